//! Nodes at regular places of the elements of a mesh, each once however many elements share it:
//! what raising the order and refining have in common.

use std::collections::HashMap;

use super::{Face, Group, Mesh};
use crate::Error;
use crate::element::{FACE_VERTICES, MAX_NODES, Order};

/// A place between vertices of the mesh: each vertex with its weight, in steps, by ascending
/// vertex. Whichever element asks for a place on a shared edge or face, the key is the same.
type Key = [(u32, u8); 4];

/// Fills the unused entries of a [`Key`].
const UNUSED: (u32, u8) = (u32::MAX, 0);

/// Nodes of a mesh in the making, on the lattice of the elements of the old one.
pub(super) struct Lattice<'a> {
    old: &'a Mesh,
    /// Steps of the lattice from vertex to vertex.
    steps: u8,
    known: HashMap<Key, u32>,
    nodes: Vec<[f64; 3]>,
    node_tags: Vec<u64>,
    /// New index of each old node that stays.
    kept: Vec<Option<u32>>,
    next_tag: u64,
}

impl<'a> Lattice<'a> {
    /// Begins with the old nodes that are places of the lattice, in their old sequence and with
    /// their tags; those that are of no element are left out.
    ///
    /// # Errors
    /// [`Error::NotConforming`] if neighbours do not share the nodes of their common edge or face,
    /// which would be glued or torn by giving each place one node.
    pub(super) fn new(old: &'a Mesh, steps: u8) -> Result<Self, Error> {
        let places = weights(old.order);
        let mut key_of_node: Vec<Option<Key>> = vec![None; old.n_nodes()];
        let mut node_of_key = HashMap::with_capacity(old.n_nodes());
        for e in 0..old.n_elements() {
            let nodes = old.element_nodes(e);
            for (&node, place) in nodes.iter().zip(&places) {
                let key = key(&nodes[..4], place);
                let place_before = key_of_node[node as usize].replace(key);
                let node_before = node_of_key.insert(key, node);
                if place_before.is_some_and(|k| k != key) || node_before.is_some_and(|n| n != node)
                {
                    return Err(Error::NotConforming {
                        tag: old.element_tags[e],
                        node: old.node_tags[node as usize],
                    });
                }
            }
        }
        let mut lattice = Self {
            old,
            steps,
            known: HashMap::with_capacity(2 * old.n_nodes()),
            nodes: Vec::new(),
            node_tags: Vec::new(),
            kept: vec![None; old.n_nodes()],
            next_tag: old.node_tags.iter().max().map_or(1, |t| t.wrapping_add(1)),
        };
        for (node, key) in key_of_node.into_iter().enumerate() {
            let Some(key) = key.and_then(|k| rescaled(k, old.order as u8, steps)) else {
                continue;
            };
            let index = lattice.nodes.len() as u32;
            lattice.known.insert(key, index);
            lattice.kept[node] = Some(index);
            lattice.nodes.push(old.nodes[node]);
            lattice.node_tags.push(old.node_tags[node]);
        }
        Ok(lattice)
    }

    /// The node at a place of an old element, made on the element's map if it is new.
    pub(super) fn node(&mut self, element: usize, place: &[u8; 4]) -> u32 {
        let key = key(&self.old.element_nodes(element)[..4], place);
        if let Some(&index) = self.known.get(&key) {
            return index;
        }
        let index = self.nodes.len() as u32;
        let l = place.map(|w| f64::from(w) / f64::from(self.steps));
        self.nodes.push(self.old.point(element, l));
        // A file may use the largest number there is; then go on with the free ones from 0.
        while self.old.node_of_tag(self.next_tag).is_some() {
            self.next_tag = self.next_tag.wrapping_add(1);
        }
        self.node_tags.push(self.next_tag);
        self.next_tag = self.next_tag.wrapping_add(1);
        self.known.insert(key, index);
        index
    }

