//! `snapin accuracy`.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::{CacheArgs, print};
use crate::Error;
use crate::progress::Ui;
use crate::scene::Scene;
use crate::study::accuracy::{self, Axis, StudyOptions};

#[derive(Debug, Args)]
pub(super) struct AccuracyArgs {
    /// Scene file.
    scene: PathBuf,
    /// Folder for the result (default: out/, the scene's name and -accuracy). What was finished there
    /// before is used again.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Compare with the values in this file instead of an overkill run.
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Write what was compared with, for --reference.
    #[arg(long, value_name = "FILE")]
    save_reference: Option<PathBuf>,
    /// Only these choices, separated by commas (default: all).
    #[arg(long, value_name = "AXES", value_delimiter = ',', value_parser = axis)]
    axes: Vec<Axis>,
    /// Time each setting for a tenth of a second only: good for 99 % of the steps, not for 99.9 %.
    #[arg(long)]
    quick: bool,
    /// Begin anew.
    #[arg(long)]
    fresh: bool,
    /// Print accuracy.json instead of the tables.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    cache: CacheArgs,
}

fn axis(name: &str) -> Result<Axis, String> {
    Axis::of_name(name).ok_or_else(|| {
        let all: Vec<&str> = Axis::ALL.iter().map(|a| a.name()).collect();
        format!("no such choice; there are {}", all.join(", "))
    })
}

pub(super) fn run(args: &AccuracyArgs, out: &mut dyn Write, ui: &Ui<'_>) -> Result<u8, Error> {
    let scene = Scene::load(&args.scene)?;
    let target = args.out.clone().unwrap_or_else(|| {
        let stem = args.scene.file_stem().unwrap_or("scene".as_ref());
        PathBuf::from("out").join(format!("{}-accuracy", stem.to_string_lossy()))
    });
    accuracy::check_folder(&target)?;
    let options = StudyOptions {
        out: target.clone(),
        axes: if args.axes.is_empty() {
            Axis::ALL.to_vec()
        } else {
            args.axes.clone()
        },
        reference: args.reference.clone(),
        save_reference: args.save_reference.clone(),
        timed_s: args.quick.then_some(0.1),
        fresh: args.fresh,
    };
    let study = accuracy::run(&scene, &options, &args.cache.options(false)?, ui);
    ui.end_status();
    let study = match study {
        Err(e) if e.is_interrupt() => {
            ui.note(&format!(
                "stopped by Ctrl-C; what was finished is kept in {}, and the same command goes on from \
                 there",
                target.join("points").display()
            ));
            return Ok(e.exit_code());
        }
        study => study?,
    };
    if study.n_resumed > 0 {
        ui.note(&format!(
            "{} settings were finished before and are used again (--fresh measures all anew)",
            study.n_resumed
        ));
    }
    accuracy::write(&study, &target)?;
    if args.json {
        let file = target.join("accuracy.json");
        let json = std::fs::read_to_string(&file).map_err(Error::io(&file, "read"))?;
        print(out, &json)?;
    } else {
        print(out, &accuracy::text(&study))?;
        print(
            out,
            &format!("result: {}\n", target.join("report.html").display()),
        )?;
    }
    Ok(0)
}
