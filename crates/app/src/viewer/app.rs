//! The window itself.

mod facts;
mod help;
mod legend;
mod panel;
mod pointer;
mod saved;

use std::time::Duration;

use eframe::egui;
use eframe::egui_wgpu::RenderState;
use glam::DVec3;

use super::camera::Camera;
use super::exhibit::Exhibit;
use super::hand::Hand;
use super::scene3d::{Samples, Scene3d, Target};
use super::session::{Feed, Seen};
use crate::Error;
pub(crate) use facts::Facts;
use facts::Pace;
use saved::Saved;

/// Pictures a second at most; the loop shares the machine with them.
const MOST_PICTURES: f64 = 60.0;

/// Size of the window at first, points.
const SIZE: [f32; 2] = [1280.0, 800.0];

/// Width of the panel, points.
const PANEL: f32 = 400.0;

/// s, that a snap is told in large letters.
const BANNER_S: f64 = 1.6;

/// What a window is made of.
pub(crate) struct Parts<'a> {
    pub(crate) exhibit: &'a Exhibit,
    pub(crate) feed: Feed<'a>,
    /// What moves the tool here; `None` where a device does.
    pub(crate) hand: Option<Hand>,
    pub(crate) facts: Facts,
}

/// Opens the window and returns when it is closed or the loop has ended.
///
/// # Errors
/// No display, or none that can be drawn to.
pub(crate) fn open(parts: Parts<'_>) -> Result<(), Error> {
    let title = format!("{} - snapin", parts.exhibit.title);
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_inner_size(SIZE)
            .with_min_inner_size([720.0, 480.0]),
        renderer: eframe::Renderer::Wgpu,
        ..eframe::NativeOptions::default()
    };
    let create: eframe::AppCreator<'_> = Box::new(move |context| {
        look_of(&context.egui_ctx);
        let render = context.wgpu_render_state.clone();
        let render = render.ok_or("the window has no graphics adapter")?;
        Ok(Box::new(Window::new(parts, render)))
    });
    eframe::run_native(&title, options, create).map_err(|e| no_window(&e))
}

/// Why there is no window, with the mend.
fn no_window(error: &eframe::Error) -> Error {
    let mend = match error {
        eframe::Error::Wgpu(_) => {
            "install a graphics driver, or Mesa's software one (Debian: apt install libvulkan1 mesa-vulkan-drivers)"
        }
        _ => {
            "a display is needed: DISPLAY or WAYLAND_DISPLAY; without one, snapin live feels the scene and snapin view \
             --screenshot FILE --at TRAVEL draws it"
        }
    };
    // The last part is the reason; before it stand places in others' sources.
    let words = error.to_string();
    let why = words.rsplit(": ").next().unwrap_or(&words);
    Error::Input(format!("the window cannot be opened: {why}; {mend}"))
}

/// Light, and large enough to read.
fn look_of(context: &egui::Context) {
    context.set_theme(egui::Theme::Light);
    context.all_styles_mut(|style| {
        for (kind, size) in [
            (egui::TextStyle::Small, 13.0),
            (egui::TextStyle::Body, 15.5),
            (egui::TextStyle::Button, 15.5),
            (egui::TextStyle::Monospace, 15.0),
            (egui::TextStyle::Heading, 21.0),
        ] {
            if let Some(font) = style.text_styles.get_mut(&kind) {
                font.size = size;
            }
        }
        style.spacing.item_spacing = egui::vec2(8.0, 6.0);
        style.spacing.button_padding = egui::vec2(10.0, 5.0);
        style.visuals.override_text_color = Some(egui::Color32::from_rgb(30, 33, 38));
    });
}

struct Window<'a> {
    exhibit: &'a Exhibit,
    seen: Seen<'a>,
    hand: Option<Hand>,
    /// Of the hand by keys, world, m/s.
    velocity: DVec3,
    facts: Facts,
    camera: Option<Camera>,
    render: RenderState,
    scene: Scene3d,
    target: Target,
    samples: Samples,
    texture: egui::TextureId,
    pace: Pace,
    help: bool,
    saved: Saved,
    /// Snaps in and out that were told, and until when the last is shown, s.
    snaps: (u32, u32),
    banner: Option<(&'static str, f64)>,
}

