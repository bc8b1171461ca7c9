//! How often the guard stepped in, by kind.

/// How often the guard stepped in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SafetyEvents {
    /// Samples that never came: the device failed to read.
    pub samples_missing: u64,
    /// Samples with a number that is not finite.
    pub samples_non_finite: u64,
    /// Samples whose quaternion is not of unit length.
    pub samples_non_unit: u64,
    /// Samples too far from the last good one, or with too high a velocity.
    pub samples_too_fast: u64,
    /// Samples with a time before the last good one's.
    pub samples_back_in_time: u64,
    /// Wrenches from the simulation that were not finite.
    pub wrenches_non_finite: u64,
    /// Wrenches shortened to the largest force or torque.
    pub wrenches_clamped: u64,
    /// Wrenches held back by the largest rate.
    pub wrenches_rate_limited: u64,
    /// Stalls of the loop long enough to make the wrench stale.
    pub stalls: u64,
    /// Wrenches to which damping was added because more energy had come out than gone in.
    pub passivity_damped: u64,
    /// Wrenches shortened because the energy that came out was near its allowance.
    pub energy_limited: u64,
    /// Forces shortened to what the heat of the motors allowed.
    pub heat_limited: u64,
    /// Wrenches weakened because the simulation's answer was old.
    pub answers_stale: u64,
    /// Stiffnesses beside a wrench that were beyond the largest.
    pub stiffness_limited: u64,
    /// Times the force was cut because the device was no longer ready.
    pub trips_not_ready: u64,
    /// Times the force was cut because no hand held the handle.
    pub trips_hand_absent: u64,
    /// Times the force was cut because no good sample came.
    pub trips_samples_lost: u64,
    /// Times the force was cut because the handle was too fast.
    pub trips_too_fast: u64,
    /// Times the force was cut because the loop stood still.
    pub trips_stalled: u64,
}

impl SafetyEvents {
    /// Samples rejected for any reason.
    #[must_use]
    pub fn samples_rejected(&self) -> u64 {
        self.samples_missing
            + self.samples_non_finite
            + self.samples_non_unit
            + self.samples_too_fast
            + self.samples_back_in_time
    }

    /// Times the force was cut and had to be armed again, for any reason.
    #[must_use]
    pub fn trips(&self) -> u64 {
        self.trips_not_ready
            + self.trips_hand_absent
            + self.trips_samples_lost
            + self.trips_too_fast
            + self.trips_stalled
    }
}
