//! How stiff a sampled wall may be before the device shakes: the edge of stability, and the bounds of the literature.
//!
//! ```text
//! m x'' + b x' = F        F_n = −K x_{n−d} − B (x_{n−d} − x_{n−d−1})/T, held for a period T
//! ```
//! m mass (kg), b damping (N s/m) of the device, K stiffness (N/m), B damping (N s/m) of the wall, d delay in periods.
//! The device is taken without dry friction, encoder and hand, so this is where it would shake alone: a hand adds
//! damping, as a rule, and an encoder takes some away ([`largest_stiffness_for_friction`]).
//!
//! Sources: Colgate and Schenkel 1997 (passivity), Gil et al. 2009 (delay), Abbott and Okamura 2005 (encoder).

use crate::coupling::{largest_stiffness_for_damping, largest_stiffness_for_friction};
use crate::driver::simulated::Model;

/// Longest delay that is computed, in periods: 0.1 s at 1 kHz. Beyond it no wall is worth rendering.
const DELAY_MAX: u32 = 100;

/// Most coefficients of the characteristic polynomial.
const COEFFICIENTS_MAX: usize = DELAY_MAX as usize + 4;

/// Steps per decade in which the first unstable stiffness is looked for.
const STEPS_PER_DECADE: i32 = 10;

/// Decades that are looked through below the stiffness at which nothing is stable.
const DECADES: i32 = 9;

/// What moves at the handle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plant {
    /// Apparent mass m, kg, above 0.
    pub mass: f64,
    /// Viscous damping b, N s/m, 0 or above.
    pub damping: f64,
    /// Delay between the sample and its force, d, in periods; 100 at most.
    pub delay_periods: u32,
}

/// A damping of the wall and how stiff the wall may be with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZPoint {
    /// B, N s/m.
    pub virtual_damping: f64,
    /// Stiffness at which the device begins to shake, N/m; 0 where it always does.
    pub critical: f64,
    /// 2(b − |B|)/T, N/m: the wall is passive below; `None` with delay, for which the bound does not hold.
    pub passive: Option<f64>,
    /// (b + B)/(T/2 + dT), N/m: the edge as it is estimated by hand.
    pub rule_of_thumb: f64,
}

/// The walls that a device can render at a period: the region below the points.
#[derive(Debug, Clone, PartialEq)]
pub struct ZWidth {
    /// From B = 0 to where no stiffness is stable any more.
    pub points: Vec<ZPoint>,
    /// 2c/Δ, N/m: above it the steps of the encoder buzz; `None` where friction or step are not known.
    pub friction_bound: Option<f64>,
    /// Delay that was assumed, in periods.
    pub delay_periods: u32,
}

/// The stiffness at which a sampled wall on the plant becomes unstable, N/m; 0 where it always is, or where the input
/// makes no sense.
///
/// Exact but for rounding: the characteristic polynomial is that of the exact zero-order hold, and its roots are held
/// against the unit circle by the Schur–Cohn recursion. Allocates nothing; some 10 µs.
#[must_use]
pub fn critical_stiffness(plant: &Plant, virtual_damping: f64, period_s: f64) -> f64 {
    let makes_sense = plant.mass.is_finite()
        && plant.mass > 0.0
        && plant.damping.is_finite()
        && plant.damping >= 0.0
        && virtual_damping.is_finite()
        && period_s.is_finite()
        && period_s > 0.0
        && plant.delay_periods <= DELAY_MAX;
    if !makes_sense {
        return 0.0;
    }
    let wall = Wall::new(plant, virtual_damping, period_s);
    // Beyond, a period's force alone throws the mass further back than it came.
    let per_period = 2.0 * (plant.damping + virtual_damping.abs()) / period_s;
    let most = 8.0 * plant.mass / (period_s * period_s) + 2.0 * per_period;
    let step = 10_f64.powf(1.0 / f64::from(STEPS_PER_DECADE));
    let mut stable = most * 10_f64.powi(-DECADES);
    if !wall.is_stable(stable) {
        return 0.0;
    }
    let mut unstable = stable * step;
    while wall.is_stable(unstable) {
        if unstable > most {
            return unstable;
        }
        stable = unstable;
        unstable *= step;
    }
    while unstable - stable > 1e-12 * unstable {
        let middle = 0.5 * (stable + unstable);
        if middle <= stable || middle >= unstable {
            break;
        }
        if wall.is_stable(middle) {
            stable = middle;
        } else {
            unstable = middle;
        }
    }
    0.5 * (stable + unstable)
}

