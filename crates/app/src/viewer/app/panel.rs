//! The panel beside the picture: force, curve, hand, and how the loop is doing.

use eframe::egui::{self, Color32, RichText};
use egui_plot::{Line, Plot, PlotPoint, PlotPoints, Points};

use super::Window;

/// The felt curve; apart from the other in lightness too.
const FELT: Color32 = Color32::from_rgb(213, 94, 0);

/// The part's own curve.
const OWN: Color32 = Color32::from_rgb(90, 100, 115);

/// Where the loop is in trouble.
const ALARM: Color32 = Color32::from_rgb(178, 24, 43);

impl Window<'_> {
    pub(super) fn panel(&mut self, ui: &mut egui::Ui) {
        ui.add_space(8.0);
        ui.heading(&self.exhibit.title);
        self.numbers(ui);
        self.plot(ui);
        ui.add_space(2.0);
        self.hand(ui);
        ui.separator();
        self.loop_facts(ui);
        self.messages(ui);
    }

    fn numbers(&self, ui: &mut egui::Ui) {
        let sample = self.seen.sample.as_ref();
        let (force, travel) = sample.map_or((0.0, 0.0), |s| (s.resistance, 1e3 * s.gone.travel));
        // No sign of a zero.
        let shown = |value: f64| if value.abs() < 0.005 { 0.0 } else { value };
        let large = |text: String| RichText::new(text).size(30.0).strong();
        egui::Grid::new("numbers")
            .num_columns(2)
            .min_col_width(180.0)
            .show(ui, |ui| {
                ui.label("force against the hand");
                ui.label("travel");
                ui.end_row();
                ui.label(large(format!("{:.2} N", shown(force))));
                ui.label(large(format!("{:.2} mm", shown(travel))));
                ui.end_row();
            });
        let snap = &self.seen.snap;
        let peak = match snap.peak_force {
            0.0 => "no force felt yet".to_owned(),
            peak => format!("peak {peak:.2} N at {:.2} mm", 1e3 * snap.travel_at_peak),
        };
        let words = format!(
            "{peak};  snapped in {} ×, came off {} ×",
            snap.n_snaps_in, snap.n_snaps_out
        );
        ui.label(words);
    }

    fn plot(&self, ui: &mut egui::Ui) {
        let curve = &self.exhibit.rehearsal.curve;
        let own: Vec<PlotPoint> = curve
            .iter()
            .map(|[travel, force]| PlotPoint::new(1e3 * travel, *force))
            .collect();
        let felt = PlotPoints::Borrowed(self.seen.trail.points());
        let sample = self.seen.sample.as_ref();
        let here = sample.map(|s| [1e3 * s.gone.travel, s.resistance]);
        let height = (ui.available_height() - 400.0).clamp(170.0, 330.0);
        ui.horizontal(|ui| {
            ui.colored_label(FELT, "— felt");
            ui.colored_label(OWN, "— the part's own curve");
        });
        Plot::new("force against travel")
            .height(height)
            .grid_color(Color32::from_gray(185))
            .x_axis_label("travel, mm")
            .y_axis_label("force, N")
            .allow_scroll(false)
            .allow_drag(false)
            .allow_zoom(false)
            .allow_boxed_zoom(false)
            .include_y(0.0)
            .grid_spacing(egui::Rangef::new(5.0, 120.0))
            .show(ui, |plot| {
                let own = Line::new("the part's own curve", PlotPoints::Owned(own));
                plot.line(own.color(OWN).width(1.5));
                plot.line(Line::new("felt", felt).color(FELT).width(2.5));
                if let Some(here) = here {
                    let now = Points::new("", here);
                    plot.points(now.color(FELT).radius(5.0));
                }
            });
    }

    fn hand(&mut self, ui: &mut egui::Ui) {
        let Some(hand) = &self.hand else {
            ui.label(format!("Held by {}.", self.facts.device));
            return;
        };
        ui.horizontal(|ui| {
            ui.label("push");
            let mut push = 1e3 * hand.push();
            let longest = 1e3 * hand.longest();
            ui.spacing_mut().slider_width = 240.0;
            let slider = egui::Slider::new(&mut push, 0.0..=longest).show_value(false);
            if ui.add(slider).changed() {
                hand.push_to(1e-3 * push);
            }
            ui.label(format!("{:.2} mm", 1e3 * hand.push()));
        });
        ui.horizontal(|ui| {
            let show = if hand.shows() {
                "Stop (P)"
            } else {
                "Push and pull once (P)"
            };
            if ui.button(show).clicked() {
                hand.toggle_show();
            }
            if ui.button("Back to the start (R)").clicked() {
                hand.reset();
            }
        });
        ui.label("Space pushes, Shift + Space pulls; F1: mouse and keys");
    }

    fn loop_facts(&self, ui: &mut egui::Ui) {
        let trail = &self.seen.trail;
        let sample = self.seen.sample.as_ref();
        let arming = sample.map(|s| s.servo.arming.to_string());
        let arming = arming.unwrap_or_else(|| "no pose from the device yet".to_owned());
        let contacts = sample.map_or_else(String::new, |s| {
            let sticking = match self.facts.has_friction {
                true => format!(", {} stick", s.report.sticking),
                false => String::new(),
            };
            let trouble = match s.report.lcp_solved && s.report.converged {
                true => "",
                false => ", not converged",
            };
            format!("{}{sticking}{trouble}", s.report.contacts)
        });
        let late = match trail.n_periods {
            0 => "none".to_owned(),
            n => format!("{} of {n}", trail.n_late),
        };
        let rows = [
            ("force", arming),
            ("contacts", contacts),
            (
                "loop",
                format!(
                    "{:.0} of {:.0} periods/s;  window {:.0} pictures/s",
                    self.pace.periods_per_s,
                    1.0 / self.facts.period_s,
                    self.pace.pictures_per_s
                ),
            ),
            ("late", late),
            (
                "answer",
                format!(
                    "median {} µs, 99.9 % below {} µs",
                    trail.response_us(0.5),
                    trail.response_us(0.999)
                ),
            ),
            ("effects", self.facts.effects.clone()),
            ("surface", format!("multiplied on {}", self.seen.multiply())),
            ("device", self.facts.device.clone()),
            ("coupling", self.facts.coupling.clone()),
        ];
        let is_alarm = |name: &str| name == "late" && trail.n_late * 1000 > trail.n_periods;
        egui::Grid::new("facts").num_columns(2).show(ui, |ui| {
            for (name, words) in rows {
                ui.label(RichText::new(name).color(OWN));
                let words = RichText::new(words);
                let words = if is_alarm(name) {
                    words.color(ALARM)
                } else {
                    words
                };
                ui.add(egui::Label::new(words).wrap());
                ui.end_row();
            }
        });
    }

    fn messages(&self, ui: &mut egui::Ui) {
        if self.seen.told.is_empty() {
            return;
        }
        ui.separator();
        egui::ScrollArea::vertical()
            .stick_to_bottom(true)
            .show(ui, |ui| {
                for told in &self.seen.told {
                    ui.add(egui::Label::new(RichText::new(told).small()).wrap());
                }
            });
    }
}
