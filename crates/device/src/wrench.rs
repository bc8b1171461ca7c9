//! Wrenches and rotation vectors: the conventions of this crate.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use glam::{DQuat, DVec3};

/// A force and a torque about a stated point.
///
/// Within this crate the point is the handle point (the origin of the handle's pose) and the axes are
/// those of the device's frame, unless said otherwise. On whom the wrench acts is in the name of the
/// variable or function.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// Force, N.
    pub force: DVec3,
    /// Torque about the reference point, N m.
    pub torque: DVec3,
}

impl Wrench {
    /// No force, no torque.
    pub const ZERO: Self = Self {
        force: DVec3::ZERO,
        torque: DVec3::ZERO,
    };

    /// A wrench from its force (N) and its torque about the reference point (N m).
    #[must_use]
    pub const fn new(force: DVec3, torque: DVec3) -> Self {
        Self { force, torque }
    }

    /// The same wrench about another point.
    ///
    /// ```text
    /// t_to = t_from + (from − to) × f
    /// ```
    #[must_use]
    pub fn about(&self, from: DVec3, to: DVec3) -> Self {
        Self {
            force: self.force,
            torque: self.torque + (from - to).cross(self.force),
        }
    }

    /// Are all six components finite?
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.force.is_finite() && self.torque.is_finite()
    }

    /// `[f_x, f_y, f_z, t_x, t_y, t_z]`, N and N m.
    #[must_use]
    pub fn to_array(&self) -> [f64; 6] {
        let (f, t) = (self.force, self.torque);
        [f.x, f.y, f.z, t.x, t.y, t.z]
    }

    /// From `[f_x, f_y, f_z, t_x, t_y, t_z]`, N and N m.
    #[must_use]
    pub fn from_array(a: &[f64; 6]) -> Self {
        Self {
            force: DVec3::new(a[0], a[1], a[2]),
            torque: DVec3::new(a[3], a[4], a[5]),
        }
    }
}

impl Add for Wrench {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.force + other.force, self.torque + other.torque)
    }
}

impl AddAssign for Wrench {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Wrench {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.force - other.force, self.torque - other.torque)
    }
}

impl Neg for Wrench {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.force, -self.torque)
    }
}

impl Mul<f64> for Wrench {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.force * factor, self.torque * factor)
    }
}

/// Rotation vector of a unit quaternion: axis times angle, rad, with the angle in [0, π].
///
/// Keeps full relative accuracy down to the smallest rotations.
#[must_use]
pub fn rotation_vector(rotation: DQuat) -> DVec3 {
    // q and -q are the same rotation; the one with w >= 0 has the angle within [0, pi].
    let sign = if rotation.w < 0.0 { -1.0 } else { 1.0 };
    let vector = DVec3::new(rotation.x, rotation.y, rotation.z) * sign;
    let w = rotation.w * sign;
    let sine = vector.length();
    if sine == 0.0 {
        return vector * 2.0;
    }
    vector * (2.0 * sine.atan2(w) / sine)
}

/// Unit quaternion of a rotation vector (rad): the inverse of [`rotation_vector`] below an angle of π.
#[must_use]
pub fn rotation_from_vector(vector: DVec3) -> DQuat {
    let angle = vector.length();
    let half = 0.5 * angle;
    let factor = if angle == 0.0 {
        0.5
    } else {
        half.sin() / angle
    };
    let v = vector * factor;
    DQuat::from_xyzw(v.x, v.y, v.z, half.cos())
}

/// `v`, shortened to `limit` if it is longer, in the same direction. Safe against overflow of the square.
pub(crate) fn limit_length(v: DVec3, limit: f64) -> DVec3 {
    let largest = v.abs().max_element();
    if largest == 0.0 {
        return v;
    }
    let scaled = v / largest;
    let length = scaled.length();
    if length * largest <= limit {
        v
    } else {
        scaled * (limit / length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrench_about_another_point_has_the_lever_torque() {
        // 2 N along +y at x = 3 m gives +6 N m about z at the origin.
        let at_point = Wrench::new(DVec3::new(0.0, 2.0, 0.0), DVec3::ZERO);
        let at_origin = at_point.about(DVec3::new(3.0, 0.0, 0.0), DVec3::ZERO);
        assert_eq!(at_origin.torque, DVec3::new(0.0, 0.0, 6.0));
        let back = at_origin.about(DVec3::ZERO, DVec3::new(3.0, 0.0, 0.0));
        assert_eq!(back, at_point);
    }

    #[test]
    fn wrench_arithmetic_and_array_agree() {
        let a = Wrench::from_array(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let mut b = a * 2.0 - a;
        assert_eq!(b, a);
        b += -a;
        assert_eq!(b, Wrench::ZERO);
        assert_eq!((a + a).to_array(), [2.0, 4.0, 6.0, 8.0, 10.0, 12.0]);
    }

    #[test]
    fn wrench_with_one_nan_is_not_finite() {
        for i in 0..6 {
            let mut a = [0.0; 6];
            a[i] = f64::NAN;
            assert!(!Wrench::from_array(&a).is_finite());
        }
        assert!(Wrench::ZERO.is_finite());
    }

    #[test]
    fn rotation_vector_inverts_the_exponential() {
        let axis = DVec3::new(1.0, -2.0, 0.5).normalize();
        for angle in [0.0, 1e-200, 1e-12, 1e-5, 0.3, 1.5, 3.0, 3.13] {
            let vector = axis * angle;
            let there = rotation_vector(rotation_from_vector(vector));
            assert!(
                (there - vector).length() <= 1e-14 * angle.max(1e-300) + 1e-15 * angle,
                "angle {angle}: {there}"
            );
            // The other quaternion of the same rotation has the same vector.
            let other = rotation_vector(-rotation_from_vector(vector));
            assert!((other - vector).length() <= 1e-14 * angle);
        }
    }

    #[test]
    fn limit_length_keeps_direction_even_where_the_square_overflows() {
        let long = DVec3::new(3e200, 4e200, 0.0);
        let limited = limit_length(long, 10.0);
        assert!((limited - DVec3::new(6.0, 8.0, 0.0)).length() < 1e-12);
        let short = DVec3::new(0.3, 0.4, 0.0);
        assert_eq!(limit_length(short, 10.0), short);
        assert_eq!(limit_length(DVec3::ZERO, 0.0), DVec3::ZERO);
    }
}
