//! Section *Probe*: the light paths that reach the point which the user clicked.

use egui::{Grid, Ui};

use super::control::{about_button, ask, counted, grouped, significant};
use super::{Command, Model};
use crate::light_pass::explain::LightPath;
use crate::transport::Event;
use crate::units::LUMENS_PER_WATT;
use crate::viewer::probe::{Probed, ProbedTexel};
use crate::viewer::sketching::PreviewFlags;

/// Limit of the paths that are listed; the strongest come first.
const MAX_LISTED: usize = 8;

pub fn show(
    ui: &mut Ui,
    (is_on, sketched): (&mut bool, &mut PreviewFlags),
    model: &Model,
    commands: &mut Vec<Command>,
) {
    ui.horizontal(|ui| {
        ui.toggle_value(is_on, "Probe")
            .on_hover_text(about_button("Probe"));
        let none = model.probed().is_none().then_some("Nothing is probed yet.");
        ask(ui, "Clear probe", none, commands, Command::ClearProbe);
        let dark = model.maps().is_empty().then_some("No light is baked yet.");
        ask(ui, "Brightest spot", dark, commands, Command::Brightest);
    });

    sketch(ui, sketched, model);

    // A result stays when the mode is switched off, until it is cleared.
    let Some(probed) = model.probed() else {
        if *is_on {
            ui.weak("Click on a surface.");
        }
        return;
    };
    let [x, y, z] = probed.point.to_array();
    ui.label(format!("{} at {x:.4}, {y:.4}, {z:.4} m", probed.surface));

    // Values of the map are there at once, light paths as soon as a thread has found them.
    match &probed.texel {
        Some(texel) => figures(ui, texel),
        None => drop(ui.label("No light is baked onto it.")),
    }
    match &probed.explanation {
        Some(_) => paths(ui, probed, model),
        None if probed.texel.is_some() => drop(ui.weak("Looking for its light paths …")),
        None => {}
    }
}

/// Switches of the path preview.
fn sketch(ui: &mut Ui, sketched: &mut PreviewFlags, model: &Model) {
    ui.horizontal(|ui| {
        ui.label("Draw");
        ui.checkbox(&mut sketched.hits, "hits")
            .on_hover_text(about_button("hits"));
        ui.checkbox(&mut sketched.patches, "patches")
            .on_hover_text(about_button("patches"));
        if let Some(sketch) = model.sketch().filter(|_| sketched.is_any()) {
            let text = format!(
                "{} rays, {} patches",
                grouped(sketch.rays),
                grouped(sketch.patches.len() as u64)
            );
            ui.weak(text);
        }
    });
}

fn figures(ui: &mut Ui, texel: &ProbedTexel) {
    Grid::new("probed")
        .num_columns(2)
        .spacing([12.0, 2.0])
        .show(ui, |ui| {
            let mut line = |name: &str, text: String| {
                ui.label(name);
                ui.label(text);
                ui.end_row();
            };

            // Layers add up to the total, of which alone the error is estimated.
            let total = texel.total_w_m2();
            let error = texel
                .error_w_m2
                .map_or_else(String::new, |error| format!(" ± {}", significant(error)));
            line("irradiance", format!("{}{error} W/m²", significant(total)));
            for (kind, luminance) in &texel.layers {
                line(kind.name(), format!("{} W/m²", significant(*luminance)));
            }
            line(
                "illuminance",
                format!("{} lx", significant(LUMENS_PER_WATT * total)),
            );

            // The texel's size is the side of a square of its area on the surface.
            let [column, row] = texel.corner;
            let [width, height] = texel.map;
            let side_mm = 1e3 * texel.area_m2.sqrt();
            line(
                "texel",
                format!(
                    "{column}, {row} of {width} × {height}, {} mm",
                    significant(side_mm)
                ),
            );
        });
}

fn paths(ui: &mut Ui, probed: &Probed, model: &Model) {
    let Some(explanation) = &probed.explanation else {
        return;
    };
    if explanation.paths.is_empty() {
        ui.label("No light path leads here.");
    }
    for path in explanation.paths.iter().take(MAX_LISTED) {
        ui.label(format!("{}  {}", percent(probed.share(path)), chain(path, model)));
    }
    if explanation.paths.len() > MAX_LISTED {
        let rest: f64 = explanation.paths[MAX_LISTED..]
            .iter()
            .map(|path| probed.share(path))
            .sum();
        let more = counted(explanation.paths.len() - MAX_LISTED, "path");
        ui.label(format!("{}  {more} more", percent(rest)));
    }
    if !explanation.is_complete {
        ui.weak("Not all of it could be followed.");
    }
}

/// A share as text; small shares are not rounded to zero.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent > 0.0 && percent < 0.05 {
        return "<0.1 %".into();
    }
    format!("{percent:.1} %")
}

/// A path in words: "lamp, through ball, off mirror".
fn chain(path: &LightPath, model: &Model) -> String {
    let scene = model.scene();
    let light = scene.lights.get(path.light).map_or("light", |light| &light.name);
    let mut text = light.to_owned();
    for vertex in &path.vertices {
        let verb = match vertex.event {
            Event::Refraction | Event::ThinTransmission | Event::Passage => "through",
            Event::Reflection => "off",
            Event::TotalInternalReflection => "totally off",
        };
        let object = scene
            .objects
            .get(vertex.object)
            .map_or("surface", |object| &object.name);
        text += &format!(", {verb} {object}");
    }
    if path.vertices.is_empty() {
        text + ", straight"
    } else {
        text
    }
}
