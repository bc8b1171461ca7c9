//! Words and scales over the picture, drawn on its samples: letters then stand where they should
//! and not at the next whole pixel. Places and sizes here are in pixels.

use glam::DVec3;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::super::font;
use super::super::plot::short;
use super::colour;

const INK: RGBColor = RGBColor(30, 33, 38);

type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;

/// Left, top, width and height of the colour bar, pixels.
const BAR: (i32, i32, i32, i32) = (1130, 212, 30, 540);

/// A colour scale from zero to a round number.
#[derive(Clone, Debug)]
pub(crate) struct ColourBar {
    name: &'static str,
    unit: &'static str,
    /// Value at the end of the scale.
    pub(crate) top: f64,
    step: f64,
}

impl ColourBar {
    /// Reaches at least to `largest`.
    pub(crate) fn new(name: &'static str, unit: &'static str, largest: f64) -> Self {
        let largest = if largest.is_finite() && largest > 0.0 {
            largest
        } else {
            1.0
        };
        let step = round_step(largest / 5.0);
        // Half steps keep the scale from being half empty.
        let top = (2.0 * largest / step - 1e-9).ceil() / 2.0 * step;
        Self {
            name,
            unit,
            top,
            step,
        }
    }

    /// Values that are written beside it, ascending.
    pub(crate) fn ticks(&self) -> impl Iterator<Item = f64> {
        let n = (self.top / self.step + 1e-9).floor() as usize;
        (0..=n).map(|i| i as f64 * self.step)
    }
}

/// A picture being written upon.
#[derive(Debug)]
pub(crate) struct Overlay {
    bytes: Vec<u8>,
    size: (usize, usize),
    samples: i32,
    error: Option<String>,
}

impl Overlay {
    /// `bytes`: `samples` x `samples` samples for each pixel of a picture of this size.
    pub(crate) fn new(bytes: Vec<u8>, size: (usize, usize), samples: usize) -> Self {
        font::register();
        Self {
            bytes,
            size,
            samples: samples as i32,
            error: None,
        }
    }

    /// The samples, or the first thing that could not be drawn.
    pub(crate) fn finish(self) -> Result<Vec<u8>, String> {
        match self.error {
            Some(error) => Err(error),
            None => Ok(self.bytes),
        }
    }

    /// A line of text whose upper left corner is at `place`; what does not fit is cut off.
    pub(crate) fn text(&mut self, text: &str, place: (i32, i32), height: i32) {
        self.coloured_text(text, place, height, INK);
    }

    fn coloured_text(&mut self, text: &str, place: (i32, i32), height: i32, colour: RGBColor) {
        // At less than a third of its height for the slimmest letter, more than this cannot be seen.
        let room = 4 * self.size.0 / height.max(1) as usize;
        let text: String = text
            .chars()
            .filter(|c| !c.is_control())
            .take(room)
            .collect();
        let style = (font::FAMILY, height * self.samples)
            .into_font()
            .color(&colour);
        self.draw(|root, at| root.draw(&Text::new(text, at(place), style)));
    }

    fn line(&mut self, ends: [(i32, i32); 2], width: i32, colour: RGBColor) {
        let style = colour.stroke_width((width * self.samples) as u32);
        self.draw(|root, at| root.draw(&PathElement::new(ends.map(at), style)));
    }

    fn polygon(&mut self, corners: &[(i32, i32)], colour: RGBColor) {
        self.draw(|root, at| {
            let corners: Vec<_> = corners.iter().map(|&p| at(p)).collect();
            root.draw(&Polygon::new(corners, colour.filled()))
        });
    }

    /// The scale, with `largest` told below it: it may lie beyond the top.
    pub(crate) fn colour_bar(&mut self, bar: &ColourBar, largest: f64) {
        let (left, top, width, height) = BAR;
        let map = colour::map();
        let shade = |value: f32| {
            let [r, g, b] = colour::at(&map, value).map(|c| (c * 255.0).round() as u8);
            RGBColor(r, g, b)
        };
        for row in 0..height {
            let (from, to) = ((left, top + row), (left + width, top + row + 1));
            let colour = shade(1.0 - (row as f32 + 0.5) / height as f32);
            self.draw(|root, at| root.draw(&Rectangle::new([at(from), at(to)], colour.filled())));
        }
        let (right, bottom) = (left + width, top + height);
        let corners = [
            (left, top),
            (right, top),
            (right, bottom),
            (left, bottom),
            (left, top),
        ];
        for ends in corners.windows(2) {
            self.line([ends[0], ends[1]], 1, INK);
        }
        if largest > bar.top * 1.000_001 {
            self.polygon(
                &[
                    (left, top - 4),
                    (right, top - 4),
                    (left + width / 2, top - 22),
                ],
                shade(1.0),
            );
        }
        for tick in bar.ticks() {
            let y = bottom - (f64::from(height) * tick / bar.top).round() as i32;
            self.line([(right, y), (right + 7, y)], 1, INK);
            self.text(&short(tick), (right + 13, y - 14), 25);
        }
        let start = left - 62;
        self.text(bar.name, (start, top - 92), 25);
        self.text(&format!("({})", bar.unit), (start, top - 62), 25);
        self.text("largest", (start, bottom + 18), 25);
        let largest = format!("{} {}", short(largest), bar.unit);
        self.text(&largest, (start, bottom + 48), 25);
    }

