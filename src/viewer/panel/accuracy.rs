//! Section *Accuracy*: how good the next bake is to be, and what that may take.

pub mod course;
mod limits;
pub mod preset;
pub mod target;

use egui::{Response, Ui};

use super::control::{choice, rows, setting};
use super::light_pass;
use crate::settings::{BakeSettings, MapResolution};

/// Shows the section; `settings` holds what the user chose.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = light_pass::no_caustic(settings);
    rows(ui, "accuracy", |ui| {
        preset::show(ui, settings);
        target::show(ui, settings, no_caustic);
        let value = (&mut settings.map_resolution, &MapResolution::Auto);
        setting(ui, "Map size [texels]", None, value, map_resolution);
    });
}

/// Shows what is seldom changed.
pub fn show_limits(ui: &mut Ui, settings: &mut BakeSettings) {
    limits::show(ui, settings);
}

fn map_resolution(ui: &mut Ui, resolution: &mut MapResolution) -> Response {
    let square = |side| MapResolution::Fixed {
        width: side,
        height: side,
    };
    let custom = match *resolution {
        MapResolution::Auto => String::new(),
        MapResolution::Fixed { width, height } => format!("{width} × {height}"),
    };
    let sides = (6..=12).map(|power| 1_usize << power);
    let sides: Vec<(usize, String)> = sides.map(|side| (side, side.to_string())).collect();
    let auto = "starts coarse and doubles while footprints are finer than texels";
    let fixed = "so many across and down; 4096 take 200 MB per map and layer";
    let sides = sides
        .iter()
        .map(|(side, name)| (square(*side), name.as_str(), fixed));
    let choices: Vec<_> = std::iter::once((MapResolution::Auto, "auto", auto))
        .chain(sides)
        .collect();
    choice(ui, "map size", resolution, &custom, &choices)
}
