//! `report.html`: one page that tells the run to someone who was not there. No script, nothing
//! loaded from elsewhere: the file can be mailed.

mod style;
mod text;

use std::fmt::Write as _;

pub(crate) use self::style::STYLE;
pub(crate) use self::text::escaped;
use self::text::push_base64;
use super::curve::Curve;
use super::data::{Effect, Handbook, PaperStage, Run};
use super::plot::short;
use super::render::Quantity;
use super::strain::{self, StrainFacts, StrainPeak};
use super::summary::{Percentiles, max_certificate, max_wrench_mismatch, stage_percentiles};

/// Plots and pictures that go into the page.
#[derive(Clone, Debug, Default)]
pub struct Drawings {
    /// Force over travel, SVG.
    pub force_svg: String,
    /// Time of the stages, SVG.
    pub time_svg: String,
    /// Pictures in the order in which they are shown.
    pub pictures: Vec<Picture>,
}

/// A picture of a frame.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Position of the frame in the run.
    pub frame: usize,
    /// What its colours show.
    pub quantity: Quantity,
    /// The file's bytes.
    pub png: Vec<u8>,
}

/// The text of `report.html`.
pub fn page(run: &Run, curve: &Curve, drawings: &Drawings) -> String {
    let mut page = String::new();
    let title = escaped(&run.title);
    page.push_str("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n");
    page.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    let _ = writeln!(page, "<title>{title}: snap-fit report</title>");
    let _ = writeln!(page, "<style>{}</style></head><body><main>", STYLE);
    let _ = writeln!(page, "<h1>{title}</h1>");
    let _ = writeln!(page, "<p class=\"where\">{}</p>", escaped(&run.scene_path));
    let _ = writeln!(
        page,
        "<p class=\"headline\">{}</p>",
        escaped(&headline(curve))
    );
    for warning in &run.warnings {
        let _ = writeln!(page, "<p class=\"warning\">{}</p>", escaped(warning));
    }
    cards(&mut page, run, curve);

    section(&mut page, "Force over travel");
    figure(&mut page, &drawings.force_svg, FORCE_CAPTION);
    if let Some(handbook) = &run.handbook {
        section(&mut page, "Beside the handbook");
        handbook_table(&mut page, handbook);
    }
    section(&mut page, "Strain");
    strain_table(&mut page, &run.strain);
    if !drawings.pictures.is_empty() {
        section(&mut page, "Pictures");
        pictures(&mut page, run, &drawings.pictures);
    }
    section(&mut page, "Key numbers");
    key_numbers(&mut page, run, curve);
    section(&mut page, "Physical effects");
    effects_table(&mut page, &run.effects);
    section(&mut page, "Time of a step");
    timing(&mut page, run, &drawings.time_svg);
    section(&mut page, "Settings and checks");
    labelled(&mut page, &run.settings);
    if !run.checks.is_empty() {
        labelled(&mut page, &run.checks);
    }
    if !run.notes.is_empty() {
        section(&mut page, "Notes");
        let items = run
            .notes
            .iter()
            .map(|note| format!("<li>{}</li>", escaped(note)));
        let _ = writeln!(page, "<ul>{}</ul>", items.collect::<String>());
    }
    section(&mut page, "How to read this");
    page.push_str(HOW_TO_READ);
    let _ = writeln!(
        page,
        "<footer>Written by snapin {} on {}.</footer></main></body></html>",
        env!("CARGO_PKG_VERSION"),
        escaped(&run.machine)
    );
    page
}

