//! Rows of section *Scene* for a material: its glass, its surface and its waves.

use std::sync::Arc;

use egui::{DragValue, Response, Ui};
use glam::DVec3;

use super::bake::FAILED;
use super::control::{CONTROL_WIDTH, Entry, edited, pick, setting, slider};
use super::{Command, Model};
use crate::optics::glass::{Dispersion, catalogue};
use crate::optics::{Glass, LinearSrgb};
use crate::scene::waves::STEEPEST_SLOPE;
use crate::scene::{Edit, Material, MaterialEdit, SurfaceKind, Wave, Waves};

const NO_IOR: &str = "Only glass, water and coats have one; this surface is matte or a mirror.";
const ONE_INDEX: &str = "one index";
/// Shown for a glass that is not in the catalogue.
const BY_NUMBERS: &str = "by numbers";
/// Smallest amplitude that scaling starts from [m].
const MIN_HEIGHT_M: f64 = 1e-6;
/// Slopes nearer than this count as equal.
const SAME_SLOPE: f64 = 1e-9;

/// Shows the rows of a material; their defaults are those of the file. Pushes edits to `commands`.
pub fn show(ui: &mut Ui, index: usize, model: &Model, commands: &mut Vec<Command>) {
    let (shown, of_file) = (&model.scene().materials[index], &model.loaded().materials[index]);
    let is_opaque = matches!(shown.surface, SurfaceKind::Diffuse | SurfaceKind::Mirror);
    let no_ior = is_opaque.then_some(NO_IOR);
    let mut push = |edit: Option<MaterialEdit>| {
        commands.extend(edit.map(|edit| Command::Edit(Edit::Material(index, edit))))
    };
    let ior = (&shown.ior, &of_file.ior);
    push(edited(ui, "Refractive index", no_ior, ior, slider(1.0..=3.0, 3)).map(MaterialEdit::Ior));
    push(substance(ui, shown, of_file, no_ior));
    let roughness = (&shown.roughness, &of_file.roughness);
    push(edited(ui, "Roughness", None, roughness, slider(0.0..=1.0, 2)).map(MaterialEdit::Roughness));
    if let Some(present) = shown.bending_waves() {
        push(waves(ui, present, of_file.bending_waves()));
    }
    let base_colour = (&shown.base_colour, &of_file.base_colour);
    push(edited(ui, "Base colour", None, base_colour, colour).map(MaterialEdit::BaseColour));
}

fn colour(ui: &mut Ui, base_colour: &mut LinearSrgb) -> Response {
    let mut colour = base_colour.to_array().map(|channel| channel as f32);
    let response = ui.color_edit_button_rgb(&mut colour);
    if response.changed() {
        *base_colour = LinearSrgb::from(colour.map(|channel| f64::from(channel.clamp(0.0, 1.0))));
    }
    response
}

/// Rows of the glass and its dispersion.
fn substance(
    ui: &mut Ui,
    shown: &Material,
    of_file: &Material,
    why_not: Option<&str>,
) -> Option<MaterialEdit> {
    let mut glass = edited(ui, "Glass", why_not, (&shown.glass, &of_file.glass), by_name);
    let (before, default) = (dispersion_of(shown), dispersion_of(of_file));
    let value = (&before, &default);
    if let Some(dispersion) = edited(ui, "Dispersion [20/V]", why_not, value, slider(0.0..=1.0, 3)) {
        // The file's dispersion restores the file's glass.
        glass = Some(if dispersion == default && shown.ior == of_file.ior {
            of_file.glass.clone()
        } else {
            let is_dispersive = dispersion > 0.0;
            is_dispersive.then(|| Arc::new(Glass::with_abbe_number(shown.ior, 20.0 / dispersion)))
        });
    }
    let glass = glass.filter(|glass| *glass != shown.glass)?;
    Some(MaterialEdit::Substance {
        ior: glass.as_ref().map_or(shown.ior, |glass| glass.dispersion.n_d()),
        glass,
        base_colour: shown.base_colour,
        metal: shown.metal,
    })
}

/// 20 over the Abbe number; 0 without dispersion.
fn dispersion_of(material: &Material) -> f64 {
    let glass = material.glass.as_ref();
    let parting = glass.filter(|glass| glass.dispersion.is_dispersive());
    let abbe_number = parting.map(|glass| match glass.dispersion {
        // The exact number: the fitted formula reproduces it only approximately.
        Dispersion::Abbe { v_d, .. } => v_d,
        other => other.abbe_number(),
    });
    // Rounded to the digits shown, so that displaying the number does not change it.
    abbe_number.map_or(0.0, |v_d| (20.0 / v_d * 1e3).round() / 1e3)
}

fn by_name(ui: &mut Ui, glass: &mut Option<Arc<Glass>>) -> Response {
    let all: Vec<&Glass> = catalogue::all().collect();
    let known = |glass: &Glass| all.iter().position(|known| known.name == glass.name);
    // The first entry stands for no glass.
    let (shown, at) = match glass.as_deref() {
        None => (ONE_INDEX, Some(0)),
        Some(glass) => match known(glass) {
            Some(index) => (all[index].name.as_str(), Some(index + 1)),
            None => (BY_NUMBERS, None),
        },
    };
    let mut names: Vec<Entry> = vec![(ONE_INDEX, "".into(), None)];
    names.extend(all.iter().map(|glass| {
        let (n_d, abbe) = (glass.dispersion.n_d(), glass.dispersion.abbe_number());
        let hover = format!("n = {n_d:.4}, Abbe number {abbe:.1}");
        (glass.name.as_str(), hover.into(), None)
    }));
    let (response, picked) = pick(ui, ("glass", CONTROL_WIDTH), (shown, at), &names);
    if let Some(index) = picked {
        *glass = index.checked_sub(1).map(|index| Arc::new(all[index].clone()));
    }
    response
}

/// Rows of the waves: their slope, and each by itself.
fn waves(ui: &mut Ui, waves: &Waves, of_file: Option<&Waves>) -> Option<MaterialEdit> {
    let mut list = waves.list().to_vec();
    let in_file = of_file.map_or(&[][..], Waves::list);
    slope(ui, &mut list, in_file);
    for (index, wave) in list.iter_mut().enumerate() {
        let default = *in_file.get(index).unwrap_or(wave);
        setting(ui, "Wave", None, (wave, &default), one);
    }
    if list == waves.list() {
        return None;
    }
    match Waves::new(list) {
        Ok(waves) => Some(MaterialEdit::Waves(Some(waves))),
        Err(why) => {
            ui.colored_label(FAILED, why);
            ui.end_row();
            None
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
    // An azimuth of 0 points along −z, as for lights.
    let mut azimuth_deg = wave.direction.x.atan2(-wave.direction.z).to_degrees();
    let before = azimuth_deg;
    let response = ui
        .horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.spacing_mut().interact_size.x = 58.0;

            // A point of a drag changes a length by one per cent: waves range from ripples to swell.
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

    // Without an edit the direction stays as it is: on the way over the angle it would be rounded.
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
