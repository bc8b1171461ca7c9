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

/// A stretch of 64-bit numbers, little-endian, in a mapped file.
#[derive(Clone, Debug)]
pub struct Mapped {
    map: Arc<Mmap>,
    bytes: Range<usize>,
}

impl Mapped {
    /// Maps a whole file to be read.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn open(file: &File) -> io::Result<Arc<Mmap>> {
        // SAFETY: cache files are written beside their place and renamed, never changed in place or cut; a file
        // that is replaced or removed stays as it was for those who have mapped it.
        unsafe { Mmap::map(file) }.map(Arc::new)
    }

    /// The numbers in some bytes of the file.
    ///
    /// None where they are not whole numbers at a multiple of 8, or not all in the file, or where this machine writes
    /// numbers the other way round.
    pub(crate) fn new(map: &Arc<Mmap>, bytes: Range<usize>) -> Option<Self> {
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
