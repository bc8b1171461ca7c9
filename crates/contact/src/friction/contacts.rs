//! What each contact does, and what is known about each from its own block of W.

use super::{Problem, State, cone};

/// Of the larger tangential compliance, or of the normal one: below there is none.
const NO_COMPLIANCE: f64 = 1e-13;

/// Of the largest |q|: motion that is round-off.
const NO_MOTION: f64 = 1e-14;

/// The contacts' states, slip directions and constants; memory for `capacity` of them.
#[derive(Debug, Clone)]
pub(super) struct Contacts {
    pub(super) states: Vec<State>,
    /// Unit vectors along the slip where a contact slips; otherwise where the next local solve starts, or 0.
    pub(super) directions: Vec<[f64; 2]>,
    blocks: Vec<Block>,
    moved: Vec<(u32, [f64; 3])>,
}

/// Constants of one contact.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// 1 / compliance along the normal and in the tangent plane, N/m.
    rho: [f64; 2],
    /// Directions in the tangent plane in which a force moves the point.
    tangents: [[f64; 2]; 2],
    n_tangents: u8,
    /// Tangential compliances: along each axis, and of one by the other.
    tangential: [f64; 3],
    floor: f64,
    can_close: bool,
    /// Not where the point moves in a direction in which no force holds it.
    can_stick: bool,
}

impl Contacts {
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            states: Vec::with_capacity(capacity),
            directions: Vec::with_capacity(capacity),
            blocks: Vec::with_capacity(capacity),
            moved: Vec::with_capacity(capacity),
        }
    }

    /// All open. `max_q`: largest |q|.
    pub(super) fn reset(&mut self, problem: &Problem, max_q: f64) {
        let n = problem.n_contacts();
        self.states.clear();
        self.states.resize(n, State::Open);
        self.directions.clear();
        self.directions.resize(n, [0.0; 2]);
        self.blocks.clear();
        self.blocks
            .extend((0..n).map(|contact| Block::new(problem, contact, max_q)));
    }

    pub(super) fn rho(&self, contact: usize) -> [f64; 2] {
        self.blocks[contact].rho
    }

    pub(super) fn tangents(&self, contact: usize) -> &[[f64; 2]] {
        let block = &self.blocks[contact];
        &block.tangents[..usize::from(block.n_tangents)]
    }

    /// Whether forces move the point along its normal.
    pub(super) fn can_close(&self, contact: usize) -> bool {
        self.blocks[contact].can_close
    }

    /// Whether it can be held where it is.
    pub(super) fn can_stick(&self, contact: usize) -> bool {
        self.blocks[contact].can_stick
    }

    /// How the point gives way along a unit vector in the tangent plane, m/N.
    pub(super) fn compliance(&self, contact: usize, along: [f64; 2]) -> f64 {
        let [x, y, cross] = self.blocks[contact].tangential;
        along[0] * along[0] * x + along[1] * along[1] * y + 2.0 * along[0] * along[1] * cross
    }

    /// What counts as no compliance at the contact, m/N.
    pub(super) fn no_compliance(&self, contact: usize) -> f64 {
        self.blocks[contact].floor
    }

    /// The states that forces inside their cones tell by themselves.
    pub(super) fn read(&mut self, problem: &Problem, forces: &[f64]) {
        /// Of the force: this near to the cone is on it.
        const NEAR: f64 = 1e-9;
        let triples = forces.as_chunks::<3>().0.iter();
        for (contact, force) in triples.enumerate() {
            let mu = problem.friction_coefficients()[contact];
            let length = cone::tangential(force);
            self.states[contact] = if force[0] <= 0.0 {
                State::Open
            } else if length < (1.0 - NEAR) * mu * force[0] {
                State::Stick
            } else {
                State::Slip
            };
            if length > 0.0 {
                self.directions[contact] = [-force[1] / length, -force[2] / length];
            }
        }
    }

    /// Finds the states from forces and u = q + W λ, and puts each force where it must be for its state: zero, or on the
    /// cone; [`Contacts::moved`] has what changed. True if a state changed.
    pub(super) fn settle(&mut self, problem: &Problem, u: &[f64], forces: &mut [f64]) -> bool {
        self.moved.clear();
        let mut is_new = false;
        let triples = u.as_chunks::<3>().0.iter();
        for (contact, (u, force)) in triples.zip(forces.as_chunks_mut::<3>().0).enumerate() {
            let mu = problem.friction_coefficients()[contact];
            let (state, settled) = self.settled(contact, mu, u, force);
            if settled != *force {
                self.moved
                    .push((contact as u32, [0, 1, 2].map(|k| settled[k] - force[k])));
                *force = settled;
            }
            is_new |= state != self.states[contact];
            self.states[contact] = state;
        }
        is_new
    }

    /// Directions of slipping contacts against their forces.
    pub(super) fn follow(&mut self, forces: &[f64]) {
        let triples = forces.as_chunks::<3>().0.iter();
        for ((force, state), direction) in triples.zip(&self.states).zip(&mut self.directions) {
            let drag = cone::tangential(force);
            if *state == State::Slip && drag > 0.0 && force[0] > 0.0 {
                *direction = [-force[1] / drag, -force[2] / drag];
            }
        }
    }

    /// The states alone; forces stay.
    pub(super) fn find(&mut self, problem: &Problem, u: &[f64], forces: &[f64]) {
        let triples = u.as_chunks::<3>().0.iter().zip(forces.as_chunks::<3>().0);
        for (contact, (u, force)) in triples.enumerate() {
            let mu = problem.friction_coefficients()[contact];
            self.states[contact] = self.settled(contact, mu, u, force).0;
        }
    }

    /// Contacts whose force the last [`Contacts::settle`] changed, and by how much.
    pub(super) fn moved(&self) -> &[(u32, [f64; 3])] {
        &self.moved
    }

    /// State and force of one contact; sets its direction if it slips.
    fn settled(
        &mut self,
        contact: usize,
        mu: f64,
        u: &[f64; 3],
        force: &[f64; 3],
    ) -> (State, [f64; 3]) {
        let block = &self.blocks[contact];
        let rho = block.rho;
        let trial = [
            force[0] - rho[0] * u[0],
            force[1] - rho[1] * u[1],
            force[2] - rho[1] * u[2],
        ];
        if !block.can_close || trial[0].is_nan() || trial[0] <= 0.0 {
            return (State::Open, [0.0; 3]);
        }
        let length = cone::tangential(&trial);
        let old = self.states[contact];
        let direction = &mut self.directions[contact];
        // A contact that slipped stays on the cone where its force is, and one that turned back stops first.
        let is_back = old == State::Slip && trial[1] * direction[0] + trial[2] * direction[1] > 0.0;
        if block.can_stick && (length <= mu * trial[0] || is_back) {
            return (State::Stick, block.held(force));
        }
        let drag = cone::tangential(force);
        if old == State::Slip && drag > 0.0 && force[0] > 0.0 {
            *direction = [-force[1] / drag, -force[2] / drag];
            return (State::Slip, *force);
        }
        if length > 0.0 {
            *direction = [-trial[1] / length, -trial[2] / length];
        }
        let normal = force[0].max(0.0);
        let on_cone = direction.map(|d| -mu * normal * d);
        (State::Slip, [normal, on_cone[0], on_cone[1]])
    }
}

