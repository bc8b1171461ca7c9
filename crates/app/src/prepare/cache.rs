//! Prepared parts on disk. A file is whole or not there: it is written beside and renamed, and
//! carries a checksum of every byte. A damaged, cut or foreign file is never used.
//!
//! Layout, little-endian: magic (8 bytes), format (u32), scalar bytes (u32), key (32 bytes),
//! candidates and rows (u64 each), checks (3 x f64), 3x3 blocks (f64), BLAKE3 of all before (32).

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use fem::{Compliance, ComplianceChecks};

/// Changes whenever the meaning of the file or the numbers in it changes.
pub const FORMAT: u32 = 2;

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

/// Reads a cached part. `Ok(None)`: there is none.
///
/// # Errors
/// What is wrong with the file; the caller prepares anew.
pub fn read(
    file: &Path,
    key: &[u8; 32],
    candidates: &[u32],
    rows: &[u32],
) -> Result<Option<(Compliance, ComplianceChecks)>, Damage> {
    let bytes = match fs::read(file) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(Damage::Unreadable(e.to_string())),
    };
    let n_blocks = candidates.len() * rows.len();
    if bytes.len() < HEADER + CHECKSUM {
        return Err(Damage::Length);
    }
    let (body, checksum) = bytes.split_at(bytes.len() - CHECKSUM);
    if blake3::hash(body).as_bytes() != checksum {
        return Err(Damage::Checksum);
    }
    if body[..HEADER - 24] != header(key, candidates.len(), rows.len())[..] {
        return Err(Damage::Kind);
    }
    if body.len() != HEADER + 72 * n_blocks {
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
    let blocks = bytemuck::pod_collect_to_vec::<u8, f64>(&body[HEADER..]);
    let compliance = Compliance {
        candidates: candidates.to_vec(),
        rows: rows.to_vec(),
        blocks,
    };
    Ok(Some((compliance, checks)))
}

/// Writes a part beside its place and renames it.
///
/// # Errors
/// What the system says; nothing half-written is left.
pub fn write(
    file: &Path,
    key: &[u8; 32],
    compliance: &Compliance,
    checks: &ComplianceChecks,
) -> io::Result<()> {
    if let Some(dir) = file.parent() {
        fs::create_dir_all(dir)?;
    }
    let partial = file.with_extension(format!("partial-{}", std::process::id()));
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
    let mut out = fs::File::create(partial)?;
    let blocks: &[u8] = bytemuck::cast_slice(&compliance.blocks);
    for bytes in [head.as_slice(), blocks] {
        hash.update(bytes);
        out.write_all(bytes)?;
    }
    out.write_all(hash.finalize().as_bytes())?;
    out.sync_all()
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
        assert!(read(&file, &key, &[3, 7], &[3, 7, 9]).unwrap().is_none());
        write(&file, &key, &compliance, &checks).unwrap();
        let (again, checks_again) = read(&file, &key, &[3, 7], &[3, 7, 9]).unwrap().unwrap();
        assert_eq!(again.blocks, compliance.blocks);
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
            assert!(
                read(&file, &key, &[3, 7], &[3, 7, 9]).is_err(),
                "byte {byte}"
            );
        }
        for len in [0, 10, HEADER, good.len() - 1] {
            fs::write(&file, &good[..len]).unwrap();
            assert!(
                read(&file, &key, &[3, 7], &[3, 7, 9]).is_err(),
                "length {len}"
            );
        }
    }
}
