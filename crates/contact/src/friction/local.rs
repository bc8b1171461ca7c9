//! One contact, the others standing still: u = b + W λ with a 3 x 3 W, solved exactly.

use super::{State, cone};
use crate::lcp::Scalar;

/// The contact's own part of the problem.
pub(super) struct Local<T> {
    /// W, symmetric.
    pub(super) w: [[T; 3]; 3],
    /// Gap and slip without force at this contact, m.
    pub(super) b: [T; 3],
    pub(super) friction_coefficient: T,
}

/// Force, what the contact does, and the direction of slip if it slips.
pub(super) struct Answer<T> {
    pub(super) force: [T; 3],
    pub(super) state: State,
    pub(super) direction: [T; 2],
}

impl<T: Scalar> Local<T> {
    /// `direction`: where slip was going, a unit vector or zero.
    pub(super) fn solve(&self, direction: [T; 2]) -> Answer<T> {
        let answer = |force, state, direction| Answer {
            force,
            state,
            direction,
        };
        if self.b[0] >= T::zero() {
            return answer([T::zero(); 3], State::Open, direction);
        }
        let mu = self.friction_coefficient;
        if let Some(stick) = self.stick()
            && cone::tangential(&stick) <= mu * stick[0]
        {
            return answer(stick, State::Stick, direction);
        }
        if mu <= T::zero() {
            let normal = -self.b[0] / self.w[0][0];
            return answer([normal, T::zero(), T::zero()], State::Slip, direction);
        }
        if let Some((force, direction)) = self.slip(direction) {
            return answer(force, State::Slip, direction);
        }
        answer(self.projected(), State::Slip, direction)
    }

    /// The force that stops all motion, -W⁻¹ b. None where W is singular.
    fn stick(&self) -> Option<[T; 3]> {
        let w = &self.w;
        let minor = |a: usize, b: usize, c: usize, d: usize| w[a][c] * w[b][d] - w[a][d] * w[b][c];
        let first_row = [minor(1, 2, 1, 2), -minor(1, 2, 0, 2), minor(1, 2, 0, 1)];
        let determinant = w[0][0] * first_row[0] + w[0][1] * first_row[1] + w[0][2] * first_row[2];
        let size = w[0][0] * w[1][1] * w[2][2];
        if determinant <= T::of(64.0) * T::epsilon() * size {
            return None;
        }
        let adjugate = [
            first_row,
            [first_row[1], minor(0, 2, 0, 2), -minor(0, 2, 0, 1)],
            [first_row[2], -minor(0, 2, 0, 1), minor(0, 1, 0, 1)],
        ];
        Some(adjugate.map(|row| {
            -(row[0] * self.b[0] + row[1] * self.b[1] + row[2] * self.b[2]) / determinant
        }))
    }

    /// A force on the cone with a closed gap and slip against its tangential part.
    ///
    /// With slip along d the force is l (1, -μ d), the closed gap gives l, and what remains is that u_t is along d: one
    /// equation for the angle, a trigonometric polynomial of degree two.
    fn slip(&self, direction: [T; 2]) -> Option<([T; 3], [T; 2])> {
        /// Intervals in which a change of sign is looked for. The polynomial has at most four roots.
        const INTERVALS: usize = 24;
        if direction != [T::zero(); 2]
            && let Some(found) = self.newton(direction)
        {
            return Some(found);
        }
        let mut best: Option<([T; 3], [T; 2], T)> = None;
        let step = T::of(std::f64::consts::TAU / INTERVALS as f64);
        // Off the axes, where symmetric problems have their roots.
        let angle = |k: usize| step * T::of(k as f64 + 0.381_966);
        let mut left = self.turning(unit(angle(0)));
        for k in 0..INTERVALS {
            let right = self.turning(unit(angle(k + 1)));
            if (left > T::zero()) != (right > T::zero()) {
                let d = self.bisect(angle(k), angle(k + 1), left > T::zero());
                if let Some((force, power)) = self.force_along(d)
                    && best.as_ref().is_none_or(|(_, _, most)| power > *most)
                {
                    best = Some((force, d, power));
                }
            }
            left = right;
        }
        best.map(|(force, d, _)| (force, d))
    }

