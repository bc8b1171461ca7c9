//! A device's body in the hand: mass, damping and dry friction, moved exactly under a held wrench.

use glam::DVec3;

use super::HandSettings;
use crate::error::{DeviceError, check_setting};
use crate::wrench::limit_length;

/// What a device adds at the handle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Body {
    /// Apparent mass, kg.
    pub(crate) mass: f64,
    /// Apparent moment of inertia about the handle point, kg m².
    pub(crate) inertia: f64,
    /// Viscous damping, N s/m.
    pub(crate) damping: f64,
    /// Viscous damping of a turn, N m s/rad.
    pub(crate) rotational_damping: f64,
    /// Dry friction, N, against the velocity of the handle point.
    pub(crate) coulomb_friction: f64,
}

/// A body with the hand's grip on it, and without.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldBody {
    held: Motions,
    free: Motions,
    coulomb_friction: f64,
}

#[derive(Debug, Clone, Copy)]
struct Motions {
    translation: Motion,
    rotation: Motion,
}

impl HeldBody {
    pub(super) fn new(
        body: &Body,
        hand: &HandSettings,
        period_s: f64,
    ) -> Result<Self, DeviceError> {
        let held = Motions {
            translation: Motion::new(
                body.mass + hand.apparent_mass,
                body.damping + hand.grip_damping,
                hand.grip_stiffness,
                period_s,
            )?,
            rotation: Motion::new(
                body.inertia + hand.apparent_inertia,
                body.rotational_damping + hand.grip_rotational_damping,
                hand.grip_rotational_stiffness,
                period_s,
            )?,
        };
        let free = Motions {
            translation: Motion::new(body.mass, body.damping, 0.0, period_s)?,
            rotation: Motion::new(body.inertia, body.rotational_damping, 0.0, period_s)?,
        };
        Ok(Self {
            held,
            free,
            coulomb_friction: body.coulomb_friction,
        })
    }

    /// Way (m) and velocity (m/s) after a period under a force, from an offset from the grip's rest.
    pub(super) fn translate(
        &self,
        is_held: bool,
        offset: DVec3,
        velocity: DVec3,
        force: DVec3,
    ) -> (DVec3, DVec3) {
        let motion = self.motions(is_held).translation;
        motion.step(offset, velocity, force, self.coulomb_friction)
    }

    /// Turn (rad) and angular velocity (rad/s) after a period under a torque.
    pub(super) fn turn(
        &self,
        is_held: bool,
        offset: DVec3,
        velocity: DVec3,
        torque: DVec3,
    ) -> (DVec3, DVec3) {
        let motion = self.motions(is_held).rotation;
        motion.step(offset, velocity, torque, 0.0)
    }

    fn motions(&self, is_held: bool) -> &Motions {
        if is_held { &self.held } else { &self.free }
    }
}

/// A damped mass on a spring over a period, by its matrix exponential: the same in each direction.
///
/// ```text
/// m y'' + d y' + k y = u        (Δy, v₁) = A (y₀, v₀) + g u
/// ```
#[derive(Debug, Clone, Copy)]
struct Motion {
    /// Of the way y₁ − y₀ on y₀, v₀ and u.
    way: [f64; 3],
    /// Of the velocity v₁.
    velocity: [f64; 3],
}

impl Motion {
    fn new(mass: f64, damping: f64, stiffness: f64, period_s: f64) -> Result<Self, DeviceError> {
        let rate = [
            [0.0, period_s, 0.0],
            [
                -stiffness / mass * period_s,
                -damping / mass * period_s,
                period_s / mass,
            ],
            [0.0, 0.0, 0.0],
        ];
        // Of e^A − 1, so that a way far below the offset keeps its digits.
        let [way, mut velocity, _] = exponential_less_one(&rate);
        velocity[1] += 1.0;
        let is_finite = way.iter().chain(&velocity).all(|x| x.is_finite());
        check_setting(
            "apparent mass",
            mass,
            is_finite && mass > 0.0,
            "above 0 and not too small beside grip and damping (kg, kg m²)",
        )?;
        Ok(Self { way, velocity })
    }

    /// Way and velocity after a period, with dry friction of at most `friction`.
    ///
    /// The friction is one force over the period: what would bring the mass to rest, or the most there is.
    fn step(&self, y: DVec3, v: DVec3, u: DVec3, friction: f64) -> (DVec3, DVec3) {
        let combine = |c: &[f64; 3], u: DVec3| y * c[0] + v * c[1] + u * c[2];
        let gain = self.velocity[2];
        let mut force = u;
        if friction > 0.0 && gain > 0.0 {
            force -= limit_length(combine(&self.velocity, u) / gain, friction);
        }
        (combine(&self.way, force), combine(&self.velocity, force))
    }
}

