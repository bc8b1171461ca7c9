//! What can be wrong with a mesh, a material or a stiffness.

/// Errors of this crate. The text says what, where and the mend.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The mesh file is not what it should be.
    #[error("{place}: {what}")]
    Format {
        /// Line (ASCII) or byte (binary).
        place: String,
        /// What is wrong there, and the mend.
        what: String,
    },
    /// The mesh file has a version that is not read.
    #[error(
        "MSH version {found} is not read; convert it with `gmsh {file} -save -format msh41 -o {file}`"
    )]
    Version {
        /// As in the file.
        found: String,
        /// Name of the file.
        file: String,
    },
    /// No tetrahedra.
    #[error(
        "the mesh has no tetrahedra of order 1, 2 or 3{found}; mesh the volume with `gmsh -3 -order 2 -format msh41`"
    )]
    NoTetrahedra {
        /// Other kinds that were found, or nothing.
        found: String,
    },
    /// A volume without tetrahedra, because Gmsh saves only what is in a group.
    #[error(
        "the mesh has no tetrahedra: {volumes} in no physical group, and Gmsh saves only what is in one; \
         add `Physical Volume(\"body\") = {{{tags}}};` to the model and mesh it again with `gmsh -3 -order 2 -format msh41`"
    )]
    VolumeInNoGroup {
        /// "its volume 1 is", or as many as there are.
        volumes: String,
        /// Their tags.
        tags: String,
    },
    /// Elements of several orders.
    #[error("the mesh mixes tetrahedra of orders {0} and {1}; make it anew with one `-order`")]
    MixedOrders(u8, u8),
    /// A coordinate that is not a number.
    #[error("node {tag} has a coordinate that is not finite")]
    CoordinateNotFinite {
        /// Tag in the file.
        tag: u64,
    },
    /// An element of negative or no volume.
    #[error(
        "element {tag} is inverted or has no volume (smallest Jacobian {jacobian:.3e} m³{more}); \
         repair the mesh, or make it anew with `-optimize_ho` if it is curved"
    )]
    Inverted {
        /// Tag in the file.
        tag: u64,
        /// m³: smallest bound of the determinant of the Jacobian.
        jacobian: f64,
        /// " and N more", or nothing.
        more: String,
    },
    /// An element that is valid is not so at another order.
    #[error(
        "element {tag} becomes inverted or flat at order {order} (smallest Jacobian {jacobian:.3e} m³{more}); \
         ask for order = {from}, or make the mesh anew with `gmsh -order {order} -optimize_ho`, finer where it curves"
    )]
    OrderInvalid {
        /// Tag in the file.
        tag: u64,
        /// The order asked for.
        order: u8,
        /// The order that the mesh has.
        from: u8,
        /// m³: smallest bound of the determinant of the Jacobian.
        jacobian: f64,
        /// "; N more are too", or nothing.
        more: String,
    },
    /// Neighbours that do not share the nodes of their common edge or face.
    #[error(
        "element {tag} does not fit its neighbours: node {node} has another place in one of them, \
         or they have another node at its place; make the mesh anew, with coincident nodes merged"
    )]
    NotConforming {
        /// Tag of the element in the file.
        tag: u64,
        /// Tag of the node in the file.
        node: u64,
    },
    /// A face of a group that is on no element, so that a new order or size of elements gives it
    /// no nodes.
    #[error(
        "group {group:?}: the face with the corner nodes {}, {}, {} is of no element; \
         delete it, or mesh the volume behind it",
        tags[0], tags[1], tags[2]
    )]
    FaceOfNoElement {
        /// Name of the group.
        group: String,
        /// Tags of the corner nodes in the file.
        tags: [u64; 3],
    },
    /// Nothing holds the body, or too little does.
    #[error(
        "the body is not held: free rigid motion {motions}; name a group of nodes in `fixed` that stops it"
    )]
    FreeRigidMotion {
        /// The motions in words.
        motions: String,
    },
    /// A part of the mesh is not joined to the rest and not held.
    #[error(
        "disconnected, loose piece: {elements} elements around element {tag} are joined to nothing that is \
         `fixed` (free rigid motion {motions}); join the piece, hold it, or delete it"
    )]
    LoosePiece {
        /// Tag of an element of the piece.
        tag: u64,
        /// Elements of the piece.
        elements: usize,
        /// The motions in words.
        motions: String,
    },
    /// A material constant out of range.
    #[error("{name} = {value} {rule}")]
    Material {
        /// Name of the constant.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
    /// A group has no faces to load.
    #[error("group {0:?} has no faces, so no load can act on it")]
    NoFaces(String),
    /// The faces of a group have no area, so a total force cannot be spread over them.
    #[error("the faces of group {0:?} have an area of {1} m²; no force can be spread over them")]
    NoArea(String, f64),
    /// The factorisation met a pivot that is not positive.
    #[error(
        "the stiffness is not positive definite (pivot {pivot}): the body is not held, or its elements are degenerate"
    )]
    NotPositiveDefinite {
        /// Number of the pivot.
        pivot: usize,
    },
    /// The solver has not enough memory or refuses the size.
    #[error("the factorisation does not fit: {0}")]
    TooLarge(String),
    /// A check after the build failed.
    #[error(
        "the compliance fails its check: {what} is {value:.1e}, must be below {limit:.0e}; the part is too badly conditioned"
    )]
    CheckFailed {
        /// Which check.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its limit.
        limit: f64,
    },
    /// A point outside of the mesh.
    #[error("the point {0:?} m is in no element")]
    OutsideMesh([f64; 3]),
    /// The user stopped it.
    #[error("stopped")]
    Cancelled,
}

impl Error {
    /// Whether the user stopped the work.
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Cancelled)
    }
}
