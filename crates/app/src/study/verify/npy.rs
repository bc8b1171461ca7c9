//! NumPy arrays (`.npy`) of numbers: a reader that believes nothing of a file before it is checked.
//!
//! The header is text in Python's notation. Only what NumPy writes there is read, in one pass over
//! at most [`LONGEST_HEADER`] bytes, and the length of the file must be that of the shape.
//! Source: numpy.lib.format, versions 1.0, 2.0 and 3.0.

mod header;

use std::fmt;
use std::io::Read;
use std::path::Path;

use super::Failure;
use super::files::{open, wrong};
use header::Header;

/// Bytes. NumPy's own bound (`max_header_size`).
const LONGEST_HEADER: usize = 10_000;
/// 200 MB, a matrix of 5000 rows: more than the solver ends with in a day.
const MOST_ENTRIES: u64 = 5000 * 5000;
/// Bytes of an entry, of all types that are read.
const ENTRY: usize = 8;

/// An array as it lies in the file.
#[derive(Debug)]
pub(super) struct Array<T> {
    pub(super) shape: Vec<u64>,
    /// First index fastest.
    pub(super) is_fortran: bool,
    pub(super) entries: Vec<T>,
}

/// Types of entries that are read.
pub(super) trait Entry: Copy + fmt::Display {
    /// As in the header, without the order of bytes.
    const CODE: &'static str;
    /// As NumPy names it.
    const NAME: &'static str;
    fn of_bytes(bytes: [u8; ENTRY]) -> Self;
    fn is_number(self) -> bool;
}

impl Entry for f64 {
    const CODE: &'static str = "f8";
    const NAME: &'static str = "float64";
    fn of_bytes(bytes: [u8; ENTRY]) -> Self {
        Self::from_le_bytes(bytes)
    }
    fn is_number(self) -> bool {
        self.is_finite()
    }
}

impl Entry for i64 {
    const CODE: &'static str = "i8";
    const NAME: &'static str = "int64";
    fn of_bytes(bytes: [u8; ENTRY]) -> Self {
        Self::from_le_bytes(bytes)
    }
    fn is_number(self) -> bool {
        true
    }
}

/// Reads an array whose entries are all numbers.
pub(super) fn read<T: Entry>(path: &Path) -> Result<Array<T>, Failure> {
    let (mut file, length) = open(path)?;
    // What is in the file, at most: the shape is believed only after it is compared with this.
    let longest = MOST_ENTRIES * ENTRY as u64 + LONGEST_HEADER as u64 + 12;
    if length > longest {
        return Err(wrong(
            path,
            &format!("has {length} bytes; an array of a case has at most {MOST_ENTRIES} entries"),
        ));
    }
    let mut bytes = Vec::new();
    file.by_ref()
        .take(longest)
        .read_to_end(&mut bytes)
        .map_err(|e| wrong(path, &e.to_string()))?;
    parse(&bytes).map_err(|what| wrong(path, &what))
}

fn parse<T: Entry>(bytes: &[u8]) -> Result<Array<T>, String> {
    let mend = format!("save the array anew with numpy.save and dtype {}", T::NAME);
    let (text, start) = header_of(bytes).map_err(|what| format!("{what}; {mend}"))?;
    let header = Header::parse(text)
        .map_err(|e| format!("byte {}: {}; {mend}", start - text.len() + e.at, e.what))?;
    let is_little = match header.descr.strip_suffix(T::CODE) {
        Some("<") => true,
        Some(">") => false,
        _ => {
            return Err(format!(
                "the header says entries of type {:?}, {:?} is read; {mend}",
                header.descr,
                format!("<{}", T::CODE)
            ));
        }
    };
    let n = header
        .shape
        .iter()
        .try_fold(1u64, |n, side| n.checked_mul(*side))
        .filter(|n| *n <= MOST_ENTRIES)
        .ok_or_else(|| {
            format!(
                "the header says shape {}, more than the {MOST_ENTRIES} entries that are read; {mend}",
                shown(&header.shape)
            )
        })?;
    let payload = &bytes[start..];
    // No overflow: n is bounded above.
    let expected = n as usize * ENTRY;
    if payload.len() != expected {
        return Err(format!(
            "shape {} needs {expected} bytes after the header, the file has {}: it {}; {mend}",
            shown(&header.shape),
            payload.len(),
            if payload.len() < expected {
                "was cut off"
            } else {
                "goes on after the array"
            },
        ));
    }
    let entries: Vec<T> = payload
        .chunks_exact(ENTRY)
        .map(|chunk| {
            let mut entry = [0; ENTRY];
            entry.copy_from_slice(chunk);
            if !is_little {
                entry.reverse();
            }
            T::of_bytes(entry)
        })
        .collect();
    if let Some(at) = entries.iter().position(|x| !x.is_number()) {
        return Err(format!(
            "entry {at} (counted from 0, as they lie in the file) is {}; all must be numbers",
            entries[at]
        ));
    }
    Ok(Array {
        shape: header.shape,
        is_fortran: header.is_fortran,
        entries,
    })
}

/// Text of the header, and where the entries begin.
fn header_of(bytes: &[u8]) -> Result<(&str, usize), String> {
    const MAGIC: &[u8] = b"\x93NUMPY";
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err("byte 0: does not begin like a NumPy array".to_owned());
    };
    let (length, before) = match *rest {
        [1, 0, a, b, ..] => (usize::from(u16::from_le_bytes([a, b])), 10),
        [2 | 3, 0, a, b, c, d, ..] => (u32::from_le_bytes([a, b, c, d]) as usize, 12),
        [0..=3, 0, ..] | [] | [_] => return Err("was cut off in its first bytes".to_owned()),
        [major, minor, ..] => {
            return Err(format!(
                "byte 6: version {major}.{minor} of the format; 1.0, 2.0 and 3.0 are read"
            ));
        }
    };
    if length > LONGEST_HEADER {
        return Err(format!(
            "byte 8: a header of {length} bytes; at most {LONGEST_HEADER} are read"
        ));
    }
    let start = before + length;
    let Some(header) = bytes.get(before..start) else {
        return Err(format!(
            "byte 8: a header of {length} bytes in a file of {}",
            bytes.len()
        ));
    };
    // What NumPy writes for plain numbers is ASCII in all versions.
    match header.iter().position(|b| !b.is_ascii()) {
        Some(at) => Err(format!(
            "byte {}: a character in the header that is not ASCII",
            before + at
        )),
        None => Ok((std::str::from_utf8(header).unwrap_or_default(), start)),
    }
}

/// A shape as Python writes it.
pub(super) fn shown(shape: &[u64]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => {
            let sides: Vec<String> = shape.iter().map(u64::to_string).collect();
            format!("({})", sides.join(", "))
        }
    }
}

#[cfg(test)]
mod tests;