/// The result in two sentences, plain text.
pub fn headline(curve: &Curve) -> String {
    if curve.peak_row_idx.is_none() {
        return "Nothing resisted the hand: the tool did not touch the part, or pushed it nowhere."
            .to_owned();
    }
    let peak = format!(
        "The force peaks at {} N after {} mm",
        short(curve.peak_force_n),
        short(curve.travel_at_peak_m * 1e3)
    );
    let drop = match curve.snap_travel_m {
        Some(travel) => format!(
            " and drops by {} N: the part snaps home, {} mm after the peak.",
            short(curve.snap_drop_n),
            short(travel * 1e3)
        ),
        None if curve.snap_drop_n > 0.02 * curve.peak_force_n => format!(
            " and drops by {} N, but never to zero: the part does not snap home within this travel.",
            short(curve.snap_drop_n)
        ),
        None => " and does not drop: the part does not snap home within this travel.".to_owned(),
    };
    let work = format!(
        " Pushing it over takes {} mJ.",
        short(curve.insertion_work_j * 1e3)
    );
    let pull = match curve.retention_force_n {
        Some(pull) => format!(" Pulling out again takes {} N.", short(pull)),
        None => String::new(),
    };
    peak + &drop + &work + &pull
}

const FORCE_CAPTION: &str = "Force that the hand feels against how far the tool has moved. Above zero \
    the part resists; below zero it pulls the tool in.";

const HOW_TO_READ: &str = "<ul>\
<li><b>Peak</b> is the largest force while pushing in; <b>snap drop</b> is how far the force falls \
after it. A drop larger than the peak means that the part pulls the tool in. People tell two \
forces apart when they differ by 7 to 10 %.</li>\
<li><b>Snap travel</b> is the way from the peak to the point where the force is gone. The shorter \
it is, the crisper the snap.</li>\
<li>The hand feels the part through a spring, the <b>virtual coupling</b>. A soft coupling rounds \
the peak and stretches the drop, as a soft grip does.</li>\
<li><b>Certificate</b> is the largest violation of the contact conditions in any step: no contact \
pulls, no node is inside the tool, no force without touch; scaled so that 1 is as large as the \
forces and gaps themselves. <b>Imbalance</b> is by how much the force of the contacts on the tool \
differs from that of the coupling, as a share of it.</li>\
<li><b>Strain</b> tells whether the material stays elastic: compare with its permissible strain, and mind the bar, \
which is the mesh's error. \
<b>Rotation</b> tells whether small displacements are a fair assumption: see the effect \
<i>large_rotation</i>.</li>\
<li>In the pictures the shape is to scale. Colours reach from zero to the top of the scale, the same \
in every picture of this run. Stress at contact points and clamped edges depends on the fineness of \
the mesh: read it away from them.</li>\
<li><b>p99</b> is the time that 99 % of the steps did not exceed. A hand notices the slow ones, so \
the mean is not shown.</li>\
</ul>\n";

fn section(page: &mut String, title: &str) {
    let _ = writeln!(page, "<h2>{}</h2>", escaped(title));
}

fn figure(page: &mut String, svg: &str, caption: &str) {
    let _ = writeln!(
        page,
        "<figure>{svg}<figcaption>{}</figcaption></figure>",
        escaped(caption)
    );
}

fn cards(page: &mut String, run: &Run, curve: &Curve) {
    let snaps = if curve.snaps_home() { "yes" } else { "no" };
    let pull = curve
        .retention_force_n
        .map_or("not pulled".into(), |f| format!("{} N", short(f)));
    page.push_str("<div class=\"cards\">");
    for (value, label) in [
        (
            format!("{} N", short(curve.peak_force_n)),
            "peak insertion force",
        ),
        (
            format!("{} mm", short(curve.travel_at_peak_m * 1e3)),
            "travel at the peak",
        ),
        (format!("{} N", short(curve.snap_drop_n)), "snap drop"),
        (snaps.to_owned(), "snaps home"),
        (pull, "retention force"),
        (
            run.strain
                .governing()
                .map_or("none".into(), StrainPeak::percent),
            "largest strain",
        ),
        (
            run.strain.safety_once().map_or("not given".into(), short),
            "permissible over largest strain",
        ),
    ] {
        let _ = write!(
            page,
            "<div class=\"card\"><b>{}</b><span>{label}</span></div>",
            escaped(&value)
        );
    }
    page.push_str("</div>\n");
}

