//! Section *Accuracy*: the target of the next bake, its limits, and where the light pass truncates light.

pub mod course;
pub mod target;

use egui::emath::Numeric;
use egui::{Response, Slider, SliderClamping, Ui};

use super::control::{choice, listed, rows, setting, significant};
use super::light_pass;
use crate::settings::{BakeSettings, Estimator, MapResolution};

/// Shows the section.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = light_pass::no_caustic(settings);
    rows(ui, "accuracy", |ui| {
        target::show_presets(ui, settings);
        target::show(ui, settings, no_caustic);
        let value = (&mut settings.map_resolution, &MapResolution::Auto);
        setting(ui, "Map size [texels]", None, value, map_resolution);
    });
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

/// Range of the slider; every valid value can be typed.
const SHARES: std::ops::RangeInclusive<f64> = 1e-6..=0.5;
const DEPTHS: std::ops::RangeInclusive<u32> = 1..=1000;

const NO_TARGET: &str = "No error is aimed at.";

/// Shows the subsection *Limits*.
pub fn show_limits(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = light_pass::no_caustic(settings);
    let default = BakeSettings::default();
    let usual_share = settings.path_threshold();
    let usual_depth = match settings.estimator {
        Estimator::Auto | Estimator::Photon => settings.photon_depth(),
        Estimator::Splat => settings.depth(),
    };
    let no_metric = no_caustic.or(settings.max_error.is_none().then_some(NO_TARGET));
    rows(ui, "limits", |ui| {
        let metric = (&mut settings.error_metric, &default.error_metric);
        setting(ui, "Error is", no_metric, metric, listed);
        let depth = (&mut settings.max_depth, &default.max_depth);
        setting(ui, "Max depth", no_caustic, depth, |ui, depth| {
            automatic(ui, depth, usual_depth, |shown| Slider::new(shown, DEPTHS))
        });
        let share = (&mut settings.branch_threshold, &default.branch_threshold);
        setting(ui, "Weakest branch", no_caustic, share, |ui, share| {
            automatic(ui, share, usual_share, |shown| {
                Slider::new(shown, SHARES).custom_formatter(|value, _| significant(value))
            })
        });
    });
}

/// A slider that shows the automatic value until the user changes it.
fn automatic<T: Numeric>(
    ui: &mut Ui,
    value: &mut Option<T>,
    usual: T,
    slider: impl FnOnce(&mut T) -> Slider<'_>,
) -> Response {
    let mut shown = value.unwrap_or(usual);
    let slider = slider(&mut shown).logarithmic(true);
    let response = ui.add(slider.clamping(SliderClamping::Never));
    // The history holds numbers as JSON, which knows no infinity.
    if response.changed() && shown.to_f64().is_finite() {
        *value = Some(shown);
    }
    response
}
