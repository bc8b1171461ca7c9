//! No candidate that is near is ever missed, whatever moves; and those that are far are spared.

use contact::Place;
use contact::tool::{BoxShape, Sphere};
use glam::{DMat3, DQuat};

use super::super::ActiveContact;
use super::super::forces::Loads;
use super::super::pairs::Pairs;
use super::*;

/// Numbers between -0.5 and 0.5 that look random.
fn numbers() -> impl FnMut() -> f64 {
    let mut seed = 0x1234_5678_u64;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5
    }
}

/// Nodes 1 mm apart on a strip that is rolled up, so that neighbours in space are not all neighbours on the strip.
fn strip(n: usize) -> Vec<DVec3> {
    (0..n)
        .map(|k| {
            let (along, across) = ((k / 8) as f64, (k % 8) as f64);
            let (turn, height) = (0.1 * along, 1e-3 * across);
            let radius = 1e-2 - 4e-5 * along;
            DVec3::new(radius * turn.cos(), radius * turn.sin(), height)
        })
        .collect()
}

/// Compliance of a node under a force at another, m/N: falls with the distance, turns, and couples all.
fn block(rest: &[DVec3], i: usize, j: usize) -> DMat3 {
    let d = rest[i] - rest[j];
    let r = d.length();
    if i == j {
        return DMat3::from_diagonal(DVec3::new(1e-3, 1.2e-3, 0.8e-3));
    }
    // C_ij = C_jiᵀ: even and symmetric, odd and skew.
    let along = DMat3::from_cols(d * d.x, d * d.y, d * d.z) * (1.0 / (r * r));
    let skew = DMat3::from_cols(
        DVec3::new(0.0, d.z, -d.y),
        DVec3::new(-d.z, 0.0, d.x),
        DVec3::new(d.y, -d.x, 0.0),
    );
    let scale = 4e-7 / (r + 5e-4);
    // The last term bends the part as a whole.
    scale * (DMat3::IDENTITY + along + skew * (0.5 / r))
        + 1e-5 * DMat3::IDENTITY * (1.0 + 100.0 * rest[i].x) * (1.0 + 100.0 * rest[j].x)
}

fn part(rest: &[DVec3]) -> ContactPart {
    let n = rest.len();
    let mut blocks = Vec::with_capacity(9 * n * n);
    for j in 0..n {
        for i in 0..n {
            blocks.extend(block(rest, i, j).to_cols_array());
        }
    }
    ContactPart::new(rest.to_vec(), n, blocks)
}

fn loads_of(active: &[ActiveContact], n_candidates: usize) -> Loads {
    let mut loads = Loads::new(n_candidates);
    for contact in active {
        let place = Place::node(contact.candidate, DVec3::ZERO);
        loads.add(&place, 1.0, contact.force_on_part, false);
    }
    loads
}

/// Forces that come, change, wander to a neighbour and go; few at a time.
struct Forces(Vec<DVec3>);

impl Forces {
    fn change(&mut self, scale: f64, random: &mut impl FnMut() -> f64) {
        let n = self.0.len();
        for candidate in 0..n {
            let force = self.0[candidate];
            if force == DVec3::ZERO {
                if random() > 0.4985 {
                    self.0[candidate] =
                        scale * DVec3::new(0.1 * random(), 0.1 * random(), random());
                }
            } else if random() > 0.45 {
                self.0[candidate] = DVec3::ZERO;
                if random() > 0.0 {
                    self.0[(candidate + 8) % n] += force;
                }
            } else {
                self.0[candidate] += 0.01 * scale * DVec3::new(random(), random(), random());
            }
        }
    }

    fn active(&self) -> Vec<ActiveContact> {
        let loaded = self
            .0
            .iter()
            .enumerate()
            .filter(|(_, f)| **f != DVec3::ZERO);
        loaded
            .map(|(k, force)| ActiveContact {
                candidate: k as u32,
                normal_force: force.length(),
                force_on_part: *force,
                sticks: false,
            })
            .collect()
    }
}

/// What a walk saw.
#[derive(Default)]
struct Seen {
    near: usize,
    looks: usize,
}

