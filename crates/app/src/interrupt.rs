//! Ctrl-C: a flag that long work looks at. A second Ctrl-C ends the program at once.

use std::sync::atomic::{AtomicBool, Ordering};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Exit code of a program that Ctrl-C ended, as shells have it.
pub const EXIT_CODE: u8 = 130;

/// Installs the handler. Called once, by the program, never by the library's users.
pub fn install() {
    // Without a handler Ctrl-C ends the program at once, which loses nothing: results are
    // written beside and renamed.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(EXIT_CODE));
        }
    });
}

/// Whether the user asked to stop.
pub fn is_requested() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}
