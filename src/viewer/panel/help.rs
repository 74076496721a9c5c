//! Section *Help*: the keys, with current values.

use egui::{Grid, RichText, Ui};

use crate::viewer::navigation::Travel;

/// Shows the keys for a way to get about at a speed [m/s].
pub fn show(ui: &mut Ui, travel: Travel, speed_m_per_s: f64) {
    let (way, wheel) = match travel {
        Travel::Fly | Travel::Walk => (
            "hold to look around",
            format!("speed ±5 % a notch, now {speed_m_per_s:.3} m/s"),
        ),
        Travel::Orbit => ("hold to turn around it", "nearer, farther".to_owned()),
    };
    let now = format!("fly, walk, orbit; now {}", travel.name());
    let lines = [
        ("V", now.as_str()),
        ("W A S D", "forward, left, back, right"),
        ("E  Q", "up, down, but on foot"),
        ("Shift  Ctrl", "four times as fast, a quarter"),
        ("Right mouse, M", way),
        ("Wheel", wheel.as_str()),
        ("1 … 9", "views kept with Ctrl+1 … Ctrl+9"),
        ("C", "next camera of the file"),
        ("F", "frame what has handles, or the whole scene"),
        ("R", "re-bake"),
        ("Ctrl+Z", "take the last change back"),
        ("Ctrl+Y", "do it again; Ctrl+Shift+Z too"),
        ("P", "probe: click on a surface to see what lights it"),
        ("K", "add a key to the camera's path"),
        ("F12", "save the picture as .png and .exr"),
        ("Click", "on an object: handles to move and turn it"),
        ("Esc", "let go of mouse and handles, cancel the bake"),
        ("H  ?", "open or close this list"),
    ];
    Grid::new("keys")
        .num_columns(2)
        .spacing([12.0, 2.0])
        .show(ui, |ui| {
            for (key, meaning) in lines {
                ui.label(RichText::new(key).strong());
                ui.label(meaning);
                ui.end_row();
            }
        });
}
