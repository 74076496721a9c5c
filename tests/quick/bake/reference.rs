//! The built-in scenes against maps of an independent solver (`assets/reference`), bits that nothing may change, and
//! effects: simulated where a scene calls for them; left out, they change nothing; switched off, they are missing.

use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::illumination::lookup::bilinear;

use crate::prelude::*;
use support::effect_scenes::{EffectScene, all};
use support::references::references;
use support::tools::{bake, bits, builtin_scene, energy_fault, map_of, photons, settings, to};

#[test]
fn bundles_agree_with_the_solver() {
    let small = ["ring", "mirror", "slab", "nephroid"];
    let references = references();
    for reference in references
        .iter()
        .filter(|reference| small.contains(&reference.builtin))
    {
        reference.check_bundles();
    }
}

#[test]
fn splats_agree_with_the_solver() {
    for reference in references() {
        let Some((density, most)) = reference.by_splats else {
            continue;
        };
        let scene = builtin_scene(reference.builtin);
        let result = bake(scene.clone(), &settings(density, 256));
        reference.check(&result, &scene, (most, 0.005));
    }
}

/// The mirror's scene with its floor in the middle half of its map.
fn with_room_around_the_floor() -> Scene {
    let mut scene = builtin_scene("mirror");
    let mut objects = scene.objects.iter_mut();
    let floor = objects.find(|object| object.name == "floor").expect("a floor");
    let mesh = floor.mesh_in_scene_mut();
    for uv in mesh.uv0.as_mut().expect("coordinates") {
        *uv = *uv * 0.5 + 0.25;
    }
    scene
}

/// Texels beside a surface hold the mean of their neighbours on it, so that look-ups at its border show no dark seam.
#[test]
fn gutters_are_filled() {
    let side = 64_usize;
    let scene = with_room_around_the_floor();
    for base in [to(0.01, side), settings(2e4, side)] {
        let settings = with(base, |it| it.layers = LayerKind::ALL.to_vec());
        let result = bake(scene.clone(), &settings);
        let map = map_of(&result, &scene, "floor");
        let is_covered = |texel: usize| map.chart.texel_area_m2(texel) > 0.0;
        let covered = (0..side * side).filter(|&texel| is_covered(texel));
        assert_eq!(covered.count(), side * side / 4);
        assert_eq!(map.layers.len(), 3);
        for layer in &map.layers {
            let values = &layer.irradiance;
            let mut gutter = 0;
            for texel in (0..side * side).filter(|&texel| !is_covered(texel)) {
                let (column, row) = (texel % side, texel / side);
                let around = (row.saturating_sub(1)..=(row + 1).min(side - 1)).flat_map(|row| {
                    let columns = column.saturating_sub(1)..=(column + 1).min(side - 1);
                    columns.map(move |column| row * side + column)
                });
                let known = { around }.filter(|&texel| is_covered(texel));
                let known: Vec<f32> = known.map(|texel| values[texel][1]).collect();
                if known.is_empty() {
                    continue;
                }
                gutter += 1;
                let mean = known.iter().sum::<f32>() / known.len() as f32;
                let off = (values[texel][1] - mean).abs();
                assert!(off <= 1e-5 * mean, "{:?} at {column}, {row}", layer.kind);
            }
            assert_eq!(gutter, 4 * (side / 2) + 4);
            if layer.kind == LayerKind::Direct {
                check_border(values, side);
            }
        }
    }
}

/// No dark seam: with nothing beside it, the floor's border would be half as bright as half a texel further in. Edges of
/// shadows that meet the border take a third at most.
fn check_border(values: &[[f32; 3]], side: usize) {
    for step in 0..=200 {
        let along = 0.25 + 0.5 * f64::from(step) / 200.0;
        for (border, inside) in [(0.25, 0.25 + 0.5 / side as f64), (0.75, 0.75 - 0.5 / side as f64)] {
            let look = |across: f64| {
                [dvec2(across, along), dvec2(along, across)]
                    .map(|uv| bilinear(values, side, side, uv).luminance())
            };
            for (at_border, further_in) in look(border).into_iter().zip(look(inside)) {
                assert!(at_border >= 0.6 * further_in, "{at_border} beside {further_in}");
            }
        }
    }
}

