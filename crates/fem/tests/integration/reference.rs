//! Cantilever clip arm with a tip load, against other programs.
//!
//! ```text
//!  |▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒|  40 x 8 x 2 mm, E 2300 MPa, nu 0.3
//! fixed (x = 0)          load ↓ 1 N, uniform traction
//! ```
//! Displacements of three nodes: order 2 by scikit-fem 12.0.2, with getfem 5.4.2 and NGSolve
//! 6.2.2608 within 5e-10 and CalculiX 2.20 within its 7 printed digits; order 3 by getfem 5.4.2,
//! with NGSolve 6.2.2608 within 2e-10. Tolerance 1e-8: what those programs agree to, with room.

use fem::{FactoredStiffness, Material, Quadrature, Silent};

use crate::common::{assemble, hold, largest_difference, read};

fn compare(mesh: &str, nodes: [(u64, [f64; 3]); 3], twice_energy: f64) {
    let mesh = read(mesh);
    let supports = hold(&mesh, &mesh.group("fixed").unwrap().nodes);
    assert_eq!(mesh.check(&supports), Ok(vec![]));
    let material = Material::new(2.3e9, 0.3).unwrap();
    let stiffness = assemble(&mesh, material, Quadrature::Fast);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let force =
        fem::load::traction_of_total_force(&mesh, mesh.group("load").unwrap(), [0.0, 0.0, -1.0])
            .unwrap();
    let u = factor.solve(&force);
    for (tag, expected) in nodes {
        let node = mesh.node_of_tag(tag).unwrap() as usize;
        let error = largest_difference(&u[3 * node..][..3], &expected);
        assert!(error < 1e-8 * 1.7e-3, "node {tag}: {error:e}");
    }
    let work: f64 = force.iter().zip(&u).map(|(f, u)| f * u).sum();
    assert!((work / twice_energy - 1.0).abs() < 1e-8, "{work}");
    assert!((2.0 * stiffness.strain_energy(&u) / twice_energy - 1.0).abs() < 1e-8);
}

#[test]
fn cantilever_tet10_agrees_with_other_programs() {
    let nodes = [
        (
            987,
            [
                -3.636152891901052e-09,
                1.0256702185026064e-07,
                -0.0017023199107914608,
            ],
        ),
        (
            169,
            [
                -6.41954933382029e-05,
                -1.251821850357114e-07,
                -0.0017017033999617087,
            ],
        ),
        (
            96,
            [
                4.791880312547754e-05,
                -1.914879353292166e-06,
                -0.0005236036714707746,
            ],
        ),
    ];
    compare("cantilever-tet10.msh", nodes, 0.001702120987295136);
}

#[test]
fn cantilever_tet20_agrees_with_other_programs() {
    let nodes = [
        (
            799,
            [
                2.1440670853939702e-05,
                7.583393473728632e-08,
                -0.001708315901653227,
            ],
        ),
        (
            61,
            [
                -6.436194697359473e-05,
                -1.306767515034613e-07,
                -0.0017077622638330757,
            ],
        ),
        (
            36,
            [
                4.805826329716532e-05,
                -1.910933599188265e-06,
                -0.0005263938137690081,
            ],
        ),
    ];
    compare("cantilever-tet20.msh", nodes, 0.001708122139080536);
}
