//! Prepared parts on disk. A file is whole or not there: it is written beside and renamed, and
//! carries a checksum of every byte. A damaged, cut or foreign file is never used.
//!
//! Layout, little-endian: magic (8 bytes), format (u32), scalar bytes (u32), key (32 bytes),
//! candidates and rows (u64 each), checks (3 x f64), 3x3 blocks (f64) of the candidates' rows, which the step reads,
//! then of the rows that are only drawn, BLAKE3 of all before (32). Numbers lie at multiples of 8: the file is mapped,
//! not copied. While a file is in use, a lock on it is shared; its time of change is that of its last use, which is what
//! [`shelf`] keeps the folder within its bound by.

pub mod shelf;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use fem::{Compliance, ComplianceChecks};

use crate::leftovers;
use crate::stored::{Mapped, Source, StoredCompliance, sections};

/// Changes whenever the meaning of the file or the numbers in it changes.
pub const FORMAT: u32 = 3;

const MAGIC: &[u8; 8] = b"SNAPINC\n";
const HEADER: usize = 8 + 4 + 4 + 32 + 8 + 8 + 24;
const CHECKSUM: usize = 32;

/// Why a cache file is not used.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum Damage {
    /// Shorter or longer than its header says.
    #[error("the cached part is cut short or has bytes too many")]
    Length,
    /// Another program's file, or another version of this one's.
    #[error("the cached part is of another kind or version")]
    Kind,
    /// A bit flipped.
    #[error("the cached part is damaged (its checksum does not fit)")]
    Checksum,
    /// The file cannot be read.
    #[error("the cached part cannot be read ({0})")]
    Unreadable(String),
}

/// Default folder: `SNAPIN_CACHE`, else the user's cache folder; `None` if there is neither.
pub fn default_dir() -> Option<PathBuf> {
    let from = |name: &str| {
        std::env::var_os(name)
            .filter(|v| !v.is_empty())
            .map(PathBuf::from)
    };
    from("SNAPIN_CACHE")
        .or_else(|| from("XDG_CACHE_HOME").map(|dir| dir.join("snapin")))
        .or_else(|| from("LOCALAPPDATA").map(|dir| dir.join("snapin").join("cache")))
        .or_else(|| from("HOME").map(|dir| dir.join(".cache").join("snapin")))
}

/// File of a part in the folder: the mesh's name and the start of the key.
pub fn file_of(dir: &Path, mesh_path: &Path, key: &[u8; 32]) -> PathBuf {
    let stem = mesh_path
        .file_stem()
        .map_or_else(|| "part".into(), |s| s.to_string_lossy());
    let hex: String = key[..8].iter().map(|b| format!("{b:02x}")).collect();
    dir.join(format!("{stem}-{hex}.cache"))
}

/// Maps a cached part and checks every byte of it. `Ok(None)`: there is none.
///
/// # Errors
/// What is wrong with the file; the caller prepares anew.
pub fn read(
    file: &Path,
    key: &[u8; 32],
    n_candidates: usize,
    n_rows: usize,
) -> Result<Option<(StoredCompliance, ComplianceChecks)>, Damage> {
    let unreadable = |e: io::Error| Damage::Unreadable(e.to_string());
    let opened = match File::open(file) {
        Ok(opened) => opened,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(unreadable(e)),
    };
    if opened.metadata().map_err(unreadable)?.len() < (HEADER + CHECKSUM) as u64 {
        return Err(Damage::Length);
    }
    mark_as_used(file, &opened);
    let map = Mapped::open(opened).map_err(unreadable)?;
    let (body, checksum) = map.split_at(map.len() - CHECKSUM);
    // All bytes are in memory afterwards: no step waits for the disk.
    if blake3::Hasher::new()
        .update_rayon(body)
        .finalize()
        .as_bytes()
        != checksum
    {
        return Err(Damage::Checksum);
    }
    if body[..HEADER - 24] != header(key, n_candidates, n_rows)[..] {
        return Err(Damage::Kind);
    }
    let drawn_from = HEADER + 72 * n_candidates * n_candidates;
    if body.len() != HEADER + 72 * n_candidates * n_rows {
        return Err(Damage::Length);
    }
    let number = |at: usize| {
        let mut b = [0; 8];
        b.copy_from_slice(&body[at..at + 8]);
        f64::from_le_bytes(b)
    };
    let checks = ComplianceChecks {
        symmetry_rel: number(HEADER - 24),
        residual_rel: number(HEADER - 16),
        smallest_pivot_rel: number(HEADER - 8),
    };
    let section = |bytes| {
        Mapped::new(&map, bytes)
            .map(Source::Mapped)
            .ok_or_else(|| Damage::Unreadable("this machine cannot map it".to_owned()))
    };
    let stored = StoredCompliance::of_sections(
        n_candidates,
        n_rows,
        section(HEADER..drawn_from)?,
        section(drawn_from..body.len())?,
    );
    Ok(Some((stored, checks)))
}