    /// From the direction of the last sweep. None unless it ends at a root that is a slip.
    fn newton(&self, direction: [T; 2]) -> Option<([T; 3], [T; 2])> {
        const MAX_STEPS: usize = 6;
        let mut d = direction;
        for _ in 0..MAX_STEPS {
            let slope = self.turning_slope(d);
            let step = -self.turning(d) / slope;
            if num_traits::Float::abs(step).is_nan() || num_traits::Float::abs(step) > T::one() {
                return None;
            }
            let (x, y) = (d[0] - step * d[1], d[1] + step * d[0]);
            let length = x.hypot(y);
            d = [x / length, y / length];
            if num_traits::Float::abs(step) <= T::of(4.0) * T::epsilon() {
                break;
            }
        }
        self.force_along(d).map(|(force, _)| (force, d))
    }

    fn bisect(&self, left: T, right: T, is_left_positive: bool) -> [T; 2] {
        /// Halvings: as many as there are digits.
        const HALVINGS: usize = 54;
        let (mut left, mut right) = (left, right);
        for _ in 0..HALVINGS {
            let middle = T::of(0.5) * (left + right);
            if middle <= left || middle >= right {
                break;
            }
            if (self.turning(unit(middle)) > T::zero()) == is_left_positive {
                left = middle;
            } else {
                right = middle;
            }
        }
        unit(T::of(0.5) * (left + right))
    }

    /// How the gap opens with a unit of force along (1, -μ d).
    fn opening(&self, d: [T; 2]) -> T {
        let mu = self.friction_coefficient;
        self.w[0][0] - mu * (self.w[0][1] * d[0] + self.w[0][2] * d[1])
    }

    /// Slip for a unit of force along (1, -μ d).
    fn slip_per_force(&self, d: [T; 2]) -> [T; 2] {
        let mu = self.friction_coefficient;
        [1, 2].map(|k| self.w[k][0] - mu * (self.w[k][1] * d[0] + self.w[k][2] * d[1]))
    }

    /// d x u_t times the opening: zero where slip is along d.
    fn turning(&self, d: [T; 2]) -> T {
        let b = [self.b[1], self.b[2]];
        self.opening(d) * cross(d, b) - self.b[0] * cross(d, self.slip_per_force(d))
    }

    /// Derivative of [`Local::turning`] with the angle of d.
    fn turning_slope(&self, d: [T; 2]) -> T {
        let mu = self.friction_coefficient;
        let turned = [-d[1], d[0]];
        let b = [self.b[1], self.b[2]];
        let opening_slope = -mu * (self.w[0][1] * turned[0] + self.w[0][2] * turned[1]);
        let slip_slope =
            [1, 2].map(|k| -mu * (self.w[k][1] * turned[0] + self.w[k][2] * turned[1]));
        opening_slope * cross(d, b) + self.opening(d) * cross(turned, b)
            - self.b[0] * (cross(turned, self.slip_per_force(d)) + cross(d, slip_slope))
    }

    /// The force for slip along d and how fast it slips. None if it would pull, or push the slip on.
    fn force_along(&self, d: [T; 2]) -> Option<([T; 3], T)> {
        let opening = self.opening(d);
        if opening <= T::zero() {
            return None;
        }
        let normal = -self.b[0] / opening;
        let slip = self.slip_per_force(d);
        let along = d[0] * (self.b[1] + normal * slip[0]) + d[1] * (self.b[2] + normal * slip[1]);
        let drag = -self.friction_coefficient * normal;
        (along >= T::zero() && num_traits::Float::is_finite(normal))
            .then_some(([normal, drag * d[0], drag * d[1]], along))
    }

    /// Where no slip was found (wedged, or singular W): the fixed point of projected steps, as near as they come.
    fn projected(&self) -> [T; 3] {
        const STEPS: usize = 50;
        let mu = self.friction_coefficient;
        let trace = self.w[0][0] + self.w[1][1] + self.w[2][2];
        let mut force = [T::zero(); 3];
        for _ in 0..STEPS {
            let mut u = [0, 1, 2].map(|k| {
                let w = &self.w[k];
                self.b[k] + w[0] * force[0] + w[1] * force[1] + w[2] * force[2]
            });
            u[0] += mu * u[1].hypot(u[2]);
            let trial = [0, 1, 2].map(|k| force[k] - u[k] / trace);
            force = cone::project(&trial, mu);
        }
        force
    }
}

fn unit<T: Scalar>(angle: T) -> [T; 2] {
    let (sin, cos) = num_traits::Float::sin_cos(angle);
    [cos, sin]
}

fn cross<T: Scalar>(a: [T; 2], b: [T; 2]) -> T {
    a[0] * b[1] - a[1] * b[0]
}
