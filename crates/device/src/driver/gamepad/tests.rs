//! Shapes of pads by hand, the rumble against a clock of the test's own, and the source over a pad of its own.

use std::io;

use super::pad::{Axis, Range};
use super::rumble::FULL_FORCE;
use super::*;

const STICK: Range = Range {
    min: -32768,
    max: 32767,
    flat: 128,
};
const TRIGGER: Range = Range {
    min: 0,
    max: 255,
    flat: 0,
};
const CROSS: Range = Range {
    min: -1,
    max: 1,
    flat: 0,
};

fn shape(axes: &[(Axis, Range)]) -> Shape {
    let mut ranges = [None; Axis::ALL.len()];
    for (range, axis) in ranges.iter_mut().zip(Axis::ALL) {
        *range = axes.iter().find(|(a, _)| *a == axis).map(|(_, r)| *r);
    }
    Shape::new(ranges)
}

/// A pad with six axes and a cross of axes, the commonest.
fn common() -> Shape {
    shape(&[
        (Axis::X, STICK),
        (Axis::Y, STICK),
        (Axis::Rx, STICK),
        (Axis::Ry, STICK),
        (Axis::Z, TRIGGER),
        (Axis::Rz, TRIGGER),
        (Axis::CrossX, CROSS),
    ])
}

fn values(axes: &[(Axis, i32)]) -> Snapshot {
    let mut now = Snapshot::default();
    for (value, axis) in now.axes.iter_mut().zip(Axis::ALL) {
        *value = axes.iter().find(|(a, _)| *a == axis).map_or(0, |(_, v)| *v);
    }
    now
}

/// The kernel counts sticks to the right and to the user.
#[test]
fn sticks_triggers_and_cross_of_a_common_pad() {
    let linear = |axes: &[(Axis, i32)]| common().input(&values(axes)).linear;
    let angular = |axes: &[(Axis, i32)]| common().input(&values(axes)).angular;
    assert_eq!(linear(&[(Axis::X, 32767)]), DVec3::X);
    assert_eq!(linear(&[(Axis::X, -32768)]), DVec3::NEG_X);
    assert_eq!(linear(&[(Axis::Y, -32768)]), DVec3::Y);
    assert_eq!(linear(&[(Axis::Rz, 255)]), DVec3::Z);
    assert_eq!(linear(&[(Axis::Z, 255)]), DVec3::NEG_Z);
    assert_eq!(linear(&[(Axis::Z, 255), (Axis::Rz, 255)]), DVec3::ZERO);
    // To the right: clockwise seen from above. To the user: the top comes to the user.
    assert_eq!(angular(&[(Axis::Rx, 32767)]), DVec3::NEG_Z);
    assert_eq!(angular(&[(Axis::Ry, 32767)]), DVec3::X);
    assert_eq!(angular(&[(Axis::CrossX, 1)]), DVec3::Y);
}

#[test]
fn drift_within_a_tenth_of_the_way_or_the_kernels_dead_zone_is_nothing() {
    let axes = [
        (Axis::X, 3000),
        (Axis::Y, -3200),
        (Axis::Rx, 1),
        (Axis::Z, 25),
    ];
    let resting = common().input(&values(&axes));
    assert_eq!(
        (resting.linear, resting.angular),
        (DVec3::ZERO, DVec3::ZERO)
    );
    let half = common().input(&values(&[(Axis::X, 18022)]));
    assert!((half.linear.x - 0.5).abs() < 1e-3);
    let loose = Range {
        flat: 16000,
        ..STICK
    };
    let pad = shape(&[(Axis::X, loose), (Axis::Y, STICK)]);
    assert_eq!(pad.input(&values(&[(Axis::X, 15900)])).linear.x, 0.0);
}

