//! `report.html`: one page that tells the run to someone who was not there. No script, nothing
//! loaded from elsewhere: the file can be mailed. Each section is a file below; [`page`] is their
//! order.

mod blocks;
mod curve;
mod effects;
pub(crate) mod head;
mod headline;
mod numbers;
mod pictures;
mod reading;
mod settings;
mod strain;
mod style;
mod text;
mod timing;
mod warnings;

use std::fmt::Write as _;

pub use self::headline::headline;
pub use self::pictures::Picture;
pub(crate) use self::text::escaped;
use super::curve::Curve;
use super::data::Run;

/// A plot for wide and for narrow screens; the page shows the one that fits.
#[derive(Clone, Debug, Default)]
pub struct Plot {
    /// SVG for pages and paper.
    pub wide: String,
    /// SVG for phones.
    pub narrow: String,
}

/// Plots and pictures that go into the page.
#[derive(Clone, Debug, Default)]
pub struct Drawings {
    /// Force over travel.
    pub force_svg: Plot,
    /// Time of the stages.
    pub time_svg: Plot,
    /// Pictures in the order in which they are shown.
    pub pictures: Vec<Picture>,
}

/// The text of `report.html`.
pub fn page(run: &Run, curve: &Curve, drawings: &Drawings) -> String {
    let mut page = String::new();
    head::open(
        &mut page,
        &run.title,
        "snap-fit report",
        &run.scene_path,
        &run.origin,
    );
    let _ = writeln!(
        page,
        "<p class=\"headline\">{}</p>",
        escaped(&headline(run, curve))
    );
    warnings::warnings(&mut page, run);
    headline::cards(&mut page, run, curve);
    curve::curve(&mut page, run, &drawings.force_svg);
    strain::strain(&mut page, &run.strain);
    pictures::pictures(&mut page, run, &drawings.pictures);
    numbers::key_numbers(&mut page, run, curve);
    effects::effects(&mut page, &run.effects);
    if !run.rows.is_empty() {
        timing::timing(&mut page, run, &drawings.time_svg);
    }
    settings::settings(&mut page, run);
    settings::notes(&mut page, run);
    reading::how_to_read(&mut page, run);
    head::close(&mut page, &run.machine);
    page
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::render::Quantity;
    use super::super::{plot, sample};
    use super::*;

    fn sample_page() -> String {
        let run = sample::run();
        page_of(&run)
    }

    fn page_of(run: &Run) -> String {
        let curve = Curve::of(&run.rows);
        let [wide, narrow] = [plot::Format::Wide, plot::Format::Narrow].map(|format| {
            let mark = plot::force::peak(run, &curve);
            plot::force_travel(&plot::force::curves(run), mark.as_ref(), format).unwrap()
        });
        let drawings = Drawings {
            force_svg: Plot { wide, narrow },
            time_svg: Plot {
                wide: plot::step_time(&run.rows, plot::Format::Wide).unwrap(),
                narrow: plot::step_time(&run.rows, plot::Format::Narrow).unwrap(),
            },
            pictures: vec![Picture {
                frame: 1,
                quantity: Quantity::VonMises,
                file: "frames/02-peak-stress.png".into(),
                png: b"foobar".to_vec(),
            }],
        };
        page(run, &curve, &drawings)
    }

    #[test]
    fn every_table_scrolls_by_itself_and_every_picture_is_a_link_to_its_file() {
        let page = sample_page();
        let tables = page.matches("<table>").count();
        assert!(tables >= 3, "{tables}");
        assert_eq!(
            page.matches("<div class=\"scroll\"><table>").count(),
            tables
        );
        let pictures = page.matches("<img ").count();
        assert_eq!(pictures, 1);
        assert!(page.contains("<a href=\"frames/02-peak-stress.png\" title=\"full size\"><img "));
        // Each plot in both formats, scaled by its view box.
        assert_eq!(page.matches("<figure class=\"plot\">").count(), 2);
        assert_eq!(page.matches("<svg ").count(), 4);
        assert_eq!(page.matches("viewBox=").count(), 4);
    }

    #[test]
    fn the_page_tells_when_and_from_what_it_was_made() {
        let run = sample::run();
        let page = page_of(&run);
        let hash = run.origin.hash();
        assert_eq!(hash.len(), 64);
        for text in [
            "<time datetime=\"2026-11-27T08:15:30Z\">2026-11-27 08:15 UTC</time>",
            &format!("input {}<", &hash[..16]),
            &format!(
                "<dt>mesh file</dt><dd>clip.msh, BLAKE3 {}</dd>",
                "cd".repeat(32)
            ),
        ] {
            assert!(page.contains(text), "{text}");
        }
        let mut other = run;
        other.origin.inputs[1].hash[31] ^= 1;
        assert_ne!(other.origin.hash(), hash);
        other.origin = super::super::Origin::default();
        assert!(!page_of(&other).contains("<time"));
    }

    #[test]
    fn deadlines_are_told_where_a_clock_was_kept() {
        let mut run = sample::run();
        assert!(!page_of(&run).contains("missed deadlines"));
        run.facts.missed_deadlines = Some(3);
        assert!(page_of(&run).contains("<dt>missed deadlines</dt><dd>3</dd>"));
    }

    /// A frame at rest at the end of a run of 40 N: what is left of its force is round-off.
    #[test]
    fn captions_are_rounded_beside_what_the_run_reaches() {
        let mut run = sample::run();
        run.frames[1].force_n = -3.1e-12;
        run.frames[1].travel_m = -1.84e-10;
        let page = page_of(&run);
        assert!(page.contains("<figcaption>Peak!: von Mises stress, 0 mm of travel, 0 N<"));
        assert!(!page.contains(">-0"));
        assert!(!page.contains(" -0 "));
    }

    #[test]
    fn the_page_tells_all() {
        let page = sample_page();
        for text in [
            "The part snaps: the force peaks at 42 N after 2 mm and falls by 54 N",
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
        run.origin.made = evil.into();
        run.origin.inputs[0].name = evil.into();
        assert!(!page_of(&run).contains("<script"));
    }

    #[test]
    fn headlines() {
        let felt_only = Run {
            driven: None,
            ..sample::run()
        };
        let quiet = headline(&felt_only, &Curve::default());
        assert!(quiet.starts_with("Nothing resisted"));
        let rising = Curve {
            peak_force_n: 12.0,
            travel_at_peak_m: 1e-3,
            peak_row_idx: Some(3),
            ..Curve::default()
        };
        assert!(headline(&felt_only, &rising).contains("does not drop"));
        let partly = Curve {
            snap_drop_n: 4.0,
            ..rising
        };
        assert!(headline(&felt_only, &partly).contains("never to zero"));
    }
}
