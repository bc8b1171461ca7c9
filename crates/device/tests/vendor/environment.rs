//! The environment variable that names a library's file.

use std::process::Command;

use device::driver::{Family, Unavailable, virtuose};

use crate::stub::Stub;

const VARIABLE: &str = "SNAPIN_LIBVIRTUOSE";

/// Says that this process was started by the test for its second half.
const SECOND: &str = "SNAPIN_TEST_SECOND_HALF";

/// Runs the second half of a test: this very program, with the variable set, which holds for a whole process.
fn second_half(value: &str, test: &str) {
    let output = Command::new(std::env::current_exe().unwrap())
        .env(VARIABLE, value)
        .env(SECOND, "1")
        .args(["--exact", test, "--nocapture"])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && text.contains("1 passed"),
        "{text}\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

fn is_second_half() -> bool {
    std::env::var_os(SECOND).is_some()
}

#[test]
fn library_that_the_environment_names_is_taken() {
    if !is_second_half() {
        let stub = Stub::of("virtuose");
        let test = "environment::library_that_the_environment_names_is_taken";
        return second_half(&stub.file.display().to_string(), test);
    }
    let listing = virtuose::INSTALLED.list().remove(0);
    assert!(listing.status.unwrap().contains("Virtuose 6D"));
}

#[test]
fn nothing_else_is_tried_than_what_the_environment_names() {
    if !is_second_half() {
        let test = "environment::nothing_else_is_tried_than_what_the_environment_names";
        return second_half("/nowhere/libother.so", test);
    }
    let status = virtuose::INSTALLED.list().remove(0).status;
    let Err(Unavailable::NoLibrary { tried, mend }) = status else {
        panic!("there is no such library: {status:?}");
    };
    assert_eq!(tried, ["/nowhere/libother.so"]);
    assert!(mend.contains(VARIABLE));
}

#[test]
fn families_are_registered_and_found_by_their_names() {
    for key in ["virtuose", "dhd", "hd"] {
        let family = device::driver::FAMILIES
            .iter()
            .find(|family| family.key() == key)
            .unwrap();
        assert!(!family.title().is_empty());
    }
    // A place that none of them knows, whatever is installed here.
    for name in ["virtuose:#", "dhd:x", "hd:a\nb"] {
        let error = device::driver::open(name).unwrap_err();
        assert!(
            matches!(error, Unavailable::UnknownName { .. }),
            "{name}: {error}"
        );
    }
}
