//! Random scenes with walls, boxes, mirrors, glass and lamps, and what must hold in every one of them.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use glam::{DMat3, DQuat, DVec3};

use super::laws::{luminance, map_sum, maps_apart, same_bits};
use super::scenes::{at, random, transformed};
use super::{Bench, Case, Effort, Group};
use crate::error::Result;
use crate::illumination::{IlluminationMap, Receiver, UvSet};
use crate::optics::LinearSrgb;
use crate::scene::builtin::{parts, shapes};
use crate::scene::{Light, LightKind, LightSize, Material, Scene, SurfaceKind, Volume};
use crate::session::BakeResult;
use crate::settings::{BakeSettings, Estimator, LayerKind};
use crate::units::{Flux, Irradiance, RadiantIntensity};

/// Cases of many scenes.
pub const CASES: &[Case] = &[Case::quick("random-scenes", Group::Laws, keep_laws)];

/// Scenes that are tried, by effort.
pub const fn count(effort: Effort) -> u64 {
    match effort {
        Effort::Quick => 200,
        Effort::Long => 10_000,
    }
}

/// Lamps of a scene, at most.
const MOST_LAMPS: u32 = 3;

/// Scenes baked side by side.
const BATCH: u64 = 32;

struct Dice<F>(F);

impl<F: FnMut() -> f64> Dice<F> {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0)()
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

    fn glass(&mut self) -> Material {
        let mut glass = parts::dielectric("glass", self.between(1.2, 1.9));
        if self.below(3) == 0 {
            glass.volume = Some(Volume {
                attenuation_distance_m: self.between(0.05, 1.0),
                attenuation_colour: LinearSrgb::new(0.9, 0.5, 0.3),
            });
        }
        glass
    }

    fn add_caster(&mut self, scene: &mut Scene, index: u32) {
        let (centre, size) = (self.place([0.2, 1.0]), self.between(0.15, 0.3));
        let turn = self.turn();
        let panel = shapes::rectangle(centre, turn * DVec3::X * size, turn * DVec3::Z * size);
        let (mesh, material) = match self.below(5) {
            0 => (shapes::sphere(centre, size, 2), self.glass()),
            1 => (shapes::sphere(centre, size, 2), parts::mirror()),
            2 => (panel, parts::mirror()),
            3 => {
                let pane = Material {
                    surface: SurfaceKind::ThinWall,
                    volume: None,
                    ..parts::dielectric("pane", 1.5)
                };
                (panel, pane)
            }
            _ => (shapes::cuboid(centre - size, centre + size), self.glass()),
        };
        parts::add(scene, &format!("caster{index}"), mesh, material);
        // Sealed, now and then.
        if self.below(4) == 0 {
            let half = size * self.between(1.8, 2.5);
            let safe = shapes::cuboid(centre - half, centre + half);
            let matte = parts::matte("safe", LinearSrgb::grey(0.5));
            parts::add(scene, &format!("safe{index}"), safe, matte);
        }
    }

    fn add_wall(&mut self, scene: &mut Scene, index: u32) {
        let centre = self.place([0.1, 1.2]);
        let turn = self.turn();
        let (width, height) = (self.between(0.1, 0.8), self.between(0.1, 0.8));
        let mesh = shapes::rectangle(centre, turn * DVec3::X * width, turn * DVec3::Z * height);
        let matte = parts::matte("wall", LinearSrgb::grey(0.5));
        parts::add(scene, &format!("wall{index}"), mesh, matte);
    }

    fn lamp(&mut self, index: u32) -> Light {
        let (name, place) = (format!("lamp{index}"), self.place([0.8, 2.2]));
        match self.below(4) {
            0 => {
                let direction = DVec3::new(self.between(-1.0, 1.0), -1.0, self.between(-1.0, 1.0));
                parts::sun(&name, direction, Irradiance(2.0))
            }
            1 => Light {
                name,
                colour: LinearSrgb::WHITE,
                spectrum: None,
                kind: LightKind::Spot {
                    position: place,
                    direction: (self.place([0.0, 0.6]) - place).normalize(),
                    intensity: RadiantIntensity(2.0),
                    inner_cone_rad: 0.2,
                    outer_cone_rad: self.between(0.3, 1.0),
                },
                size: LightSize::None,
            },
            _ => parts::point_light(&name, place, Flux(10.0)),
        }
    }
}

/// One of many scenes: a floor, up to three casters, some of them sealed, up to three walls, up to three lamps.
pub fn scene(seed: u64) -> Scene {
    let mut dice = Dice(random(0xeffec7 ^ seed << 20));
    let mut scene = parts::reference_scene(1.0);
    for index in 0..1 + dice.below(3) {
        dice.add_caster(&mut scene, index);
    }
    for index in 0..dice.below(4) {
        dice.add_wall(&mut scene, index);
    }
    for index in 0..1 + dice.below(MOST_LAMPS) {
        let lamp = dice.lamp(index);
        scene.lights.push(lamp);
    }
    scene.name = format!("random {seed}");
    scene
}

