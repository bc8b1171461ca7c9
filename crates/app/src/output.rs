//! A result folder that is complete or not there: written beside and renamed.

use std::fs;
use std::path::{Path, PathBuf};

use crate::Error;

/// File that marks a folder as a result of this program.
const MARK: &str = "summary.json";

/// A folder in the making. Dropped without [`Staging::commit`], it vanishes and an earlier result
/// stays as it was.
#[derive(Debug)]
pub(crate) struct Staging {
    target: PathBuf,
    partial: PathBuf,
}

impl Staging {
    /// Makes the folder to write into, beside `target`.
    ///
    /// # Errors
    /// If `target` is a file, a folder that holds something else than an earlier result, or
    /// cannot be written beside.
    pub(crate) fn new(target: &Path) -> Result<Self, Error> {
        if target.exists() {
            if !target.is_dir() {
                return Err(Error::Input(format!(
                    "{}: is a file, not a folder; name another folder with --out",
                    target.display()
                )));
            }
            let mut entries =
                fs::read_dir(target).map_err(Error::io(target, "read the result folder"))?;
            if entries.next().is_some() && !target.join(MARK).is_file() {
                return Err(Error::Input(format!(
                    "{}: holds files that are no snapin result (no {MARK}), so it is left alone; \
                     name another folder with --out",
                    target.display()
                )));
            }
        }
        let absolute =
            std::path::absolute(target).map_err(Error::io(target, "find the result folder"))?;
        let (Some(parent), Some(name)) = (absolute.parent(), absolute.file_name()) else {
            return Err(Error::Input(format!(
                "{}: is not a folder that can be replaced; name another with --out",
                target.display()
            )));
        };
        fs::create_dir_all(parent).map_err(Error::io(
            parent,
            "create the folder for results (name another with --out)",
        ))?;
        let partial = parent.join(format!(
            ".{}.partial-{}",
            name.to_string_lossy(),
            std::process::id()
        ));
        let _ = fs::remove_dir_all(&partial);
        fs::create_dir(&partial).map_err(Error::io(
            &partial,
            "create the result folder (name another with --out)",
        ))?;
        Ok(Self {
            target: absolute,
            partial,
        })
    }

    /// Where to write.
    pub(crate) fn path(&self) -> &Path {
        &self.partial
    }

    /// Puts the finished folder in its place; an earlier result is replaced only now.
    pub(crate) fn commit(self) -> Result<(), Error> {
        let old = self.partial.with_extension("old");
        let _ = fs::remove_dir_all(&old);
        let had_old = self.target.exists();
        if had_old {
            fs::rename(&self.target, &old)
                .map_err(Error::io(&self.target, "set the earlier result aside"))?;
        }
        if let Err(source) = fs::rename(&self.partial, &self.target) {
            if had_old {
                let _ = fs::rename(&old, &self.target);
            }
            return Err(Error::Io {
                path: self.target.clone(),
                action: "put the result in its place",
                source,
            });
        }
        if had_old {
            let _ = fs::remove_dir_all(&old);
        }
        Ok(())
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.partial);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_earlier_result_is_replaced_only_by_a_finished_one() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("clip");
        fs::create_dir(&target).unwrap();
        fs::write(target.join(MARK), "old").unwrap();

        let staging = Staging::new(&target).unwrap();
        fs::write(staging.path().join(MARK), "half").unwrap();
        drop(staging);
        assert_eq!(fs::read_to_string(target.join(MARK)).unwrap(), "old");

        let staging = Staging::new(&target).unwrap();
        fs::write(staging.path().join(MARK), "new").unwrap();
        staging.commit().unwrap();
        assert_eq!(fs::read_to_string(target.join(MARK)).unwrap(), "new");
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            1,
            "nothing is left beside"
        );
    }

    #[test]
    fn a_folder_with_other_files_is_left_alone() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("thesis.tex"), "years of work").unwrap();
        let error = Staging::new(dir.path()).unwrap_err();
        assert!(error.to_string().contains("--out"), "{error}");
        assert!(dir.path().join("thesis.tex").exists());
    }
}
