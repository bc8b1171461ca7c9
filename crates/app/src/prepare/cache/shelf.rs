//! The folder of prepared parts as a whole: what it holds, what goes when it holds too much, clearing it.
//!
//! Only files that carry both a name and a beginning of this program are touched: links, folders and files of others
//! stay. A part in use, of this program or another one, stays too. There is no index: the folder is what it is, so
//! programs that work in it at the same time cannot disagree.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::MAGIC;
use crate::leftovers;
use crate::prepare::budget::bytes;
use crate::progress::Ui;

/// Digits of the key in a file's name.
const KEY_DIGITS: usize = 16;

/// Most bytes that the folder holds; none: no bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit(pub Option<u64>);

impl Default for Limit {
    /// 2 GB: some hundred parts like the clip, or three of a hundred thousand nodes.
    fn default() -> Self {
        Self(Some(2_000_000_000))
    }
}

impl Limit {
    /// In words.
    pub fn words(self) -> String {
        self.0.map_or("without bound".to_owned(), |n| {
            format!("at most {}", bytes(n as f64))
        })
    }
}

impl std::str::FromStr for Limit {
    type Err = String;

    /// `2GB`, `500 MB`, `1.5GiB`, `0`, `none`; without unit: bytes.
    fn from_str(text: &str) -> Result<Self, String> {
        let lower = text.trim().to_ascii_lowercase();
        if ["none", "unlimited"].contains(&lower.as_str()) {
            return Ok(Self(None));
        }
        let digits = lower
            .find(|c: char| !c.is_ascii_digit() && c != '.')
            .unwrap_or(lower.len());
        let (number, unit) = lower.split_at(digits);
        let scale = match unit.trim() {
            "" | "b" => 1.0,
            "k" | "kb" => 1e3,
            "m" | "mb" => 1e6,
            "g" | "gb" => 1e9,
            "t" | "tb" => 1e12,
            "kib" => 1024.0,
            "mib" => 1024.0f64.powi(2),
            "gib" => 1024.0f64.powi(3),
            "tib" => 1024.0f64.powi(4),
            _ => f64::NAN,
        };
        let value = number.parse::<f64>().unwrap_or(f64::NAN) * scale;
        if value.is_finite() {
            Ok(Self(Some(value.round() as u64)))
        } else {
            Err(format!(
                "{text:?} is no size; write for example 2GB, 500MB, or none for no bound"
            ))
        }
    }
}

/// What a file of the folder is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A prepared part.
    Part,
    /// What was measured of multiplying on a graphics adapter; small, and no part of the bound.
    Measured,
}

/// A file of this program in the folder.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Where.
    pub path: PathBuf,
    /// What.
    pub kind: Kind,
    /// Name of the mesh without its ending, for parts.
    pub mesh: Option<String>,
    /// Size of the file.
    pub bytes: u64,
    /// When it was last read or written.
    pub last_use: SystemTime,
}

impl Entry {
    /// Of a path, if it is one of ours.
    fn of(path: PathBuf) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let (kind, mesh) = match name.strip_suffix(".cache") {
            Some(stem) => (Kind::Part, Some(before_key(stem)?.to_owned())),
            None if before_key(name.strip_suffix(".json")?)? == "multiply" => {
                (Kind::Measured, None)
            }
            None => return None,
        };
        let meta = fs::symlink_metadata(&path).ok()?;
        let begins = match kind {
            Kind::Part => MAGIC.as_slice(),
            Kind::Measured => b"{",
        };
        (meta.is_file() && begins_with(&path, begins)).then_some(())?;
        Some(Self {
            kind,
            mesh,
            bytes: meta.len(),
            last_use: meta.modified().ok()?,
            path,
        })
    }

    /// Whether a program has it open.
    pub fn is_in_use(&self) -> bool {
        File::open(&self.path)
            .is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
    }
}

/// What stands before `-0123456789abcdef` at the end of a name.
fn before_key(stem: &str) -> Option<&str> {
    let (name, key) = stem.rsplit_once('-')?;
    let is_key =
        key.len() == KEY_DIGITS && key.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    is_key.then_some(name)
}

fn begins_with(path: &Path, begins: &[u8]) -> bool {
    let mut found = vec![0; begins.len()];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut found));
    read.is_ok() && found == begins
}

