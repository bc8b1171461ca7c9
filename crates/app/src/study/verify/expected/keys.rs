//! Keys of `expected.json`. Those that only describe are listed in docs/reference-cases.md.

use crate::study::verify::schema::{MOST, Shape};

const COUNT: Shape = Shape::Count(1, MOST);
pub(in crate::study::verify) const VECTOR: Shape = Shape::Exactly(3, &Shape::Number);
pub(in crate::study::verify) const VECTORS: Shape = Shape::ByNode(&VECTOR);
pub(in crate::study::verify) const MATRIX: Shape = Shape::List(&Shape::List(&Shape::Number));
const ORDER: Shape = Shape::Count(1, 3);

/// Keys of the file.
pub(in crate::study::verify) const FILE: Shape = Shape::Object(&[
    ("case", Shape::Text),
    ("title", Shape::Text),
    ("note", Shape::Text),
    (
        "mesh",
        Shape::Object(&[
            ("nodes", COUNT),
            ("elements", COUNT),
            ("order", ORDER),
            ("geometry", Shape::Choice(&["straight", "curved"])),
        ]),
    ),
    (
        "meshes",
        Shape::List(&Shape::Object(&[
            ("mesh", Shape::Text),
            ("divisions", Shape::List(&COUNT)),
            ("h_m", Shape::Positive),
            ("nodes", COUNT),
            ("elements", COUNT),
            ("nodal_rms_error_m", Shape::NotNegative),
            ("strain_energy_J", Shape::NotNegative),
            ("ngsolve_L2_error", Shape::NotNegative),
            ("ngsolve_strain_energy_J", Shape::NotNegative),
        ])),
    ),
    ("programs", Shape::Any),
    ("node_numbers", Shape::Text),
    ("condition_number_of_free_stiffness", Shape::Positive),
    ("min_dihedral_deg", Shape::Positive),
    ("slivers", Shape::Count(0, MOST)),
    // Looked at one by one, see `super::check_quantities`.
    ("quantities", Shape::Any),
    (
        "expected_error",
        Shape::Object(&[
            ("must_name", Shape::List(&Shape::Text)),
            ("cause", Shape::Text),
            ("checked", Shape::Text),
            ("note", Shape::Text),
            ("exit_nonzero", Shape::Flag),
            ("rigid_modes", Shape::Count(0, MOST)),
            ("pieces", COUNT),
            ("elements_per_piece", Shape::List(&COUNT)),
            ("element_tag", COUNT),
            ("inverted_count", COUNT),
            ("volume_m3", Shape::Number),
        ]),
    ),
]);

/// Keys of a quantity.
pub(in crate::study::verify) const QUANTITY: Shape = Shape::Object(&[
    ("name", Shape::Text),
    ("unit", Shape::Text),
    // By the name, see `super::Form`.
    ("value", Shape::Any),
    (
        "tolerance",
        Shape::Object(&[("rel", Shape::Fraction), ("abs", Shape::Positive)]),
    ),
    ("informative", Shape::Flag),
    ("quadrature", Shape::Text),
    ("nodes", Shape::List(&COUNT)),
    ("point_m", VECTOR),
    ("edge_nodes", Shape::List(&COUNT)),
    ("edge_weights", Shape::List(&Shape::Number)),
    ("file", Shape::Text),
    ("note", Shape::Text),
    ("sources", Shape::Any),
    ("solver", Shape::Any),
    ("layout", Shape::Text),
    ("depth_m", Shape::Number),
    ("substeps", COUNT),
    ("handbook_ratio", Shape::Number),
    ("tolerances", Shape::Any),
    ("tolerance_same_model", Shape::Any),
    ("agreement_rel", Shape::NotNegative),
    ("getfem_agreement_rel", Shape::NotNegative),
    ("stiffness_agreement_rel", Shape::NotNegative),
    (
        "largest_force_change_from_substeps1_rel",
        Shape::NotNegative,
    ),
]);

/// Value of a pose of the tool.
pub(in crate::study::verify) const POSE_VALUE: Shape = Shape::Object(&[
    ("force_on_tool_N", VECTOR),
    ("torque_on_tool_Nm", VECTOR),
    ("sample_displacement_m", VECTORS),
    (
        "one_pass_planes_at_rest",
        Shape::Object(&[
            ("force_on_tool_N", VECTOR),
            ("active_count", Shape::Count(0, MOST)),
        ]),
    ),
    ("max_displacement_m", Shape::NotNegative),
    ("max_principal_strain", Shape::Number),
    ("max_von_mises_Pa", Shape::NotNegative),
    ("max_rotation_rad", Shape::NotNegative),
    ("active", Shape::Any),
    ("active_count", Shape::Count(0, MOST)),
    ("certificate", Shape::Any),
    ("checks", Shape::Any),
    ("iterations", Shape::Count(0, MOST)),
    ("pose", Shape::Any),
    ("largest_active_radius_m", Shape::NotNegative),
    ("smallest_gap_of_all_candidates_m", Shape::Number),
    ("note", Shape::Text),
]);

