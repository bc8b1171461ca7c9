//! Pads in folders of the test's own, and one that the kernel itself pretends, where it lets us.

use std::fs;
use std::io::Write;
use std::time::{Duration, Instant};

use evdev::uinput::VirtualDevice;
use evdev::{
    AbsInfo, AbsoluteAxisEvent, AttributeSet, EventSummary, KeyEvent, UInputCode, UinputAbsSetup,
};
use glam::DVec3;

use super::*;
use crate::wrench::Wrench;

#[test]
fn bits_are_found_in_the_kernels_words_the_highest_first() {
    // The keys of a pad on a machine of 64 bits: 0x130 is bit 48 of the fifth word from the end.
    let keys = "7cdb000000000000 0 0 0 0\n";
    if usize::BITS == 64 {
        assert!(has_bit(keys, 0x130) && has_bit(keys, 0x13e));
        assert!(!has_bit(keys, 0x132) && !has_bit(keys, 0x12f));
        assert!(!has_bit(keys, 0x2ff));
    }
    assert!(has_bit("3003f", 0x10) && has_bit("3003f", 0) && !has_bit("3003f", 9));
    for nonsense in ["", "zz", "-1", "123456789123456789123456789"] {
        assert!(!has_bit(nonsense, 0));
    }
}

/// Writes what the kernel tells of an input device.
fn tell(folder: &Path, event: &str, name: &str, keys: &[u16], axes: &[u16]) {
    let field = |bits: &[u16]| {
        let mut words = [0_usize; 24];
        for bit in bits {
            words[usize::from(*bit) / usize::BITS as usize] |= 1 << (u32::from(*bit) % usize::BITS);
        }
        let text: Vec<String> = words.iter().rev().map(|w| format!("{w:x}")).collect();
        text.join(" ")
    };
    let device = folder.join(event).join("device");
    fs::create_dir_all(device.join("capabilities")).unwrap();
    fs::write(device.join("name"), format!("{name}\n")).unwrap();
    fs::write(device.join("capabilities/key"), field(keys)).unwrap();
    fs::write(device.join("capabilities/abs"), field(axes)).unwrap();
}

#[test]
fn pads_are_found_among_keyboards_and_touchpads_without_opening_any() {
    let told = tempfile::tempdir().unwrap();
    let folder = told.path();
    tell(folder, "event10", "Pad B", &[0x130, 0x131], &[0, 1, 3, 4]);
    tell(folder, "event9", "Pad A", &[0x130], &[0, 1]);
    tell(folder, "event0", "Keyboard", &[30, 31], &[]);
    tell(folder, "event1", "Touchpad", &[0x14a], &[0, 1]);
    tell(folder, "event2", "Motion sensors", &[], &[0, 1, 2]);
    tell(folder, "event3", "One axis", &[0x130], &[0]);
    fs::create_dir_all(folder.join("event4")).unwrap();
    fs::create_dir_all(folder.join("js0")).unwrap();
    let pad = |file: &str, name: &str| Found {
        path: Path::new("/dev/none").join(file),
        name: name.to_owned(),
    };
    assert_eq!(
        find(folder, Path::new("/dev/none")),
        [pad("event9", "Pad A"), pad("event10", "Pad B")]
    );
    assert_eq!(find(&folder.join("nowhere"), Path::new("/dev")), []);
}

#[test]
fn refusals_of_the_system_are_told_apart() {
    let of = |kind: io::ErrorKind| refusal(Path::new("/dev/input/event5"), &kind.into());
    let rule = of(io::ErrorKind::PermissionDenied).to_string();
    let line = "\n  KERNEL==\"event*\", SUBSYSTEM==\"input\", ENV{ID_INPUT_JOYSTICK}==\"1\", TAG+=\"uaccess\"\n";
    assert!(rule.contains(line), "{rule}");
    assert!(matches!(
        of(io::ErrorKind::NotFound),
        Unavailable::NotThere { .. }
    ));
    assert!(matches!(
        of(io::ErrorKind::Other),
        Unavailable::Failed { .. }
    ));
}

#[test]
fn place_that_is_no_pad_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("event0");
    fs::write(&file, "no device").unwrap();
    let place = |path: &Path| open(path.to_str().unwrap()).unwrap_err().to_string();
    assert!(place(&file).contains("is no input device"));
    assert!(place(&folder.path().join("event1")).contains("there is no"));
    assert!(place(folder.path()).contains("could not be opened"));
    assert!(open("?speed=0").is_err());
}

/// The pad that the kernel pretends: sticks, triggers, one button, rumble.
fn pretended() -> io::Result<VirtualDevice> {
    let axis = |code, min, max| UinputAbsSetup::new(code, AbsInfo::new(0, min, max, 0, 0, 0));
    let stick = |code| axis(code, -32768, 32767);
    let keys: AttributeSet<KeyCode> = [KeyCode::BTN_SOUTH, KeyCode::BTN_TR].into_iter().collect();
    let effects: AttributeSet<FFEffectCode> = [FFEffectCode::FF_RUMBLE].into_iter().collect();
    VirtualDevice::builder()?
        .name("Pretended pad")
        .with_keys(&keys)?
        .with_absolute_axis(&stick(AbsoluteAxisCode::ABS_X))?
        .with_absolute_axis(&stick(AbsoluteAxisCode::ABS_Y))?
        .with_absolute_axis(&stick(AbsoluteAxisCode::ABS_RX))?
        .with_absolute_axis(&stick(AbsoluteAxisCode::ABS_RY))?
        .with_absolute_axis(&axis(AbsoluteAxisCode::ABS_Z, 0, 255))?
        .with_absolute_axis(&axis(AbsoluteAxisCode::ABS_RZ, 0, 255))?
        .with_ff(&effects)?
        .with_ff_effects_max(4)
        .build()
}

