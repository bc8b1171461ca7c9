//! Which interface nodes are free: near the contact, where the part bends, or as many as time allows.
//!
//! Source: Duriez et al. 2004, section 3.2: the free interface nodes are chosen at each time step in
//! O(n_i). Here an update looks at a share of the nodes and each has its turn, so that the cost of an update
//! is a share of that. A node is freed at one limit and constrained again at a looser one, so that it
//! does not chatter.

use glam::DVec3;

/// A free node is constrained beyond this multiple of the radius at which it was freed...
const LOOSE_RADIUS: f64 = 1.25;

/// ... or below this share of the bend.
const LOOSE_BEND: f64 = 0.5;

/// By what a node is judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rule {
    /// Distance from the nearest contact at rest, m.
    Radius(f64),
    /// Bend of its edge or face over the largest displacement.
    Indicator(f64),
    /// The nearest ones, as many as `max_free`.
    Nearest,
}

/// State of every interface node, free or constrained.
#[derive(Clone, Debug)]
pub(super) struct FreeNodes {
    rule: Rule,
    max_free: usize,
    positions: Vec<DVec3>,
    is_free: Vec<bool>,
    n_free: usize,
    cursor: usize,
    /// Nodes looked at in one call.
    slice: usize,
    /// m; the rule's, or for [`Rule::Nearest`] the one that frees about `max_free` nodes.
    radius: f64,
    /// Nodes within `radius` met in this sweep, to steer it.
    n_within: usize,
}

