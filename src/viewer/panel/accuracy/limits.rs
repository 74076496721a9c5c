//! Rows of the section *Accuracy* for where the light pass gives up.

use egui::{Response, Slider, SliderClamping, Ui};

use crate::settings::{BakeSettings, MOST_WAVEFRONTS};
use crate::viewer::panel::control::{About, choice, chosen, rows, setting, significant};
use crate::viewer::panel::light_pass;

const DEPTH: About = About {
    label: "Max depth",
    what: "Largest number of glass, mirror and water surfaces on a light path.",
    range: "1 to 1,000; logarithmic; more can be typed",
    default: "16",
    accuracy: "light beyond it is missing from the maps and booked as truncated",
    cost: "little where light leaves the glass soon; light caught in a ring of mirrors takes time in proportion",
};
const THRESHOLD: About = About {
    label: "Weakest branch",
    what: "Where glass splits light, branches that carry less than this share of their light ray's flux are not followed.",
    range: "0.000001 to 0.5; logarithmic; 0 can be typed",
    default: "0.003 of the max error; 0.0001 without one",
    accuracy: "what is left out is missing from the maps and booked as truncated",
    cost: "a tenth of it follows about one more reflection inside each piece of glass",
};
const WAVEFRONTS: About = About {
    label: "Wavefronts",
    what: "How many places on a lamp that has a size, or on a rough surface, soft light is the mean of.",
    range: "as needed, or a power of two from 1 to 16,384",
    default: "as needed for the max error; 32 without one",
    accuracy: "few show as separate edges in soft shadows and caustics",
    cost: "time grows in proportion to it; lamps without a size on smooth surfaces take none of it",
};

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
        setting(ui, &DEPTH, no_caustic, depth, |ui, depth| {
            let slider = Slider::new(depth, DEPTHS).logarithmic(true);
            ui.add(slider.clamping(SliderClamping::Never))
        });
        let share = (&mut settings.branch_threshold, &default.branch_threshold);
        setting(ui, &THRESHOLD, no_caustic, share, |ui, share| {
            threshold(ui, share, automatic)
        });
        let count = (&mut settings.wavefronts, &default.wavefronts);
        setting(ui, &WAVEFRONTS, no_caustic, count, wavefronts);
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
    let selected = chosen(count, &choices).to_owned();
    choice(ui, "wavefronts", count, &selected, &choices)
}
