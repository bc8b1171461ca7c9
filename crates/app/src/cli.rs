//! The command line. Each command turns typed arguments into meaning before any work; errors and
//! exit codes meet here: 0 done, 1 result out of tolerance, 2 usage or input error, 70 a fault of the program, 130 Ctrl-C.

mod accuracy;
mod cache;
mod devices;
mod doctor;
mod effects;
mod live;
mod prepare;
mod run;
mod serve;
mod verify;
#[cfg(feature = "viewer")]
mod view;

use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::prepare::PrepareOptions;
use crate::prepare::cache::{default_dir, shelf::Limit};
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
    /// Feel a scene with a haptic device, in real time, until it is ended; no window.
    Live(live::LiveArgs),
    /// See a scene in a window, held by mouse and keys or by a haptic device; or write a picture of it.
    #[cfg(feature = "viewer")]
    View(view::ViewArgs),
    /// Show what accuracy costs in time, for each choice: tables, CSV, plots.
    Accuracy(accuracy::AccuracyArgs),
    /// Show what each physical effect changes and costs, and which are simulated: table, CSV, plot.
    Effects(effects::EffectsArgs),
    /// Build or check the cached part of a scene; print sizes, times and checks.
    Prepare(prepare::PrepareArgs),
    /// List or clear prepared parts.
    Cache(cache::ShowCacheArgs),
    /// Compare with reference cases: every folder below DIR with case.toml or problem.json.
    Verify(verify::VerifyArgs),
    /// Show the keys of a scene file as JSON Schema or as Markdown.
    Scene(SceneArgs),
    /// List haptic devices: what is attached, what could be, and why not.
    Devices(devices::DevicesArgs),
    /// Offer a simulated device over VRPN, held by a scene's hand.
    Serve(serve::ServeArgs),
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
    /// What the folder may hold, such as 500MB or none (default: SNAPIN_CACHE_LIMIT, else 2GB); what was not
    /// used for the longest time goes first.
    #[arg(long, value_name = "SIZE")]
    cache_limit: Option<Limit>,
}

impl CacheArgs {
    /// # Errors
    /// SNAPIN_CACHE_LIMIT that is no size.
    fn options(&self, rebuild: bool) -> Result<PrepareOptions, Error> {
        let cache_dir = if self.no_cache {
            None
        } else {
            self.cache.clone().or_else(default_dir)
        };
        Ok(PrepareOptions {
            cache_dir,
            rebuild,
            cache_limit: limit_or_default(self.cache_limit)?,
        })
    }
}

/// The bound of the cache: as given, else from the environment, else the default.
///
/// # Errors
/// SNAPIN_CACHE_LIMIT that is no size.
fn limit_or_default(given: Option<Limit>) -> Result<Limit, Error> {
    const NAME: &str = "SNAPIN_CACHE_LIMIT";
    let of_environment = || std::env::var_os(NAME).filter(|value| !value.is_empty());
    match (given, of_environment()) {
        (Some(limit), _) => Ok(limit),
        (None, None) => Ok(Limit::default()),
        (None, Some(value)) => value
            .to_string_lossy()
            .parse()
            .map_err(|why| Error::Input(format!("{NAME}: {why}"))),
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
        Command::Live(args) => live::run(args, out, &ui),
        #[cfg(feature = "viewer")]
        Command::View(args) => view::run(args, out, &ui),
        Command::Accuracy(args) => accuracy::run(args, out, &ui),
        Command::Effects(args) => effects::run(args, out, &ui),
        Command::Prepare(args) => prepare::run(args, out, &ui),
        Command::Cache(args) => cache::run(args, out),
        Command::Verify(args) => verify::run(args, out, &ui),
        Command::Scene(args) => show_scene_keys(args, out),
        Command::Devices(args) => devices::run(args, out),
        Command::Serve(args) => serve::run(args, out, &ui),
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

/// Time between two forces at a rate, s.
///
/// # Errors
/// A rate that no haptic device takes.
fn period_of(rate: f64) -> Result<f64, Error> {
    if (100.0..=10_000.0).contains(&rate) {
        return Ok(rate.recip());
    }
    Err(Error::Input(format!(
        "--rate {rate} is not between 100 and 10000 (forces per second; haptic devices take 1000)"
    )))
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
