//! Rows of section *Scene* for the waves of a material.

use egui::{DragValue, Response, Ui};
use glam::DVec3;

use super::Command;
use super::bake::FAILED;
use super::control::{edited, setting, slider};
use crate::scene::waves::STEEPEST_SLOPE;
use crate::scene::{Edit, MaterialEdit, Wave, Waves};

/// Smallest amplitude that scaling starts from [m].
const MIN_HEIGHT_M: f64 = 1e-6;
/// Slopes nearer than this count as equal.
const SAME_SLOPE: f64 = 1e-9;

/// Shows the waves of a material; their defaults are those of the file. Pushes edits to `commands`.
pub fn show(
    ui: &mut Ui,
    material: usize,
    (waves, of_file): (&Waves, Option<&Waves>),
    commands: &mut Vec<Command>,
) {
    let mut list = waves.list().to_vec();
    let in_file = of_file.map_or(&[][..], Waves::list);
    slope(ui, &mut list, in_file);
    for (index, wave) in list.iter_mut().enumerate() {
        let default = *in_file.get(index).unwrap_or(wave);
        setting(ui, "Wave", None, (wave, &default), one);
    }
    if list == waves.list() {
        return;
    }
    match Waves::new(list) {
        Ok(waves) => {
            commands.push(Command::Edit(Edit::Material(
                material,
                MaterialEdit::Waves(Some(waves)),
            )));
        }
        Err(why) => {
            ui.colored_label(FAILED, why);
            ui.end_row();
        }
    }
}

/// A row with the sum of all slopes, which scales all amplitudes.
fn slope(ui: &mut Ui, list: &mut [Wave], in_file: &[Wave]) {
    let of = |list: &[Wave]| list.iter().map(Wave::slope).sum::<f64>();
    let (present, in_file) = (of(list), of(in_file));
    // Ignores rounding errors.
    let is_as_in_file = (present - in_file).abs() < SAME_SLOPE;
    let default = if is_as_in_file { present } else { in_file };
    let add = slider(0.0..=STEEPEST_SLOPE, 3);
    let Some(wanted) = edited(ui, "Waves' slope", None, (&present, &default), add) else {
        return;
    };
    for wave in list.iter_mut() {
        // Flat waves get equal amplitudes, so that scaling can raise them.
        wave.amplitude_m = wave.amplitude_m.max(MIN_HEIGHT_M);
    }
    let present = of(list);
    for wave in list.iter_mut() {
        wave.amplitude_m *= wanted / present;
    }
}

fn one(ui: &mut Ui, wave: &mut Wave) -> Response {
    let mut azimuth_deg = wave.direction.x.atan2(-wave.direction.z).to_degrees();
    let before = azimuth_deg;
    let response = ui
        .horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.spacing_mut().interact_size.x = 58.0;
            let fine = |value: f64| 0.01 * value.max(MIN_HEIGHT_M);
            let (height_speed, length_speed) = (fine(wave.amplitude_m), fine(wave.wavelength_m));
            number(ui, &mut wave.amplitude_m, 5, |shown| {
                shown.speed(height_speed).range(0.0..=f64::MAX).prefix("A: ")
            })
            .accessible_name("Wave: height [m]")
            .union(
                number(ui, &mut wave.wavelength_m, 4, |shown| {
                    shown
                        .speed(length_speed)
                        .range(f64::MIN_POSITIVE..=f64::MAX)
                        .prefix("λ: ")
                })
                .accessible_name("Wave: length [m]"),
            )
            .union(
                number(ui, &mut azimuth_deg, 1, |shown| {
                    shown.speed(0.5).range(-360.0..=360.0).prefix("az.: ")
                })
                .accessible_name("Wave: azimuth [°]"),
            )
        })
        .inner;
    if azimuth_deg != before {
        let azimuth = azimuth_deg.to_radians();
        wave.direction = DVec3::new(azimuth.sin(), 0.0, -azimuth.cos());
    }
    response
}

/// A number shown with this many decimals. Rounding for display does not change the value.
fn number(
    ui: &mut Ui,
    value: &mut f64,
    decimals: i32,
    style: impl FnOnce(DragValue<'_>) -> DragValue<'_>,
) -> Response {
    let unit = 10_f64.powi(-decimals);
    let rounded = (*value / unit).round() * unit;
    let mut shown = rounded;
    let response = ui.add(style(DragValue::new(&mut shown)).max_decimals(decimals as usize));
    if (shown - rounded).abs() > 1e-9 * unit {
        *value = shown;
    }
    response
}
