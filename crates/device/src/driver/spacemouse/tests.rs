//! Reports by their bytes, devices by their numbers, and the whole link over a device of the test's own.

use std::collections::VecDeque;
use std::io;
use std::time::{Duration, Instant};

use glam::DVec3;
use proptest::prelude::*;

use super::hid::{pucks, refusal};
use super::report::{Report, Truncated, decode};
use super::*;
use crate::driver::rate::RateSettings;

/// Translation (7 bytes) to the right, to the user and down by all 350 counts: 0x015e.
const RIGHT_NEAR_DOWN: [u8; 7] = [1, 0x5e, 0x01, 0x5e, 0x01, 0x5e, 0x01];

/// Rotation (7 bytes) by -350 counts about each axis: 0xfea2.
const TURNED: [u8; 7] = [2, 0xa2, 0xfe, 0xa2, 0xfe, 0xa2, 0xfe];

fn puck(reports: &[&[u8]]) -> Puck {
    let mut puck = Puck::default();
    for bytes in reports {
        puck.take(decode(bytes).unwrap(), 1.0);
    }
    puck
}

/// Source of the signs: the HID usage tables' frame (x right, y to the user, z down, right-handed), which half a
/// turn about x takes into x right, y away, z up; components of rotations change as those of ways do.
#[test]
fn seven_byte_reports_give_ways_and_turns_in_a_frame_with_z_up() {
    let input = puck(&[&RIGHT_NEAR_DOWN, &TURNED]).input(1.0);
    assert_eq!(input.linear, DVec3::new(1.0, -1.0, -1.0));
    assert_eq!(input.angular, DVec3::new(-1.0, 1.0, 1.0));
}

#[test]
fn thirteen_byte_report_is_both_seven_byte_ones() {
    let both: Vec<u8> = [&RIGHT_NEAR_DOWN[..], &TURNED[1..]].concat();
    assert_eq!(both.len(), 13);
    assert_eq!(
        decode(&both),
        Ok(Report::Both([350, 350, 350], [-350, -350, -350]))
    );
    let (new, old) = (puck(&[&both]), puck(&[&RIGHT_NEAR_DOWN, &TURNED]));
    assert_eq!(new.input(1.0), old.input(1.0));
}

#[test]
fn buttons_are_bits_whatever_the_number_of_bytes() {
    assert_eq!(decode(&[3, 1]), Ok(Report::Buttons(1)));
    assert_eq!(decode(&[3, 3, 0]), Ok(Report::Buttons(3)));
    assert_eq!(decode(&[3, 0, 0, 0, 0x80]), Ok(Report::Buttons(1 << 31)));
    // A large model has more than 32; those beyond are left out.
    assert_eq!(decode(&[3, 2, 0, 0, 0, 0xff, 0xff]), Ok(Report::Buttons(2)));
    let mut puck = puck(&[&[3, 2, 0]]);
    assert_eq!(puck.input(9.0).buttons, 2, "a button may be held for long");
    puck.take(Report::Buttons(0), 9.0);
    assert_eq!(puck.input(9.0).buttons, 0);
}

#[test]
fn reports_that_are_cut_short_are_refused_and_others_are_let_pass() {
    let cut = |bytes: &[u8]| decode(bytes).unwrap_err();
    assert_eq!(
        cut(&[]),
        Truncated {
            id: None,
            length: 0
        }
    );
    for id in [1, 2] {
        for length in 1..7 {
            let mut bytes = [0; 6];
            bytes[0] = id;
            let expected = Truncated {
                id: Some(id),
                length,
            };
            assert_eq!(cut(&bytes[..length]), expected);
        }
    }
    assert_eq!(
        cut(&[3]),
        Truncated {
            id: Some(3),
            length: 1
        }
    );
    // Between the two lengths there are three axes and something more.
    assert!(matches!(decode(&[1; 12]), Ok(Report::Translation(_))));
    assert_eq!(decode(&[0x17, 100]), Ok(Report::Other));
    assert_eq!(decode(&[0]), Ok(Report::Other));
}

#[test]
fn drift_at_rest_is_nothing_and_silence_is_rest() {
    let resting = puck(&[&[1, 5, 0, 0xfb, 0xff, 3, 0]]);
    assert_eq!(resting.input(1.0).linear, DVec3::ZERO);

    let mut moving = puck(&[&RIGHT_NEAR_DOWN, &TURNED]);
    assert_ne!(moving.input(1.09).linear, DVec3::ZERO);
    assert_eq!(moving.input(1.11).linear, DVec3::ZERO);
    assert_eq!(moving.input(1.11).angular, DVec3::ZERO);
    // Each of the two reports is missed by itself.
    moving.take(decode(&TURNED).unwrap(), 1.2);
    assert_eq!(moving.input(1.25).linear, DVec3::ZERO);
    assert_ne!(moving.input(1.25).angular, DVec3::ZERO);
}

