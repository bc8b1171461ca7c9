//! Gmsh's element types.

use crate::element::Order;

/// What an element is for us.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Point,
    Line(Order),
    Triangle(Order),
    Tetrahedron(Order),
    /// Not used; a solid among them is refused. Gmsh's number.
    Other(i32),
}

/// Kind and number of nodes.
pub(super) fn kind_of(element_type: i32) -> Option<(Kind, usize)> {
    use Order::{Cubic, Linear, Quadratic};
    Some(match element_type {
        15 => (Kind::Point, 1),
        1 => (Kind::Line(Linear), 2),
        8 => (Kind::Line(Quadratic), 3),
        26 => (Kind::Line(Cubic), 4),
        2 => (Kind::Triangle(Linear), 3),
        9 => (Kind::Triangle(Quadratic), 6),
        21 => (Kind::Triangle(Cubic), 10),
        4 => (Kind::Tetrahedron(Linear), 4),
        11 => (Kind::Tetrahedron(Quadratic), 10),
        29 => (Kind::Tetrahedron(Cubic), 20),
        3 => (Kind::Other(3), 4),
        5 => (Kind::Other(5), 8),
        6 => (Kind::Other(6), 6),
        7 => (Kind::Other(7), 5),
        10 => (Kind::Other(10), 9),
        12 => (Kind::Other(12), 27),
        13 => (Kind::Other(13), 18),
        14 => (Kind::Other(14), 14),
        16 => (Kind::Other(16), 8),
        17 => (Kind::Other(17), 20),
        18 => (Kind::Other(18), 15),
        19 => (Kind::Other(19), 13),
        23 => (Kind::Other(23), 15),
        27 => (Kind::Other(27), 5),
        28 => (Kind::Other(28), 6),
        30 => (Kind::Other(30), 35),
        31 => (Kind::Other(31), 56),
        _ => return None,
    })
}

/// Names of solids that are not tetrahedra of order 1 to 3.
pub(super) fn solid_name(element_type: i32) -> Option<&'static str> {
    match element_type {
        5 | 12 | 17 => Some("hexahedra"),
        6 | 13 | 18 => Some("prisms"),
        7 | 14 | 19 => Some("pyramids"),
        30 | 31 => Some("tetrahedra of order 4 or 5"),
        _ => None,
    }
}

pub(super) fn unknown(element_type: i32) -> String {
    format!(
        "element type {element_type} is not known; only tetrahedra of order 1, 2 and 3 are used"
    )
}
