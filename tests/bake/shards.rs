//! Shards of a bake add up to the bake, to the last bit: maps, errors, ledgers, and what is counted.

use std::sync::Arc;

use glam::DVec3;
use nephroid::error::Result;
use nephroid::light_pass::share::Share;
use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::{LightKind, PanelShape, Scene};
use nephroid::session::{BakeResult, BakeSession, EffectReport, ShardSource, ShardSums};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution, Sigma, Wavelengths};
use nephroid::units::Radiance;

use crate::tools::{at, bake, builtin_scene, settings};

/// Shards in memory.
struct Shards(Vec<ShardSums>);

impl ShardSource for Shards {
    fn shard_count(&self) -> usize {
        self.0.len()
    }

    fn pass_count(&self, shard: usize) -> usize {
        self.0[shard].passes.len()
    }

    fn pass(&self, shard: usize, pass: usize) -> Result<Vec<u8>> {
        Ok(self.0[shard].passes[pass].clone())
    }

    fn name(&self, shard: usize) -> String {
        format!("shard {}", shard + 1)
    }
}

fn session(scene: &Scene) -> BakeSession {
    BakeSession::new(Arc::new(scene.clone())).expect("a session")
}

/// All shards, one after the other: none knows what the one before it did.
fn shards(scene: &Scene, settings: &BakeSettings, count: u32) -> Vec<ShardSums> {
    let mut session = session(scene);
    let shard = |number| {
        let share = Share::new(number, count).expect("a share");
        let shard = session.bake_shard(settings, share, &(), &Control::default());
        shard.expect("a shard")
    };
    (1..=count).map(shard).collect()
}

fn merge(scene: &Scene, settings: &BakeSettings, shards: Vec<ShardSums>) -> Result<BakeResult> {
    session(scene).merge(settings, Box::new(Shards(shards)), &(), &Control::default())
}

/// All of a bake but times and memory held, as text: numbers with all their digits.
fn written(result: &BakeResult) -> Vec<String> {
    let mut lines = vec![
        format!("{:?}", result.counts),
        format!("{:?}", result.ledgers),
        format!("{:?} {:?}", result.estimated_relative_rmse, result.stop_reason),
        format!("{:?}", result.warnings),
    ];
    let course = result.course.iter();
    lines.extend(course.map(|point| format!("{} {:?} {}", point.rays, point.relative_rmse, point.is_coarse)));
    let of_effect = |report: &EffectReport| {
        format!(
            "{:?} {} rays {} deposits",
            report.line, report.counts.rays, report.counts.deposits
        )
    };
    lines.extend(result.effects.iter().map(of_effect));
    for map in &result.maps {
        let receiver = map.chart.receiver;
        let layers = map.layers.iter();
        lines.extend(layers.map(|layer| format!("{receiver:?} {layer:?}")));
        lines.push(format!("{receiver:?} {:?}", map.error));
    }
    lines.extend(result.light_layers.iter().map(|layer| format!("{layer:?}")));
    lines.extend(
        result
            .band_layers
            .iter()
            .map(|layer| format!("{:?}", layer.irradiance)),
    );
    lines
}

#[track_caller]
fn assert_adds_up(scene: &Scene, settings: &BakeSettings, counts: &[u32]) {
    let whole = bake(scene.clone(), settings);
    assert!(whole.counts.rays > 0 && !whole.maps.is_empty());
    for &count in counts {
        let shards = shards(scene, settings, count);
        let merged = merge(scene, settings, shards).expect("they belong together");
        let (whole, merged) = (written(&whole), written(&merged));
        assert_eq!(whole.len(), merged.len(), "{count} shards");
        for (whole, merged) in whole.iter().zip(&merged) {
            let differs = whole.bytes().zip(merged.bytes()).position(|(a, b)| a != b);
            let from = differs.unwrap_or(0).saturating_sub(60);
            let show = |text: &str| text.chars().skip(from).take(160).collect::<String>();
            assert!(
                whole == merged,
                "{count} shards: {} is {}",
                show(whole),
                show(merged)
            );
        }
    }
}

#[test]
fn patches_add_up_with_every_layer_and_light() {
    let settings = BakeSettings {
        layers: LayerKind::ALL.to_vec(),
        per_light: true,
        ..at(3000.0, 24)
    };
    let mut scene = builtin_scene("mirror");
    let mut other = scene.lights[0].clone();
    other.colour = LinearSrgb::new(0.2, 1.0, 3.0);
    other.kind = other.kind.moved(DVec3::new(0.1, 0.2, 0.05));
    scene.lights.push(other);
    assert_adds_up(&scene, &settings, &[3]);
    assert_adds_up(&builtin_scene("ball"), &at(5000.0, 24), &[1, 5]);
}

