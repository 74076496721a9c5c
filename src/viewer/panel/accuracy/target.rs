//! What ends a bake: a density, an error, a time, or a preset of the command line.

use egui::{Response, Slider, SliderClamping, Ui};
use strum::EnumMessage;

use crate::settings::{BakeSettings, Estimator, MIN_MAX_ERROR, MapResolution, Preset};
use crate::viewer::panel::control::{self, CONTROL_WIDTH, choice, setting};

/// Initial time limit [s].
const FIRST_TIME_S: f64 = 10.0;
/// Ranges of the sliders.
const PERCENTS: std::ops::RangeInclusive<f64> = 0.01..=100.0;
const TIMES_S: std::ops::RangeInclusive<f64> = 1e-3..=1e4;
const NO_ERRORS: &str = "Splats do not refine until an error is reached.";

/// When a bake ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// A ray density, without refinement.
    Density,
    /// An error of all maps [1].
    Error(f64),
    /// A wall-clock time [s].
    Time(f64),
}

impl Target {
    /// A time target is stored with the smallest possible error, so that refinement never ends before the time is up.
    pub fn of(settings: &BakeSettings) -> Self {
        match (settings.max_error, settings.max_time_s) {
            (Some(error), Some(time_s)) if error <= MIN_MAX_ERROR => Self::Time(time_s),
            (Some(error), _) => Self::Error(error),
            (None, Some(time_s)) => Self::Time(time_s),
            (None, None) => Self::Density,
        }
    }

    /// Refinement starts at a density of its own; without refinement, the density is the only target.
    fn set(self, settings: &mut BakeSettings) {
        let was_refined = settings.max_error.is_some();
        (settings.max_error, settings.max_time_s) = match self {
            Self::Density => (None, None),
            Self::Error(error) => (Some(error), None),
            Self::Time(time_s) if settings.estimator.refines() => (Some(MIN_MAX_ERROR), Some(time_s)),
            Self::Time(time_s) => (None, Some(time_s)),
        };
        match settings.max_error {
            Some(error) => settings.density_per_sr = BakeSettings::starting_density_per_sr(error),
            None if was_refined => settings.density_per_sr = settings.estimator.preview_density_per_sr(),
            None => {}
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Density => "ray density",
            Self::Error(_) => "max error",
            Self::Time(_) => "max time",
        }
    }

    /// The default target for an estimator.
    fn default_of(estimator: Estimator) -> Self {
        if estimator.refines() {
            Self::Error(Preset::default().max_error())
        } else {
            Self::Density
        }
    }
}

/// Sets the target to a point of the curve, rounded to two digits: its time if a time is the target, else its error.
/// Ignored for splats, which cannot refine to an error.
pub fn pick(settings: &mut BakeSettings, seconds: f64, error: f64) {
    let rounded = |value: f64| {
        let unit = 10_f64.powf(value.log10().floor() - 1.0);
        (value / unit).round() * unit
    };
    match (Target::of(settings), settings.estimator) {
        (Target::Time(_), _) => {
            Target::Time(rounded(seconds).clamp(*TIMES_S.start(), *TIMES_S.end())).set(settings);
        }
        (_, estimator) if estimator.refines() => {
            Target::Error(rounded(error).clamp(PERCENTS.start() / 100.0, PERCENTS.end() / 100.0))
                .set(settings);
        }
        _ => {}
    }
}

/// In per cent, rounded to hide floating-point noise.
fn percent(share: f64) -> f64 {
    (share * 1e6).round() / 1e4
}

/// After the user sets a density, a bake ends with it instead of refining.
pub fn aim_at_density(settings: &mut BakeSettings) {
    if settings.max_error.take().is_some() {
        settings.max_time_s = None;
    }
}

/// Keeps the target where the new estimator supports it; splats cannot refine to an error.
pub fn after_change_of_estimator(settings: &mut BakeSettings) {
    match (Target::of(settings), settings.estimator) {
        (Target::Error(_), Estimator::Splat) => Target::Density,
        (target, _) => target,
    }
    .set(settings);
}

/// Rows with the list of targets and the value of the present one. Settings with both an error and a time keep both
/// until the user changes one of them here.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings, unavailable: Option<&str>) {
    let before = Target::of(settings);
    let mut target = before;
    let default = Target::default_of(settings.estimator);

    // A different error is not a different kind of target; its own row resets it.
    let mut kind = match (target, default) {
        (Target::Error(_), Target::Error(_)) => default,
        _ => target,
    };
    let shown = kind;
    setting(
        ui,
        "Bake until",
        unavailable,
        (&mut kind, &default),
        |ui, kind| list(ui, kind, settings.estimator),
    );
    if kind != shown {
        target = kind;
    }

    // Only the kind of target that is chosen has a row for its value here.
    match &mut target {
        Target::Density => {}
        Target::Error(error) => {
            let default = Preset::default().max_error();
            let error = (error, &default);
            setting(ui, "Max error [%]", unavailable, error, percent_slider);
        }
        Target::Time(time_s) => {
            let time_s = (time_s, &FIRST_TIME_S);
            setting(ui, "Max time [s]", unavailable, time_s, |ui, time_s| {
                let slider = Slider::new(time_s, TIMES_S).logarithmic(true).suffix(" s");
                ui.add(slider.clamping(SliderClamping::Edits).max_decimals(3))
            });
        }
    }

    // Untouched settings keep an error and a time that were given together.
    if target != before {
        target.set(settings);
    }
}

fn list(ui: &mut Ui, target: &mut Target, estimator: Estimator) -> Response {
    let targets = [
        (Target::Density, "Exactly that many rays, without refinement."),
        (
            Target::Error(Preset::default().max_error()),
            "Until the estimated error of all maps is below it.",
        ),
        (Target::Time(FIRST_TIME_S), "Until the time is up."),
    ];
    let can = |target: Target| estimator.refines() || !matches!(target, Target::Error(_));
    let why_not = |target: Target| (!can(target)).then_some(NO_ERRORS);
    let entries = targets.map(|(target, hover)| (target.name(), hover.into(), why_not(target)));
    let at = targets
        .iter()
        .position(|(candidate, _)| candidate.name() == target.name());
    let (response, picked) = control::pick(ui, ("target", CONTROL_WIDTH), (target.name(), at), &entries);
    if let Some(index) = picked.filter(|index| Some(*index) != at) {
        *target = targets[index].0;
    }
    response
}

fn percent_slider(ui: &mut Ui, error: &mut f64) -> Response {
    let mut shown = percent(*error);
    let slider = Slider::new(&mut shown, PERCENTS).logarithmic(true).suffix(" %");
    let response = ui.add(slider.clamping(SliderClamping::Edits).max_decimals(2));
    if response.changed() {
        *error = shown / 100.0;
    }
    response
}

/// Applies all settings of a preset; keeps the estimator.
fn apply(preset: Preset, settings: &mut BakeSettings) {
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

/// The preset that matches the settings; `None` if any of its values differs.
pub fn preset_of(settings: &BakeSettings) -> Option<Preset> {
    Preset::ALL.into_iter().find(|preset| {
        let mut set = settings.clone();
        apply(*preset, &mut set);
        set == *settings
    })
}

/// A row with the presets.
pub fn show_presets(ui: &mut Ui, settings: &mut BakeSettings) {
    let before = preset_of(settings);
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
