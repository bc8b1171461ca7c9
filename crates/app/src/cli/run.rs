//! `snapin run`.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use contact::tool::Tool;

use super::{CacheArgs, print};
use crate::evaluate::{Felt, Story};
use crate::output::Staging;
use crate::prepare::budget::duration;
use crate::prepare::{PrepareOptions, PreparedPart, prepare};
use crate::progress::Ui;
use crate::report::part_curve::words;
use crate::report::plot::short;
use crate::report::{Curve, Driven, Effect, RateFacts, Run, summary, write_all};
use crate::scene::Scene;
use crate::session::{self, Recording};
use crate::shape::Shape;
use crate::study::accuracy::resolved;
use crate::{Error, drive, plausibility, setup};

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
    let progress = ui.progress();
    let (engine, driven) = drive::of_scene(&scene, &prepared, tool.clone(), &progress)?;
    let decided = scene.with_friction(driven.friction.is_some());
    let felt = feel(&decided, args, &prepared, tool, &options, ui)?;
    let ran = plausibility::Ran {
        prepared: &prepared,
        engine: &engine,
        driven: &driven,
        felt: felt.as_ref().map(|felt| &felt.recording),
    };
    doubts.extend(plausibility::after(&scene, &ran, &options)?);
    let story = Story {
        scene: &scene,
        prepared: &prepared,
        engine: &engine,
        driven: &driven,
        felt: felt.as_ref().map(|felt| Felt {
            recording: &felt.recording,
            shape: &felt.shape,
            is_real_time: felt.is_real_time,
        }),
        remarks,
        doubts,
        origin,
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
        print(out, &text(&run, &curve, felt.as_ref(), &target))?;
    }
    let keeps_limits = run.driven.as_ref().is_none_or(Driven::keeps_limits);
    Ok(if keeps_limits { 0 } else { 1 })
}

/// What a hand felt, and what was drawn beside it.
struct Session {
    recording: Recording,
    shape: Shape,
    is_real_time: bool,
}

/// Has the scene's hand feel the part, if there is one.
fn feel(
    scene: &Scene,
    args: &RunArgs,
    prepared: &PreparedPart,
    tool: Tool,
    options: &PrepareOptions,
    ui: &Ui<'_>,
) -> Result<Option<Session>, Error> {
    let held = setup::held(scene, prepared, &tool);
    let Some(mut spec) = setup::session(scene, held) else {
        if args.real_time {
            ui.note("--real-time: the scene has no [hand] that would keep time");
        }
        return Ok(None);
    };
    spec.real_time |= args.real_time;
    let mut engine = setup::engine(scene, prepared, tool)?;
    let mut shape = Shape::new(prepared, &scene.accuracy, options.cache_dir.as_deref())?;
    let recording = session::run(&spec, prepared, &mut engine, &mut shape, &ui.progress())?;
    if spec.real_time || recording.two_rates.is_some() {
        ui.note(&recording.rates.words());
    }
    if let Some(granted) = &recording.granted {
        ui.note(&granted.to_string());
    }
    Ok(Some(Session {
        recording,
        shape,
        is_real_time: spec.real_time,
    }))
}

fn text(run: &Run, curve: &Curve, felt: Option<&Session>, target: &std::path::Path) -> String {
    let felt = felt.map_or_else(String::new, |felt| felt_text(run, curve, felt));
    let cached = if run.facts.from_cache {
        " from the cache"
    } else {
        ""
    };
    format!(
        "{}\n{}{}{}{felt}  prepared in           {}{cached}\n  result                {}\n",
        run.title,
        run.driven
            .as_ref()
            .map_or_else(String::new, words::terminal),
        run.strain.text(),
        effects_text(run),
        duration(run.facts.prepare_s),
        target.join("report.html").display(),
    )
}

/// Which effects are simulated, and how far the others are from being called for.
fn effects_text(run: &Run) -> String {
    let size = |effect: &Effect| match effect.number {
        Some(number) => format!(" ({} of {})", short(number), short(effect.threshold)),
        None => String::new(),
    };
    let told = |is_on: bool| {
        let all = run.effects.iter().filter(|effect| effect.on == is_on);
        let all = all.filter(|effect| is_on || effect.number.is_some());
        let names: Vec<String> = all
            .map(|effect| effect.name.replace('_', " ") + &size(effect))
            .collect();
        names.join(", ")
    };
    let (on, off) = (told(true), told(false));
    let on = if on.is_empty() { "none" } else { &on };
    let off = if off.is_empty() {
        String::new()
    } else {
        format!("; off: {off}")
    };
    format!("  effects               on: {on}{off}\n")
}

/// What the hand felt, and how long the loop took.
fn felt_text(run: &Run, curve: &Curve, felt: &Session) -> String {
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
        "  felt by the hand      {:.3} N at {:.3} mm of travel, drop {:.3} N, coupling {} N/m in series\n  \
         step                  median {:.1} us, 99 % below {:.1} us, over {} steps with contact\n  {}multiply              {}\n",
        curve.peak_force_n,
        1e3 * curve.travel_at_peak_m,
        curve.snap_drop_n,
        run.facts.coupling_stiffness.unwrap_or(f64::INFINITY),
        at(0.5),
        at(0.99),
        times.len(),
        rates_text(&run.facts.rates),
        felt.shape.choice().words(),
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