/// Half the scenes by each estimator; one thread for each bake. Glass boxes have branches without end.
fn settings(seed: u64) -> BakeSettings {
    let estimator = if (seed / LAWS.len() as u64).is_multiple_of(2) {
        Estimator::Wavefront
    } else {
        Estimator::Splat
    };
    BakeSettings {
        estimator,
        sigma: estimator.default_sigma(),
        max_depth: 4,
        branch_threshold: Some(1e-2),
        threads: 1,
        ..at(1e3, 32)
    }
}

/// What is done to a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    Power,
    Order,
    Threads,
    Sum,
    Moved,
    Turned,
    Mirrored,
    Scaled,
}

const LAWS: [Law; 8] = [
    Law::Power,
    Law::Order,
    Law::Threads,
    Law::Sum,
    Law::Moved,
    Law::Turned,
    Law::Mirrored,
    Law::Scaled,
];

impl Law {
    /// What is baked beside the scene itself.
    fn variants(self, scene: &Scene, settings: &BakeSettings) -> Vec<(Scene, BakeSettings)> {
        let one = |changed: Scene| vec![(changed, settings.clone())];
        let place = |rotation, scale, offset| one(transformed(scene.clone(), rotation, scale, offset));
        match self {
            Self::Power => one(brighter(scene.clone(), 4.0, true)),
            Self::Order => {
                let mut reversed = scene.clone();
                reversed.objects.reverse();
                one(reversed)
            }
            Self::Threads => vec![(
                scene.clone(),
                BakeSettings {
                    threads: 3,
                    ..settings.clone()
                },
            )],
            Self::Sum => {
                let parts = scene.lights.iter().map(|light| {
                    let lights = vec![light.clone()];
                    (
                        Scene {
                            lights,
                            ..scene.clone()
                        },
                        settings.clone(),
                    )
                });
                parts.collect()
            }
            Self::Moved => place(DMat3::IDENTITY, 1.0, DVec3::new(64.0, -32.0, 16.0)),
            Self::Turned => {
                let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
                place(turn, 1.0, DVec3::new(3.1, -7.3, 0.9))
            }
            Self::Mirrored => place(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)), 1.0, DVec3::ZERO),
            Self::Scaled => one(brighter(
                transformed(scene.clone(), DMat3::IDENTITY, 8.0, DVec3::ZERO),
                64.0,
                false,
            )),
        }
    }

    /// Notes how far the maps of the variants are from what they must be, or returns it of a law that holds in the
    /// mean.
    fn judge(self, bench: &mut Bench, plain: &BakeResult, variants: &mut [BakeResult]) -> Option<f64> {
        match self {
            Self::Power => {
                let off = maps_apart(&variants[0].maps, &plain.maps, 4.0);
                bench.law("four times the power, four times the map", off, 0.0);
            }
            Self::Order => {
                // The sides of an object stay in their order.
                variants[0]
                    .maps
                    .sort_by_key(|map| (Reverse(map.chart.object()), map.chart.receiver));
                bench.must(
                    "objects in reverse: the same bits",
                    same_bits(plain, &variants[0]),
                );
            }
            Self::Threads => {
                bench.must(
                    "three threads for one: the same bits",
                    same_bits(plain, &variants[0]),
                );
            }
            Self::Sum => {
                let sums: Vec<_> = plain.maps.iter().map(|map| map_sum(map, variants)).collect();
                // One rounding for each light alone, one for each sum of two, one for the light of all together.
                let off = roundings_apart(&plain.maps, &sums);
                let most = 2.0 * f64::from(MOST_LAMPS);
                bench.law("lights together give the sum of their maps, roundings", off, most);
            }
            Self::Moved | Self::Turned | Self::Mirrored | Self::Scaled => {
                return Some(over_estimates(&variants[0], plain));
            }
        }
        None
    }

    /// Of a law about places, what was done to the scene.
    fn motion(self) -> &'static str {
        match self {
            Self::Moved => "moved",
            Self::Turned => "turned",
            Self::Mirrored => "mirrored",
            Self::Scaled => "eight times the size",
            Self::Power | Self::Order | Self::Threads | Self::Sum => "as it was",
        }
    }
}

