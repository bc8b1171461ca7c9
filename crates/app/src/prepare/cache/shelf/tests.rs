use super::*;
use crate::leftovers::tests::{dead_pid, make_old};

/// A part of 1000 bytes that was used some days ago.
fn part(dir: &Path, mesh: &str, days: u64) -> PathBuf {
    let path = dir.join(format!("{mesh}-0123456789abcdef.cache"));
    let mut content = MAGIC.to_vec();
    content.resize(1000, 0);
    fs::write(&path, content).unwrap();
    make_old(&path, days);
    path
}

/// Makes room and gives what was told.
fn room(part: &Path, coming: Option<u64>, limit: u64) -> String {
    let mut told = Vec::new();
    let ui = Ui::new(&mut told, false);
    make_room(part, coming, Limit(Some(limit)), &ui);
    String::from_utf8(told).unwrap()
}

#[test]
fn sizes_are_read_as_people_write_them() {
    for (text, bytes) in [
        ("2GB", Some(2_000_000_000)),
        (" 500 MB ", Some(500_000_000)),
        ("1.5GiB", Some(1_610_612_736)),
        ("0", Some(0)),
        ("1234", Some(1234)),
        ("10k", Some(10_000)),
        ("none", None),
    ] {
        assert_eq!(text.parse(), Ok(Limit(bytes)), "{text}");
    }
    for text in [
        "", "GB", "-1GB", "1,5GB", "1.2.3GB", "2 apples", "nan", "1e400",
    ] {
        let error = text.parse::<Limit>().unwrap_err();
        assert!(error.contains("2GB"), "{error}");
    }
    assert_eq!(Limit::default(), "2GB".parse().unwrap());
}

#[test]
fn what_was_not_used_for_the_longest_time_goes_first_and_the_part_in_use_never() {
    let dir = tempfile::tempdir().unwrap();
    let [a, b, c, d] =
        [("a", 5), ("b", 3), ("c", 9), ("d", 1)].map(|(n, t)| part(dir.path(), n, t));
    assert_eq!(room(&d, None, 4000), "");
    // Two others may stay: c is the oldest of all.
    let told = room(&d, None, 3000);
    assert!(told.contains("1 prepared part that was not used"), "{told}");
    assert!(!c.exists() && a.exists() && b.exists() && d.exists());
    // One more is to come, and the oldest is the one in use.
    let told = room(&a, Some(2000), 3000);
    assert!(told.contains("1.0 kB"), "{told}");
    assert!(a.exists() && !b.exists() && d.exists());
    room(&a, None, 0);
    assert!(
        a.exists() && !d.exists(),
        "the part in use stays whatever the bound"
    );
}

#[test]
fn what_another_program_uses_stays_and_the_next_one_goes() {
    let dir = tempfile::tempdir().unwrap();
    let [old, newer, now] =
        [("old", 9), ("newer", 5), ("now", 0)].map(|(n, t)| part(dir.path(), n, t));
    let user = File::open(&old).unwrap();
    user.lock_shared().unwrap();
    room(&now, None, 2000);
    assert!(old.exists() && !newer.exists());
    let removed = clear(dir.path(), Duration::ZERO).unwrap();
    assert_eq!((removed.files, removed.in_use), (1, 1));
    drop(user);
    assert_eq!(clear(dir.path(), Duration::ZERO).unwrap().files, 1);
}

/// A folder of the user with all that looks a little like ours.
#[test]
fn links_and_files_of_others_are_neither_listed_nor_removed() {
    let dir = tempfile::tempdir().unwrap();
    let dead = dead_pid();
    let ours = part(dir.path(), "clip", 9);
    let of_ours = fs::read(&ours).unwrap();
    let names = [
        "thesis.tex".to_owned(),
        // The name is ours, the content is not.
        "photo-0123456789abcdef.cache".to_owned(),
        "multiply-0123456789abcdef.json".to_owned(),
        format!("x-0123456789abcdef.partial-{dead}"),
    ];
    for name in &names {
        fs::write(dir.path().join(name), "not of snapin").unwrap();
    }
    // The content is ours, the name is not.
    let renamed = [
        "clip.cache".to_owned(),
        "clip-0123456789ABCDEF.cache".to_owned(),
        "clip-0123456789abcdef.cache.bak".to_owned(),
        format!("clip.partial-{dead}"),
    ];
    for name in &renamed {
        fs::write(dir.path().join(name), &of_ours).unwrap();
    }
    fs::create_dir(dir.path().join("folder-0123456789abcdef.cache")).unwrap();
    #[cfg(unix)]
    let link = {
        let link = dir.path().join("link-0123456789abcdef.cache");
        let elsewhere = dir.path().join("elsewhere");
        fs::write(&elsewhere, &of_ours).unwrap();
        std::os::unix::fs::symlink(&elsewhere, &link).unwrap();
        link
    };
    assert_eq!(entries(dir.path()).unwrap().len(), 1);
    room(&part(dir.path(), "now", 0), None, 0);
    assert!(!ours.exists());
    assert_eq!(clear(dir.path(), Duration::ZERO).unwrap().files, 1);
    for name in names.iter().chain(&renamed) {
        assert!(dir.path().join(name).exists(), "{name}");
    }
    assert!(dir.path().join("folder-0123456789abcdef.cache").exists());
    #[cfg(unix)]
    assert!(link.is_symlink() && link.exists());
}

#[test]
fn what_a_killed_program_was_writing_goes_and_what_is_being_written_stays() {
    let dir = tempfile::tempdir().unwrap();
    let dead = dead_pid();
    let write = |name: &str, content: &[u8]| {
        let path = dir
            .path()
            .join(format!("{name}-0123456789abcdef.partial-{dead}"));
        fs::write(&path, content).unwrap();
        path
    };
    let (begun, empty) = (write("clip", b"SNAPINC\n and more"), write("hook", b""));
    let measured = write("multiply", b"{ \"key\": 1 }");
    let writing = write("edge", b"SNAPINC\n and more");
    let writer = File::open(&writing).unwrap();
    leftovers::lock(&writer);
    clear(dir.path(), Duration::ZERO).unwrap();
    for path in [begun, empty, measured] {
        assert!(!path.exists(), "{}", path.display());
    }
    assert!(writing.exists());
}

#[test]
fn only_what_was_not_used_for_long_is_cleared_when_asked_so() {
    let dir = tempfile::tempdir().unwrap();
    let [old, new] = [("old", 31), ("new", 29)].map(|(n, t)| part(dir.path(), n, t));
    let removed = clear(dir.path(), Duration::from_secs(30 * 24 * 3600)).unwrap();
    assert_eq!((removed.files, removed.bytes), (1, 1000));
    assert!(!old.exists() && new.exists());
}

#[test]
fn a_folder_that_is_not_there_is_empty_and_a_file_is_no_folder() {
    let dir = tempfile::tempdir().unwrap();
    assert!(entries(&dir.path().join("none")).unwrap().is_empty());
    assert_eq!(
        clear(&dir.path().join("none"), Duration::ZERO).unwrap(),
        Removed::default()
    );
    let file = dir.path().join("file");
    fs::write(&file, "x").unwrap();
    assert!(entries(&file).is_err());
    assert_eq!(clear(&file, Duration::ZERO).unwrap_err().0, file);
}
