//! `snapin verify`.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::{json_text, print};
use crate::leftovers::write_beside;
use crate::progress::Ui;
use crate::study::verify::{CaseResult, Status, find_cases, run_case, to_json};
use crate::{Error, crash};

#[derive(Debug, Args)]
pub(super) struct VerifyArgs {
    /// Folder below which cases are looked for.
    dir: PathBuf,
    /// Write the computed values as JSON.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Only cases whose name contains this.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Print the JSON instead of the table.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &VerifyArgs, out: &mut dyn Write, ui: &Ui<'_>) -> Result<u8, Error> {
    let mut cases = find_cases(&args.dir)?;
    if let Some(text) = &args.only {
        cases.retain(|dir| dir.to_string_lossy().contains(text.as_str()));
    }
    if cases.is_empty() {
        return Err(Error::Input(format!(
            "{}: holds no case{}; a case is a folder with case.toml or problem.json",
            args.dir.display(),
            args.only
                .as_ref()
                .map(|t| format!(" whose name contains {t:?}"))
                .unwrap_or_default(),
        )));
    }
    if let Some(file) = &args.out {
        // Found out before an hour of work, not after it.
        std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(file)
            .map_err(Error::io(file, "write the computed values"))?;
    }
    let mut results = Vec::new();
    for dir in &cases {
        let result = run_case(&args.dir, dir, ui)?;
        if !args.json {
            print(out, &table(&result))?;
        }
        results.push(result);
    }
    let value = to_json(&results);
    if let Some(file) = &args.out {
        write_beside(file, json_text(&value).as_bytes())
            .map_err(Error::io(file, "write the computed values"))?;
    }
    if args.json {
        print(out, &json_text(&value))?;
    } else {
        let passed = results.iter().filter(|r| r.status == Status::Ok).count();
        print(
            out,
            &format!("{passed} of {} cases within tolerance\n", results.len()),
        )?;
    }
    Ok(if results.iter().any(|r| r.status == Status::Fault) {
        crash::EXIT_CODE
    } else {
        u8::from(results.iter().any(|r| r.status != Status::Ok))
    })
}

fn table(result: &CaseResult) -> String {
    let mut text = format!("{}: {}\n", result.name, result.status.word());
    if !result.message.is_empty() {
        text += &format!("    {}\n", result.message);
    }
    for q in &result.quantities {
        text += &format!(
            "  {} {:<28} {:>22} {:>22}  error {:.1e}  tolerance {}\n",
            match (q.is_within(), q.is_informative()) {
                (true, true) => "told",
                (true, false) => "ok  ",
                (false, _) => "FAIL",
            },
            q.name,
            brief(&q.computed),
            brief(&q.expected),
            q.error_rel,
            tolerance(&q.tolerance),
        );
    }
    text
}

fn tolerance(value: &serde_json::Value) -> String {
    let parts: Vec<String> = ["rel", "abs"]
        .iter()
        .filter_map(|key| value[*key].as_f64().map(|x| format!("{key} {x:.0e}")))
        .collect();
    parts.join(", ")
}

/// A value of any shape in one cell: a number, or what stands for the whole.
fn brief(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Number(n) => n
            .as_f64()
            .map_or_else(|| n.to_string(), |x| format!("{x:.12e}")),
        serde_json::Value::String(s) => s.clone(),
        serde_json::Value::Bool(b) => if *b { "yes" } else { "no" }.to_owned(),
        serde_json::Value::Object(o) => match o.get("force_on_tool_N").and_then(|f| f.as_array()) {
            // One of each pose of a path, or one.
            Some(f) if f.iter().any(serde_json::Value::is_array) => {
                let largest = f.iter().map(length).fold(0.0, f64::max);
                format!("max |F| {largest:.9} N")
            }
            Some(_) => format!("|F| = {:.12} N", length(&o["force_on_tool_N"])),
            None => o
                .get("peak_force_N")
                .and_then(serde_json::Value::as_f64)
                .map_or_else(
                    || format!("{} entries", o.len()),
                    |x| format!("peak {x:.12} N"),
                ),
        },
        serde_json::Value::Array(a) => {
            let mut numbers = Vec::new();
            flatten(value, &mut numbers);
            match numbers[..] {
                [] => format!("{} entries", a.len()),
                [a] => format!("[{a:.12e}]"),
                _ => {
                    let largest = numbers.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                    format!("max {largest:.12e}")
                }
            }
        }
        serde_json::Value::Null => "-".to_owned(),
    }
}

/// Of a vector.
fn length(value: &serde_json::Value) -> f64 {
    let mut numbers = Vec::new();
    flatten(value, &mut numbers);
    numbers.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn flatten(value: &serde_json::Value, into: &mut Vec<f64>) {
    match value {
        serde_json::Value::Number(n) => into.extend(n.as_f64()),
        serde_json::Value::Array(a) => a.iter().for_each(|v| flatten(v, into)),
        _ => {}
    }
}
