use std::time::Instant;

use super::*;

const SPEC: Spec = Spec {
    variable: "SNAPIN_NO_SUCH_VARIABLE",
    names: &["libsnapin_no_such.so", "libsnapin_no_such.so.3"],
    folders: &["/nowhere/lib"],
    source: "it comes with the test",
};

#[derive(Debug)]
struct Nothing;

impl Table for Nothing {
    unsafe fn look_up(_: &mut Symbols<'_>) -> Option<Self> {
        Some(Self)
    }
}

#[test]
fn given_file_goes_before_the_named_one_and_both_before_the_usual_names() {
    let (given, named) = (Path::new("/a/given.so"), Path::new("/a/named.so"));
    assert_eq!(SPEC.candidates(Some(given), Some(named)), [given]);
    assert_eq!(SPEC.candidates(None, Some(named)), [named]);
    let usual: Vec<String> = SPEC
        .candidates(None, None)
        .iter()
        .map(|file| file.display().to_string().replace('\\', "/"))
        .collect();
    assert_eq!(
        usual,
        [
            "libsnapin_no_such.so",
            "libsnapin_no_such.so.3",
            "/nowhere/lib/libsnapin_no_such.so",
            "/nowhere/lib/libsnapin_no_such.so.3"
        ]
    );
}

#[test]
fn absent_library_names_all_that_was_tried_and_where_it_comes_from() {
    let shelf = Shelf::<Nothing>::new();
    let error = shelf.get(&SPEC, None).unwrap_err();
    let Unavailable::NoLibrary { tried, mend } = &error else {
        panic!("{error}");
    };
    let words = [
        "libsnapin_no_such.so",
        "libsnapin_no_such.so.3",
        "the same in /nowhere/lib",
    ];
    assert_eq!(*tried, words);
    assert!(mend.contains("comes with the test") && mend.contains(SPEC.variable));
}

#[test]
fn file_that_is_no_library_is_there_but_cannot_be_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("text.so");
    std::fs::write(&file, "not a library").unwrap();
    let error = Shelf::<Nothing>::new().get(&SPEC, Some(&file)).unwrap_err();
    let Unavailable::Failed { reason } = &error else {
        panic!("{error}");
    };
    assert!(
        reason.contains("text.so") && reason.contains("cannot be loaded"),
        "{reason}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn missing_dependency_is_not_taken_for_a_missing_library() {
    let file = Path::new("libHD.so");
    let itself = "libHD.so: cannot open shared object file: No such file or directory";
    let other = "libPhantomIOLib42.so: cannot open shared object file: No such file or directory";
    let musl = "Error loading shared library libHD.so: No such file or directory";
    assert!(is_absent(file, itself) && is_absent(file, musl));
    assert!(!is_absent(file, other));
    assert!(!is_absent(
        file,
        "/usr/lib/libHD.so: wrong ELF class: ELFCLASS32"
    ));
}

#[test]
fn work_that_does_not_end_is_left_behind() {
    let (go, wait) = channel::<()>();
    let begun = Instant::now();
    let none = within(Duration::from_millis(20), move || {
        let _told_at_the_end = wait.recv();
    });
    assert!(none.is_none() && begun.elapsed().as_secs() < 10);
    drop(go);
    assert_eq!(within(Duration::from_secs(10), || 7), Some(7));
}

#[test]
fn text_of_a_library_ends_somewhere_and_has_no_control_characters() {
    let long = [b'x' as c_char; TEXT_MAX];
    let odd = c"\tbad\ncable ";
    // SAFETY: 200 bytes and a text that ends.
    let (long, odd) = unsafe { (text(long.as_ptr()), text(odd.as_ptr())) };
    assert_eq!(long.len(), TEXT_MAX);
    assert_eq!(odd, "bad cable");
    // SAFETY: null is allowed.
    assert_eq!(unsafe { text(std::ptr::null()) }, "");
}

#[test]
fn lease_is_given_once_at_a_time() {
    let library: &'static Library<()> = Box::leak(Box::new(Library {
        functions: (),
        file: "libtest.so".to_owned(),
        is_held: AtomicBool::new(false),
    }));
    let lease = library.lease().unwrap();
    let busy = library.lease().unwrap_err().to_string();
    assert!(busy.contains("libtest.so"), "{busy}");
    drop(lease);
    assert!(library.lease().is_ok());
}
