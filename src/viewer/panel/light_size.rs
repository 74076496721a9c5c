//! The row of section *Scene* for the size of a light.

use egui::{DragValue, Response, Ui};

use super::Command;
use super::control::edited;
use crate::scene::{Edit, Light, LightEdit, LightKind, LightSize};

/// Change per point of a drag, as a fraction of the radius; [m] if the radius is 0.
const RADIUS_SPEED: f64 = 0.01;
/// Change per point of a drag [°].
const ANGLE_SPEED_DEG: f64 = 0.01;

/// Shows the size of a light, if its kind has one; its default is that of the file. Pushes edits to `commands`.
pub fn show(ui: &mut Ui, index: usize, (light, of_file): (&Light, &Light), commands: &mut Vec<Command>) {
    let value = (&light.size, &of_file.size);
    let size = match light.kind {
        LightKind::Point { .. } | LightKind::Spot { .. } => edited(ui, "Radius [m]", None, value, radius),
        LightKind::Sun { .. } => edited(ui, "Diameter [°]", None, value, diameter),
        LightKind::Panel { .. } | LightKind::Surface { .. } | LightKind::Environment { .. } => None,
    };
    let edit = |size| Command::Edit(Edit::Light(index, LightEdit::Size(size)));
    commands.extend(size.map(edit));
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
