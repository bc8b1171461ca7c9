//! What the scheduler of OpenHaptics calls must not allocate: its thread is marked, and what it allocates is counted.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

use device::Wrench;
use device::driver::Family;
use device::driver::hd::Hd;

use crate::stub::{LIMIT, Stub, drive_until, push};

thread_local! {
    static IS_MARKED: Cell<bool> = const { Cell::new(false) };
}

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);
static MARKS: AtomicU64 = AtomicU64::new(0);

struct Counting;

fn count() {
    if IS_MARKED.get() {
        ALLOCATIONS.fetch_add(1, Ordering::SeqCst);
    }
}

// SAFETY: all is done by the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, start: *mut u8, layout: Layout) {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(start, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Called by the stub on its scheduler's thread. The stub has an allocator of its own, which does not count here.
extern "C" fn mark() {
    IS_MARKED.set(true);
    MARKS.fetch_add(1, Ordering::SeqCst);
}

#[test]
fn frames_of_the_scheduler_do_not_allocate() {
    let stub = Stub::of("hd");
    stub.set("freedoms", 6.0);
    stub.hand_over("stub_at_start", mark);
    let family = Hd {
        patience: LIMIT,
        ..Hd::with_library(Some(stub.file.clone()))
    };
    let mut opened = family.open("").unwrap();
    let wrench = push([1.0, -2.0, 1.5], [0.1, 0.0, 0.0]);
    drive_until(&mut opened, wrench, "the whole force", |_| {
        stub.newest("hdSetDoublev 0x2700") == Some(vec![1.0, -2.0, 1.5])
    });
    // On the way without errors, and with them.
    for (knob, value) in [
        ("scale", f64::NAN),
        ("scale", 1.0),
        ("fail:frame", 3.0),
        ("calibration", 20481.0),
    ] {
        stub.set(knob, value);
        let frames = stub.count("hdSetDoublev 0x2700");
        drive_until(&mut opened, Wrench::ZERO, "more frames", |_| {
            stub.count("hdSetDoublev 0x2700") > frames + 40
        });
    }
    // Opened once, or again where this machine was so busy that the bad poses went on for long.
    assert!(MARKS.load(Ordering::SeqCst) > 0);
    assert_eq!(ALLOCATIONS.load(Ordering::SeqCst), 0);

    // The counter does count.
    IS_MARKED.set(true);
    drop(Box::new(7));
    IS_MARKED.set(false);
    assert!(ALLOCATIONS.load(Ordering::SeqCst) > 0);
}
