//! The same elements at another order.

use super::Mesh;
use super::lattice::{Lattice, face_weights, weights};
use crate::Error;
use crate::element::Order;

impl Mesh {
    /// The same elements at another order, with all new nodes on the present (curved) elements.
    ///
    /// Raising keeps the shape exactly: order 1 stays straight, order 2 stays the parabolas that
    /// it is. Lowering puts the nodes of the lower order where the present map has them, which
    /// cuts off the rest of the curvature.
    ///
    /// The vertices stay, in their sequence and with their tags; they come first. The other nodes
    /// follow in the sequence of the elements, with tags from the largest tag + 1. So a tag that both
    /// meshes have is the same node in both ([`Mesh::node_of_tag`]), and no other node is shared.
    /// Nodes of no element are left out. Elements keep their sequence and tags, groups
    /// their names, faces (same sense of turning) and elements; a group that is only a list of
    /// nodes keeps those that are still there. The present order gives a copy.
    ///
    /// # Errors
    /// [`Error::OrderInvalid`] if an element turns inside out or flat at that order,
    /// [`Error::Inverted`] if it already is, [`Error::NotConforming`],
    /// [`Error::FaceOfNoElement`].
    pub fn with_order(&self, order: Order) -> Result<Self, Error> {
        if order == self.order {
            return Ok(self.clone());
        }
        let mut lattice = Lattice::new(self, order as u8)?;
        let places = weights(order);
        let mut elements = Vec::with_capacity(self.n_elements() * places.len());
        for e in 0..self.n_elements() {
            elements.extend(places.iter().map(|place| lattice.node(e, place)));
        }
        let mesh = lattice.into_mesh(
            order,
            elements,
            self.element_tags.clone(),
            &[face_weights(order)],
            1,
        )?;
        if order > self.order {
            // The same shape, so that it is valid as it was.
            self.check_elements()?;
            return Ok(mesh);
        }
        let invalid = mesh.invalid_elements();
        let Some((worst, jacobian)) = invalid.worst else {
            return Ok(mesh);
        };
        // One that was wrong before must be mended before; its order is not to blame.
        self.check_elements()?;
        Err(Error::OrderInvalid {
            tag: self.element_tags[worst],
            order: order as u8,
            from: self.order as u8,
            jacobian,
            more: invalid.others_in_words(),
        })
    }
}
