//! Damaged mesh files: no panic, and no allocation that the file's own size does not explain.
//!
//! Every allocation of this test program is measured, so it stands alone.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]
#![allow(
    unsafe_code,
    reason = "an allocator that measures is an unsafe trait; it only hands on to the system's"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use fem::Supports;
use fem::mesh::gmsh;

struct Measured;

static LARGEST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Measured {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        LARGEST.fetch_max(size, Ordering::Relaxed);
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Measured = Measured;

const FILES: [&str; 8] = [
    "box-order1-ascii.msh",
    "box-order1-binary.msh",
    "box-order2-ascii.msh",
    "box-order2-binary.msh",
    "box-order3-ascii.msh",
    "box-order3-binary.msh",
    "box-parametric-binary.msh",
    "ring-tet10.msh",
];

fn bytes_of(name: &str) -> Vec<u8> {
    std::fs::read(
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data")
            .join(name),
    )
    .unwrap()
}

/// Reads, and checks what could be read. Text numbers take two bytes in the file and eight in
/// memory, vectors double: 40 times the file is far above any honest need.
fn read(bytes: &[u8]) -> bool {
    LARGEST.store(0, Ordering::Relaxed);
    let mesh = gmsh::read_bytes(bytes, Path::new("damaged.msh"));
    let largest = LARGEST.load(Ordering::Relaxed);
    assert!(
        largest < 40 * bytes.len() + 4096,
        "{largest} bytes asked for a file of {}",
        bytes.len()
    );
    let Ok(mesh) = mesh else { return false };
    let _ = mesh.check(&Supports::new(mesh.n_nodes()));
    let _ = mesh.boundary_faces();
    true
}

/// One test: allocations of tests that run side by side would be mixed.
#[test]
fn damaged_files_never_panic_and_never_ask_for_much_memory() {
    for name in FILES {
        let whole = bytes_of(name);
        assert!(read(&whole), "{name}");

        // Cut at every 50th byte; the end of the last section's name and what follows may go.
        let end = whole.len() - "$EndElements\n".len();
        for len in (0..end).step_by(50) {
            assert!(!read(&whole[..len]), "{name} cut at {len} is read");
        }

        // Some bytes replaced: any value, or one that means something to the reader.
        let seed = 20_040_708;
        let mut random = Random(seed);
        for round in 0..1500 {
            let mut damaged = whole.clone();
            for _ in 0..1 + random.below(4) {
                let at = random.below(damaged.len());
                damaged[at] = match random.below(3) {
                    0 => random.below(256) as u8,
                    1 => damaged[at] ^ (1 << random.below(8)),
                    _ => b"\n $-09\xff\0"[random.below(8)],
                };
            }
            // The round is printed if `read` panics, with the seed above.
            let outcome = std::panic::catch_unwind(|| read(&damaged));
            assert!(outcome.is_ok(), "{name}, seed {seed}, round {round}");
        }

        // Pieces left out or repeated.
        for _ in 0..200 {
            let (a, b) = (random.below(whole.len()), random.below(whole.len()));
            let (from, to) = (a.min(b), a.max(b));
            read(&[&whole[..from], &whole[to..]].concat());
            read(&[&whole[..to], &whole[from..]].concat());
        }
    }
}

/// Linear congruential generator of Knuth (MMIX), upper bits.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }
}
