//! The files of a result that this program wrote: all others in its folder are the user's own.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Component, Path};

/// Name of the list in the result folder; while the result is made, its maker holds a lock on it.
pub(super) const LISTING: &str = ".snapin-files";

/// First line of the list.
const TITLE: &str = "Files that snapin wrote here; it replaces these and keeps all others.";

/// Results of before there were lists hold these, and frames.
const NAMES: [&str; 7] = [
    "summary.json",
    "report.html",
    "force-travel.csv",
    "timing.csv",
    "force-travel.svg",
    "step-time.svg",
    "session.mcap",
];

/// Files below a folder, by path with `/` between.
#[derive(Debug, Default)]
pub(super) struct Listing {
    files: BTreeSet<String>,
    /// No list was there: names are judged.
    is_by_name: bool,
}

impl Listing {
    /// All files that are below a folder now.
    ///
    /// # Errors
    /// What cannot be read.
    pub(super) fn below(folder: &Path) -> io::Result<Self> {
        let mut list = Self::default();
        list.add(folder, Path::new(""))?;
        Ok(list)
    }

    fn add(&mut self, folder: &Path, below: &Path) -> io::Result<()> {
        for entry in fs::read_dir(folder.join(below))? {
            let entry = entry?;
            let path = below.join(entry.file_name());
            if entry.file_type()?.is_dir() {
                self.add(folder, &path)?;
            } else {
                self.files.insert(written(&path));
            }
        }
        Ok(())
    }

    /// Writes the list.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn write(&self, file: &mut File) -> io::Result<()> {
        let mut text = format!("{TITLE}\n");
        for line in &self.files {
            text += line;
            text.push('\n');
        }
        file.write_all(text.as_bytes())?;
        file.flush()
    }

    /// Whether a folder has a list.
    pub(super) fn is_in(folder: &Path) -> bool {
        read(folder).is_some()
    }

    /// What this program wrote into a folder: by its list, or by names where there is none.
    pub(super) fn of(folder: &Path) -> Self {
        match read(folder) {
            Some(text) => Self {
                files: text.lines().skip(1).map(str::to_owned).collect(),
                is_by_name: false,
            },
            None => Self {
                files: BTreeSet::new(),
                is_by_name: true,
            },
        }
    }

    /// Whether a file of this path is of this program.
    pub(super) fn has(&self, path: &Path) -> bool {
        let path = written(path);
        path == LISTING || self.files.contains(&path) || (self.is_by_name && is_name_of_ours(&path))
    }

    /// Whether files of this program may be below this folder.
    pub(super) fn has_below(&self, folder: &Path) -> bool {
        let start = written(folder) + "/";
        let first = self.files.range(start.clone()..).next();
        first.is_some_and(|path| path.starts_with(&start))
            || (self.is_by_name && start == "frames/")
    }

    /// Whether a folder in the making can only be of this program: it begins its list first of all, and where there is
    /// none, nothing has another name than ours.
    pub(super) fn holds_nothing_else(folder: &Path) -> bool {
        if folder.join(LISTING).is_file() {
            return true;
        }
        Self::below(folder).is_ok_and(|all| all.files.iter().all(|path| is_name_of_ours(path)))
    }
}

fn read(folder: &Path) -> Option<String> {
    let text = fs::read_to_string(folder.join(LISTING)).ok()?;
    text.starts_with(TITLE).then_some(text)
}

/// The same on every system.
fn written(path: &Path) -> String {
    let names = path.components().filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy()),
        _ => None,
    });
    names.collect::<Vec<_>>().join("/")
}

/// `summary.json`, ..., `frames/01-peak.png`.
fn is_name_of_ours(path: &str) -> bool {
    let is_frame = |name: &str| {
        let digits = name.bytes().take_while(u8::is_ascii_digit).count();
        digits >= 2
            && name[digits..].starts_with('-')
            && (name.ends_with(".png") || name.ends_with(".vtu"))
    };
    NAMES.contains(&path) || path.strip_prefix("frames/").is_some_and(is_frame)
}
