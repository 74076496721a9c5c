//! Section *Light pass*: estimator, layers and ray density of the next bake.

use egui::{Response, Slider, SliderClamping, Ui};

use super::accuracy::target;
use super::control::{about, grouped, listed, rows, setting};
use crate::settings::{BakeSettings, Estimator, Kernel, LayerKind, Sigma};

/// Density at step 0 of the slider [rays/sr]. Each step multiplies it by [`NESTING`]: the sides of the lattice
/// double, and rays already traced are kept.
const BASE_DENSITY_PER_SR: f64 = 100_000.0;
const NESTING: f64 = 4.0;
/// Range of the slider: 391 to 102,400,000 rays/sr.
const DENSITY_STEPS: std::ops::RangeInclusive<f64> = -4.0..=5.0;
const SIGMA_RANGE: std::ops::RangeInclusive<f64> = 0.01..=100.0;

const NO_CAUSTIC: &str = "The caustic layer is off: nothing here applies to the direct layer.";
const NO_SPLATS: &str = "Only the splat estimator has it.";
const NOT_GAUSSIAN: &str = "Sigma is the spread of the gaussian kernel; the chosen kernel has none.";

/// Defaults in the panel for an estimator.
pub fn defaults(estimator: Estimator) -> BakeSettings {
    BakeSettings {
        layers: LayerKind::ALL.to_vec(),
        ..BakeSettings::of(estimator)
    }
}

/// Default density [rays/sr]: the start of refinement, or a preview density without refinement.
fn default_density_per_sr(settings: &BakeSettings) -> f64 {
    settings.max_error.map_or_else(
        || settings.estimator.preview_density_per_sr(),
        BakeSettings::starting_density_per_sr,
    )
}

/// Shows the section.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = no_caustic(settings);
    let refines = settings.estimator.refines();
    let no_sigma = no_sigma(settings);
    let default = defaults(settings.estimator);
    rows(ui, "light pass", |ui| {
        let before = settings.estimator;
        let estimator = (&mut settings.estimator, &Estimator::Auto);
        setting(ui, "Estimator", no_caustic, estimator, listed);
        if settings.estimator != before {
            change_estimator(settings, before);
        }
        let value = (&mut settings.layers, &default.layers);
        setting(ui, "Layers", None, value, layers);
        let default_density_per_sr = default_density_per_sr(settings);
        let density_per_sr = (&mut settings.density_per_sr, &default_density_per_sr);
        let before = *density_per_sr.0;
        setting(ui, "Ray density [rays/sr]", no_caustic, density_per_sr, density);
        if settings.density_per_sr != before {
            // The density has to determine the result: refinement would lead to the same picture from any density.
            target::aim_at_density(settings);
        }
        let value = (&mut settings.sigma, &default.sigma);
        setting(ui, "Sigma [radii²]", no_sigma, value, |ui, value| {
            sigma(ui, value, refines)
        });
    });
}

/// Shows the subsection *Rays and kernels*.
pub fn show_details(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = no_caustic(settings);
    let no_splats = no_caustic.or(settings.estimator.refines().then_some(NO_SPLATS));
    let no_sigma = no_sigma(settings);
    let default = defaults(settings.estimator);
    rows(ui, "rays and kernels", |ui| {
        adaptive(ui, &mut settings.sigma, no_splats.or(no_sigma));
        let value = (&mut settings.kernel, &default.kernel);
        setting(ui, "Kernel", no_splats, value, listed);
        let value = (&mut settings.footprint, &default.footprint);
        setting(ui, "Footprint", no_splats, value, listed);
        let value = (&mut settings.rays, &default.rays);
        setting(ui, "Rays", no_splats, value, listed);
        let value = (&mut settings.item_buffer, &default.item_buffer);
        setting(ui, "Item buffer", no_caustic, value, listed);
    });
}

