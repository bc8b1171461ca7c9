//! The study as files: CSV, JSON, plots and a page.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;

use super::compare::pareto_front;
use super::table::{PERIOD_US, cells, csv, name, percent};
use super::{Axis, Errors, Measured, Row, Study, store};
use crate::Error;
use crate::report::html::{escaped, head};
use crate::report::plot::short;
use crate::report::work_precision::{PlotPoint, Scale, error_over_cost, force_curves};

/// Error of the wrench below which a point is drawn at this value: round-off.
const LEAST_ERROR: f64 = 1e-9;

/// Writes all files of a study into its folder, each beside and renamed, the page last.
///
/// # Errors
/// What cannot be written; what the plot library says.
pub fn write(study: &Study, out: &Path) -> Result<(), Error> {
    let plot_error =
        |e: Box<dyn std::error::Error>| Error::Input(format!("cannot draw a plot: {e}"));
    let step = plot(
        study,
        "time of a step (µs): hollow 50 %, filled 99.9 % are faster",
        true,
        &step_times,
    )
    .map_err(plot_error)?;
    let solver = solver_plot(study).map_err(plot_error)?;
    let memory = plot(study, "memory that is read (MB)", false, &|m| {
        Some([1e-6 * m.bytes; 2])
    })
    .map_err(plot_error)?;
    let prepare =
        plot(study, "preparing (s)", false, &|m| Some([m.prepare_s; 2])).map_err(plot_error)?;
    let curves = force_curves(&study.curves).map_err(plot_error)?;
    store::write(&out.join("accuracy.csv"), &csv(study))?;
    store::write(&out.join("accuracy.json"), &to_json(study))?;
    store::write(&out.join("error-over-time.svg"), &step)?;
    store::write(&out.join("solver-error-over-time.svg"), &solver)?;
    store::write(&out.join("error-over-memory.svg"), &memory)?;
    store::write(&out.join("error-over-preparing.svg"), &prepare)?;
    store::write(&out.join("force-curves.svg"), &curves)?;
    let page = page(study, [&step, &memory, &prepare, &solver], &curves);
    store::write(&out.join("report.html"), &page)
}

/// Error of the wrench over a cost, a line for each axis.
fn plot(
    study: &Study,
    cost: &str,
    is_step: bool,
    of: &dyn Fn(&Measured) -> Option<[f64; 2]>,
) -> Result<String, Box<dyn std::error::Error>> {
    let scale = Scale {
        cost: cost.to_owned(),
        error: "error of the wrench along the path".to_owned(),
        limit: is_step.then_some((PERIOD_US, "1 ms")),
        bar: study.reference.bar,
    };
    draw(study, &scale, &|_| true, of, &|e| e.wrench_l2)
}

/// Error against the exact solution on the same mesh over the time of a step.
fn solver_plot(study: &Study) -> Result<String, Box<dyn std::error::Error>> {
    let scale = Scale {
        cost: "time of a step (µs): hollow 50 %, filled 99.9 % are faster".to_owned(),
        error: "error of the wrench on the same mesh".to_owned(),
        limit: Some((PERIOD_US, "1 ms")),
        bar: None,
    };
    // Other orders and meshes are their own exact solutions.
    let of_solver = |axis: Axis| !matches!(axis, Axis::Order | Axis::Mesh | Axis::Quadrature);
    draw(study, &scale, &of_solver, &step_times, &|e| e.solver_l2)
}

/// µs; none where no step was timed: such settings are no points of a plot over time.
fn step_times(measured: &Measured) -> Option<[f64; 2]> {
    measured.step.map(|times| [times.p50, times.p999])
}

