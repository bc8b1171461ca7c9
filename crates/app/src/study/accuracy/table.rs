//! The study as text and CSV.

use std::fmt::Write as _;

use super::compare::pareto_front;
use super::{Axis, Errors, Measured, Row, Study, Times};
use crate::engine::Stage;
use crate::prepare::budget::{bytes, duration};
use crate::report::plot::short;

/// Times the least error: what is within it is as accurate.
const SAME_ERROR: f64 = 1.001;

type Line<'a> = (&'a Row, &'a Measured, &'a Errors);

/// The most accurate one; of those that are as accurate, the fastest.
fn best_of<'a>(among: &[&Line<'a>]) -> Option<Line<'a>> {
    let errors = among.iter().map(|(.., e)| e.wrench_l2);
    let most = SAME_ERROR * errors.fold(f64::INFINITY, f64::min) + 1e-6;
    let p50 = |m: &Measured| m.step.map_or(f64::INFINITY, |t| t.p50);
    let same = among.iter().filter(|(.., e)| e.wrench_l2 <= most);
    same.min_by(|a, b| p50(a.1).total_cmp(&p50(b.1)))
        .map(|line| **line)
}

/// µs: the period of a haptic loop.
pub(super) const PERIOD_US: f64 = 1000.0;

impl Row {
    /// Whether its error has its price in the costs that are plotted: smaller increments are more steps of the same cost.
    pub(super) fn can_be_on_front(&self) -> bool {
        self.is_own || self.axis != Axis::Increments
    }
}

impl Study {
    /// The settings that ran, each once.
    pub(super) fn distinct(&self) -> Vec<(&Row, &Measured, &Errors)> {
        let mut all: Vec<(&Row, &Measured, &Errors)> = Vec::new();
        for row in &self.rows {
            if let Ok((measured, errors)) = &row.outcome
                && !(row.is_own && all.iter().any(|(other, ..)| other.is_own))
            {
                all.push((row, measured, errors));
            }
        }
        all
    }

    /// One sentence: the best setting under 1 ms, and what it gives up.
    pub fn sentence(&self) -> String {
        let mut all = self.distinct();
        all.retain(|(row, ..)| row.is_own || row.axis.is_choice_of_step());
        // What was not timed can be said nothing of.
        all.retain(|(_, m, _)| m.step.is_some());
        if all.is_empty() {
            return self.nothing_timed();
        }
        let fits = |m: &Measured| p999(m) < PERIOD_US;
        let (fitting, others): (Vec<_>, Vec<_>) = all.iter().partition(|(_, m, _)| fits(m));
        let best = best_of(&fitting);
        let Some((row, measured, errors)) = best else {
            let fastest = all.iter().min_by(|a, b| p999(a.1).total_cmp(&p999(b.1)));
            return fastest.map_or("No setting could be run.".to_owned(), |(row, m, _)| {
                format!(
                    "No setting keeps 99.9 % of its steps under 1 ms here; {} comes nearest with {} µs, half of its \
                     steps take less than {} µs.",
                    name(row),
                    short(p999(m)),
                    short(m.step.map_or(0.0, |t| t.p50))
                )
            });
        };
        let better: Vec<_> = others
            .into_iter()
            .filter(|(.., e)| e.wrench_l2 < errors.wrench_l2)
            .collect();
        let better = best_of(&better);
        let gives_up = match better {
            Some((other, m, e)) if e.wrench_l2 == 0.0 => format!(
                "; {}, the reference itself, needs {} µs",
                name(other),
                short(p999(m))
            ),
            Some((other, m, e)) => format!(
                "; {} would be within {} but needs {} µs",
                name(other),
                percent(e.wrench_l2),
                short(p999(m))
            ),
            None => "; nothing that was measured is more accurate".to_owned(),
        };
        let at_peak = match errors.peak {
            Some(peak) if self.is_snap => format!(", {} at the snap", percent(peak.abs())),
            Some(peak) => format!(", {} of the largest force", percent(peak.abs())),
            None if self.is_snap => ", and does not snap where the reference does".to_owned(),
            None => ", and snaps where the reference does not".to_owned(),
        };
        let bar = match self.reference.bar {
            Some(bar) if errors.wrench_l2 == 0.0 => format!(
                " because it is the reference, which is known to {}",
                percent(bar)
            ),
            Some(bar) if errors.wrench_l2 <= bar => format!(
                ", no more than the {} by which the reference itself may be wrong",
                percent(bar)
            ),
            Some(bar) => format!(" (itself known to {})", percent(bar)),
            None => String::new(),
        };
        format!(
            "Under 1 ms the best setting here is {}: 99.9 % of its steps take less than {} µs, and it gives \
             up {} of the force along the path against the reference{bar}{at_peak}{gives_up}.",
            name(row),
            short(p999(measured)),
            percent(errors.wrench_l2),
        )
    }

