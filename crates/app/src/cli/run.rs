//! `snapin run`.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::{CacheArgs, print};
use crate::evaluate::Story;
use crate::output::Staging;
use crate::prepare::budget::duration;
use crate::prepare::prepare;
use crate::progress::Ui;
use crate::report::{Curve, RateFacts, Run, summary, write_all};
use crate::scene::Scene;
use crate::shape::Shape;
use crate::study::accuracy::resolved;
use crate::{Error, plausibility, session, setup};

#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// Scene file.
    scene: PathBuf,
    /// Folder for the result (default: out/ and the scene's name); an earlier result there is
    /// replaced once the new one is complete.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Wait for the real clock in every period; the results are the same, unless steps do not fit the
    /// period and the engine runs beside the loop.
    #[arg(long)]
    real_time: bool,
    /// Print summary.json instead of the summary.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    cache: CacheArgs,
}

pub(super) fn run(args: &RunArgs, out: &mut dyn Write, ui: &Ui<'_>) -> Result<u8, Error> {
    let scene = Scene::load(&args.scene)?;
    let target = args.out.clone().unwrap_or_else(|| {
        PathBuf::from("out").join(args.scene.file_stem().unwrap_or("scene".as_ref()))
    });
    // Whether the result can be written is known before an hour of preparing.
    let staging = Staging::new(&target)?;

    let options = args.cache.options(false)?;
    let (scene, picked) = resolved(scene, &options, ui)?;
    let (tool, remarks) = setup::tool(&scene)?;
    picked.iter().for_each(|line| ui.note(line));
    let prepared = prepare(&setup::part_spec(&scene)?, &options, ui)?;
    let mut doubts = plausibility::before(&scene, &prepared, &tool);
    let n_told = plausibility::tell(&doubts, ui);
    let origin = crate::origin::read(&scene, Some(prepared.loaded.mesh_hash))?;
    let mut engine = setup::engine(&scene, &prepared, tool)?;
    let mut spec = setup::session(&scene);
    spec.real_time |= args.real_time;
    let progress = ui.progress();
    let mut shape = Shape::new(&prepared, &scene.accuracy, options.cache_dir.as_deref())?;
    let recording = session::run(&spec, &prepared, &mut engine, &mut shape, &progress)?;
    if spec.real_time || recording.two_rates.is_some() {
        ui.note(&recording.rates.words());
    }
    doubts.extend(plausibility::after(
        &scene, &prepared, &engine, &recording, &options,
    )?);
    let story = Story {
        scene: &scene,
        prepared: &prepared,
        engine: &engine,
        recording: &recording,
        shape: &shape,
        remarks,
        doubts,
        origin,
        is_real_time: spec.real_time,
        picked,
    };
    let run = story.tell(&progress)?;
    drop(progress);
    for warning in &run.warnings[n_told..] {
        ui.note(&format!("warning: {}", warning.text));
    }
    write_all(staging.path(), &run)?;
    if crate::interrupt::is_requested() {
        return Err(Error::Interrupted);
    }
    staging.commit()?;

    let curve = Curve::of(&run.rows);
    if args.json {
        print(out, &summary::json(&run, &curve))?;
    } else {
        print(out, &text(&run, &curve, &shape, &target))?;
    }
    Ok(0)
}

fn text(run: &Run, curve: &Curve, shape: &Shape, target: &std::path::Path) -> String {
    let mut times: Vec<u64> = run
        .rows
        .iter()
        .filter(|r| r.contacts > 0)
        .map(|r| r.total_ns)
        .collect();
    times.sort_unstable();
    let at = |q: f64| {
        let last = times.len().saturating_sub(1);
        times
            .get((q * last as f64) as usize)
            .map_or(0.0, |ns| 1e-3 * *ns as f64)
    };
    format!(
        "{}\n  peak insertion force  {:.3} N at {:.3} mm of travel\n  snap drop             {:.3} N\n  \
         insertion work        {:.3} mJ\n{}  coupling stiffness    {} N/m, in series with the part\n  \
         step                  median {:.1} us, 99 % below {:.1} us, over {} steps with contact\n  \
         {}multiply              {}\n  prepared in           {}{}\n  result                {}\n",
        run.title,
        curve.peak_force_n,
        1e3 * curve.travel_at_peak_m,
        curve.snap_drop_n,
        1e3 * curve.insertion_work_j,
        run.strain.text(),
        run.facts.coupling_stiffness.unwrap_or(f64::INFINITY),
        at(0.5),
        at(0.99),
        times.len(),
        rates_text(&run.facts.rates),
        shape.choice().words(),
        duration(run.facts.prepare_s),
        if run.facts.from_cache {
            " from the cache"
        } else {
            ""
        },
        target.join("report.html").display(),
    )
}

/// The line on two rates; nothing for one.
fn rates_text(rates: &RateFacts) -> String {
    let Some(two) = &rates.two else {
        return String::new();
    };
    format!(
        "two rates             {} hand-overs, {:.1e} N apart (median; {:.1e} N at most), {} periods old at most\n  ",
        two.hand_overs, two.difference_median_n, two.difference_max_n, two.max_staleness
    )
}
