//! The command line. Each command turns typed arguments into meaning before any work; errors and
//! exit codes meet here: 0 done, 1 result out of tolerance, 2 usage or input error, 70 a fault of the program, 130 Ctrl-C.

mod accuracy;
mod doctor;
mod prepare;
mod run;
mod verify;

use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::prepare::{PrepareOptions, cache};
use crate::progress::Ui;
use crate::{Error, crash};

/// Feel whether a plastic clip snaps on before a mould is cut.
#[derive(Debug, Parser)]
#[command(name = "snapin", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Push the tool onto the part with a simulated hand and write a report.
    Run(run::RunArgs),
    /// Show what accuracy costs in time, for each choice: tables, CSV, plots.
    Accuracy(accuracy::AccuracyArgs),
    /// Build or check the cached part of a scene; print sizes, times and checks.
    Prepare(prepare::PrepareArgs),
    /// Compare with reference cases: every folder below DIR with case.toml or problem.json.
    Verify(verify::VerifyArgs),
    /// Show the keys of a scene file as JSON Schema or as Markdown.
    Scene(SceneArgs),
    /// Show what works on this machine and the mend for what does not.
    Doctor(doctor::DoctorArgs),
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct SceneArgs {
    /// JSON Schema of scene files.
    #[arg(long)]
    schema: bool,
    /// docs/scene.md.
    #[arg(long)]
    markdown: bool,
}

/// Where prepared parts are kept.
#[derive(Debug, Args)]
struct CacheArgs {
    /// Folder of prepared parts (default: SNAPIN_CACHE, else the user's cache folder).
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Neither read nor write prepared parts.
    #[arg(long, conflicts_with = "cache")]
    no_cache: bool,
}

impl CacheArgs {
    fn options(&self, rebuild: bool) -> PrepareOptions {
        let cache_dir = if self.no_cache {
            None
        } else {
            self.cache.clone().or_else(cache::default_dir)
        };
        PrepareOptions { cache_dir, rebuild }
    }
}

/// Runs the program: parses `args` (the first is the program's name), does the command, writes
/// results to `out` and everything else to `err`, and returns the exit code.
pub fn run(
    args: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> u8 {
    crash::guard(err, |err| command(args, out, err))
}

fn command(
    args: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> u8 {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(e) => {
            // A closed stream leaves nobody to tell.
            let text = e.render();
            let _ = if e.use_stderr() {
                write!(err, "{text}")
            } else {
                write!(out, "{text}")
            };
            return e.exit_code() as u8;
        }
    };
    let ui = Ui::new(err, std::io::stderr().is_terminal());
    let result = match &cli.command {
        Command::Run(args) => run::run(args, out, &ui),
        Command::Accuracy(args) => accuracy::run(args, out, &ui),
        Command::Prepare(args) => prepare::run(args, out, &ui),
        Command::Verify(args) => verify::run(args, out, &ui),
        Command::Scene(args) => show_scene_keys(args, out),
        Command::Doctor(args) => doctor::run(args, out),
    };
    match result {
        Ok(code) => code,
        Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::BrokenPipe => 0,
        Err(e) => {
            ui.note(&format!("snapin: {e}"));
            e.exit_code()
        }
    }
}

fn show_scene_keys(args: &SceneArgs, out: &mut dyn Write) -> Result<u8, Error> {
    let text = if args.schema {
        crate::scene::schema::json()
    } else {
        crate::scene::schema::markdown()
    };
    print(out, &text)?;
    Ok(0)
}

/// Writes a result to the output stream.
fn print(out: &mut dyn Write, text: &str) -> Result<(), Error> {
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(Error::io(std::path::Path::new("standard output"), "write"))
}

fn json_text(value: &serde_json::Value) -> String {
    let mut text = serde_json::to_string_pretty(value).unwrap_or_default();
    text.push('\n');
    text
}