impl<'a> Window<'a> {
    fn new(parts: Parts<'a>, render: RenderState) -> Self {
        let Parts {
            exhibit,
            feed,
            hand,
            facts,
        } = parts;
        let samples = match render.adapter.get_info().device_type {
            wgpu::DeviceType::Cpu => Samples::One,
            _ => Samples::Four,
        };
        let scene = exhibit.scene3d(&render.device, &render.queue, samples);
        let target = Target::new(&render.device, [1, 1], samples);
        let texture = render.renderer.write().register_native_texture(
            &render.device,
            target.view(),
            wgpu::FilterMode::Linear,
        );
        Self {
            exhibit,
            seen: Seen::new(feed, exhibit),
            hand,
            velocity: DVec3::ZERO,
            facts,
            camera: None,
            render,
            scene,
            target,
            samples,
            texture,
            pace: Pace::default(),
            help: false,
            saved: Saved::default(),
            snaps: (0, 0),
            banner: None,
        }
    }

    /// The scene, drawn to fit and shown.
    fn picture(&mut self, ui: &mut egui::Ui) {
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, egui::Sense::click_and_drag());
        let scale = ui.ctx().pixels_per_point();
        let size = [rect.width(), rect.height()].map(|v| (v * scale).round().max(1.0) as u32);
        let exhibit = self.exhibit;
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let mut camera = *self.camera.get_or_insert_with(|| exhibit.camera(aspect));
        pointer::follow(ui, &response, &mut camera, self.hand.as_ref());
        self.camera = Some(camera);
        if self.target.size() != size {
            self.target = Target::new(&self.render.device, size, self.samples);
            self.render
                .renderer
                .write()
                .update_egui_texture_from_wgpu_texture(
                    &self.render.device,
                    self.target.view(),
                    wgpu::FilterMode::Linear,
                    self.texture,
                );
        }
        let (device, queue) = (&self.render.device, &self.render.queue);
        self.scene
            .draw(device, queue, &self.seen.moving, &camera, &self.target);
        let whole = egui::Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
        ui.painter()
            .image(self.texture, rect, whole, egui::Color32::WHITE);
        let legend = legend::Legend {
            exhibit,
            camera: &camera,
            largest_mm: 1e3 * self.seen.largest,
            has_friction: self.facts.has_friction,
            rect,
        };
        legend.draw(ui.painter());
        let now = ui.input(|i| i.time);
        if let Some((words, until)) = self.banner {
            legend::banner(ui.painter(), rect, words, ((until - now) / BANNER_S) as f32);
        }
    }

    /// What has snapped since the last picture.
    fn note_snaps(&mut self, now: f64) {
        let snap = &self.seen.snap;
        let (snaps_in, snaps_out) = self.snaps;
        if snap.n_snaps_in > snaps_in {
            self.banner = Some(("snapped in", now + BANNER_S));
        } else if snap.n_snaps_out > snaps_out {
            self.banner = Some(("came off", now + BANNER_S));
        }
        self.snaps = (snap.n_snaps_in, snap.n_snaps_out);
        self.banner = self.banner.filter(|(_, until)| now < *until);
    }

    fn keys(&mut self, ui: &egui::Ui) {
        use egui::Key;
        let pressed = |key: Key| ui.input(|i| i.key_pressed(key));
        if pressed(Key::F1) {
            self.help = !self.help;
        }
        if pressed(Key::Escape) {
            self.help = false;
        }
        if pressed(Key::Home) {
            self.camera = None;
        }
        if pressed(Key::C) {
            self.seen.trail.clear();
        }
        if pressed(Key::F12) {
            self.saved.ask(ui.ctx());
        }
        let camera = self.camera;
        if let (Some(hand), Some(camera)) = (&self.hand, camera) {
            pointer::keys(ui, hand, &camera, &mut self.velocity);
        }
    }
}

impl eframe::App for Window<'_> {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        if self.seen.is_over() {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
        let now = ui.input(|i| i.time);
        self.keys(ui);
        self.seen.look(self.exhibit);
        self.seen.told.extend(self.saved.told());
        self.pace.look(now, self.seen.trail.n_periods);
        self.note_snaps(now);
        egui::Panel::right("panel")
            .exact_size(PANEL)
            .resizable(false)
            .show(ui, |ui| self.panel(ui));
        egui::CentralPanel::no_frame().show(ui, |ui| self.picture(ui));
        if self.help {
            help::show(ui.ctx(), self.hand.is_some());
        }
        ui.ctx()
            .request_repaint_after(Duration::from_secs_f64(1.0 / MOST_PICTURES));
    }
}
