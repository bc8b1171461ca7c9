//! `snapin view`: a scene in a window, or a picture of it.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;

use super::live::open::Devices;
use super::live::ready::{Loaded, Ready};
use super::live::{Files, LiveArgs, Session, feel, tell};
use super::print;
use crate::Error;
use crate::progress::Ui;
use crate::report::plot::short;
use crate::scene::Scene;
use crate::shape::Shape;
use crate::viewer::app::{self, Facts, Parts};
use crate::viewer::exhibit::Exhibit;
use crate::viewer::hand::{Hand, Way};
use crate::viewer::picture::{self, Adapter};
use crate::viewer::rehearsal::Rehearsal;
use crate::viewer::session::Feed;

#[derive(Debug, Args)]
pub(super) struct ViewArgs {
    /// Write a picture instead of opening a window (PNG, 1280 x 960); needs no display.
    #[arg(long, value_name = "FILE", requires = "at")]
    screenshot: Option<PathBuf>,
    /// How far the held body has gone in the picture, mm, driven along the scene's way as on a testing machine.
    #[arg(
        long,
        value_name = "TRAVEL",
        requires = "screenshot",
        allow_negative_numbers = true
    )]
    at: Option<f64>,
    #[command(flatten)]
    live: LiveArgs,
}

pub(super) fn run(args: &ViewArgs, out: &mut dyn Write, ui: &Ui<'_>) -> Result<u8, Error> {
    let scene = Scene::load(&args.live.scene)?;
    match (&args.screenshot, args.at) {
        (Some(file), Some(at)) => screenshot(args, scene, (file, at), out, ui),
        _ => {
            // Known before an hour of preparing.
            refuse_no_display()?;
            window(args, scene, out, ui, app::open)
        }
    }
}