impl FreeNodes {
    /// `positions`: the interface nodes at rest, m. `turns`: calls in which every node is looked at
    /// once. None is free yet.
    pub(super) fn new(rule: Rule, max_free: usize, positions: Vec<DVec3>, turns: usize) -> Self {
        let (low, high) = positions
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), x| {
                (a.min(*x), b.max(*x))
            });
        let radius = match rule {
            Rule::Radius(radius) => radius,
            Rule::Indicator(_) => 0.0,
            Rule::Nearest if positions.is_empty() => 0.0,
            Rule::Nearest => 0.1 * (high - low).length(),
        };
        Self {
            rule,
            max_free,
            is_free: vec![false; positions.len()],
            slice: positions.len().div_ceil(turns.max(1)),
            positions,
            n_free: 0,
            cursor: 0,
            radius,
            n_within: 0,
        }
    }

    /// Whether each node is free.
    pub(super) fn is_free(&self) -> &[bool] {
        &self.is_free
    }

    /// Number of free nodes.
    pub(super) fn n_free(&self) -> usize {
        self.n_free
    }

    /// Whether the rule asks for the bend of a node.
    pub(super) fn looks_at_bend(&self) -> bool {
        matches!(self.rule, Rule::Indicator(_))
    }

    /// Nodes that the next [`Self::sweep`] will look at.
    pub(super) fn next_slice(&self) -> std::ops::Range<usize> {
        self.cursor..(self.cursor + self.slice).min(self.positions.len())
    }

    /// Looks at the next share of the nodes. `contacts`: rest positions of the nodes in contact, m;
    /// without any, nothing changes. `bend(i)`: how far node `i` would be from where it is, were it
    /// constrained, m, asked for only if the rule needs it; `largest`: the largest displacement, m.
    /// Returns whether a node changed. Does not allocate.
    pub(super) fn sweep(
        &mut self,
        contacts: &[DVec3],
        bend: impl Fn(usize) -> f64,
        largest: f64,
    ) -> bool {
        let n = self.positions.len();
        let is_idle = self.n_free == 0 && (self.max_free == 0 || self.rule == Rule::Radius(0.0));
        if contacts.is_empty() || n == 0 || is_idle {
            return false;
        }
        let mut has_changed = false;
        let (low, high) = contacts
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), x| {
                (a.min(*x), b.max(*x))
            });
        let kept_within = (LOOSE_RADIUS * self.radius).powi(2);
        for i in self.next_slice() {
            let (wanted, kept) = match self.rule {
                Rule::Indicator(limit) => {
                    let bend = bend(i);
                    (bend > limit * largest, bend > LOOSE_BEND * limit * largest)
                }
                Rule::Radius(_) | Rule::Nearest => {
                    let x = self.positions[i];
                    // Most nodes are farther than the box of all contacts.
                    let mut squared = (x - x.clamp(low, high)).length_squared();
                    if squared < kept_within {
                        let to = |c: &DVec3| (x - *c).length_squared();
                        squared = contacts.iter().map(to).fold(f64::INFINITY, f64::min);
                    }
                    (squared < self.radius * self.radius, squared < kept_within)
                }
            };
            self.n_within += usize::from(wanted);
            if self.is_free[i] && !kept {
                self.is_free[i] = false;
                self.n_free -= 1;
                has_changed = true;
            } else if !self.is_free[i] && wanted && self.n_free < self.max_free {
                self.is_free[i] = true;
                self.n_free += 1;
                has_changed = true;
            }
        }
        self.cursor = self.next_slice().end;
        if self.cursor == n {
            self.end_sweep();
        }
        has_changed
    }

    /// Steers the radius towards as many nodes as are allowed.
    fn end_sweep(&mut self) {
        self.cursor = 0;
        let n_within = std::mem::take(&mut self.n_within);
        if self.rule == Rule::Nearest {
            if n_within > self.max_free {
                self.radius *= 0.9;
            } else if (n_within as f64) < 0.8 * self.max_free as f64
                && n_within < self.positions.len()
            {
                self.radius *= 1.1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURNS: usize = 16;

    fn line(n: usize) -> Vec<DVec3> {
        (0..n).map(|i| DVec3::new(i as f64, 0.0, 0.0)).collect()
    }

    fn sweeps(nodes: &mut FreeNodes, times: usize, contact: f64) {
        for _ in 0..times * TURNS {
            nodes.sweep(&[DVec3::new(contact, 0.0, 0.0)], |_| 0.0, 0.0);
        }
    }

    #[test]
    fn nodes_near_the_contact_are_free_and_stay_so_a_little_farther() {
        let mut nodes = FreeNodes::new(Rule::Radius(10.5), 100, line(100), TURNS);
        nodes.sweep(&[], |_| 0.0, 0.0);
        assert_eq!(nodes.n_free(), 0, "nothing touches");
        sweeps(&mut nodes, 2, 50.0);
        let free = |nodes: &FreeNodes| -> Vec<usize> {
            (0..100).filter(|i| nodes.is_free()[*i]).collect()
        };
        assert_eq!(free(&nodes), (40..=60).collect::<Vec<_>>());
        // 2 farther: 62 is new, 40 and 41 are beyond the radius but within 1.25 of it.
        sweeps(&mut nodes, 2, 52.0);
        assert_eq!(free(&nodes), (40..=62).collect::<Vec<_>>());
        sweeps(&mut nodes, 2, 56.0);
        assert_eq!(free(&nodes), (43..=66).collect::<Vec<_>>());
    }

    #[test]
    fn a_contact_that_trembles_changes_nothing() {
        let mut nodes = FreeNodes::new(Rule::Radius(10.5), 100, line(100), TURNS);
        sweeps(&mut nodes, 2, 50.0);
        sweeps(&mut nodes, 2, 51.0);
        let settled = nodes.is_free().to_vec();
        for k in 0..50 {
            sweeps(&mut nodes, 1, 50.0 + f64::from(k % 2));
            assert_eq!(nodes.is_free(), settled);
        }
    }

    #[test]
    fn bend_frees_at_the_limit_and_constrains_at_half() {
        let mut nodes = FreeNodes::new(Rule::Indicator(0.1), 100, line(20), TURNS);
        let contact = [DVec3::ZERO];
        let run = |nodes: &mut FreeNodes, scale: f64| {
            for _ in 0..TURNS {
                nodes.sweep(&contact, |i| scale * i as f64, 100.0);
            }
            nodes.n_free()
        };
        assert_eq!(run(&mut nodes, 1.0), 9, "11 to 19 are above 10");
        assert_eq!(run(&mut nodes, 0.6), 9, "6.6 to 11.4 are above 5");
        assert_eq!(run(&mut nodes, 0.3), 3, "17 to 19 are above 5");
    }

    #[test]
    fn no_more_than_allowed_are_free_and_they_are_the_nearest() {
        let mut nodes = FreeNodes::new(Rule::Nearest, 20, line(200), TURNS);
        sweeps(&mut nodes, 80, 100.0);
        assert!((16..=20).contains(&nodes.n_free()), "{}", nodes.n_free());
        let farthest = (0..200usize)
            .filter(|i| nodes.is_free()[*i])
            .map(|i| i.abs_diff(100))
            .max();
        assert!(farthest < Some(14), "{farthest:?}");
    }
}