fn draw(
    study: &Study,
    scale: &Scale,
    is_shown: &dyn Fn(Axis) -> bool,
    cost_of: &dyn Fn(&Measured) -> Option<[f64; 2]>,
    error_of: &dyn Fn(&Errors) -> f64,
) -> Result<String, Box<dyn std::error::Error>> {
    let names: Vec<String> = Axis::ALL.iter().map(|a| a.name().to_owned()).collect();
    let all: Vec<(&Row, [f64; 2], f64)> = study
        .rows
        .iter()
        .filter(|row| is_shown(row.axis))
        .filter_map(|row| {
            let (measured, errors) = row.outcome.as_ref().ok()?;
            let cost = cost_of(measured)?.map(|c| c.max(1e-6));
            // The reference itself has no error to show.
            if scale.bar.is_some() && error_of(errors) == 0.0 {
                return None;
            }
            Some((row, cost, error_of(errors).max(LEAST_ERROR)))
        })
        .collect();
    let candidates = (0..all.len()).filter(|k| all[*k].0.can_be_on_front());
    let candidates: Vec<usize> = candidates.collect();
    let costs = candidates.iter().map(|&k| (all[k].1[1], all[k].2));
    let front = pareto_front(&costs.collect::<Vec<_>>());
    let front: Vec<usize> = front.into_iter().map(|k| candidates[k]).collect();
    // The scene's own setting is on most axes: it is named once.
    let first_own = all.iter().position(|(row, ..)| row.is_own);
    let points: Vec<PlotPoint> = all
        .iter()
        .enumerate()
        .map(|(k, (row, cost, error))| PlotPoint {
            line: Axis::ALL.iter().position(|a| *a == row.axis).unwrap_or(0),
            label: match row.is_own {
                true if first_own == Some(k) => "own".to_owned(),
                true => String::new(),
                false => row.label.clone(),
            },
            cost: *cost,
            error: *error,
            is_front: front.contains(&k),
        })
        .collect();
    error_over_cost(&names, &points, scale)
}

/// Whether a folder holds the JSON of a finished study; other programs may write a file of this name too.
pub(super) fn is_written_in(out: &Path) -> bool {
    let text = std::fs::read(out.join("accuracy.json")).unwrap_or_default();
    serde_json::from_slice::<serde_json::Value>(&text).is_ok_and(|value| {
        ["sentence", "reference", "rows"]
            .iter()
            .all(|key| value.get(key).is_some())
    })
}

fn to_json(study: &Study) -> String {
    let rows: Vec<_> = study
        .rows
        .iter()
        .map(|row| {
            let mut value = json!({
                "axis": row.axis.name(),
                "setting": row.label,
                "own": row.is_own,
                "increment_m": row.increment,
            });
            match &row.outcome {
                Ok((m, e)) => {
                    value["status"] = json!("ok");
                    value["step_us"] = json!(m.step);
                    value["shape_us"] = json!(m.shape);
                    value["prepare_s"] = json!(m.prepare_s);
                    value["bytes"] = json!(m.bytes);
                    value["errors"] = json!(e);
                    value["repeats"] = json!(m.repeats);
                    value["penetration_m"] = json!(m.penetration);
                    value["certificate"] = json!(m.certificate);
                }
                Err(why) => value["status"] = json!(format!("not run: {why}")),
            }
            value
        })
        .collect();
    let mut text = serde_json::to_string_pretty(&json!({
        "title": study.title,
        "sentence": study.sentence(),
        "made": study.origin.made,
        "input_hash": study.origin.hash(),
        "machine": study.machine,
        "law": study.law,
        "load": study.load,
        "busy": study.busy(),
        "gpu": study.adapter,
        "reference": {
            "made": study.reference.made,
            "bar": study.reference.bar,
            "bar_made": study.reference.bar_made,
            "peak_force_N": study.peak.0,
            "travel_at_peak_m": study.peak.1,
            "snaps": study.is_snap,
        },
        "rows": rows,
    }))
    .unwrap_or_default();
    text.push('\n');
    text
}

/// `energy`: the column of energy or work.
fn head_of_table(energy: &str) -> String {
    format!(
        "<tr><th>setting</th><th>step, 50 % (µs)</th><th>step, 99.9 % (µs)</th>\
         <th>shape (µs)</th><th>preparing</th><th>memory</th><th>wrench</th><th>solver</th><th>peak</th>\
         <th>shift of the peak (mm)</th><th>shape</th><th>{energy}</th><th>depth (µm)</th></tr>"
    )
}

