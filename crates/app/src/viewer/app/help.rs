//! What mouse and keys do.

use eframe::egui;

const VIEW: [(&str, &str); 5] = [
    ("left drag", "turn the part"),
    ("middle drag, Shift + left drag", "move the picture"),
    ("wheel", "zoom at the pointer"),
    ("Home", "first view again"),
    ("F12", "save the window as a PNG in this folder"),
];

const HAND: [(&str, &str); 7] = [
    ("Space", "push, at the speed of the scene's hand"),
    ("Shift + Space", "pull"),
    ("Up, Down", "push, pull slowly"),
    ("Left, Right", "move aside slowly"),
    (
        "right drag, Ctrl + left drag",
        "move the tool in the picture's plane",
    ),
    ("Ctrl + wheel", "push and pull"),
    ("P, R", "push and pull once; back to the start"),
];

const OTHER: [(&str, &str); 2] = [("C", "clear the felt curve"), ("F1, Esc", "close this")];

/// Over everything. `has_hand`: whether the mouse moves the tool.
pub(super) fn show(context: &egui::Context, has_hand: bool) {
    egui::Window::new("Mouse and keys")
        .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
        .collapsible(false)
        .resizable(false)
        .show(context, |ui| {
            let hand: &[_] = if has_hand { &HAND } else { &[] };
            for (name, rows) in [("View", &VIEW[..]), ("Hand", hand), ("Other", &OTHER)] {
                if rows.is_empty() {
                    continue;
                }
                ui.add_space(4.0);
                ui.strong(name);
                egui::Grid::new(name).num_columns(2).show(ui, |ui| {
                    for (keys, what) in rows {
                        ui.monospace(*keys);
                        ui.label(*what);
                        ui.end_row();
                    }
                });
            }
            ui.add_space(6.0);
            ui.label(
                "Colours: length of the displacement, to scale, never exaggerated. Arrows: forces on the part, \
                 faint where something hides them.",
            );
        });
}