fn handbook_table(page: &mut String, handbook: &Handbook) {
    let _ = writeln!(page, "<p>{}</p>", escaped(&handbook.name));
    let rows = handbook.rows.iter().map(|row| {
        let difference = if row.handbook == 0.0 {
            String::new()
        } else {
            format!("{:+.1} %", 100.0 * (row.computed / row.handbook - 1.0))
        };
        let numbers = [short(row.handbook), short(row.computed), difference];
        (row.label.clone(), numbers.to_vec(), row.unit.clone())
    });
    let rows: Vec<Vec<String>> = rows
        .map(|(label, numbers, unit)| {
            let mut cells = vec![if unit.is_empty() {
                label
            } else {
                format!("{label} ({unit})")
            }];
            cells.extend(numbers);
            cells
        })
        .collect();
    table(
        page,
        &["", "handbook", "computed", "difference"],
        &rows,
        &[],
        false,
    );
}

fn strain_table(page: &mut String, strain: &StrainFacts) {
    let _ = writeln!(page, "<p>{}</p>", escaped(&strain.words()));
    if !strain.peaks.is_empty() {
        table(page, &strain::TABLE_HEADINGS, &strain.table(), &[], true);
        let _ = writeln!(page, "<p>{}</p>", escaped(strain::CAPTION));
    }
}

fn pictures(page: &mut String, run: &Run, pictures: &[Picture]) {
    page.push_str("<div class=\"pictures\">");
    for picture in pictures {
        let Some(frame) = run.frames.get(picture.frame) else {
            continue;
        };
        let quantity = picture.quantity.name();
        let caption = escaped(&format!(
            "{}: {quantity} at {} mm travel, {} N",
            frame.label,
            short(frame.travel_m * 1e3),
            short(frame.force_n)
        ));
        let _ = write!(
            page,
            "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,"
        );
        push_base64(page, &picture.png);
        let _ = writeln!(page, "\"><figcaption>{caption}</figcaption></figure>");
    }
    page.push_str("</div>\n");
}

fn key_numbers(page: &mut String, run: &Run, curve: &Curve) {
    let facts = &run.facts;
    let millimetres = |m: f64| format!("{} mm", short(m * 1e3));
    let newtons = |n: f64| format!("{} N", short(n));
    let order = match facts.order {
        1 => "linear".to_owned(),
        2 => "quadratic".to_owned(),
        3 => "cubic".to_owned(),
        n => format!("order {n}"),
    };
    let source = if facts.from_cache {
        " (read from the cache)"
    } else {
        ""
    };
    let contacts = run.rows.iter().map(|row| row.contacts).max().unwrap_or(0);
    let rows = [
        ("peak insertion force", newtons(curve.peak_force_n)),
        ("travel at the peak", millimetres(curve.travel_at_peak_m)),
        ("snap drop", newtons(curve.snap_drop_n)),
        (
            "snap travel",
            curve
                .snap_travel_m
                .map_or("does not snap".into(), millimetres),
        ),
        (
            "insertion work",
            format!("{} mJ", short(curve.insertion_work_j * 1e3)),
        ),
        (
            "net work of the whole insertion",
            format!("{} mJ", short(curve.net_work_j * 1e3)),
        ),
        (
            "retention force",
            curve
                .retention_force_n
                .map_or("not pulled out".into(), newtons),
        ),
        (
            "largest principal strain",
            run.strain
                .governing()
                .map_or("none".into(), StrainPeak::percent),
        ),
        (
            "safety against permissible strain",
            run.strain.safety_words(),
        ),
        (
            "largest rotation",
            format!("{}\u{b0}", short(facts.max_rotation_deg)),
        ),
        (
            "coupling stiffness",
            facts
                .coupling_stiffness
                .map_or("none: the tool's pose is imposed".into(), |k| {
                    format!("{} N/mm", short(k / 1e3))
                }),
        ),
        (
            "mesh",
            format!("{} nodes, {} {order} elements", facts.nodes, facts.elements),
        ),
        (
            "surface nodes",
            format!(
                "{}, of which {} may touch",
                facts.surface_nodes, facts.candidates
            ),
        ),
        ("most contacts at once", contacts.to_string()),
        ("steps", run.rows.len().to_string()),
        ("missed deadlines", facts.missed_deadlines.to_string()),
        (
            "worst certificate",
            format!("{:.1e}", max_certificate(&run.rows)),
        ),
        (
            "worst imbalance of contact and coupling",
            format!("{:.1e}", max_wrench_mismatch(&run.rows)),
        ),
        (
            "preparation",
            format!("{} s{source}", short(facts.prepare_s)),
        ),
    ];
    let rows: Vec<_> = rows.into_iter().map(|(l, v)| (l.to_owned(), v)).collect();
    labelled(page, &rows);
}

