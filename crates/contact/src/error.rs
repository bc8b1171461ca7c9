//! What can go wrong, by cause, with the data to find it.

use std::path::PathBuf;

use glam::DVec3;

/// What a message's coordinates are counted in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinates {
    /// m.
    Metres,
    /// As they stand in the mesh file, where a modelling program finds them again.
    OfFile,
}

impl std::fmt::Display for Coordinates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Metres => "m",
            Self::OfFile => "(coordinates of the file)",
        })
    }
}

/// Errors of this crate: refused input. A solver's outcome is not an error, see [`crate::lcp::Status`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A length, radius or other size is not finite and positive.
    #[error("{what} is {value}, it must be finite and above 0")]
    NotPositive {
        /// Which quantity, in words.
        what: &'static str,
        /// Its value, SI units.
        value: f64,
    },
    /// A value that must be finite is not.
    #[error("{what} {index} is not finite; remove or repair it")]
    NotFinite {
        /// Which quantity, in words.
        what: &'static str,
        /// Position in the list it came from.
        index: usize,
    },
    /// A slice has the wrong length.
    #[error("{what} has {actual} entries, expected {expected}")]
    Length {
        /// Which slice.
        what: &'static str,
        /// Length needed.
        expected: usize,
        /// Length given.
        actual: usize,
    },
    /// A face names a node that does not exist.
    #[error("face {face} names node {node}, the part has {n_nodes} that can touch or are held")]
    NoSuchNode {
        /// Face, from 0.
        face: usize,
        /// The node it names, from 0.
        node: u32,
        /// Candidates and held nodes together.
        n_nodes: usize,
    },
    /// The complementarity problem is larger than its scratch.
    #[error("{rows} contact rows exceed the capacity of {capacity}; make the scratch larger")]
    Capacity {
        /// Rows of the problem.
        rows: usize,
        /// Rows the scratch was made for.
        capacity: usize,
    },
    /// A friction coefficient is negative or not finite.
    #[error(
        "the friction coefficient of contact {contact} is {value}, it must be finite and not below 0"
    )]
    NegativeFriction {
        /// Contact, from 0.
        contact: usize,
        /// Its coefficient.
        value: f64,
    },
    /// A matrix that must be symmetric is not, by more than round-off.
    #[error(
        "matrix entry ({row}, {column}) is {value}, ({column}, {row}) is {mirrored}; the method needs a symmetric matrix"
    )]
    NotSymmetric {
        /// Row of the entry, from 0.
        row: usize,
        /// Its column, from 0.
        column: usize,
        /// The entry.
        value: f64,
        /// Its mirror image.
        mirrored: f64,
    },
    /// A mesh file could not be read.
    #[error("{}: {cause}", path.display())]
    MeshFile {
        /// The file.
        path: PathBuf,
        /// What the reader said.
        cause: String,
    },
    /// A mesh file of a kind we do not read.
    #[error("{}: unknown mesh format, use .stl or .obj", path.display())]
    MeshFormat {
        /// The file.
        path: PathBuf,
    },
    /// A mesh without any triangle.
    #[error("the tool mesh has no triangles")]
    MeshEmpty,
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, the mesh has {n_vertices}")]
    MeshIndex {
        /// Triangle, from 0.
        triangle: usize,
        /// The vertex it names, from 0.
        vertex: u32,
        /// Vertices in the mesh.
        n_vertices: usize,
    },
    /// A triangle without area between three different points.
    #[error(
        "tool mesh triangle {triangle} at {position} {coordinates} has no area; repair the mesh"
    )]
    MeshZeroArea {
        /// Triangle, from 0.
        triangle: usize,
        /// Its centre.
        position: DVec3,
        /// What these are counted in.
        coordinates: Coordinates,
    },
    /// An edge with one triangle only: inside and outside are undefined.
    #[error(
        "tool mesh is open at the edge from {start} to {end} {coordinates} ({n_edges} open edges); close it"
    )]
    MeshOpen {
        /// Start of the first open edge.
        start: DVec3,
        /// End of the first open edge.
        end: DVec3,
        /// How many open edges there are.
        n_edges: usize,
        /// What these are counted in.
        coordinates: Coordinates,
    },
    /// An edge shared by more than two triangles.
    #[error(
        "tool mesh edge from {start} to {end} {coordinates} is shared by {n_triangles} triangles; two are needed"
    )]
    MeshEdgeNotManifold {
        /// Start of the edge.
        start: DVec3,
        /// End of the edge.
        end: DVec3,
        /// Triangles on it.
        n_triangles: usize,
        /// What these are counted in.
        coordinates: Coordinates,
    },
    /// Two pieces of surface touch in a single vertex.
    #[error(
        "tool mesh surfaces touch in the single vertex {position} {coordinates}; separate them"
    )]
    MeshVertexNotManifold {
        /// The vertex.
        position: DVec3,
        /// What these are counted in.
        coordinates: Coordinates,
    },
    /// A one-sided surface, as a Moebius strip.
    #[error(
        "tool mesh has no consistent outside, see the edge from {start} to {end} {coordinates}"
    )]
    MeshNotOrientable {
        /// Start of an edge where the sides contradict.
        start: DVec3,
        /// End of that edge.
        end: DVec3,
        /// What these are counted in.
        coordinates: Coordinates,
    },
    /// A closed mesh that encloses nothing.
    #[error("tool mesh encloses no volume; it needs an inside")]
    MeshNoVolume,
    /// A distance field of a tool without an end.
    #[error(
        "a half-space and an infinite cylinder have no distance field; use them as they are, they answer fast"
    )]
    FieldUnbounded,
    /// A distance field that would not know in from out anywhere in its band.
    #[error(
        "the distance field's error of {error} m exceeds its band of {band} m; ask for a smaller error or a wider band"
    )]
    FieldErrorAboveBand {
        /// Wanted bound of the error, m.
        error: f64,
        /// Half width of the band, m.
        band: f64,
    },
    /// A distance field larger than allowed.
    #[error(
        "the distance field needs about {bytes} bytes, {max_bytes} are allowed; accept a larger error or a narrower band"
    )]
    FieldMemory {
        /// What the whole would take: counted or, where the build was stopped, taken on from the part that was made.
        bytes: usize,
        /// What is allowed.
        max_bytes: usize,
    },
}

pub(crate) fn check_positive(what: &'static str, value: f64) -> Result<f64, Error> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(Error::NotPositive { what, value })
    }
}
