//! How carefully to bake, by name: the presets of the command line.

use egui::Ui;

use crate::settings::{BakeSettings, MapResolution, Preset};
use crate::viewer::panel::control::{About, choice, chosen, setting};

const PRESET: About = About {
    label: "Preset",
    what: "How carefully to bake. Sets what ends the bake, the ray density, the map size and the limits; custom once one \
           of them is set otherwise.",
    range: "draft 10 %, preview 3 %, final 1 % of relative RMSE; splats 12,500, 100,000 and 800,000 rays/sr",
    default: "preview",
    accuracy: "as the name says, by the estimate",
    cost: "preview takes some ten times as long as a draft, final some ten times as long as a preview",
};
const PRESETS: [(Option<Preset>, &str, &str); 3] = [
    (
        Some(Preset::Draft),
        "draft",
        "10 % of relative RMSE (splat: 12,500 rays/sr): to place lamps and glass",
    ),
    (
        Some(Preset::Preview),
        "preview",
        "3 % (splat: 100,000 rays/sr): to judge the light",
    ),
    (
        Some(Preset::Final),
        "final",
        "1 % (splat: 800,000 rays/sr): to keep the maps",
    ),
];

/// Sets all that a preset stands for; the estimator stays.
pub fn apply(preset: Preset, settings: &mut BakeSettings) {
    (settings.max_error, settings.density_per_sr) = if settings.estimator.refines() {
        let target = preset.max_error();
        (Some(target), BakeSettings::starting_density_per_sr(target))
    } else {
        (None, preset.splat_density_per_sr())
    };
    let default = BakeSettings::default();
    settings.max_time_s = None;
    settings.map_resolution = MapResolution::Auto;
    settings.wavefronts = default.wavefronts;
    settings.max_depth = default.max_depth;
    settings.branch_threshold = default.branch_threshold;
}

/// The preset that settings are those of; `None` where one of its values differs.
pub fn of(settings: &BakeSettings) -> Option<Preset> {
    Preset::ALL.into_iter().find(|preset| {
        let mut set = settings.clone();
        apply(*preset, &mut set);
        set == *settings
    })
}

/// A row with the presets.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) {
    let before = of(settings);
    let mut preset = before;
    let value = (&mut preset, &Some(Preset::Preview));
    setting(ui, &PRESET, None, value, |ui, preset| {
        let selected = chosen(preset, &PRESETS);
        choice(ui, "preset", preset, selected, &PRESETS)
    });
    if let Some(preset) = preset.filter(|_| preset != before) {
        apply(preset, settings);
    }
}
