//! Rows of the section *Accuracy* for where the light pass gives up, and what its error means.

use egui::{Response, Slider, SliderClamping, Ui};

use crate::settings::{BakeSettings, Estimator};
use crate::viewer::panel::control::{listed, rows, setting, significant};
use crate::viewer::panel::light_pass;

/// Ends of the slider; every share that settings may have can be typed.
const SHARES: std::ops::RangeInclusive<f64> = 1e-6..=0.5;
const DEPTHS: std::ops::RangeInclusive<u32> = 1..=1000;

const NO_TARGET: &str = "No error is aimed at.";

/// Shows the rows.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = light_pass::no_caustic(settings);
    let default = BakeSettings::default();
    let automatic = settings.path_threshold();
    let usual_depth = match settings.estimator {
        Estimator::Auto | Estimator::Photon => settings.photon_depth(),
        Estimator::Wavefront | Estimator::Splat => settings.depth(),
    };
    let no_metric = no_caustic.or(settings.max_error.is_none().then_some(NO_TARGET));
    rows(ui, "limits", |ui| {
        let metric = (&mut settings.error_metric, &default.error_metric);
        setting(ui, "Error is", no_metric, metric, |ui, metric| {
            listed(ui, "error metric", metric)
        });
        let depth = (&mut settings.max_depth, &default.max_depth);
        setting(ui, "Max depth", no_caustic, depth, |ui, depth| {
            automatic_depth(ui, depth, usual_depth)
        });
        let share = (&mut settings.branch_threshold, &default.branch_threshold);
        setting(ui, "Weakest branch", no_caustic, share, |ui, share| {
            threshold(ui, share, automatic)
        });
    });
}

/// The depth that counts; automatic until it is touched.
fn automatic_depth(ui: &mut Ui, depth: &mut Option<u32>, automatic: u32) -> Response {
    let mut shown = depth.unwrap_or(automatic);
    let slider = Slider::new(&mut shown, DEPTHS).logarithmic(true);
    let response = ui.add(slider.clamping(SliderClamping::Never));
    if response.changed() {
        *depth = Some(shown);
    }
    response
}

/// The share that counts; automatic until it is touched.
fn threshold(ui: &mut Ui, share: &mut Option<f64>, automatic: f64) -> Response {
    let mut shown = share.unwrap_or(automatic);
    let slider = Slider::new(&mut shown, SHARES).logarithmic(true);
    let slider = slider.clamping(SliderClamping::Never);
    let response = ui.add(slider.custom_formatter(|value, _| significant(value)));
    if response.changed() {
        *share = Some(shown);
    }
    response
}
