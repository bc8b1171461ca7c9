//! `snapin live`: a scene in the hand, until it is ended.

pub(super) mod open;
pub(super) mod ready;
pub(super) mod told;

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use clap::Args;
use device::Realtime;

use super::{CacheArgs, print};
use crate::Error;
use crate::progress::Ui;
use crate::scene::Scene;
use crate::session::live::{self, LivePorts, LiveReport};
use crate::session::log::{Log, Logged};
use crate::session::{Snapshot, SnapshotOutput, StopOnDrop, TracePoint, snapshots};
use crate::shape::Shape;
use open::Devices;
use ready::{Loaded, Ready};
use told::Told;

#[derive(Debug, Args)]
pub(super) struct LiveArgs {
    /// Scene file.
    pub(super) scene: PathBuf,
    /// Device, as `snapin devices` names it; `simulated` (the scene's device.model) or `simulated:MODEL` is held by the
    /// scene's hand.
    #[arg(long, value_name = "NAME", default_value = "simulated")]
    pub(super) device: String,
    /// A second device for the other hand, which holds the other body (part or tool).
    #[arg(long, value_name = "NAME")]
    pub(super) second_device: Option<String>,
    /// Axes of the second device in the scene, as --axes.
    #[arg(
        long,
        value_name = "AXES",
        default_value = "+x+y+z",
        allow_hyphen_values = true
    )]
    pub(super) second_axes: open::Axes,
    /// Forces sent to the device per second, 100 to 10000 (default: the scene's device.servo_period).
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Metres in the scene per metre of the device; forces are scaled by the same factor.
    #[arg(
        long,
        value_name = "FACTOR",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
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
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    max_force: Option<f64>,
    /// End after so many seconds (default: Ctrl-C, or the end of the scripted hand).
    #[arg(long = "for", value_name = "SECONDS", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Folder for recordings (default: out/ and the scene's name with -live); nothing there is overwritten.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Record nothing.
    #[arg(long, conflicts_with = "out")]
    pub(super) no_recording: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) cache: CacheArgs,
}

/// Time between two looks at the newest snapshot, s.
const LOOK_S: f64 = 0.016;

/// Looks between two status lines.
const LOOKS_PER_STATUS: u64 = 6;

pub(super) fn run(args: &LiveArgs, out: &mut dyn Write, ui: &Ui<'_>) -> Result<u8, Error> {
    let scene = Scene::load(&args.scene)?;
    let files = Files::new(args)?;
    // Whether the devices are there is known before an hour of preparing.
    let mut devices = Devices::external(args)?;
    let loaded = Loaded::new(args, scene, ui)?;
    devices.add_simulated(args, &loaded)?;
    devices.notes().for_each(|note| ui.note(note));
    let mut ready = Ready::new(args, loaded, devices.first()?)?;
    ui.note(&format!("coupling {}", ready.coupling));
    ui.note(&ready.rates.words());
    let session = Session {
        args,
        ready: &mut ready,
        devices: &mut devices,
        files: files.as_ref(),
        trace: None,
    };
    let (report, logged) = feel(session, ui, |seat| {
        Eye::new(seat, ui).look_on();
        Ok(())
    })?;
    ui.end_status();
    tell(
        args,
        &ready,
        &devices,
        files.as_ref(),
        (&report, logged),
        out,
        ui,
    )?;
    Ok(0)
}

/// Prints the summary with its warnings, and writes it beside the recording.
///
/// # Errors
/// What cannot be written.
pub(super) fn tell(
    args: &LiveArgs,
    ready: &Ready,
    devices: &Devices,
    files: Option<&Files>,
    (report, logged): (&LiveReport, Option<Logged>),
    out: &mut dyn Write,
    ui: &Ui<'_>,
) -> Result<(), Error> {
    let told = Told {
        ready,
        devices: devices.names(),
        report,
        logged: logged.as_ref(),
        recording: files.map(|files| files.recording.as_path()),
    };
    told.warnings().iter().for_each(|line| ui.note(line));
    print(out, &if args.json { told.json() } else { told.text() })?;
    if let Some(files) = files
        && let Err(e) = std::fs::write(&files.summary, told.json())
    {
        // Half a summary is none.
        let _ = std::fs::remove_file(&files.summary);
        return Err(Error::io(&files.summary, "write the summary")(e));
    }
    Ok(())
}

/// A session that is to be.
pub(super) struct Session<'a> {
    pub(super) args: &'a LiveArgs,
    pub(super) ready: &'a mut Ready,
    pub(super) devices: &'a mut Devices,
    pub(super) files: Option<&'a Files>,
    /// Every period for a plot.
    pub(super) trace: Option<rtrb::Producer<TracePoint>>,
}

/// What the thread that looks on has of the loop.
pub(super) struct Seat<'a> {
    /// The newest period.
    pub(super) view: SnapshotOutput,
    /// The surface's motion, where somebody wants it.
    pub(super) shape: Option<&'a mut Shape>,
    /// What devices tell.
    pub(super) messages: Vec<&'a Receiver<String>>,
    /// Whether the loop has ended.
    pub(super) is_over: &'a dyn Fn() -> bool,
}

