//! Force over travel: any number of curves, one of them marked.

use std::error::Error;

use plotters::prelude::*;

use super::super::curve::Curve;
use super::super::data::{Handbook, Phase, Run};
use super::super::part_curve::Place;
use super::{
    Area, BLUE, FINE, Format, GREEN, GREY, GRID, INK, Key, ORANGE, VERMILLION, draw, empty, short,
    stroke, words,
};

/// Points of a line beyond which only extremes within equal stretches are drawn.
const MAX_POINTS: usize = 2_000;

/// A curve of the plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// In the legend.
    pub name: String,
    /// Travel (m) and force (N, positive when it resists), in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
    /// What it stands for.
    pub look: Look,
}

/// What a curve stands for, which decides its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// The main curve on the way in: strong.
    In,
    /// The main curve on the way out.
    Out,
    /// Another curve on the way in, to be compared with the main one.
    OtherIn,
    /// Another curve on the way out.
    OtherOut,
    /// The main curve without friction, in and out: thin, behind.
    Frictionless,
    /// From a formula or a file: dashed.
    Reference,
}

impl Look {
    fn colour(self) -> RGBColor {
        match self {
            Self::In => BLUE,
            Self::Out => VERMILLION,
            Self::OtherIn => GREEN,
            Self::OtherOut => ORANGE,
            Self::Frictionless => GREY,
            Self::Reference => INK,
        }
    }

    fn width(self) -> i32 {
        match self {
            Self::In => 3,
            Self::Frictionless => 1,
            _ => 2,
        }
    }
}

/// A curve as it is drawn, in mm and N.
struct Line {
    key: Key,
    look: Look,
    points: Vec<(f64, f64)>,
}

/// A point to be named on the plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// m.
    pub travel_m: f64,
    /// N.
    pub force_n: f64,
    /// Before its numbers, for example `peak`.
    pub name: String,
}

/// The part's own curve, what the hand felt beside it, and the handbook's curve, as far as there are any.
pub fn curves(run: &Run) -> Vec<Series> {
    let mut all = Vec::new();
    let mut add = |name: &str, points: Vec<(f64, f64)>, look| {
        if !points.is_empty() {
            all.push(Series {
                name: name.to_owned(),
                points,
                look,
            });
        }
    };
    let driven = run.driven.as_ref().map_or(&[][..], |driven| &driven.rows);
    let driven = |is_out: bool| {
        let rows = driven
            .iter()
            .filter(|r| (r.phase == Phase::Retract) == is_out);
        rows.map(|row| (row.travel_m, row.force_n)).collect()
    };
    let felt = |is_out: bool| {
        let rows = run
            .rows
            .iter()
            .filter(|r| (r.phase == Phase::Retract) == is_out);
        rows.map(|row| (row.travel_m, row.force_n)).collect()
    };
    let (felt_in, felt_out) = if run.driven.is_some() {
        (Look::OtherIn, Look::OtherOut)
    } else {
        (Look::In, Look::Out)
    };
    // Beside what a hand felt it is told whose curve this is.
    let (into, out) = if run.rows.is_empty() {
        ("pushing in", "pulling out")
    } else {
        ("driven in", "driven out")
    };
    add(into, driven(false), Look::In);
    add(out, driven(true), Look::Out);
    let friction = run.driven.as_ref().and_then(|d| d.friction.as_ref());
    let plain = friction.map_or(&[][..], |f| &f.frictionless_rows);
    let plain = plain.iter().map(|row| (row.travel_m, row.force_n));
    add("without friction", plain.collect(), Look::Frictionless);
    add("felt by the hand", felt(false), felt_in);
    add("felt, pulling out", felt(true), felt_out);
    all.extend(run.handbook.as_ref().and_then(of_handbook));
    all
}

fn of_handbook(handbook: &Handbook) -> Option<Series> {
    // The formula after the colon stands beside the table, not in the legend.
    let book = handbook.name.split(": ").next().unwrap_or_default();
    (handbook.curve.len() > 1).then(|| Series {
        name: format!("handbook: {book}"),
        points: handbook.curve.clone(),
        look: Look::Reference,
    })
}