/// A session, for as long as `open` shows it.
fn window(
    args: &ViewArgs,
    scene: Scene,
    out: &mut dyn Write,
    ui: &Ui<'_>,
    open: impl FnOnce(Parts<'_>) -> Result<(), Error>,
) -> Result<u8, Error> {
    let live = &args.live;
    // A recording is made where its folder is named.
    let files = live.out.as_ref().map(|_| Files::new(live)).transpose()?;
    let files = files.flatten();
    let mut devices = Devices::external(live)?;
    let loaded = Loaded::new(live, scene, ui)?;
    let guided = devices.add_guided(live, &loaded)?;
    devices.add_simulated(live, &loaded)?;
    devices.notes().for_each(|note| ui.note(note));
    let (exhibit, shape) = exhibit(&loaded, None, ui)?;
    let mut ready = Ready::new(live, loaded, devices.first()?)?;
    let session = &ready.spec.session;
    let hand = guided.map(|guided| {
        let way = Way {
            start: session.held.start(),
            direction: session.direction.normalize(),
            travel: session.travel,
            speed: session.speed,
            reach: guided.reach,
        };
        Hand::new(guided.guide, way)
    });
    let hand = hand.transpose()?;
    let facts = facts(&ready, &devices);
    // Where columns are fetched, the session's own knows what comes next.
    let shape = ready.shape.get_or_insert(shape);
    shape.never_wait();
    let (trace, points) = rtrb::RingBuffer::new(TRACE);
    let session = Session {
        args: live,
        ready: &mut ready,
        devices: &mut devices,
        files: files.as_ref(),
        trace: Some(trace),
    };
    let felt = feel(session, ui, |seat| {
        let missing = || Error::Input("the surface has no shape".to_owned());
        open(Parts {
            exhibit: &exhibit,
            feed: Feed {
                view: seat.view,
                shape: seat.shape.ok_or_else(missing)?,
                trace: points,
                messages: seat.messages,
                is_over: seat.is_over,
            },
            hand,
            facts,
        })
    })?;
    tell(
        live,
        &ready,
        &devices,
        files.as_ref(),
        (&felt.0, felt.1),
        out,
        ui,
    )?;
    Ok(0)
}

/// Periods that the plot may be behind: 4 s at 1 kHz.
const TRACE: usize = 4096;

/// What the window tells of a session.
fn facts(ready: &Ready, devices: &Devices) -> Facts {
    let coupling = &ready.scene.coupling;
    let friction = ready.scene.effects.simulated_friction();
    Facts {
        device: devices.names(),
        coupling: format!(
            "{} N/m, {} N m/rad",
            short(coupling.translational_stiffness),
            short(coupling.rotational_stiffness)
        ),
        effects: match ready.scene.effects.largest_friction() {
            Some(coefficient) if friction.is_some() => {
                format!("friction, coefficient {}", short(coefficient))
            }
            _ => "none beyond contact without friction".to_owned(),
        },
        has_friction: ready.engine.has_friction(),
        period_s: ready.spec.session.period_s,
    }
}

/// Where the system says that there is none.
///
/// # Errors
/// No display, with the mend.
fn refuse_no_display() -> Result<(), Error> {
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let has_display = !cfg!(target_os = "linux") || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
    if has_display {
        return Ok(());
    }
    Err(Error::Input(
        "no display: neither DISPLAY nor WAYLAND_DISPLAY is set; run it on a desktop, or draw a picture with --screenshot \
         FILE --at TRAVEL, or feel the scene without a window with snapin live"
            .to_owned(),
    ))
}

/// A picture of the part at a travel, mm.
fn screenshot(
    args: &ViewArgs,
    scene: Scene,
    (file, at): (&Path, f64),
    out: &mut dyn Write,
    ui: &Ui<'_>,
) -> Result<u8, Error> {
    if !(at.is_finite() && at > 0.0) {
        return Err(Error::Input(format!("--at {at} is no travel above 0 mm")));
    }
    let adapter = Adapter::first()?;
    let loaded = Loaded::new(&args.live, scene, ui)?;
    let (exhibit, mut shape) = exhibit(&loaded, Some(1e-3 * at), ui)?;
    let bytes = picture::of_end(&exhibit, &mut shape, &adapter)?;
    std::fs::write(file, bytes).map_err(Error::io(file, "write the picture"))?;
    print(
        out,
        &format!("{} (drawn by {})\n", file.display(), adapter.name),
    )?;
    Ok(0)
}

/// What is shown of a scene, and what moves its surface. `travel`: m, of the rehearsed way, if it is not the scene's.
fn exhibit(loaded: &Loaded, travel: Option<f64>, ui: &Ui<'_>) -> Result<(Exhibit, Shape), Error> {
    let Loaded {
        scene,
        prepared,
        tool,
        options,
        ..
    } = loaded;
    let mut shape = Shape::new(prepared, &scene.accuracy, options.cache_dir.as_deref())?;
    let progress = ui.progress();
    let rehearsal = Rehearsal::of(scene, prepared, tool.clone(), &mut shape, travel, &progress)?;
    let exhibit = Exhibit::new(scene, prepared, tool, rehearsal, &mut shape)?;
    Ok((exhibit, shape))
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        view: ViewArgs,
    }

    fn scene_file(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../scenes")
            .join(name)
    }

    fn arguments(rest: &[&str]) -> ViewArgs {
        let scene = scene_file("clip.toml").display().to_string();
        let all = ["view", &scene, "--no-cache"]
            .into_iter()
            .chain(rest.iter().copied());
        Program::try_parse_from(all).unwrap().view
    }

    /// All of the window but the glass: the hand pushes, the part answers and moves, and when the window is closed the
    /// session is over.
    #[test]
    fn a_push_is_felt_and_drawn_and_closing_ends_the_session() {
        let args = arguments(&["--device", "simulated"]);
        let scene = Scene::load(&args.live.scene).unwrap();
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let ui = Ui::new(&mut err, false);
        let mut seen = (0.0_f64, 0.0_f64, 0);
        let code = window(&args, scene, &mut out, &ui, |parts| {
            let (mut feed, hand) = (parts.feed, parts.hand.unwrap());
            let begun = Instant::now();
            hand.push_to(0.006);
            while begun.elapsed() < Duration::from_secs(60) && seen.0 < 1.0 {
                while feed.trace.pop().is_ok() {
                    seen.2 += 1;
                }
                if feed.view.update() {
                    let snapshot = feed.view.output_buffer();
                    let sample = snapshot.sample.unwrap();
                    seen.0 = seen.0.max(sample.resistance);
                    let displacement = feed.shape.update(snapshot.contacts())?;
                    seen.1 = seen.1.max(crate::shape::largest(displacement));
                }
                std::thread::sleep(Duration::from_millis(5));
            }
            assert!(!(feed.is_over)());
            Ok(())
        });
        assert_eq!(code.unwrap(), 0);
        let (force, moved, n_periods) = seen;
        assert!(force > 1.0 && moved > 1e-5 && n_periods > 0, "{seen:?}");
        let told = String::from_utf8(out).unwrap();
        assert!(told.contains("C-clip on a 20 mm tube"), "{told}");
    }

    #[test]
    fn a_picture_wants_its_travel_and_a_window_wants_none() {
        let parse = |rest: &[&str]| {
            Program::try_parse_from(["view", "a.toml"].iter().chain(rest)).map(|p| p.view)
        };
        assert!(parse(&["--screenshot", "a.png"]).is_err());
        assert!(parse(&["--at", "3"]).is_err());
        let both = parse(&["--screenshot", "a.png", "--at", "3.5"]).unwrap();
        assert_eq!(both.at, Some(3.5));
    }
}
