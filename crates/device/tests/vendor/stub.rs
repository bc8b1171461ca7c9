//! Stand-ins for the makers' libraries: compiled by the test, loaded by the driver and by the test alike.

use std::ffi::{CString, c_char};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use device::driver::Opened;
use device::{HandleState, Wrench};
use glam::DVec3;
use libloading::Library;
use tempfile::TempDir;

/// Longest time that anything may take to come to be.
pub(crate) const LIMIT: Duration = Duration::from_secs(20);

/// One stand-in in a file of its own, so that it shares nothing with those of other tests.
pub(crate) struct Stub {
    pub(crate) file: PathBuf,
    library: Library,
    _folder: TempDir,
}

impl Stub {
    /// The stand-in for a maker's library.
    pub(crate) fn of(maker: &str) -> Self {
        Self::with(maker, None)
    }

    /// The same, compiled with a condition that leaves something out.
    pub(crate) fn with(maker: &str, condition: Option<&str>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(format!("lib{maker}.so"));
        std::fs::copy(compiled(maker, condition), &file).unwrap();
        // SAFETY: our own code, which does nothing when it is loaded.
        let library = unsafe { Library::new(&file) }.unwrap();
        Self {
            file,
            library,
            _folder: folder,
        }
    }

    /// Turns a knob.
    pub(crate) fn set(&self, name: &str, value: f64) {
        let name = CString::new(name).unwrap();
        // SAFETY: the type is that of the stub's function.
        unsafe {
            let set = self
                .library
                .get::<unsafe extern "C" fn(*const c_char, f64)>("stub_set")
                .unwrap();
            set(name.as_ptr(), value);
        }
    }

    /// Has the stub call a function of the test.
    pub(crate) fn hand_over(&self, name: &str, call: extern "C" fn()) {
        // SAFETY: the type is that of the stub's function.
        unsafe {
            let hand_over = self
                .library
                .get::<unsafe extern "C" fn(extern "C" fn())>(name)
                .unwrap();
            hand_over(call);
        }
    }

    /// All calls so far.
    pub(crate) fn calls(&self) -> Vec<String> {
        self.calls_from(0)
    }

    /// The calls after so many.
    pub(crate) fn calls_from(&self, from: usize) -> Vec<String> {
        type Log = unsafe extern "C" fn(usize, *mut u8, usize) -> usize;
        let mut buffer: Vec<u8> = Vec::new();
        loop {
            // SAFETY: the type is that of the stub's function, the room is the buffer's.
            let needed = unsafe {
                let log = self.library.get::<Log>("stub_log").unwrap();
                log(from, buffer.as_mut_ptr(), buffer.len())
            };
            if needed <= buffer.len() {
                buffer.truncate(needed);
                let text = String::from_utf8(buffer).unwrap();
                return text.lines().map(str::to_owned).collect();
            }
            // Some to spare: the log goes on growing.
            buffer.resize(2 * needed, 0);
        }
    }

    /// How many calls there were so far.
    pub(crate) fn lines(&self) -> usize {
        // SAFETY: the type is that of the stub's function.
        unsafe {
            self.library
                .get::<unsafe extern "C" fn() -> usize>("stub_lines")
                .unwrap()()
        }
    }

    /// The numbers of all calls of this function.
    pub(crate) fn numbers(&self, call: &str) -> Vec<Vec<f64>> {
        let calls = self.calls();
        calls
            .iter()
            .filter_map(|line| numbers(line, call))
            .collect()
    }

    /// The numbers of its last call, if it is not long ago.
    pub(crate) fn newest(&self, call: &str) -> Option<Vec<f64>> {
        let calls = self.calls_from(self.lines().saturating_sub(50));
        calls.iter().rev().find_map(|line| numbers(line, call))
    }

    /// Were the last ten calls ones with zeros alone? A single one may be the driver's answer to a stall of the test.
    pub(crate) fn is_at_zero(&self, call: &str) -> bool {
        let calls = self.calls_from(self.lines().saturating_sub(50));
        let all: Vec<Vec<f64>> = calls
            .iter()
            .filter_map(|line| numbers(line, call))
            .collect();
        all.len() >= 10 && all[all.len() - 10..].iter().flatten().all(|x| *x == 0.0)
    }

    /// Waits for ten calls in a row with zeros alone, after so many lines and before the device is given up.
    pub(crate) fn wait_for_zeros(
        &self,
        opened: &mut Opened,
        wrench: Wrench,
        from: usize,
        call: &str,
        close: &str,
    ) {
        drive_until(opened, wrench, "zero force", |_| {
            let calls = self.calls_from(from);
            let is_open = |line: &&String| !is_of(line, close);
            let kept: Vec<&String> = calls.iter().take_while(is_open).collect();
            let all = kept.iter().filter_map(|line| numbers(line, call));
            let is_zero: Vec<bool> = all.map(|n| n.iter().all(|x| *x == 0.0)).collect();
            let runs = is_zero.split(|is_zero| !is_zero);
            let zeros = runs.map(<[bool]>::len).max().unwrap_or(0);
            assert!(
                zeros >= 10 || kept.len() == calls.len(),
                "given up without zero force: {:?}",
                tail(&calls)
            );
            zeros >= 10
        });
    }

