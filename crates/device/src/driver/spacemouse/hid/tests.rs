//! A SpaceMouse that the kernel itself pretends, where it lets us.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::*;
use crate::driver::Family;
use crate::driver::spacemouse::SpaceMouse;

/// What the puck says of itself: multi-axis controller; reports 1 and 2 of three 16-bit axes, 3 of two buttons with
/// padding, 4 a light.
const DESCRIPTOR: [u8; 89] = [
    0x05, 0x01, 0x09, 0x08, 0xa1, 0x01, // generic desktop, multi-axis controller
    0xa1, 0x00, 0x85, 0x01, 0x16, 0xa2, 0xfe, 0x26, 0x5e, 0x01, // report 1, -350 to 350
    0x09, 0x30, 0x09, 0x31, 0x09, 0x32, 0x75, 0x10, 0x95, 0x03, 0x81, 0x06, 0xc0, // x y z
    0xa1, 0x00, 0x85, 0x02, 0x09, 0x33, 0x09, 0x34, 0x09, 0x35, 0x75, 0x10, 0x95, 0x03, 0x81, 0x06,
    0xc0, // report 2
    0xa1, 0x02, 0x85, 0x03, 0x05, 0x09, 0x19, 0x01, 0x29, 0x02, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01,
    0x95, 0x02, 0x81, 0x02, 0x95, 0x0e, 0x81, 0x03, 0xc0, // report 3
    0xa1, 0x02, 0x85, 0x04, 0x05, 0x08, 0x09, 0x4b, 0x95, 0x01, 0x91, 0x02, 0x95, 0x07, 0x91, 0x03,
    0xc0, 0xc0, // report 4
];

/// A line of the kernel to pretend HID devices. The numbers are those of its interface.
struct Pretended(File);

impl Pretended {
    fn new(name: &str) -> io::Result<Self> {
        let mut line = OpenOptions::new()
            .read(true)
            .write(true)
            .open("/dev/uhid")?;
        let mut event = vec![0; 4 + 276 + 4096];
        event[0] = 11; // create
        event[4..4 + name.len()].copy_from_slice(name.as_bytes());
        event[260] = DESCRIPTOR.len() as u8;
        event[262] = 3; // USB
        event[264..266].copy_from_slice(&0x256f_u16.to_le_bytes());
        event[268..270].copy_from_slice(&0xc635_u16.to_le_bytes());
        event[280..280 + DESCRIPTOR.len()].copy_from_slice(&DESCRIPTOR);
        line.write_all(&event)?;
        Ok(Self(line))
    }

    fn say(&mut self, report: &[u8]) {
        let mut event = vec![0; 4 + 2 + 4096];
        event[0] = 12; // input
        event[4] = report.len() as u8;
        event[6..6 + report.len()].copy_from_slice(report);
        self.0.write_all(&event).unwrap();
    }

    /// The next report that it was sent.
    fn hear(line: &mut File) -> Vec<u8> {
        let mut event = vec![0; 4 + 276 + 4096];
        loop {
            let length = line.read(&mut event).unwrap();
            // Output: 4096 bytes, of which so many count.
            if length > 4102 && event[0] == 6 {
                let size = usize::from(event[4100]);
                return event[4..4 + size].to_vec();
            }
        }
    }
}

fn wait_for<T>(mut found: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(begun.elapsed().as_secs() < 10, "it never came to be");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The whole way through the kernel: found, lit, moved, closed, lit no more, unplugged.
#[test]
fn puck_that_the_kernel_pretends_moves_the_handle() {
    let mut line = match Pretended::new("Pretended puck") {
        Ok(line) => line,
        Err(why) => {
            // Past the test runner, which keeps what passing tests print.
            let told = format!("not tried with a puck of the kernel's own, /dev/uhid: {why}\n");
            io::stderr().write_all(told.as_bytes()).unwrap();
            return;
        }
    };
    let found = wait_for(|| {
        find()
            .unwrap()
            .into_iter()
            .find(|f| f.name == "Pretended puck")
    });
    assert_eq!(
        (found.vendor, found.product, found.usage),
        (0x256f, 0xc635, (1, 8))
    );
    wait_for(|| check_access(&found).ok());
    let name = format!("spacemouse:{}", found.path);
    let listed = SpaceMouse.list();
    assert!(listed.iter().any(|l| l.name == name && l.status.is_ok()));

    let (tell, heard) = channel();
    let mut ears = line.0.try_clone().unwrap();
    std::thread::spawn(move || while tell.send(Pretended::hear(&mut ears)).is_ok() {});
    let mut opened = SpaceMouse
        .open(&format!("{}?speed=0.1", found.path))
        .unwrap();
    let light = || heard.recv_timeout(Duration::from_secs(10)).unwrap();
    assert_eq!(light(), [4, 1]);
    line.say(&[3, 2, 0]);
    wait_for(|| {
        line.say(&[1, 0x5e, 0x01, 0, 0, 0xa2, 0xfe]);
        line.say(&[2, 0, 0, 0, 0, 0x5e, 0x01]);
        let state = opened.device.read(0.0).ok()?;
        let is_moved = state.linear_velocity == DVec3::new(0.1, 0.0, 0.1)
            && state.angular_velocity.z == -0.8
            && state.pose.translation.z > 1e-3
            && state.buttons == 2;
        is_moved.then_some(())
    });
    drop(opened);
    assert_eq!(light(), [4, 0]);

    let opened = SpaceMouse.open(&found.path).unwrap();
    line.0.write_all(&[1, 0, 0, 0]).unwrap(); // destroy
    let is_lost = |told: String| told.contains("is lost (the device no longer answers");
    while !is_lost(
        opened
            .messages
            .recv_timeout(Duration::from_secs(10))
            .unwrap(),
    ) {}
}
