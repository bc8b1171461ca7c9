//! Nodes, elements and named groups.

pub mod gmsh;
mod lattice;
mod measure;
mod quality;
mod raise;
mod refine;
mod topology;
mod validity;

use std::collections::HashMap;

use crate::element::Order;

/// A face of an element: node indices in the order of Gmsh's triangle of the mesh's order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Face {
    /// 3, 6 or 10 node indices.
    pub nodes: Vec<u32>,
}

/// A physical group of the mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Name in the file; `group-N` if it has none.
    pub name: String,
    /// 0 for points, 1 for curves, 2 for faces, 3 for elements.
    pub dimension: u8,
    /// Node indices, ascending, each once.
    pub nodes: Vec<u32>,
    /// Lines of a group of dimension 1: 2, 3 or 4 node indices in the order of Gmsh's line, the ends first.
    pub lines: Vec<Vec<u32>>,
    /// Faces of a group of dimension 2.
    pub faces: Vec<Face>,
    /// Element indices of a group of dimension 3.
    pub elements: Vec<u32>,
}

/// A mesh of tetrahedra of one order. Coordinates in metres once the caller has scaled them.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Order of all elements.
    pub order: Order,
    /// Coordinates.
    pub nodes: Vec<[f64; 3]>,
    /// Tags of the nodes in the file.
    pub node_tags: Vec<u64>,
    /// Node indices, `order.nodes_per_element()` for each element, in the order of [`crate::element`].
    pub elements: Vec<u32>,
    /// Tags of the elements in the file.
    pub element_tags: Vec<u64>,
    /// Named groups.
    pub groups: Vec<Group>,
    /// Names that several physical groups of one dimension have, with how many have it: in [`Mesh::groups`] they are
    /// one group.
    pub shared_names: Vec<(String, usize)>,
    /// Tags of the volumes that the file names, but in no group and without elements: Gmsh saves only what is in a
    /// group.
    pub left_out_volumes: Vec<i32>,
    node_of_tag: HashMap<u64, u32>,
}

impl Mesh {
    /// Puts a mesh together; the lengths must fit.
    ///
    /// # Panics
    /// If there are not as many tags as nodes or elements (a programmer's mistake).
    pub fn new(
        order: Order,
        nodes: Vec<[f64; 3]>,
        node_tags: Vec<u64>,
        elements: Vec<u32>,
        element_tags: Vec<u64>,
        groups: Vec<Group>,
    ) -> Self {
        assert_eq!(nodes.len(), node_tags.len(), "one tag for each node");
        assert_eq!(
            elements.len(),
            element_tags.len() * order.nodes_per_element(),
            "one tag for each element"
        );
        let node_of_tag = node_tags
            .iter()
            .zip(0..)
            .map(|(&tag, i)| (tag, i))
            .collect();
        Self {
            order,
            nodes,
            node_tags,
            elements,
            element_tags,
            groups,
            shared_names: Vec::new(),
            left_out_volumes: Vec::new(),
            node_of_tag,
        }
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.nodes.len()
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.element_tags.len()
    }

    /// Node indices of an element.
    pub fn element_nodes(&self, element: usize) -> &[u32] {
        let n = self.order.nodes_per_element();
        &self.elements[element * n..(element + 1) * n]
    }

    /// Coordinates of an element's nodes; the first `nodes_per_element` are set.
    pub(crate) fn element_coordinates(
        &self,
        element: usize,
    ) -> [[f64; 3]; crate::element::MAX_NODES] {
        let mut x = [[0.0; 3]; crate::element::MAX_NODES];
        for (x, &node) in x.iter_mut().zip(self.element_nodes(element)) {
            *x = self.nodes[node as usize];
        }
        x
    }

    /// The group of this name; of several the faces, then the elements, the curves, the points.
    pub fn group(&self, name: &str) -> Option<&Group> {
        let named = self.groups.iter().filter(|g| g.name == name);
        named.min_by_key(|g| [3, 2, 0, 1][usize::from(g.dimension.min(3))])
    }

    /// Index of the node with this tag in the file.
    pub fn node_of_tag(&self, tag: u64) -> Option<u32> {
        self.node_of_tag.get(&tag).copied()
    }

    /// Multiplies all coordinates, to convert a unit of length.
    pub fn scale(&mut self, factor: f64) {
        for x in &mut self.nodes {
            *x = x.map(|c| c * factor);
        }
    }
}
