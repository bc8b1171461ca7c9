//! One contact, the others standing still: u = b + W λ with a 3 x 3 W, solved exactly.

use super::{State, cone};

/// The contact's own part of the problem.
pub(super) struct Local {
    /// W, symmetric.
    pub(super) w: [[f64; 3]; 3],
    /// Gap and slip without force at this contact, m.
    pub(super) b: [f64; 3],
    pub(super) friction_coefficient: f64,
}

/// Force, what the contact does, and the direction of slip if it slips.
pub(super) struct Answer {
    pub(super) force: [f64; 3],
    pub(super) state: State,
    pub(super) direction: [f64; 2],
}

impl Local {
    /// `direction`: where slip was going, a unit vector or zero.
    pub(super) fn solve(&self, direction: [f64; 2]) -> Answer {
        let answer = |force, state, direction| Answer {
            force,
            state,
            direction,
        };
        if self.b[0] >= 0.0 {
            return answer([0.0; 3], State::Open, direction);
        }
        let mu = self.friction_coefficient;
        if let Some(stick) = self.stick()
            && cone::tangential(&stick) <= mu * stick[0]
        {
            return answer(stick, State::Stick, direction);
        }
        if mu <= 0.0 {
            let normal = -self.b[0] / self.w[0][0];
            return answer([normal, 0.0, 0.0], State::Slip, direction);
        }
        if let Some((force, direction)) = self.slip(direction) {
            return answer(force, State::Slip, direction);
        }
        answer(self.projected(), State::Slip, direction)
    }

    /// The force that stops all motion, W λ = -b; of several the one with the least tangential part. None if there is none.
    fn stick(&self) -> Option<[f64; 3]> {
        /// Of the tangential compliances: below a pivot is round-off.
        const SINGULAR: f64 = 64.0 * f64::EPSILON;
        /// Of the largest |b|: motion that is round-off.
        const NO_MOTION: f64 = 1e-13;
        let w = &self.w;
        // What is left of the tangent plane when the gap stays closed: T λ_t = -g.
        let per = [w[0][1] / w[0][0], w[0][2] / w[0][0]];
        let [x, y] = [1, 2].map(|k| w[k][k] - w[k][0] * per[k - 1]);
        let cross = w[1][2] - w[1][0] * per[1];
        let g = [1, 2].map(|k| self.b[k] - w[k][0] * (self.b[0] / w[0][0]));
        let determinant = x * y - cross * cross;
        let drag = if determinant > SINGULAR * w[1][1] * w[2][2] {
            [
                (cross * g[1] - y * g[0]) / determinant,
                (cross * g[0] - x * g[1]) / determinant,
            ]
        } else {
            // Along the one direction that gives way, if any.
            let v = unit(0.5 * cross.atan2(0.5 * (x - y)));
            let compliance = v[0] * v[0] * x + v[1] * v[1] * y + 2.0 * v[0] * v[1] * cross;
            let motion = v[0] * g[0] + v[1] * g[1];
            let is_none = compliance <= SINGULAR * w[1][1].max(w[2][2]).max(w[0][0]);
            let force = if is_none { 0.0 } else { -motion / compliance };
            let left = [0, 1].map(|k| g[k] - if is_none { 0.0 } else { motion * v[k] });
            let most = self.b.iter().fold(0.0, |max: f64, b| max.max(b.abs()));
            if left[0].hypot(left[1]) > NO_MOTION * most {
                return None;
            }
            [force * v[0], force * v[1]]
        };
        let normal = -self.b[0] / w[0][0] - per[0] * drag[0] - per[1] * drag[1];
        Some([normal, drag[0], drag[1]])
    }

