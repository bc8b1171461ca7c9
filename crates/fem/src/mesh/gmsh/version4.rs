//! Entities, nodes and elements of versions 4.0 and 4.1.

use super::kind::{kind_of, unknown};
use super::reader::Reader;
use super::{Block, File, GroupsOf, Version};
use crate::Error;

impl File {
    pub(super) fn read_entities(
        &mut self,
        reader: &mut Reader<'_>,
        version: Version,
    ) -> Result<(), Error> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = reader.count(8)?;
        }
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..count {
                let tag = reader.int()?;
                let physical = rest_of_entity(reader, version, dimension)?;
                self.physical.insert((dimension, tag), physical);
            }
        }
        Ok(())
    }

    /// What the entities of a partitioned mesh were cut into. Elements name these; a piece without groups of its own
    /// has those of its parent, if that is no piece of the border between partitions.
    pub(super) fn read_partitioned_entities(
        &mut self,
        reader: &mut Reader<'_>,
        version: Version,
    ) -> Result<(), Error> {
        reader.size()?;
        for _ in 0..2 * reader.count(8)? {
            reader.int()?;
        }
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = reader.count(8)?;
        }
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..count {
                let tag = reader.int()?;
                let parent = (reader.int()?, reader.int()?);
                for _ in 0..reader.count(4)? {
                    reader.int()?;
                }
                let mut physical = rest_of_entity(reader, version, dimension)?;
                if physical.is_empty() && parent.0 == dimension {
                    physical = self.physical.get(&parent).cloned().unwrap_or_default();
                }
                self.physical.insert((dimension, tag), physical);
                self.split.insert(parent);
            }
        }
        Ok(())
    }

    pub(super) fn read_nodes_4(
        &mut self,
        reader: &mut Reader<'_>,
        version: Version,
    ) -> Result<(), Error> {
        let n_blocks = reader.count(1)?;
        for _ in 0..n_head(version) {
            reader.size()?;
        }
        for _ in 0..n_blocks {
            let (first, second) = (reader.int()?, reader.int()?);
            let is_parametric = reader.int()? != 0;
            let n = reader.count(8)?;
            let dimension = if version == Version::V40 {
                second
            } else {
                first
            };
            let n_parameters = if is_parametric {
                dimension.clamp(0, 3)
            } else {
                0
            };
            // Version 4.1 has all tags of the block first.
            if version == Version::V41 {
                for _ in 0..n {
                    self.node_tags.push(reader.size()?);
                }
            }
            for _ in 0..n {
                if version == Version::V40 {
                    self.node_tags.push(reader.tag()?);
                }
                self.nodes
                    .push([reader.float()?, reader.float()?, reader.float()?]);
                for _ in 0..n_parameters {
                    reader.float()?;
                }
            }
        }
        Ok(())
    }

    pub(super) fn read_elements_4(
        &mut self,
        reader: &mut Reader<'_>,
        version: Version,
    ) -> Result<(), Error> {
        let n_blocks = reader.count(1)?;
        for _ in 0..n_head(version) {
            reader.size()?;
        }
        for _ in 0..n_blocks {
            let (first, second) = (reader.int()?, reader.int()?);
            let groups = match version {
                Version::V40 => GroupsOf::Entity(second, first),
                _ => GroupsOf::Entity(first, second),
            };
            let element_type = reader.int()?;
            let Some((kind, n_nodes)) = kind_of(element_type) else {
                return Err(reader.wrong(&unknown(element_type)));
            };
            let n = reader.count(8)?;
            let mut block = Block {
                groups,
                kind,
                tags: Vec::new(),
                nodes: Vec::new(),
            };
            let mut tag = || match version {
                Version::V40 => reader.tag(),
                _ => reader.size(),
            };
            for _ in 0..n {
                block.tags.push(tag()?);
                for _ in 0..n_nodes {
                    block.nodes.push(tag()?);
                }
            }
            self.blocks.push(block);
        }
        Ok(())
    }
}

/// Numbers behind the number of blocks: that of all entries and, since 4.1, the least and largest tag.
fn n_head(version: Version) -> usize {
    if version == Version::V40 { 1 } else { 3 }
}

/// Box (of a point its place, since 4.1), physical tags, which are returned, and what bounds the entity.
fn rest_of_entity(
    reader: &mut Reader<'_>,
    version: Version,
    dimension: i32,
) -> Result<Vec<i32>, Error> {
    let is_place = dimension == 0 && version == Version::V41;
    for _ in 0..if is_place { 3 } else { 6 } {
        reader.float()?;
    }
    // Gmsh makes the tag negative where a group reverses the entity.
    let n = reader.count(4)?;
    let physical = (0..n)
        .map(|_| reader.int().map(i32::saturating_abs))
        .collect::<Result<Vec<_>, _>>()?;
    if dimension > 0 {
        for _ in 0..reader.count(4)? {
            reader.int()?;
        }
    }
    Ok(physical)
}
