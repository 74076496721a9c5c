//! Section *Light pass*: how the next bake is made.

mod target;

use egui::{Response, Slider, SliderClamping, Ui};

use super::control::{About, choice, chosen, grouped, row, rows};
use crate::settings::{
    BakeSettings, Estimator, Footprint, ItemBufferKind, Kernel, LayerKind, MapResolution, RayPlacement, Sigma,
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
    range: "wavefront, splat; default wavefront",
    accuracy: "wavefront needs some hundred times fewer rays for the same error",
    cost: "grows with the number of rays; a wavefront ray costs a few times more than a splat",
};
const LAYERS: About = About {
    label: "Layers",
    what: "Which light is baked. Caustic: light that met glass, mirrors or water. Direct: straight from the lights. \
           Indirect: what diffuse surfaces send each other of both, any number of times.",
    range: "at least one; default here caustic and direct",
    accuracy: "a layer that is not baked is missing from the picture; indirect stops at the max error, 3 % without one",
    cost: "direct takes one shadow ray per texel and light; indirect 64 to 4,096 rays per texel of a coarser grid, and \
           the other two layers though they be hidden; they are kept while only lamps are dimmed",
};
const DENSITY: About = About {
    label: "Ray density [rays/sr]",
    what: "Light rays per steradian around each lamp; for a sun the same density over the casters.",
    range: "391 to 102,400,000 in steps of ×4; default 25,000 (splat: 100,000)",
    accuracy: "finer caustics and less noise with more rays; with a max error only where refinement starts, with a max \
               time the finest that is tried",
    cost: "time grows in proportion to it; a step keeps the rays of the one before",
};
const TARGET: About = About {
    label: "Bake until",
    what: "What ends a bake: the ray density below exactly, an estimated error (relative RMSE over all maps) that is \
           small enough, or time that is up.",
    range: "density; max error 0.01 to 100 %, default 3 %; max time 0.001 to 10,000 s",
    accuracy: "a max error is kept by the estimate, not by a reference; after a max time the finest complete maps are \
               shown",
    cost: "halving the error takes about four times the rays",
};
const SIGMA: About = About {
    label: "Sigma [radii²]",
    what: "Splat: spread of the gaussian kernel in squared footprint radii, weight exp(−r²/2σ). Wavefront: smoothing of \
           the finished map in squared texel radii.",
    range: "splat 0.01 to 100, default 1; wavefront 0 to 100, default 0; logarithmic",
    accuracy: "small shows single rays (splat) or is exact (wavefront), large blurs the caustic",
    cost: "splat: time per ray grows in proportion to it; wavefront: little",
};
const ADAPTIVE: About = About {
    label: "Adaptive sigma",
    what: "Scales sigma by how each footprint compares with the map's mean footprint.",
    range: "on or off; default off",
    accuracy: "sharper where light converges, smoother where it spreads",
    cost: "about that of a constant sigma",
};
const KERNEL: About = About {
    label: "Kernel",
    what: "Shape of a splat. All have the same area at the same footprint.",
    range: "gaussian, cone, disc, box; default gaussian",
    accuracy: "gaussian is smoothest; disc and box show their edges",
    cost: "gaussian touches the most texels",
};
const FOOTPRINT: About = About {
    label: "Footprint",
    what: "What sets the size and shape of a splat.",
    range: "ellipse, disc, distance, fixed; default ellipse",
    accuracy: "ellipse follows the wavefront best, fixed least",
    cost: "nearly the same for all",
};
const RAYS: About = About {
    label: "Rays",
    what: "Where in its cell of the lattice a ray starts.",
    range: "lattice, jittered; default lattice",
    accuracy: "a lattice converges faster, jittered rays turn regular patterns into noise",
    cost: "the same",
};
const ITEM_BUFFER: About = About {
    label: "Item buffer",
    what: "How the directions around a lamp are divided when looking for glass and mirrors.",
    range: "equal, cube; default equal",
    accuracy: "equal cells give each ray the same flux; the cube's differ by a factor of up to 5.2",
    cost: "nearly the same",
};
const MAP_RESOLUTION: About = About {
    label: "Map size [texels]",
    what: "Texels across and down of every map; automatic maps of flat surfaces are finer where light is finer.",
    range: "auto, 64 to 4096; default auto",
    accuracy: "details finer than a texel are averaged",
    cost: "memory and the direct layer's time grow with its square",
};

