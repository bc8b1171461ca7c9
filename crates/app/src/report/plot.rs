//! Plots as SVG: what all of them share; [`force`] over travel, and how long steps take ([`time`]).

pub mod force;
pub mod time;

use std::error::Error;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::font;

pub use self::force::{Look, Mark, Series, force_travel};
pub use self::time::step_time;

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Colours that stay apart for every common colour vision (Okabe and Ito 2008).
pub(super) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(super) const VERMILLION: RGBColor = RGBColor(213, 94, 0);
pub(super) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(super) const ORANGE: RGBColor = RGBColor(230, 159, 0);
pub(super) const SKY: RGBColor = RGBColor(86, 180, 233);
pub(super) const PURPLE: RGBColor = RGBColor(204, 121, 167);
pub(super) const INK: RGBColor = RGBColor(34, 34, 34);
pub(super) const GREY: RGBColor = RGBColor(120, 120, 120);
pub(super) const GRID: RGBColor = RGBColor(225, 225, 225);

/// Room and shape of a plot. Words keep their size, so that a narrow plot is readable on a phone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// For a page and for paper.
    Wide,
    /// For a screen that is narrower than a hand.
    Narrow,
}

impl Format {
    /// Width and height as it is shown, pixels.
    pub(super) fn size(self) -> (i32, i32) {
        match self {
            Self::Wide => SIZE,
            Self::Narrow => (480, 430),
        }
    }

    /// Room for the words of the vertical axis, pixels.
    pub(super) fn aside(self) -> i32 {
        match self {
            Self::Wide => 70,
            Self::Narrow => 62,
        }
    }

    /// Values on the horizontal axis, about.
    pub(super) fn n_ticks(self) -> usize {
        match self {
            Self::Wide => 10,
            Self::Narrow => 5,
        }
    }
}

/// Size of a wide plot as it is shown, pixels.
pub(super) const SIZE: (i32, i32) = (960, 540);

/// The plot library rounds to whole units, which would show as steps in slanted lines: it gets
/// this many units per pixel.
pub(super) const FINE: i32 = 8;

/// At most three significant digits, without trailing zeros.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 {
            "0".into()
        } else {
            value.to_string()
        };
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{value:.digits$}");
    if !text.contains('.') {
        return text;
    }
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.to_owned()
    }
}

/// A line of the legend.
#[derive(Clone, Debug)]
pub(super) struct Key {
    label: String,
    colour: RGBColor,
    width: i32,
    pub(super) is_dashed: bool,
}

impl Key {
    pub(super) fn new(label: &str, colour: RGBColor, width: i32) -> Self {
        Self {
            label: label.to_owned(),
            colour,
            width,
            is_dashed: false,
        }
    }

    fn style(&self) -> ShapeStyle {
        stroke(self.colour, self.width)
    }
}

/// Draws on white, with the legend in a line above the plot, and hands the SVG text back.
pub(super) fn draw(
    format: Format,
    keys: &[Key],
    content: impl FnOnce(&Area<'_>) -> Result<(), Box<dyn Error>>,
) -> Result<String, Box<dyn Error>> {
    font::register();
    let size = format.size();
    let fine = ((size.0 * FINE) as u32, (size.1 * FINE) as u32);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, fine).into_drawing_area();
        root.fill(&WHITE)?;
        let lines = legend_lines(&root, format, keys)?;
        let (head, body) = root.split_vertically((10 + 24 * lines.len().max(1) as i32) * FINE);
        legend(&head, format, &lines)?;
        content(&body)?;
        root.present().map_err(|e| e.to_string())?;
    }
    let at_fine = format!("width=\"{}\" height=\"{}\"", fine.0, fine.1);
    let shown = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    Ok(svg.replacen(&at_fine, &shown, 1))
}

/// Letters of a legend's entry that fit beside the others.
fn legend_length(format: Format) -> usize {
    match format {
        Format::Wide => 70,
        Format::Narrow => 40,
    }
}

/// A key, its label cut to what fits, and the label's size.
type LegendEntry<'a> = (&'a Key, String, (i32, i32));

/// The keys in as many lines as they need.
fn legend_lines<'a>(
    area: &Area<'_>,
    format: Format,
    keys: &'a [Key],
) -> Result<Vec<Vec<LegendEntry<'a>>>, Box<dyn Error>> {
    let mut lines: Vec<Vec<LegendEntry<'a>>> = Vec::new();
    let mut x = i32::MAX;
    for key in keys {
        let mut label: String = key.label.chars().take(legend_length(format)).collect();
        if label.len() < key.label.len() {
            label.push('…');
        }
        let (width, height) = area.estimate_text_size(&label, &words(17, INK))?;
        let size = (width as i32, height as i32);
        let needed = 55 * FINE + size.0;
        if x.saturating_add(needed) > (format.size().0 - 12) * FINE {
            lines.push(Vec::new());
            x = (format.aside() + 14) * FINE;
        }
        x += needed;
        if let Some(line) = lines.last_mut() {
            line.push((key, label, size));
        }
    }
    Ok(lines)
}

fn legend(
    head: &Area<'_>,
    format: Format,
    lines: &[Vec<LegendEntry<'_>>],
) -> Result<(), Box<dyn Error>> {
    for (entries, k) in lines.iter().zip(0..) {
        let (mut x, y) = ((format.aside() + 14) * FINE, (20 + 24 * k) * FINE);
        for (key, label, (width, height)) in entries {
            let line = |from: i32, to: i32| {
                let ends = [(x + from * FINE, y), (x + to * FINE, y)];
                head.draw(&PathElement::new(ends, key.style()))
            };
            if key.is_dashed {
                line(0, 10)?;
                line(15, 25)?;
            } else {
                line(0, 25)?;
            }
            let place = (x + 33 * FINE, y - height / 2);
            head.draw(&Text::new(label.clone(), place, words(17, INK)))?;
            x += 55 * FINE + width;
        }
    }
    Ok(())
}

pub(super) fn stroke(colour: RGBColor, width: i32) -> ShapeStyle {
    colour.stroke_width((width * FINE) as u32)
}

pub(super) fn words(size: i32, colour: RGBColor) -> TextStyle<'static> {
    (font::FAMILY, size * FINE).into_font().color(&colour)
}

pub(super) fn empty(root: &Area<'_>) -> Result<(), Box<dyn Error>> {
    let (width, height) = root.dim_in_pixel();
    let place = (width as i32 / 2 - 60 * FINE, height as i32 / 2 - 40 * FINE);
    root.draw(&Text::new("no steps to show", place, words(20, GREY)))
        .map_err(|e| e.to_string().into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_numbers() {
        let texts = [0.0, -0.0, 1234.4, 12.34, 0.012_34, 2.0, -0.5, 100.0].map(short);
        assert_eq!(
            texts,
            ["0", "0", "1234", "12.3", "0.0123", "2", "-0.5", "100"]
        );
    }
}