    /// Why there are no times.
    fn nothing_timed(&self) -> String {
        match self.distinct().first() {
            None => match self.not_there.first() {
                Some((what, why)) if self.rows.is_empty() => {
                    format!("Nothing is compared: {what} is no choice here, {why}.")
                }
                _ => "No setting could be run.".to_owned(),
            },
            Some(_) => "No setting was timed, because no step of the path has contact: let the tool reach the part."
                .to_owned(),
        }
    }

    /// What the peak of the tables is.
    pub(super) fn peak_words(&self) -> String {
        let (force, travel) = (short(self.peak.0), short(1e3 * self.peak.1));
        if self.is_snap {
            format!("it snaps at {force} N and {travel} mm")
        } else if self.peak.0 <= 0.0 {
            "nothing resists on this path".to_owned()
        } else {
            format!("it does not snap on this path; its largest force is {force} N at {travel} mm")
        }
    }
}

/// µs; infinite if no step was timed.
pub(super) fn p999(measured: &Measured) -> f64 {
    measured.step.map_or(f64::INFINITY, |times| times.p999)
}

/// In a cell of a time that is not there.
const NOT_TIMED: &str = "not timed";

fn time(times: Option<Times>, of: impl Fn(Times) -> f64) -> String {
    times.map_or(NOT_TIMED.to_owned(), |times| short(of(times)))
}

/// A setting in words.
pub(super) fn name(row: &Row) -> String {
    if row.is_own {
        "the scene's own".to_owned()
    } else {
        format!("{} {}", row.axis.name(), row.label)
            .replace("order order", "order")
            .replace("planes planes", "planes")
    }
}

pub(super) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    if value != 0.0 && value.abs() < 1e-3 {
        return format!("{value:.0e} %");
    }
    format!("{} %", short(value))
}

fn columns(study: &Study) -> [&'static str; 12] {
    let energy = study.law.energy();
    [
        "p50 us", "p99.9 us", "shape us", "prepare", "memory", "wrench", "solver", "peak",
        "shift mm", "shape", energy, "depth um",
    ]
}

/// Cells of a line: times, costs, errors.
pub(super) fn cells(measured: &Measured, errors: &Errors) -> [String; 12] {
    [
        time(measured.step, |t| t.p50),
        time(measured.step, |t| t.p999),
        time(measured.shape, |t| t.p50),
        duration(measured.prepare_s),
        bytes(measured.bytes),
        percent(errors.wrench_l2),
        percent(errors.solver_l2),
        errors.peak.map_or("-".to_owned(), percent),
        errors
            .peak_travel
            .map_or("-".to_owned(), |shift| short(1e3 * shift)),
        errors.displacement.map_or("-".to_owned(), percent),
        errors
            .energy
            .or(errors.work)
            .map_or("-".to_owned(), percent),
        match 1e6 * measured.penetration {
            depth if depth < 1e-3 => "below 1e-3".to_owned(),
            depth => short(depth),
        },
    ]
}

