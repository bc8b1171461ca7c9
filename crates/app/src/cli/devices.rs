//! `snapin devices`: what is attached, what could be, and why not.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use device::driver;
use device::driver::simulated::Model;
use device::stability::ZWidth;
use serde_json::{Value, json};

use super::{json_text, period_of, print};
use crate::Error;
use crate::report::plot::short;
use crate::report::z_width;

#[derive(Debug, Args)]
pub(super) struct DevicesArgs {
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Show which walls a simulated model can render at a rate: table and plot.
    #[arg(long, value_name = "MODEL")]
    stability: Option<String>,
    /// Forces per second for --stability, 100 to 10000.
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 1000.0,
        requires = "stability"
    )]
    rate: f64,
    /// The plot of --stability (default: out/stability-MODEL.svg).
    #[arg(long, value_name = "FILE", requires = "stability")]
    out: Option<PathBuf>,
}

/// Dampings in the table and the plot of stability.
const N_DAMPINGS: usize = 41;

pub(super) fn run(args: &DevicesArgs, out: &mut dyn Write) -> Result<u8, Error> {
    if let Some(name) = &args.stability {
        return stability(args, name, out);
    }
    let listings = driver::list();
    let text = if args.json {
        let list: Vec<_> = listings
            .iter()
            .map(|one| {
                json!({
                    "name": one.name,
                    "is_there": one.status.is_ok(),
                    "what": one.status.as_ref().ok(),
                    "why_not": one.status.as_ref().err().map(ToString::to_string),
                })
            })
            .collect();
        json_text(&json!({ "devices": list }))
    } else {
        table(&listings)
    };
    print(out, &text)?;
    Ok(0)
}

/// Which walls a model can render.
fn stability(args: &DevicesArgs, name: &str, out: &mut dyn Write) -> Result<u8, Error> {
    let period_s = period_of(args.rate)?;
    let key = name.strip_prefix("simulated:").unwrap_or(name);
    let model =
        Model::named(key).map_err(|why| Error::Input(format!("--stability {name}: {why}")))?;
    let width = device::stability::z_width(model, period_s, N_DAMPINGS);
    let svg = z_width::z_width(model.name, &width, model.limits.max_stiffness)
        .map_err(|e| Error::Input(format!("--stability {name}: the plot failed: {e}")))?;
    let path = args
        .out
        .clone()
        .unwrap_or_else(|| Path::new("out").join(format!("stability-{}.svg", model.key)));
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(Error::io(folder, "create the folder"))?;
    }
    std::fs::write(&path, svg).map_err(Error::io(&path, "write the plot"))?;
    let text = if args.json {
        json_text(&stability_json(model, &width, period_s))
    } else {
        stability_text(model, &width, period_s)
            + &format!("  plot                  {}\n", path.display())
    };
    print(out, &text)?;
    Ok(0)
}

fn stability_text(model: &Model, width: &ZWidth, period_s: f64) -> String {
    let bound = |value: Option<f64>| value.map_or("not known".to_owned(), short);
    let mut text = format!(
        "{} at {} Hz, delay {} periods\n  largest recommended   {} N/m\n  encoder's steps buzz  above {} N/m\n\n  \
         {:>12} {:>12} {:>12} {:>12}\n  {:>12} {:>12} {:>12} {:>12}\n",
        model.name,
        short(period_s.recip()),
        width.delay_periods,
        bound(model.limits.max_stiffness),
        bound(width.friction_bound),
        "damping",
        "stable",
        "passive",
        "estimate",
        "N s/m",
        "below N/m",
        "below N/m",
        "N/m",
    );
    for p in &width.points {
        text += &format!(
            "  {:>12} {:>12} {:>12} {:>12}\n",
            short(p.virtual_damping),
            short(p.critical),
            p.passive.map_or("-".to_owned(), short),
            short(p.rule_of_thumb),
        );
    }
    for (figure, source) in model.sources {
        text += &format!("  {figure}: {source}\n");
    }
    text
}

fn stability_json(model: &Model, width: &ZWidth, period_s: f64) -> Value {
    let points: Vec<Value> = width
        .points
        .iter()
        .map(|p| {
            json!({
                "damping_N_s_per_m": p.virtual_damping,
                "stable_below_N_per_m": p.critical,
                "passive_below_N_per_m": p.passive,
                "estimate_N_per_m": p.rule_of_thumb,
            })
        })
        .collect();
    json!({
        "model": model.key,
        "period_s": period_s,
        "delay_periods": width.delay_periods,
        "recommended_N_per_m": model.limits.max_stiffness,
        "friction_bound_N_per_m": width.friction_bound,
        "points": points,
    })
}

/// What is there first.
fn table(listings: &[driver::Listing]) -> String {
    let width = listings.iter().map(|one| one.name.len()).max().unwrap_or(0);
    let line = |one: &driver::Listing| match &one.status {
        Ok(what) => format!("ok    {:<width$}  {what}\n", one.name),
        Err(why) => format!("none  {:<width$}  {why}\n", one.name),
    };
    let (there, not): (Vec<_>, Vec<_>) = listings.iter().partition(|one| one.status.is_ok());
    there.into_iter().chain(not).map(line).collect()
}