    /// Was a call with zeros alone among those after so many lines?
    pub(crate) fn has_zero_since(&self, from: usize, call: &str) -> bool {
        let calls = self.calls_from(from);
        calls
            .iter()
            .filter_map(|line| numbers(line, call))
            .any(|n| n.iter().all(|x| *x == 0.0))
    }

    /// Did the first number of the calls after so many lines take some values between zero and this one?
    pub(crate) fn has_risen_slowly_to(&self, full: f64, from: usize, call: &str) -> bool {
        let calls = self.calls_from(from);
        let all = calls.iter().filter_map(|line| numbers(line, call));
        all.filter(|n| n[0] > 0.0 && n[0] < full).count() >= 2
    }

    /// Was the call before this place one with zeros alone?
    pub(crate) fn is_zero_before(&self, place: usize, call: &str) -> bool {
        numbers(&self.calls()[place - 1], call).is_some_and(|n| n.iter().all(|x| *x == 0.0))
    }

    /// Place of the last such call; fails where there is none.
    pub(crate) fn last(&self, call: &str) -> usize {
        let calls = self.calls();
        calls
            .iter()
            .rposition(|line| is_of(line, call))
            .unwrap_or_else(|| panic!("{call} was never called: {:?}", tail(&calls)))
    }

    /// How often such a call was made.
    pub(crate) fn count(&self, call: &str) -> usize {
        self.calls().iter().filter(|line| is_of(line, call)).count()
    }
}

/// Does a line begin with these whole words?
fn is_of(line: &str, call: &str) -> bool {
    line.strip_prefix(call)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
}

fn numbers(line: &str, call: &str) -> Option<Vec<f64>> {
    let words = line
        .strip_prefix(call)?
        .strip_prefix(' ')?
        .split_whitespace();
    Some(
        words
            .filter(|word| !word.starts_with('@'))
            .map(|word| word.parse().unwrap())
            .collect(),
    )
}

/// The end of a log, to be shown.
pub(crate) fn tail(calls: &[String]) -> &[String] {
    &calls[calls.len().saturating_sub(20)..]
}

/// The compiled stand-in; compiled once for as long as its source stays the same.
fn compiled(maker: &str, condition: Option<&str>) -> PathBuf {
    static COMPILER: Mutex<()> = Mutex::new(());
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vendor/stubs");
    let source = sources.join(format!("{maker}.rs"));
    let mut hasher = DefaultHasher::new();
    for file in [&source, &sources.join("common.rs")] {
        std::fs::read(file).unwrap().hash(&mut hasher);
    }
    (condition, std::env::consts::ARCH, std::env::consts::OS).hash(&mut hasher);
    let name = format!("stub-{maker}-{:016x}", hasher.finish());
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(&name);

    let _one_at_a_time = COMPILER.lock().unwrap_or_else(PoisonError::into_inner);
    if file.exists() {
        return file;
    }
    let unfinished = file.with_extension(std::process::id().to_string());
    let mut rustc = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
    rustc
        .args([
            "--edition",
            "2024",
            "--crate-type",
            "cdylib",
            "--crate-name",
            "stub",
            "-A",
            "warnings",
        ])
        .args([
            "-C",
            "opt-level=0",
            "-C",
            "debuginfo=0",
            "-C",
            "strip=symbols",
            "-o",
        ])
        .arg(&unfinished)
        .arg(&source);
    if let Some(condition) = condition {
        rustc.args(["--cfg", condition]);
    }
    let output = rustc
        .output()
        .expect("rustc must be there: it compiles the stand-ins");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    std::fs::rename(&unfinished, &file).unwrap();
    file
}

/// Waits until it holds.
pub(crate) fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < LIMIT, "it never came to be: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Reads until there is a sample of which this holds, and returns it. Goes on commanding zero.
pub(crate) fn read_until(
    opened: &mut Opened,
    what: &str,
    holds: impl Fn(&HandleState) -> bool,
) -> HandleState {
    drive_until(opened, Wrench::ZERO, what, |state| {
        state.is_some_and(&holds)
    })
    .unwrap()
}

/// Commands this wrench until it holds of the newest sample (none: the device is silent), which is returned.
pub(crate) fn drive_until(
    opened: &mut Opened,
    wrench: Wrench,
    what: &str,
    mut holds: impl FnMut(Option<&HandleState>) -> bool,
) -> Option<HandleState> {
    let mut newest = None;
    wait_until(what, || {
        opened.device.write(&wrench.into()).unwrap();
        newest = opened.device.read(1.0).ok();
        holds(newest.as_ref())
    });
    newest
}

/// The next message with this word. Others are passed over: on a machine with much to do the driver also tells that
/// something took long.
pub(crate) fn message(opened: &Opened, word: &str) -> String {
    let begun = Instant::now();
    let mut others = Vec::new();
    loop {
        let left = LIMIT.saturating_sub(begun.elapsed());
        match opened.messages.recv_timeout(left) {
            Ok(text) if text.contains(word) => return text,
            Ok(text) => others.push(text),
            Err(_) => panic!("no message with \"{word}\" came, but {others:?}"),
        }
    }
}

/// Are there no more messages with this word?
pub(crate) fn is_silent_about(opened: &Opened, word: &str) -> bool {
    opened.messages.try_iter().all(|text| !text.contains(word))
}

/// A wrench along known axes.
pub(crate) fn push(force: [f64; 3], torque: [f64; 3]) -> Wrench {
    Wrench::new(DVec3::from_array(force), DVec3::from_array(torque))
}
