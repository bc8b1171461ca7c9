//! What stands over the picture: colour scale, axes, scale, what arrows are.

use eframe::egui::{
    self, Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, epaint, pos2, vec2,
};
use glam::DVec3;

use super::super::arrows::{SLIPPING, STICKING};
use super::super::camera::Camera;
use super::super::exhibit::Exhibit;
use crate::report::plot::short;
use crate::report::render::colour;
use crate::report::render::overlay::round_step;

const INK: Color32 = Color32::from_rgb(30, 33, 38);

/// Width and height of the colour bar, points.
const BAR: [f32; 2] = [20.0, 260.0];

/// Steps in which the bar is drawn.
const N_STEPS: usize = 64;

/// From the border of the picture, points.
const MARGIN: f32 = 18.0;

/// What it is told from.
pub(super) struct Legend<'a> {
    pub(super) exhibit: &'a Exhibit,
    pub(super) camera: &'a Camera,
    pub(super) largest_mm: f64,
    pub(super) has_friction: bool,
    pub(super) rect: Rect,
}

impl Legend<'_> {
    pub(super) fn draw(&self, painter: &Painter) {
        let painter = painter.with_clip_rect(self.rect);
        self.colours(&painter);
        self.axes(&painter);
        self.scale(&painter);
        self.arrows(&painter);
    }

    fn colours(&self, painter: &Painter) {
        let bar = &self.exhibit.bar;
        let corner = self.rect.left_top() + vec2(MARGIN, MARGIN);
        text(painter, corner, Align2::LEFT_TOP, 15.0, "displacement, mm");
        let top = corner + vec2(0.0, 30.0);
        let map = colour::map();
        let step = BAR[1] / N_STEPS as f32;
        for k in 0..N_STEPS {
            let value = 1.0 - (k as f32 + 0.5) / N_STEPS as f32;
            let place =
                Rect::from_min_size(top + vec2(0.0, k as f32 * step), vec2(BAR[0], step + 0.6));
            painter.rect_filled(place, 0.0, ink(colour::at(&map, value)));
        }
        let whole = Rect::from_min_size(top, vec2(BAR[0], BAR[1]));
        let border = Stroke::new(1.0, INK);
        painter.rect_stroke(whole, 0.0, border, egui::StrokeKind::Outside);
        for tick in bar.ticks() {
            let y = whole.bottom() - BAR[1] * (tick / bar.top) as f32;
            let at = pos2(whole.right(), y);
            painter.line_segment([at, at + vec2(5.0, 0.0)], border);
            text(
                painter,
                at + vec2(9.0, 0.0),
                Align2::LEFT_CENTER,
                14.0,
                &short(tick),
            );
        }
        let now = format!("largest now {:.3}", self.largest_mm);
        let below = whole.left_bottom() + vec2(0.0, 10.0);
        text(painter, below, Align2::LEFT_TOP, 14.0, &now);
    }

    fn axes(&self, painter: &Painter) {
        let origin = self.rect.left_bottom() + vec2(MARGIN + 40.0, -MARGIN - 62.0);
        let mut axes = [
            (DVec3::X, "x", Color32::from_rgb(213, 94, 0)),
            (DVec3::Y, "y", Color32::from_rgb(0, 128, 90)),
            (DVec3::Z, "z", Color32::from_rgb(0, 114, 178)),
        ];
        // What points at the eye is drawn last.
        let depth = |axis: DVec3| axis.dot(self.camera.into());
        axes.sort_by(|a, b| depth(b.0).total_cmp(&depth(a.0)));
        for (axis, name, colour) in axes {
            let [x, y] = self.camera.on_picture(axis).map(|v| v as f32);
            let end = origin + vec2(x, y) * 34.0;
            painter.line_segment([origin, end], Stroke::new(2.5, colour));
            let at = origin + vec2(x, y) * 46.0;
            painter.text(
                at,
                Align2::CENTER_CENTER,
                name,
                FontId::proportional(15.0),
                colour,
            );
        }
    }

    fn scale(&self, painter: &Painter) {
        let per_metre = self.camera.pixels_per_metre(f64::from(self.rect.height()));
        let millimetres = round_step(110.0 / per_metre * 1e3);
        let length = (millimetres * 1e-3 * per_metre) as f32;
        let from = self.rect.left_bottom() + vec2(MARGIN, -MARGIN);
        let to = from + vec2(length, 0.0);
        let stroke = Stroke::new(1.8, INK);
        painter.line_segment([from, to], stroke);
        for end in [from, to] {
            painter.line_segment([end - vec2(0.0, 4.0), end + vec2(0.0, 4.0)], stroke);
        }
        let words = format!(
            "{} mm     grid {} mm",
            short(millimetres),
            short(1e3 * self.exhibit.ground_step)
        );
        text(
            painter,
            to + vec2(9.0, 0.0),
            Align2::LEFT_CENTER,
            14.0,
            &words,
        );
    }

    fn arrows(&self, painter: &Painter) {
        let mut right = self.rect.right_bottom() + vec2(-MARGIN, -MARGIN);
        let slips = if self.has_friction {
            "force, slipping"
        } else {
            "force on the part"
        };
        let kinds = [(STICKING, "sticking"), (SLIPPING, slips)];
        for (colour, words) in &kinds[usize::from(!self.has_friction)..] {
            let drawn = text(painter, right, Align2::RIGHT_CENTER, 14.0, words);
            let tip = pos2(drawn.left() - 8.0, right.y);
            arrow(painter, tip, ink(*colour));
            right = tip - vec2(44.0, 0.0);
        }
    }
}

fn arrow(painter: &Painter, tip: Pos2, colour: Color32) {
    let neck = tip - vec2(9.0, 0.0);
    painter.line_segment([neck - vec2(17.0, 0.0), neck], Stroke::new(2.5, colour));
    let corners = vec![tip, neck + vec2(0.0, 5.0), neck - vec2(0.0, 5.0)];
    painter.add(Shape::Path(epaint::PathShape::convex_polygon(
        corners,
        colour,
        Stroke::NONE,
    )));
}

/// In large letters; `left`: share of its time, 1 to 0.
pub(super) fn banner(painter: &Painter, rect: Rect, words: &str, left: f32) {
    let at = rect.center_top() + vec2(0.0, 24.0);
    let fade = (2.0 * left).clamp(0.0, 1.0);
    let [ground, letters] =
        [Color32::from_rgb(213, 94, 0), Color32::WHITE].map(|c| c.gamma_multiply(fade));
    let font = FontId::proportional(34.0);
    let galley = painter.layout_no_wrap(words.to_owned(), font, letters);
    let place = Align2::CENTER_TOP.anchor_size(at, galley.size());
    painter.rect_filled(place.expand2(vec2(22.0, 8.0)), 8.0, ground);
    painter.galley(place.min, galley, letters);
}

fn text(painter: &Painter, at: Pos2, anchor: Align2, size: f32, words: &str) -> Rect {
    painter.text(at, anchor, words, FontId::proportional(size), INK)
}

fn ink(colour: [f32; 3]) -> Color32 {
    let [r, g, b] = colour.map(|c| (255.0 * c).round() as u8);
    Color32::from_rgb(r, g, b)
}
