//! Studies of a scene that the user names: convergence, effects, spectrum.

use std::sync::Arc;

use super::agreement::{caustic_colours, pair_texels};
use super::plot::Plot;
use super::references::{Reference, Truth};
use super::sweep::{
    ARD, Against, CELLS, CPU_S, Column, FLUX_RATIO, Group, Measured, PEAK_RATIO, RAYS, REFERENCE,
    RELATIVE_RMSE, SPLATS, Sweep, Variant, column, number, share,
};
use super::table::Cell;
use crate::bake::Baker;
use crate::effect::{Effect, EffectSwitch};
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::scene::{Light, LightKind, Scene};
use crate::settings::{BakeSettings, ErrorMetric, Estimator, LayerKind, SpectralSampling, Wavelengths};

/// Name and description.
pub const CONVERGENCE: (&str, &str) = (
    "convergence",
    "error against light rays and CPU time, for every estimator",
);
/// Name and description.
pub const EFFECTS: (&str, &str) = (
    "effects",
    "what each effect costs and what it is worth, by bakes without it",
);
/// Name and description.
pub const SPECTRUM: (&str, &str) = (
    "spectrum",
    "split and stochastic rays, few wavelengths, many and all: how right and how dear",
);

/// Density of the reference bake relative to the densest variant, if no other reference is given.
const SELF_REFERENCE_FACTOR: f64 = 16.0;

/// Compares every estimator at every density (ascending, at least one) with a reference or, without one, with a much
/// denser bake by the last estimator. Variants override estimator, density and sigma of the settings.
pub fn convergence(
    scene: &Arc<Scene>,
    settings: &BakeSettings,
    estimators: &[Estimator],
    densities: &[f64],
    reference: Option<Reference>,
) -> Sweep {
    // Each estimator is judged with the sigma that suits it: none, or one footprint for splats.
    let at = |estimator: Estimator, density_per_sr| BakeSettings {
        estimator,
        density_per_sr,
        sigma: estimator.default_sigma(),
        ..settings.clone()
    };
    let densest = densities.last().copied().unwrap_or(1.0) * SELF_REFERENCE_FACTOR;
    let finest = at(estimators.last().copied().unwrap_or(settings.estimator), densest);
    let variants = estimators.iter().flat_map(|&estimator| {
        densities.iter().map(move |&density| {
            let name: &str = estimator.into();
            Variant::new(vec![name.into(), density.into()], scene, at(estimator, density))
        })
    });
    Sweep {
        name: CONVERGENCE.0,
        what: CONVERGENCE.1,
        note: format!("`{}`.", scene.source),
        labels: &["estimator", "density_per_sr"],
        columns: &[
            RAYS,
            SPLATS,
            CELLS,
            CPU_S,
            RELATIVE_RMSE,
            ARD,
            PEAK_RATIO,
            FLUX_RATIO,
            REFERENCE,
        ],
        groups: vec![Group {
            variants: variants.collect(),
            against: match reference {
                Some(reference) => Against::Known(reference),
                None => Against::Bake(Arc::clone(scene), Box::new(finest)),
            },
        }],
        plots: const {
            &[
                Plot::new("convergence-rays", ["rays", "relative_rmse"], &["estimator"]),
                Plot::new("convergence-cpu", ["cpu_s", "relative_rmse"], &["estimator"]),
            ]
        },
        ..Sweep::default()
    }
}

/// Bakes the scene as planned, and without each effect that is on in the plan.
///
/// # Errors
/// Settings outside their ranges.
pub fn effects(scene: &Arc<Scene>, settings: &BakeSettings) -> Result<Sweep> {
    // The planned bake is the reference of all others, and the first row.
    let plan = Baker::new(Arc::clone(scene))?.plan(settings)?;
    let planned = vec!["none".into(), "as planned".into()];
    let mut variants = vec![Variant::new(planned, scene, settings.clone())];

    // The difference to a bake without an effect is what the effect contributes.
    for line in plan.effects.iter().filter(|line| line.on) {
        let name = line.effect.name();
        let without = BakeSettings {
            effects: settings.effects.clone().with(line.effect, EffectSwitch::Off),
            ..settings.clone()
        };
        variants.push(Variant {
            difference: Some(format!("difference_{name}")),
            ..Variant::new(vec![name.into(), line.reason.clone().into()], scene, without)
        });
    }
    Ok(Sweep {
        name: EFFECTS.0,
        what: EFFECTS.1,
        note: format!(
            "`{}`, baked as planned and without each effect. `worth_w` is what the planned bake has more, `relative_rmse` is between \
             both. Pictures are warm where the effect adds light and cool where it takes light away, 1 to 1000 % of the map's mean.",
            scene.source
        ),
        labels: &["without", "reason"],
        columns: EFFECT_COLUMNS,
        groups: vec![Group {
            against: Against::Bake(Arc::clone(scene), Box::new(settings.clone())),
            variants,
        }],
        ..Sweep::default()
    })
}

const EFFECT_COLUMNS: &[Column] = &[
    column("flux_w", |m| number(m.difference().map(|found| found.without_w))),
    column("worth_w", |m| {
        number(m.difference().map(|found| found.difference_w()))
    }),
    column("relative_rmse", |m| {
        share(m.difference().and_then(|found| found.relative_rmse))
    }),
    RAYS,
    CPU_S,
];

