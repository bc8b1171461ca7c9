//! Nodes and elements of version 2. Counts are text in binary files too.

use super::kind::{Kind, kind_of, unknown};
use super::reader::Reader;
use super::{Block, File, GroupsOf};
use crate::Error;

impl File {
    pub(super) fn read_nodes_2(&mut self, reader: &mut Reader<'_>) -> Result<(), Error> {
        for _ in 0..reader.text_count(28)? {
            self.node_tags.push(reader.tag()?);
            self.nodes
                .push([reader.float()?, reader.float()?, reader.float()?]);
        }
        Ok(())
    }

    pub(super) fn read_elements_2(&mut self, reader: &mut Reader<'_>) -> Result<(), Error> {
        self.repeats_elements = true;
        let n_elements = reader.text_count(8)?;
        let mut n_read = 0;
        while n_read < n_elements {
            // In binary files this begins a run of elements, in text each says it after its tag.
            let mut tag = if reader.is_binary() {
                None
            } else {
                Some(reader.tag()?)
            };
            let element_type = reader.int()?;
            let Some((kind, n_nodes)) = kind_of(element_type) else {
                return Err(reader.wrong(&unknown(element_type)));
            };
            let n_in_run = match tag {
                Some(_) => 1,
                None => reader.int()?.max(1),
            };
            let n_tags = reader.int()?;
            for _ in 0..n_in_run {
                let tag = match tag.take() {
                    Some(tag) => tag,
                    None => reader.tag()?,
                };
                let mut physical = 0;
                for k in 0..n_tags {
                    let value = reader.int()?;
                    if k == 0 {
                        physical = value.saturating_abs();
                    }
                }
                let block = self.block_of(kind, physical);
                block.tags.push(tag);
                for _ in 0..n_nodes {
                    block.nodes.push(reader.tag()?);
                }
                n_read += 1;
            }
        }
        Ok(())
    }

    /// The last block, if the element belongs there, or a new one.
    fn block_of(&mut self, kind: Kind, physical: i32) -> &mut Block {
        let groups = GroupsOf::Tag(physical);
        let goes_on = |block: &Block| block.kind == kind && block.groups == groups;
        if !self.blocks.last().is_some_and(goes_on) {
            self.blocks.push(Block {
                groups,
                kind,
                tags: Vec::new(),
                nodes: Vec::new(),
            });
        }
        let last = self.blocks.len() - 1;
        &mut self.blocks[last]
    }
}
