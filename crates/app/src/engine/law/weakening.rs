//! Way slipped by contact, where static friction differs from kinetic.
//!
//! The coefficient of a step is that of the way slipped before it, so that the step stays one convex problem after the
//! other; what slips in the step counts from the next on (an error of first order in the step, as the increment's own). A
//! contact that sticks for a step is at rest again. One that is new has slipped as far as those have that carry force, by
//! the mean of their ways weighted with their forces: as a body slides on, its contacts move from place to place, and none
//! of them is at rest.

use contact::friction::Coefficients;

#[derive(Debug)]
pub(super) struct Weakening {
    coefficients: Coefficients,
    /// By key: slipped since it last stuck until the last step ended, m; NaN where there was no contact.
    slipped: Vec<f64>,
    known: Vec<u32>,
    /// m, of the known ones, weighted with their forces.
    mean: f64,
    /// Of the last pass.
    ended: Vec<Ended>,
}

/// A contact that carried force.
#[derive(Clone, Copy, Debug)]
struct Ended {
    key: u32,
    /// N.
    normal_force: f64,
    /// m, since it last stuck.
    slipped: f64,
}

impl Weakening {
    pub(super) fn new(coefficients: Coefficients, n_keys: usize, max_near: usize) -> Self {
        Self {
            coefficients,
            slipped: vec![f64::NAN; n_keys],
            known: Vec::with_capacity(max_near),
            mean: 0.0,
            ended: Vec::with_capacity(max_near),
        }
    }

    /// What the last pass left is what has slipped. Twice is as once.
    pub(super) fn end_step(&mut self) {
        for key in self.known.drain(..) {
            self.slipped[key as usize] = f64::NAN;
        }
        let (mut sum, mut force) = (0.0, 0.0);
        for ended in &self.ended {
            self.slipped[ended.key as usize] = ended.slipped;
            self.known.push(ended.key);
            sum += ended.normal_force * ended.slipped;
            force += ended.normal_force;
        }
        self.mean = if force > 0.0 { sum / force } else { 0.0 };
    }

    /// No contact carries force yet.
    pub(super) fn begin_pass(&mut self) {
        self.ended.clear();
    }

    /// A contact with its normal force (N) and what it slipped since the step began (m); `None`: it sticks.
    pub(super) fn end_pass(&mut self, key: u32, normal_force: f64, slip: Option<f64>) {
        let slipped = slip.map_or(0.0, |slip| self.before(key) + slip);
        self.ended.push(Ended {
            key,
            normal_force,
            slipped,
        });
    }

    /// Of a contact in this step.
    pub(super) fn coefficient(&self, key: u32) -> f64 {
        self.coefficients.after(self.before(key))
    }

    /// m, slipped until the last step ended.
    fn before(&self, key: u32) -> f64 {
        let slipped = self.slipped[key as usize];
        if slipped.is_nan() { self.mean } else { slipped }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_weakens_as_it_slips_and_is_at_rest_again_once_it_sticks() {
        let mut weakening = Weakening::new(
            Coefficients {
                static_coefficient: 0.5,
                kinetic_coefficient: 0.25,
                weakening_distance: 1e-4,
            },
            3,
            3,
        );
        let step = |weakening: &mut Weakening, contacts: &[(u32, f64, Option<f64>)]| {
            weakening.end_step();
            weakening.begin_pass();
            for &(key, force, slip) in contacts {
                weakening.end_pass(key, force, slip);
            }
            weakening.end_step();
        };
        assert_eq!(weakening.coefficient(0), 0.5);
        step(&mut weakening, &[(0, 1.0, Some(4e-5)), (1, 3.0, None)]);
        assert!((weakening.coefficient(0) - 0.4).abs() < 1e-12);
        assert_eq!(weakening.coefficient(1), 0.5);
        // A new one: a quarter of the force has slipped 40 um.
        assert!((weakening.coefficient(2) - 0.475).abs() < 1e-12);
        step(&mut weakening, &[(0, 1.0, Some(4e-5)), (2, 1.0, Some(0.0))]);
        assert!((weakening.coefficient(0) - 0.3).abs() < 1e-12);
        assert!((weakening.coefficient(2) - 0.475).abs() < 1e-12);
        step(&mut weakening, &[(0, 1.0, None)]);
        assert_eq!(weakening.coefficient(0), 0.5);
        // All apart: at rest.
        step(&mut weakening, &[]);
        assert_eq!(weakening.coefficient(2), 0.5);
    }
}
