//! Mouse and keys over the picture.

use eframe::egui::{self, Event, Key, MouseWheelUnit, PointerButton, Response, Ui};
use glam::{DVec2, DVec3};

use super::super::camera::Camera;
use super::super::hand::Hand;

/// rad, of a drag over the whole height.
const TURN: f64 = 3.5;

/// Zoom of one notch of the wheel.
const NOTCH: f64 = 1.15;

/// Of the slider's way, what one notch pushes.
const PUSH: f64 = 0.01;

/// Of the hand's speed, that of the arrow keys.
const SLOW: f64 = 0.25;

/// Points of scrolling that are a notch.
const POINTS_PER_NOTCH: f64 = 50.0;

/// Turns, moves and zooms the camera, or moves the tool.
pub(super) fn follow(ui: &Ui, response: &Response, camera: &mut Camera, hand: Option<&Hand>) {
    let height = f64::from(response.rect.height()).max(1.0);
    let in_heights = |v: egui::Vec2| DVec2::new(f64::from(v.x), f64::from(v.y)) / height;
    let modifiers = ui.input(|i| i.modifiers);
    let shift = in_heights(response.drag_delta());
    let moves_tool = response.dragged_by(PointerButton::Secondary)
        || (response.dragged_by(PointerButton::Primary) && modifiers.command);
    let pans = response.dragged_by(PointerButton::Middle)
        || (response.dragged_by(PointerButton::Primary) && modifiers.shift);
    let notches = if response.hovered() { wheel(ui) } else { 0.0 };
    match hand {
        Some(hand) if moves_tool => hand.drag(camera.in_plane(shift)),
        Some(hand) if notches != 0.0 && (modifiers.command || modifiers.shift) => {
            hand.push_to(hand.push() - notches * PUSH * hand.longest());
        }
        _ if moves_tool => {}
        _ if pans => camera.pan(shift),
        _ if response.dragged_by(PointerButton::Primary) => camera.orbit(shift * TURN),
        _ if notches != 0.0 => {
            let pointer = response.hover_pos().unwrap_or(response.rect.center());
            let at = in_heights(pointer - response.rect.center());
            camera.zoom(NOTCH.powf(notches), at);
        }
        _ => {}
    }
}

/// Notches of the wheel since the last picture, towards the screen above zero.
fn wheel(ui: &Ui) -> f64 {
    ui.input(|i| {
        let turned = i.events.iter().map(|event| match event {
            Event::MouseWheel { unit, delta, .. } => {
                // With Shift some systems scroll sideways.
                let way = f64::from(delta.x + delta.y);
                match unit {
                    MouseWheelUnit::Point => way / POINTS_PER_NOTCH,
                    MouseWheelUnit::Line | MouseWheelUnit::Page => way,
                }
            }
            _ => 0.0,
        });
        turned.sum()
    })
}

/// Keys that move the tool. `last`: the velocity that was asked for, world, m/s.
pub(super) fn keys(ui: &Ui, hand: &Hand, camera: &Camera, last: &mut DVec3) {
    let modifiers = ui.input(|i| i.modifiers);
    let down = |key: Key| f64::from(u8::from(ui.input(|i| i.key_down(key))));
    let space = if modifiers.shift { -1.0 } else { 1.0 } * down(Key::Space);
    let along = space + SLOW * (down(Key::ArrowUp) - down(Key::ArrowDown));
    let aside = SLOW * (down(Key::ArrowRight) - down(Key::ArrowLeft));
    let right = camera.in_plane(DVec2::X).normalize_or(DVec3::X);
    // Nothing is gained by pulling further than to the start.
    let along = if hand.push() <= 0.0 {
        along.max(0.0)
    } else {
        along
    };
    let velocity = hand.speed() * (along * hand.direction() + aside * right);
    if velocity != *last {
        hand.go_at(velocity);
        *last = velocity;
    }
    let pressed = |key: Key| ui.input(|i| i.key_pressed(key));
    if pressed(Key::P) {
        hand.toggle_show();
    }
    if pressed(Key::R) {
        hand.reset();
    }
}
