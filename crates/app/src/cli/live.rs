//! `snapin live`: a scene in the hand, until it is ended.

mod open;
mod told;

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};

use clap::Args;
use device::{Mapping, MappingSettings, Realtime, ServoSettings};

use super::{CacheArgs, period_of, print};
use crate::engine::Engine;
use crate::prepare::{PreparedCompliance, PreparedPart, prepare};
use crate::progress::Ui;
use crate::scene::Scene;
use crate::session::live::{self, LivePorts, LiveReport, LiveSpec};
use crate::session::log::{Log, Logged};
use crate::session::rates::ChosenRates;
use crate::session::{SessionSpec, Snapshot, SnapshotOutput, part_extent, snapshots};
use crate::shape::Shape;
use crate::study::accuracy::resolved;
use crate::{Error, drive, plausibility, setup};
use told::Told;

#[derive(Debug, Args)]
pub(super) struct LiveArgs {
    /// Scene file.
    scene: PathBuf,
    /// Device, as `snapin devices` names it; `simulated` (the scene's device.model) or `simulated:MODEL` is held by the
    /// scene's hand.
    #[arg(long, value_name = "NAME", default_value = "simulated")]
    device: String,
    /// Forces sent to the device per second, 100 to 10000 (default: the scene's device.servo_period).
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Metres in the scene per metre of the device; forces are scaled by the same factor.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    scale: f64,
    /// Button (1 is the first) that holds the clutch: the tool stays while the handle moves.
    #[arg(long, value_name = "BUTTON", value_parser = clap::value_parser!(u32).range(1..=32))]
    clutch: Option<u32>,
    /// Axes of the device in the scene, as a permutation with signs: `+x+y+z` leaves them as they are, `+x-z+y` turns a
    /// device with y up into a scene with z up.
    #[arg(
        long,
        value_name = "AXES",
        default_value = "+x+y+z",
        allow_hyphen_values = true
    )]
    axes: open::Axes,
    /// Largest force on the hand, N (default: what the device can).
    #[arg(long, value_name = "N")]
    max_force: Option<f64>,
    /// End after so many seconds (default: Ctrl-C, or the end of the scripted hand).
    #[arg(long = "for", value_name = "SECONDS")]
    seconds: Option<f64>,
    /// Folder for recordings (default: out/ and the scene's name with -live); nothing there is overwritten.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Record nothing.
    #[arg(long, conflicts_with = "out")]
    no_recording: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    cache: CacheArgs,
}

/// Time between two looks at the newest snapshot, s.
const LOOK_S: f64 = 0.016;

/// Looks between two status lines.
const LOOKS_PER_STATUS: u64 = 6;