/// Relative RMSE of bakes by the default estimator, and of the reference.
const TARGET: f64 = 0.05;
const REFERENCE_TARGET: f64 = 0.02;

/// Half-angle below which a spot counts as a thin beam [rad].
const THIN_RAD: f64 = 0.05;

/// Bakes with every way to sample the spectrum, the paper's first (section 4.1, Plates 3 and 4). If the scene has thin
/// beams, only these shine.
///
/// # Errors
/// A scene without dispersive light.
pub fn spectrum(scene: &Scene, settings: &BakeSettings, wavelengths: &[u32]) -> Result<Sweep> {
    // Thin beams show the colours of a prism apart; other lamps would overlap them.
    let mut scene = scene.clone();
    let is_thin = |light: &Light| matches!(light.kind, LightKind::Spot { outer_cone_rad, .. } if outer_cone_rad < THIN_RAD);
    if scene.lights.iter().any(is_thin) {
        scene.lights.retain(is_thin);
    }
    let scene = Arc::new(scene);

    // The paper's ways: each ray at every wavelength, or wavelengths that share the rays.
    let with = |estimator: Estimator, wavelengths, spectral_sampling| BakeSettings {
        estimator,
        sigma: estimator.default_sigma(),
        wavelengths,
        spectral_sampling,
        layers: vec![LayerKind::Caustic],
        ..settings.clone()
    };
    let (split, stochastic) = (SpectralSampling::Split, SpectralSampling::Stochastic);
    let mut variants = Vec::new();
    let mut add = |sampling: &str, wavelengths: String, settings: BakeSettings| {
        let name: &str = settings.estimator.into();
        let labels = vec![name.into(), sampling.into(), wavelengths.into()];
        variants.push(Variant::new(labels, &scene, settings).in_sheet(SPECTRUM.0));
    };
    for (name, sampling) in [("split", split), ("stochastic", stochastic)] {
        for &count in wavelengths {
            let settings = with(Estimator::Splat, Wavelengths::Fixed(count), Some(sampling));
            add(name, count.to_string(), settings);
        }
    }
    let all = with(Estimator::Splat, Wavelengths::Continuous, None);
    add("stochastic", "continuous".into(), all);

    // Bundles and photons, all to the same error, so that cost and colours depend on the wavelengths alone.
    let to = |target, wavelengths| BakeSettings {
        max_error: Some(target),
        error_metric: ErrorMetric::Rmse,
        ..with(Estimator::Auto, wavelengths, None)
    };
    for &count in wavelengths {
        add(
            "sampled",
            count.to_string(),
            to(TARGET, Wavelengths::Fixed(count)),
        );
    }
    add(
        "sampled",
        "continuous".into(),
        to(TARGET, Wavelengths::Continuous),
    );

    // Without dispersion in the light pass, the wavelengths would make no difference.
    let finest = to(REFERENCE_TARGET, Wavelengths::Continuous);
    if !Baker::new(Arc::clone(&scene))?
        .plan(&finest)?
        .is_on(Effect::Dispersion)
    {
        return Err(Error::failure(
            &scene.source,
            "no light reaches a diffuse surface through dispersive glass",
            "name a scene with a lit prism, such as builtin:spectrum",
        ));
    }
    Ok(Sweep {
        name: SPECTRUM.0,
        what: SPECTRUM.1,
        note: format!(
            "`{}` against bundles of the whole spectrum to {} %. Errors are the root of the squared differences over that of the reference's squares.",
            scene.source,
            100.0 * REFERENCE_TARGET
        ),
        labels: &["estimator", "sampling", "wavelengths"],
        columns: SPECTRUM_COLUMNS,
        groups: vec![Group {
            against: Against::Bake(scene, Box::new(finest)),
            variants,
        }],
        sheet_columns: 1,
        ..Sweep::default()
    })
}

const SPECTRUM_COLUMNS: &[Column] = &[
    RAYS,
    SPLATS,
    CPU_S,
    column("colour_error", |m| norm_of_difference(m, LinearSrgb::to_array)),
    column("luminance_error", |m| {
        norm_of_difference(m, |colour| [colour.luminance(), 0.0, 0.0])
    }),
    FLUX_RATIO,
];

/// ‖I − R‖ / ‖R‖ over all texels, area-weighted.
fn norm_of_difference(measured: &Measured, of: fn(LinearSrgb) -> [f64; 3]) -> Cell {
    let Some(Truth::Maps(references)) = measured.reference.map(|reference| &reference.truth) else {
        return Cell::Empty;
    };
    let Some(pairs) = pair_texels(&measured.result.maps, references, caustic_colours) else {
        return Cell::Empty;
    };
    let square = |rgb: LinearSrgb| of(rgb).iter().map(|channel| channel * channel).sum::<f64>();
    let (mut difference, mut whole) = (0.0, 0.0);
    for (image, reference, area_m2) in pairs {
        difference += area_m2 * square(image - reference);
        whole += area_m2 * square(reference);
    }
    Cell::Share((difference / whole).sqrt())
}