    /// The mesh of these elements. `faces` gives, for every face that takes the place of an old
    /// one, its nodes as places on the old face; `children` how many elements take the place of
    /// each old one, one behind the other.
    ///
    /// # Errors
    /// [`Error::FaceOfNoElement`].
    pub(super) fn into_mesh(
        self,
        order: Order,
        elements: Vec<u32>,
        element_tags: Vec<u64>,
        faces: &[Vec<[u8; 3]>],
        children: u32,
    ) -> Result<Mesh, Error> {
        let n_local = order.nodes_per_element();
        let groups = self
            .old
            .groups
            .iter()
            .map(|old| {
                let mut group = Group {
                    name: old.name.clone(),
                    dimension: old.dimension,
                    nodes: Vec::new(),
                    lines: old
                        .lines
                        .iter()
                        .flat_map(|line| self.lines(line, order))
                        .collect(),
                    faces: Vec::with_capacity(old.faces.len() * faces.len()),
                    elements: Vec::with_capacity(old.elements.len() * children as usize),
                };
                for face in &old.faces {
                    for places in faces {
                        group.faces.push(self.face(old, face, places)?);
                    }
                }
                for &e in &old.elements {
                    group.elements.extend(children * e..children * e + children);
                }
                if old.faces.is_empty() && old.elements.is_empty() && old.lines.is_empty() {
                    // Only nodes: those that are still there.
                    let stay = old.nodes.iter().filter_map(|&n| self.kept[n as usize]);
                    group.nodes.extend(stay);
                } else {
                    group
                        .nodes
                        .extend(group.faces.iter().flat_map(|f| &f.nodes));
                    group.nodes.extend(group.lines.iter().flatten());
                    for &e in &group.elements {
                        let first = e as usize * n_local;
                        group.nodes.extend(&elements[first..first + n_local]);
                    }
                }
                group.nodes.sort_unstable();
                group.nodes.dedup();
                Ok(group)
            })
            .collect::<Result<Vec<Group>, Error>>()?;
        let mut mesh = Mesh::new(
            order,
            self.nodes,
            self.node_tags,
            elements,
            element_tags,
            groups,
        );
        mesh.shared_names.clone_from(&self.old.shared_names);
        mesh.left_out_volumes.clone_from(&self.old.left_out_volumes);
        Ok(mesh)
    }

    /// The lines that take the place of an old one; none for a line that is the edge of no element.
    fn lines(&self, old: &[u32], order: Order) -> Vec<Vec<u32>> {
        let places = (0..=self.steps).map(|k| [self.steps - k, k]);
        let nodes: Option<Vec<u32>> = places
            .map(|place| self.known.get(&key(&old[..2], &place)).copied())
            .collect();
        let n_steps = usize::from(order as u8);
        let of_line = |part: &[u32]| {
            let ends = [part[0], part[n_steps]];
            [&ends, &part[1..n_steps]].concat()
        };
        let nodes = nodes.unwrap_or_default();
        let parts = nodes.windows(n_steps + 1).step_by(n_steps);
        parts.map(of_line).collect()
    }

    /// The face with nodes at these places of an old face.
    fn face(&self, group: &Group, old: &Face, places: &[[u8; 3]]) -> Result<Face, Error> {
        let vertices = &old.nodes[..3];
        let nodes: Option<Vec<u32>> = places
            .iter()
            .map(|place| self.known.get(&key(vertices, place)).copied())
            .collect();
        match nodes {
            Some(nodes) => Ok(Face { nodes }),
            None => Err(Error::FaceOfNoElement {
                group: group.name.clone(),
                tags: [0, 1, 2].map(|k| self.old.node_tags[vertices[k] as usize]),
            }),
        }
    }
}

impl Mesh {
    /// Where a local point of an element is, m.
    pub(crate) fn point(&self, element: usize, l: [f64; 4]) -> [f64; 3] {
        let (mut values, mut unused) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
        self.order.shape(l, &mut values, &mut unused);
        let mut point = [0.0; 3];
        for (&node, value) in self.element_nodes(element).iter().zip(values) {
            for (p, x) in point.iter_mut().zip(self.nodes[node as usize]) {
                *p += value * x;
            }
        }
        point
    }
}

/// Places of the nodes of an element of this order, in steps of 1 / order.
pub(super) fn weights(order: Order) -> Vec<[u8; 4]> {
    let steps = f64::from(order as u8);
    order
        .node_coordinates()
        .into_iter()
        .map(|l| l.map(|x| (steps * x).round() as u8))
        .collect()
}

/// Places of the nodes of Gmsh's triangle of this order, in steps of 1 / order.
pub(super) fn face_weights(order: Order) -> Vec<[u8; 3]> {
    let weights = weights(order);
    order
        .face_nodes(0)
        .into_iter()
        .map(|node| FACE_VERTICES[0].map(|v| weights[node][v]))
        .collect()
}

/// Key of the place that has these weights of these vertices.
fn key(vertices: &[u32], place: &[u8]) -> Key {
    let mut key = [UNUSED; 4];
    let mut n = 0;
    for (&vertex, &weight) in vertices.iter().zip(place) {
        if weight > 0 {
            key[n] = (vertex, weight);
            n += 1;
        }
    }
    key[..n].sort_unstable();
    key
}

/// The same place in other steps, if it is on that lattice.
fn rescaled(mut key: Key, from: u8, to: u8) -> Option<Key> {
    for (_, weight) in &mut key {
        if !(*weight * to).is_multiple_of(from) {
            return None;
        }
        *weight = *weight * to / from;
    }
    Some(key)
}
