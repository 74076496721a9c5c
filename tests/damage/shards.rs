//! Shards, as `merge` reads them: their two files, and the sums behind the checksums.

use std::io::Read;
use std::path::PathBuf;
use std::sync::Arc;

use nephroid::error::Result;
use nephroid::export::shards::{SceneOrigin, ShardFolder, ShardManifest, ShardSet};
use nephroid::light_pass::share::Share;
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::session::{BakeResult, BakeSession, ShardSource, ShardSums};
use nephroid::settings::BakeSettings;

use crate::mutate::{Damage, effort};
use crate::tools::{at, builtin_scene};
use crate::watch::Tally;

/// Memory that merging so small a bake may take [bytes].
const MOST_BYTES: usize = 32 << 20;

const COUNT: u32 = 2;

fn session(scene: &Arc<Scene>) -> BakeSession {
    BakeSession::new(scene.clone()).expect("a session")
}

fn shard(scene: &Arc<Scene>, settings: &BakeSettings, share: Share) -> ShardSums {
    let sums = session(scene).bake_shard(settings, share, &(), &Control::default());
    sums.expect("a shard")
}

fn shares() -> impl Iterator<Item = Share> {
    (1..=COUNT).filter_map(|number| Share::new(number, COUNT))
}

fn merge(scene: &Arc<Scene>, settings: &BakeSettings, shards: Box<dyn ShardSource>) -> Result<BakeResult> {
    session(scene).merge(settings, shards, &(), &Control::default())
}

/// Whether all that a bake gives are numbers.
fn is_sound(result: &BakeResult) -> bool {
    let layers = result.maps.iter().flat_map(|map| &map.layers);
    let mut values = layers.flat_map(|layer| layer.irradiance.as_flattened());
    let errors = result.maps.iter().filter_map(|map| map.error.as_ref()).flatten();
    values.all(|value| value.is_finite()) && errors.into_iter().all(|value| value.is_finite())
}

#[test]
fn folders_of_shards() {
    let _alone = crate::watch::alone();
    let (scene, settings) = (Arc::new(builtin_scene("mirror")), at(1000.0, 16));
    let around = tempfile::tempdir().expect("temporary folder");
    let folder_of = |share: Share| around.path().join(share.number().to_string());
    for share in shares() {
        let folder = ShardFolder::open(&folder_of(share), share, false).expect("writable");
        let sums = shard(&scene, &settings, share);
        let origin = SceneOrigin {
            source: scene.source.clone(),
            default_light: false,
            solid_glass: false,
            environment: None,
        };
        let manifest = ShardManifest::new(&scene, origin, &settings, share, &sums);
        folder.write(&manifest, &sums).expect("writable");
    }
    let folders: Vec<PathBuf> = shares().map(folder_of).collect();
    let read = || {
        let shards = ShardSet::open(&folders)?;
        shards.check_scene(&scene)?;
        let settings = shards.manifest()?.settings.clone();
        merge(&scene, &settings, Box::new(shards))
    };
    assert!(is_sound(&read().expect("nothing is damaged yet")));
    let tally = Tally::default();
    for number in 0..60 * effort() {
        let mut damage = Damage::to("shards", number);
        let file = ["shard.json", "sums.bin"][damage.below(2)];
        let place = folders[damage.below(folders.len())].join(file);
        let whole = std::fs::read(&place).expect("written");
        let mut bytes = whole.clone();
        match serde_json::from_slice::<serde_json::Value>(&whole) {
            Ok(mut manifest) if damage.below(4) > 0 => {
                damage.json(&mut manifest);
                bytes = manifest.to_string().into_bytes();
            }
            _ if damage.below(3) == 0 => {
                // Where the lengths are.
                let end = bytes.len().min(120);
                let mut head = bytes[..end].to_vec();
                damage.bytes(&mut head);
                bytes.splice(..end, head);
            }
            _ => damage.bytes(&mut bytes),
        }
        std::fs::write(&place, &bytes).expect("can be written");
        if let Some(result) = tally.watch((&format!("{number}-{file}"), &bytes), MOST_BYTES, read) {
            assert!(is_sound(&result), "{number}");
        }
        std::fs::write(&place, whole).expect("can be written");
    }
    println!("folders of shards: {tally:?}");
    assert!(tally.taken.get() > 0 && tally.refused.get() > 20, "{tally:?}");
}

/// Shards in memory.
struct Sums(Vec<ShardSums>);

impl ShardSource for Sums {
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

#[test]
fn sums_behind_a_checksum_that_is_right() {
    let _alone = crate::watch::alone();
    let (scene, settings) = (Arc::new(builtin_scene("mirror")), at(1000.0, 16));
    let whole: Vec<ShardSums> = shares().map(|share| shard(&scene, &settings, share)).collect();
    let tally = Tally::default();
    for number in 0..60 * effort() {
        let mut damage = Damage::to("sums", number);
        let mut shards = whole.clone();
        let passes = &mut shards[damage.below(COUNT as usize)].passes;
        let hit = damage.below(passes.len());
        let mut bytes = Vec::new();
        let mut decoder = zstd::stream::Decoder::new(&passes[hit][..]).expect("a frame");
        decoder.read_to_end(&mut bytes).expect("whole");
        if damage.below(2) == 0 {
            // Counts and accounts come first, and are short.
            let end = bytes.len().min(80);
            let mut head = bytes[..end].to_vec();
            damage.bytes(&mut head);
            bytes.splice(..end, head);
        } else {
            damage.bytes(&mut bytes);
        }
        let mut encoder = zstd::stream::Encoder::new(Vec::new(), 1).expect("it can begin");
        encoder.include_checksum(true).expect("a checksum");
        std::io::Write::write_all(&mut encoder, &bytes).expect("in memory");
        passes[hit] = encoder.finish().expect("in memory");
        let work = || merge(&scene, &settings, Box::new(Sums(shards)));
        if let Some(result) = tally.watch((&format!("{number}-sums"), &bytes), MOST_BYTES, work) {
            assert!(is_sound(&result), "{number}");
        }
    }
    println!("sums: {tally:?}");
    assert!(tally.taken.get() > 3 && tally.refused.get() > 10, "{tally:?}");
}

#[test]
fn a_small_file_that_unpacks_to_a_large_one_takes_no_memory() {
    let _alone = crate::watch::alone();
    let (scene, settings) = (Arc::new(builtin_scene("mirror")), at(1000.0, 16));
    let mut shards: Vec<ShardSums> = shares().map(|share| shard(&scene, &settings, share)).collect();
    for byte in [0, 0x01, 0x7f] {
        let mut encoder = zstd::stream::Encoder::new(Vec::new(), 1).expect("it can begin");
        std::io::copy(&mut std::io::repeat(byte).take(1 << 28), &mut encoder).expect("in memory");
        shards[0].passes[0] = encoder.finish().expect("in memory");
        let bomb = shards[0].passes[0].clone();
        let settings = BakeSettings {
            memory_bytes: 8 << 20,
            ..settings.clone()
        };
        let tally = Tally::default();
        let work = || merge(&scene, &settings, Box::new(Sums(shards.clone())));
        tally.watch((&format!("{byte}-bomb"), &bomb), MOST_BYTES, work);
        assert_eq!(tally.refused.get(), 1, "{byte}");
    }
}
