//! Section *Light pass*: how the next bake is made.

use egui::{Response, Slider, SliderClamping, Ui};

use super::accuracy::target;
use super::control::{About, choice, chosen, grouped, rows, setting};
use crate::settings::{
    BakeSettings, Estimator, Footprint, ItemBufferKind, Kernel, LayerKind, RayPlacement, Sigma,
};

/// Density at the slider's zero [rays/sr]. Each step is [`NESTING`] times the one before: the lattice's sides double,
/// and what was traced of one is kept for the next.
const BASE_DENSITY_PER_SR: f64 = 100_000.0;
const NESTING: f64 = 4.0;
/// The slider's ends: 391 to 102,400,000 rays/sr.
const DENSITY_STEPS: std::ops::RangeInclusive<f64> = -4.0..=5.0;
const SIGMA_RANGE: std::ops::RangeInclusive<f64> = 0.01..=100.0;

const ESTIMATOR: About = About {
    label: "Estimator",
    what: "How light rays become irradiance. Wavefront: smooth patches between neighbouring rays, spread exactly over \
           the texels they cover. Splat: every ray spreads its flux over its footprint by a kernel (Collins).",
    range: "wavefront, splat",
    default: "wavefront",
    accuracy: "wavefront needs some hundred times fewer rays for the same error",
    cost: "grows with the number of rays; a wavefront ray costs a few times more than a splat",
};
const LAYERS: About = About {
    label: "Layers",
    what: "Which light is baked. Caustic: light that met glass, mirrors or water. Direct: straight from the lights. \
           Indirect: what diffuse surfaces send each other of both, any number of times.",
    range: "at least one",
    default: "caustic and direct",
    accuracy: "a layer that is not baked is missing from the picture; indirect stops at the max error, 3 % without one",
    cost: "direct takes one shadow ray per texel and light; indirect 64 to 4,096 rays per texel of a coarser grid, and \
           the other two layers though they be hidden; they are kept while only lamps are dimmed",
};
const DENSITY: About = About {
    label: "Ray density [rays/sr]",
    what: "Light rays per steradian around each lamp; for a sun the same density over the casters.",
    range: "391 to 102,400,000 in steps of ×4; logarithmic",
    default: "25,000 (splat: 100,000); with a max error 40 over it, from 1,600 to 40,000",
    accuracy: "finer caustics and less noise with more rays; with a max error only where refinement starts, with a max \
               time the finest that is tried",
    cost: "time grows in proportion to it; a step keeps the rays of the one before",
};
const SIGMA: About = About {
    label: "Sigma [radii²]",
    what: "Splat: spread of the gaussian kernel in squared footprint radii, weight exp(−r²/2σ). Wavefront: smoothing of \
           the finished map in squared texel radii.",
    range: "wavefront 0 to 100, splat 0.01 to 100; logarithmic",
    default: "wavefront 0, splat 1",
    accuracy: "small shows single rays (splat) or is exact (wavefront), large blurs the caustic",
    cost: "splat: time per ray grows in proportion to it; wavefront: little",
};
const ADAPTIVE: About = About {
    label: "Adaptive sigma",
    what: "Scales sigma by how each footprint compares with the map's mean footprint.",
    range: "on or off",
    default: "off",
    accuracy: "sharper where light converges, smoother where it spreads",
    cost: "about that of a constant sigma",
};
const KERNEL: About = About {
    label: "Kernel",
    what: "Shape of a splat. All have the same area at the same footprint.",
    range: "gaussian, cone, disc, box",
    default: "gaussian",
    accuracy: "gaussian is smoothest; disc and box show their edges",
    cost: "gaussian touches the most texels",
};
const FOOTPRINT: About = About {
    label: "Footprint",
    what: "What sets the size and shape of a splat.",
    range: "ellipse, disc, distance, fixed",
    default: "ellipse",
    accuracy: "ellipse follows the wavefront best, fixed least",
    cost: "nearly the same for all",
};
const RAYS: About = About {
    label: "Rays",
    what: "Where in its cell of the lattice a ray starts.",
    range: "lattice, jittered",
    default: "lattice",
    accuracy: "a lattice converges faster, jittered rays turn regular patterns into noise",
    cost: "the same",
};
const ITEM_BUFFER: About = About {
    label: "Item buffer",
    what: "How the directions around a lamp are divided when looking for glass and mirrors.",
    range: "equal, cube",
    default: "equal",
    accuracy: "equal cells give each ray the same flux; the cube's differ by a factor of up to 5.2",
    cost: "nearly the same",
};