/// All but the indirect layer and the eye's chains.
const EFFECTS: [Effect; 10] = [
    Effect::LightPass,
    Effect::Refraction,
    Effect::Dispersion,
    Effect::Reflection,
    Effect::Absorption,
    Effect::Textures,
    Effect::Roughness,
    Effect::Bumps,
    Effect::AreaLights,
    Effect::Direct,
];

fn all_bits(result: &Bake) -> Vec<(usize, Vec<u32>)> {
    let maps = result.maps.iter();
    maps.map(|map| (map.chart.receiver.index(), bits(map))).collect()
}

fn check(case: &EffectScene, settings: &BakeSettings) {
    let what = format!("{}, {:?}", case.name, settings.estimator);
    let bake = |effects: EffectSwitches| {
        let settings = BakeSettings {
            layers: case.layers.clone(),
            effects,
            ..settings.clone()
        };
        bake(case.scene.clone(), &settings)
    };
    let planned = bake(EffectSwitches::default());
    // Layers are asked for, not called for.
    let everything = EffectSwitches::all_on()
        .with(Effect::Direct, EffectSwitch::Auto)
        .with(Effect::Indirect, EffectSwitch::Auto);
    assert!(
        all_bits(&bake(everything)) == all_bits(&planned),
        "{what}: forced on, other maps"
    );
    let rays = planned.counts.rays;
    assert_eq!(case.calls_for.is_empty(), rays == 0, "{what}: {rays} rays");
    for effect in EFFECTS {
        let mut lines = planned.plan.effects.iter();
        let line = lines.find(|line| line.effect == effect).expect("its line");
        let is_called = case.calls_for.contains(&effect);
        assert_eq!(line.on, is_called, "{what}: {line:?}");
        if !is_called {
            continue;
        }
        let what = format!("{what}: {} off", effect.name());
        let without = bake(EffectSwitches::default().with(effect, EffectSwitch::Off));
        assert!(!without.plan.is_on(effect), "{what} is on");
        assert!(all_bits(&without) != all_bits(&planned), "{what} changes nothing");
        let rays = match effect {
            Effect::LightPass => without.counts.rays,
            Effect::Direct => without.counts.shadow_rays,
            _ => 0,
        };
        assert_eq!(rays, 0, "{what} traces rays");
        let ledgers = without.ledgers.iter();
        let lost_w: f64 = ledgers.map(|ledger| ledger.energy_w.truncated.switched_off).sum();
        let loses_light = [Effect::Refraction, Effect::Reflection].contains(&effect);
        assert_eq!(loses_light, lost_w > 0.0, "{what}, {lost_w} W booked");
        assert_eq!(energy_fault(&without), None, "{what}");
    }
}

#[test]
fn only_what_is_called_for() {
    let scenes = all();
    for effect in EFFECTS {
        let has = |case: &EffectScene| case.calls_for.contains(&effect);
        assert!(scenes.iter().any(has) && !scenes.iter().all(has), "{effect:?}");
    }
    let dark = scenes
        .iter()
        .find(|case| case.name == "no light")
        .expect("it is listed");
    let result = bake(dark.scene.clone(), &to(0.03, 48));
    assert!(result.maps.is_empty());
    assert_eq!(result.plan.effects[0].reason, "the scene has no light");
    for case in &scenes {
        check(case, &photons(30_000.0, 24));
        let soft = [Effect::AreaLights, Effect::Roughness];
        if soft.iter().any(|effect| case.calls_for.contains(effect)) {
            continue;
        }
        for settings in [to(0.03, 48), settings(6_000.0, 48)] {
            check(case, &settings);
        }
    }
}