pub(super) fn run(args: &LiveArgs, out: &mut dyn Write, ui: &Ui<'_>) -> Result<u8, Error> {
    let scene = Scene::load(&args.scene)?;
    let files = Files::new(args)?;
    // Whether the device is there is known before an hour of preparing.
    let external = open::external(&args.device)?;
    let options = args.cache.options(false)?;
    let (scene, picked) = resolved(scene, &options, ui)?;
    let (tool, remarks) = setup::tool(&scene)?;
    remarks.iter().chain(&picked).for_each(|line| ui.note(line));
    let prepared = prepare(&setup::part_spec(&scene)?, &options, ui)?;
    plausibility::tell(&plausibility::before(&scene, &prepared, &tool), ui);
    let with_friction = drive::calls_for_friction(&scene, &prepared, tool.clone(), &ui.progress())?;
    let scene = scene.with_friction(with_friction);

    let held = setup::held(&scene, &prepared, &tool);
    let session = setup::live_session(&scene, held, period(args, &scene)?);
    let mut opened = match external {
        Some(opened) => opened,
        None => open::simulated(&args.device, scene.device.model, &session)?,
    };
    opened.notes.iter().for_each(|note| ui.note(note));
    let limits = opened.limits(args.max_force)?;
    let (scene, coupling) = open::coupled(scene, &limits, session.period_s)?;
    let mut engine = setup::engine(&scene, &prepared, tool)?;
    let rates = live::rates(&session, &prepared, &mut engine)?;
    ui.note(&rates.words());
    let mut shape = look_ahead_shape(&scene, &prepared, &engine, &options)?;

    let mut spec = live_spec(args, session, &opened, &limits, &prepared)?;
    if opened.is_rate {
        // Nothing holds the hand back, and what a motor shakes does no work on it.
        let largest = live::largest_force(&spec.session, &mut engine);
        spec.stretch_max = Some(open::stretch(largest, &scene));
        spec.servo.safety.passivity = None;
    }
    let about = BTreeMap::from([
        ("title".to_owned(), scene.title.clone()),
        ("scene".to_owned(), scene.path.display().to_string()),
        ("scene_text".to_owned(), scene.source.clone()),
        ("device".to_owned(), opened.device.name().to_owned()),
        ("coupling".to_owned(), coupling.clone()),
    ]);
    let (log, samples) = match &files {
        Some(files) => {
            Log::create(&files.recording, &about).map(|(log, p)| (Some(log), Some(p)))?
        }
        None => (None, None),
    };
    let (viewer, view) = snapshots(engine.settings().max_contacts);
    let (granted, granted_words) = std::sync::mpsc::channel();
    let ports = LivePorts {
        at_start: Some(Box::new(move || {
            // Nobody listens where the session ended at once.
            let _ = granted.send(Realtime::ask().to_string());
        })),
        viewer,
        log: samples,
    };
    let mut eye = Eye {
        view,
        shape: shape.as_mut(),
        messages: [&opened.messages, &granted_words],
        ui,
    };
    let device = &mut *opened.device;
    let (report, logged) = together(&spec, &rates, device, &mut engine, ports, log, &mut eye)?;
    ui.end_status();
    let told = Told {
        scene: &scene,
        device: opened.device.name(),
        coupling: &coupling,
        period_s: spec.session.period_s,
        report: &report,
        logged: logged.as_ref(),
        recording: files.as_ref().map(|files| files.recording.as_path()),
    };
    if let Some(files) = &files {
        std::fs::write(&files.summary, told.json())
            .map_err(Error::io(&files.summary, "write the summary"))?;
    }
    print(out, &if args.json { told.json() } else { told.text() })?;
    Ok(0)
}

/// Time between two forces, s.
fn period(args: &LiveArgs, scene: &Scene) -> Result<f64, Error> {
    args.rate.map_or(Ok(scene.device.servo_period), period_of)
}

/// The session's settings.
fn live_spec(
    args: &LiveArgs,
    session: SessionSpec,
    opened: &open::Hand,
    limits: &device::Limits,
    prepared: &PreparedPart,
) -> Result<LiveSpec, Error> {
    let mapping = MappingSettings {
        axes: args.axes.0,
        scale: args.scale,
        ..MappingSettings::default()
    };
    // A simulated hand goes along the scene's way in the scene's world.
    let mapping = match opened.is_in_world {
        true => None,
        false => Some(Mapping::new(mapping, session.held.start())?),
    };
    let seconds = match (args.seconds, opened.ends_after_s) {
        (Some(asked), Some(scripted)) => Some(asked.min(scripted)),
        (asked, scripted) => asked.or(scripted),
    };
    if let Some(seconds) = seconds.filter(|s| !(s.is_finite() && *s > 0.0)) {
        return Err(Error::Input(format!(
            "--for {seconds} is no time above 0 s"
        )));
    }
    Ok(LiveSpec {
        n_periods: seconds.map(|s| (s / session.period_s).ceil() as u64),
        mapping,
        clutch: args.clutch.map_or(0, |button| 1 << (button - 1)),
        stretch_max: None,
        lever: part_extent(&prepared.loaded.mesh),
        servo: ServoSettings::live(limits)?,
        session,
    })
}

/// Where columns of the compliance are fetched, what fetches them ahead of the tool.
fn look_ahead_shape(
    scene: &Scene,
    prepared: &PreparedPart,
    engine: &Engine,
    options: &crate::prepare::PrepareOptions,
) -> Result<Option<Shape>, Error> {
    let PreparedCompliance::Near(_) = &prepared.compliance else {
        return Ok(None);
    };
    let mut shape = Shape::new(prepared, &scene.accuracy, options.cache_dir.as_deref())?;
    shape.follow(engine, true);
    Ok(Some(shape))
}

/// The files of a session: the first number that is free.
struct Files {
    recording: PathBuf,
    summary: PathBuf,
}