/// The walls that a simulated model can render at a period (s), in `n_points` dampings, two at least.
#[must_use]
pub fn z_width(model: &Model, period_s: f64, n_points: usize) -> ZWidth {
    let plant = model.plant(period_s);
    let most = largest_virtual_damping(&plant, period_s);
    let n_points = n_points.max(2);
    let points = (0..n_points)
        .map(|k| {
            let share = k as f64 / (n_points - 1) as f64;
            point(&plant, most * share, period_s)
        })
        .collect();
    let friction_bound = match model.limits.coulomb_friction {
        Some(friction) if model.limits.position_resolution > 0.0 => Some(
            largest_stiffness_for_friction(friction, model.limits.position_resolution),
        ),
        _ => None,
    };
    ZWidth {
        points,
        friction_bound,
        delay_periods: plant.delay_periods,
    }
}

fn point(plant: &Plant, virtual_damping: f64, period_s: f64) -> ZPoint {
    let b = plant.damping;
    let held = 0.5 * period_s + f64::from(plant.delay_periods) * period_s;
    ZPoint {
        virtual_damping,
        critical: critical_stiffness(plant, virtual_damping, period_s),
        passive: (plant.delay_periods == 0)
            .then(|| largest_stiffness_for_damping(b, virtual_damping, period_s)),
        rule_of_thumb: (b + virtual_damping) / held,
    }
}

/// The damping of a wall at which no stiffness is stable any more, N s/m.
fn largest_virtual_damping(plant: &Plant, period_s: f64) -> f64 {
    let is_stable = |damping: f64| critical_stiffness(plant, damping, period_s) > 0.0;
    // A sampled damper alone moves the velocity by at most 2 m/T in a period.
    let (mut stable, mut unstable) = (0.0, 4.0 * plant.mass / period_s + 2.0 * plant.damping);
    for _ in 0..40 {
        let middle = 0.5 * (stable + unstable);
        if is_stable(middle) {
            stable = middle;
        } else {
            unstable = middle;
        }
    }
    stable
}

/// The loop as a polynomial in z, linear in K.
///
/// ```text
/// z^{d+1} (z − 1)(z − a) + (g_x (z − a) + t_v g_v)((K + B/T) z − B/T) = 0        a = e^{−bT/m}
/// ```
/// g_x (m/N) and g_v (m/(N s)): way and velocity after a period of 1 N from rest; t_v (s): way of a velocity of 1 m/s.
struct Wall {
    a: f64,
    way: f64,
    coasted: f64,
    damping: f64,
    period_s: f64,
    delay: usize,
}

impl Wall {
    fn new(plant: &Plant, damping: f64, period_s: f64) -> Self {
        let held = held_force(plant.mass, plant.damping, period_s);
        Self {
            a: held.kept,
            way: held.way,
            coasted: held.coasted * held.speed,
            damping,
            period_s,
            delay: plant.delay_periods as usize,
        }
    }

    fn is_stable(&self, stiffness: f64) -> bool {
        let mut p = [0.0; COEFFICIENTS_MAX];
        let n = self.delay + 3;
        p[n] = 1.0;
        p[n - 1] = -(1.0 + self.a);
        p[n - 2] = self.a;
        let newest = stiffness + self.damping / self.period_s;
        let before = self.damping / self.period_s;
        let rest = self.coasted - self.way * self.a;
        p[2] += self.way * newest;
        p[1] += rest * newest - self.way * before;
        p[0] -= rest * before;
        all_inside_unit_circle(&mut p[..=n])
    }
}

/// How a mass with damping answers to a force that is held for a period.
struct HeldForce {
    /// Part of the velocity that is left.
    kept: f64,
    /// Velocity after 1 N from rest, m/(N s).
    speed: f64,
    /// Way after 1 N from rest, m/N.
    way: f64,
    /// Way of a velocity of 1 m/s without force, s.
    coasted: f64,
}

fn held_force(mass: f64, damping: f64, period_s: f64) -> HeldForce {
    let x = damping * period_s / mass;
    // (1 − e⁻ˣ)/x and (x − 1 + e⁻ˣ)/x², by their series where the formulas lose digits.
    let (first, second) = if x < 1e-2 {
        (
            1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0))),
            0.5 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0)))),
        )
    } else {
        let lost = -(-x).exp_m1();
        (lost / x, (x - lost) / (x * x))
    };
    HeldForce {
        kept: (-x).exp(),
        speed: first * period_s / mass,
        way: second * period_s * period_s / mass,
        coasted: first * period_s,
    }
}

/// Are all roots of Σ p_i zⁱ inside the unit circle? By the Schur–Cohn recursion, in place.
fn all_inside_unit_circle(p: &mut [f64]) -> bool {
    let mut n = p.len() - 1;
    while n > 0 {
        let ratio = p[0] / p[n];
        if ratio.is_nan() || ratio.abs() >= 1.0 {
            return false;
        }
        // p ← (p − ratio p*)/z with p* the reversed polynomial.
        for i in 1..=n / 2 {
            let j = n - i;
            let (low, high) = (p[i], p[j]);
            p[i] = low - ratio * high;
            p[j] = high - ratio * low;
        }
        p[n] -= ratio * p[0];
        p.copy_within(1..=n, 0);
        n -= 1;
    }
    true
}

#[cfg(test)]
mod tests;