/// Value of a complementarity problem.
pub(in crate::study::verify) const LCP_VALUE: Shape = Shape::Object(&[
    ("nodes", Shape::List(&COUNT)),
    ("q", Shape::List(&Shape::Number)),
    ("M", MATRIX),
    ("solution_z", Shape::List(&Shape::Number)),
    ("redundant", Shape::Any),
    ("note", Shape::Text),
]);

/// Value of a path of the tool.
pub(in crate::study::verify) const INSERTION_VALUE: Shape = Shape::Object(&[
    ("peak_force_N", Shape::Number),
    ("axis_y_at_peak_m", Shape::Number),
    ("min_force_N", Shape::Number),
    ("max_principal_strain", Shape::Number),
    ("work_to_zero_J", Shape::Number),
    ("note", Shape::Text),
]);

const NUMBERS: Shape = Shape::List(&Shape::Number);
const BY_POSE: Shape = Shape::List(&VECTOR);

/// Value of a path with friction: one entry for each listed pose.
pub(in crate::study::verify) const PATH_VALUE: Shape = Shape::Object(&[
    ("force_on_tool_N", BY_POSE),
    ("torque_on_tool_Nm", BY_POSE),
    ("dissipated_J", NUMBERS),
    ("elastic_energy_J", NUMBERS),
    ("work_total_J", NUMBERS),
    ("normal_force_sum_N", NUMBERS),
    ("sticking", Shape::Any),
    ("slipping", Shape::Any),
    ("note", Shape::Text),
]);

/// How many nodes stick or slip is not unique: one without force makes it round-off.
pub(in crate::study::verify) const PATH_COMPARED: [&str; 6] = [
    "force_on_tool_N",
    "torque_on_tool_Nm",
    "dissipated_J",
    "elastic_energy_J",
    "work_total_J",
    "normal_force_sum_N",
];

/// Value of the peaks and totals of a path; without friction with the forces beside.
pub(in crate::study::verify) const SUMMARY_VALUE: Shape = Shape::Object(&[
    ("axis", Shape::Choice(&["x", "y", "z"])),
    ("peak_force_N", Shape::Number),
    ("peak_pose", COUNT),
    ("peak_at_m", Shape::Number),
    ("min_force_N", Shape::Number),
    ("min_pose", COUNT),
    ("min_at_m", Shape::Number),
    ("dissipated_total_J", Shape::Number),
    ("work_total_J", Shape::Number),
    ("force_on_tool_N", BY_POSE),
    ("note", Shape::Text),
]);

pub(in crate::study::verify) const SUMMARY_COMPARED: [&str; 8] = [
    "peak_force_N",
    "peak_pose",
    "peak_at_m",
    "min_force_N",
    "min_pose",
    "min_at_m",
    "dissipated_total_J",
    "work_total_J",
];

/// What friction takes is none here, and the work of a closed way is none: round-off of both programs.
pub(in crate::study::verify) const FRICTIONLESS_COMPARED: [&str; 7] = [
    "force_on_tool_N",
    "peak_force_N",
    "peak_pose",
    "peak_at_m",
    "min_force_N",
    "min_pose",
    "min_at_m",
];

/// Value of a pose of a path with friction.
pub(in crate::study::verify) const STATE_VALUE: Shape = Shape::Object(&[
    ("pose", Shape::Any),
    ("force_on_tool_N", VECTOR),
    ("torque_on_tool_Nm", VECTOR),
    ("sample_displacement_m", VECTORS),
    ("active", Shape::Any),
    ("certificate", Shape::Any),
    ("smallest_gap_of_all_contact_nodes_m", Shape::Number),
    ("checks", Shape::Any),
    ("note", Shape::Text),
]);

/// Forces and slips of single nodes are not unique where a node carries no force.
pub(in crate::study::verify) const STATE_COMPARED: [&str; 3] = [
    "force_on_tool_N",
    "torque_on_tool_Nm",
    "sample_displacement_m",
];

/// Value of the problem of one increment.
pub(in crate::study::verify) const PROBLEM_VALUE: Shape = Shape::Object(&[
    ("nodes", Shape::List(&COUNT)),
    ("frames", Shape::Any),
    ("friction", Shape::NotNegative),
    ("M", MATRIX),
    ("q", NUMBERS),
    ("solution_r", NUMBERS),
    ("y", NUMBERS),
    ("residual", Shape::NotNegative),
    ("note", Shape::Text),
]);

pub(in crate::study::verify) const PROBLEM_COMPARED: [&str; 2] = ["solution_r", "y"];
