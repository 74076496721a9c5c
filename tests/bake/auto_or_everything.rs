//! What the plan leaves out changes no map: random scenes with walls, boxes, mirrors, glass and lamps, baked as the plan
//! says and with every effect forced on.

use glam::{DQuat, DVec3};
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, LightKind, Material, Scene, Volume};
use nephroid::session::BakeResult;
use nephroid::settings::{BakeSettings, Estimator, LayerKind};
use nephroid::units::{Flux, Irradiance, RadiantIntensity};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::tools::{at, bake, settings};

const SCENES: u64 = 200;

struct Dice(Pcg64Mcg);

impl Dice {
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (-53_f64).exp2()
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn below(&mut self, count: u32) -> u32 {
        self.between(0.0, f64::from(count)) as u32
    }

    fn place(&mut self, height: [f64; 2]) -> DVec3 {
        DVec3::new(
            self.between(-0.8, 0.8),
            self.between(height[0], height[1]),
            self.between(-0.8, 0.8),
        )
    }

    fn turn(&mut self) -> DQuat {
        DQuat::from_rotation_y(self.between(0.0, 6.3)) * DQuat::from_rotation_x(self.between(0.0, 3.2))
    }
}

fn glass(dice: &mut Dice) -> Material {
    let mut glass = parts::dielectric("glass", dice.between(1.2, 1.9));
    if dice.below(3) == 0 {
        glass.volume = Some(Volume {
            attenuation_distance_m: dice.between(0.05, 1.0),
            attenuation_colour: LinearSrgb::new(0.9, 0.5, 0.3),
        });
    }
    glass
}

fn add_caster(scene: &mut Scene, dice: &mut Dice, index: u32) {
    let (centre, size) = (dice.place([0.2, 1.0]), dice.between(0.15, 0.3));
    let turn = dice.turn();
    let panel = shapes::rectangle(centre, turn * DVec3::X * size, turn * DVec3::Z * size);
    let (mesh, material) = match dice.below(5) {
        0 => (shapes::sphere(centre, size, 2), glass(dice)),
        1 => (shapes::sphere(centre, size, 2), parts::mirror()),
        2 => (panel, parts::mirror()),
        3 => {
            let pane = Material {
                surface: nephroid::scene::SurfaceKind::ThinWall,
                volume: None,
                ..parts::dielectric("pane", 1.5)
            };
            (panel, pane)
        }
        _ => (shapes::cuboid(centre - size, centre + size), glass(dice)),
    };
    parts::add(scene, &format!("caster{index}"), mesh, material);
    // Sealed, now and then.
    if dice.below(4) == 0 {
        let half = size * dice.between(1.8, 2.5);
        let safe = shapes::cuboid(centre - half, centre + half);
        parts::add(
            scene,
            &format!("safe{index}"),
            safe,
            parts::matte("safe", LinearSrgb::grey(0.5)),
        );
    }
}

fn add_wall(scene: &mut Scene, dice: &mut Dice, index: u32) {
    let centre = dice.place([0.1, 1.2]);
    let turn = dice.turn();
    let (width, height) = (dice.between(0.1, 0.8), dice.between(0.1, 0.8));
    let mesh = shapes::rectangle(centre, turn * DVec3::X * width, turn * DVec3::Z * height);
    let matte = parts::matte("wall", LinearSrgb::grey(0.5));
    parts::add(scene, &format!("wall{index}"), mesh, matte);
}

fn lamp(dice: &mut Dice, index: u32) -> Light {
    let (name, place) = (format!("lamp{index}"), dice.place([0.8, 2.2]));
    match dice.below(4) {
        0 => parts::sun(
            &name,
            DVec3::new(dice.between(-1.0, 1.0), -1.0, dice.between(-1.0, 1.0)),
            Irradiance(2.0),
        ),
        1 => Light {
            name,
            colour: LinearSrgb::WHITE,
            spectrum: None,
            kind: LightKind::Spot {
                position: place,
                direction: (dice.place([0.0, 0.6]) - place).normalize(),
                intensity: RadiantIntensity(2.0),
                inner_cone_rad: 0.2,
                outer_cone_rad: dice.between(0.3, 1.0),
            },
            size: nephroid::scene::LightSize::None,
        },
        _ => parts::point_light(&name, place, Flux(10.0)),
    }
}

fn random_scene(seed: u64) -> Scene {
    let mut dice = Dice(Pcg64Mcg::seed_from_u64(0xeffec7 ^ seed << 20));
    let mut scene = parts::reference_scene(1.0);
    for index in 0..1 + dice.below(3) {
        add_caster(&mut scene, &mut dice, index);
    }
    for index in 0..dice.below(4) {
        add_wall(&mut scene, &mut dice, index);
    }
    for index in 0..1 + dice.below(3) {
        let lamp = lamp(&mut dice, index);
        scene.lights.push(lamp);
    }
    scene
}

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
    let scene = random_scene(seed);
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