const ESTIMATORS: [(Estimator, &str, &str); 4] = [
    (
        Estimator::Auto,
        "auto",
        "patches or photons, whichever reaches the target sooner",
    ),
    (
        Estimator::Wavefront,
        "wavefront",
        "patches between neighbouring rays, spread exactly over texels",
    ),
    (
        Estimator::Photon,
        "photon",
        "sampled paths, each counted into the texel it hits",
    ),
    (
        Estimator::Splat,
        "splat",
        "a kernel of flux per ray, scaled to the wavefront",
    ),
];
const KERNELS: [(Kernel, &str, &str); 4] = [
    (Kernel::Gaussian, "gaussian", "exp(−r²/2σ), cut at four spreads"),
    (Kernel::Cone, "cone", "falls linearly to 0 at 1.73 radii"),
    (Kernel::Disc, "disc", "constant up to 1 radius"),
    (Kernel::Box, "box", "constant over a square of the disc's area"),
];
const FOOTPRINTS: [(Footprint, &str, &str); 4] = [
    (
        Footprint::Ellipse,
        "ellipse",
        "the ellipse that the neighbouring rays span",
    ),
    (
        Footprint::Disc,
        "disc",
        "a disc of the area that the neighbouring rays span",
    ),
    (
        Footprint::Distance,
        "distance",
        "a disc that grows with the length of the path",
    ),
    (Footprint::Fixed, "fixed", "the same disc for every ray of a lamp"),
];
const PLACEMENTS: [(RayPlacement, &str, &str); 2] = [
    (RayPlacement::Lattice, "lattice", "at the centre of its cell"),
    (
        RayPlacement::Jittered,
        "jittered",
        "anywhere in its cell, by the seed",
    ),
];
const ITEM_BUFFERS: [(ItemBufferKind, &str, &str); 2] = [
    (ItemBufferKind::Equal, "equal", "cells of equal solid angle"),
    (
        ItemBufferKind::Cube,
        "cube",
        "cells of equal area on the faces of a cube",
    ),
];

const NO_CAUSTIC: &str = "The caustic layer is off: nothing here applies to the direct layer.";
const NO_SPLATS: &str = "Only the splat estimator has it.";
const NOT_GAUSSIAN: &str = "Sigma is the spread of the gaussian kernel; the chosen kernel has none.";

/// What the settings are set back to: what the program begins with for an estimator.
pub fn defaults(estimator: Estimator) -> BakeSettings {
    BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..BakeSettings::of(estimator)
    }
}

/// The density that a bake begins from unless another is set [rays/sr].
fn default_density_per_sr(settings: &BakeSettings) -> f64 {
    settings.max_error.map_or_else(
        || settings.estimator.preview_density_per_sr(),
        BakeSettings::starting_density_per_sr,
    )
}