/// All files of this program in a folder, last used first; a folder that is not there holds none.
///
/// # Errors
/// A folder that cannot be read.
pub fn entries(dir: &Path) -> io::Result<Vec<Entry>> {
    let listed = match fs::read_dir(dir) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        listed => listed?,
    };
    let mut all: Vec<Entry> = listed
        .flatten()
        .filter_map(|entry| Entry::of(entry.path()))
        .collect();
    all.sort_by(|a, b| b.last_use.cmp(&a.last_use).then(a.path.cmp(&b.path)));
    Ok(all)
}

/// What was removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Removed {
    /// Files.
    pub files: usize,
    /// Their bytes.
    pub bytes: u64,
    /// Files that stayed because a program uses them.
    pub in_use: usize,
}

/// Removes all files of this program, or those that were not used for a time. What a program uses stays.
///
/// # Errors
/// The first file that cannot be removed, with its path.
pub fn clear(dir: &Path, older_than: Duration) -> Result<Removed, (PathBuf, io::Error)> {
    sweep(dir);
    let mut removed = Removed::default();
    for entry in entries(dir).map_err(|e| (dir.to_path_buf(), e))? {
        if since(entry.last_use) < older_than {
            continue;
        }
        if entry.is_in_use() {
            removed.in_use += 1;
        } else if remove(&entry.path).map_err(|e| (entry.path.clone(), e))? {
            removed.files += 1;
            removed.bytes += entry.bytes;
        }
    }
    Ok(removed)
}

/// Time since then; none for a time to come.
pub fn since(time: SystemTime) -> Duration {
    SystemTime::now().duration_since(time).unwrap_or_default()
}

/// Whether it was there; another program may have been faster.
fn remove(path: &Path) -> io::Result<bool> {
    match fs::remove_file(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(false),
        removed => removed.map(|()| true),
    }
}

/// Keeps the folder of `part` within its bound: parts that were not used for the longest time go, but not `part` and
/// what another program uses. `coming`: bytes that `part` will have once it is written. What was done, and what cannot
/// be done, is told; neither is a reason to end.
pub(in crate::prepare) fn make_room(part: &Path, coming: Option<u64>, limit: Limit, ui: &Ui<'_>) {
    let Some(dir) = part.parent() else { return };
    sweep(dir);
    let (Some(limit), Ok(mut others)) = (limit.0, entries(dir)) else {
        return;
    };
    others.retain(|entry| entry.kind == Kind::Part);
    let is_part = |entry: &Entry| entry.path.file_name() == part.file_name();
    let own = coming
        .or_else(|| others.iter().find(|e| is_part(e)).map(|e| e.bytes))
        .unwrap_or(0);
    others.retain(|entry| !is_part(entry));
    let mut total = own + others.iter().map(|entry| entry.bytes).sum::<u64>();
    let mut removed = Removed::default();
    while total > limit {
        let Some(oldest) = others.pop() else { break };
        if oldest.is_in_use() {
            continue;
        }
        match remove(&oldest.path) {
            Ok(was_there) => {
                total -= oldest.bytes;
                removed.files += usize::from(was_there);
                removed.bytes += oldest.bytes;
            }
            Err(why) => {
                ui.note(&format!(
                    "{}: holds {} of prepared parts, more than {} (--cache-limit), but {} cannot be removed ({why}); \
                     make the folder writable or name another in SNAPIN_CACHE",
                    dir.display(),
                    bytes(total as f64),
                    bytes(limit as f64),
                    oldest.path.display(),
                ));
                return;
            }
        }
    }
    if removed.files > 0 {
        ui.note(&format!(
            "{}: {} that {} not used for the longest time {} removed, {}, to hold {} (--cache-limit)",
            dir.display(),
            counted(removed.files, "prepared part"),
            if removed.files == 1 { "was" } else { "were" },
            if removed.files == 1 { "is" } else { "are" },
            bytes(removed.bytes as f64),
            Limit(Some(limit)).words(),
        ));
    }
}

/// `1 file`, `2 files`.
pub fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Removes what killed programs were writing.
fn sweep(dir: &Path) {
    leftovers::sweep_files(dir, |path, stem| {
        let is_empty = || fs::metadata(path).is_ok_and(|meta| meta.len() == 0);
        before_key(stem).is_some_and(|before| {
            let is_measured = || before == "multiply" && begins_with(path, b"{");
            is_empty() || begins_with(path, MAGIC) || is_measured()
        })
    });
}

#[cfg(test)]
mod tests;
