//! How carefully to bake, by name: the presets of the command line.

use egui::Ui;
use strum::EnumMessage;

use crate::settings::{BakeSettings, MapResolution, Preset};
use crate::viewer::panel::control::{choice, setting};

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
    settings.error_metric = default.error_metric;
    settings.map_resolution = MapResolution::Auto;
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
    setting(ui, "Preset", None, value, |ui, preset| {
        let choices = Preset::ALL.map(|preset| {
            let hover = preset.get_documentation().unwrap_or_default();
            (Some(preset), preset.name(), hover)
        });
        choice(ui, "preset", preset, "custom", &choices)
    });
    if let Some(preset) = preset.filter(|_| preset != before) {
        apply(preset, settings);
    }
}
