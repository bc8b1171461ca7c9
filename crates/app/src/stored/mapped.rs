//! Numbers in a mapped file.

#![allow(
    unsafe_code,
    reason = "a file can be mapped only with the promise that nobody cuts it meanwhile"
)]

use std::fs::File;
use std::io;
use std::ops::Range;
use std::sync::Arc;

use memmap2::Mmap;

/// A mapped file. It stays open, so that a lock on it lasts as long as its numbers are in use.
#[derive(Debug)]
pub(crate) struct MappedFile {
    map: Mmap,
    _file: File,
}

impl std::ops::Deref for MappedFile {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.map
    }
}

/// A stretch of 64-bit numbers, little-endian, in a mapped file.
#[derive(Clone, Debug)]
pub struct Mapped {
    map: Arc<MappedFile>,
    bytes: Range<usize>,
}

impl Mapped {
    /// Maps a whole file to be read.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn open(file: File) -> io::Result<Arc<MappedFile>> {
        // SAFETY: cache files are written beside their place and renamed, never changed in place or cut; a file
        // that is replaced or removed stays as it was for those who have mapped it.
        let map = unsafe { Mmap::map(&file) }?;
        Ok(Arc::new(MappedFile { map, _file: file }))
    }

    /// The numbers in some bytes of the file.
    ///
    /// None where they are not whole numbers at a multiple of 8, or not all in the file, or where this machine writes
    /// numbers the other way round.
    pub(crate) fn new(map: &Arc<MappedFile>, bytes: Range<usize>) -> Option<Self> {
        let stretch = map.get(bytes.clone())?;
        bytemuck::try_cast_slice::<u8, f64>(stretch).ok()?;
        cfg!(target_endian = "little").then(|| Self {
            map: Arc::clone(map),
            bytes,
        })
    }

    /// The numbers.
    #[inline]
    pub fn as_slice(&self) -> &[f64] {
        bytemuck::cast_slice(&self.map[self.bytes.clone()])
    }
}