/// Reports of all kinds with bytes changed, cut and added: nothing panics, no deflection is beyond the full one.
#[test]
fn mutated_reports_a_hundred_thousand_times() {
    let originals: [&[u8]; 4] = [&RIGHT_NEAR_DOWN, &TURNED, &[1; 13], &[3, 1, 0]];
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move |below: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state % below
    };
    let (mut puck, mut refused) = (Puck::default(), 0_u32);
    for round in 0..100_000_u32 {
        let mut bytes = originals[random(4) as usize].to_vec();
        for _ in 0..random(4) {
            let at = random(bytes.len() as u64) as usize;
            bytes[at] = random(256) as u8;
        }
        bytes.resize(random(16) as usize, random(256) as u8);
        let now_s = f64::from(round) * 1e-3;
        match decode(&bytes) {
            Ok(report) => puck.take(report, now_s),
            Err(short) => {
                assert!(short.length < 7, "{bytes:?}");
                refused += 1;
            }
        }
        let input = puck.input(now_s);
        assert!(input.linear.abs().max_element() <= 1.0);
        assert!(input.angular.abs().max_element() <= 1.0);
    }
    assert!((10_000..90_000).contains(&refused), "{refused}");
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes: Vec<u8>) {
        let mut puck = Puck::default();
        if let Ok(report) = decode(&bytes) {
            puck.take(report, 0.0);
        }
        let input = puck.input(0.0);
        prop_assert!(input.linear.is_finite() && input.angular.is_finite());
    }
}

fn device(path: &str, vendor: u16, product: u16, usage: (u16, u16)) -> Found {
    Found {
        path: path.to_owned(),
        vendor,
        product,
        name: "SpaceMouse Compact".to_owned(),
        usage,
    }
}

#[test]
fn mice_keypads_and_other_makers_are_skipped() {
    let all = vec![
        device("/dev/hidraw10", 0x256f, 0xc652, (1, 8)),
        // The receiver's other interface, its mouse, a keypad that says it is a multi-axis controller.
        device("/dev/hidraw11", 0x256f, 0xc652, (1, 6)),
        device("/dev/hidraw1", 0x256f, 0xc650, (1, 2)),
        device("/dev/hidraw2", 0x256f, 0xc665, (1, 8)),
        // A mouse and a keyboard of the old maker, and one of another with the same model number.
        device("/dev/hidraw3", 0x046d, 0xc52b, (1, 2)),
        device("/dev/hidraw4", 0x046d, 0xc31c, (1, 8)),
        device("/dev/hidraw5", 0x1234, 0xc635, (1, 8)),
        // One file, listed once for each usage; and a new model that is not known yet.
        device("/dev/hidraw6", 0x046d, 0xc626, (1, 8)),
        device("/dev/hidraw6", 0x046d, 0xc626, (1, 8)),
        device("/dev/hidraw7", 0x256f, 0xc699, (1, 8)),
        // The system tells no usage: only models that are known count.
        device("/dev/hidraw8", 0x256f, 0xc635, (0, 0)),
        device("/dev/hidraw9", 0x256f, 0xc699, (0, 0)),
    ];
    let found = pucks(all);
    let paths: Vec<&str> = found.iter().map(|f| f.path.as_str()).collect();
    assert_eq!(
        paths,
        [
            "/dev/hidraw6",
            "/dev/hidraw7",
            "/dev/hidraw8",
            "/dev/hidraw10"
        ]
    );
}

#[test]
fn place_is_a_file_two_numbers_or_the_first() {
    let both = || {
        vec![
            device("/dev/hidraw0", 0x046d, 0xc626, (1, 8)),
            device("/dev/hidraw3", 0x256f, 0xc635, (1, 8)),
        ]
    };
    let path = |place: &str| pick(both(), place).map(|f| f.path);
    assert_eq!(path("").unwrap(), "/dev/hidraw0");
    assert_eq!(path("/dev/hidraw3").unwrap(), "/dev/hidraw3");
    assert_eq!(path("256F:c635").unwrap(), "/dev/hidraw3");
    for wrong in ["/dev/hidraw9", "256f", "256f:", "256f:zzzz", "1:2:3"] {
        let refused = path(wrong).unwrap_err().to_string();
        assert!(refused.contains("spacemouse:/dev/hidraw3"), "{refused}");
    }
    let refused = pick(Vec::new(), "").unwrap_err();
    assert!(matches!(refused, Unavailable::NotThere { .. }));
}

