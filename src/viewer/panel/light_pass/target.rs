//! What ends a bake: a density, an error or a time.

use egui::{ComboBox, DragValue, Response, Ui};

use crate::settings::{BakeSettings, Estimator, LEAST_MAX_ERROR};

/// Errors offered by name [relative RMSE]: those of the presets.
const ERRORS: [f64; 3] = [0.10, 0.03, 0.01];
/// The first time that is offered [s].
const FIRST_TIME_S: f64 = 10.0;
/// Width of the list [points].
const LIST_WIDTH: f32 = 118.0;
const NO_ERRORS: &str = "Only the wavefront estimator refines until an error is reached.";

/// Which of the targets is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    Density,
    Error(f64),
    Time(f64),
}

impl Target {
    /// An error that is no target stands beside a time: as far as that goes.
    fn of(settings: &BakeSettings) -> Self {
        match (settings.max_error, settings.max_time_s) {
            (Some(error), Some(time_s)) if error <= LEAST_MAX_ERROR => Self::Time(time_s),
            (Some(error), _) => Self::Error(error),
            (None, Some(time_s)) => Self::Time(time_s),
            (None, None) => Self::Density,
        }
    }

    /// Refinement begins from a density of its own; without it the density is all that counts.
    fn set(self, settings: &mut BakeSettings) {
        let was_refined = settings.max_error.is_some();
        (settings.max_error, settings.max_time_s) = match self {
            Self::Density => (None, None),
            Self::Error(error) => (Some(error), None),
            Self::Time(time_s) if settings.estimator == Estimator::Wavefront => {
                (Some(LEAST_MAX_ERROR), Some(time_s))
            }
            Self::Time(time_s) => (None, Some(time_s)),
        };
        match settings.max_error {
            Some(error) => settings.density_per_sr = BakeSettings::starting_density_per_sr(error),
            None if was_refined => settings.density_per_sr = settings.estimator.preview_density_per_sr(),
            None => {}
        }
    }

    fn name(self) -> String {
        match self {
            Self::Density => "ray density".into(),
            Self::Error(error) => format!("max error {} %", percent(error)),
            Self::Time(time_s) => format!("max time {time_s} s"),
        }
    }
}

/// In per cent, without what rounding leaves.
fn percent(share: f64) -> f64 {
    (share * 1e6).round() / 1e4
}

/// Keeps what ends a bake where another estimator can: splats do not refine.
pub fn after_change_of_estimator(settings: &mut BakeSettings) {
    match (Target::of(settings), settings.estimator) {
        (Target::Error(_), Estimator::Splat) => Target::Density,
        (target, _) => target,
    }
    .set(settings);
}

/// A list of targets with the value of the chosen one beside it. Settings that ask for both an error and a time keep
/// both until one of them is touched here.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) -> Response {
    let before = Target::of(settings);
    let mut target = before;
    let response = ui
        .horizontal(|ui| {
            let list = list(ui, &mut target, settings.estimator);
            let value = value(ui, &mut target);
            value.map_or(list.clone(), |value| list.union(value))
        })
        .inner;
    if target != before {
        target.set(settings);
    }
    response
}

fn list(ui: &mut Ui, target: &mut Target, estimator: Estimator) -> Response {
    let name = match target {
        Target::Density => "ray density",
        Target::Error(_) => "max error [%]",
        Target::Time(_) => "max time [s]",
    };
    ComboBox::from_id_salt("target")
        .width(LIST_WIDTH)
        .selected_text(name)
        .show_ui(ui, |ui| {
            ui.selectable_value(target, Target::Density, Target::Density.name())
                .on_hover_text("Exactly the lattice of that density, without refinement.");
            ui.add_enabled_ui(estimator == Estimator::Wavefront, |ui| {
                for error in ERRORS.map(Target::Error) {
                    ui.selectable_value(target, error, error.name())
                        .on_hover_text("Until the estimated relative RMSE over all maps is below it.")
                        .on_disabled_hover_text(NO_ERRORS);
                }
            });
            let time = Target::Time(FIRST_TIME_S);
            ui.selectable_value(target, time, time.name())
                .on_hover_text("Until the time is up.");
        })
        .response
}

fn value(ui: &mut Ui, target: &mut Target) -> Option<Response> {
    match target {
        Target::Density => None,
        Target::Error(error) => {
            let mut shown = percent(*error);
            let drag = DragValue::new(&mut shown).range(0.01..=100.0).max_decimals(2);
            let response = ui.add(drag.speed(0.002 * percent(*error)).suffix(" %"));
            if response.changed() {
                *error = shown / 100.0;
            }
            Some(response)
        }
        Target::Time(time_s) => {
            let speed = 0.01 * *time_s;
            let drag = DragValue::new(time_s).range(1e-3..=1e4).max_decimals(3);
            Some(ui.add(drag.speed(speed).suffix(" s")))
        }
    }
}