/// The session itself: the loop on a thread of its own, the recording on another, and this one looks on; when it does not
/// any more, the loop ends.
///
/// # Errors
/// Settings that the loop refuses, files that cannot be written, and what the one who looks on says.
pub(super) fn feel(
    session: Session<'_>,
    ui: &Ui<'_>,
    look_on: impl FnOnce(Seat<'_>) -> Result<(), Error>,
) -> Result<(LiveReport, Option<Logged>), Error> {
    let Session {
        args,
        ready,
        devices,
        files,
        trace,
    } = session;
    let about = BTreeMap::from([
        ("title".to_owned(), ready.scene.title.clone()),
        ("scene".to_owned(), ready.scene.path.display().to_string()),
        ("scene_text".to_owned(), ready.scene.source.clone()),
        ("device".to_owned(), devices.names()),
        ("coupling".to_owned(), ready.coupling.clone()),
    ]);
    let log = files.map(|files| Log::create(&files.recording, &about));
    let (log, samples) = log.transpose()?.unzip();
    let (viewer, view) = snapshots(ready.engine.settings().max_contacts);
    let (granted, granted_words) = channel();
    let ports = LivePorts {
        at_start: Some(Box::new(move || {
            // Nobody listens where the session ended at once.
            let _ = granted.send(Realtime::ask().to_string());
        })),
        viewer,
        log: samples,
        trace,
    };
    let (hands, mut messages) = devices.hands(args, ready)?;
    messages.push(&granted_words);
    let (stop, is_written) = (AtomicBool::new(false), AtomicBool::new(false));
    let (spec, rates, engine) = (&ready.spec, &ready.rates, &mut ready.engine);
    let shape = ready.shape.as_mut();
    std::thread::scope(|scope| {
        let written = log.map(|log| scope.spawn(|| log.write(&is_written)));
        // Also where the one who looks on panics.
        let end_of_log = StopOnDrop(&is_written);
        let haptic = std::thread::Builder::new()
            .name("haptic loop".to_owned())
            .spawn_scoped(scope, || {
                live::run(spec, rates, hands, engine, ports, &stop)
            })
            .map_err(Error::io(
                Path::new("the haptic loop"),
                "start the thread of",
            ))?;
        let end_of_loop = StopOnDrop(&stop);
        let seen = look_on(Seat {
            view,
            shape,
            messages,
            is_over: &|| haptic.is_finished(),
        });
        drop(end_of_loop);
        let report = haptic.join().map_err(|_| Error::EngineEnded);
        drop(end_of_log);
        let report = report?;
        let logged = written.map(|thread| thread.join().map_err(|_| Error::EngineEnded));
        let logged = logged.transpose()?.transpose().unwrap_or_else(|error| {
            ui.note(&format!("warning: the recording is cut short: {error}"));
            None
        });
        seen?;
        Ok((report?, logged))
    })
}

/// The files of a session: the first number that is free.
pub(super) struct Files {
    pub(super) recording: PathBuf,
    summary: PathBuf,
}

impl Files {
    /// The recording is made here, so that two sessions that begin together do not share a number.
    ///
    /// # Errors
    /// A folder or file that cannot be made.
    pub(super) fn new(args: &LiveArgs) -> Result<Option<Self>, Error> {
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
        for n in 1_u32.. {
            let recording = folder.join(format!("session-{n:03}.mcap"));
            let summary = folder.join(format!("session-{n:03}.json"));
            if summary.exists() {
                continue;
            }
            match std::fs::File::create_new(&recording) {
                Ok(_) => return Ok(Some(Self { recording, summary })),
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(Error::io(&recording, "create the recording")(e)),
            }
        }
        Ok(None)
    }

    /// Takes back what is not used.
    fn forget(&self) {
        let is_empty = std::fs::metadata(&self.recording).is_ok_and(|m| m.len() == 0);
        if is_empty {
            let _ = std::fs::remove_file(&self.recording);
        }
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        self.forget();
    }
}

/// What looks on while the loop goes: messages, status, and the columns that come next.
struct Eye<'a, 'u> {
    seat: Seat<'a>,
    /// What the guard did and was told.
    told: Vec<&'static str>,
    ui: &'a Ui<'u>,
}

impl<'a, 'u> Eye<'a, 'u> {
    fn new(seat: Seat<'a>, ui: &'a Ui<'u>) -> Self {
        let told = Vec::new();
        Self { seat, told, ui }
    }

    /// Until the loop ends.
    fn look_on(&mut self) {
        let begun = Instant::now();
        let mut looks = 0;
        while !(self.seat.is_over)() {
            self.tell();
            if self.seat.view.update() {
                let snapshot = self.seat.view.output_buffer();
                if let Some(sample) = &snapshot.sample {
                    let news = told::news(&sample.servo.safety, &mut self.told);
                    news.for_each(|news| self.ui.note(&news));
                }
                if let (Some(shape), Some(sample)) = (&mut self.seat.shape, &snapshot.sample) {
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
        let messages = self.seat.messages.iter().flat_map(|m| m.try_iter());
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
