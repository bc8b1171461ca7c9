//! Gmsh MSH 2 and 4, text and binary.
//!
//! Read by hand: the available library drops physical names, assumes consecutive node tags
//! instead of reading them, and panics on some damaged files.
//!
//! Source: Gmsh reference manual, "MSH file format" (version 4.1) and "Legacy formats" (4.0, 2).

mod build;
mod kind;
mod reader;
mod version2;
mod version4;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::Mesh;
use crate::Error;
use kind::Kind;
use reader::Reader;

/// Reads a mesh file.
///
/// # Errors
/// [`Error::Format`] with the place in the file, [`Error::Version`], [`Error::NoTetrahedra`],
/// [`Error::VolumeInNoGroup`], [`Error::MixedOrders`], [`Error::CoordinateNotFinite`].
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
    let mut version = None;
    let mut file = File::default();
    while let Some(section) = reader.section()? {
        match (section.as_str(), version) {
            ("NOD" | "NOE", None) => return Err(other_version("1", path)),
            ("MeshFormat", _) => version = Some(read_format(&mut reader, path)?),
            ("Nodes" | "Elements" | "Entities" | "PartitionedEntities", None) => {
                return Err(reader.wrong_line(
                    "is no Gmsh mesh: $MeshFormat is to come before the first section with numbers",
                ));
            }
            ("PhysicalNames", _) => file.read_names(&mut reader)?,
            ("Nodes", Some(Version::V2)) => file.read_nodes_2(&mut reader)?,
            ("Elements", Some(Version::V2)) => file.read_elements_2(&mut reader)?,
            ("ParametricNodes", Some(Version::V2)) => {
                return Err(reader.wrong_line(
                    "holds parametric nodes, which are not read; save the mesh without them (Mesh.SaveParametric = 0)",
                ));
            }
            ("Entities", Some(v)) => file.read_entities(&mut reader, v)?,
            ("PartitionedEntities", Some(v)) => file.read_partitioned_entities(&mut reader, v)?,
            ("Nodes", Some(v)) => file.read_nodes_4(&mut reader, v)?,
            ("Elements", Some(v)) => file.read_elements_4(&mut reader, v)?,
            _ => {
                reader.skip_section(&section)?;
                continue;
            }
        }
        reader.end_of(&section)?;
    }
    if version.is_none() {
        return Err(reader.wrong("is no Gmsh mesh: it is empty or has no $MeshFormat"));
    }
    file.into_mesh()
}

/// How numbers and tags are laid out.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
enum Version {
    /// 2 to 2.2: every element says its group.
    V2,
    /// Tags are 32-bit, nodes and their tags alternate.
    V40,
    #[default]
    V41,
}

fn other_version(found: &str, path: &Path) -> Error {
    let file = path.file_name().unwrap_or(path.as_os_str());
    Error::Version {
        found: found.to_owned(),
        file: file.to_string_lossy().into_owned(),
    }
}

fn read_format(reader: &mut Reader<'_>, path: &Path) -> Result<Version, Error> {
    let found = reader.word()?;
    let version = match found.as_str() {
        "2" | "2.0" | "2.1" | "2.2" => Version::V2,
        "4" | "4.0" => Version::V40,
        "4.1" => Version::V41,
        _ => return Err(other_version(&found, path)),
    };
    let is_binary = reader.word()? == "1";
    if is_binary && version == Version::V40 {
        return Err(other_version(&format!("{found} in binary"), path));
    }
    if reader.word()? != "8" {
        return Err(reader.wrong("has a data size other than 8 bytes; save it with a 64-bit Gmsh"));
    }
    if is_binary {
        reader.begin_binary()?;
    }
    Ok(version)
}

/// Sections of the file as they stand there.
#[derive(Default)]
struct File {
    names: HashMap<(i32, i32), String>,
    /// Physical tags of an entity (dimension, tag).
    physical: HashMap<(i32, i32), Vec<i32>>,
    /// Entities whose elements stand with those that a partitioned file made of them.
    split: HashSet<(i32, i32)>,
    node_tags: Vec<u64>,
    nodes: Vec<[f64; 3]>,
    blocks: Vec<Block>,
    /// Whether an element stands there once for each of its groups.
    repeats_elements: bool,
}

/// Elements that have kind and groups in common.
struct Block {
    groups: GroupsOf,
    kind: Kind,
    tags: Vec<u64>,
    nodes: Vec<u64>,
}

/// Where the groups of a block are said.
#[derive(Clone, Copy, PartialEq, Eq)]
enum GroupsOf {
    /// With the entity of this dimension and tag.
    Entity(i32, i32),
    /// Here: one physical tag, 0 for none.
    Tag(i32),
}

impl File {
    /// Text also in binary files.
    fn read_names(&mut self, reader: &mut Reader<'_>) -> Result<(), Error> {
        let n = reader.text_line()?;
        let Ok(n) = n.trim().parse::<usize>() else {
            return Err(reader.wrong_line("the number of physical names was expected"));
        };
        for _ in 0..n {
            let line = reader.text_line()?;
            let Some((dimension, tag, name)) = physical_name(&line) else {
                return Err(reader.wrong_line("a physical name needs dimension, tag and \"name\""));
            };
            self.names.insert((dimension, tag), name.to_owned());
        }
        Ok(())
    }
}

/// Dimension, tag and name, with any white space between them; the name may hold some too.
fn physical_name(line: &str) -> Option<(i32, i32, &str)> {
    let (dimension, rest) = line.trim().split_once(char::is_whitespace)?;
    let (tag, name) = rest.trim_start().split_once(char::is_whitespace)?;
    let name = name.trim();
    let inner = name.strip_prefix('"').and_then(|n| n.strip_suffix('"'));
    let name = inner.unwrap_or(name);
    Some((dimension.parse().ok()?, tag.parse().ok()?, name))
}

fn in_mesh(what: String) -> Error {
    Error::Format {
        place: "mesh".to_owned(),
        what,
    }
}
