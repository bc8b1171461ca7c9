//! A C-clip with curved quadratic elements, against other programs.
//!
//! ```text
//!      __          inner radius 10.1 mm, wall 2 mm, width 10 mm, open by 108 degrees
//!    /    \        POM: E 2.7 GPa, nu 0.35; held at the foot
//!   |      |       686 nodes, 297 elements, mid nodes on the arcs
//!    \_##_/
//! ```
//! Compliance by the 4-point rule: scikit-fem 12.0.2, with getfem 5.4.2 within 6e-12 and CalculiX
//! 2.20 within its 7 printed digits; by a rule of degree 20: scikit-fem, with getfem within 2e-5 by
//! another rule. A contact pose's nodal forces and what they do: scikit-fem and quadprog 0.1.14.
//! Numbers and versions are in `data/clip-coarse.json`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use fem::stress::Extremes;
use fem::{Compliance, FactoredStiffness, Material, Mesh, Quadrature, Silent, Stiffness, Supports};
use serde_json::Value;

struct Clip {
    mesh: Mesh,
    expected: Value,
    material: Material,
    stiffness: Stiffness,
    factor: FactoredStiffness,
}

fn clip(quadrature: Quadrature) -> Clip {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let mesh = fem::mesh::gmsh::read(&data.join("clip-coarse.msh")).unwrap();
    let text = std::fs::read_to_string(data.join("clip-coarse.json")).unwrap();
    let mut supports = Supports::new(mesh.n_nodes());
    for &node in &mesh.group("fixed").unwrap().nodes {
        supports.fix_node(node, [true; 3]);
    }
    assert_eq!(mesh.check(&supports), Ok(vec![]));
    let material = Material::new(2.7e9, 0.35).unwrap();
    let of_element = vec![0; mesh.n_elements()];
    let stiffness = fem::assemble_stiffness(&mesh, &[material], &of_element, quadrature).unwrap();
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    Clip {
        mesh,
        expected: serde_json::from_str(&text).unwrap(),
        material,
        stiffness,
        factor,
    }
}

impl Clip {
    fn node(&self, tag: u64) -> u32 {
        self.mesh.node_of_tag(tag).unwrap()
    }

    /// Largest difference of the block to the expected one, over its largest entry.
    fn compliance_error(&self, name: &str) -> f64 {
        let tags = self.expected["nodes"].as_array().unwrap();
        let nodes: Vec<u32> = tags
            .iter()
            .map(|t| self.node(t.as_u64().unwrap()))
            .collect();
        let c = Compliance::build(&self.factor, &nodes, &nodes, &Silent).unwrap();
        let checks = c.check(&self.stiffness, &self.factor).unwrap();
        assert!(
            checks.residual_rel < 1e-10 && checks.symmetry_rel < 1e-12,
            "{checks:?}"
        );
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for row in 0..3 * nodes.len() {
            for column in 0..3 * nodes.len() {
                let expected = self.expected[name][row][column].as_f64().unwrap();
                let ours = c.block(row / 3, column / 3)[3 * (column % 3) + row % 3];
                worst = worst.max((ours - expected).abs());
                largest = largest.max(expected.abs());
            }
        }
        worst / largest
    }
}

/// 1e-9: the programs agree to 6e-12; double precision leaves about 1e-11 on this part.
#[test]
fn compliance_by_the_four_point_rule_agrees_with_other_programs() {
    let error = clip(Quadrature::Fast).compliance_error("compliance_4_points");
    assert!(error < 1e-9, "{error:e}");
}

/// The rule chosen element by element meets a fixed one of degree 20; degree 8 misses by 8e-6.
#[test]
fn compliance_by_the_converged_rule_agrees_with_degree_20() {
    let error = clip(Quadrature::Converged).compliance_error("compliance_degree_20");
    assert!(error < 1e-8, "{error:e}");
    let error = clip(Quadrature::Degree(20)).compliance_error("compliance_degree_20");
    assert!(error < 1e-9, "{error:e}");
}

/// The nodal forces of a pose give its displacements, strain, stress and rotation.
#[test]
fn extremes_of_a_contact_pose_agree_with_other_programs() {
    let clip = clip(Quadrature::Fast);
    let pose = &clip.expected["pose"];
    let mut force = vec![0.0; clip.factor.n_dofs()];
    for active in pose["active"].as_array().unwrap() {
        let node = clip.node(active["node"].as_u64().unwrap()) as usize;
        let size = active["normal_force_N"].as_f64().unwrap();
        for c in 0..3 {
            force[3 * node + c] += size * active["normal"][c].as_f64().unwrap();
        }
    }
    let u = clip.factor.solve(&force);
    let largest = u.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    for (tag, expected) in pose["sample_displacement_m"].as_object().unwrap() {
        let node = clip.node(tag.parse().unwrap()) as usize;
        for c in 0..3 {
            let difference = u[3 * node + c] - expected[c].as_f64().unwrap();
            assert!(
                difference.abs() < 1e-9 * largest,
                "node {tag}: {difference:e}"
            );
        }
    }
    let of_element = vec![0; clip.mesh.n_elements()];
    let extremes = Extremes::of(&clip.mesh, &[clip.material], &of_element, &u);
    for (name, ours) in [
        ("max_principal_strain", extremes.max_principal_strain),
        ("max_von_mises_Pa", extremes.max_von_mises),
        ("max_rotation_rad", extremes.max_rotation),
    ] {
        let expected = pose[name].as_f64().unwrap();
        assert!(
            (ours / expected - 1.0).abs() < 1e-9,
            "{name}: {ours} {expected}"
        );
    }
}