/// The snap's peak, or else the largest force; of the felt curve where there is no other.
pub fn peak(run: &Run, felt: &Curve) -> Option<Mark> {
    let driven = run.driven.as_ref().map(|driven| driven.curve.insertion());
    let of_felt = || {
        felt.peak_row_idx.map(|_| Place {
            travel_m: felt.travel_at_peak_m,
            force_n: felt.peak_force_n,
        })
    };
    let place = driven.unwrap_or_else(of_felt)?;
    Some(Mark {
        travel_m: place.travel_m,
        force_n: place.force_n,
        name: "peak".to_owned(),
    })
}

/// `force-travel.svg`: mm and N, the curves in their order, the last on top of the others, and the
/// first with [`Look::In`] on top of all.
///
/// # Errors
/// What the plot library says.
pub fn force_travel(
    series: &[Series],
    mark: Option<&Mark>,
    format: Format,
) -> Result<String, Box<dyn Error>> {
    let lines: Vec<Line> = series
        .iter()
        .map(|s| {
            let key = Key {
                is_dashed: s.look == Look::Reference,
                ..Key::new(&s.name, s.look.colour(), s.look.width())
            };
            let points = s.points.iter().map(|&(x, y)| (x * 1e3, y));
            let points = points.filter(|p| p.0.is_finite() && p.1.is_finite());
            Line {
                key,
                look: s.look,
                points: points.collect(),
            }
        })
        .collect();
    let all = || lines.iter().flat_map(|line| &line.points);
    let (x0, x1) = range(all().map(|p| p.0));
    let (y0, y1) = range(all().map(|p| p.1).chain([0.0]));
    let room = 0.08 * (y1 - y0);
    let keys: Vec<Key> = lines.iter().map(|line| line.key.clone()).collect();
    draw(format, &keys, |root| {
        let mut chart = ChartBuilder::on(root)
            .margin(12 * FINE)
            .x_label_area_size(50 * FINE)
            .y_label_area_size(format.aside() * FINE)
            .build_cartesian_2d(x0..x1, y0 - room..y1 + 2.0 * room)?;
        chart
            .configure_mesh()
            .x_labels(format.n_ticks())
            .x_desc("travel (mm)")
            .y_desc("force (N), positive when it resists")
            .label_style(words(17, INK))
            .axis_desc_style(words(18, INK))
            .axis_style(GREY.stroke_width(FINE as u32))
            .bold_line_style(GRID.stroke_width(FINE as u32))
            .light_line_style(TRANSPARENT)
            .set_all_tick_mark_size(5 * FINE)
            .x_label_formatter(&|x| short(*x))
            .y_label_formatter(&|y| short(*y))
            .draw()?;
        chart.draw_series(LineSeries::new([(x0, 0.0), (x1, 0.0)], stroke(GREY, 1)))?;
        // The main curve lies over the others, and what it is compared with over it in dashes.
        let rank = |look: Look| match look {
            Look::Frictionless => 0,
            Look::OtherOut => 1,
            Look::OtherIn => 2,
            Look::Out => 3,
            Look::In => 4,
            Look::Reference => 5,
        };
        let mut order: Vec<_> = lines.iter().collect();
        order.sort_by_key(|line| rank(line.look));
        for Line { key, points, .. } in order {
            if key.is_dashed {
                let (dash, space) = (8 * FINE, 5 * FINE);
                let line = DashedLineSeries::new(points.clone(), dash, space, key.style());
                chart.draw_series(line)?;
            } else {
                chart.draw_series(LineSeries::new(thinned(points), key.style()))?;
            }
        }
        if let Some(mark) = mark {
            let at = (mark.travel_m * 1e3, mark.force_n);
            let text = format!("{} {} N at {} mm", mark.name, short(at.1), short(at.0));
            let style = words(18, INK);
            let (width, height) = size_of(root, &text, &style)?;
            // On the side that has room.
            let is_right = at.0 > 0.5 * (x0 + x1);
            let aside = if is_right {
                -12 * FINE - width
            } else {
                12 * FINE
            };
            let shift = (aside, -8 * FINE - height);
            let end = (shift.0 + width, shift.1 + height);
            // The words stay readable where a curve runs below them.
            let backdrop = WHITE.mix(0.85).filled();
            chart.draw_series([EmptyElement::at(at)
                + Rectangle::new([shift, end], backdrop)
                + Circle::new((0, 0), 6 * FINE, INK.filled())
                + Circle::new((0, 0), 4 * FINE, ORANGE.filled())
                + Text::new(text, shift, style)])?;
        }
        if all().next().is_none() {
            empty(root)?;
        }
        Ok(())
    })
}