/// One look; every node nearer than reach has to be due.
fn look(watch: &mut Watch, state: State<'_>, seen: &mut Seen) {
    let part = state.deformed.part;
    watch.advance(state);
    watch.look(state);
    let due = watch.take_due();
    seen.looks += due.len();
    let mut is_due = vec![false; part.n_candidates()];
    for candidate in &due {
        assert!(!is_due[*candidate as usize], "{candidate} twice");
        is_due[*candidate as usize] = true;
    }
    for candidate in 0..part.n_candidates() {
        let position = part.rest_positions()[candidate] + state.deformed.displacement(candidate);
        let contact = state.tool.signed_distance(state.tool_pose, position);
        let distance = contact.signed_distance;
        if distance < watch.reach {
            seen.near += 1;
            assert!(is_due[candidate], "{candidate} at {position}");
        } else if is_due[candidate] {
            watch.postpone(part.clusters(), candidate as u32, distance, position);
        }
    }
    watch.give_back(due);
}

fn walk(tool: &Tool, n: usize, steps: usize, force: f64) -> Seen {
    let rest = strip(n);
    let part = part(&rest);
    let mut watch = Watch::new(&part, 2e-4, 6e-4).unwrap();
    let mut random = numbers();
    let pairs = Pairs::new(n, 0);
    let mut forces = Forces(vec![DVec3::ZERO; n]);
    let (mut at, mut turn) = (DVec3::new(8e-3, 0.0, 4e-3), DVec3::ZERO);
    let mut seen = Seen::default();
    for step in 0..steps {
        let mut vector = || DVec3::new(random(), random(), random());
        at += 2e-4 * vector();
        turn += 0.01 * vector();
        // Now and then it jumps, and now and then stays; far away in between.
        match step % 500 {
            100 => at = 2e-2 * vector() + DVec3::new(0.0, 0.0, 4e-3),
            300 => at = DVec3::new(0.1, 0.0, 0.0),
            310 => at = DVec3::new(-8e-3, 0.0, 4e-3),
            450 => watch.forget(),
            _ => at = at.clamp(DVec3::splat(-0.15), DVec3::splat(0.15)),
        }
        if step % 3 > 0 {
            forces.change(force, &mut random);
        }
        let pose = DPose3::from_parts(at, DQuat::from_scaled_axis(turn));
        let active = forces.active();
        let loads = loads_of(&active, part.n_candidates());
        let deformed = Deformed {
            part: &part,
            active: &active,
            pairs: &pairs,
        };
        let state = State {
            deformed,
            tool,
            tool_pose: &pose,
            loads: &loads,
        };
        look(&mut watch, state, &mut seen);
    }
    seen
}

#[test]
fn no_near_candidate_is_ever_missed() {
    let ball = Tool::Sphere(Sphere::new(3e-3).unwrap());
    let brick = Tool::Box(BoxShape::new(DVec3::new(4e-3, 2e-3, 1e-3)).unwrap());
    for (tool, n, force) in [
        (&ball, 900, 0.1),
        (&brick, 900, 0.1),
        (&brick, 900, 3.0),
        (&ball, 5, 1.0),
    ] {
        let seen = walk(tool, n, 1500, force);
        assert!(
            seen.near > 200,
            "the walk met {} near nodes only",
            seen.near
        );
        if force < 1.0 {
            assert!(
                seen.looks < 1500 * n / 4,
                "{} looks spare nothing",
                seen.looks
            );
        }
    }
}

/// A force that is none leaves nothing undiscovered after it.
#[test]
fn after_a_force_that_is_no_number_all_is_looked_at_anew() {
    let rest = strip(300);
    let part = part(&rest);
    let tool = Tool::Sphere(Sphere::new(3e-3).unwrap());
    let mut watch = Watch::new(&part, 2e-4, 6e-4).unwrap();
    let pairs = Pairs::new(rest.len(), 0);
    let mut seen = Seen::default();
    for step in 0..40 {
        let is_bad = step == 10;
        let force = if is_bad { DVec3::NAN } else { DVec3::Z };
        let active = [ActiveContact {
            candidate: 200,
            normal_force: 1.0,
            force_on_part: force,
            sticks: false,
        }];
        let loads = loads_of(&active, rest.len());
        let pose = DPose3::from_translation(DVec3::new(8e-3 - 2e-4 * f64::from(step), 0.0, 4e-3));
        let state = State {
            deformed: Deformed {
                part: &part,
                active: &active,
                pairs: &pairs,
            },
            tool: &tool,
            tool_pose: &pose,
            loads: &loads,
        };
        if is_bad {
            watch.advance(state);
            watch.look(state);
            assert_eq!(watch.due.len(), rest.len());
        } else {
            look(&mut watch, state, &mut seen);
        }
    }
    assert!(seen.near > 30, "{}", seen.near);
}