/// Shows the section; `settings` holds what the user chose.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = no_caustic(settings);
    let refines = settings.estimator.refines();
    let no_sigma = no_sigma(settings);
    let default = defaults(settings.estimator);
    rows(ui, "light pass", |ui| {
        let before = settings.estimator;
        let estimator = (&mut settings.estimator, &Estimator::Wavefront);
        setting(ui, &ESTIMATOR, no_caustic, estimator, |ui, estimator| {
            listed(ui, "estimator", estimator, &ESTIMATORS)
        });
        if settings.estimator != before {
            change_estimator(settings, before);
        }
        setting(ui, &LAYERS, None, (&mut settings.layers, &default.layers), layers);
        let default_density_per_sr = default_density_per_sr(settings);
        let density_per_sr = (&mut settings.density_per_sr, &default_density_per_sr);
        setting(ui, &DENSITY, no_caustic, density_per_sr, density);
        setting(
            ui,
            &SIGMA,
            no_sigma,
            (&mut settings.sigma, &default.sigma),
            |ui, value| sigma(ui, value, refines),
        );
    });
}

/// Shows what is seldom changed.
pub fn show_details(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = no_caustic(settings);
    let no_splats = no_caustic.or(settings.estimator.refines().then_some(NO_SPLATS));
    let no_sigma = no_sigma(settings);
    let default = defaults(settings.estimator);
    rows(ui, "rays and kernels", |ui| {
        adaptive(ui, &mut settings.sigma, no_splats.or(no_sigma));
        let value = (&mut settings.kernel, &default.kernel);
        setting(ui, &KERNEL, no_splats, value, |ui, kernel| {
            listed(ui, "kernel", kernel, &KERNELS)
        });
        let value = (&mut settings.footprint, &default.footprint);
        setting(ui, &FOOTPRINT, no_splats, value, |ui, footprint| {
            listed(ui, "footprint", footprint, &FOOTPRINTS)
        });
        let value = (&mut settings.rays, &default.rays);
        setting(ui, &RAYS, no_splats, value, |ui, rays| {
            listed(ui, "rays", rays, &PLACEMENTS)
        });
        let value = (&mut settings.item_buffer, &default.item_buffer);
        setting(ui, &ITEM_BUFFER, no_caustic, value, |ui, item_buffer| {
            listed(ui, "item buffer", item_buffer, &ITEM_BUFFERS)
        });
    });
}

/// Takes over what suits another estimator.
fn change_estimator(settings: &mut BakeSettings, before: Estimator) {
    settings.density_per_sr *= settings.estimator.preview_density_per_sr() / before.preview_density_per_sr();
    settings.sigma = settings.estimator.default_sigma();
    target::after_change_of_estimator(settings);
}

/// Why nothing that shapes the caustic layer can be set, where that is so.
pub fn no_caustic(settings: &BakeSettings) -> Option<&'static str> {
    (!settings.layers.contains(&LayerKind::Caustic)).then_some(NO_CAUSTIC)
}

fn no_sigma(settings: &BakeSettings) -> Option<&'static str> {
    let not_gaussian = settings.estimator == Estimator::Splat && settings.kernel != Kernel::Gaussian;
    no_caustic(settings).or(not_gaussian.then_some(NOT_GAUSSIAN))
}

fn listed<T: PartialEq + Copy>(
    ui: &mut Ui,
    name: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
) -> Response {
    let selected = chosen(value, choices);
    choice(ui, name, value, selected, choices)
}

fn layers(ui: &mut Ui, layers: &mut Vec<LayerKind>) -> Response {
    ui.horizontal(|ui| {
        // Three words in a narrow row.
        ui.spacing_mut().item_spacing.x = 5.0;
        for kind in LayerKind::ALL {
            let mut on = layers.contains(&kind);
            let is_last = on && layers.len() == 1;
            ui.add_enabled_ui(!is_last, |ui| {
                ui.checkbox(&mut on, kind.name())
                    .on_hover_text(LAYERS.what)
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
    // Beside it stand up to nine digits.
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
    setting(ui, &ADAPTIVE, unavailable, (&mut on, &false), |ui, on| {
        ui.checkbox(on, "per footprint")
    });
    if on != was_on {
        *sigma = if on { Sigma::Adaptive } else { Sigma::Constant(1.0) };
    }
}
