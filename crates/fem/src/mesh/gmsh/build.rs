//! From the sections of a file to a mesh.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::kind::{Kind, solid_name};
use super::{Block, File, GroupsOf, in_mesh};
use crate::Error;
use crate::element::Order;
use crate::mesh::{Face, Group, Mesh};

/// Physical groups by dimension and tag.
type Groups = BTreeMap<(i32, i32), Group>;

/// Elements so far.
#[derive(Default)]
struct Elements {
    nodes: Vec<u32>,
    tags: Vec<u64>,
    /// Where the element with these corners is, if the file repeats elements.
    known: HashMap<[u32; 4], u32>,
}

impl File {
    pub(super) fn into_mesh(self) -> Result<Mesh, Error> {
        let node_of_tag = self.node_of_tag()?;
        let order = self.order()?;
        let mut elements = Elements::default();
        let mut groups = Groups::new();
        for block in &self.blocks {
            self.add(block, order, &node_of_tag, &mut elements, &mut groups)?;
        }
        let (groups, shared_names) = one_group_for_each_name(groups);
        let left_out_volumes = self.volumes_without_elements();
        let mut mesh = Mesh::new(
            order,
            self.nodes,
            self.node_tags,
            elements.nodes,
            elements.tags,
            groups,
        );
        mesh.shared_names = shared_names;
        mesh.left_out_volumes = left_out_volumes;
        Ok(mesh)
    }

    /// Volumes in no group of which there is no element, ascending.
    fn volumes_without_elements(&self) -> Vec<i32> {
        let of_block = |block: &Block| match block.groups {
            GroupsOf::Entity(dimension, tag) if !block.tags.is_empty() => Some((dimension, tag)),
            _ => None,
        };
        let filled: HashSet<_> = self.blocks.iter().filter_map(of_block).collect();
        let mut volumes = self.loose_volumes();
        volumes.retain(|tag| !filled.contains(&(3, *tag)) && !self.split.contains(&(3, *tag)));
        volumes
    }

    /// Volumes in no group, ascending.
    fn loose_volumes(&self) -> Vec<i32> {
        let is_loose = |((dimension, _), groups): &(&(i32, i32), &Vec<i32>)| {
            *dimension == 3 && groups.is_empty()
        };
        let loose = self.physical.iter().filter(is_loose);
        let mut tags: Vec<i32> = loose.map(|((_, tag), _)| *tag).collect();
        tags.sort_unstable();
        tags
    }

    fn node_of_tag(&self) -> Result<HashMap<u64, u32>, Error> {
        let mut node_of_tag = HashMap::with_capacity(self.nodes.len());
        for (i, (&tag, x)) in self.node_tags.iter().zip(&self.nodes).enumerate() {
            if !x.iter().all(|c| c.is_finite()) {
                return Err(Error::CoordinateNotFinite { tag });
            }
            if node_of_tag.insert(tag, i as u32).is_some() {
                return Err(in_mesh(format!("node {tag} is there twice")));
            }
        }
        Ok(node_of_tag)
    }

    /// Adds a block's elements to the part and to the block's groups.
    fn add(
        &self,
        block: &Block,
        order: Order,
        node_of_tag: &HashMap<u64, u32>,
        elements: &mut Elements,
        groups: &mut Groups,
    ) -> Result<(), Error> {
        let (dimension, n_nodes) = match block.kind {
            Kind::Point => (0, 1),
            Kind::Line(o) if o == order => (1, order as usize + 1),
            Kind::Triangle(o) if o == order => (2, order.nodes_per_face()),
            Kind::Tetrahedron(_) => (3, order.nodes_per_element()),
            _ => return Ok(()),
        };
        let physical = match &block.groups {
            GroupsOf::Entity(d, tag) => self
                .physical
                .get(&(*d, *tag))
                .map_or(&[][..], Vec::as_slice),
            GroupsOf::Tag(0) => &[],
            GroupsOf::Tag(tag) => std::slice::from_ref(tag),
        };
        for (&tag, nodes) in block.tags.iter().zip(block.nodes.chunks_exact(n_nodes)) {
            let nodes = indices(tag, nodes, node_of_tag)?;
            let element = if dimension == 3 {
                elements.add(tag, &nodes, self.repeats_elements)
            } else {
                0
            };
            for &p in physical {
                let group = groups.entry((dimension, p)).or_insert_with(|| Group {
                    name: self.name_of(dimension, p),
                    dimension: dimension as u8,
                    nodes: Vec::new(),
                    lines: Vec::new(),
                    faces: Vec::new(),
                    elements: Vec::new(),
                });
                group.nodes.extend(&nodes);
                match dimension {
                    1 => group.lines.push(nodes.clone()),
                    2 => group.faces.push(Face {
                        nodes: nodes.clone(),
                    }),
                    3 => group.elements.push(element),
                    _ => {}
                }
            }
        }
        Ok(())
    }

