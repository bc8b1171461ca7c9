//! Gmsh MSH 4.1, ASCII and binary.
//!
//! Read by hand: the available library drops physical names, assumes consecutive node tags
//! instead of reading them, and panics on some damaged files.
//!
//! Source: Gmsh reference manual, "MSH file format" (version 4.1).

mod reader;

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use super::{Face, Group, Mesh};
use crate::Error;
use crate::element::Order;
use reader::Reader;

/// Reads a mesh file.
///
/// # Errors
/// [`Error::Format`] with the place in the file, [`Error::Version`], [`Error::NoTetrahedra`],
/// [`Error::MixedOrders`], [`Error::CoordinateNotFinite`].
pub fn read(path: &Path) -> Result<Mesh, Error> {
    let bytes = std::fs::read(path).map_err(|e| Error::Format {
        place: "opening the file".to_owned(),
        what: e.to_string(),
    })?;
    read_bytes(&bytes, path)
}

/// Reads a mesh from memory; `path` is only named in errors.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(bytes: &[u8], path: &Path) -> Result<Mesh, Error> {
    let mut reader = Reader::new(bytes);
    let mut file = File::default();
    let mut seen_format = false;
    while let Some(section) = reader.section()? {
        if !seen_format && section != "MeshFormat" {
            return Err(reader.wrong_line("is no Gmsh mesh: it does not begin with $MeshFormat"));
        }
        match section.as_str() {
            "MeshFormat" => {
                read_format(&mut reader, path)?;
                seen_format = true;
            }
            "PhysicalNames" => file.read_names(&mut reader)?,
            "Entities" => file.read_entities(&mut reader)?,
            "Nodes" => file.read_nodes(&mut reader)?,
            "Elements" => file.read_elements(&mut reader)?,
            _ => {
                reader.skip_section(&section)?;
                continue;
            }
        }
        reader.end_of(&section)?;
    }
    if !seen_format {
        return Err(reader.wrong("is no Gmsh mesh: it is empty"));
    }
    file.into_mesh()
}

fn read_format(reader: &mut Reader<'_>, path: &Path) -> Result<(), Error> {
    let version = reader.word()?;
    if version != "4.1" {
        let file = path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
            .into_owned();
        return Err(Error::Version {
            found: version,
            file,
        });
    }
    let is_binary = reader.word()? == "1";
    if reader.word()? != "8" {
        return Err(reader.wrong("has a data size other than 8 bytes; save it with a 64-bit Gmsh"));
    }
    if is_binary {
        reader.begin_binary()?;
    }
    Ok(())
}

/// Sections of the file as they stand there.
#[derive(Default)]
struct File {
    names: HashMap<(i32, i32), String>,
    /// Physical tags of an entity (dimension, tag).
    physical: HashMap<(i32, i32), Vec<i32>>,
    node_tags: Vec<u64>,
    nodes: Vec<[f64; 3]>,
    blocks: Vec<Block>,
}

struct Block {
    entity: (i32, i32),
    kind: Kind,
    tags: Vec<u64>,
    nodes: Vec<u64>,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Triangle(Order),
    Tetrahedron(Order),
    Other(i32),
}

