//! A result folder that is complete or not there: written beside and renamed. Files in it that are the user's own
//! survive: they go over into the new result.
//!
//! At every moment a user's file is either in the result folder or in the earlier one that was set aside
//! (`.NAME.old-PID`), from where the next start fetches it if a run is killed in between.

mod listing;

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use crate::{Error, leftovers};
use listing::{LISTING, Listing};

/// File that marks a folder as a result of this program.
const MARK: &str = "summary.json";

/// A key of every summary there has been.
const KEY: &str = "peak_insertion_force_N";

/// Word in the name of a folder in the making, and of an earlier result that is set aside.
const PARTIAL: &str = "partial";
const OLD: &str = "old";

/// Programs that put results into the same folder at the same time give way to each other this often.
const ATTEMPTS: usize = 10;

/// A folder in the making. Dropped without [`Staging::commit`], it vanishes and an earlier result
/// stays as it was.
#[derive(Debug)]
pub(crate) struct Staging {
    target: PathBuf,
    partial: PathBuf,
    /// Of the list of files, locked as long as this lives.
    lock: Option<File>,
}

impl Staging {
    /// Makes the folder to write into, beside `target`, after sweeping what killed runs left there.
    ///
    /// # Errors
    /// If `target` is a file, a folder that holds something else than an earlier result, or
    /// cannot be written beside.
    pub(crate) fn new(target: &Path) -> Result<Self, Error> {
        // A link to a folder stays one: its folder is replaced.
        let absolute = fs::canonicalize(target)
            .or_else(|_| std::path::absolute(target))
            .map_err(Error::io(target, "find the result folder"))?;
        let (Some(parent), Some(name)) = (absolute.parent(), absolute.file_name()) else {
            return Err(Error::Input(format!(
                "{}: is not a folder that can be replaced; name another with --out",
                target.display()
            )));
        };
        restore(parent, &name.to_string_lossy(), &absolute);
        refuse_what_is_no_result(target)?;
        fs::create_dir_all(parent).map_err(Error::io(
            parent,
            "create the folder for results (name another with --out)",
        ))?;
        sweep(parent);
        let partial = parent.join(format!(".{}.{}", name.to_string_lossy(), leftovers::mark()));
        let _ = fs::remove_dir_all(&partial);
        let create = || {
            fs::create_dir(&partial)?;
            File::create(partial.join(LISTING))
        };
        let lock = create().map_err(Error::io(
            &partial,
            "create the result folder (name another with --out)",
        ))?;
        leftovers::lock(&lock);
        Ok(Self {
            target: absolute,
            partial,
            lock: Some(lock),
        })
    }

    /// Where to write.
    pub(crate) fn path(&self) -> &Path {
        &self.partial
    }

    /// Puts the finished folder in its place; an earlier result is replaced only now, and what in it is not of this
    /// program is kept.
    ///
    /// # Errors
    /// What cannot be written or renamed. A user's file that cannot be moved is named with its place.
    pub(crate) fn commit(mut self) -> Result<(), Error> {
        let list = Listing::below(&self.partial)
            .map_err(Error::io(&self.partial, "list the result's files"))?;
        if let Some(lock) = &mut self.lock {
            list.write(lock)
                .map_err(Error::io(&self.partial, "list the result's files"))?;
        }
        if cfg!(windows) {
            // There a folder with an open file cannot be renamed.
            self.lock = None;
        }
        let set_aside = self.swap()?;
        for old in set_aside {
            keep_own_files(&old, &self.target).map_err(|source| {
                Error::Input(format!(
                    "{}: the new result is in its place, but files of your own could not be moved into it \
                     ({source}); they are in {}",
                    self.target.display(),
                    old.display()
                ))
            })?;
            let _ = fs::remove_dir_all(&old);
        }
        Ok(())
    }

    /// Sets aside what is there and renames; again, if another program's result comes in between.
    fn swap(&self) -> Result<Vec<PathBuf>, Error> {
        let mut set_aside = Vec::new();
        for attempt in 0..ATTEMPTS {
            let old = self.aside();
            match fs::rename(&self.target, &old) {
                Ok(()) => set_aside.push(old),
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
                Err(e) => {
                    let error = Error::io(&self.target, "set the earlier result aside")(e);
                    return Err(self.put_back(&set_aside, error));
                }
            }
            match fs::rename(&self.partial, &self.target) {
                Ok(()) => return Ok(set_aside),
                Err(_) if self.target.exists() && attempt + 1 < ATTEMPTS => {}
                Err(e) => {
                    let error = Error::io(&self.target, "put the result in its place")(e);
                    return Err(self.put_back(&set_aside, error));
                }
            }
        }
        Ok(set_aside)
    }

    /// The earlier result goes back to its place, if that is free.
    fn put_back(&self, set_aside: &[PathBuf], error: Error) -> Error {
        if let Some(last) = set_aside.last()
            && !self.target.exists()
        {
            let _ = fs::rename(last, &self.target);
        }
        error
    }

