//! A file that is a whole recording at every moment, wherever the program is killed.
//!
//! What is not finished stays in memory. Each time a piece is finished it goes to the file with an end behind it that
//! players accept, and the next piece is written over that end.

use std::fs::File;
use std::io::{Result, Seek, SeekFrom, Write};

/// End of a recording without a summary: "data end" (checksum not stated), a footer that points nowhere, the magic.
const END: [u8; 50] = {
    let mut end = [0; 50];
    // Operation, then the length of what follows, little-endian.
    (end[0], end[1]) = (0x0f, 4);
    (end[13], end[14]) = (0x02, 20);
    let magic = b"\x89MCAP0\r\n";
    let mut k = 0;
    while k < magic.len() {
        end[42 + k] = magic[k];
        k += 1;
    }
    end
};

/// The file and what is not in it yet.
#[derive(Debug)]
pub struct WholeFile {
    file: File,
    /// Bytes of the recording that are in the file, its end not counted.
    n_in_file: u64,
    pending: Vec<u8>,
    /// Where the next byte goes.
    at: u64,
}

impl WholeFile {
    /// On an empty file.
    pub fn new(file: File) -> Self {
        Self {
            file,
            n_in_file: 0,
            pending: Vec::new(),
            at: 0,
        }
    }

    /// Ends the file as its writer has ended it.
    ///
    /// # Errors
    /// What the system says.
    pub fn finish(mut self) -> Result<()> {
        let n = self.n_in_file + self.pending.len() as u64;
        self.file.seek(SeekFrom::Start(self.n_in_file))?;
        self.file.write_all(&self.pending)?;
        self.file.set_len(n)?;
        self.file.sync_all()
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let Some(from) = self.at.checked_sub(self.n_in_file) else {
            return Err(std::io::Error::other("what was finished is not changed"));
        };
        let from = from as usize;
        let to = from + bytes.len();
        if self.pending.len() < to {
            self.pending.resize(to, 0);
        }
        self.pending[from..to].copy_from_slice(bytes);
        self.at += bytes.len() as u64;
        Ok(bytes.len())
    }

    /// What is pending is finished: it goes to the file in one piece, with an end behind it.
    fn flush(&mut self) -> Result<()> {
        if self.pending.is_empty() {
            return Ok(());
        }
        let n = self.pending.len() as u64;
        self.pending.extend_from_slice(&END);
        self.file.seek(SeekFrom::Start(self.n_in_file))?;
        let written = self.file.write_all(&self.pending);
        self.pending.truncate(n as usize);
        written?;
        self.n_in_file += n;
        self.pending.clear();
        Ok(())
    }
}

impl Seek for WholeFile {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let end = self.n_in_file + self.pending.len() as u64;
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
            SeekFrom::End(by) => end.checked_add_signed(by),
        };
        let at = at.filter(|at| *at <= end);
        self.at = at.ok_or_else(|| std::io::Error::other("beyond the recording"))?;
        Ok(self.at)
    }
}