#[test]
fn listing_has_a_line_for_each_device_with_the_rule_where_it_is_refused() {
    let found = vec![
        device("/dev/hidraw0", 0x046d, 0xc626, (1, 8)),
        device("/dev/hidraw3", 0x256f, 0xc635, (1, 8)),
    ];
    let lines = listings(Ok(found), |device| {
        if device.vendor == 0x046d {
            return Err(refusal(
                device,
                &io::Error::from(io::ErrorKind::PermissionDenied),
            ));
        }
        Ok(())
    });
    assert_eq!(lines[0].name, "spacemouse:/dev/hidraw0");
    let rule = lines[0].status.clone().unwrap_err().to_string();
    // Never the maker's number alone: its keyboards would be open to all.
    assert!(
        rule.contains(
            "\n  KERNEL==\"hidraw*\", ATTRS{idVendor}==\"046d\", ATTRS{idProduct}==\"c626\", TAG+=\"uaccess\"\n"
        ),
        "{rule}"
    );
    assert_eq!(
        lines[1].status,
        Ok("SpaceMouse Compact (256f:c635)".to_owned())
    );
    let none = listings(Ok(Vec::new()), |_| Ok(()));
    assert_eq!(none.len(), 1);
    assert!(none[0].status.is_err());
}

#[test]
fn refusals_of_the_system_are_told_apart() {
    let device = device("/dev/hidraw0", 0x256f, 0xc635, (1, 8));
    let of = |kind| refusal(&device, &io::Error::from(kind));
    assert!(matches!(
        of(io::ErrorKind::NotFound),
        Unavailable::NotThere { .. }
    ));
    assert!(matches!(
        of(io::ErrorKind::ResourceBusy),
        Unavailable::Busy { .. }
    ));
    assert!(matches!(
        of(io::ErrorKind::Other),
        Unavailable::Failed { .. }
    ));
}

/// What the test gives the puck to say, and what the puck was told.
#[derive(Default)]
struct Bench {
    queue: VecDeque<Vec<u8>>,
    /// Repeated while nothing else waits, as a device that is held deflected does.
    held: Option<Vec<u8>>,
    fails_with: Option<io::ErrorKind>,
    written: Vec<Vec<u8>>,
}

#[derive(Clone, Default)]
struct Wire(Arc<Mutex<Bench>>);

impl Wire {
    fn with<T>(&self, f: impl FnOnce(&mut Bench) -> T) -> T {
        f(&mut self.0.lock().unwrap())
    }
}

impl Reports for Wire {
    fn read(&mut self, bytes: &mut [u8], timeout_ms: i32) -> io::Result<usize> {
        let report = self.with(|bench| match bench.fails_with {
            Some(kind) => Err(io::Error::from(kind)),
            None => Ok(bench.queue.pop_front().or_else(|| {
                // Once a call: only the first read of a poll waits.
                bench.held.clone().filter(|_| timeout_ms > 0)
            })),
        })?;
        std::thread::sleep(Duration::from_millis(timeout_ms.unsigned_abs().into()));
        let report = report.unwrap_or_default();
        bytes[..report.len()].copy_from_slice(&report);
        Ok(report.len())
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.with(|bench| bench.written.push(bytes.to_vec()));
        self.with(|bench| bench.fails_with.map_or(Ok(()), |kind| Err(kind.into())))
    }
}

fn open(wire: &Wire, settings: RateSettings) -> Opened {
    let wire = wire.clone();
    let handle = Arc::new(Mutex::new(RateHandle::new(settings)));
    Threaded::open(move || {
        Ok(connect(
            "puck".to_owned(),
            Vec::new(),
            wire.clone(),
            &handle,
        ))
    })
    .unwrap()
}

/// Waits until it holds, for ten seconds at most: a lost device is tried again once a second.
fn wait_until(mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed().as_secs() < 10, "it never came to be");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn held_puck_carries_the_handle_along_until_it_is_let_go() {
    let wire = Wire::default();
    wire.with(|bench| {
        bench.queue.push_back(vec![3, 2, 0]);
        bench.held = Some(RIGHT_NEAR_DOWN.to_vec());
    });
    let settings = RateSettings {
        speed: 0.1,
        turn: 1.0,
    };
    let mut opened = open(&wire, settings);
    let mut state = None;
    wait_until(|| {
        state = opened.device.read(0.0).ok();
        state.is_some_and(|s| s.pose.translation.x > 5e-3)
    });
    let state = state.unwrap();
    assert_eq!(state.linear_velocity, DVec3::new(0.1, -0.1, -0.1));
    assert!((state.pose.translation.x + state.pose.translation.z).abs() < 1e-12);
    assert_eq!(state.buttons, 2);
    assert_eq!(opened.device.limits().peak_force, 0.0);
    // No last word of the device: silence ends the motion.
    wire.with(|bench| bench.held = None);
    wait_until(|| {
        opened
            .device
            .read(0.0)
            .is_ok_and(|s| s.linear_velocity == DVec3::ZERO)
    });
    drop(opened);
    let written = wire.with(|bench| bench.written.clone());
    assert_eq!(written, [vec![4, 1], vec![4, 0]]);
}