fn effects_table(page: &mut String, effects: &[Effect]) {
    let rows: Vec<Vec<String>> = effects
        .iter()
        .map(|effect| {
            vec![
                effect.name.clone(),
                if effect.on { "on" } else { "off" }.to_owned(),
                effect.number.map_or("not estimated".into(), short),
                short(effect.threshold),
                effect.why.clone(),
            ]
        })
        .collect();
    page.push_str(
        "<p>An effect matters from its threshold on. What is off is not simulated and costs \
         nothing.</p>\n",
    );
    let loud: Vec<usize> = effects
        .iter()
        .enumerate()
        .filter(|(_, e)| !e.on && e.number.is_some_and(|n| n >= e.threshold))
        .map(|(idx, _)| idx)
        .collect();
    table(
        page,
        &["effect", "", "number", "threshold", "why"],
        &rows,
        &loud,
        true,
    );
}

fn timing(page: &mut String, run: &Run, svg: &str) {
    let stages = stage_percentiles(&run.rows);
    let rows: Vec<Vec<String>> = stages
        .iter()
        .map(|(name, times)| {
            let Percentiles {
                p50,
                p99,
                p999,
                max,
            } = *times;
            let mut cells = vec![(*name).to_owned()];
            cells.extend([p50, p99, p999, max].map(short));
            cells
        })
        .collect();
    let total = stages.iter().position(|(name, _)| *name == "total");
    page.push_str("<p>Microseconds of the wall clock per step, on the machine named below.</p>\n");
    table(
        page,
        &["stage", "p50", "p99", "p99.9", "max"],
        &rows,
        total.as_slice(),
        false,
    );
    if !run.paper.is_empty() {
        page.push_str(
            "<p>Beside the method's first publication (Duriez, Andriot and Kheddar 2004; Pentium 4, \
             2.4 GHz). Machine, mesh and code differ: the factor shows where the two stand, not \
             which code is better.</p>\n",
        );
        table(
            page,
            &["stage", "2004 (ms)", "here (µs)", "factor"],
            &paper_rows(&run.paper),
            &[run.paper.len()],
            false,
        );
    }
    figure(
        page,
        svg,
        "Time that the given share of the steps did not exceed. Logarithmic both ways.",
    );
}

/// The stages, and their sum where all of them were timed.
fn paper_rows(paper: &[PaperStage]) -> Vec<Vec<String>> {
    let sum = PaperStage {
        stage: "together".into(),
        paper_ms: paper.iter().map(|row| row.paper_ms).sum(),
        ours_us: paper.iter().map(|row| row.ours_us).sum(),
    };
    let is_whole = paper.iter().all(|row| row.ours_us > 0.0);
    paper
        .iter()
        .chain(is_whole.then_some(&sum))
        .map(|row| {
            let factor = row.paper_ms * 1e3 / row.ours_us;
            let factor = if factor.is_finite() {
                format!("{}x", short(factor))
            } else {
                String::new()
            };
            vec![
                row.stage.clone(),
                short(row.paper_ms),
                short(row.ours_us),
                factor,
            ]
        })
        .collect()
}