    /// A force on the cone with a closed gap and slip against its tangential part.
    ///
    /// With slip along d the force is l (1, -μ d), the closed gap gives l, and what remains is that u_t is along d: one
    /// equation for the angle, a trigonometric polynomial of degree two.
    fn slip(&self, direction: [f64; 2]) -> Option<([f64; 3], [f64; 2])> {
        /// Intervals in which a change of sign is looked for. The polynomial has at most four roots.
        const INTERVALS: usize = 24;
        if direction != [0.0; 2]
            && let Some(found) = self.newton(direction)
        {
            return Some(found);
        }
        let mut best: Option<([f64; 3], [f64; 2], f64)> = None;
        let step = std::f64::consts::TAU / INTERVALS as f64;
        // Off the axes, where symmetric problems have their roots.
        let angle = |k: usize| step * (k as f64 + 0.381_966);
        let mut left = self.turning(unit(angle(0)));
        for k in 0..INTERVALS {
            let right = self.turning(unit(angle(k + 1)));
            if (left > 0.0) != (right > 0.0) {
                let d = self.bisect(angle(k), angle(k + 1), left > 0.0);
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
    fn newton(&self, direction: [f64; 2]) -> Option<([f64; 3], [f64; 2])> {
        const MAX_STEPS: usize = 6;
        let mut d = direction;
        for _ in 0..MAX_STEPS {
            let slope = self.turning_slope(d);
            let step = -self.turning(d) / slope;
            if step.abs().is_nan() || step.abs() > 1.0 {
                return None;
            }
            let (x, y) = (d[0] - step * d[1], d[1] + step * d[0]);
            let length = x.hypot(y);
            d = [x / length, y / length];
            if step.abs() <= 4.0 * f64::EPSILON {
                break;
            }
        }
        self.force_along(d).map(|(force, _)| (force, d))
    }

    fn bisect(&self, left: f64, right: f64, is_left_positive: bool) -> [f64; 2] {
        /// Halvings: as many as there are digits.
        const HALVINGS: usize = 54;
        let (mut left, mut right) = (left, right);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (left + right);
            if middle <= left || middle >= right {
                break;
            }
            if (self.turning(unit(middle)) > 0.0) == is_left_positive {
                left = middle;
            } else {
                right = middle;
            }
        }
        unit(0.5 * (left + right))
    }

    /// How the gap opens with a unit of force along (1, -μ d).
    fn opening(&self, d: [f64; 2]) -> f64 {
        let mu = self.friction_coefficient;
        self.w[0][0] - mu * (self.w[0][1] * d[0] + self.w[0][2] * d[1])
    }

    /// Slip for a unit of force along (1, -μ d).
    fn slip_per_force(&self, d: [f64; 2]) -> [f64; 2] {
        let mu = self.friction_coefficient;
        [1, 2].map(|k| self.w[k][0] - mu * (self.w[k][1] * d[0] + self.w[k][2] * d[1]))
    }

    /// d x u_t times the opening: zero where slip is along d.
    fn turning(&self, d: [f64; 2]) -> f64 {
        let b = [self.b[1], self.b[2]];
        self.opening(d) * cross(d, b) - self.b[0] * cross(d, self.slip_per_force(d))
    }

    /// Derivative of [`Local::turning`] with the angle of d.
    fn turning_slope(&self, d: [f64; 2]) -> f64 {
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
    fn force_along(&self, d: [f64; 2]) -> Option<([f64; 3], f64)> {
        let opening = self.opening(d);
        if opening <= 0.0 {
            return None;
        }
        let normal = -self.b[0] / opening;
        let slip = self.slip_per_force(d);
        let along = d[0] * (self.b[1] + normal * slip[0]) + d[1] * (self.b[2] + normal * slip[1]);
        let drag = -self.friction_coefficient * normal;
        (along >= 0.0 && normal.is_finite()).then_some(([normal, drag * d[0], drag * d[1]], along))
    }

    /// Where no slip was found (wedged, or singular W): the fixed point of projected steps, as near as they come.
    fn projected(&self) -> [f64; 3] {
        const STEPS: usize = 50;
        let mu = self.friction_coefficient;
        let trace = self.w[0][0] + self.w[1][1] + self.w[2][2];
        let mut force = [0.0; 3];
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

fn unit(angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [cos, sin]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