const ESTIMATORS: [(Estimator, &str, &str); 2] = [
    (
        Estimator::Wavefront,
        "wavefront",
        "patches between neighbouring rays, spread exactly over texels",
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

/// Shows the section; `settings` holds what the user chose.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = no_caustic(settings);
    let is_wavefront = settings.estimator == Estimator::Wavefront;
    let no_sigma = no_sigma(settings);
    rows(ui, "light pass", |ui| {
        let before = settings.estimator;
        row(ui, &ESTIMATOR, no_caustic, |ui| {
            listed(ui, "estimator", &mut settings.estimator, &ESTIMATORS)
        });
        if settings.estimator != before {
            change_estimator(settings, before);
        }
        row(ui, &LAYERS, None, |ui| layers(ui, &mut settings.layers));
        row(ui, &TARGET, no_caustic, |ui| target::show(ui, settings));
        row(ui, &DENSITY, no_caustic, |ui| {
            density(ui, &mut settings.density_per_sr)
        });
        row(ui, &SIGMA, no_sigma, |ui| {
            sigma(ui, &mut settings.sigma, is_wavefront)
        });
        row(ui, &MAP_RESOLUTION, None, |ui| {
            map_resolution(ui, &mut settings.map_resolution)
        });
    });
}

/// Shows the section of what is seldom changed.
pub fn show_details(ui: &mut Ui, settings: &mut BakeSettings) {
    let no_caustic = no_caustic(settings);
    let is_wavefront = settings.estimator == Estimator::Wavefront;
    let no_splats = no_caustic.or(is_wavefront.then_some(NO_SPLATS));
    let no_sigma = no_sigma(settings);
    rows(ui, "rays and kernels", |ui| {
        row(ui, &ADAPTIVE, no_splats.or(no_sigma), |ui| {
            adaptive(ui, &mut settings.sigma)
        });
        row(ui, &KERNEL, no_splats, |ui| {
            listed(ui, "kernel", &mut settings.kernel, &KERNELS)
        });
        row(ui, &FOOTPRINT, no_splats, |ui| {
            listed(ui, "footprint", &mut settings.footprint, &FOOTPRINTS)
        });
        row(ui, &RAYS, no_splats, |ui| {
            listed(ui, "rays", &mut settings.rays, &PLACEMENTS)
        });
        row(ui, &ITEM_BUFFER, no_caustic, |ui| {
            listed(ui, "item buffer", &mut settings.item_buffer, &ITEM_BUFFERS)
        });
    });
}

/// Takes over what suits another estimator.
fn change_estimator(settings: &mut BakeSettings, before: Estimator) {
    settings.density_per_sr *= settings.estimator.preview_density_per_sr() / before.preview_density_per_sr();
    settings.sigma = settings.estimator.default_sigma();
    target::after_change_of_estimator(settings);
}

fn no_caustic(settings: &BakeSettings) -> Option<&'static str> {
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
                .text("adaptive"),
        ),
    }
}

fn adaptive(ui: &mut Ui, sigma: &mut Sigma) -> Response {
    let mut on = *sigma == Sigma::Adaptive;
    let response = ui.checkbox(&mut on, "per footprint");
    if response.changed() {
        *sigma = if on { Sigma::Adaptive } else { Sigma::Constant(1.0) };
    }
    response
}

fn map_resolution(ui: &mut Ui, resolution: &mut MapResolution) -> Response {
    let square = |side| MapResolution::Fixed {
        width: side,
        height: side,
    };
    let selected = match *resolution {
        MapResolution::Auto => "auto".into(),
        MapResolution::Fixed { width, height } if width == height => width.to_string(),
        MapResolution::Fixed { width, height } => format!("{width} × {height}"),
    };
    choice(
        ui,
        "map size",
        resolution,
        &selected,
        &[
            (
                MapResolution::Auto,
                "auto",
                "starts coarse and doubles while footprints are finer than texels",
            ),
            (square(64), "64", "64 × 64"),
            (square(128), "128", "128 × 128"),
            (square(256), "256", "256 × 256"),
            (square(512), "512", "512 × 512"),
            (square(1024), "1024", "1024 × 1024"),
            (square(2048), "2048", "2048 × 2048"),
            (square(4096), "4096", "4096 × 4096: 200 MB per map and layer"),
        ],
    )
}
