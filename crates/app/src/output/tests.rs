use super::*;
use crate::leftovers::tests::dead_pid;

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

/// A finished result that holds these files.
fn result(target: &Path, files: &[&str]) {
    let staging = Staging::new(target).unwrap();
    for file in [&[MARK], files].concat() {
        let path = staging.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "of snapin").unwrap();
    }
    staging.commit().unwrap();
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

#[test]
fn files_of_the_user_survive_wherever_they_lie_and_those_of_the_earlier_result_go() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("clip");
    result(
        &target,
        &["report.html", "frames/01-peak.png", "frames/02-home.png"],
    );
    for own in [
        "notes.txt",
        ".hidden",
        "frames/mine.png",
        "study/deep/a.csv",
    ] {
        let path = target.join(own);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "mine").unwrap();
    }
    fs::create_dir(target.join("empty")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("/no/where", target.join("link")).unwrap();
    for _ in 0..2 {
        result(&target, &["report.html", "frames/01-peak.png"]);
        for own in [
            "notes.txt",
            ".hidden",
            "frames/mine.png",
            "study/deep/a.csv",
        ] {
            assert_eq!(text(&target.join(own)), "mine", "{own}");
        }
        assert!(target.join("empty").is_dir());
        #[cfg(unix)]
        assert!(target.join("link").is_symlink());
        assert!(!target.join("frames/02-home.png").exists());
    }
    // No frames this time: the folder stays for the user's picture only.
    result(&target, &["report.html"]);
    assert_eq!(fs::read_dir(target.join("frames")).unwrap().count(), 1);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn a_users_file_whose_name_the_new_result_takes_is_kept_beside_it() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("clip");
    result(&target, &[]);
    fs::write(target.join("curve.csv"), "mine").unwrap();
    fs::write(target.join("frames"), "a file where a folder comes").unwrap();
    result(&target, &["curve.csv", "frames/01-peak.png"]);
    assert_eq!(text(&target.join("curve.csv")), "of snapin");
    assert_eq!(text(&target.join("curve (kept).csv")), "mine");
    assert!(target.join("frames (kept)").is_file());
    assert!(target.join("frames/01-peak.png").is_file());
}

#[test]
fn results_without_a_list_are_known_by_their_names() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("clip");
    for file in [
        "frames/01-peak.png",
        "frames/holiday.png",
        "session.mcap",
        "n.md",
    ] {
        let path = target.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "x").unwrap();
    }
    fs::write(target.join(MARK), "{\"peak_insertion_force_N\": 1}").unwrap();
    result(&target, &[]);
    for (file, stays) in [
        ("frames/01-peak.png", false),
        ("frames/holiday.png", true),
        ("session.mcap", false),
        ("n.md", true),
    ] {
        assert_eq!(target.join(file).exists(), stays, "{file}");
    }
}

#[test]
fn a_summary_of_another_program_marks_no_result() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join(MARK), "{\"accuracy\": 0.97}").unwrap();
    let error = Staging::new(dir.path()).unwrap_err();
    assert!(error.to_string().contains("another program"), "{error}");
}

#[test]
fn what_a_killed_run_left_is_swept_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let dead = dead_pid();
    let make = |name: String, file: &str| {
        let path = dir.path().join(name);
        fs::create_dir(&path).unwrap();
        fs::write(path.join(file), "x").unwrap();
        path
    };
    let left = make(format!(".hook.partial-{dead}"), "report.html");
    let older = make(format!(".clip.partial-{dead}"), LISTING);
    let of_this = make(format!(".a.partial-{}", std::process::id()), "report.html");
    let others = make(format!(".mail.partial-{dead}"), "thesis.tex");
    let shown = make(format!("mail.partial-{dead}"), "report.html");
    let file = dir.path().join(format!(".b.partial-{dead}"));
    fs::write(&file, "x").unwrap();
    drop(Staging::new(&dir.path().join("clip")).unwrap());
    for path in [left, older] {
        assert!(!path.exists(), "{}", path.display());
    }
    for path in [of_this, others, shown, file] {
        assert!(path.exists(), "{}", path.display());
    }
}

#[test]
fn what_another_run_is_making_is_not_swept() {
    let dir = tempfile::tempdir().unwrap();
    let staging = Staging::new(&dir.path().join("clip")).unwrap();
    // As it looks from a container, or another computer, where this process has another number.
    let elsewhere = dir.path().join(format!(".clip.partial-{}", dead_pid()));
    fs::rename(&staging.partial, &elsewhere).unwrap();
    drop(Staging::new(&dir.path().join("hook")).unwrap());
    assert!(elsewhere.exists());
    drop(staging);
    drop(Staging::new(&dir.path().join("hook")).unwrap());
    assert!(!elsewhere.exists());
}

#[test]
fn a_run_that_was_killed_amid_its_renames_loses_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("clip");
    result(&target, &["report.html"]);
    fs::write(target.join("notes.txt"), "mine").unwrap();
    // Killed before the new result was in its place.
    let old = dir.path().join(format!(".clip.old-{}", dead_pid()));
    fs::rename(&target, &old).unwrap();
    drop(Staging::new(&target).unwrap());
    assert_eq!(text(&target.join("notes.txt")), "mine");
    assert!(target.join("report.html").is_file() && !old.exists());
    // Killed after it.
    fs::rename(&target, &old).unwrap();
    fs::create_dir(&target).unwrap();
    fs::write(target.join(MARK), "new").unwrap();
    drop(Staging::new(&target).unwrap());
    assert_eq!(text(&target.join("notes.txt")), "mine");
    assert_eq!(text(&target.join(MARK)), "new");
    assert!(!old.exists());
}

#[test]
fn two_runs_into_one_folder_both_end_and_the_users_file_stays() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("clip");
    result(&target, &[]);
    fs::write(target.join("notes.txt"), "mine").unwrap();
    let mut first = Staging::new(&target).unwrap();
    let elsewhere = dir.path().join(".clip.partial-0");
    fs::rename(&first.partial, &elsewhere).unwrap();
    first.partial = elsewhere;
    let second = Staging::new(&target).unwrap();
    for staging in [&first, &second] {
        fs::write(staging.path().join(MARK), "x").unwrap();
    }
    first.commit().unwrap();
    second.commit().unwrap();
    assert_eq!(text(&target.join("notes.txt")), "mine");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn a_link_to_a_result_folder_stays_a_link() {
    let dir = tempfile::tempdir().unwrap();
    let (disk, link) = (dir.path().join("disk"), dir.path().join("clip"));
    fs::create_dir(&disk).unwrap();
    std::os::unix::fs::symlink(&disk, &link).unwrap();
    result(&link, &[]);
    assert!(link.is_symlink() && disk.join(MARK).is_file());
}
