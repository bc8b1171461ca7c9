//! The constrained part: what the step needs to free interface nodes while it is touched.

use fem::{BubbleCompliance, Hierarchy, Rule};

use super::{BubbleReach, LoadedPart, assemble, budget};
use crate::Error;
use crate::machine::Machine;
use crate::progress::Ui;

/// Builds it; it is not cached: the method is there to be compared.
///
/// # Errors
/// A part without interface nodes; what does not fit into memory; as `fem` reports them; Ctrl-C.
pub(super) fn build(
    loaded: &LoadedPart,
    reach: BubbleReach,
    ui: &Ui<'_>,
) -> Result<BubbleCompliance, Error> {
    let path = &loaded.spec.mesh_path;
    let hierarchy = Hierarchy::of(&loaded.mesh);
    if hierarchy.interface_nodes().is_empty() {
        return Err(Error::Input(format!(
            "{}: elements of order 1 have no interface nodes to constrain; set accuracy.order to 2 \
             or 3, or accuracy.adaptive = \"off\"",
            path.display()
        )));
    }
    let bubbles = within_reach(loaded, &hierarchy, reach);
    let needed = BubbleCompliance::bytes(loaded.candidates.len(), loaded.rows.len(), bubbles.len());
    let available = Machine::read().available_memory as f64;
    if needed > available {
        return Err(Error::Input(format!(
            "{}: the constrained part needs about {} for {} interface nodes that may be freed and {} \
             are free; use a smaller adaptive radius, or method = \"select\", which needs nothing more",
            path.display(),
            budget::bytes(needed),
            bubbles.len(),
            budget::bytes(available),
        )));
    }
    let stiffness = assemble(loaded)?;
    let constraints = hierarchy.constrain(
        hierarchy.interface_nodes(),
        &loaded.supports,
        Rule::AffineExact,
    );
    BubbleCompliance::build(
        &stiffness,
        &loaded.supports,
        &constraints,
        &loaded.candidates,
        &loaded.rows,
        &bubbles,
        &ui.progress(),
    )
    .map_err(|e| Error::part(path, e))
}

/// Interface nodes that may ever be freed, ascending.
fn within_reach(loaded: &LoadedPart, hierarchy: &Hierarchy, reach: BubbleReach) -> Vec<u32> {
    let BubbleReach::Within(distance) = reach else {
        return hierarchy.interface_nodes().to_vec();
    };
    let x = |node: u32| glam::DVec3::from_array(loaded.mesh.nodes[node as usize]);
    let is_near = |node: &u32| {
        let here = x(*node);
        let mut candidates = loaded.candidates.iter();
        candidates.any(|c| (x(*c) - here).length_squared() <= distance * distance)
    };
    let interface = hierarchy.interface_nodes().iter().copied();
    interface.filter(is_near).collect()
}
