//! Effects are simulated where a scene calls for them: left out, they change nothing; switched off, they are missing.

use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::session::BakeResult;

use crate::prelude::*;
use support::effect_scenes::{EffectScene, all};
use support::tools::{at, bake, bits, energy_fault, photons, settings};

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

fn all_bits(result: &BakeResult) -> Vec<(usize, Vec<u32>)> {
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
    let result = bake(dark.scene.clone(), &at(3_000.0, 48));
    assert!(result.maps.is_empty());
    assert_eq!(result.plan.effects[0].reason, "the scene has no light");
    for case in &scenes {
        check(case, &photons(30_000.0, 24));
        let soft = [Effect::AreaLights, Effect::Roughness];
        if soft.iter().any(|effect| case.calls_for.contains(effect)) {
            continue;
        }
        for settings in [at(3_000.0, 48), settings(6_000.0, 48)] {
            check(case, &settings);
        }
    }
}