#[test]
fn pads_of_other_habits_find_their_stick_and_triggers() {
    let sticks = [
        (Axis::X, STICK),
        (Axis::Y, STICK),
        (Axis::Z, STICK),
        (Axis::Rz, STICK),
    ];
    let wireless = shape(&[&sticks[..], &[(Axis::Gas, TRIGGER), (Axis::Brake, TRIGGER)]].concat());
    let input = wireless.input(&values(&[(Axis::Z, 32767), (Axis::Brake, 255)]));
    assert_eq!((input.linear, input.angular), (DVec3::NEG_Z, DVec3::NEG_Z));
    // No axes for the triggers: their keys, 0x138 and 0x139; and a cross of keys.
    let keys = Snapshot {
        keys: 1 << 9 | 1,
        cross: [true, false],
        ..Snapshot::default()
    };
    let input = shape(&sticks).input(&keys);
    assert_eq!((input.linear, input.angular), (DVec3::Z, DVec3::NEG_Y));
    assert_eq!(input.buttons, 1 << 9 | 1);
    // One stick and nothing else.
    let bare = shape(&sticks[..2]).input(&values(&[(Axis::Rx, 32767), (Axis::X, 32767)]));
    assert_eq!((bare.linear, bare.angular), (DVec3::X, DVec3::ZERO));
}

/// What a broken or hostile pad states must not turn into a number beyond the full deflection.
#[test]
fn absurd_ranges_and_values_deflect_by_no_more_than_all() {
    let numbers = [i32::MIN, -1, 0, 1, 100, i32::MAX];
    let mut moved = 0;
    for min in numbers {
        for max in numbers {
            for flat in numbers {
                let range = Range { min, max, flat };
                let pad = shape(&Axis::ALL.map(|axis| (axis, range)));
                for value in numbers {
                    let input = pad.input(&values(&Axis::ALL.map(|axis| (axis, value))));
                    let all = [input.linear, input.angular];
                    assert!(all.iter().all(|v| v.abs().max_element() <= 1.0));
                    moved += u32::from(input.linear.x != 0.0);
                    if min >= max {
                        assert_eq!(all, [DVec3::ZERO; 2], "{range:?}");
                    }
                }
            }
        }
    }
    assert!(moved > 0);
}

/// Runs the rumble at 1 kHz for a time and returns the orders with their times, s.
fn orders(
    rumble: &mut Rumble,
    from_s: f64,
    to_s: f64,
    force: impl Fn(f64) -> f64,
) -> Vec<(f64, Order)> {
    let ticks = (from_s * 1e3) as u32..(to_s * 1e3) as u32;
    ticks
        .map(|tick| f64::from(tick) * 1e-3)
        .filter_map(|t| rumble.next(force(t), t).map(|order| (t, order)))
        .collect()
}

#[test]
fn steady_force_is_renewed_before_the_rumble_ends_and_stopped_once() {
    let mut rumble = Rumble::default();
    assert_eq!(orders(&mut rumble, 0.0, 1.0, |_| 0.0), []);
    let steady = orders(&mut rumble, 1.0, 2.0, |_| 0.5 * FULL_FORCE);
    assert!(steady.iter().all(|(_, o)| *o == Order::Play(32767)));
    let end_s = f64::from(Rumble::LENGTH_MS) * 1e-3;
    assert!(steady.windows(2).all(|w| w[1].0 - w[0].0 < 0.9 * end_s));
    assert!((15..=21).contains(&steady.len()), "{}", steady.len());
    let after: Vec<Order> = orders(&mut rumble, 2.0, 3.0, |_| 0.0)
        .into_iter()
        .map(|(_, order)| order)
        .collect();
    assert_eq!(after, [Order::Stop]);
}

#[test]
fn changing_force_gives_fifty_orders_a_second_at_most() {
    let mut rumble = Rumble::default();
    let buzz = |t: f64| 5.0 + 5.0 * (2.0 * std::f64::consts::PI * 93.0 * t).sin();
    let given = orders(&mut rumble, 0.0, 1.0, buzz);
    assert!((40..=50).contains(&given.len()), "{}", given.len());
    assert!(given.windows(2).all(|w| w[1].0 - w[0].0 > 0.0199));
}

