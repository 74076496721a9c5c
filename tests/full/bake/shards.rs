//! Shards of a bake add up to the bake, to the last bit of maps, errors and ledgers.

use glam::DVec3;
use nephroid::error::Result;
use nephroid::light_pass::share::Share;
use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::session::{BakeResult, ShardSource, ShardSums};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution, Sigma, Wavelengths};

use crate::bake::common::{assert_same, session, with_layers};
use support::hard_scenes::under_square_lamp;
use support::tools::{at, bake, builtin_scene, photons, set, settings};

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

#[track_caller]
fn assert_adds_up(scene: &Scene, settings: &BakeSettings, counts: &[u32]) {
    let whole = bake(scene.clone(), settings);
    assert!(whole.counts.rays > 0 && !whole.maps.is_empty());
    for &count in counts {
        let merged = merge(scene, settings, shards(scene, settings, count));
        let merged = merged.expect("they belong together");
        assert_same(&merged, &whole, &format!("{count} shards"));
        assert_eq!(merged.warnings, whole.warnings, "{count} shards");
        // Layers of lights and bands, as text: numbers with all their digits.
        let parts = |result: &BakeResult| format!("{:?} {:?}", result.light_layers, result.band_layers);
        assert!(
            parts(&merged) == parts(&whole),
            "{count} shards: layers of lights or bands"
        );
    }
}

#[test]
fn patches_add_up() {
    let per_light = set(with_layers(&LayerKind::ALL, at(3000.0, 24)), |s| {
        s.per_light = true
    });
    let mut scene = builtin_scene("mirror");
    let mut other = scene.lights[0].clone();
    other.colour = LinearSrgb::new(0.2, 1.0, 3.0);
    other.kind = other.kind.moved(DVec3::new(0.1, 0.2, 0.05));
    scene.lights.push(other);
    assert_adds_up(&scene, &per_light, &[3]);
    assert_adds_up(&builtin_scene("ball"), &at(5000.0, 24), &[1, 5]);
}

#[test]
fn splats_add_up() {
    assert_adds_up(&builtin_scene("ball"), &settings(15_000.0, 32), &[4]);
    let adaptive = set(settings(10_000.0, 32), |s| s.sigma = Sigma::Adaptive);
    assert_adds_up(&builtin_scene("ring"), &adaptive, &[2]);
}

/// Rays of the first bands are kept, the others are traced again.
#[test]
fn too_little_memory_to_keep_rays_adds_up() {
    for (settings, memory_bytes) in [(at(20_000.0, 16), 4 << 20), (settings(20_000.0, 16), 1 << 20)] {
        let scarce = set(settings, |s| s.memory_bytes = memory_bytes);
        assert_adds_up(&builtin_scene("ball"), &scarce, &[3]);
    }
}

#[test]
fn wavelengths_add_up() {
    let bands = BakeSettings {
        wavelengths: Wavelengths::Fixed(3),
        keep_spectrum: true,
        ..at(1e6, 32)
    };
    for settings in [at(1e6, 32), bands, settings(1e6, 32)] {
        assert_adds_up(&builtin_scene("prism"), &settings, &[3]);
    }
}

#[test]
fn soft_light_adds_up() {
    assert_adds_up(&under_square_lamp("ball", 0.1), &photons(1e6, 24), &[3]);
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
    let all = shards(&scene, &settings, 3);
    let damaged = |change: fn(&mut Vec<Vec<u8>>)| {
        let mut shards = all.clone();
        change(&mut shards[1].passes);
        shards
    };
    let cases = [
        (all[..2].to_vec(), "in no shard, or in two"),
        ([&all[..], &all[..1]].concat(), "in no shard, or in two"),
        (damaged(|passes| passes.truncate(1)), "does not hold the passes"),
        (
            damaged(|passes| passes.push(Vec::new())),
            "does not hold the passes",
        ),
        (damaged(|passes| passes.reverse()), ""),
        (damaged(|passes| passes[0].truncate(30)), "damaged"),
        (damaged(|passes| passes[0].clear()), "damaged"),
        (
            damaged(|passes| {
                let half = passes[1].len() / 2;
                passes[1][half] ^= 1;
            }),
            "damaged",
        ),
    ];
    for (shards, word) in cases {
        let error = merge(&scene, &settings, shards).expect_err(word);
        assert!(error.what.contains(word), "{error}");
    }
    let other = merge(&scene, &at(2000.0, 17), all).expect_err("maps of another size");
    assert!(other.what.contains("damaged"), "{other}");
}