/// The tables for a terminal.
pub fn text(study: &Study) -> String {
    let mut out = format!("{}\n{}\n", study.title, study.machine);
    let _ = writeln!(out, "own settings: {}", study.own);
    let _ = writeln!(out, "law of contact: {}", study.law.words);
    let _ = writeln!(out, "reference: {}", study.reference.made);
    let _ = writeln!(
        out,
        "its own error: {} ({})",
        study.reference.bar.map_or("-".to_owned(), percent),
        study.reference.bar_made
    );
    let _ = writeln!(out, "its peak: {}", study.peak_words());
    if let Some(busy) = study.busy() {
        let _ = writeln!(out, "warning: {busy}");
    }
    out.push('\n');
    let _ = write!(out, "{:<34}", "");
    for column in columns(study) {
        let _ = write!(out, "{column:>11}");
    }
    out.push('\n');
    for axis in Axis::ALL {
        let rows: Vec<&Row> = study.rows.iter().filter(|r| r.axis == axis).collect();
        if rows.is_empty() {
            continue;
        }
        let _ = writeln!(out, "{}", axis.title());
        for row in rows {
            let mark = if row.is_own { "*" } else { "" };
            let _ = write!(out, "  {:<32}", format!("{}{mark}", row.label));
            match &row.outcome {
                Ok((measured, errors)) => {
                    for cell in cells(measured, errors) {
                        let _ = write!(out, "{cell:>11}");
                    }
                }
                Err(why) => {
                    let _ = write!(out, "not run: {why}");
                }
            }
            out.push('\n');
        }
    }
    for (what, why) in &study.not_there {
        let _ = writeln!(out, "{what}: no choice, {why}");
    }
    if let Some(adapter) = &study.adapter {
        let _ = writeln!(out, "the GPU: {adapter}");
    }
    let _ = writeln!(out, "* the scene's own setting\n\n{}", study.sentence());
    out
}

/// `accuracy.csv`: a line for each point, SI but for times.
pub(super) fn csv(study: &Study) -> String {
    let mut out = "axis,setting,own,status,nodes,elements,order,free_nodes,contacts,timed_steps,\
        step_p50_us,step_p99_us,step_p999_us,step_max_us,shape_p50_us,shape_p999_us"
        .to_owned();
    for stage in Stage::ALL {
        let name = stage.name();
        let _ = write!(out, ",{name}_p50_us,{name}_p999_us");
    }
    out.push_str(
        ",prepare_s,bytes,wrench_l2_rel,solver_l2_rel,wrench_max_rel,peak_rel,peak_travel_m,displacement_rel,\
         energy_rel,work_rel,penetration_m,certificate,steps_not_converged,front,repeat_over_shortest,disturbed_share,\
         increment_m\n",
    );
    let mut all = study.distinct();
    all.retain(|(row, ..)| row.can_be_on_front());
    let costs: Vec<(f64, f64)> = all.iter().map(|(_, m, e)| (p999(m), e.wrench_l2)).collect();
    let is_timed = |k: &usize| all[*k].1.step.is_some();
    let front = pareto_front(&costs).into_iter().filter(is_timed);
    let front: Vec<&Row> = front.map(|k| all[k].0).collect();
    for row in &study.rows {
        let _ = write!(
            out,
            "{},{},{}",
            row.axis.name(),
            quoted(&row.label),
            row.is_own
        );
        match &row.outcome {
            Err(why) => {
                let _ = writeln!(out, ",{}", quoted(&format!("not run: {why}")));
            }
            Ok((m, e)) => {
                let _ = write!(
                    out,
                    ",ok,{},{},{},{},{},{}",
                    m.nodes, m.elements, m.order, m.free_nodes, m.contacts, m.n_timed,
                );
                let optional = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
                let mut times = |times: Option<Times>, of: &[fn(Times) -> f64]| {
                    for of in of {
                        let _ = write!(out, ",{}", optional(times.map(of)));
                    }
                };
                times(m.step, &[|t| t.p50, |t| t.p99, |t| t.p999, |t| t.max]);
                times(m.shape, &[|t| t.p50, |t| t.p999]);
                for stage in &m.stages {
                    times(*stage, &[|t| t.p50, |t| t.p999]);
                }
                let is_front = front.iter().any(|r| std::ptr::eq(*r, row));
                let _ = writeln!(
                    out,
                    ",{},{},{},{},{},{},{},{},{},{},{},{},{},{is_front},{},{},{}",
                    m.prepare_s,
                    m.bytes,
                    e.wrench_l2,
                    e.solver_l2,
                    e.wrench_max,
                    optional(e.peak),
                    optional(e.peak_travel),
                    optional(e.displacement),
                    optional(e.energy),
                    optional(e.work),
                    m.penetration,
                    m.certificate,
                    m.not_converged,
                    optional(m.repeats.map(|r| r.typical)),
                    optional(m.repeats.map(|r| r.disturbed)),
                    row.increment,
                );
            }
        }
    }
    out
}

/// A field that may hold commas.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\"").replace('\n', " "))
    } else {
        text.to_owned()
    }
}
