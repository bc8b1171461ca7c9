//! A tool that overlaps the part at the start.

use contact::face::{Face, FaceOrder};
use fem::Mesh;
use glam::DVec3;

use contact::tool::Tool;
use glamx::DPose3;

use super::part_extent;
use crate::Error;

/// Of the part's size, a depth that is rounding: the tool just touches.
const TOUCH: f64 = 1e-9;

/// Whether the tool may start in the part, and the unit of the message if it may not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// The scene wants it so.
    pub may_overlap: bool,
    /// Length unit of messages: its name, and m.
    pub length_unit: (&'static str, f64),
}

/// A tool that starts inside the part has no path to where it is: refused with the depth, unless the scene wants it so.
///
/// # Errors
/// That, with the place.
pub fn refuse_overlap(
    clearance: &Clearance,
    mesh: &Mesh,
    tool: &Tool,
    tool_pose: &DPose3,
) -> Result<(), Error> {
    if clearance.may_overlap {
        return Ok(());
    }
    let touch = TOUCH * part_extent(mesh) + tool.error_bound();
    let mend = "move tool.position back, against the direction of approach, or write tool.start = \"overlap\" for a \
                fit that is tight from the start";
    let deepest = mesh
        .surface_nodes()
        .into_iter()
        .map(|node| {
            let x = DVec3::from_array(mesh.nodes[node as usize]);
            (tool.signed_distance(tool_pose, x).signed_distance, node)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((distance, node)) = deepest
        && distance < -touch
    {
        return Err(Error::Input(format!(
            "the tool starts inside the part: node {} of the mesh is {} inside it; {mend}",
            mesh.node_tags[node as usize],
            length(-distance, clearance),
        )));
    }
    // A tool smaller than an element can hide between the nodes.
    let surface = DeepSurface::of(mesh);
    let inside = tool
        .tessellate(part_extent(mesh))
        .0
        .into_iter()
        .map(|p| *tool_pose * p)
        .filter(|p| fem::stress::locate(mesh, p.to_array()).is_some())
        .map(|p| (surface.depth(p), p))
        .find(|(depth, _)| *depth > touch);
    match inside {
        Some((depth, p)) => {
            let (unit, scale) = clearance.length_unit;
            let p = p / scale;
            Err(Error::Input(format!(
                "the tool starts inside the part: its surface at {:.4} {:.4} {:.4} {unit} is {} deep in an element; {mend}",
                p.x,
                p.y,
                p.z,
                length(depth, clearance),
            )))
        }
        None => Ok(()),
    }
}

/// A length in the scene's unit, with digits that show it.
fn length(metres: f64, clearance: &Clearance) -> String {
    let (unit, scale) = clearance.length_unit;
    let x = metres / scale;
    if (1e-2..1e4).contains(&x) {
        format!("{x:.3} {unit}")
    } else {
        format!("{x:.1e} {unit}")
    }
}

/// The part's boundary, to tell how deep a point of an element is.
struct DeepSurface {
    order: Option<FaceOrder>,
    faces: Vec<Vec<DVec3>>,
}

impl DeepSurface {
    fn of(mesh: &Mesh) -> Self {
        let place = |node: &u32| DVec3::from_array(mesh.nodes[*node as usize]);
        let faces: Vec<Vec<DVec3>> = mesh
            .boundary_faces()
            .iter()
            .map(|face| face.nodes.iter().map(place).collect())
            .collect();
        Self {
            order: faces.first().and_then(|f| FaceOrder::with_nodes(f.len())),
            faces,
        }
    }

    /// m, from a point to the nearest place of the boundary.
    fn depth(&self, p: DVec3) -> f64 {
        let Some(order) = self.order else {
            return 0.0;
        };
        let distances = self.faces.iter().map(|places| {
            let nearest = Face::new(order, places).nearest(p);
            (nearest.position - p).length()
        });
        distances.fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_told_in_the_scenes_unit_with_digits_that_show_them() {
        let mut clearance = super::super::tests::spec().clearance;
        assert_eq!(length(6.7139e-3, &clearance), "6.7e-3 m");
        assert_eq!(length(0.25, &clearance), "0.250 m");
        clearance.length_unit = ("mm", 1e-3);
        assert_eq!(length(6.7139e-3, &clearance), "6.714 mm");
        assert_eq!(length(1.23e-9, &clearance), "1.2e-6 mm");
    }
}
