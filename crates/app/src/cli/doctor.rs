//! `snapin doctor`: what works here, and the mend for what does not.

use std::io::Write;
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::json;

use super::{json_text, print};
use crate::Error;
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
}

pub(super) fn run(args: &DoctorArgs, out: &mut dyn Write) -> Result<u8, Error> {
    let findings = [
        processor(),
        memory(),
        clock(),
        cache_folder(),
        devices(),
        gpu_path(),
    ];
    let text = if args.json {
        let list: Vec<_> = findings
            .iter()
            .map(
                |f| json!({"subject": f.subject, "works": f.works, "what": f.what, "mend": f.mend}),
            )
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
    Finding {
        subject: "processor",
        works: true,
        what: machine.summary(),
        mend: None,
    }
}

fn memory() -> Finding {
    let machine = Machine::read();
    // 72 bytes per pair of nodes: a part whose whole surface can touch.
    let nodes = (machine.available_memory as f64 / 72.0).sqrt();
    Finding {
        subject: "memory",
        works: true,
        what: format!(
            "{} free: a part with about {:.0} surface nodes that can all touch",
            bytes(machine.available_memory as f64),
            nodes
        ),
        mend: None,
    }
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
    }
}

fn cache_folder() -> Finding {
    let Some(dir) = cache::default_dir() else {
        return Finding {
            subject: "cache",
            works: false,
            what: "no folder for prepared parts is known".to_owned(),
            mend: Some("set SNAPIN_CACHE to a folder, or pass --cache".to_owned()),
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
    }
}

fn devices() -> Finding {
    Finding {
        subject: "devices",
        works: true,
        what: "simulated Virtuose 6D with a simulated hand (this version drives no hardware)"
            .to_owned(),
        mend: None,
    }
}

fn gpu_path() -> Finding {
    Finding {
        subject: "multiply",
        works: true,
        what: "on the processor (this version has no GPU path)".to_owned(),
        mend: None,
    }
}
