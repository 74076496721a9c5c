//! Section *Accuracy*: how good the next bake is to be, and what that may take.

pub mod course;
mod limits;
pub mod preset;
pub mod target;

use egui::{Response, Ui};

use super::control::{About, choice, rows, setting};
use super::light_pass;
use crate::settings::{BakeSettings, MapResolution};

const MAP_RESOLUTION: About = About {
    label: "Map size [texels]",
    what: "Texels across and down of every map; automatic maps of flat surfaces are finer where light is finer.",
    range: "auto, 64 to 4096",
    default: "auto",
    accuracy: "details finer than a texel are averaged",
    cost: "memory and the direct layer's time grow with its square",
};

/// Shows the section; `settings` holds what the user chose.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = light_pass::no_caustic(settings);
    rows(ui, "accuracy", |ui| {
        preset::show(ui, settings);
        target::show(ui, settings, no_caustic);
        let value = (&mut settings.map_resolution, &MapResolution::Auto);
        setting(ui, &MAP_RESOLUTION, None, value, map_resolution);
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
    let selected = match *resolution {
        MapResolution::Auto => "auto".into(),
        MapResolution::Fixed { width, height } if width == height => width.to_string(),
        MapResolution::Fixed { width, height } => format!("{width} × {height}"),
    };
    choice(
        ui,
        "map size",
        resolution,
        &selected,
        &[
            (
                MapResolution::Auto,
                "auto",
                "starts coarse and doubles while footprints are finer than texels",
            ),
            (square(64), "64", "64 × 64"),
            (square(128), "128", "128 × 128"),
            (square(256), "256", "256 × 256"),
            (square(512), "512", "512 × 512"),
            (square(1024), "1024", "1024 × 1024"),
            (square(2048), "2048", "2048 × 2048"),
            (square(4096), "4096", "4096 × 4096: 200 MB per map and layer"),
        ],
    )
}