#[test]
fn strength_is_the_share_of_the_full_force() {
    for (force, strength) in [
        (0.0, None),
        (1e-3, None),
        (2.5, Some(16383)),
        (10.0, Some(65535)),
        (1e9, Some(65535)),
        (f64::INFINITY, Some(65535)),
        (f64::NAN, None),
        (-3.0, None),
    ] {
        let order = Rumble::default().next(force, 0.0);
        assert_eq!(order, strength.map(Order::Play), "{force}");
    }
}

/// A pad of the test's own.
#[derive(Default)]
struct Bench {
    now: Snapshot,
    fails_with: Option<io::ErrorKind>,
    told: Vec<(u16, u16)>,
    stops: u32,
}

impl Bench {
    fn result(&self) -> io::Result<()> {
        self.fails_with.map_or(Ok(()), |kind| Err(kind.into()))
    }
}

impl Port for Bench {
    fn snapshot(&mut self) -> io::Result<Snapshot> {
        self.result().map(|()| self.now)
    }

    fn play(&mut self, strength: u16, length_ms: u16) -> io::Result<()> {
        self.told.push((strength, length_ms));
        self.result()
    }

    fn stop(&mut self) -> io::Result<()> {
        self.stops += 1;
        self.result()
    }
}

#[test]
fn axis_that_was_never_at_rest_moves_nothing() {
    // A trigger that runs from -32768 and has not spoken yet reads 0: half pressed.
    let pad = shape(&[
        (Axis::X, STICK),
        (Axis::Y, STICK),
        (Axis::Rx, STICK),
        (Axis::Ry, STICK),
        (Axis::Z, STICK),
        (Axis::Rz, STICK),
    ]);
    let mut source = PadSource::new(Bench::default(), pad, false);
    source.port.now = values(&[(Axis::Z, -32768), (Axis::X, 32767)]);
    assert_eq!(source.poll(0.0).unwrap().linear, DVec3::ZERO);
    let released = values(&[(Axis::Z, -32768), (Axis::Rz, -32768)]);
    source.port.now = released;
    assert_eq!(source.poll(0.0).unwrap().linear, DVec3::ZERO);
    source.port.now = values(&[(Axis::Z, -32768), (Axis::Rz, 32767), (Axis::X, 32767)]);
    assert_eq!(source.poll(0.0).unwrap().linear, DVec3::new(1.0, 0.0, 1.0));
}

#[test]
fn pad_that_is_gone_ends_the_link_and_an_interrupted_call_does_not() {
    let mut source = PadSource::new(Bench::default(), common(), true);
    source.poll(0.0).unwrap();
    source.port.now = values(&[(Axis::X, 32767)]);
    let moving = source.poll(0.0).unwrap();
    source.port.fails_with = Some(io::ErrorKind::Interrupted);
    assert_eq!(source.poll(0.0).unwrap(), moving);
    source.port.fails_with = Some(io::ErrorKind::NotFound);
    let lost = source.poll(0.0).unwrap_err();
    assert!(matches!(lost, DeviceError::Gone { .. }));
}

#[test]
fn rumble_is_finite_ends_on_closing_and_is_given_up_when_it_fails() {
    let mut source = PadSource::new(Bench::default(), common(), true);
    source.render(10.0, 0.0);
    source.render(10.0, 0.001);
    assert_eq!(source.port.told, [(65535, Rumble::LENGTH_MS)]);
    source.close();
    assert_eq!(source.port.stops, 1);

    source.port.fails_with = Some(io::ErrorKind::PermissionDenied);
    source.render(5.0, 1.0);
    assert!(source.message().unwrap().contains("rumble failed"));
    source.render(10.0, 2.0);
    assert_eq!(source.port.told.len(), 2);
    source.close();
    assert_eq!(source.port.stops, 1);

    let mut without = PadSource::new(Bench::default(), common(), false);
    without.render(10.0, 0.0);
    without.close();
    assert_eq!((without.port.told.len(), without.port.stops), (0, 0));
}

#[test]
fn family_lists_at_least_one_line_that_opens_or_says_why() {
    let lines = Gamepad.list();
    assert!(!lines.is_empty());
    assert!(lines.iter().all(|l| l.name.starts_with("gamepad")));
}
