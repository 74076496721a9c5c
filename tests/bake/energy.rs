//! Every watt is accounted for.

use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin;
use nephroid::settings::{BakeSettings, Footprint, Kernel, KernelSampling, LayerKind, RayPlacement, Sigma};

use crate::tools::{at, bake, builtin_scene, energy_fault, settings};

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
fn every_lamp_of_the_gallery_has_its_caster() {
    let gallery = builtin_scene("gallery");
    let result = bake(gallery.clone(), &settings(1e4, 16));
    for light in &gallery.lights {
        let ledger = result.ledgers.iter().find(|ledger| ledger.light == light.name);
        let deposited_w = ledger.expect("a ledger for each light").energy_w.deposited;
        assert!(deposited_w > 0.003, "{}: {deposited_w} W", light.name);
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
                    let settings = BakeSettings {
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
    let jittered = BakeSettings {
        rays: RayPlacement::Jittered,
        ..base
    };
    assert_eq!(energy_fault(&bake(scene, &jittered)), None);
}

/// Patches and kernels book in ways of their own: what one forgets, drops or books twice, the other tells. What patches
/// leave open between what a surface sends on and what arrives is small as well.
#[test]
fn both_estimators_agree_on_every_account() {
    let mut ball = builtin_scene("ball");
    let mut ring = builtin_scene("ring");
    for material in &mut ball.materials {
        if let Some(volume) = &mut material.volume {
            volume.attenuation_distance_m = 0.3;
            volume.attenuation_colour = LinearSrgb::new(0.3, 0.5, 0.7);
        }
    }
    for material in ring
        .materials
        .iter_mut()
        .filter(|material| material.metallic > 0.0)
    {
        material.base_colour = LinearSrgb::new(0.5, 0.6, 0.7);
    }
    // Within tinted glass, light is taken before its first hit.
    let mut within = ball.clone();
    let (low, high) = within.objects[1].mesh.bounds().expect("a ball");
    let lamp = within.lights[0].kind.position().expect("a point light");
    within.lights[0].kind = within.lights[0].kind.moved(0.5 * (low + high) - lamp);
    for (name, scene, density) in [
        ("ball", ball, 2e4),
        ("ring", ring, 2e4),
        ("lamp within", within, 1e3),
    ] {
        let of = |settings: &BakeSettings| {
            let result = bake(scene.clone(), settings);
            assert_eq!(energy_fault(&result), None, "{name}");
            let energy_w = result.ledgers[0].energy_w;
            let open = energy_w.truncated.quadrature / energy_w.emitted;
            let accounts_w = [
                energy_w.emitted,
                energy_w.deposited,
                energy_w.absorbed,
                energy_w.escaped,
            ];
            (accounts_w, open)
        };
        let (patches_w, open) = of(&at(density, 64));
        let (kernels_w, _) = of(&settings(density, 64));
        println!("{name}: {patches_w:?} by patches, {kernels_w:?} by kernels; {open:e} left open");
        assert!(patches_w[2] > 0.1 * patches_w[0], "{name}: something is absorbed");
        for (a, b) in patches_w.into_iter().zip(kernels_w) {
            assert!(
                (a - b).abs() < 0.01 * patches_w[0],
                "{name}: {patches_w:?}, {kernels_w:?}"
            );
        }
        assert!(open.abs() < 2e-3, "{name}: {open}");
    }
}
