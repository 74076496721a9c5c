//! Rows of section *Scene* for the colour and the spectrum of a light.

use std::sync::Arc;

use egui::{Response, Ui};

use super::Command;
use super::control::{CONTROL_WIDTH, edited, pick_name};
use crate::optics::LinearSrgb;
use crate::optics::spectrum::{Spectrum, illuminants};
use crate::scene::{Edit, Light, LightEdit};

const COLOUR_ALONE: &str = "a colour alone";
/// Spectra that are named by a number.
const BY_NUMBER: [&str; 7] = [
    "blackbody:2700",
    "blackbody:3200",
    "blackbody:4000",
    "blackbody:5600",
    "line:450",
    "line:532",
    "line:633",
];

/// Shows the rows of a light; their defaults are those of the file. Pushes edits to `commands`.
pub fn show(ui: &mut Ui, index: usize, (light, of_file): (&Light, &Light), commands: &mut Vec<Command>) {
    let colour = edited(ui, "Colour", None, (&light.colour, &of_file.colour), button);
    let spectrum = edited(
        ui,
        "Spectrum",
        None,
        (&light.spectrum, &of_file.spectrum),
        by_name,
    );
    let (colour, spectrum) = match (colour, spectrum) {
        (_, Some(spectrum)) if spectrum == of_file.spectrum => (of_file.colour, spectrum),
        (_, Some(Some(found))) => (found.xyz().to_linear_srgb(), Some(found)),
        (_, Some(None)) => (within_reach(light.colour), None),
        (Some(colour), None) if colour == of_file.colour => (colour, of_file.spectrum.clone()),
        (Some(colour), None) => (colour, None),
        (None, None) => return,
    };
    let edit = LightEdit::Colour(colour, spectrum);
    commands.push(Command::Edit(Edit::Light(index, edit)));
}

/// Clamps negative channels to zero.
fn within_reach(colour: LinearSrgb) -> LinearSrgb {
    LinearSrgb::from(colour.to_array().map(|channel| channel.max(0.0)))
}

fn button(ui: &mut Ui, colour: &mut LinearSrgb) -> Response {
    // The button clamps colours outside the gamut; the colour changes only when the user edits it.
    let mut rgb = colour.to_array().map(|channel| channel.clamp(0.0, 1.0) as f32);
    let response = ui.color_edit_button_rgb(&mut rgb);
    if response.changed() && rgb.iter().any(|channel| *channel > 0.0) {
        *colour = LinearSrgb::from(rgb.map(f64::from));
    }
    response
}

fn by_name(ui: &mut Ui, spectrum: &mut Option<Arc<Spectrum>>) -> Response {
    let names: Vec<&str> = std::iter::once(COLOUR_ALONE)
        .chain(illuminants::names())
        .chain(BY_NUMBER)
        .collect();
    let shown = match spectrum.as_ref() {
        None => COLOUR_ALONE,
        Some(spectrum) => spectrum.name().unwrap_or("of the file"),
    };
    let at = names.iter().position(|name| *name == shown);
    let (response, picked) = pick_name(ui, ("spectrum", CONTROL_WIDTH), (shown, at), &names);
    if let Some(index) = picked {
        // All names in the list are valid.
        *spectrum = match index {
            0 => None,
            _ => illuminants::illuminant(names[index]).ok().map(Arc::new),
        };
    }
    response
}
