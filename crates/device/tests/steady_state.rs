//! What the loop must never do: take memory from the heap, whatever the guard, the device or the simulation do.
//!
//! A file of its own, because it replaces the allocator. Nothing here is timed.
#![allow(unsafe_code, reason = "a counting allocator forwards to the system's")]
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use device::driver::simulated::MODELS;
use device::{
    Answer, Arming, AsFastAsPossible, Command, DeviceError, HandPresence, HandSettings,
    HandleState, HapticDevice, Limits, Servo, ServoSettings, Simulated, SimulatedHand, Wrench,
};
use glam::{DMat3, DVec3};
use glamx::DPose3;

thread_local! {
    static N_ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call goes on to the system's allocator unchanged; the counter is a thread-local cell without a
// destructor, which asks for no memory itself.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        N_ALLOCATIONS.with(|n| n.set(n.get() + 1));
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(work: impl FnOnce()) -> usize {
    let before = N_ALLOCATIONS.with(Cell::get);
    work();
    N_ALLOCATIONS.with(Cell::get) - before
}

#[test]
fn the_counter_counts() {
    let work = || drop(std::hint::black_box(vec![1_u8; 100]));
    assert_eq!(allocations(work), 1);
}

/// Arming, contact, nonsense, old results, a hand that lets go, on each model.
#[test]
fn live_session_on_a_simulated_device_allocates_nothing() {
    for model in MODELS {
        let (mut guide, hand) =
            SimulatedHand::guided(HandSettings::default(), DPose3::IDENTITY, 1e-4).unwrap();
        let mut device = Simulated::of_model(model, hand).unwrap();
        let settings = ServoSettings::live(device.limits()).unwrap();
        let mut servo = Servo::new(AsFastAsPossible::new(1e-3).unwrap(), settings).unwrap();
        let mut armed = 0;
        let n = allocations(|| {
            for k in 0..3000_u32 {
                if k == 500 {
                    let into = DPose3::from_translation(DVec3::NEG_Z * 0.02);
                    guide.set_target(into).unwrap();
                }
                if k == 2500 {
                    guide.set_hand(HandPresence::Absent);
                }
                let record = servo.step(&mut device, |handle| {
                    let depth = (-handle.pose.translation.z - 0.01).max(0.0);
                    let up = if k % 500 == 7 { f64::NAN } else { 5e4 * depth };
                    Answer {
                        command: Command {
                            wrench: Wrench::new(DVec3::Z * up, DVec3::ZERO),
                            stiffness: DMat3::IDENTITY * -1e6,
                        },
                        age_s: if k % 300 < 20 { 0.03 } else { 0.0 },
                    }
                });
                armed += u32::from(record.unwrap().arming == Arming::Armed);
            }
            servo.release(&mut device);
        });
        assert_eq!(n, 0, "{}", model.key);
        assert!(armed > 500, "{}", model.key);
        let events = servo.report().safety;
        assert!(events.wrenches_non_finite > 0 && events.answers_stale > 0);
        assert!(events.trips_hand_absent > 0 && events.stiffness_limited > 0);
    }
}

/// A device that went silent, as the loop's end of a link reports it.
struct Silent(Limits);

impl HapticDevice for Silent {
    fn name(&self) -> &str {
        "silent"
    }
    fn limits(&self) -> &Limits {
        &self.0
    }
    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError> {
        if time_s > 0.1 {
            return Err(DeviceError::Silent { age_s: time_s });
        }
        Ok(HandleState {
            time_s,
            ..HandleState::at_rest(DPose3::IDENTITY)
        })
    }
    fn write(&mut self, _: &Command) -> Result<(), DeviceError> {
        Ok(())
    }
    fn stop(&mut self) {}
}

#[test]
fn silent_device_is_waited_for_without_allocating() {
    let mut device = Silent(Limits::virtuose_6d());
    let settings = ServoSettings::live(device.limits()).unwrap();
    let mut servo = Servo::new(AsFastAsPossible::new(1e-3).unwrap(), settings).unwrap();
    let push = Wrench::new(DVec3::X, DVec3::ZERO);
    let n = allocations(|| {
        for _ in 0..1000 {
            servo.step(&mut device, |_| push).unwrap();
        }
    });
    assert_eq!(n, 0);
    assert_eq!(servo.report().read_failures, 899);
}