fn how_to_read(study: &Study) -> String {
    let energy = match study.law.has_friction {
        false => "<b>energy</b>: in the energy norm at the reference's highest energy.",
        true => {
            "<b>work</b>: put in on the way to where the reference's is largest, which is what it takes to push the body \
             over; with friction no energy is least at the solution, and its difference measures nothing."
        }
    };
    let solver = match study.law.has_friction {
        false => "same mesh.",
        true => {
            "same mesh in increments of a sixteenth of the scene's own. With friction all settings are compared at the \
             places that the largest increments come to; larger ones than the scene's own may pass over the peak, so that \
             theirs is a dash."
        }
    };
    format!(
        "<ul>\
         <li><b>wrench</b>: distance of force and torque from the reference along the whole path, root of the \
         mean square, as a share of the reference's. <b>solver</b>: the same against the exact solution on the \
         {solver} <b>peak</b>: of the force at which it snaps (the largest peak that is passed, not what \
         it meets at the end), with its sign; of the largest force where nothing snaps; a dash where only one of setting \
         and reference snaps. \
         <b>shape</b>: of the drawn displacement where the part can touch; a dash where the mesh has other \
         nodes. {energy} <b>depth</b>: how deep \
         a node, or a point on an edge between nodes, is inside the tool at most.</li>\
         <li>Errors below the reference's own are no differences.</li>\
         <li><b>not timed</b>: no step with contact was timed, so nothing is said of its time.</li>\
         <li>Only steps with contact are counted, the whole step without the drawn shape, which a session \
         makes 60 times a second. No slow step is left out.</li>\
         <li>The orange band is the front: settings that no other beats in both time and error.</li></ul>"
    )
}

fn page(study: &Study, plots: [&String; 4], curves: &str) -> String {
    let mut page = String::new();
    head::open(
        &mut page,
        &format!("{}: what accuracy costs in time", study.title),
        "accuracy and time",
        &study.scene_path,
        &study.origin,
    );
    let _ = writeln!(
        page,
        "<p class=\"headline\">{}</p>",
        escaped(&study.sentence())
    );
    let _ = writeln!(
        page,
        "<p>Reference: {}; {} (travel of the held body). Its own error is {}: {}. The scene's own settings: \
         {}.</p><p>Law of contact: {}.</p>",
        escaped(&study.reference.made),
        study.peak_words(),
        study.reference.bar.map_or("unknown".to_owned(), percent),
        escaped(&study.reference.bar_made),
        escaped(&study.own),
        escaped(&study.law.words),
    );
    if let Some(busy) = study.busy() {
        let _ = writeln!(page, "<p class=\"warning\">{}</p>", escaped(&busy));
    }
    figures(&mut page, study, plots, curves);
    let _ = writeln!(page, "<h2>Tables</h2>");
    tables(&mut page, study);
    remarks(&mut page, study);
    let _ = writeln!(page, "<h2>How to read this</h2>{}", how_to_read(study));
    head::close(&mut page, &study.machine);
    page
}

fn figures(page: &mut String, study: &Study, plots: [&String; 4], curves: &str) {
    let untimed: Vec<String> = study
        .distinct()
        .iter()
        .filter(|(_, m, _)| m.step.is_none())
        .map(|(row, ..)| name(row))
        .collect();
    let mut figure = |title: &str, svg: &str, caption: &str| {
        if !title.is_empty() {
            let _ = writeln!(page, "<h2>{title}</h2>");
        }
        let _ = writeln!(
            page,
            "<figure class=\"plot\"><div class=\"scroll wordy\">{svg}</div><figcaption>{}</figcaption></figure>",
            escaped(caption)
        );
    };
    let not_shown = if untimed.is_empty() {
        String::new()
    } else {
        format!(" Not timed, so not shown: {}.", untimed.join(", "))
    };
    figure(
        "Error against time",
        plots[0],
        &format!(
            "One line for each choice; each point is the scene's own setting with that one changed.{not_shown}"
        ),
    );
    let (adds, bottom) = match study.law.has_friction {
        false => (
            "passes, tolerances and the p-method add",
            " Points at the bottom are round-off.",
        ),
        true => ("increments, passes, tolerances and the p-method add", ""),
    };
    figure(
        "What the solver adds",
        plots[3],
        &format!(
            "The same times, but errors against the exact solution on the same mesh at the same order: what {adds} to the \
             error of the mesh.{bottom}"
        ),
    );
    figure("The curves behind it", curves, &curves_caption(study));
    figure(
        "Error against memory and preparing",
        plots[1],
        "Compliance that the step and the drawn shape read.",
    );
    figure(
        "",
        plots[2],
        "Preparing the part once; it is cached after that.",
    );
}