#[test]
fn splats_add_up() {
    let scene = builtin_scene("ball");
    assert_adds_up(&scene, &settings(15_000.0, 32), &[4]);
    let adaptive = BakeSettings {
        sigma: Sigma::Adaptive,
        ..settings(10_000.0, 32)
    };
    assert_adds_up(&builtin_scene("ring"), &adaptive, &[2]);
}

#[test]
fn what_a_bake_has_no_memory_to_keep_is_counted_as_it_counts() {
    // Rays of the first bands are kept, the others are traced again.
    let patches = BakeSettings {
        memory_bytes: 4 << 20,
        ..at(20_000.0, 16)
    };
    let roomy = BakeSettings {
        memory_bytes: 1 << 30,
        ..patches.clone()
    };
    let scene = builtin_scene("ball");
    assert!(bake(scene.clone(), &patches).counts.rays > bake(scene.clone(), &roomy).counts.rays);
    assert_adds_up(&scene, &patches, &[3]);
    let splats = BakeSettings {
        memory_bytes: 1 << 20,
        ..settings(20_000.0, 16)
    };
    assert_adds_up(&scene, &splats, &[3]);
}

#[test]
fn wavelengths_add_up() {
    let scene = builtin_scene("prism");
    let thin = |settings: BakeSettings| BakeSettings {
        density_per_sr: 1e6,
        ..settings
    };
    assert_adds_up(&scene, &thin(at(1.0, 32)), &[3]);
    let bands = BakeSettings {
        wavelengths: Wavelengths::Fixed(3),
        keep_spectrum: true,
        ..thin(at(1.0, 32))
    };
    assert_adds_up(&scene, &bands, &[3]);
    assert_adds_up(&scene, &thin(settings(1.0, 32)), &[3]);
}

#[test]
fn soft_light_adds_up() {
    let mut scene = builtin_scene("ball");
    let centre = scene.lights[0].kind.position().expect("a point light");
    scene.lights[0].kind = LightKind::Panel {
        centre,
        across: DVec3::X * 0.05,
        down: DVec3::Z * 0.05,
        shape: PanelShape::Rectangle,
        radiance: Radiance(800.0),
    };
    for settings in [at(1500.0, 24), settings(3000.0, 24)] {
        let settings = BakeSettings {
            wavefronts: Some(8),
            ..settings
        };
        assert_adds_up(&scene, &settings, &[3]);
    }
}

#[test]
fn what_the_light_decides_is_refused() {
    let scene = builtin_scene("ring");
    type Change = fn(&mut BakeSettings);
    let cases: [(&str, Change); 5] = [
        ("--max-error", |settings| settings.max_error = Some(0.02)),
        ("--max-time", |settings| settings.max_time_s = Some(1.0)),
        ("--map-resolution", |settings| {
            settings.map_resolution = MapResolution::Auto
        }),
        ("--layers", |settings| settings.layers = vec![LayerKind::Direct]),
        ("--memory", |settings| settings.memory_bytes = 1 << 20),
    ];
    for (option, change) in cases {
        let mut settings = at(1000.0, 512);
        change(&mut settings);
        let share = Share::new(1, 2).expect("a share");
        let refused = session(&scene).bake_shard(&settings, share, &(), &Control::default());
        assert_eq!(refused.expect_err(option).location, option);
        let refused = merge(&scene, &settings, Vec::new()).expect_err(option);
        assert_eq!(refused.location, option);
    }
}

#[test]
fn what_is_not_all_of_a_bake_is_refused() {
    let (scene, settings) = (builtin_scene("ring"), at(2000.0, 16));
    let shards = shards(&scene, &settings, 3);
    let refuse = |shards: Vec<ShardSums>, word: &str| {
        let error = merge(&scene, &settings, shards).expect_err(word);
        assert!(error.what.contains(word), "{error}");
    };
    refuse(shards[..2].to_vec(), "in no shard, or in two");
    refuse([&shards[..], &shards[..1]].concat(), "in no shard, or in two");
    let with = |change: &dyn Fn(&mut Vec<Vec<u8>>)| {
        let mut shards = shards.clone();
        change(&mut shards[1].passes);
        shards
    };
    refuse(with(&|passes| passes.truncate(1)), "does not hold the passes");
    refuse(
        with(&|passes| passes.push(Vec::new())),
        "does not hold the passes",
    );
    refuse(with(&|passes| passes.reverse()), "");
    refuse(with(&|passes| passes[0].truncate(30)), "damaged");
    refuse(with(&|passes| passes[0].clear()), "damaged");
    let half = passes_middle(&shards[1]);
    refuse(with(&|passes| passes[1][half] ^= 1), "damaged");
    let other = session(&scene)
        .merge(
            &at(2000.0, 17),
            Box::new(Shards(shards)),
            &(),
            &Control::default(),
        )
        .expect_err("maps of another size");
    assert!(other.what.contains("damaged"), "{other}");
}

fn passes_middle(shard: &ShardSums) -> usize {
    shard.passes[1].len() / 2
}
