//! What the plan leaves out changes no map: random scenes with walls, boxes, mirrors, glass and lamps, baked as the plan
//! says and with every effect forced on.

use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::optics::LinearSrgb;
use nephroid::session::BakeResult;
use nephroid::settings::{BakeSettings, Estimator, LayerKind};
use nephroid::study::stability::random;

use super::tools::{at, bake, settings};

const SCENES: u64 = 200;

/// Σ|E₁ − E₂|·A [W] over all maps; a map that one of them lacks counts as black.
fn difference_w(a: &BakeResult, b: &BakeResult, objects: usize) -> f64 {
    let texels = |result: &BakeResult, object: usize| -> Option<Vec<f64>> {
        let map = result.maps.iter().find(|map| map.chart.object() == object)?;
        let layer = map.layer(LayerKind::Caustic)?;
        let luminance = |(texel, e): (usize, &[f32; 3])| {
            LinearSrgb::from(e.map(f64::from)).luminance() * map.chart.texel_area_m2(texel)
        };
        Some(layer.irradiance.iter().enumerate().map(luminance).collect())
    };
    let of_object = |object: usize| match (texels(a, object), texels(b, object)) {
        (Some(a), Some(b)) => a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum(),
        (Some(only), None) | (None, Some(only)) => only.iter().sum(),
        (None, None) => 0.0,
    };
    (0..objects).map(of_object).sum()
}

/// What a bake gave up [W].
fn booked_w(result: &BakeResult) -> f64 {
    let ledgers = result.ledgers.iter();
    ledgers
        .map(|ledger| ledger.energy_w.truncated.total().abs())
        .sum()
}

/// What one scene came to.
struct Outcome {
    fault: Option<String>,
    is_equal: bool,
    rays: (u64, u64),
    was_cut: bool,
}

fn compare(seed: u64, estimator: Estimator) -> Outcome {
    let scene = random::scene(seed);
    let settings = BakeSettings {
        // Glass boxes have branches without end.
        max_depth: 4,
        branch_threshold: Some(1e-2),
        threads: 1,
        ..match estimator {
            Estimator::Wavefront => at(2_000.0, 32),
            Estimator::Splat => settings(2_000.0, 32),
        }
    };
    let auto = bake(scene.clone(), &settings);
    let forced = bake(
        scene.clone(),
        &BakeSettings {
            effects: EffectSwitches::all_on()
                .with(Effect::Direct, EffectSwitch::Auto)
                .with(Effect::Indirect, EffectSwitch::Auto),
            ..settings
        },
    );
    let difference = difference_w(&auto, &forced, scene.objects.len());
    let booked = (booked_w(&auto) - booked_w(&forced)).abs();
    let fault = (difference > booked + 1e-9).then(|| {
        format!("scene {seed}, {estimator:?}: maps differ by {difference:e} W, {booked:e} W are booked")
    });
    Outcome {
        fault,
        is_equal: difference == 0.0,
        rays: (auto.counts.rays, forced.counts.rays),
        was_cut: auto.plan.lights.iter().any(|light| !light.on),
    }
}

/// Every second scene, on as many threads as there are cores: each bake is to have one of its own.
fn half(estimator: Estimator, from: u64) -> Vec<Outcome> {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get) as u64;
    let part = |first: u64| -> Vec<Outcome> {
        let seeds = (from + 2 * first..SCENES).step_by(2 * threads as usize);
        seeds.map(|seed| compare(seed, estimator)).collect()
    };
    std::thread::scope(|scope| {
        let parts: Vec<_> = (0..threads)
            .map(|first| scope.spawn(move || part(first)))
            .collect();
        let done = parts
            .into_iter()
            .flat_map(|part| part.join().expect("no bake panics"));
        done.collect()
    })
}

#[test]
fn two_hundred_random_scenes_are_the_same_with_everything_forced_on() {
    for (estimator, from) in [(Estimator::Wavefront, 0), (Estimator::Splat, 1)] {
        let outcomes = half(estimator, from);
        let faults: Vec<&String> = outcomes
            .iter()
            .filter_map(|outcome| outcome.fault.as_ref())
            .collect();
        let equal = outcomes.iter().filter(|outcome| outcome.is_equal).count();
        let cut = outcomes.iter().filter(|outcome| outcome.was_cut).count();
        let (auto, forced) = outcomes.iter().fold((0, 0), |sum, outcome| {
            (sum.0 + outcome.rays.0, sum.1 + outcome.rays.1)
        });
        println!(
            "{estimator:?}: {equal} of {} scenes equal to the bit; lights left out in {cut}; {auto} rays, {forced} \
             with everything on",
            outcomes.len()
        );
        assert_eq!(outcomes.len() as u64, SCENES / 2);
        assert!(
            faults.is_empty(),
            "{} of {}: {faults:#?}",
            faults.len(),
            outcomes.len()
        );
        assert!(cut > 10, "the scenes are to have something that can be left out");
        assert!(auto < forced);
    }
}