impl Block {
    fn new(problem: &Problem, contact: usize, max_q: f64) -> Self {
        let row = 3 * contact;
        let columns = [0, 1, 2].map(|axis| problem.column(row + axis));
        let (normal, x, y) = (columns[0][row], columns[1][row + 1], columns[2][row + 2]);
        let cross = columns[2][row + 1];
        let floor = NO_COMPLIANCE * normal.max(x).max(y);
        let can_close = normal > 0.0;
        // Eigenvalues of the tangential block.
        let (middle, radius) = (0.5 * (x + y), (0.5 * (x - y)).hypot(cross));
        let mut block = Self {
            rho: [
                1.0 / normal,
                1.0 / if middle > floor { middle } else { normal },
            ],
            tangents: [[1.0, 0.0], [0.0, 1.0]],
            n_tangents: 2,
            tangential: [x, y, cross],
            floor,
            can_close,
            can_stick: true,
        };
        if !can_close {
            block.rho = [0.0; 2];
        }
        if middle - radius > floor {
            return block;
        }
        let q = [problem.q()[row + 1], problem.q()[row + 2]];
        let left = if middle + radius <= floor {
            block.n_tangents = 0;
            q[0].hypot(q[1])
        } else {
            // The eigenvector of the larger one.
            let angle = 0.5 * cross.atan2(0.5 * (x - y));
            let (sin, cos) = angle.sin_cos();
            block.n_tangents = 1;
            block.tangents[0] = [cos, sin];
            (cos * q[1] - sin * q[0]).abs()
        };
        block.can_stick = left <= NO_MOTION * max_q;
        block
    }

    /// The force without what holds nothing.
    fn held(&self, force: &[f64; 3]) -> [f64; 3] {
        let [t, _] = self.tangents;
        match self.n_tangents {
            0 => [force[0], 0.0, 0.0],
            1 => {
                let along = force[1] * t[0] + force[2] * t[1];
                [force[0], along * t[0], along * t[1]]
            }
            _ => *force,
        }
    }
}
