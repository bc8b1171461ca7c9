use std::sync::Arc;

use glamx::DPose3;
use proptest::prelude::*;

use super::*;
use crate::tool::{BoxShape, Capsule, Cylinder, HalfSpace, Mesh, Sphere};

const PLENTY: usize = 1 << 30;

fn mesh_of(tool: &Tool) -> Tool {
    let (vertices, triangles) = tool.tessellate(1.0);
    Tool::Mesh(Mesh::new(&vertices, &triangles).unwrap().into())
}

fn brick() -> Tool {
    Tool::Box(BoxShape::new(DVec3::new(0.3, 0.5, 0.2)).unwrap())
}

fn tools() -> Vec<Tool> {
    let ball = Tool::Sphere(Sphere::new(0.4).unwrap());
    vec![
        mesh_of(&ball),
        mesh_of(&brick()),
        ball,
        brick(),
        Tool::Capsule(Capsule::new(0.2, 0.4).unwrap()),
        Tool::Cylinder(Cylinder::new(0.3, Some(0.5)).unwrap()),
    ]
}

/// Each tool's field at two errors; the second is below what facets deviate from the ball. Made once.
fn fields() -> &'static [DistanceField] {
    static FIELDS: std::sync::LazyLock<Vec<DistanceField>> = std::sync::LazyLock::new(|| {
        let field = |tool, error| DistanceField::new(tool, error, 0.05, PLENTY).unwrap();
        let coarse = tools().into_iter().map(|tool| field(tool, 2e-3));
        let fine = tools().into_iter().map(|tool| field(tool, 5e-4));
        coarse.chain(fine).collect()
    });
    &FIELDS
}

fn point() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-0.8..0.8_f64).prop_map(DVec3::from_array)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// Half of the points are brought near the surface, where the field interpolates.
    #[test]
    fn answers_are_within_the_bound(p in point(), is_near in any::<bool>(), shift in -0.06..0.06_f64) {
        for field in fields() {
            let exact = field.tool().signed_distance_local(p);
            let way = if is_near { shift - exact.signed_distance } else { 0.0 };
            let p = p + way * exact.normal;
            let exact = field.tool().signed_distance_local(p);
            let answer = field.signed_distance_local(p);
            let off = (answer.signed_distance - exact.signed_distance).abs();
            prop_assert!(off <= field.error_bound(), "{field:?} at {p}: {off}");
            prop_assert!((answer.normal.length() - 1.0).abs() < 1e-12);
            if exact.signed_distance.abs() > field.band() + field.error_bound() {
                prop_assert_eq!(answer, exact);
            }
            // In the lattice nodes the angle is bounded, between them the exact normal turns by as much again.
            if field.interpolated(p).is_some() {
                let angle = answer.normal.angle_between(exact.normal);
                prop_assert!(angle < 2.0 * build::NORMAL_TOLERANCE, "{field:?} at {p}: {angle}");
            }
        }
    }

    /// Where a cell ends: its corners, edges and faces, a block's, and the next number to either side.
    #[test]
    fn answers_are_within_the_bound_where_cells_meet(
        at in prop::array::uniform3(0..4000_u32),
        off in prop::array::uniform3(-1..=1_i32),
        inside in 0.0..1.0_f64,
        on in 0..4_u32,
    ) {
        for field in fields() {
            let cells = field.n_blocks.map(|n| 8 * n as u32);
            let mut p = [0.0; 3];
            for k in 0..3 {
                let cell = f64::from(at[k] % cells[k]) + if k as u32 == on { inside } else { 0.0 };
                let place = field.origin[k] + cell / 8.0 / field.per_metre;
                p[k] = [place.next_down(), place, place.next_up()][(off[k] + 1) as usize];
            }
            let p = DVec3::from_array(p);
            let exact = field.tool().signed_distance_local(p).signed_distance;
            let answer = field.signed_distance_local(p);
            prop_assert!((answer.signed_distance - exact).abs() <= field.error_bound());
            prop_assert!((answer.normal.length() - 1.0).abs() < 1e-12);
        }
    }
}

/// Round tools ask nowhere to speak of, others along their edges and on the medial axis that starts there; the ball
/// of facets has many.
#[test]
fn most_of_the_band_is_interpolated() {
    let least = [0.7, 0.8, 0.99, 0.8, 0.99, 0.8];
    for (field, least) in fields().iter().zip(least.into_iter().cycle()) {
        let (mut n_band, mut n_interpolated) = (0, 0);
        for k in 0..20_000_u32 {
            // Additive recurrence of the plastic number's powers: even over the cube.
            let share = |x: f64| (f64::from(k) * x).fract() - 0.5;
            let p = 1.4 * DVec3::new(share(0.819_172_5), share(0.671_043_6), share(0.549_700_5));
            if field.tool().signed_distance_local(p).signed_distance.abs() < field.band() {
                n_band += 1;
                n_interpolated += u32::from(field.interpolated(p).is_some());
            }
        }
        let share = f64::from(n_interpolated) / f64::from(n_band);
        assert!(share > least, "{field:?}: {share}");
        assert!(field.exact_share() < 0.4 && field.n_cells() > 0);
        assert!(field.bytes() < 10_000_000);
    }
}

