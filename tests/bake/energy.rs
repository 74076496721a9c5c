//! Every watt is accounted for.

use nephroid::scene::builtin;
use nephroid::settings::{Footprint, Kernel, KernelSampling, LayerKind, RayPlacement, Sigma};

use crate::tools::{bake, builtin_scene, energy_fault, settings};

#[test]
fn ledgers_close_on_every_built_in_scene() {
    for name in builtin::NAMES {
        // A slit of a millimetre lets one ray of hundreds through.
        let density = if name == "prism" { 2e6 } else { 3e3 };
        let result = bake(builtin_scene(name), &settings(density, 64));
        assert_eq!(energy_fault(&result), None, "{name}");
        assert!(
            result
                .ledgers
                .iter()
                .any(|ledger| ledger.energy_w.deposited > 0.0),
            "{name}: nothing arrived"
        );
    }
}

#[test]
fn a_lost_texel_or_deposit_is_noticed() {
    let mut result = bake(builtin_scene("ring"), &settings(3e3, 64));
    assert_eq!(energy_fault(&result), None);
    let splats = result.counts.splats as f64;

    let mut short = result.clone();
    short.ledgers[0].energy_w.deposited -= short.ledgers[0].energy_w.deposited / splats;
    assert!(
        energy_fault(&short).is_some(),
        "a ledger without one of {splats} deposits passes"
    );

    let map = result
        .maps
        .iter_mut()
        .find(|map| map.layer(LayerKind::Caustic).is_some())
        .expect("a map");
    let layer = map
        .layers
        .iter_mut()
        .find(|layer| layer.kind == LayerKind::Caustic)
        .expect("its layer");
    let mean = layer.irradiance.iter().map(|e| e[1]).sum::<f32>() / layer.irradiance.len() as f32;
    let lit = layer
        .irradiance
        .iter_mut()
        .find(|e| e[1] > mean)
        .expect("a lit texel");
    *lit = [0.0; 3];
    assert!(
        energy_fault(&result).is_some(),
        "a map without one of its texels passes"
    );
}

#[test]
fn every_kernel_footprint_and_placement_keeps_the_flux() {
    let scene = builtin_scene("ring");
    let base = settings(3e3, 48);
    let exact = bake(scene.clone(), &base).ledgers[0].energy_w;
    for kernel in [Kernel::Gaussian, Kernel::Cone, Kernel::Disc, Kernel::Box] {
        for footprint in [
            Footprint::Ellipse,
            Footprint::Disc,
            Footprint::Distance,
            Footprint::Fixed,
        ] {
            for kernel_sampling in [KernelSampling::Integrated, KernelSampling::Point] {
                for sigma in [Sigma::Constant(0.5), Sigma::Adaptive] {
                    let settings = nephroid::settings::BakeSettings {
                        kernel,
                        footprint,
                        kernel_sampling,
                        sigma,
                        ..base.clone()
                    };
                    let result = bake(scene.clone(), &settings);
                    assert_eq!(energy_fault(&result), None, "{settings:?}");
                    // The same rays: not a bit of the accounts may depend on how they are drawn.
                    assert_eq!(result.ledgers[0].energy_w, exact, "{settings:?}");
                }
            }
        }
    }
    let jittered = nephroid::settings::BakeSettings {
        rays: RayPlacement::Jittered,
        ..base
    };
    assert_eq!(energy_fault(&bake(scene, &jittered)), None);
}