/// What the pretended pad was told of its rumble.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
struct Heard {
    strengths: Vec<u16>,
    lengths: Vec<u16>,
    played: u32,
    stopped: u32,
    erased: u32,
}

/// Answers the kernel's questions about rumble until told to end: whoever plays an effect waits for the answers.
fn answer(mut pad: VirtualDevice, heard: &Mutex<Heard>, ends: &std::sync::atomic::AtomicBool) {
    while !ends.load(std::sync::atomic::Ordering::Relaxed) {
        let events: Vec<_> = pad.fetch_events().unwrap().collect();
        for event in events {
            let mut heard = heard.lock().unwrap();
            match event.destructure() {
                EventSummary::UInput(event, UInputCode::UI_FF_UPLOAD, ..) => {
                    let mut upload = pad.process_ff_upload(event).unwrap();
                    upload.set_effect_id(2);
                    upload.set_retval(0);
                    let effect = upload.effect();
                    heard.lengths.push(effect.replay.length);
                    if let FFEffectKind::Rumble {
                        strong_magnitude, ..
                    } = effect.kind
                    {
                        heard.strengths.push(strong_magnitude);
                    }
                }
                EventSummary::UInput(event, UInputCode::UI_FF_ERASE, ..) => {
                    pad.process_ff_erase(event).unwrap();
                    heard.erased += 1;
                }
                EventSummary::ForceFeedback(_, _, 0) => heard.stopped += 1,
                EventSummary::ForceFeedback(..) => heard.played += 1,
                _ => {}
            }
        }
    }
}

fn wait_until(mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed().as_secs() < 10, "it never came to be");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The pretended pad with its device file, where the kernel lets us.
fn pretended_with_file() -> Option<(VirtualDevice, PathBuf)> {
    let mut pad = match pretended() {
        Ok(pad) => pad,
        Err(why) => {
            // Past the test runner, which keeps what passing tests print.
            let told = format!("not tried with a pad of the kernel's own, /dev/uinput: {why}\n");
            io::stderr().write_all(told.as_bytes()).unwrap();
            return None;
        }
    };
    let mut files = pad.enumerate_dev_nodes_blocking().unwrap();
    let path = files.next().unwrap().unwrap();
    wait_until(|| path.exists());
    Some((pad, path))
}

#[test]
fn pad_that_the_kernel_takes_away_is_told() {
    let Some((pad, path)) = pretended_with_file() else {
        return;
    };
    let mut opened = open(path.to_str().unwrap()).unwrap();
    wait_until(|| opened.device.read(0.0).is_ok());
    drop(pad);
    let lost = "is lost (the gamepad no longer answers";
    let wait = Duration::from_secs(10);
    while !opened.messages.recv_timeout(wait).unwrap().contains(lost) {}
    wait_until(|| opened.device.read(0.0).is_err());
}

/// The whole way through the kernel: found, opened, moved, rumbled, closed.
#[test]
fn pad_that_the_kernel_pretends_moves_the_handle_and_rumbles() {
    let Some((mut pad, path)) = pretended_with_file() else {
        return;
    };
    let listed = list();
    let name = format!("gamepad:{}", path.display());
    assert!(
        listed
            .iter()
            .any(|l| l.name == name && l.status == Ok("Pretended pad".to_owned()))
    );

    let mut opened = open(&format!("{}?speed=0.1", path.display())).unwrap();
    assert_eq!(opened.device.name(), "Pretended pad");
    assert_eq!(opened.device.limits().peak_force, FULL_FORCE);
    wait_until(|| opened.device.read(0.0).is_ok());
    let right = AbsoluteAxisEvent::new(AbsoluteAxisCode::ABS_X, 32767);
    let up = AbsoluteAxisEvent::new(AbsoluteAxisCode::ABS_RZ, 255);
    let pressed = KeyEvent::new(KeyCode::BTN_TR, 1);
    pad.emit(&[*right, *up, *pressed]).unwrap();
    wait_until(|| {
        opened.device.read(0.0).is_ok_and(|s| {
            s.linear_velocity == DVec3::new(0.1, 0.0, 0.1)
                && s.pose.translation.z > 1e-3
                && s.buttons == 1 << 7
        })
    });

    let (heard, ends) = (
        Mutex::new(Heard::default()),
        std::sync::atomic::AtomicBool::new(false),
    );
    std::thread::scope(|scope| {
        scope.spawn(|| answer(pad, &heard, &ends));
        let push = Wrench::new(DVec3::new(0.0, 3.0, 4.0), DVec3::ZERO).into();
        wait_until(|| {
            opened.device.write(&push).unwrap();
            heard.lock().unwrap().played >= 3
        });
        // Nothing more is written: the command fades, and with it the rumble.
        wait_until(|| heard.lock().unwrap().stopped >= 1);
        // Closing makes events, and the thread that waits for one ends after it.
        ends.store(true, std::sync::atomic::Ordering::Relaxed);
        drop(opened);
    });
    let heard = heard.into_inner().unwrap();
    assert!(heard.strengths.contains(&32767), "{heard:?}");
    assert!(heard.lengths.iter().all(|ms| *ms == 100), "{heard:?}");
}