/// A table whose first column is text and whose others are numbers; `has_prose`: the last and the
/// second are text as well. `bold`: rows to be stressed.
fn table(page: &mut String, head: &[&str], rows: &[Vec<String>], bold: &[usize], has_prose: bool) {
    let class = |column: usize| {
        let is_text = column == 0 || (has_prose && (column == 1 || column + 1 == head.len()));
        if is_text { "" } else { " class=\"n\"" }
    };
    page.push_str("<div class=\"scroll\"><table><thead><tr>");
    for (column, cell) in head.iter().enumerate() {
        let _ = write!(page, "<th{}>{}</th>", class(column), escaped(cell));
    }
    page.push_str("</tr></thead><tbody>");
    for (row_idx, row) in rows.iter().enumerate() {
        page.push_str(if bold.contains(&row_idx) {
            "<tr class=\"sum\">"
        } else {
            "<tr>"
        });
        for (column, cell) in row.iter().enumerate() {
            let _ = write!(page, "<td{}>{}</td>", class(column), escaped(cell));
        }
        page.push_str("</tr>");
    }
    page.push_str("</tbody></table></div>\n");
}

fn labelled(page: &mut String, rows: &[(String, String)]) {
    page.push_str("<dl>");
    for (label, value) in rows {
        let _ = write!(
            page,
            "<dt>{}</dt><dd>{}</dd>",
            escaped(label),
            escaped(value)
        );
    }
    page.push_str("</dl>\n");
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::{plot, sample};
    use super::*;

    fn sample_page() -> String {
        let run = sample::run();
        let curve = Curve::of(&run.rows);
        let drawings = Drawings {
            force_svg: plot::force_travel(&run, &curve).unwrap(),
            time_svg: plot::step_time(&run.rows).unwrap(),
            pictures: vec![Picture {
                frame: 1,
                quantity: Quantity::VonMises,
                png: b"foobar".to_vec(),
            }],
        };
        page(&run, &curve, &drawings)
    }

    #[test]
    fn the_page_tells_all() {
        let page = sample_page();
        for text in [
            "peaks at 40 N after 2 mm and drops by 50 N: the part snaps home, 0.8 mm after the peak",
            "data:image/png;base64,Zm9vYmFy",
            "insertion force (N)",
            "-4.8 %",
            "2004 (ms)",
            "<tr class=\"sum\"><td>together</td><td class=\"n\">2.71</td><td class=\"n\">61.1</td>",
            "<dt>worst imbalance of contact and coupling</dt><dd>1.0e-12</dd>",
            "p99.9",
            "symmetry of the compliance",
            "not estimated",
            "How to read this",
            "test machine, 1 core",
        ] {
            assert!(page.contains(text), "{text}");
        }
    }

    #[test]
    fn the_page_is_closed_to_the_world() {
        let page = sample_page();
        assert!(!page.contains("<script"));
        assert!(!page.contains("<link"));
        assert!(!page.contains("src=\"http"));
        // The only address is the name of the SVG language.
        for (at, _) in page.match_indices("http") {
            assert!(
                page[at..].starts_with("http://www.w3.org/2000/svg"),
                "{}",
                &page[at..at + 40]
            );
        }
    }

    #[test]
    fn what_users_write_is_escaped() {
        let page = sample_page();
        assert!(page.contains("Pipe clip &lt;C-20&gt; &amp; co"));
        assert!(!page.contains("<C-20>"));
        assert!(page.contains("by &quot;30 %&quot;"));
        let mut run = sample::run();
        let evil = "</text><script>alert(1)</script>";
        run.handbook.as_mut().unwrap().name = evil.into();
        let svg = plot::force_travel(&run, &Curve::of(&run.rows)).unwrap();
        assert!(!svg.contains("<script"));
    }

    #[test]
    fn headlines() {
        let quiet = headline(&Curve::default());
        assert!(quiet.starts_with("Nothing resisted"));
        let rising = Curve {
            peak_force_n: 12.0,
            travel_at_peak_m: 1e-3,
            peak_row_idx: Some(3),
            ..Curve::default()
        };
        assert!(headline(&rising).contains("does not drop"));
        let partly = Curve {
            snap_drop_n: 4.0,
            ..rising
        };
        assert!(headline(&partly).contains("never to zero"));
    }
}
