//! Folders of maps, as `--maps` and `compare` read them, and of shards, as `merge` does.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nephroid::error::Result;
use nephroid::export::map_folder::MapFolder;
use nephroid::export::map_reader;
use nephroid::export::shards::{SceneOrigin, ShardFolder, ShardManifest, ShardSet};
use nephroid::illumination::IlluminationMap;
use nephroid::light_pass::share::Share;
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::session::{BakeResult, BakeSession, ShardSums};
use nephroid::settings::{BakeSettings, LayerKind};

use super::mutate::Damage;
use super::watch::{Tally, Way, alone, attack};
use support::tools::{at, bake, builtin_scene, set};

/// Memory that reading or merging so little may take [bytes].
const MOST_BYTES: usize = 32 << 20;

/// Damages one file of a folder after the other, so often each, and reads the folder.
fn attack_files<T>(
    (name, files): (&str, &[PathBuf]),
    times: impl Fn(&Path) -> usize,
    tally: &Tally,
    read: impl Fn() -> Result<T>,
    fault: impl Fn(T) -> Option<String>,
) {
    assert_eq!(read().map(&fault), Ok(None), "nothing is damaged yet");
    for file in files {
        let whole = std::fs::read(file).expect("it was written");
        let is_json = file.extension().is_some_and(|kind| kind == "json");
        let damage = if is_json {
            Damage::document
        } else {
            Damage::head as Way
        };
        let name = format!("{name}-{}", file.file_name().expect("a name").display());
        let read = |bytes: &[u8]| {
            std::fs::write(file, bytes).expect("can be written");
            read()
        };
        let subjects = [(name.as_str(), whole.clone(), damage)];
        attack(tally, (times(file), MOST_BYTES), &subjects, read, &fault);
        std::fs::write(file, whole).expect("can be written");
    }
}

/// Where a map that was read is none.
fn map_fault(map: &IlluminationMap, scene: &Scene) -> Option<String> {
    let texels = map.chart.texel_count();
    let is_light = |value: &f32| value.is_finite() && *value >= 0.0;
    let is_whole = |values: &[[f32; 3]]| values.len() == texels && values.as_flattened().iter().all(is_light);
    let layers = map.layers.iter().all(|layer| is_whole(&layer.irradiance));
    let is_error = |error: &Vec<f32>| error.len() == texels && error.iter().all(is_light);
    let errors = map.error.as_ref().is_none_or(is_error);
    let estimate = map.estimated_relative_rmse;
    let estimate = estimate.is_none_or(|error| error.is_finite() && error >= 0.0);
    let object = map.chart.object() < scene.objects.len();
    (!(layers && errors && estimate && object))
        .then(|| format!("layers {layers}, errors {errors}, estimate {estimate}, object {object}"))
}

#[test]
fn maps() {
    alone(|| {
        let tally = Tally::default();
        for name in ["mirror", "showroom"] {
            let scene = builtin_scene(name);
            let folder = tempfile::tempdir().expect("temporary folder");
            let layers = vec![LayerKind::Caustic, LayerKind::Direct];
            let settings = set(at(500.0, 16), |s| s.layers = layers);
            let result = bake(scene.clone(), &settings);
            let written = MapFolder::open(folder.path(), false).expect("writable");
            written.write(&scene, &settings, &result).expect("writable");
            let maps = std::fs::read_dir(folder.path().join("maps")).expect("it was made");
            let mut files: Vec<PathBuf> = maps.map(|entry| entry.expect("listed").path()).collect();
            files.sort();
            files.push(folder.path().join("manifest.json"));
            let count = files.len();
            // The manifest leads to everything else.
            let times = |file: &Path| {
                if file.ends_with("manifest.json") {
                    20
                } else {
                    20_usize.div_ceil(count)
                }
            };
            let read = || map_reader::read(folder.path(), &scene).map(|(maps, _)| maps);
            assert!(read().is_ok_and(|maps| !maps.is_empty()));
            attack_files((name, &files), times, &tally, read, |maps| {
                maps.iter().find_map(|map| map_fault(map, &scene))
            });
        }
        tally.expect(3, 3);
    });
}

/// The first value of a bake that is no number, if there is one.
fn result_fault(result: &BakeResult) -> Option<String> {
    let layers = result.maps.iter().flat_map(|map| &map.layers);
    let values = layers.flat_map(|layer| layer.irradiance.as_flattened());
    let errors = result.maps.iter().filter_map(|map| map.error.as_ref()).flatten();
    let fault = values.chain(errors).find(|value| !value.is_finite());
    fault.map(|value| format!("{value} in a map"))
}

