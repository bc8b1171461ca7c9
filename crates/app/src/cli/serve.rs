//! `snapin serve`: a simulated device, held by a scene's hand, for other programs that speak VRPN.

use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use device::driver::simulated::Model;
use device::driver::vrpn::server::Server;
use device::{HandSettings, Insertion, Script, Simulated, SimulatedHand};

use super::{period_of, print};
use crate::progress::Ui;
use crate::scene::Scene;
use crate::{Error, interrupt};

#[derive(Debug, Args)]
pub(super) struct ServeArgs {
    /// Scene file: its hand's way, or else that of its own curve, is gone again and again.
    scene: PathBuf,
    /// Simulated model, as `snapin devices` names it.
    #[arg(long, value_name = "MODEL", default_value = "simulated:virtuose-6d")]
    device: String,
    /// Address and port; 3883 is VRPN's.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:3883")]
    listen: String,
    /// What stands before the @ of the device's name.
    #[arg(long, value_name = "NAME", default_value = "Hand0")]
    name: String,
    /// Rest of the hand before each way in, s: time to connect.
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 10.0,
        allow_negative_numbers = true
    )]
    rest: f64,
    /// Periods per second, 100 to 10000.
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 1000.0,
        allow_negative_numbers = true
    )]
    rate: f64,
}

/// m/s, of a hand that the scene does not describe.
const SPEED: f64 = 0.01;

/// Time between two targets of the hand, s.
const TARGET_S: f64 = 2e-3;

pub(super) fn run(args: &ServeArgs, out: &mut dyn Write, ui: &Ui<'_>) -> Result<u8, Error> {
    let scene = Scene::load(&args.scene)?;
    let period_s = period_of(args.rate)?;
    if !(args.rest.is_finite() && args.rest >= 0.0) {
        return Err(Error::Input(format!("--rest {} is no time", args.rest)));
    }
    let key = args.device.strip_prefix("simulated:");
    let key = key.unwrap_or(&args.device).trim_start_matches("simulated");
    let model = Model::named(key)
        .map_err(|why| Error::Input(format!("--device {}: {why}", args.device)))?;
    let script = script(&scene)?;
    let start = script.start();
    let (mut guide, hand) = SimulatedHand::guided(HandSettings::default(), start, period_s)?;
    let mut device = Simulated::of_model(model, hand)?;
    let mut server = Server::bind(&args.listen, &args.name)
        .map_err(|why| Error::Input(format!("--listen {}: {why}", args.listen)))?;
    let address = server.local_addr();
    print(
        out,
        &format!(
            "{} as vrpn:{}@{address}, until Ctrl-C; the hand goes in after {} s of rest, again and again\n",
            model.name, args.name, args.rest
        ),
    )?;
    let stop = AtomicBool::new(false);
    let report = std::thread::scope(|scope| {
        let served = scope.spawn(|| server.run(&mut device, period_s, &stop));
        let begun = Instant::now();
        let round_s = args.rest + script.duration_s();
        while !interrupt::is_requested() && !served.is_finished() {
            let into_round = begun.elapsed().as_secs_f64() % round_s;
            let target = script.target((into_round - args.rest).max(0.0));
            guide.set_target(target.pose)?;
            std::thread::sleep(Duration::from_secs_f64(TARGET_S));
        }
        stop.store(true, Ordering::Release);
        let report = served.join().map_err(|_| Error::EngineEnded)?;
        Ok::<_, Error>(report?)
    })?;
    ui.note(&format!(
        "{} clients, {} turned away, {} force fields; {} forces dropped because the client fell silent, {} because it left",
        report.guests, report.refused, report.fields, report.silences, report.departures
    ));
    Ok(0)
}

/// The scene's way, in and out.
fn script(scene: &Scene) -> Result<Script, Error> {
    let start = scene.tool.pose_part_tool;
    let (direction, travel) = (scene.drive.direction, scene.drive.travel);
    let way = Insertion {
        start,
        direction,
        speed: SPEED,
        travel,
        hold_s: 0.5,
        retract: true,
    };
    let way = scene.hand.as_ref().map_or(way, |hand| Insertion {
        direction: hand.direction,
        speed: hand.speed,
        travel: hand.travel,
        hold_s: hand.hold,
        ..way
    });
    Ok(Script::new(&way)?)
}
