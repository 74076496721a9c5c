//! Rows of section *Scene* for a light.

use std::sync::Arc;

use egui::{DragValue, Response, Slider, SliderClamping, Ui};
use glam::DVec3;

use super::control::{CONTROL_WIDTH, edited, pick_name, significant};
use super::scene::coordinates;
use super::{Command, Model};
use crate::optics::LinearSrgb;
use crate::optics::spectrum::{Spectrum, illuminants};
use crate::scene::{Edit, Light, LightEdit, LightKind, LightSize};

/// Range of the slider, as factors of the strength in the file.
const POWER_FACTORS: (f64, f64) = (1e-2, 1e2);
/// Largest elevation that can be set [°]: the vertical has no azimuth.
const STEEPEST_DEG: f64 = 89.99;
/// Unit vectors nearer than this count as equal.
const SAME_DIRECTION: f64 = 1e-9;
/// Change per point of a drag, as a fraction of the radius; [m] if the radius is 0.
const RADIUS_SPEED: f64 = 0.01;
/// Change per point of a drag [°].
const ANGLE_SPEED_DEG: f64 = 0.01;
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
pub fn show(ui: &mut Ui, index: usize, model: &Model, commands: &mut Vec<Command>) {
    let light = &model.scene().lights[index];
    let of_file = model.scene().original_light(index, model.loaded());
    let (kind, kind_of_file) = (&light.kind, &of_file.kind);
    let mut push =
        |edit: Option<LightEdit>| commands.extend(edit.map(|edit| Command::Edit(Edit::Light(index, edit))));

    // Each kind of light has rows for what can be changed: panels, surfaces and environments keep extent and colour.
    push(power(ui, kind, kind_of_file));
    let sizes = (&light.size, &of_file.size);
    let size = match kind {
        LightKind::Point { .. } | LightKind::Spot { .. } => edited(ui, "Radius [m]", None, sizes, radius),
        LightKind::Sun { .. } => edited(ui, "Diameter [°]", None, sizes, diameter),
        LightKind::Panel { .. } | LightKind::Surface { .. } | LightKind::Environment { .. } => None,
    };
    push(size.map(LightEdit::Size));
    if matches!(
        kind,
        LightKind::Point { .. } | LightKind::Spot { .. } | LightKind::Sun { .. }
    ) {
        push(colour(ui, light, of_file));
    }

    // A sun has no position, and a point no direction.
    if let (Some(position), Some(default)) = (kind.position(), kind_of_file.position()) {
        let moved = edited(ui, "Position [m]", None, (&position, &default), |ui, moved| {
            coordinates(ui, "Position [m]", moved, model.scene())
        });
        push(moved.map(LightEdit::Position));
    }
    if let (Some(present), Some(default)) = (kind.direction(), kind_of_file.direction()) {
        let rotated = edited(ui, "Direction [°]", None, (&present, &default), angles);
        push(rotated.map(LightEdit::Direction));
    }
}

fn power(ui: &mut Ui, kind: &LightKind, of_file: &LightKind) -> Option<LightEdit> {
    let about = match kind {
        LightKind::Sun { .. } => "Irradiance [W/m²]",
        LightKind::Point { .. } | LightKind::Spot { .. } => "Intensity [W/sr]",
        LightKind::Panel { .. } | LightKind::Surface { .. } | LightKind::Environment { .. } => "Brightness",
    };
    let (present, default) = (kind.strength(), of_file.strength());
    let strength = edited(ui, about, None, (&present, &default), |ui, value| {
        ui.add(
            Slider::new(value, default * POWER_FACTORS.0..=default * POWER_FACTORS.1)
                .logarithmic(true)
                .clamping(SliderClamping::Never)
                .custom_formatter(|value, _| significant(value)),
        )
    });
    strength.map(LightEdit::Strength)
}

fn radius(ui: &mut Ui, size: &mut LightSize) -> Response {
    let mut radius_m = match *size {
        LightSize::Radius { radius_m } => radius_m,
        _ => 0.0,
    };
    let speed = if radius_m > 0.0 {
        RADIUS_SPEED * radius_m
    } else {
        RADIUS_SPEED
    };
    let response = number(ui, &mut radius_m, f64::MAX, speed);
    if response.changed() {
        *size = if radius_m > 0.0 {
            LightSize::Radius { radius_m }
        } else {
            LightSize::None
        };
    }
    response
}

fn diameter(ui: &mut Ui, size: &mut LightSize) -> Response {
    let mut angle_deg = match *size {
        LightSize::Angle { diameter_rad } => diameter_rad.to_degrees(),
        _ => 0.0,
    };
    let response = number(ui, &mut angle_deg, 180.0, ANGLE_SPEED_DEG);
    if response.changed() {
        let diameter_rad = angle_deg.to_radians();
        *size = if angle_deg > 0.0 {
            LightSize::Angle { diameter_rad }
        } else {
            LightSize::None
        };
    }
    response
}

fn number(ui: &mut Ui, value: &mut f64, most: f64, speed: f64) -> Response {
    ui.add(
        DragValue::new(value)
            .range(0.0..=most)
            .speed(speed)
            .max_decimals(4),
    )
}

/// Rows of the colour and the spectrum.
fn colour(ui: &mut Ui, light: &Light, of_file: &Light) -> Option<LightEdit> {
    let colour = edited(ui, "Colour", None, (&light.colour, &of_file.colour), button);
    let spectra = (&light.spectrum, &of_file.spectrum);
    let spectrum = edited(ui, "Spectrum", None, spectra, by_name);
    let (colour, spectrum) = match (colour, spectrum) {
        (_, Some(spectrum)) if spectrum == of_file.spectrum => (of_file.colour, spectrum),
        (_, Some(Some(found))) => (found.xyz().to_linear_srgb(), Some(found)),
        (_, Some(None)) => (within_reach(light.colour), None),
        (Some(colour), None) if colour == of_file.colour => (colour, of_file.spectrum.clone()),
        (Some(colour), None) => (colour, None),
        (None, None) => return None,
    };
    Some(LightEdit::Colour(colour, spectrum))
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

/// A row with the azimuth and elevation of a direction.
fn angles(ui: &mut Ui, direction: &mut DVec3) -> Response {
    let mut azimuth_deg = direction.x.atan2(-direction.z).to_degrees();
    let mut elevation_deg = direction.y.clamp(-1.0, 1.0).asin().to_degrees();
    let before = (azimuth_deg, elevation_deg);
    let response = ui
        .horizontal(|ui| {
            let angle = |value, range| DragValue::new(value).speed(0.5).range(range).max_decimals(1);
            let azimuth = ui.add(angle(&mut azimuth_deg, -360.0..=360.0).prefix("azimuth: "));
            let elevation = ui.add(angle(&mut elevation_deg, -90.0..=90.0).prefix("elev.: "));
            azimuth.union(elevation.accessible_name("Direction [°]: elevation"))
        })
        .inner;
    if (azimuth_deg, elevation_deg) != before {
        let azimuth = azimuth_deg.to_radians();
        let (sine, cosine) = elevation_deg
            .clamp(-STEEPEST_DEG, STEEPEST_DEG)
            .to_radians()
            .sin_cos();
        let rotated = DVec3::new(azimuth.sin() * cosine, sine, -azimuth.cos() * cosine);
        // Ignores the rounding error of the conversion to angles and back.
        if rotated.distance(*direction) > SAME_DIRECTION {
            *direction = rotated;
        }
    }
    response
}
