//! Section *Help*: the keys, with current values.

use egui::{Grid, RichText, Ui};

/// Shows the keys; `speed_m_per_s` is the present flying speed.
pub fn show(ui: &mut Ui, speed_m_per_s: f64) {
    let speed = format!("speed ±5 % a notch, now {speed_m_per_s:.3} m/s");
    let lines = [
        ("W A S D", "fly forward, left, back, right"),
        ("E  Q", "fly up, down"),
        ("Shift", "four times as fast"),
        ("Right mouse", "hold to look around"),
        ("Wheel", speed.as_str()),
        ("C", "next camera of the file"),
        ("F", "frame the whole scene"),
        ("R", "re-bake"),
        ("Ctrl+Z", "take the last change of the scene back"),
        ("F12", "save the picture as .png and .exr"),
        ("Esc", "let go of the mouse, cancel the bake"),
        ("H", "open or close this list"),
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
