//! A part whose inside is of a higher order than its surface.
//!
//! A step reads the compliance of the surface's nodes only, whatever lies inside: elements that bend rightly cost it
//! nothing. With the nodes of the surface's order among those of the inside's, C is that of these nodes in the finer
//! part; the contact surface and the drawn shape stay what they are.

use std::borrow::Cow;

use fem::{Mesh, Order, Supports};

use super::PartSpec;
use super::load::held;
use crate::Error;

/// The mesh that is solved on.
#[derive(Debug)]
pub struct Interior {
    /// The same elements at the inside's order, in metres.
    pub mesh: Mesh,
    /// Held degrees of freedom of it.
    pub supports: Supports,
    /// By node of the surface's mesh: the same node here; `None` for one of no element.
    node_of: Vec<Option<u32>>,
}

impl Interior {
    /// `None` where the inside is of the surface's order.
    ///
    /// # Errors
    /// An order that does not keep the nodes of the surface's, or that the elements cannot have.
    pub(super) fn of(surface: &Mesh, spec: &PartSpec) -> Result<Option<Self>, Error> {
        let path = &spec.mesh_path;
        let own = surface.order as u8;
        let Some(number) = spec.interior_order.filter(|number| *number != own) else {
            return Ok(None);
        };
        let order = Order::try_from_number(number);
        let Some(order) =
            order.filter(|order| *order as u8 > own && (*order as u8).is_multiple_of(own))
        else {
            let fitting: Vec<String> = (own..=Order::HIGHEST)
                .filter(|n| n.is_multiple_of(own))
                .map(|n| n.to_string())
                .collect();
            return Err(Error::Input(format!(
                "{}: part.interior_order = {number} does not keep the nodes of elements of order {own}: write {}",
                path.display(),
                fitting.join(" or ")
            )));
        };
        let mesh = surface
            .with_order(order)
            .map_err(|e| Error::part(path, e))?;
        let supports = held(&mesh, spec)?;
        let node_of = surface.node_tags.iter();
        Ok(Some(Self {
            node_of: node_of.map(|tag| mesh.node_of_tag(*tag)).collect(),
            supports,
            mesh,
        }))
    }

    /// Nodes of the surface's mesh as nodes of this one. All are of elements.
    pub(crate) fn nodes(&self, of_surface: &[u32]) -> Vec<u32> {
        let here = of_surface
            .iter()
            .filter_map(|node| self.node_of[*node as usize]);
        here.collect()
    }

    /// Forces (N, 3 node + component) on nodes of the surface's mesh as forces here.
    pub(crate) fn forces(&self, of_surface: &[f64]) -> Vec<f64> {
        let mut forces = vec![0.0; 3 * self.mesh.n_nodes()];
        for (force, node) in of_surface.chunks_exact(3).zip(&self.node_of) {
            if let Some(node) = node {
                forces[3 * *node as usize..][..3].copy_from_slice(force);
            }
        }
        forces
    }

    /// Numbers of the nodes here, `N` of each, at the nodes of the surface's mesh; `missing` for those of no element.
    pub(crate) fn at_surface<const N: usize>(&self, here: &[f64], missing: f64) -> Vec<f64> {
        let at = |node: &Option<u32>| -> [f64; N] {
            node.map_or([missing; N], |node| {
                std::array::from_fn(|c| here[N * node as usize + c])
            })
        };
        self.node_of.iter().flat_map(at).collect()
    }

    /// By node here: the same node of the surface's mesh, where it is one.
    pub(crate) fn surface_nodes(&self) -> Vec<Option<u32>> {
        let mut nodes = vec![None; self.mesh.n_nodes()];
        for (surface, here) in (0..).zip(&self.node_of) {
            if let Some(here) = here {
                nodes[*here as usize] = Some(surface);
            }
        }
        nodes
    }
}

/// Mesh, supports and nodes that are solved on, in place of those of the surface.
impl super::LoadedPart {
    /// The mesh that is solved on.
    pub fn solved_mesh(&self) -> &Mesh {
        self.interior.as_ref().map_or(&self.mesh, |i| &i.mesh)
    }

    /// Its held degrees of freedom.
    pub fn solved_supports(&self) -> &Supports {
        self.interior
            .as_ref()
            .map_or(&self.supports, |i| &i.supports)
    }

    /// Nodes of the part as nodes of the mesh that is solved on.
    pub(crate) fn solved_nodes<'a>(&self, nodes: &'a [u32]) -> Cow<'a, [u32]> {
        match &self.interior {
            None => Cow::Borrowed(nodes),
            Some(interior) => Cow::Owned(interior.nodes(nodes)),
        }
    }
}
