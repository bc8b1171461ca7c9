//! `snapin doctor`: what works here, and the mend for what does not.

use std::io::Write;
use std::time::{Duration, Instant};

use clap::Args;
use device::Granted;
use device::driver;
use gpu::{Adapter, Adapters, Gpu, GpuSettings, Layout};
use serde_json::{Value, json};

use super::{json_text, print};
use crate::Error;
use crate::choice::name_of;
use crate::machine::Machine;
use crate::prepare::budget::bytes;
use crate::prepare::cache;

#[derive(Debug, Args)]
pub(super) struct DoctorArgs {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

struct Finding {
    subject: &'static str,
    works: bool,
    what: String,
    mend: Option<String>,
    /// Numbers, for JSON.
    numbers: Value,
}

impl Finding {
    fn works(subject: &'static str, what: String) -> Self {
        Self {
            subject,
            works: true,
            what,
            mend: None,
            numbers: Value::Null,
        }
    }
}

pub(super) fn run(args: &DoctorArgs, out: &mut dyn Write) -> Result<u8, Error> {
    let mut findings = vec![
        processor(),
        memory(),
        clock(),
        cache_folder(),
        real_time(),
        devices(),
    ];
    let adapters = Adapters::find();
    findings.push(multiply(&adapters));
    findings.extend(adapters.list.iter().map(|one| adapter(one, &adapters)));
    let text = if args.json {
        let list: Vec<_> = findings
            .iter()
            .map(|f| {
                json!({
                    "subject": f.subject,
                    "works": f.works,
                    "what": f.what,
                    "mend": f.mend,
                    "numbers": f.numbers,
                })
            })
            .collect();
        json_text(&json!({ "findings": list }))
    } else {
        findings
            .iter()
            .map(|f| {
                let mend = f
                    .mend
                    .as_ref()
                    .map(|m| format!("\n      mend: {m}"))
                    .unwrap_or_default();
                format!(
                    "{} {:<10} {}{mend}\n",
                    if f.works { "ok  " } else { "no  " },
                    f.subject,
                    f.what
                )
            })
            .collect()
    };
    print(out, &text)?;
    Ok(0)
}

fn processor() -> Finding {
    let machine = Machine::read();
    Finding::works("processor", machine.summary())
}

fn memory() -> Finding {
    let machine = Machine::read();
    // 72 bytes per pair of nodes: a part whose whole surface can touch.
    let nodes = (machine.available_memory as f64 / 72.0).sqrt();
    let free = bytes(machine.available_memory as f64);
    Finding::works(
        "memory",
        format!("{free} free: a part with about {nodes:.0} surface nodes that can all touch"),
    )
}

/// How late the system wakes a thread that asks for the next millisecond.
fn clock() -> Finding {
    const PERIOD: Duration = Duration::from_millis(1);
    const SAMPLES: u32 = 300;
    let begun = Instant::now();
    let mut late: Vec<u128> = (1..=SAMPLES)
        .map(|k| {
            let release = begun + PERIOD * k;
            std::thread::sleep(release.saturating_duration_since(Instant::now()));
            Instant::now()
                .saturating_duration_since(release)
                .as_micros()
        })
        .collect();
    late.sort_unstable();
    let (median, worst) = (late[late.len() / 2], late[late.len() - 1]);
    let works = worst < 500;
    Finding {
        subject: "clock",
        works,
        what: format!(
            "a sleeping thread wakes {median} us late (median), {worst} us at worst, in {SAMPLES} periods of 1 ms"
        ),
        mend: (!works).then(|| {
            "close other programs, or run where threads may ask for real-time priority; \
             headless runs do not depend on the clock"
                .to_owned()
        }),
        numbers: Value::Null,
    }
}

fn cache_folder() -> Finding {
    let Some(dir) = cache::default_dir() else {
        return Finding {
            subject: "cache",
            works: false,
            what: "no folder for prepared parts is known".to_owned(),
            mend: Some("set SNAPIN_CACHE to a folder, or pass --cache".to_owned()),
            numbers: Value::Null,
        };
    };
    let probe = dir.join(format!(".probe-{}", std::process::id()));
    let result = std::fs::create_dir_all(&dir).and_then(|()| std::fs::write(&probe, b"x"));
    let _ = std::fs::remove_file(&probe);
    Finding {
        subject: "cache",
        works: result.is_ok(),
        what: match &result {
            Ok(()) => format!("{} can be written", dir.display()),
            Err(e) => format!("{} cannot be written: {e}", dir.display()),
        },
        mend: result
            .is_err()
            .then(|| "set SNAPIN_CACHE to a folder, or pass --cache".to_owned()),
        numbers: Value::Null,
    }
}

/// Simulated devices are always there.
fn devices() -> Finding {
    let found: Vec<String> = driver::list()
        .into_iter()
        .filter(|one| one.status.is_ok() && !one.name.starts_with("simulated"))
        .map(|one| one.name)
        .collect();
    let what = match found.as_slice() {
        [] => "none is attached; `snapin devices` says what could be, and why not".to_owned(),
        found => format!("{}; `snapin devices` tells more", found.join(", ")),
    };
    Finding::works("devices", format!("simulated ones; {what}"))
}

/// What a live session's loop would be granted.
fn real_time() -> Finding {
    // On a thread of its own: what it is granted must not outlive the question.
    let granted = std::thread::spawn(device::priority_of_loop).join();
    match granted {
        Ok(Granted::Yes(what)) => Finding::works("real time", what),
        Ok(Granted::No { what, mend }) => Finding {
            subject: "real time",
            works: false,
            what,
            mend: Some(mend),
            numbers: Value::Null,
        },
        Err(_) => Finding::works("real time", "not known".to_owned()),
    }
}

/// The processor multiplies in any case.
fn multiply(adapters: &Adapters) -> Finding {
    let what = match adapters.best(false) {
        Ok(best) => format!(
            "on the processor, or on {} where that is measured to be faster",
            best.name()
        ),
        Err(_) => format!("on the processor; {adapters}"),
    };
    Finding::works("multiply", what)
}

/// Opens an adapter and multiplies on it.
fn adapter(one: &Adapter, all: &Adapters) -> Finding {
    let is_auto = all.best(false).is_ok_and(|best| std::ptr::eq(best, one));
    let auto = match (is_auto, one.is_software()) {
        (true, _) => "considered by multiply = \"auto\"",
        (false, true) => "never taken by \"auto\": it is the processor at work",
        (false, false) => "not taken by \"auto\": another comes first",
    };
    let measured = round_trip(one);
    let trip = match &measured {
        Ok(trip) => format!("round trip {:.2} ms", 1e3 * trip.as_secs_f64()),
        Err(error) => error.to_string(),
    };
    Finding {
        subject: "adapter",
        works: measured.is_ok(),
        what: format!(
            "{}: {trip}, bindings up to {}, buffers up to {}, {auto}",
            name_of(one),
            binary_bytes(one.binding_limit()),
            binary_bytes(one.buffer_limit()),
        ),
        mend: measured.is_err().then(|| {
            "bring its driver up to date, or name another adapter in WGPU_ADAPTER_NAME; the processor multiplies \
             meanwhile"
                .to_owned()
        }),
        numbers: json!({
            "name": one.name(),
            "software": one.is_software(),
            "binding_limit_bytes": one.binding_limit(),
            "buffer_limit_bytes": one.buffer_limit(),
            "round_trip_us": measured.as_ref().ok().map(|trip| 1e6 * trip.as_secs_f64()),
            "considered_by_auto": is_auto,
            "error": measured.as_ref().err().map(gpu::Error::to_string),
        }),
    }
}

/// Median time of a product with one contact, on a compliance of 1000 surface nodes, 64 of which can touch.
fn round_trip(adapter: &Adapter) -> Result<Duration, gpu::Error> {
    const N_ROWS: usize = 1000;
    const N_CANDIDATES: usize = 64;
    let layout = Layout::new(N_ROWS, N_CANDIDATES)?;
    let blocks: Vec<f64> = (0..layout.n_scalars())
        .map(|k| 1e-4 * (k as f64 * 0.37).sin())
        .collect();
    Gpu::new(adapter, layout, &[&blocks], GpuSettings::default()).map(|gpu| gpu.round_trip())
}

/// Limits of drivers are powers of two, or nearly.
fn binary_bytes(n: u64) -> String {
    let mib = n as f64 / (1u64 << 20) as f64;
    if mib < 1024.0 {
        format!("{mib:.0} MiB")
    } else {
        format!("{:.1} GiB", mib / 1024.0)
    }
}
