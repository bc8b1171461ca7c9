//! Nothing on the way from pose to forces asks for memory.
//!
//! A counting allocator stands in for the system's. Source of the idea: Drake's LimitMalloc.
#![allow(clippy::unwrap_used, reason = "a test may stop")]
#![allow(unsafe_code, reason = "a global allocator is an unsafe trait")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use contact::delassus::{ComplianceBlocks, CouplingCompliance, delassus_into};
use contact::friction;
use contact::glam::{DMat3, DVec3};
use contact::glamx::DPose3;
use contact::lcp::{Problem, Scratch, Settings, Start, solve};
use contact::tool::{BoxShape, Capsule, Cylinder, DistanceField, HalfSpace, Mesh, Sphere, Tool};
use contact::{Contact, Place};

thread_local! {
    static N_ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call goes on to the system's allocator unchanged; the counter is a thread-local cell without a destructor,
// which asks for no memory itself.
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
    assert_eq!(
        allocations(|| drop(std::hint::black_box(vec![1_u8; 100]))),
        1
    );
}

#[test]
fn solve_allocates_nothing_on_any_path() {
    let m = 30;
    let contact: Vec<f64> = (0..m * m)
        .map(|k| (-((k / m) as f64 - (k % m) as f64).abs() / 3.0).exp())
        .collect();
    let singular = vec![1.0; m * m];
    let negative: Vec<f64> = (0..m * m)
        .map(|k| if k % (m + 1) == 0 { -1.0 } else { 0.001 })
        .collect();
    let q: Vec<f64> = (0..m).map(|i| ((i * 7) % 5) as f64 - 3.0).collect();
    let warm: Vec<bool> = (0..m).map(|i| i % 3 == 0).collect();
    let mut scratch = Scratch::new(m);
    let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
    let default = Settings::default();
    let all = [
        default.clone(),
        Settings {
            max_rounds: 0,
            ..default.clone()
        },
        Settings {
            max_rounds: 0,
            max_pivots: 0,
            ..default
        },
    ];
    for matrix in [&contact, &singular, &negative] {
        for settings in &all {
            for warm in [Start::Cold, Start::Rows(&warm), Start::Kept] {
                let n = allocations(|| {
                    let problem = Problem::new(matrix, &q).unwrap();
                    solve(&problem, settings, &mut scratch, warm, &mut z, &mut w).unwrap();
                });
                assert_eq!(n, 0);
            }
        }
    }
}

#[test]
fn friction_allocates_nothing() {
    let n = 12;
    let w: Vec<f64> = (0..9 * n * n)
        .map(|k| {
            let (i, j) = (k / (3 * n), k % (3 * n));
            let near = (-((i / 3) as f64 - (j / 3) as f64).abs() / 2.0).exp();
            if i % 3 == j % 3 { near } else { 0.05 * near }
        })
        .collect();
    let q: Vec<f64> = (0..3 * n).map(|i| ((i * 7) % 5) as f64 - 2.5).collect();
    let mut scratch = friction::Scratch::new(n);
    let (mut forces, mut slip) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
    for coefficient in [0.0, 0.2, 3.0] {
        let mu = vec![coefficient; n];
        for is_warm in [false, true] {
            let n_allocations = allocations(|| {
                let problem = friction::Problem::new(&w, &q, &mu).unwrap();
                let settings = friction::Settings::default();
                friction::solve(
                    &problem,
                    &settings,
                    &mut scratch,
                    is_warm,
                    &mut forces,
                    &mut slip,
                )
                .unwrap();
            });
            assert_eq!(n_allocations, 0, "μ = {coefficient}");
        }
    }
}

struct Blocks(DMat3);
impl ComplianceBlocks for Blocks {
    fn block(&self, _row: usize, _col: usize) -> DMat3 {
        self.0
    }
}

#[test]
fn planes_and_delassus_allocate_nothing() {
    let brick = Tool::Box(BoxShape::new(DVec3::new(0.3, 0.5, 0.2)).unwrap());
    let (vertices, triangles) = Tool::Sphere(Sphere::new(0.4).unwrap()).tessellate(1.0);
    let field = DistanceField::new(brick.clone(), 2e-3, 0.1, 1 << 30).unwrap();
    let tools = [
        Tool::Sphere(Sphere::new(0.4).unwrap()),
        Tool::Cylinder(Cylinder::new(0.3, Some(0.5)).unwrap()),
        Tool::Cylinder(Cylinder::new(0.3, None).unwrap()),
        Tool::Capsule(Capsule::new(0.2, 0.4).unwrap()),
        Tool::HalfSpace(HalfSpace),
        Tool::Mesh(Mesh::new(&vertices, &triangles).unwrap().into()),
        Tool::Field(field.into()),
        brick,
    ];
    let nodes: Vec<DVec3> = (0..5000)
        .map(|k| {
            DVec3::new(
                (k % 17) as f64,
                (k % 83) as f64 / 5.0,
                (k % 31) as f64 / 2.0,
            ) * 0.06
        })
        .collect();
    let mut contacts: Vec<Contact> = Vec::with_capacity(40);
    let mut w = vec![0.0; 1600];
    let blocks = Blocks(DMat3::IDENTITY);
    let coupling = [[0.001; 6]; 6];
    for tool in &tools {
        let mut n_contacts = 0;
        let n = allocations(|| {
            for step in 0..50 {
                let pose = DPose3::translation(0.02 * step as f64, 0.3, 0.3);
                contacts.clear();
                for (k, node) in nodes.iter().enumerate() {
                    let place = Place::node(k as u32, *node);
                    let contact = place.contact(0, tool, &pose, *node);
                    if contact.gap < 0.1 && contacts.len() < 40 {
                        contacts.push(contact);
                    }
                }
                n_contacts += contacts.len();
                let coupling = CouplingCompliance {
                    matrix: &coupling,
                    reference: DVec3::ZERO,
                };
                let m = contacts.len();
                delassus_into(&blocks, &contacts, Some(coupling), &mut w[..m * m]).unwrap();
            }
        });
        assert_eq!(n, 0, "{tool:?}");
        assert!(n_contacts > 0);
    }
}