/// e^A − 1 by its series at a small part of A, and squaring: e^{2A} − 1 = E² + 2E.
fn exponential_less_one(a: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let norm = a.iter().flatten().fold(0.0_f64, |n, x| n.max(x.abs()));
    let halvings = norm.log2().ceil().clamp(0.0, 200.0) as i32 + 3;
    let small = scale(a, 0.5_f64.powi(halvings));
    let mut term = small;
    let mut sum = small;
    for k in 2..=16 {
        term = scale(&product(&term, &small), 1.0 / f64::from(k));
        sum = add(&sum, &term);
    }
    for _ in 0..halvings {
        sum = add(&product(&sum, &sum), &scale(&sum, 2.0));
    }
    sum
}

fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut c = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            c[i][j] = (0..3).map(|k| a[i][k] * b[k][j]).sum();
        }
    }
    c
}

fn add(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut c = *a;
    for i in 0..3 {
        for j in 0..3 {
            c[i][j] += b[i][j];
        }
    }
    c
}

fn scale(a: &[[f64; 3]; 3], factor: f64) -> [[f64; 3]; 3] {
    a.map(|row| row.map(|x| x * factor))
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1e-3;

    fn at(motion: &Motion, y: f64, v: f64, u: f64, friction: f64) -> (f64, f64) {
        let (way, velocity) = motion.step(DVec3::X * y, DVec3::X * v, DVec3::X * u, friction);
        (way.x, velocity.x)
    }

    #[test]
    fn free_mass_with_damping_has_its_closed_form() {
        let (m, b) = (0.25, 2.0);
        let motion = Motion::new(m, b, 0.0, T).unwrap();
        let a = (-b * T / m).exp();
        let (way, velocity) = at(&motion, 5.0, 0.3, 1.5, 0.0);
        assert!((velocity - (0.3 * a + 1.5 * (1.0 - a) / b)).abs() < 1e-15);
        let coasted = (1.0 - a) * m / b;
        assert!((way - (0.3 * coasted + 1.5 * (T - coasted) / b)).abs() < 1e-17);
    }

    #[test]
    fn mass_on_a_spring_swings_and_decays_as_the_textbook_says() {
        let (m, c, k) = (0.5_f64, 2.0, 800.0);
        let motion = Motion::new(m, c, k, T).unwrap();
        let (mut y, mut v) = (1e-3, 0.0);
        for n in 1..=2000 {
            let (way, velocity) = at(&motion, y, v, 0.0, 0.0);
            (y, v) = (y + way, velocity);
            let t = f64::from(n) * T;
            let (d, w) = (c / (2.0 * m), (k / m - (c / (2.0 * m)).powi(2)).sqrt());
            let expected = 1e-3 * (-d * t).exp() * ((w * t).cos() + d / w * (w * t).sin());
            assert!((y - expected).abs() < 1e-13, "{n}: {y} {expected}");
        }
    }

    #[test]
    fn very_stiff_grip_comes_to_rest_at_force_over_stiffness() {
        let motion = Motion::new(0.5, 1e5, 1e9, T).unwrap();
        let mut y = 0.0;
        for _ in 0..100 {
            y += at(&motion, y, 0.0, 10.0, 0.0).0;
        }
        assert!((y / 1e-8 - 1.0).abs() < 1e-6, "{y}");
    }

    #[test]
    fn dry_friction_holds_what_it_can_and_slows_the_rest() {
        let motion = Motion::new(0.1, 0.0, 0.0, T).unwrap();
        assert_eq!(at(&motion, 0.0, 0.0, 0.25, 0.26), (0.0, 0.0));
        let (way, velocity) = at(&motion, 0.0, 0.0, 0.36, 0.26);
        assert!((velocity - 0.1 / 0.1 * T).abs() < 1e-15 && way > 0.0);
        // 0.26 N take 2.6 mm/s a period from 0.1 kg, and stop it without turning it round.
        let (_, velocity) = at(&motion, 0.0, 0.01, 0.0, 0.26);
        assert!((velocity - 0.0074).abs() < 1e-15);
        assert!(at(&motion, 0.0, 0.002, 0.0, 0.26).1.abs() < 1e-18);
    }

    #[test]
    fn mass_of_zero_is_refused() {
        assert!(Motion::new(0.0, 1.0, 0.0, T).is_err());
        assert!(Motion::new(f64::NAN, 1.0, 0.0, T).is_err());
    }
}