fn size_of(
    root: &Area<'_>,
    text: &str,
    style: &TextStyle<'_>,
) -> Result<(i32, i32), Box<dyn Error>> {
    let (width, height) = root.estimate_text_size(text, style)?;
    Ok((width as i32, height as i32))
}

/// Smallest and largest value, widened to an interval that can be drawn.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
        (a.min(v), b.max(v))
    });
    if low > high {
        return (0.0, 1.0);
    }
    if high - low < 1e-9 * high.abs().max(1e-3) {
        let half = 0.5 * high.abs().max(1.0);
        return (low - half, high + half);
    }
    (low, high)
}

/// The line itself if it is short, else lowest and highest point of equal stretches in order.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= MAX_POINTS {
        return points.to_vec();
    }
    let stretch = points.len().div_ceil(MAX_POINTS / 2);
    let mut kept = Vec::with_capacity(MAX_POINTS + 2);
    for part in points.chunks(stretch) {
        let by_force = |a: &usize, b: &usize| part[*a].1.total_cmp(&part[*b].1);
        let low = (0..part.len()).min_by(by_force).unwrap_or(0);
        let high = (0..part.len()).max_by(by_force).unwrap_or(0);
        kept.push(part[low.min(high)]);
        if low != high {
            kept.push(part[low.max(high)]);
        }
    }
    kept.extend(points.last());
    kept
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::super::sample;
    use super::*;

    fn of_run(run: &Run) -> String {
        let mark = peak(run, &Curve::of(&run.rows));
        force_travel(&curves(run), mark.as_ref(), Format::Wide).unwrap()
    }

    #[test]
    fn force_travel_names_its_units_peak_and_curves() {
        let run = sample::run();
        let svg = of_run(&run);
        for text in [
            "(mm)",
            "(N)",
            "peak 42 N at 2 mm",
            "driven in",
            "driven out",
            "felt by the hand",
            "handbook: cantilever",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(svg.starts_with("<svg"));
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn the_legend_names_the_formula_without_writing_it_out() {
        let mut run = sample::run();
        let book = run.handbook.as_mut().unwrap();
        book.name = "cantilever: P = b h² E ε / 6 L".into();
        let svg = of_run(&run);
        assert!(svg.contains("handbook: cantilever\n"));
        run.handbook.as_mut().unwrap().name = "long ".repeat(40);
        let svg = of_run(&run);
        assert!(svg.contains("long …\n"));
    }

    #[test]
    fn without_a_hand_the_legend_has_one_way_in_and_one_out() {
        let mut run = sample::run();
        run.rows.clear();
        let svg = of_run(&run);
        assert!(svg.contains("pushing in") && svg.contains("pulling out"));
        assert!(!svg.contains("driven in") && !svg.contains("felt"));
    }

    #[test]
    fn nothing_to_show_is_said() {
        let svg = force_travel(&[], None, Format::Wide).unwrap();
        assert!(svg.contains("no steps"));
    }

    /// The part's own curve beside the hand's: both are named and have lines of their own.
    #[test]
    fn curves_are_told_apart() {
        let run = sample::run();
        let series = curves(&run);
        for format in [Format::Wide, Format::Narrow] {
            let svg = force_travel(&series, None, format).unwrap();
            assert!(svg.contains("felt by the hand"));
            for look in [Look::In, Look::Out, Look::OtherIn] {
                let RGBColor(r, g, b) = look.colour();
                let colour = format!("#{r:02X}{g:02X}{b:02X}");
                assert!(svg.contains(&colour), "{colour}");
            }
        }
    }

    #[test]
    fn a_long_line_keeps_its_extremes() {
        let points: Vec<(f64, f64)> = (0..100_000)
            .map(|i| (f64::from(i), if i == 54_321 { 9.0 } else { 0.0 }))
            .collect();
        let kept = thinned(&points);
        assert!(kept.len() <= MAX_POINTS + 2);
        assert!(kept.contains(&(54_321.0, 9.0)));
        assert_eq!(kept.last(), points.last());
        assert!(kept.is_sorted_by(|a, b| a.0 <= b.0));
    }
}
