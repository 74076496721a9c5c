//! Rows of the section *Accuracy* for where the light pass gives up.

use egui::{Response, Slider, SliderClamping, Ui};

use crate::settings::{BakeSettings, MOST_WAVEFRONTS};
use crate::viewer::panel::control::{choice, rows, setting, significant};
use crate::viewer::panel::light_pass;

/// Ends of the slider; every share that settings may have can be typed.
const SHARES: std::ops::RangeInclusive<f64> = 1e-6..=0.5;
const DEPTHS: std::ops::RangeInclusive<u32> = 1..=1000;

/// Shows the rows.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = light_pass::no_caustic(settings);
    let default = BakeSettings::default();
    let automatic = settings.path_threshold();
    rows(ui, "limits", |ui| {
        let depth = (&mut settings.max_depth, &default.max_depth);
        setting(ui, "Max depth", no_caustic, depth, |ui, depth| {
            let slider = Slider::new(depth, DEPTHS).logarithmic(true);
            ui.add(slider.clamping(SliderClamping::Never))
        });
        let share = (&mut settings.branch_threshold, &default.branch_threshold);
        setting(ui, "Weakest branch", no_caustic, share, |ui, share| {
            threshold(ui, share, automatic)
        });
        let count = (&mut settings.wavefronts, &default.wavefronts);
        setting(ui, "Wavefronts", no_caustic, count, wavefronts);
    });
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

fn wavefronts(ui: &mut Ui, count: &mut Option<u32>) -> Response {
    let powers = (0..=MOST_WAVEFRONTS.ilog2()).map(|power| 1 << power);
    let named: Vec<(u32, String)> = powers.map(|count: u32| (count, count.to_string())).collect();
    let exactly = named.iter();
    let exactly = exactly.map(|(count, name)| (Some(*count), name.as_str(), "exactly so many"));
    let needed = (
        None,
        "as needed",
        "as many as the max error needs; 32 without one",
    );
    let choices: Vec<_> = std::iter::once(needed).chain(exactly).collect();
    choice(ui, "wavefronts", count, "custom", &choices)
}