/// A bake in two shards, each in its folder.
struct Shards {
    scene: Arc<Scene>,
    settings: BakeSettings,
    around: tempfile::TempDir,
    sums: Vec<(Share, ShardSums)>,
}

impl Shards {
    fn bake() -> Self {
        let (scene, settings) = (Arc::new(builtin_scene("mirror")), at(1000.0, 16));
        let shard = |number| {
            let share = Share::new(number, 2).expect("one of two");
            let mut session = BakeSession::new(scene.clone()).expect("a session");
            let sums = session.bake_shard(&settings, share, &(), &Control::default());
            (share, sums.expect("a shard"))
        };
        let sums = [1, 2].map(shard).into();
        let around = tempfile::tempdir().expect("temporary folder");
        let shards = Self {
            scene,
            settings,
            around,
            sums,
        };
        shards
            .sums
            .iter()
            .for_each(|(share, sums)| shards.write(*share, sums));
        shards
    }

    fn folder(&self, share: Share) -> PathBuf {
        self.around.path().join(share.number().to_string())
    }

    /// With checksums that are right, whatever the sums are.
    fn write(&self, share: Share, sums: &ShardSums) {
        let origin = SceneOrigin {
            source: self.scene.source.clone(),
            default_light: false,
            solid_glass: false,
            environment: None,
        };
        let manifest = ShardManifest::new(&self.scene, origin, &self.settings, share, sums);
        let folder = ShardFolder::open(&self.folder(share), share, false).expect("writable");
        folder.write(&manifest, sums).expect("writable");
    }

    fn read(&self, memory_bytes: u64) -> Result<BakeResult> {
        let folders: Vec<PathBuf> = self.sums.iter().map(|(share, _)| self.folder(*share)).collect();
        let shards = ShardSet::open(&folders)?;
        shards.check_scene(&self.scene)?;
        let settings = shards.manifest().settings.clone();
        let settings = set(settings, |s| s.memory_bytes = memory_bytes);
        let mut session = BakeSession::new(self.scene.clone())?;
        session.merge(&settings, Box::new(shards), &(), &Control::default())
    }

    /// The same after a pass of the first shard was replaced by what a reader gives.
    fn read_with(&self, pass: usize, bytes: impl Read, memory_bytes: u64) -> Result<BakeResult> {
        let (share, mut sums) = self.sums[0].clone();
        let mut encoder = zstd::stream::Encoder::new(Vec::new(), 1).expect("it can begin");
        encoder.include_checksum(true).expect("a checksum");
        std::io::copy(&mut { bytes }, &mut encoder).expect("in memory");
        sums.passes[pass] = encoder.finish().expect("in memory");
        self.write(share, &sums);
        self.read(memory_bytes)
    }
}

#[test]
fn shards_of_a_bake() {
    alone(|| {
        let shards = Shards::bake();
        let files = ["shard.json", "sums.bin"].map(|file| shards.folder(shards.sums[0].0).join(file));
        let (tally, read) = (Tally::default(), || shards.read(1 << 30));
        attack_files(
            ("shards", &files),
            |_| 30,
            &tally,
            read,
            |result| result_fault(&result),
        );
        tally.expect(0, 20);
    });
}

#[test]
fn sums_behind_right_checksums() {
    alone(|| {
        let shards = Shards::bake();
        let tally = Tally::default();
        let passes = &shards.sums[0].1.passes;
        for (pass, packed) in passes.iter().enumerate() {
            let unpacked = zstd::stream::decode_all(&packed[..]).expect("whole");
            let sums = [("sums", unpacked, Damage::head as Way)];
            let bounds = (60_usize.div_ceil(passes.len()), MOST_BYTES);
            let read = |bytes: &[u8]| shards.read_with(pass, bytes, 1 << 30);
            attack(&tally, bounds, &sums, read, |result| result_fault(&result));
        }
        tally.expect(3, 10);
    });
}

#[test]
fn small_file_that_unpacks_to_a_large_one() {
    alone(|| {
        let shards = Shards::bake();
        let tally = Tally::default();
        for byte in [0, 0x01, 0x7f] {
            let read = || shards.read_with(0, std::io::repeat(byte).take(1 << 28), 8 << 20);
            tally.watch((&format!("{byte}-bomb"), &[]), MOST_BYTES, read);
        }
        assert_eq!(tally.refused.get(), 3, "{tally:?}");
    });
}