/// Gmsh's element types: kind and number of nodes.
fn kind_of(element_type: i32) -> Option<(Kind, usize)> {
    Some(match element_type {
        2 => (Kind::Triangle(Order::Linear), 3),
        9 => (Kind::Triangle(Order::Quadratic), 6),
        21 => (Kind::Triangle(Order::Cubic), 10),
        4 => (Kind::Tetrahedron(Order::Linear), 4),
        11 => (Kind::Tetrahedron(Order::Quadratic), 10),
        29 => (Kind::Tetrahedron(Order::Cubic), 20),
        // Points and lines carry nothing that is needed; other solids are counted and refused.
        1 => (Kind::Other(1), 2),
        3 => (Kind::Other(3), 4),
        5 => (Kind::Other(5), 8),
        6 => (Kind::Other(6), 6),
        7 => (Kind::Other(7), 5),
        8 => (Kind::Other(8), 3),
        10 => (Kind::Other(10), 9),
        12 => (Kind::Other(12), 27),
        13 => (Kind::Other(13), 18),
        14 => (Kind::Other(14), 14),
        15 => (Kind::Other(15), 1),
        16 => (Kind::Other(16), 8),
        17 => (Kind::Other(17), 20),
        18 => (Kind::Other(18), 15),
        19 => (Kind::Other(19), 13),
        23 => (Kind::Other(23), 15),
        26 => (Kind::Other(26), 4),
        27 => (Kind::Other(27), 5),
        28 => (Kind::Other(28), 6),
        30 => (Kind::Other(30), 35),
        31 => (Kind::Other(31), 56),
        _ => return None,
    })
}

/// Names of solids that are not tetrahedra of order 1 to 3.
fn solid_name(element_type: i32) -> Option<&'static str> {
    match element_type {
        5 | 12 | 17 => Some("hexahedra"),
        6 | 13 | 18 => Some("prisms"),
        7 | 14 | 19 => Some("pyramids"),
        30 | 31 => Some("tetrahedra of order 4 or 5"),
        _ => None,
    }
}

impl File {
    fn read_names(&mut self, reader: &mut Reader<'_>) -> Result<(), Error> {
        // Text also in binary files.
        let n = reader.text_line()?.trim().parse::<usize>().unwrap_or(0);
        for _ in 0..n {
            let line = reader.text_line()?;
            let mut parts = line.trim().splitn(3, ' ');
            let dimension = parts.next().and_then(|s| s.parse().ok());
            let tag = parts.next().and_then(|s| s.parse().ok());
            let (Some(dimension), Some(tag), Some(name)) = (dimension, tag, parts.next()) else {
                return Err(reader.wrong_line("a physical name needs dimension, tag and \"name\""));
            };
            self.names
                .insert((dimension, tag), name.trim().trim_matches('"').to_owned());
        }
        Ok(())
    }