/// Beside a face, away from edges, the distance is linear, so is the interpolant: nothing but f32 is lost.
#[test]
fn flat_faces_are_exact_to_rounding_of_samples() {
    let field = DistanceField::new(mesh_of(&brick()), 1e-3, 0.05, PLENTY).unwrap();
    for shift in [-0.03, -0.01, 0.0, 0.02, 0.04] {
        let p = DVec3::new(0.05, -0.08, 0.2 + shift);
        let answer = field.interpolated(p).unwrap();
        assert!((answer.signed_distance - shift).abs() < 1e-8);
        assert!((answer.normal - DVec3::Z).length() < 1e-5);
    }
}

/// Lengths times a power of two: the same distances times that, to the last bit.
#[test]
fn scaling_by_a_power_of_two_changes_no_bit() {
    let unit = 2.0_f64.powi(-7);
    let field = |unit: f64| {
        let capsule = Tool::Capsule(Capsule::new(0.25 * unit, 0.5 * unit).unwrap());
        DistanceField::new(capsule, 1e-3 * unit, 0.0625 * unit, PLENTY).unwrap()
    };
    let (large, small) = (field(1.0), field(unit));
    assert_eq!(large.n_cells(), small.n_cells());
    for k in 0..1000 {
        let p = DVec3::new(0.26, 1e-4 * f64::from(k), 0.1);
        let (a, b) = (
            large.signed_distance_local(p),
            small.signed_distance_local(unit * p),
        );
        assert_eq!(a.signed_distance * unit, b.signed_distance);
        assert_eq!(a.normal, b.normal);
    }
}

#[test]
fn points_that_are_no_points_do_not_panic() {
    for field in fields() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            for axis in 0..3 {
                let mut p = DVec3::new(0.3, 0.0, 0.0);
                p[axis] = bad;
                assert!(field.interpolated(p).is_none());
            }
        }
        let _ = field.signed_distance_local(DVec3::NAN);
    }
}

#[test]
fn field_is_a_tool_as_the_one_inside() {
    let pose = DPose3::from_translation(DVec3::new(0.1, 0.2, 0.3));
    let inner = brick();
    let field = Arc::new(DistanceField::new(inner.clone(), 1e-3, 0.02, PLENTY).unwrap());
    let tool = Tool::Field(Arc::clone(&field));
    assert_eq!(tool.aabb(&pose), inner.aabb(&pose));
    assert_eq!(tool.characteristic_size(), inner.characteristic_size());
    assert_eq!(tool.tessellate(1.0), inner.tessellate(1.0));
    let p = DVec3::new(0.1, 0.2, 0.51);
    assert_eq!(
        tool.signed_distance(&pose, p),
        field.signed_distance_local(p - pose.translation)
    );
    // A field of a field is one of the tool.
    let again = DistanceField::new(tool, 1e-3, 0.02, PLENTY).unwrap();
    assert!(matches!(again.tool(), Tool::Box(_)));
    assert_eq!(again.samples, field.samples);
}

#[test]
fn what_cannot_be_is_refused() {
    let ball = || Tool::Sphere(Sphere::new(0.4).unwrap());
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for (error, band) in [(bad, 0.1), (1e-3, bad)] {
            let refused = DistanceField::new(ball(), error, band, PLENTY).unwrap_err();
            assert!(matches!(refused, Error::NotPositive { .. }), "{refused}");
        }
    }
    for endless in [
        Tool::HalfSpace(HalfSpace),
        Tool::Cylinder(Cylinder::new(0.3, None).unwrap()),
    ] {
        let refused = DistanceField::new(endless, 1e-3, 0.1, PLENTY).unwrap_err();
        assert_eq!(refused, Error::FieldUnbounded);
    }
    let refused = DistanceField::new(ball(), 0.2, 0.1, PLENTY).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "the distance field's error of 0.2 m exceeds its band of 0.1 m; ask for a smaller error or a wider band"
    );
}

/// Refused before the work where the grid alone is too large, on the way where the samples are.
#[test]
fn memory_above_the_limit_is_refused_with_what_is_needed() {
    let field = |error, max_bytes| {
        let ball = Tool::Sphere(Sphere::new(0.4).unwrap());
        DistanceField::new(ball, error, 0.1, max_bytes)
    };
    let needed = field(1e-3, PLENTY).unwrap().bytes();
    assert_eq!(field(1e-3, needed).unwrap().bytes(), needed);
    for max_bytes in [1, needed - 1] {
        let refused = field(1e-3, max_bytes).unwrap_err();
        assert!(
            matches!(refused, Error::FieldMemory { bytes, max_bytes: m } if bytes > m && m == max_bytes),
            "{refused}"
        );
    }
    for error in [1e-12, 1e-200, f64::MIN_POSITIVE] {
        let refused = field(error, PLENTY).unwrap_err();
        assert!(matches!(refused, Error::FieldMemory { .. }), "{refused}");
    }
}
