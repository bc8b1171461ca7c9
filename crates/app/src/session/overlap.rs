//! A tool that overlaps the part at the start.

use fem::Mesh;
use glam::DVec3;

use super::{SessionSpec, part_extent};
use crate::Error;
use crate::engine::Engine;

/// A tool that starts inside the part has no path to where it is: refused with the depth.
pub(super) fn refuse_overlap(
    spec: &SessionSpec,
    mesh: &Mesh,
    engine: &Engine,
) -> Result<(), Error> {
    let tool = engine.tool();
    let deepest = mesh
        .surface_nodes()
        .into_iter()
        .map(|node| {
            let x = DVec3::from_array(mesh.nodes[node as usize]);
            (
                tool.signed_distance(&spec.tool_pose, x).signed_distance,
                node,
            )
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((distance, node)) = deepest
        && distance < 0.0
    {
        return Err(Error::Input(format!(
            "the tool starts inside the part: node {} of the mesh is {:.3} mm inside it; move \
             tool.position back, against hand.direction",
            mesh.node_tags[node as usize],
            -1e3 * distance
        )));
    }
    // A tool smaller than an element can hide between the nodes.
    let inside = tool
        .tessellate(part_extent(mesh))
        .0
        .into_iter()
        .map(|p| spec.tool_pose * p)
        .find(|p| fem::stress::locate(mesh, p.to_array()).is_some());
    match inside {
        Some(p) => Err(Error::Input(format!(
            "the tool starts inside the part: its surface at {:.4} {:.4} {:.4} m is in an element; \
             move tool.position back, against hand.direction",
            p.x, p.y, p.z
        ))),
        None => Ok(()),
    }
}