impl Files {
    /// # Errors
    /// A folder that cannot be made.
    fn new(args: &LiveArgs) -> Result<Option<Self>, Error> {
        if args.no_recording {
            return Ok(None);
        }
        let stem = args.scene.file_stem().unwrap_or("scene".as_ref());
        let folder = args
            .out
            .clone()
            .unwrap_or_else(|| Path::new("out").join(format!("{}-live", stem.to_string_lossy())));
        std::fs::create_dir_all(&folder).map_err(Error::io(
            &folder,
            "create the folder for recordings (name another with --out)",
        ))?;
        let free = (1_u32..).find_map(|n| {
            let recording = folder.join(format!("session-{n:03}.mcap"));
            let summary = folder.join(format!("session-{n:03}.json"));
            (!recording.exists() && !summary.exists()).then_some(Self { recording, summary })
        });
        Ok(free)
    }
}

/// The loop on a thread of its own, the recording on another, and this one looks on.
fn together(
    spec: &LiveSpec,
    rates: &ChosenRates,
    device: &mut dyn device::HapticDevice,
    engine: &mut Engine,
    ports: LivePorts<'_>,
    log: Option<Log>,
    eye: &mut Eye<'_, '_>,
) -> Result<(LiveReport, Option<Logged>), Error> {
    let (stop, is_written) = (AtomicBool::new(false), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let written = log.map(|log| scope.spawn(|| log.write(&is_written)));
        let haptic = std::thread::Builder::new()
            .name("haptic loop".to_owned())
            .spawn_scoped(scope, || {
                live::run(spec, rates, device, engine, ports, &stop)
            })
            .map_err(Error::io(
                Path::new("the haptic loop"),
                "start the thread of",
            ))?;
        eye.look_on(&haptic);
        is_written.store(true, Ordering::Release);
        let report = haptic.join().map_err(|_| Error::EngineEnded)?;
        let logged = written.map(|thread| thread.join().map_err(|_| Error::EngineEnded));
        let logged = match logged.transpose()?.transpose() {
            Ok(logged) => logged,
            Err(error) => {
                eye.ui
                    .note(&format!("warning: the recording is cut short: {error}"));
                None
            }
        };
        Ok((report?, logged))
    })
}

/// What looks on while the loop goes: messages, status, and the columns that come next.
struct Eye<'a, 'u> {
    view: SnapshotOutput,
    shape: Option<&'a mut Shape>,
    messages: [&'a Receiver<String>; 2],
    ui: &'a Ui<'u>,
}

impl Eye<'_, '_> {
    /// Until the loop ends.
    fn look_on<T>(&mut self, haptic: &ScopedJoinHandle<'_, T>) {
        let begun = Instant::now();
        let mut looks = 0;
        while !haptic.is_finished() {
            self.tell();
            if self.view.update() {
                let snapshot = self.view.output_buffer();
                if let (Some(shape), Some(sample)) = (&mut self.shape, &snapshot.sample) {
                    // What cannot be drawn is not fetched ahead; the step says so itself.
                    let _ = shape.update(snapshot.contacts());
                    shape.look_ahead(sample.report.tool_pose);
                }
                if looks % LOOKS_PER_STATUS == 0 {
                    self.ui.status(&status(snapshot, begun.elapsed()));
                }
            }
            looks += 1;
            std::thread::sleep(Duration::from_secs_f64(LOOK_S));
        }
        self.tell();
    }

    fn tell(&self) {
        let messages = self.messages.iter().flat_map(|m| m.try_iter());
        messages.for_each(|message| self.ui.note(&message));
    }
}

/// One line while it goes on.
fn status(snapshot: &Snapshot, elapsed: Duration) -> String {
    let Some(sample) = &snapshot.sample else {
        return format!(
            "{:7.1} s  no pose from the device yet",
            elapsed.as_secs_f64()
        );
    };
    format!(
        "{:7.1} s  {}  travel {:8.3} mm  force {:7.2} N  {:3} contacts  peak {:.2} N  snapped {} in, {} out",
        elapsed.as_secs_f64(),
        sample.servo.arming,
        1e3 * sample.gone.travel,
        sample.resistance,
        sample.report.contacts,
        snapshot.snap.peak_force,
        snapshot.snap.n_snaps_in,
        snapshot.snap.n_snaps_out,
    )
}
