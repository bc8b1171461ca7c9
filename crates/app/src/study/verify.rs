//! `snapin verify`: runs reference cases and compares with what independent programs computed.
//!
//! A case is a folder with `case.toml` (what to compute) and `expected.json` (what it should
//! give), or a folder with `problem.json` (a linear complementarity problem). Anything that
//! cannot be run is reported as such and fails.

mod case;
mod compare;
mod contact_case;
mod elastic_case;
mod expected;
mod files;
mod friction_case;
mod lcp_case;
mod npy;
mod schema;

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use crate::progress::Ui;
use crate::{Error, crash};
use case::{Case, Kind};
pub use compare::Quantity;

/// How a case ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Every quantity inside its tolerance (or refused, where a refusal is asked for).
    Ok,
    /// Computed, and something is outside.
    OutOfTolerance,
    /// Could not be computed.
    Error,
    /// Asks for something this program does not have.
    NotSupported,
    /// The program itself failed over it.
    Fault,
}

impl Status {
    /// The word in the table and in the JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::OutOfTolerance => "out of tolerance",
            Self::Error => "error",
            Self::NotSupported => "not supported",
            Self::Fault => "fault of the program",
        }
    }
}

/// Result of one case.
#[derive(Clone, Debug)]
pub struct CaseResult {
    /// Path below the folder that was given.
    pub name: String,
    /// How it ended.
    pub status: Status,
    /// Refusal, failure or remark.
    pub message: String,
    /// What was compared.
    pub quantities: Vec<Quantity>,
}

/// Why a case has no result.
#[derive(Debug)]
enum Failure {
    Error(String),
    NotSupported(String),
    /// A panic, with its place and where to report it.
    Fault(String),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Error(error.to_string())
    }
}

impl Failure {
    fn in_file(path: &Path) -> impl Fn(fem::Error) -> Self {
        let path = path.to_path_buf();
        move |e| Self::Error(format!("{}: {e}", path.display()))
    }
}

/// Folders below `root` (itself included) that hold a case, sorted.
///
/// # Errors
/// A folder that cannot be read.
pub fn find_cases(root: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    let mut open = vec![root.to_path_buf()];
    while let Some(dir) = open.pop() {
        // One without the other is a case too, of which a file is missing or has another name.
        let names = ["case.toml", "expected.json", "problem.json"];
        if names.iter().any(|name| dir.join(name).is_file()) {
            found.push(dir.clone());
        }
        let entries =
            std::fs::read_dir(&dir).map_err(Error::io(&dir, "read the folder of cases"))?;
        for entry in entries {
            let entry = entry.map_err(Error::io(&dir, "read the folder of cases"))?;
            // Links are not followed: they could lead round in a circle.
            if entry.file_type().is_ok_and(|t| t.is_dir()) {
                open.push(entry.path());
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Runs one case. Never fails: what goes wrong is its result.
///
/// # Errors
/// Only Ctrl-C.
pub fn run_case(root: &Path, dir: &Path, ui: &Ui<'_>) -> Result<CaseResult, Error> {
    let name = match dir.strip_prefix(root) {
        Ok(rest) if !rest.as_os_str().is_empty() => rest.to_string_lossy().replace('\\', "/"),
        _ => dir
            .file_name()
            .unwrap_or(dir.as_os_str())
            .to_string_lossy()
            .into_owned(),
    };
    let is_lcp = dir.join("problem.json").is_file() && !dir.join("case.toml").is_file();
    let run = || {
        if is_lcp {
            lcp_case::run(dir)
        } else {
            run_element_case(dir, ui)
        }
    };
    // One case that panics takes only itself.
    let outcome = crash::catch(run).unwrap_or_else(|line| Err(Failure::Fault(line)));
    if crate::interrupt::is_requested() {
        return Err(Error::Interrupted);
    }
    let (status, message, quantities) = match outcome {
        Ok((_, quantities)) if quantities.is_empty() => {
            (Status::Error, "nothing was compared".to_owned(), quantities)
        }
        Ok((message, quantities)) if quantities.iter().all(Quantity::is_within) => {
            (Status::Ok, message, quantities)
        }
        Ok((message, quantities)) => (Status::OutOfTolerance, message, quantities),
        Err(Failure::Error(message)) => (Status::Error, message, Vec::new()),
        Err(Failure::Fault(line)) => (Status::Fault, line, Vec::new()),
        Err(Failure::NotSupported(message)) => (Status::NotSupported, message, Vec::new()),
    };
    Ok(CaseResult {
        name,
        status,
        message,
        quantities,
    })
}

type Outcome = Result<(String, Vec<Quantity>), Failure>;

fn run_element_case(dir: &Path, ui: &Ui<'_>) -> Outcome {
    let case = Case::read(dir)?;
    match case.kind {
        Kind::Patch | Kind::Static => elastic_case::run(&case, ui),
        Kind::Convergence => elastic_case::run_convergence(&case, ui),
        Kind::Contact => contact_case::run(&case, ui),
        Kind::ContactFriction => friction_case::run(&case, ui),
        Kind::Error => run_refusal(&case, ui),
    }
}

/// An `error` case is right when it is refused, and the refusal names what it must name.
fn run_refusal(case: &Case, ui: &Ui<'_>) -> Outcome {
    let refusal = match elastic_case::solve_only(case, ui) {
        Ok(()) => {
            return Ok((
                "computed, although it should have been refused".to_owned(),
                vec![Quantity::verdict("refused", false)],
            ));
        }
        Err(Failure::Error(message)) => message,
        Err(other) => return Err(other),
    };
    // The folder of a case is often named for what is wrong with it.
    let folder = case.dir.display().to_string();
    let lower = refusal.replace(&folder, "").to_lowercase();
    let must_name: Vec<String> = case.expected["expected_error"]["must_name"]
        .as_array()
        .map(|list| {
            list.iter()
                .filter_map(|v| v.as_str().map(str::to_lowercase))
                .collect()
        })
        .unwrap_or_default();
    // "disconnected or loose piece": one of the alternatives, each of whose words must appear.
    let missing: Vec<&String> = must_name
        .iter()
        .filter(|phrase| {
            !phrase
                .split(" or ")
                .any(|words| words.split(' ').all(|w| lower.contains(w)))
        })
        .collect();
    let named = missing.is_empty();
    Ok((
        refusal,
        vec![
            Quantity::verdict("refused", true),
            Quantity::verdict("named", named),
        ],
    ))
}

/// The results as JSON: computed values whole, in the shape of the expected ones.
pub fn to_json(results: &[CaseResult]) -> Value {
    let cases: Vec<Value> = results
        .iter()
        .map(|r| {
            let quantities: Vec<Value> = r
                .quantities
                .iter()
                .map(|q| {
                    let mut object = Map::new();
                    object.insert("name".into(), json!(q.name));
                    object.insert("computed".into(), q.computed.clone());
                    object.insert("expected".into(), q.expected.clone());
                    object.insert("error_rel".into(), json!(q.error_rel));
                    object.insert("tolerance".into(), q.tolerance.clone());
                    object.insert("informative".into(), json!(q.is_informative()));
                    Value::Object(object)
                })
                .collect();
            json!({
                "case": r.name,
                "status": r.status.word(),
                "message": r.message,
                "quantities": quantities,
            })
        })
        .collect();
    json!({ "cases": cases })
}
