//! The faces that the held body slides on, read off the contact forces, and what friction does on them.

use glam::DVec3;

use crate::engine::ActiveContact;

/// rad: a face that rises by less is level.
const LEVEL: f64 = 0.0175;
/// rad: a face steeper than that stops a body that does not pass it, and is no ramp (75 degrees).
const HEAD_ON: f64 = 1.309;

/// The contacts of one moment as one ramp: what they press with across and along the way of the held body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ramp {
    /// N, across the way, summed over all sides.
    across: f64,
    /// N, against the motion.
    along: f64,
}

impl Ramp {
    /// Of these contacts, for a tool that moves along the unit vector `way` against the part.
    pub fn of(contacts: &[ActiveContact], way: DVec3) -> Self {
        contacts.iter().fold(Self::default(), |ramp, c| {
            let along = c.force_on_part.dot(way);
            let across = (c.force_on_part - along * way).length();
            Self {
                // Shares of a force between nodes may cancel.
                across: ramp.across + across.copysign(c.normal_force),
                along: ramp.along + along,
            }
        })
    }

    /// One face that rises by `angle` (rad) and is pressed with `normal` (N).
    pub fn face(angle: f64, normal: f64) -> Self {
        Self {
            across: normal * angle.cos(),
            along: normal * angle.sin(),
        }
    }

    /// The same faces on the way back.
    pub fn reversed(self) -> Self {
        Self {
            along: -self.along,
            ..self
        }
    }

    /// N, against the motion without friction.
    pub fn along(&self) -> f64 {
        self.along
    }

    /// rad, of the face that stands for all; below 0 where the part pulls. `None` without force.
    pub fn angle(&self) -> Option<f64> {
        (self.across > 0.0 || self.along != 0.0).then(|| self.along.atan2(self.across))
    }

    /// Whether it hardly rises.
    pub fn is_level(&self) -> bool {
        self.angle().is_some_and(|a| a < LEVEL)
    }

    /// Whether it is rather a stop than a ramp.
    pub fn is_head_on(&self) -> bool {
        self.angle().is_some_and(|a| a > HEAD_ON)
    }

    /// Whether no force along the way moves the body over: the face's angle and that of friction make a right angle.
    pub fn locks(&self, coefficient: f64) -> bool {
        self.angle()
            .is_some_and(|a| a + coefficient.atan() >= std::f64::consts::FRAC_PI_2)
    }

    /// N that Coulomb's friction adds while the part is bent as it is: what presses across stays, so the force along the
    /// way grows from tan(a) to tan(a + phi) of it. `None` where the face locks.
    pub fn friction(&self, coefficient: f64) -> Option<f64> {
        let a = self.angle().unwrap_or(0.0);
        (!self.locks(coefficient))
            .then(|| self.across * (a + coefficient.atan()).tan() - self.along)
    }

    /// Coefficient from which friction adds this share of the force.
    pub fn coefficient_for(&self, share: f64) -> Option<f64> {
        let a = self.angle().filter(|a| *a > 0.0)?;
        Some((((1.0 + share) * a.tan()).atan() - a).tan())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(force: DVec3) -> ActiveContact {
        ActiveContact {
            candidate: 0,
            normal_force: force.length(),
            force_on_part: force,
            sticks: false,
        }
    }

    #[test]
    fn the_angle_is_that_of_the_face_whichever_side_it_is_on() {
        let (sin, cos) = 30f64.to_radians().sin_cos();
        let both = [
            contact(3.0 * DVec3::new(cos, -sin, 0.0)),
            contact(3.0 * DVec3::new(-cos, -sin, 0.0)),
        ];
        let ramp = Ramp::of(&both, DVec3::NEG_Y);
        assert!((ramp.angle().unwrap() - 30f64.to_radians()).abs() < 1e-12);
        assert!((ramp.along() - 3.0).abs() < 1e-12);
        let back = ramp.reversed().angle().unwrap();
        assert!((back + 30f64.to_radians()).abs() < 1e-12);
        assert_eq!(Ramp::default().angle(), None);
    }

    #[test]
    fn friction_on_one_face_is_the_handbooks_factor() {
        for degrees in [15.0f64, 30.0, 45.0, -30.0] {
            for mu in [0.05f64, 0.2, 0.6] {
                let a = degrees.to_radians();
                let ramp = Ramp::face(a, 2.0);
                let handbook = 2.0 * a.cos() * (a + mu.atan()).tan();
                let ours = ramp.along() + ramp.friction(mu).unwrap();
                assert!((ours / handbook - 1.0).abs() < 1e-12, "{degrees} {mu}");
            }
        }
    }

    #[test]
    fn a_level_face_has_the_friction_of_what_presses() {
        let ramp = Ramp::face(1e-4, 5.0);
        assert!(ramp.is_level() && !Ramp::face(0.018, 5.0).is_level());
        assert!((ramp.friction(0.3).unwrap() - 1.5).abs() < 1e-3);
    }

    #[test]
    fn a_face_locks_where_its_angle_and_frictions_make_a_right_angle() {
        // atan 0.6 is 30.96 degrees.
        let at = |degrees: f64| Ramp::face(degrees.to_radians(), 1.0);
        assert!(!at(59.0).locks(0.6) && at(59.0).friction(0.6).is_some());
        assert!(at(59.1).locks(0.6) && at(59.1).friction(0.6).is_none());
        assert!(at(76.0).is_head_on() && !at(74.0).is_head_on());
    }

    #[test]
    fn the_coefficient_for_a_tenth_gives_a_tenth() {
        let ramp = Ramp::face(30f64.to_radians(), 4.0);
        let mu = ramp.coefficient_for(0.1).unwrap();
        assert!((mu - 0.0423).abs() < 1e-4, "{mu}");
        assert!((ramp.friction(mu).unwrap() / ramp.along() - 0.1).abs() < 1e-12);
        assert_eq!(Ramp::face(-0.1, 1.0).coefficient_for(0.1), None);
    }
}
