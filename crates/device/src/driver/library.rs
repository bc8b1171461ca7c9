//! Makers' libraries: found and loaded at run time, each function looked up once, never unloaded.
//!
//! A maker's library may start threads of its own and may block for as long as it likes. So it stays loaded for the
//! whole process, a call that must not take for ever is made on a thread that can be left behind ([`within`]), and
//! one [`Lease`] at a time is given for it: whoever was left behind still holds it.

#![allow(
    unsafe_code,
    reason = "a foreign library is loaded and its functions are given their types"
)]

use std::ffi::c_char;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use super::link::Connected;
use super::{Opened, Threaded, Unavailable};

pub(super) mod guard;

/// Longest time that a list of devices waits for a library.
pub(super) const LIST_LIMIT: Duration = Duration::from_millis(900);

/// Time that a library may take to open a device before it is left behind.
pub(super) const PATIENCE: Duration = Duration::from_secs(10);

/// Longest text taken from a library, bytes; some are not ended.
const TEXT_MAX: usize = 200;

/// Where a maker's library is looked for.
#[derive(Debug)]
pub(super) struct Spec {
    /// Environment variable that names the file; then nothing else is tried.
    pub(super) variable: &'static str,
    /// File names, the usual one first: looked for along the system's own search path.
    pub(super) names: &'static [&'static str],
    /// Folders in which the names are tried after that.
    pub(super) folders: &'static [&'static str],
    /// Where it comes from, for people.
    pub(super) source: &'static str,
}

impl Spec {
    /// The files to try: the one given, else the one the environment names, else all that are usual.
    fn candidates(&self, given: Option<&Path>, named: Option<&Path>) -> Vec<PathBuf> {
        if let Some(file) = given.or(named) {
            return vec![file.to_owned()];
        }
        let bare = self.names.iter().map(PathBuf::from);
        let in_folders = self.folders.iter().flat_map(|folder| {
            let folder = Path::new(folder);
            self.names.iter().map(|name| folder.join(name))
        });
        bare.chain(in_folders).collect()
    }

    fn mend(&self) -> String {
        format!(
            "{}; set {} to the file where it lies elsewhere",
            self.source, self.variable
        )
    }

    /// What was tried, in words that are not longer than they must be.
    fn tried(&self, file: Option<&Path>) -> Vec<String> {
        if let Some(file) = file {
            return vec![file.display().to_string()];
        }
        let names = self.names.iter().map(|name| (*name).to_owned());
        let folders = self
            .folders
            .iter()
            .map(|folder| format!("the same in {folder}"));
        names.chain(folders).collect()
    }

    fn load(&self, given: Option<&Path>) -> Result<(PathBuf, libloading::Library), Unavailable> {
        let named = std::env::var_os(self.variable)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from);
        let mut broken = None;
        for file in self.candidates(given, named.as_deref()) {
            // SAFETY: what a maker's library does when it is loaded cannot be checked; the user installed it for
            // this very purpose, or named it.
            match unsafe { libloading::Library::new(&file) } {
                Ok(library) => return Ok((file, library)),
                Err(error) => {
                    let reason = reason_of(&error);
                    if !is_absent(&file, &reason) && broken.is_none() {
                        broken = Some(format!("{} cannot be loaded: {reason}", file.display()));
                    }
                }
            }
        }
        Err(match broken {
            Some(reason) => Unavailable::Failed {
                reason: format!(
                    "{reason}; it must be built for this kind of machine, and the libraries it needs must be \
                     installed with it"
                ),
            },
            None => Unavailable::NoLibrary {
                tried: self.tried(given.or(named.as_deref())),
                mend: self.mend(),
            },
        })
    }
}

fn reason_of(error: &libloading::Error) -> String {
    match std::error::Error::source(error) {
        Some(source) => source.to_string(),
        None => error.to_string(),
    }
}

/// Is the file itself missing, or is it there and something else is wrong with it?
fn is_absent(file: &Path, reason: &str) -> bool {
    if file.components().count() > 1 {
        return !file.exists();
    }
    // The system says of a bare name only in words whether it or a library that it needs was not found.
    let name = file.display();
    cfg!(windows)
        || reason.contains("no such file")
        || reason.starts_with(&format!("{name}: cannot open"))
        || reason.ends_with(&format!("library {name}: No such file or directory"))
}

/// The functions of one maker's library, see [`functions`].
pub(super) trait Table: Sized {
    /// Looks all of them up; `None` where one that is needed is missing.
    ///
    /// # Safety
    /// The library must be the maker's: its functions must have the types that the table states.
    unsafe fn look_up(symbols: &mut Symbols<'_>) -> Option<Self>;
}

/// The names of a library that are being looked up.
#[derive(Debug)]
pub(super) struct Symbols<'a> {
    library: &'a libloading::Library,
    missing: Vec<&'static str>,
}

impl Symbols<'_> {
    /// A function that a driver can do without.
    ///
    /// # Safety
    /// `F` must be the function's type.
    pub(super) unsafe fn optional<F: Copy>(&self, name: &'static str) -> Option<F> {
        // SAFETY: the caller promises the type.
        unsafe { self.library.get::<F>(name) }
            .ok()
            .map(|found| *found)
    }

    /// A function that a driver needs.
    ///
    /// # Safety
    /// `F` must be the function's type.
    pub(super) unsafe fn required<F: Copy>(&mut self, name: &'static str) -> Option<F> {
        // SAFETY: the caller promises the type.
        let found = unsafe { self.optional(name) };
        if found.is_none() {
            self.missing.push(name);
        }
        found
    }
}

