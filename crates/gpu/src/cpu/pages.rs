//! Memory for the compliance in large pages, where the system has them.
//!
//! A product reads six columns at once, each on other pages of 4 KB, and what the processor remembers of where pages
//! lie does not last from one column to the next. With pages of 2 MB columns of 36 KB are read a twentieth faster,
//! long ones as fast as before.

use std::marker::PhantomData;

use memmap2::MmapMut;

use super::Stored;
use crate::error::Error;

/// Numbers, all zero at first.
#[derive(Debug)]
pub(super) struct Pages<T> {
    map: MmapMut,
    bytes: usize,
    stored: PhantomData<T>,
}

impl<T: Stored> Pages<T> {
    /// Memory for `len` numbers.
    ///
    /// # Errors
    /// [`Error::NoMemory`] where the system has not as much.
    pub(super) fn new(len: usize) -> Result<Self, Error> {
        let bytes = len * size_of::<T>();
        // A map of nothing is no map.
        let map = MmapMut::map_anon(bytes.max(1)).map_err(|error| Error::NoMemory {
            bytes: bytes as u64,
            reason: error.to_string(),
        })?;
        // Where there are no large pages small ones do.
        #[cfg(target_os = "linux")]
        let _ = map.advise(memmap2::Advice::HugePage);
        Ok(Self {
            map,
            bytes,
            stored: PhantomData,
        })
    }

    pub(super) fn as_slice(&self) -> &[T] {
        bytemuck::cast_slice(&self.map[..self.bytes])
    }

    pub(super) fn as_mut_slice(&mut self) -> &mut [T] {
        bytemuck::cast_slice_mut(&mut self.map[..self.bytes])
    }
}