#[test]
fn unplugged_puck_is_told_and_comes_back_where_the_handle_was() {
    let wire = Wire::default();
    wire.with(|bench| bench.held = Some(RIGHT_NEAR_DOWN.to_vec()));
    let mut opened = open(&wire, RateSettings::default());
    wait_until(|| {
        opened
            .device
            .read(0.0)
            .is_ok_and(|s| s.pose.translation.x > 1e-3)
    });
    wire.with(|bench| {
        bench.fails_with = Some(io::ErrorKind::BrokenPipe);
        bench.held = None;
    });
    let is_lost = |told: String| told.contains("is lost");
    while !is_lost(
        opened
            .messages
            .recv_timeout(Duration::from_secs(10))
            .unwrap(),
    ) {}
    wait_until(|| opened.device.read(0.0).is_err());
    wire.with(|bench| bench.fails_with = None);
    wait_until(|| opened.device.read(0.0).is_ok());
    let back = opened.device.read(0.0).unwrap();
    assert!(back.pose.translation.x > 1e-3);
    assert_eq!(back.linear_velocity, DVec3::ZERO);
}

#[test]
fn wait_that_is_interrupted_is_no_loss_and_short_reports_are_told_once() {
    let wire = Wire::default();
    wire.with(|bench| bench.fails_with = Some(io::ErrorKind::Interrupted));
    let mut source = PuckSource {
        reports: wire.clone(),
        puck: Puck::default(),
        has_told: false,
        message: None,
    };
    assert_eq!(source.poll(0.0), Ok(Input::default()));
    wire.with(|bench| {
        bench.fails_with = None;
        bench.queue.extend([vec![1, 2], vec![2], vec![3, 1]]);
    });
    assert_eq!(source.poll(0.0).unwrap().buttons, 1);
    let told = source.message().unwrap();
    assert!(told.contains("report 1 of 2 bytes"), "{told}");
    assert_eq!(source.message(), None);
    wire.with(|bench| bench.queue.push_back(vec![2]));
    source.poll(0.0).unwrap();
    assert_eq!(source.message(), None);
}

#[test]
fn device_that_floods_does_not_hold_the_link() {
    let wire = Wire::default();
    wire.with(|bench| {
        bench
            .queue
            .extend(std::iter::repeat_n(RIGHT_NEAR_DOWN.to_vec(), 1000));
    });
    let mut source = PuckSource {
        reports: wire.clone(),
        puck: Puck::default(),
        has_told: false,
        message: None,
    };
    source.poll(0.0).unwrap();
    assert_eq!(wire.with(|bench| bench.queue.len()), 1000 - 64);
}

#[test]
fn wrong_option_is_refused_before_anything_is_looked_for() {
    let refused = SpaceMouse.open("?speed=fast").unwrap_err();
    assert!(matches!(refused, Unavailable::UnknownName { .. }));
}

/// The daemon is preferred where it listens, unless a device file is named; one that has ended is passed over.
#[cfg(unix)]
#[test]
fn daemon_is_preferred_where_it_listens() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("s");
    let path = socket.to_str().unwrap();
    let listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
    let opened = open_unless_daemon("?speed=0.3", path).unwrap();
    assert!(opened.device.name().contains("spacenavd"));
    assert!(opened.notes.iter().any(|n| n.contains("300 mm/s")));
    let named = open_unless_daemon("/dev/none", path).unwrap_err();
    assert!(!named.to_string().contains("spacenavd"), "{named}");
    drop(listener);
    let over_hid = open_unless_daemon("", path).map(|o| o.device.name().to_owned());
    assert!(!over_hid.is_ok_and(|name| name.contains("spacenavd")));
}

#[test]
fn family_lists_at_least_one_line_that_opens_or_says_why() {
    let lines = SpaceMouse.list();
    assert!(!lines.is_empty());
    assert!(lines.iter().all(|l| l.name.starts_with("spacemouse")));
}
