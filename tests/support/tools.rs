//! Short forms for bakes, and checks that are themselves tested with wrong input.

use nephroid::bake::Baker;
use nephroid::settings::{ErrorMetric, Estimator};
use nephroid::study::brute_force::brute_force;

use crate::prelude::*;

/// A built-in scene, which must exist.
pub fn builtin_scene(name: &str) -> Scene {
    builtin::build(name).unwrap_or_else(|| panic!("there is no built-in scene {name}"))
}

/// Settings with one change.
pub fn set(mut settings: BakeSettings, change: impl FnOnce(&mut BakeSettings)) -> BakeSettings {
    change(&mut settings);
    settings
}

/// Settings of an estimator at a density [rays/sr], with relative RMSE as the metric and maps of side² texels.
fn by(estimator: Estimator, density_per_sr: f64, side: usize) -> BakeSettings {
    BakeSettings {
        density_per_sr,
        map_resolution: MapResolution::Fixed {
            width: side,
            height: side,
        },
        error_metric: ErrorMetric::Rmse,
        ..BakeSettings::of(estimator)
    }
}

/// Splats at a density [rays/sr], with maps of side² texels.
pub fn settings(density_per_sr: f64, side: usize) -> BakeSettings {
    by(Estimator::Splat, density_per_sr, side)
}

/// Bundles and photons to a relative RMSE, with maps of side² texels.
pub fn to(target: f64, side: usize) -> BakeSettings {
    BakeSettings {
        max_error: Some(target),
        ..by(Estimator::Auto, BakeSettings::default().density_per_sr, side)
    }
}

/// Photons at a density [rays/sr] without filtering, with maps of side² texels.
pub fn photons(density_per_sr: f64, side: usize) -> BakeSettings {
    BakeSettings {
        filter: Some(false),
        ..by(Estimator::Photon, density_per_sr, side)
    }
}

pub fn bake(scene: Scene, settings: &BakeSettings) -> Bake {
    let mut session = Baker::new(Arc::new(scene)).expect("a session");
    session.bake(settings, &(), &Control::default()).expect("a bake")
}

/// The map of the named object, which must exist.
pub fn map_of<'a>(result: &'a Bake, scene: &Scene, name: &str) -> &'a IlluminationMap {
    result
        .maps
        .iter()
        .find(|map| scene.objects[map.chart.object()].name == name)
        .unwrap_or_else(|| panic!("{name} received no light"))
}

/// Luminance of the caustic layer for each texel [W/m²].
pub fn caustic(map: &IlluminationMap) -> Vec<f64> {
    let layer = map.layer(LayerKind::Caustic).expect("a caustic layer");
    layer
        .irradiance
        .iter()
        .map(|&[r, g, b]| {
            rgb(f64::from(r), f64::from(g), f64::from(b)).luminance()
        })
        .collect()
}

/// The first fault in the energy balance of a bake: a ledger that does not close, or maps whose flux differs from the
/// flux deposited according to the ledgers. Both tolerances are 1e-6, as maps are in single precision.
pub fn energy_fault(result: &Bake) -> Option<String> {
    for ledger in &result.ledgers {
        let imbalance = ledger.energy_w.relative_imbalance();
        if imbalance.is_nan() || imbalance > 1e-6 {
            return Some(format!(
                "the ledger of {} is off by {imbalance:e}: {ledger:?}",
                ledger.light
            ));
        }
    }
    let deposited: f64 = result
        .ledgers
        .iter()
        .map(|ledger| ledger.energy_w.deposited)
        .sum();
    let held: f64 = result
        .maps
        .iter()
        .map(|map| map.flux_w(LayerKind::Caustic).luminance())
        .sum();
    let off = (held - deposited).abs();
    (off.is_nan() || off > 1e-6 * deposited)
        .then(|| format!("the maps hold {held} W, the ledgers say {deposited} W"))
}

/// The scene rotated or mirrored, scaled about the origin, then translated. Lights keep their strength, skies their
/// orientation.
pub fn transformed(mut scene: Scene, rotation: DMat3, scale: f64, offset: DVec3) -> Scene {
    let place = |p: DVec3| rotation * p * scale + offset;
    let turned = |direction: DVec3| (rotation * direction).normalize();
    let is_mirrored = rotation.determinant() < 0.0;
    for object in &mut scene.objects {
        let mesh = object.mesh_in_scene_mut();
        mesh.positions.iter_mut().for_each(|p| *p = place(*p));
        mesh.normals.iter_mut().for_each(|n| *n = turned(*n));
        if is_mirrored {
            // Keeps the outsides of surfaces outside.
            mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
    }
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { position, .. } => *position = place(*position),
            LightKind::Spot {
                position, direction, ..
            } => (*position, *direction) = (place(*position), turned(*direction)),
            LightKind::Sun { direction, .. } => *direction = turned(*direction),
            LightKind::Panel {
                centre, across, down, ..
            } => {
                let side = if is_mirrored { -scale } else { scale };
                (*centre, *across, *down) = (place(*centre), rotation * *across * scale, rotation * *down * side);
            }
            LightKind::Surface { .. } | LightKind::Environment { .. } => {}
        }
    }
    for material in &mut scene.materials {
        if let Some(volume) = &mut material.volume {
            volume.attenuation_distance_m *= scale;
        }
    }
    for camera in &mut scene.cameras {
        *camera = Camera {
            position: place(camera.position),
            forward: turned(camera.forward),
            up: turned(camera.up),
            ..camera.clone()
        };
    }
    scene
}

/// The bits of all layers of a map, for exact comparison.
pub fn bits(map: &IlluminationMap) -> Vec<u32> {
    map.layers
        .iter()
        .flat_map(|layer| &layer.irradiance)
        .flatten()
        .map(|e| e.to_bits())
        .collect()
}

/// A brute-force reference bake of a scene.
pub fn brute(scene: &Scene, settings: &BakeSettings, rays: u64) -> Bake {
    let tracer = Tracer::new(Arc::new(scene.clone()));
    brute_force(&tracer, settings, rays, &(), &Control::default()).expect("a reference")
}
