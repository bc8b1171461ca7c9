//! A fault of the program itself: one line and an exit code of its own in place of a trace, and nothing half-written.
//!
//! Unwinding drops what was begun: the folder beside the result vanishes (see `output`), the device is released.

use std::any::Any;
use std::cell::Cell;
use std::io::Write;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Exit code of a fault of the program, `EX_SOFTWARE` of sysexits.h.
pub const EXIT_CODE: u8 = 70;

/// Panics that are kept of one command: those of many threads at once are one fault.
const MOST_KEPT: usize = 8;

/// Commands that are under way behind [`guard`].
static GUARDED: AtomicUsize = AtomicUsize::new(0);

/// What panicked since the guard was put up, on whatever thread.
static KEPT: Mutex<Vec<Kept>> = Mutex::new(Vec::new());

thread_local! {
    /// Whether a fault was told where it was caught, so that [`guard`] need not.
    static TOLD: Cell<bool> = const { Cell::new(false) };
}

/// A panic as the hook saw it.
struct Kept {
    message: String,
    place: String,
}

/// Keeps panics to be told in one line by [`guard`], with their place. Called once, by the program, never by the
/// library's users.
pub fn install() {
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if GUARDED.load(Ordering::SeqCst) == 0 {
            before(info);
        } else {
            keep(info);
        }
    }));
}

fn keep(info: &PanicHookInfo<'_>) {
    let mut kept = kept();
    if kept.len() < MOST_KEPT {
        kept.push(Kept {
            message: message_of(info.payload()),
            place: info
                .location()
                .map_or_else(String::new, |at| format!("{}:{}", at.file(), at.line())),
        });
    }
}

fn kept() -> MutexGuard<'static, Vec<Kept>> {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does the work of a command. Where it panics, or ends with [`EXIT_CODE`] because a thread of it did, `err` gets one
/// line with the place and where to report it.
pub fn guard(err: &mut dyn Write, work: impl FnOnce(&mut dyn Write) -> u8) -> u8 {
    if GUARDED.fetch_add(1, Ordering::SeqCst) == 0 {
        kept().clear();
    }
    TOLD.set(false);
    let outcome = catch_unwind(AssertUnwindSafe(|| work(&mut *err)));
    GUARDED.fetch_sub(1, Ordering::SeqCst);
    let message = match &outcome {
        Ok(EXIT_CODE) if TOLD.take() => return EXIT_CODE,
        Ok(EXIT_CODE) => None,
        Ok(code) => return *code,
        Err(payload) => Some(message_of(payload.as_ref())),
    };
    // A closed error stream leaves nobody to tell.
    let _ = writeln!(err, "{}", line(message));
    EXIT_CODE
}

/// Does one of several works, of which the others go on where it panics. The command then ends with [`EXIT_CODE`] and
/// shows the line itself.
///
/// # Errors
/// What is to be told of a panic: what, its place, and where to report it.
pub(crate) fn catch<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
        TOLD.set(true);
        let message = message_of(payload.as_ref());
        let fault = fault(Some(message.clone()));
        // Told: there is room for what comes next.
        kept().retain(|k| k.message != message);
        format!(
            "{fault}; please report this line with the files it is about to {}",
            tracker()
        )
    })
}

/// The one line. `message`: of the panic that ended the command, if it got that far.
fn line(message: Option<String>) -> String {
    format!(
        "snapin: {}; nothing was written and earlier results are untouched; please report this line with the scene \
         and its mesh to {}",
        fault(message),
        tracker()
    )
}

/// What happened and where.
fn fault(message: Option<String>) -> String {
    let kept = kept();
    // Another thread's may have been dealt with; the one that ended the command has its message.
    let same = kept
        .iter()
        .find(|k| message.as_ref().is_none_or(|m| *m == k.message));
    let place = same.map_or("place unknown", |k| k.place.as_str());
    let what = message
        .or_else(|| same.map(|k| k.message.clone()))
        .unwrap_or_else(|| "a thread ended".to_owned());
    format!(
        "a fault of the program, not of your input: {what} ({place}, version {})",
        env!("CARGO_PKG_VERSION")
    )
}

fn tracker() -> String {
    match env!("CARGO_PKG_REPOSITORY") {
        "" => "the project's issue tracker".to_owned(),
        repository => format!("{repository}/issues"),
    }
}

/// What was said, in one line.
fn message_of(payload: &(dyn Any + Send)) -> String {
    let text = match (
        payload.downcast_ref::<&str>(),
        payload.downcast_ref::<String>(),
    ) {
        (Some(text), _) => text,
        (None, Some(text)) => text.as_str(),
        (None, None) => "a panic without words",
    };
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::Staging;

    /// One after the other: the hook and what it keeps are the process's.
    #[test]
    fn a_panic_on_any_thread_becomes_one_line_an_exit_code_and_nothing_half_written() {
        install();

        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("result");
        let mut err = Vec::new();
        let code = guard(&mut err, |err| {
            let staging = Staging::new(&target).unwrap();
            std::fs::write(staging.path().join("report.html"), "half").unwrap();
            writeln!(err, "warning: before").unwrap();
            let empty: Vec<u8> = Vec::new();
            empty[std::hint::black_box(7)]
        });
        let text = String::from_utf8(err).unwrap();
        assert_eq!(code, 70, "{text}");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 2, "{text}");
        assert_eq!(lines[0], "warning: before");
        for part in [
            "index out of bounds: the len is 0 but the index is 7",
            "crash.rs:",
            "report this line",
            "issue",
        ] {
            assert!(lines[1].contains(part), "{part}: {text}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);

        // On a thread beside, whose end the command tells by the code.
        let mut err = Vec::new();
        let code = guard(&mut err, |_| {
            let joined = std::thread::spawn(|| panic!("two\nlines")).join();
            if joined.is_err() { EXIT_CODE } else { 0 }
        });
        let text = String::from_utf8(err).unwrap();
        assert_eq!(code, 70);
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(
            text.contains("two lines (") && text.contains("crash.rs:"),
            "{text}"
        );

        // One of several works: its line is for the command to show, and the next one is done.
        let mut err = Vec::new();
        let mut lines = Vec::new();
        let code = guard(&mut err, |_| {
            for k in 0..20 {
                lines.push(catch(|| assert!(k % 2 == 0, "odd {k}")));
            }
            EXIT_CODE
        });
        assert_eq!((code, err.len()), (EXIT_CODE, 0));
        for (k, line) in lines.iter().enumerate() {
            match line {
                Ok(()) => assert_eq!(k % 2, 0),
                Err(line) => {
                    let is_whole =
                        line.contains(&format!("odd {k} (")) && line.contains("crash.rs:");
                    assert!(is_whole && line.contains("report this line"), "{line}");
                }
            }
        }

        // What goes well says nothing.
        let mut err = Vec::new();
        assert_eq!(guard(&mut err, |_| 2), 2);
        assert!(err.is_empty());
        let _ = std::panic::take_hook();
    }
}
