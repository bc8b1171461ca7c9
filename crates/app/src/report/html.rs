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
pub(crate) use self::style::STYLE;
pub(crate) use self::text::escaped;
use super::curve::Curve;
use super::data::Run;

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

/// The text of `report.html`.
pub fn page(run: &Run, curve: &Curve, drawings: &Drawings) -> String {
    let mut page = String::new();
    head::open(&mut page, &run.title, "snap-fit report", &run.scene_path);
    let _ = writeln!(
        page,
        "<p class=\"headline\">{}</p>",
        escaped(&headline(curve))
    );
    warnings::warnings(&mut page, run);
    headline::cards(&mut page, run, curve);
    curve::curve(&mut page, run, &drawings.force_svg);
    strain::strain(&mut page, &run.strain);
    pictures::pictures(&mut page, run, &drawings.pictures);
    numbers::key_numbers(&mut page, run, curve);
    effects::effects(&mut page, &run.effects);
    timing::timing(&mut page, run, &drawings.time_svg);
    settings::settings(&mut page, run);
    settings::notes(&mut page, run);
    reading::how_to_read(&mut page);
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
