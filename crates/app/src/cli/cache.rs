//! `snapin cache`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

use clap::{Args, Subcommand};
use serde_json::json;

use super::{json_text, limit_or_default, print};
use crate::Error;
use crate::prepare::budget::bytes;
use crate::prepare::cache::default_dir;
use crate::prepare::cache::shelf::{self, Entry, Kind, Limit, Removed, counted};

const DAY_S: f64 = 24.0 * 3600.0;

#[derive(Debug, Args)]
pub(super) struct ShowCacheArgs {
    /// What to do (default: list).
    #[command(subcommand)]
    action: Option<Action>,
    /// Folder of prepared parts (default: SNAPIN_CACHE, else the user's cache folder).
    #[arg(long, value_name = "DIR", global = true)]
    cache: Option<PathBuf>,
    /// Print JSON.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Show each prepared part with its mesh, size and last use.
    List,
    /// Remove prepared parts; files of others in the folder, and parts that a running program uses, stay.
    Clear {
        /// Only parts that were not used for this many days.
        #[arg(long, value_name = "DAYS", value_parser = days)]
        older_than: Option<Duration>,
    },
}

fn days(text: &str) -> Result<Duration, String> {
    let days: f64 = text.parse().unwrap_or(f64::NAN);
    Duration::try_from_secs_f64(days * DAY_S)
        .map_err(|_| "is no number of days, such as 30".to_owned())
}

pub(super) fn run(args: &ShowCacheArgs, out: &mut dyn Write) -> Result<u8, Error> {
    let Some(dir) = args.cache.clone().or_else(default_dir) else {
        return Err(Error::Input(
            "there is no cache folder here; name one with --cache or SNAPIN_CACHE".to_owned(),
        ));
    };
    let text = match &args.action {
        None | Some(Action::List) => {
            let all = shelf::entries(&dir)
                .map_err(Error::io(&dir, "read the folder of prepared parts"))?;
            let limit = limit_or_default(None)?;
            if args.json {
                listed_json(&dir, &all, limit)
            } else {
                listed(&dir, &all, limit)
            }
        }
        Some(Action::Clear { older_than }) => {
            let removed =
                shelf::clear(&dir, older_than.unwrap_or_default()).map_err(|(path, source)| {
                    Error::Io {
                        path,
                        action: "clear",
                        source,
                    }
                })?;
            if args.json {
                json_text(&json!({
                    "folder": dir,
                    "removed": removed.files,
                    "bytes": removed.bytes,
                    "in_use": removed.in_use,
                }))
            } else {
                cleared(&dir, removed)
            }
        }
    };
    print(out, &text)?;
    Ok(0)
}

fn total(all: &[Entry]) -> u64 {
    all.iter().map(|entry| entry.bytes).sum()
}

fn name(entry: &Entry) -> String {
    let name = entry.path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn listed(dir: &Path, all: &[Entry], limit: Limit) -> String {
    let parts = all.iter().filter(|entry| entry.kind == Kind::Part).count();
    let mut text = format!(
        "{}: {}, {} ({})\n",
        dir.display(),
        counted(parts, "prepared part"),
        bytes(total(all) as f64),
        limit.words(),
    );
    if all.is_empty() {
        return text;
    }
    let mesh_of = |entry: &Entry| match &entry.mesh {
        Some(mesh) => mesh.clone(),
        None => "(measured multiply)".to_owned(),
    };
    let width = all.iter().map(|entry| mesh_of(entry).chars().count()).max();
    let width = width.unwrap_or(0).max("mesh".len());
    text += &format!(
        "  {:<width$}  {:>9}  {:<17}  file\n",
        "mesh", "size", "last use"
    );
    for entry in all {
        text += &format!(
            "  {:<width$}  {:>9}  {:<17}  {}\n",
            mesh_of(entry),
            bytes(entry.bytes as f64),
            ago(shelf::since(entry.last_use)),
            name(entry),
        );
    }
    text
}

fn listed_json(dir: &Path, all: &[Entry], limit: Limit) -> String {
    let entries: Vec<_> = all
        .iter()
        .map(|entry| {
            let last_use = entry.last_use.duration_since(UNIX_EPOCH);
            json!({
                "file": name(entry),
                "kind": match entry.kind {
                    Kind::Part => "part",
                    Kind::Measured => "measured multiply",
                },
                "mesh": entry.mesh,
                "bytes": entry.bytes,
                "last_use_unix_s": last_use.map(|t| t.as_secs()).ok(),
                "in_use": entry.is_in_use(),
            })
        })
        .collect();
    json_text(&json!({
        "folder": dir,
        "bytes": total(all),
        "limit_bytes": limit.0,
        "entries": entries,
    }))
}

fn cleared(dir: &Path, removed: Removed) -> String {
    let stayed = match removed.in_use {
        0 => String::new(),
        n => format!(
            "; {} in use by a running program stayed",
            counted(n, "file")
        ),
    };
    format!(
        "{}: removed {}, {}{stayed}\n",
        dir.display(),
        counted(removed.files, "file"),
        bytes(removed.bytes as f64),
    )
}

/// `3 days ago`.
fn ago(time: Duration) -> String {
    let seconds = time.as_secs();
    let (n, unit) = match seconds {
        0..60 => return "now".to_owned(),
        60..3600 => (seconds / 60, "minute"),
        3600..172_800 => (seconds / 3600, "hour"),
        _ => (seconds / 86_400, "day"),
    };
    format!("{} ago", counted(n as usize, unit))
}
