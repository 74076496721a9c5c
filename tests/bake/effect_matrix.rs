//! A dozen scenes against every effect of the light pass: what a scene does not call for takes no ray, no byte and no
//! deposit, counted where the work is done; what it calls for takes some, and changes the maps.

use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::scene::Scene;
use nephroid::session::{BakeResult, EffectCounts};
use nephroid::settings::{BakeSettings, Estimator, LayerKind};

use super::effect_scenes::{EffectScene, all};
use super::tools::{at, bake, bits, energy_fault, settings};

/// Effects that the light pass knows.
const OF_THE_BAKE: [Effect; 10] = [
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

fn counts(result: &BakeResult, effect: Effect) -> EffectCounts {
    let report = result.effects.iter().find(|report| report.line.effect == effect);
    report.expect("every effect is reported").counts
}

fn is_nothing(counts: &EffectCounts) -> bool {
    counts.rays == 0 && counts.deposits == 0 && counts.bytes == 0
}

fn all_bits(result: &BakeResult) -> Vec<(usize, Vec<u32>)> {
    result
        .maps
        .iter()
        .map(|map| (map.chart.object(), bits(map)))
        .collect()
}

fn check(case: &EffectScene, settings: &BakeSettings, faults: &mut Vec<String>) {
    let settings = BakeSettings {
        layers: case.layers.clone(),
        wavefronts: Some(4),
        ..settings.clone()
    };
    let whole = bake(case.scene.clone(), &settings);
    for effect in OF_THE_BAKE {
        let what = format!("{} of `{}`, {:?}", effect.name(), case.name, settings.estimator);
        let took = counts(&whole, effect);
        let line = whole.plan.effects.iter().find(|line| line.effect == effect);
        let is_called = case.calls_for.contains(&effect);
        if line.is_none_or(|line| line.on != is_called) {
            faults.push(format!("{what}: {line:?}"));
        }
        if is_called == (took.rays == 0) || (!is_called && !is_nothing(&took)) {
            faults.push(format!("{what}: {took:?}"));
        }
        let deposits = [Effect::LightPass, Effect::Refraction, Effect::Reflection].contains(&effect);
        if is_called && deposits && took.deposits == 0 {
            faults.push(format!("{what}: no deposit, {took:?}"));
        }
        if is_called {
            check_off(case, &settings, effect, (&whole, &what), faults);
        }
    }
}

/// Without an effect that is called for: nothing is taken for it, the maps are others, and every watt is booked.
fn check_off(
    case: &EffectScene,
    settings: &BakeSettings,
    effect: Effect,
    (whole, what): (&BakeResult, &str),
    faults: &mut Vec<String>,
) {
    let without = BakeSettings {
        effects: EffectSwitches::default().with(effect, EffectSwitch::Off),
        ..settings.clone()
    };
    let result = bake(case.scene.clone(), &without);
    if !is_nothing(&counts(&result, effect)) {
        faults.push(format!("{what}: off, yet {:?}", counts(&result, effect)));
    }
    if all_bits(&result) == all_bits(whole) {
        faults.push(format!("{what}: off, and nothing changes"));
    }
    let lost: f64 = result
        .ledgers
        .iter()
        .map(|ledger| ledger.energy_w.truncated.switched_off)
        .sum();
    let loses_light = [Effect::Refraction, Effect::Reflection].contains(&effect);
    if loses_light != (lost > 0.0) {
        faults.push(format!("{what}: off, {lost} W switched off"));
    }
    faults.extend(energy_fault(&result).map(|fault| format!("{what}: off, {fault}")));
}

#[test]
fn effects_that_are_off_take_nothing_and_those_that_are_on_change_the_maps() {
    let scenes = all();
    assert!(scenes.len() >= 11);
    let mut faults = Vec::new();
    for case in &scenes {
        for settings in [at(3_000.0, 48), settings(6_000.0, 48)] {
            check(case, &settings, &mut faults);
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
    for effect in OF_THE_BAKE {
        let has = |case: &&EffectScene| case.calls_for.contains(&effect);
        assert!(scenes.iter().any(|case| has(&case)) && scenes.iter().any(|case| !has(&case)));
    }
}

/// Forced on, an effect that nothing calls for runs its code and changes no bit.
#[test]
fn forcing_on_what_nothing_calls_for_changes_no_bit() {
    let mut compared = 0;
    for case in all().iter().filter(|case| !case.calls_for.is_empty()) {
        for estimator in [Estimator::Wavefront, Estimator::Splat] {
            let settings = BakeSettings {
                layers: vec![LayerKind::Caustic],
                ..match estimator {
                    Estimator::Wavefront => at(3_000.0, 48),
                    Estimator::Splat => settings(6_000.0, 48),
                }
            };
            let auto = bake(case.scene.clone(), &settings);
            let forced = bake(case.scene.clone(), &forced_on(&settings));
            assert!(
                all_bits(&auto) == all_bits(&forced),
                "{}, {estimator:?}",
                case.name
            );
            compared += 1;
        }
    }
    assert!(compared >= 10);
}

fn forced_on(settings: &BakeSettings) -> BakeSettings {
    BakeSettings {
        // The direct layer is a layer of its own.
        effects: EffectSwitches::all_on()
            .with(Effect::Direct, EffectSwitch::Auto)
            .with(Effect::Indirect, EffectSwitch::Auto),
        ..settings.clone()
    }
}

/// A scene in which nothing is to be done says so.
#[test]
fn a_scene_without_light_says_why_nothing_is_done() {
    let dark: Vec<Scene> = all()
        .into_iter()
        .filter(|case| case.name == "no light")
        .map(|case| case.scene)
        .collect();
    let result = bake(dark[0].clone(), &at(3_000.0, 48));
    assert!(result.maps.is_empty());
    assert_eq!(result.plan.effects[0].reason, "the scene has no light");
}