    /// A free name for an earlier result, which tells whose it is.
    fn aside(&self) -> PathBuf {
        let name = self.target.file_name().unwrap_or_default();
        let (name, pid) = (name.to_string_lossy(), std::process::id());
        let named = |word: String| self.partial.with_file_name(format!(".{name}.{word}-{pid}"));
        let free = |path: &PathBuf| fs::symlink_metadata(path).is_err();
        old_words()
            .map(named)
            .find(free)
            .unwrap_or_else(|| named(OLD.to_owned()))
    }
}

/// `old`, `old1`, ...: several may be set aside.
fn old_words() -> impl Iterator<Item = String> {
    let numbered = (1..2 * ATTEMPTS).map(|k| format!("{OLD}{k}"));
    std::iter::once(OLD.to_owned()).chain(numbered)
}

impl Drop for Staging {
    fn drop(&mut self) {
        self.lock = None;
        let _ = fs::remove_dir_all(&self.partial);
    }
}

/// # Errors
/// A file; a folder that holds something else than an earlier result.
fn refuse_what_is_no_result(target: &Path) -> Result<(), Error> {
    if !target.exists() {
        return Ok(());
    }
    let refuse = |what: String| {
        Err(Error::Input(format!(
            "{}: {what}; name another folder with --out",
            target.display()
        )))
    };
    if !target.is_dir() {
        return refuse("is a file, not a folder".to_owned());
    }
    let mut entries = fs::read_dir(target).map_err(Error::io(target, "read the result folder"))?;
    if entries.next().is_none() || Listing::is_in(target) {
        return Ok(());
    }
    let mark = target.join(MARK);
    if !mark.is_file() {
        return refuse(format!(
            "holds files that are no snapin result (no {MARK}), so it is left alone"
        ));
    }
    // Other programs write a file of this name too. One that is damaged may be ours.
    let text = fs::read(&mark).unwrap_or_default();
    match serde_json::from_slice::<serde_json::Value>(&text) {
        Ok(value) if value.get(KEY).is_none() => refuse(format!(
            "holds files that are no snapin result ({MARK} is of another program), so it is left alone"
        )),
        _ => Ok(()),
    }
}

/// Removes what killed runs were making in this folder.
fn sweep(parent: &Path) {
    let Ok(entries) = fs::read_dir(parent) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let Some((stem, pid)) = leftovers::maker(&name, PARTIAL) else {
            continue;
        };
        let path = entry.path();
        if is_folder
            && stem.starts_with('.')
            && Listing::holds_nothing_else(&path)
            && leftovers::is_abandoned(&path.join(LISTING), pid)
        {
            let _ = fs::remove_dir_all(&path);
        }
    }
}

/// Fetches what a run that was killed amid its last renames had set aside: the earlier result as a whole if there is no
/// newer one, else the user's own files in it.
fn restore(parent: &Path, name: &str, target: &Path) {
    let Ok(entries) = fs::read_dir(parent) else {
        return;
    };
    for entry in entries.flatten() {
        let file_name = entry.file_name();
        let file_name = file_name.to_string_lossy();
        let made = old_words().find_map(|word| leftovers::maker(&file_name, &word));
        let Some((stem, pid)) = made else {
            continue;
        };
        let is_of_target = stem.strip_prefix('.') == Some(name);
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if !is_of_target || !is_folder || leftovers::is_alive(pid) {
            continue;
        }
        let old = entry.path();
        if !target.exists() {
            let _ = fs::rename(&old, target);
        } else if keep_own_files(&old, target).is_ok() {
            let _ = fs::remove_dir_all(&old);
        }
    }
}

/// Moves what is not of this program from an earlier result into the new one.
///
/// # Errors
/// What the system says; files that are not moved stay where they were.
fn keep_own_files(old: &Path, new: &Path) -> std::io::Result<()> {
    let list = Listing::of(old);
    keep_below(old, new, Path::new(""), &list)
}

fn keep_below(old: &Path, new: &Path, below: &Path, list: &Listing) -> std::io::Result<()> {
    for entry in fs::read_dir(old.join(below))? {
        let entry = entry?;
        let path = below.join(entry.file_name());
        // A link to a folder is the user's, and moved as it is.
        if entry.file_type()?.is_dir() {
            let is_free = fs::symlink_metadata(new.join(&path)).is_err();
            if is_free && !list.has_below(&path) {
                move_to(&entry.path(), &new.join(&path))?;
            } else {
                keep_below(old, new, &path, list)?;
            }
        } else if !list.has(&path) {
            move_to(&entry.path(), &free_name(&new.join(&path)))?;
        }
    }
    Ok(())
}

fn move_to(from: &Path, to: &Path) -> std::io::Result<()> {
    if let Some(folder) = to.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::rename(from, to)
}

/// The path, or beside it, where the new result has a file of this name, `name (kept).ext`.
fn free_name(path: &Path) -> PathBuf {
    let is_free = |path: &PathBuf| fs::symlink_metadata(path).is_err();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let end = path
        .extension()
        .map_or_else(String::new, |end| format!(".{}", end.to_string_lossy()));
    let named = |k: usize| match k {
        0 => path.to_path_buf(),
        1 => path.with_file_name(format!("{stem} (kept){end}")),
        k => path.with_file_name(format!("{stem} (kept {k}){end}")),
    };
    (0..1000)
        .map(named)
        .find(is_free)
        .unwrap_or_else(|| named(1))
}

#[cfg(test)]
mod tests;