/// Notes what maps of scenes elsewhere were off by, over both estimated errors. Two errors that know nothing of each
/// other are 0.7 of their sum apart; an estimate may be half of the error in 2 of 50 scenes, here as in the tests of
/// estimates.
fn judge_motions(bench: &mut Bench, motions: &[(Law, f64)]) {
    for law in LAWS {
        let of_law: Vec<f64> = motions
            .iter()
            .filter(|(of, _)| *of == law)
            .map(|(_, off)| *off)
            .collect();
        if of_law.is_empty() {
            continue;
        }
        let count = of_law.len() as f64;
        let what = law.motion();
        bench.law(
            &format!("{what}: map as before, over both estimated errors, mean"),
            of_law.iter().sum::<f64>() / count,
            1.0,
        );
        bench.law(
            &format!("{what}: more than twice both errors off, share of scenes"),
            of_law.iter().filter(|off| **off > 2.0).count() as f64 / count,
            0.04,
        );
    }
}

/// Largest difference of two texels over what single precision may round off, 2⁻²⁴ of the value.
fn roundings_apart(maps: &[IlluminationMap], others: &[IlluminationMap]) -> f64 {
    let values = |maps: &[IlluminationMap]| -> Vec<f64> {
        let layers = maps.iter().filter_map(|map| map.layer(LayerKind::Caustic));
        let texels = layers.flat_map(|layer| layer.irradiance.iter().flatten());
        texels.map(|e| f64::from(*e)).collect()
    };
    let (a, b) = (values(maps), values(others));
    if a.len() != b.len() {
        return f64::INFINITY;
    }
    let pairs = a.into_iter().zip(b).filter(|(a, b)| a != b);
    pairs
        .map(|(a, b)| (a - b).abs() / (a.abs() * (-24_f64).exp2()).max(f64::from(f32::MIN_POSITIVE)))
        .fold(0.0, f64::max)
}

/// Difference of the maps of two bakes over the sum of what they think of their errors, root mean squares over all
/// surfaces with texture coordinates of their own: generated ones lie elsewhere for another scene. 0 where there is no
/// difference.
fn over_estimates(a: &BakeResult, b: &BakeResult) -> f64 {
    let (mut difference, mut errors) = (0.0, [0.0; 2]);
    let receivers: BTreeSet<Receiver> = [a, b]
        .into_iter()
        .flat_map(|bake| &bake.maps)
        .filter(|map| map.chart.uv_set != UvSet::Generated)
        .map(|map| map.chart.receiver)
        .collect();
    for receiver in receivers {
        let maps = [a, b].map(|bake| bake.maps.iter().find(|map| map.chart.receiver == receiver));
        let values = maps.map(|map| luminance(map, LayerKind::Caustic));
        let Some(chart) = maps.into_iter().flatten().map(|map| &map.chart).next() else {
            continue;
        };
        for texel in 0..chart.texel_count() {
            let [a, b] = [0, 1].map(|bake| values[bake].get(texel).copied().unwrap_or(0.0));
            difference += (a - b) * (a - b) * chart.texel_area_m2(texel);
        }
        for (error, map) in errors.iter_mut().zip(maps) {
            *error += map.map_or(0.0, squared_error);
        }
    }
    if difference == 0.0 {
        0.0
    } else {
        difference.sqrt() / (errors[0].sqrt() + errors[1].sqrt())
    }
}

/// What a map thinks of its error, squared and integrated over its surface [W²/m²].
fn squared_error(map: &IlluminationMap) -> f64 {
    let area_m2 = map.chart.area_m2();
    let mean = map.flux_w(LayerKind::Caustic).luminance() / area_m2;
    (map.estimated_relative_rmse.unwrap_or(0.0) * mean).powi(2) * area_m2
}

/// Lamps a number of times as strong; suns too, if asked.
fn brighter(mut scene: Scene, factor: f64, suns_too: bool) -> Scene {
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => intensity.0 *= factor,
            LightKind::Sun {
                normal_irradiance, ..
            } if suns_too => normal_irradiance.0 *= factor,
            _ => {}
        }
    }
    scene
}

/// Every scene is baked with its books open, and held to one law of symmetry or proportion.
fn keep_laws(bench: &mut Bench) -> Result<()> {
    let count = count(bench.effort);
    let mut motions = Vec::new();
    for first in (0..count).step_by(BATCH as usize) {
        let mut jobs = Vec::new();
        let mut spans = Vec::new();
        for seed in first..count.min(first + BATCH) {
            let law = LAWS[(seed % LAWS.len() as u64) as usize];
            let (scene, settings) = (scene(seed), settings(seed));
            let variants = law.variants(&scene, &settings);
            spans.push((law, variants.len()));
            jobs.push((scene, settings));
            jobs.extend(variants);
        }
        let mut results = bench.bake_each(&jobs)?.into_iter();
        for (law, variants) in spans {
            let plain = results.next().expect("one result for each job");
            let mut variants: Vec<BakeResult> = results.by_ref().take(variants).collect();
            let off = law.judge(bench, &plain, &mut variants);
            motions.extend(off.map(|off| (law, off)));
        }
    }
    judge_motions(bench, &motions);
    Ok(())
}