fn tables(page: &mut String, study: &Study) {
    let head = head_of_table(study.law.energy());
    for axis in Axis::ALL {
        let rows: Vec<&Row> = study.rows.iter().filter(|r| r.axis == axis).collect();
        if rows.is_empty() {
            continue;
        }
        let _ = writeln!(
            page,
            "<h3>{}</h3><div class=\"scroll\"><table class=\"numbers\">{head}",
            escaped(axis.title())
        );
        for row in rows {
            let label = if row.is_own {
                format!("<b>{}</b> (own)", escaped(&row.label))
            } else {
                escaped(&row.label)
            };
            match &row.outcome {
                Ok((measured, errors)) => {
                    let line: String = table_cells(study, measured, errors);
                    let _ = writeln!(page, "<tr><td>{label}</td>{line}</tr>");
                }
                Err(why) => {
                    let why = escaped(why);
                    let _ = writeln!(
                        page,
                        "<tr><td>{label}</td><td colspan=\"12\">not run: {why}</td></tr>"
                    );
                }
            }
        }
        page.push_str("</table></div>\n");
    }
}

/// What is not there, and where the own setting's time goes.
fn remarks(page: &mut String, study: &Study) {
    let _ = writeln!(page, "<ul>");
    for (what, why) in &study.not_there {
        let _ = writeln!(
            page,
            "<li>{}: no choice, {}.</li>",
            escaped(what),
            escaped(why)
        );
    }
    if let Some(adapter) = &study.adapter {
        let _ = writeln!(page, "<li>The GPU: {}.</li>", escaped(adapter));
    }
    let stages = study.distinct();
    let is_own =
        |(row, measured, _): &&(&Row, &Measured, &Errors)| row.is_own && measured.step.is_some();
    if let Some((row, measured, _)) = stages.iter().find(is_own) {
        let list: Vec<String> = crate::engine::Stage::ALL
            .iter()
            .zip(&measured.stages)
            .filter_map(|(stage, times)| Some((stage, (*times)?)))
            .map(|(stage, t)| format!("{} {} and {}", stage.name(), short(t.p50), short(t.p999)))
            .collect();
        let _ = writeln!(
            page,
            "<li>Stages of {} (µs, 50 % and 99.9 %, {} steps): {}; of the others in accuracy.csv.</li>",
            escaped(&name(row)),
            measured.n_timed,
            list.join(", ")
        );
    }
    let _ = writeln!(page, "</ul>");
}

fn curves_caption(study: &Study) -> String {
    let mut caption = "Force over the travel at other orders and meshes.".to_owned();
    for (label, peak) in &study.off_scale {
        let _ = write!(
            caption,
            " Not shown: {label}, which reaches {} N.",
            short(*peak)
        );
    }
    caption
}

/// Cells of a line; the error of the wrench grey where it is below the reference's own.
fn table_cells(study: &Study, measured: &Measured, errors: &Errors) -> String {
    let is_below = study
        .reference
        .bar
        .is_some_and(|bar| errors.wrench_l2 < bar);
    cells(measured, errors)
        .iter()
        .enumerate()
        .map(|(k, cell)| {
            let grey = if k == 5 && is_below {
                " class=\"soft\""
            } else {
                ""
            };
            format!("<td{grey}>{}</td>", escaped(cell))
        })
        .collect()
}
