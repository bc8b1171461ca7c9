//! What is in the making, and what a killed run left of it.
//!
//! Files and folders that take time are written beside their place under a name that ends in `.partial-PID`, and
//! renamed once they are whole. Their maker holds a lock on them, which the system frees however the process ends: what
//! can be locked has been left behind. So neither a process number that is used again, nor another computer or
//! container that writes to the same drive, leads to the loss of what somebody is still writing.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::Path;
use std::time::{Duration, SystemTime};

use sysinfo::{Pid, ProcessRefreshKind, ProcessStatus, ProcessesToUpdate, System};

/// Between making a file and locking it no maker takes this long.
const SURELY_LOCKED: Duration = Duration::from_secs(60);

/// Where a drive has no locks, nothing is in the making for longer than this.
const WITHOUT_LOCKS: Duration = Duration::from_secs(24 * 3600);

/// The end of a name in the making: `partial-` and the number of this process.
pub(crate) fn mark() -> String {
    format!("partial-{}", std::process::id())
}

/// The name and the process number of `NAME.WORD-PID`.
pub(crate) fn maker<'a>(name: &'a str, word: &str) -> Option<(&'a str, u32)> {
    let (before, pid) = name.rsplit_once('-')?;
    let stem = before.strip_suffix(word)?.strip_suffix('.')?;
    let is_number = !pid.is_empty() && pid.bytes().all(|b| b.is_ascii_digit());
    Some((stem, pid.parse().ok().filter(|_| is_number)?))
}

/// Writes a small file beside its place and renames it, after sweeping what killed programs left of the same file.
///
/// # Errors
/// What the system says; nothing half-written is left.
pub(crate) fn write_beside(file: &Path, bytes: &[u8]) -> io::Result<()> {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    if let Some(dir) = file.parent() {
        sweep_files(dir, |_, of| of == stem);
    }
    let partial = file.with_extension(mark());
    let written = fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, file));
    if written.is_err() {
        let _ = fs::remove_file(&partial);
    }
    written
}

/// Removes files that killed programs were making in a folder. `is_ours`: of a file and its name without the mark.
pub(crate) fn sweep_files(dir: &Path, is_ours: impl Fn(&Path, &str) -> bool) {
    let dir = if dir.as_os_str().is_empty() {
        Path::new(".")
    } else {
        dir
    };
    let Ok(listed) = fs::read_dir(dir) else {
        return;
    };
    for entry in listed.flatten() {
        let name = entry.file_name();
        let made = name.to_str().and_then(|name| maker(name, "partial"));
        let Some((stem, pid)) = made else { continue };
        let path = entry.path();
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && is_ours(&path, stem) && is_abandoned(&path, pid) {
            let _ = fs::remove_file(&path);
        }
    }
}

/// Takes the maker's lock, where the drive has locks.
pub(crate) fn lock(file: &File) {
    // Without it, age and process number tell.
    let _ = file.try_lock();
}

/// Whether what process `pid` was making has been left behind. `locked`: the file whose lock the maker holds.
pub(crate) fn is_abandoned(locked: &Path, pid: u32) -> bool {
    let is_file = fs::symlink_metadata(locked).is_ok_and(|meta| meta.is_file());
    // Some drives give an exclusive lock only to those who may write.
    let open = || {
        let to_write = File::options().append(true).open(locked);
        to_write.or_else(|_| File::open(locked)).ok()
    };
    let Some(file) = is_file.then(open).flatten() else {
        // Killed before it was made; or its maker is about to make it.
        return !is_alive(pid);
    };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => false,
        Ok(()) => !is_alive(pid) || age(locked) > SURELY_LOCKED,
        Err(TryLockError::Error(_)) => !is_alive(pid) && age(locked) > WITHOUT_LOCKS,
    }
}

/// Since it was last written; none for a time to come.
pub(crate) fn age(path: &Path) -> Duration {
    let modified = fs::symlink_metadata(path).and_then(|meta| meta.modified());
    modified.map_or(Duration::ZERO, |at| {
        SystemTime::now().duration_since(at).unwrap_or_default()
    })
}

/// Whether a process of this number runs here; one that has ended and is not yet taken note of does not.
pub(crate) fn is_alive(pid: u32) -> bool {
    let pid = Pid::from_u32(pid);
    let mut system = System::new();
    let what = ProcessRefreshKind::nothing();
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[pid]), true, what);
    let process = system.process(pid);
    process.is_some_and(|p| !matches!(p.status(), ProcessStatus::Zombie | ProcessStatus::Dead))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The number of a process that ran and has ended.
    pub(crate) fn dead_pid() -> u32 {
        let program = std::env::current_exe().unwrap();
        let mut child = std::process::Command::new(program)
            .arg("--list")
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        child.wait().unwrap();
        child.id()
    }

    /// As if it had been written some days ago.
    pub(crate) fn make_old(path: &Path, days: u64) {
        let at = SystemTime::now() - Duration::from_secs(days * 24 * 3600);
        let file = File::options().append(true).open(path).unwrap();
        file.set_modified(at).unwrap();
    }

    #[test]
    fn names_in_the_making_are_told_from_others() {
        assert_eq!(maker(".clip.partial-17", "partial"), Some((".clip", 17)));
        assert_eq!(maker("a-b.c.old-1", "old"), Some(("a-b.c", 1)));
        for other in [
            "clip",
            "clip.partial",
            "clip.partial-",
            "clip.partial-x",
            "clip.partial-+3",
            "clip-partial-3",
            "partial-3",
            "clip.partial-3.txt",
            "clip.partial-99999999999",
        ] {
            assert_eq!(maker(other, "partial"), None, "{other}");
        }
        assert_eq!(
            maker(&format!("x.{}", mark()), "partial"),
            Some(("x", std::process::id()))
        );
    }

    #[test]
    fn what_is_locked_is_in_the_making_whoever_holds_its_number() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("file");
        let file = File::create(&path).unwrap();
        let (dead, alive) = (dead_pid(), std::process::id());
        lock(&file);
        assert!(!is_abandoned(&path, dead) && !is_abandoned(&path, alive));
        drop(file);
        assert!(is_abandoned(&path, dead));
        assert!(!is_abandoned(&path, alive), "it may be about to lock it");
        // A number that is used again: nobody holds the lock of an old file.
        make_old(&path, 1);
        assert!(is_abandoned(&path, alive));
    }

    #[test]
    fn a_file_is_written_whole_and_only_its_own_leftovers_go() {
        let dir = tempfile::tempdir().unwrap();
        let dead = dead_pid();
        let file = dir.path().join("found.json");
        let left = dir.path().join(format!("found.partial-{dead}"));
        let other = dir.path().join(format!("other.partial-{dead}"));
        for path in [&left, &other] {
            fs::write(path, "half").unwrap();
        }
        write_beside(&file, b"whole").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"whole");
        assert!(!left.exists() && other.exists());
        assert!(write_beside(&dir.path().join("none/found.json"), b"x").is_err());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
    }

    #[test]
    fn without_a_file_the_process_tells() {
        let nothing = Path::new("no such file");
        assert!(is_abandoned(nothing, dead_pid()));
        assert!(!is_abandoned(nothing, std::process::id()));
    }
}