    fn name_of(&self, dimension: i32, physical: i32) -> String {
        let name = self.names.get(&(dimension, physical)).cloned();
        name.unwrap_or_else(|| format!("group-{physical}"))
    }

    /// The one order of all tetrahedra; other solids are refused.
    fn order(&self) -> Result<Order, Error> {
        let mut order = None;
        let mut others = Vec::new();
        for block in self.blocks.iter().filter(|b| !b.tags.is_empty()) {
            match block.kind {
                Kind::Tetrahedron(o) => match order {
                    Some(first) if first != o => {
                        return Err(Error::MixedOrders(first as u8, o as u8));
                    }
                    _ => order = Some(o),
                },
                Kind::Other(t) => others.extend(solid_name(t)),
                _ => {}
            }
        }
        match (order, others.first()) {
            (Some(order), None) => Ok(order),
            (None, None) => Err(self.no_solid()),
            (_, Some(name)) => Err(Error::NoTetrahedra {
                found: format!(" alone: it has {name}"),
            }),
        }
    }

    /// Why there are no solids at all.
    fn no_solid(&self) -> Error {
        let is_volume = |(dimension, _): &(i32, i32)| *dimension == 3;
        let loose = self.loose_volumes();
        let has_groups = self.physical.values().any(|p| !p.is_empty());
        let has_solid_group = self.names.keys().any(is_volume);
        let tags = || {
            loose
                .iter()
                .map(i32::to_string)
                .collect::<Vec<_>>()
                .join(", ")
        };
        match loose.len() {
            0 if self.repeats_elements && !has_solid_group && !self.blocks.is_empty() => {
                Error::VolumeInNoGroup {
                    volumes: "its volume is not meshed, or is".to_owned(),
                    tags: "1".to_owned(),
                }
            }
            1 if has_groups => Error::VolumeInNoGroup {
                volumes: format!("its volume {} is", tags()),
                tags: tags(),
            },
            2.. if has_groups => Error::VolumeInNoGroup {
                volumes: format!("its volumes {} are", tags()),
                tags: tags(),
            },
            _ => Error::NoTetrahedra {
                found: String::new(),
            },
        }
    }
}

impl Elements {
    /// Index of the element.
    fn add(&mut self, tag: u64, nodes: &[u32], may_be_known: bool) -> u32 {
        let next = self.tags.len() as u32;
        if may_be_known {
            let mut corners = [nodes[0], nodes[1], nodes[2], nodes[3]];
            corners.sort_unstable();
            let element = *self.known.entry(corners).or_insert(next);
            if element != next {
                return element;
            }
        }
        self.nodes.extend(nodes);
        self.tags.push(tag);
        next
    }
}

fn indices(tag: u64, nodes: &[u64], node_of_tag: &HashMap<u64, u32>) -> Result<Vec<u32>, Error> {
    let index = |node: &u64| {
        node_of_tag.get(node).copied().ok_or_else(|| {
            in_mesh(format!(
                "element {tag} names node {node}, which is not in the file"
            ))
        })
    };
    nodes.iter().map(index).collect()
}

/// Groups of one dimension and name as one group, and the names that several had.
fn one_group_for_each_name(groups: Groups) -> (Vec<Group>, Vec<(String, usize)>) {
    let mut by_name: Vec<(Group, usize)> = Vec::new();
    for group in groups.into_values() {
        let same = |(other, _): &&mut (Group, usize)| {
            other.dimension == group.dimension && other.name == group.name
        };
        match by_name.iter_mut().find(same) {
            Some((first, n)) => {
                first.nodes.extend(group.nodes);
                first.lines.extend(group.lines);
                first.faces.extend(group.faces);
                first.elements.extend(group.elements);
                *n += 1;
            }
            None => by_name.push((group, 1)),
        }
    }
    for (group, _) in &mut by_name {
        group.nodes.sort_unstable();
        group.nodes.dedup();
        // A file may list an element once for each group that it is in.
        group.elements.sort_unstable();
        group.elements.dedup();
        let mut seen = HashSet::new();
        group.faces.retain(|f| {
            let mut key = f.nodes.clone();
            key.sort_unstable();
            seen.insert(key)
        });
    }
    let shared = by_name.iter().filter(|(_, n)| *n > 1);
    let shared = shared.map(|(group, n)| (group.name.clone(), *n)).collect();
    (
        by_name.into_iter().map(|(group, _)| group).collect(),
        shared,
    )
}