/// Adapts density, sigma and target to a new estimator.
fn change_estimator(settings: &mut BakeSettings, before: Estimator) {
    settings.density_per_sr *= settings.estimator.preview_density_per_sr() / before.preview_density_per_sr();
    settings.sigma = settings.estimator.default_sigma();
    target::after_change_of_estimator(settings);
}

/// Reason why settings of the caustic layer have no effect, if the layer is off.
pub fn no_caustic(settings: &BakeSettings) -> Option<&'static str> {
    (!settings.layers.contains(&LayerKind::Caustic)).then_some(NO_CAUSTIC)
}

fn no_sigma(settings: &BakeSettings) -> Option<&'static str> {
    let not_gaussian = settings.estimator == Estimator::Splat && settings.kernel != Kernel::Gaussian;
    no_caustic(settings).or(not_gaussian.then_some(NOT_GAUSSIAN))
}

fn layers(ui: &mut Ui, layers: &mut Vec<LayerKind>) -> Response {
    ui.horizontal(|ui| {
        // Three words have to fit into a narrow row.
        ui.spacing_mut().item_spacing.x = 5.0;
        for kind in LayerKind::ALL {
            let mut on = layers.contains(&kind);
            let is_last = on && layers.len() == 1;
            ui.add_enabled_ui(!is_last, |ui| {
                ui.checkbox(&mut on, kind.name())
                    .on_hover_text(about("Layers").what)
                    .on_disabled_hover_text("One layer at least has to be baked.");
            });
            if on != layers.contains(&kind) {
                layers.retain(|layer| *layer != kind);
                if on {
                    layers.push(kind);
                    layers.sort_unstable();
                }
            }
        }
    })
    .response
}

fn density(ui: &mut Ui, density_per_sr: &mut f64) -> Response {
    let step_of = |density: f64| (density / BASE_DENSITY_PER_SR).log(NESTING);
    let get_set = |step: Option<f64>| {
        if let Some(step) = step.filter(|step| step.is_finite()) {
            *density_per_sr = BASE_DENSITY_PER_SR * NESTING.powf(step.round());
        }
        step_of(*density_per_sr)
    };
    // Leaves room for nine digits.
    ui.spacing_mut().slider_width = 86.0;
    ui.add(
        Slider::from_get_set(DENSITY_STEPS, get_set)
            .clamping(SliderClamping::Edits)
            .step_by(1.0)
            .custom_formatter(|step, _| grouped((BASE_DENSITY_PER_SR * NESTING.powf(step)).round() as u64))
            .custom_parser(move |text| {
                let density: f64 = text.replace(',', "").trim().parse().ok()?;
                (density > 0.0).then(|| step_of(density))
            }),
    )
}

fn sigma(ui: &mut Ui, sigma: &mut Sigma, from_zero: bool) -> Response {
    let range = if from_zero {
        0.0..=*SIGMA_RANGE.end()
    } else {
        SIGMA_RANGE
    };
    match sigma {
        Sigma::Constant(value) => ui.add(
            Slider::new(value, range)
                .logarithmic(true)
                .smallest_positive(*SIGMA_RANGE.start())
                .clamping(SliderClamping::Edits)
                .custom_formatter(|value, _| format!("{value:.3}")),
        ),
        Sigma::Adaptive => ui.add_enabled(
            false,
            Slider::new(&mut 1.0, SIGMA_RANGE)
                .logarithmic(true)
                .custom_formatter(|_, _| "adaptive".into()),
        ),
    }
}

fn adaptive(ui: &mut Ui, sigma: &mut Sigma, unavailable: Option<&str>) {
    let mut on = *sigma == Sigma::Adaptive;
    let was_on = on;
    setting(ui, "Adaptive sigma", unavailable, (&mut on, &false), |ui, on| {
        ui.checkbox(on, "per footprint")
    });
    if on != was_on {
        *sigma = if on { Sigma::Adaptive } else { Sigma::Constant(1.0) };
    }
}