    fn read_entities(&mut self, reader: &mut Reader<'_>) -> Result<(), Error> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = reader.count(8)?;
        }
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..count {
                let tag = reader.int()?;
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    reader.float()?;
                }
                let n = reader.count(4)?;
                // Gmsh makes the tag negative where a group reverses the entity.
                let physical = (0..n)
                    .map(|_| reader.int().map(i32::saturating_abs))
                    .collect::<Result<Vec<_>, _>>()?;
                self.physical.insert((dimension, tag), physical);
                if dimension > 0 {
                    for _ in 0..reader.count(4)? {
                        reader.int()?;
                    }
                }
            }
        }
        Ok(())
    }

    fn read_nodes(&mut self, reader: &mut Reader<'_>) -> Result<(), Error> {
        let n_blocks = reader.count(1)?;
        for _ in 0..3 {
            reader.size()?;
        }
        for _ in 0..n_blocks {
            let dimension = reader.int()?;
            reader.int()?;
            let is_parametric = reader.int()? != 0;
            let n = reader.count(8)?;
            for _ in 0..n {
                self.node_tags.push(reader.size()?);
            }
            for _ in 0..n {
                self.nodes
                    .push([reader.float()?, reader.float()?, reader.float()?]);
                for _ in 0..if is_parametric {
                    dimension.clamp(0, 3)
                } else {
                    0
                } {
                    reader.float()?;
                }
            }
        }
        Ok(())
    }

    fn read_elements(&mut self, reader: &mut Reader<'_>) -> Result<(), Error> {
        let n_blocks = reader.count(1)?;
        for _ in 0..3 {
            reader.size()?;
        }
        for _ in 0..n_blocks {
            let entity = (reader.int()?, reader.int()?);
            let element_type = reader.int()?;
            let Some((kind, n_nodes)) = kind_of(element_type) else {
                return Err(reader.wrong(&format!(
                    "element type {element_type} is not known; only tetrahedra of order 1, 2 and 3 are used"
                )));
            };
            let n = reader.count(8)?;
            let mut block = Block {
                entity,
                kind,
                tags: Vec::new(),
                nodes: Vec::new(),
            };
            for _ in 0..n {
                block.tags.push(reader.size()?);
                for _ in 0..n_nodes {
                    block.nodes.push(reader.size()?);
                }
            }
            self.blocks.push(block);
        }
        Ok(())
    }

    fn into_mesh(self) -> Result<Mesh, Error> {
        let mut node_of_tag: HashMap<u64, u32> = HashMap::with_capacity(self.nodes.len());
        for (i, (&tag, x)) in self.node_tags.iter().zip(&self.nodes).enumerate() {
            if !x.iter().all(|c| c.is_finite()) {
                return Err(Error::CoordinateNotFinite { tag });
            }
            if node_of_tag.insert(tag, i as u32).is_some() {
                return Err(in_mesh(format!("node {tag} is there twice")));
            }
        }
        let order = self.order()?;
        let mut elements = Vec::new();
        let mut element_tags = Vec::new();
        let mut groups: BTreeMap<(i32, i32), Group> = BTreeMap::new();
        for block in &self.blocks {
            let (dimension, n_nodes) = match block.kind {
                Kind::Triangle(o) if o == order => (2, order.nodes_per_face()),
                Kind::Tetrahedron(_) => (3, order.nodes_per_element()),
                _ => continue,
            };
            let physical = self
                .physical
                .get(&block.entity)
                .map_or(&[][..], Vec::as_slice);
            for (tag, nodes) in block.tags.iter().zip(block.nodes.chunks_exact(n_nodes)) {
                let indices: Vec<u32> = nodes
                    .iter()
                    .map(|node| {
                        node_of_tag.get(node).copied().ok_or_else(|| {
                            in_mesh(format!(
                                "element {tag} names node {node}, which is not in the file"
                            ))
                        })
                    })
                    .collect::<Result<_, _>>()?;
                for &p in physical {
                    let group = groups.entry((dimension, p)).or_insert_with(|| Group {
                        name: self
                            .names
                            .get(&(dimension, p))
                            .cloned()
                            .unwrap_or_else(|| format!("group-{p}")),
                        dimension: dimension as u8,
                        nodes: Vec::new(),
                        faces: Vec::new(),
                        elements: Vec::new(),
                    });
                    group.nodes.extend(&indices);
                    if dimension == 2 {
                        group.faces.push(Face {
                            nodes: indices.clone(),
                        });
                    } else {
                        group.elements.push(element_tags.len() as u32);
                    }
                }
                if dimension == 3 {
                    elements.extend(indices);
                    element_tags.push(*tag);
                }
            }
        }
        let groups = groups
            .into_values()
            .map(|mut group| {
                group.nodes.sort_unstable();
                group.nodes.dedup();
                // Older files list a triangle once for each group that it is in.
                let mut seen = std::collections::HashSet::new();
                group.faces.retain(|f| {
                    let mut key = f.nodes.clone();
                    key.sort_unstable();
                    seen.insert(key)
                });
                group
            })
            .collect();
        Ok(Mesh::new(
            order,
            self.nodes,
            self.node_tags,
            elements,
            element_tags,
            groups,
        ))
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
                Kind::Triangle(_) => {}
            }
        }
        match (order, others.first()) {
            (Some(order), None) => Ok(order),
            (_, found) => Err(Error::NoTetrahedra {
                found: found
                    .map(|name| format!(" alone: it has {name}"))
                    .unwrap_or_default(),
            }),
        }
    }
}

fn in_mesh(what: String) -> Error {
    Error::Format {
        place: "mesh".to_owned(),
        what,
    }
}