    /// Directions of the part's axes. `on_picture`: right and down on the picture of a direction in space.
    pub(crate) fn axes(&mut self, on_picture: impl Fn(DVec3) -> [f64; 2]) {
        let origin = (86, 820);
        for (axis, name, colour) in [
            (DVec3::X, "x", RGBColor(213, 94, 0)),
            (DVec3::Y, "y", RGBColor(0, 128, 90)),
            (DVec3::Z, "z", RGBColor(0, 114, 178)),
        ] {
            let [dx, dy] = on_picture(axis);
            let along = |length: f64| {
                (
                    origin.0 + (dx * length).round() as i32,
                    origin.1 + (dy * length).round() as i32,
                )
            };
            self.line([origin, along(46.0)], 3, colour);
            let (x, y) = along(60.0);
            self.coloured_text(name, (x - 7, y - 15), 27, colour);
        }
    }

    /// A bar of a round length.
    pub(crate) fn scale_bar(&mut self, pixels_per_metre: f64) {
        let millimetres = round_step(150.0 / pixels_per_metre * 1e3);
        let length = millimetres * 1e-3 * pixels_per_metre;
        if !(10.0..400.0).contains(&length) {
            return;
        }
        let (left, y) = (40, 926);
        let right = left + length.round() as i32;
        self.line([(left, y), (right, y)], 2, INK);
        for end in [left, right] {
            self.line([(end, y - 6), (end, y + 6)], 2, INK);
        }
        self.text(
            &format!("{} mm", short(millimetres)),
            (right + 12, y - 16),
            25,
        );
    }

    /// `content` gets the samples to draw on and what turns a place in pixels into one of samples.
    fn draw<E: std::fmt::Display>(
        &mut self,
        content: impl FnOnce(&Area<'_>, &dyn Fn((i32, i32)) -> (i32, i32)) -> Result<(), E>,
    ) {
        if self.error.is_some() {
            return;
        }
        let k = self.samples;
        let size = (self.size.0 as u32 * k as u32, self.size.1 as u32 * k as u32);
        let root = BitMapBackend::with_buffer(&mut self.bytes, size).into_drawing_area();
        let result = content(&root, &|(x, y)| (x * k, y * k)).map_err(|e| e.to_string());
        self.error = result
            .and_then(|()| root.present().map_err(|e| e.to_string()))
            .err();
    }
}

/// 1, 2 or 5 times a power of ten, not below a third of `about` and not beyond its double.
pub(crate) fn round_step(about: f64) -> f64 {
    if !about.is_finite() || about <= 0.0 {
        return 1.0;
    }
    let power = 10f64.powf(about.log10().floor());
    let factor = match about / power {
        f if f < 1.5 => 1.0,
        f if f < 3.5 => 2.0,
        f if f < 7.5 => 5.0,
        _ => 10.0,
    };
    factor * power
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        for (about, step) in [
            (0.13, 0.1),
            (0.2, 0.2),
            (4.0, 5.0),
            (8.0, 10.0),
            (60.0, 50.0),
        ] {
            assert!((round_step(about) - step).abs() < 1e-12 * step, "{about}");
        }
        assert_eq!(round_step(f64::NAN), 1.0);
    }

    #[test]
    fn the_scale_reaches_the_largest_value_and_is_not_half_empty() {
        for largest in [0.013, 0.99, 1.0, 1.01, 7.3, 48.0, 1234.0] {
            let bar = ColourBar::new("", "", largest);
            assert!(
                bar.top >= largest * (1.0 - 1e-9) && bar.top < 1.35 * largest,
                "{largest}"
            );
            assert!((3..=9).contains(&bar.ticks().count()), "{largest}");
        }
        assert_eq!(ColourBar::new("", "", 0.0).top, 1.0);
    }

    #[test]
    fn text_beyond_the_picture_is_cut_off() {
        let mut picture = Overlay::new(vec![255; 4 * 3 * 200 * 50], (200, 50), 2);
        picture.text(&"long \u{1F600} \n line ".repeat(50), (5, 40), 20);
        assert!(picture.finish().unwrap().iter().any(|&b| b < 200));
    }
}