/// Declares the table of a library's functions: `field: "symbol" = type`.
macro_rules! functions {
    (
        $(#[$about:meta])*
        $table:ident
        required { $($needed:ident: $needed_symbol:literal = $needed_type:ty,)* }
        optional { $($extra:ident: $extra_symbol:literal = $extra_type:ty,)* }
    ) => {
        $(#[$about])*
        #[derive(Debug)]
        pub(super) struct $table {
            $($needed: $needed_type,)*
            $($extra: Option<$extra_type>,)*
        }

        impl crate::driver::library::Table for $table {
            unsafe fn look_up(symbols: &mut crate::driver::library::Symbols<'_>) -> Option<Self> {
                // All are looked up before the first missing one ends it, so that the error names them all.
                // SAFETY: the caller promises that the library is the one whose types stand here.
                $(let $needed = unsafe { symbols.required::<$needed_type>($needed_symbol) };)*
                $(let $extra = unsafe { symbols.optional::<$extra_type>($extra_symbol) };)*
                Some(Self { $($needed: $needed?,)* $($extra,)* })
            }
        }
    };
}
pub(super) use functions;

/// A maker's library in this process.
#[derive(Debug)]
pub(super) struct Library<T> {
    /// Its functions.
    pub(super) functions: T,
    /// Its file, as it was found.
    pub(super) file: String,
    is_held: AtomicBool,
}

impl<T> Library<T> {
    /// The right to use the library, for one at a time.
    ///
    /// # Errors
    /// Where this process has a device of the library open, or a call into it has not come back.
    pub(super) fn lease(&'static self) -> Result<Lease, Unavailable> {
        if self.is_held.swap(true, Ordering::AcqRel) {
            return Err(Unavailable::Busy {
                reason: format!(
                    "this program has a device of {} open already, or a call into it has not come back",
                    self.file
                ),
            });
        }
        Ok(Lease(&self.is_held))
    }
}

/// The right to use a library until it is dropped.
#[derive(Debug)]
pub(super) struct Lease(&'static AtomicBool);

impl Drop for Lease {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

/// The libraries of one maker that this process has loaded, by file. In all but tests there is one.
#[derive(Debug)]
pub(super) struct Shelf<T: 'static>(Mutex<Vec<(PathBuf, &'static Library<T>)>>);

impl<T: Table> Shelf<T> {
    pub(super) const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// The library, loaded at the first call and never unloaded: a thread of its own may run in it.
    ///
    /// # Errors
    /// Where it is not found, cannot be loaded or lacks a function.
    pub(super) fn get(
        &self,
        spec: &Spec,
        given: Option<&Path>,
    ) -> Result<&'static Library<T>, Unavailable> {
        // Held while loading: two threads must not both load it.
        let mut loaded = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let key = given.map(Path::to_owned).unwrap_or_default();
        if let Some((_, library)) = loaded.iter().find(|(file, _)| *file == key) {
            return Ok(library);
        }
        let (file, foreign) = spec.load(given)?;
        let file = file.display().to_string();
        // Loaded for ever, also where it turns out to be of no use.
        let foreign = Box::leak(Box::new(foreign));
        let mut symbols = Symbols {
            library: foreign,
            missing: Vec::new(),
        };
        // SAFETY: the file bears the maker's name or was named by the user as the maker's library.
        let Some(functions) = (unsafe { T::look_up(&mut symbols) }) else {
            return Err(Unavailable::WrongVersion {
                what: file,
                found: format!("one without {}", symbols.missing.join(", ")),
                mend: spec.mend(),
            });
        };
        let library: &'static Library<T> = Box::leak(Box::new(Library {
            functions,
            file,
            is_held: AtomicBool::new(false),
        }));
        loaded.push((key, library));
        Ok(library)
    }
}

/// What `work` says, or `None` where it does not end within `limit`: it goes on on its thread, and what it returns
/// then is dropped there.
pub(super) fn within<R: Send + 'static>(
    limit: Duration,
    work: impl FnOnce() -> R + Send + 'static,
) -> Option<R> {
    let (tell, told) = channel();
    std::thread::Builder::new()
        .name("maker's library".to_owned())
        .spawn(move || {
            let _left_behind = tell.send(work());
        })
        .ok()?;
    told.recv_timeout(limit).ok()
}

/// Opens a device on a link's thread, or gives up where the library does not come back within `limit`.
///
/// # Errors
/// What the first `connect` says, or that it says nothing.
pub(super) fn open_within(
    limit: Duration,
    connect: impl FnMut() -> Result<Connected, Unavailable> + Send + 'static,
) -> Result<Opened, Unavailable> {
    within(limit, move || Threaded::open(connect)).unwrap_or_else(|| {
        Err(Unavailable::Busy {
            reason: format!(
                "the maker's library did not come back within {:.0} s; end other programs that use the device, \
                 switch it off and on, and start this program anew",
                limit.as_secs_f64()
            ),
        })
    })
}

/// A text of a library, shortened, without control characters; empty where there is none.
///
/// # Safety
/// `start` is null or points to bytes that end with a zero or go on for 200.
pub(super) unsafe fn text(start: *const c_char) -> String {
    if start.is_null() {
        return String::new();
    }
    let mut bytes = Vec::new();
    for i in 0..TEXT_MAX {
        // SAFETY: no zero came before, so this byte belongs to the text.
        let byte = unsafe { *start.add(i) } as u8;
        if byte == 0 {
            break;
        }
        bytes.push(byte);
    }
    String::from_utf8_lossy(&bytes)
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect::<String>()
        .trim()
        .to_owned()
}

#[cfg(test)]
mod tests;