/// Tells other programs that the file is in use, and since when. A folder that cannot be written into, or has no locks,
/// is no reason not to read.
fn mark_as_used(file: &Path, opened: &File) {
    let _ = opened.try_lock_shared();
    let now = SystemTime::now();
    if opened.set_modified(now).is_err()
        && let Ok(to_write) = File::options().append(true).open(file)
    {
        let _ = to_write.set_modified(now);
    }
}

/// Bytes of a part's file.
pub fn size_of_file(n_candidates: usize, n_rows: usize) -> u64 {
    72 * n_candidates as u64 * n_rows as u64 + (HEADER + CHECKSUM) as u64
}

/// Writes a part beside its place and renames it.
///
/// # Errors
/// What the system says; nothing half-written is left. A link in its place is left alone.
pub fn write(
    file: &Path,
    key: &[u8; 32],
    compliance: &Compliance,
    checks: &ComplianceChecks,
) -> io::Result<()> {
    if let Some(dir) = file.parent() {
        fs::create_dir_all(dir)?;
    }
    if file.is_symlink() {
        return Err(io::Error::other("a link is in its place"));
    }
    let partial = file.with_extension(leftovers::mark());
    let result =
        write_to(&partial, key, compliance, checks).and_then(|()| fs::rename(&partial, file));
    if result.is_err() {
        let _ = fs::remove_file(&partial);
    }
    result
}

fn write_to(
    partial: &Path,
    key: &[u8; 32],
    compliance: &Compliance,
    checks: &ComplianceChecks,
) -> io::Result<()> {
    let mut head = header(key, compliance.candidates.len(), compliance.rows.len());
    for number in [
        checks.symmetry_rel,
        checks.residual_rel,
        checks.smallest_pivot_rel,
    ] {
        head.extend(number.to_le_bytes());
    }
    let mut hash = blake3::Hasher::new();
    let file = File::create(partial)?;
    leftovers::lock(&file);
    let mut out = io::BufWriter::with_capacity(1 << 20, file);
    let (contact, drawn) = sections(compliance);
    let columns = contact.into_iter().chain(drawn).map(bytemuck::cast_slice);
    for bytes in std::iter::once(head.as_slice()).chain(columns) {
        hash.update(bytes);
        out.write_all(bytes)?;
    }
    out.write_all(hash.finalize().as_bytes())?;
    out.into_inner()?.sync_all()
}

fn header(key: &[u8; 32], n_candidates: usize, n_rows: usize) -> Vec<u8> {
    let mut head = Vec::with_capacity(HEADER);
    head.extend(MAGIC);
    head.extend(FORMAT.to_le_bytes());
    head.extend(8u32.to_le_bytes());
    head.extend(key);
    head.extend((n_candidates as u64).to_le_bytes());
    head.extend((n_rows as u64).to_le_bytes());
    head
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> (Compliance, ComplianceChecks) {
        let compliance = Compliance {
            candidates: vec![3, 7],
            rows: vec![3, 7, 9],
            blocks: (0..54).map(f64::from).collect(),
        };
        let checks = ComplianceChecks {
            symmetry_rel: 1e-15,
            residual_rel: 2e-14,
            smallest_pivot_rel: 0.1,
        };
        (compliance, checks)
    }

    #[test]
    fn what_is_written_is_read_and_nothing_is_left_beside() {
        let dir = tempfile::tempdir().unwrap();
        let (compliance, checks) = sample();
        let key = [7; 32];
        let file = file_of(dir.path(), Path::new("clip.msh"), &key);
        assert!(read(&file, &key, 2, 3).unwrap().is_none());
        write(&file, &key, &compliance, &checks).unwrap();
        let (again, checks_again) = read(&file, &key, 2, 3).unwrap().unwrap();
        for j in 0..2 {
            for i in 0..3 {
                assert_eq!(again.block(i, j), compliance.block(i, j));
            }
        }
        assert_eq!(checks_again.residual_rel, checks.residual_rel);
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_found() {
        let dir = tempfile::tempdir().unwrap();
        let (compliance, checks) = sample();
        let key = [7; 32];
        let file = file_of(dir.path(), Path::new("clip.msh"), &key);
        write(&file, &key, &compliance, &checks).unwrap();
        let good = fs::read(&file).unwrap();
        for byte in 0..good.len() {
            let mut bad = good.clone();
            bad[byte] ^= 1 << (byte % 8);
            fs::write(&file, &bad).unwrap();
            assert!(read(&file, &key, 2, 3).is_err(), "byte {byte}");
        }
        for len in [0, 10, HEADER, good.len() - 1] {
            fs::write(&file, &good[..len]).unwrap();
            assert!(read(&file, &key, 2, 3).is_err(), "length {len}");
        }
    }
}
