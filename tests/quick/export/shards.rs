//! Folders of shards: taken up only where they are whole, of one bake and all there.

use std::path::PathBuf;

use nephroid::error::Result;
use nephroid::export::shards::{SceneOrigin, ShardFolder, ShardManifest, ShardSet};
use nephroid::light_pass::share::Share;
use nephroid::session::{BakeSession, ShardSource as _};

use crate::prelude::*;
use support::program::read_json;
use support::tools::at;

struct Shards(tempfile::TempDir);

impl Shards {
    fn new() -> Self {
        Self(folder())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Bakes shard `number` of `count` to a folder of that name.
    fn bake(&self, name: &str, scene: &Scene, settings: &BakeSettings, (number, count): (u32, u32)) {
        let share = Share::new(number, count).expect("a share");
        let folder = ShardFolder::open(&self.path(name), share, false).expect("writable");
        let mut session = BakeSession::new(Arc::new(scene.clone())).expect("a session");
        let sums = session.bake_shard(settings, share, &(), &Control::default());
        let sums = sums.expect("a shard");
        let origin = SceneOrigin {
            source: scene.source.clone(),
            default_light: false,
            solid_glass: false,
            environment: None,
        };
        let manifest = ShardManifest::new(scene, origin, settings, share, &sums);
        folder.write(&manifest, &sums).expect("writable");
    }

    fn open(&self, names: &str) -> Result<ShardSet> {
        let folders: Vec<PathBuf> = names.split(' ').map(|name| self.path(name)).collect();
        ShardSet::open(&folders)
    }

    #[track_caller]
    fn refuse(&self, names: &str, words: &str) {
        says(self.open(names).expect_err(names), words);
    }
}

#[test]
fn shards_of_different_bakes_are_refused() {
    let (scene, settings) = (built_in("mirror"), at(1e3, 16));
    let shards = Shards::new();
    for (name, share) in [("two1", (1, 2)), ("two2", (2, 2)), ("three2", (2, 3))] {
        shards.bake(name, &scene, &settings, share);
    }
    shards.bake("denser2", &scene, &at(5e3, 16), (2, 2));
    shards.bake("other2", &built_in("ring"), &settings, (2, 2));
    std::fs::create_dir(shards.path("newer")).expect("made");
    let mut newer = read_json(&shards.path("two2/shard.json"));
    newer["program_version"] = "99.0.0".into();
    std::fs::write(shards.path("newer/shard.json"), newer.to_string()).expect("writable");
    std::fs::copy(shards.path("two2/sums.bin"), shards.path("newer/sums.bin")).expect("writable");
    for (names, words) in rows(
        "two1 => two1 | missing: 2
         three2 => three2 | missing: 1, 3
         two1 two1 => two1 | is shard 1, and so is
         two1 two2 two2 => two2 | is shard 2, and so is
         two1 three2 => three2 | 3 shards and not 2 | two1
         two1 denser2 => denser2 | density per sr | 5000 | 1000 | two1
         two1 other2 => other2 | another scene | two1
         two1 newer => newer | 99.0.0 | two1
         two1 nowhere => nowhere | no such file
         two1 . => holds no shard | --shard",
    ) {
        shards.refuse(names, words);
    }
    let set = shards.open("two2 two1").expect("in any order");
    set.check_scene(&scene).expect("it is of this scene");
    let other = set.check_scene(&built_in("ring")).expect_err("another scene");
    says(other, "builtin:ring | not the scene | two2");
}

#[test]
fn torn_shards_are_refused_by_name() {
    let shards = Shards::new();
    for number in [1, 2] {
        let name = format!("s{number}");
        shards.bake(&name, &built_in("mirror"), &at(1e3, 16), (number, 2));
    }
    let [sums, json] = ["s2/sums.bin", "s2/shard.json"].map(|file| shards.path(file));
    let whole = std::fs::read(&sums).expect("written");
    for (bytes, word) in [
        (&whole[..whole.len() - 1], "ends before it should"),
        (&whole[..50], "ends before it should"),
        (&whole[..3], "ends before it should"),
        (b"", "ends before it should"),
        (&[&whole[..], b"x"].concat(), "longer than it should be"),
        (&[0; 100], "ends before it should"),
    ] {
        std::fs::write(&sums, bytes).expect("writable");
        shards.refuse("s1 s2", &format!("s2 | {word} | again"));
    }
    let others = std::fs::read(shards.path("s1/sums.bin")).expect("written");
    let others = [&others[..], &whole[..]].concat();
    std::fs::write(&sums, &others[..whole.len()]).expect("writable");
    let set = shards.open("s1 s2").expect("its length is right");
    says(
        set.pass(1, 0).expect_err("another's"),
        "s2 | damaged | shard.json | again",
    );
    std::fs::write(&sums, &whole).expect("writable");
    set.pass(1, 0).expect("they are its own again");
    let whole = std::fs::read(&json).expect("written");
    for bytes in [&whole[..whole.len() / 2], b"{}", b"[1]", b"", b"\xff"] {
        std::fs::write(&json, bytes).expect("writable");
        shards.refuse("s1 s2", "s2 | shard.json");
    }
    std::fs::write(&json, &whole).expect("writable");
    shards.open("s1 s2").expect("they are whole again");
}

#[test]
fn shards_do_not_take_each_others_folders() {
    let shards = Shards::new();
    let (scene, settings) = (built_in("mirror"), at(1e3, 16));
    shards.bake("a", &scene, &settings, (1, 2));
    let first = std::fs::read(shards.path("a/sums.bin")).expect("written");
    let open = |number, force| {
        let share = Share::new(number, 2).expect("a share");
        ShardFolder::open(&shards.path("a"), share, force)
    };
    let refused = open(2, false).expect_err("it is shard 1's");
    says(refused, "a | holds shard 1 of 2 | --force");
    open(2, true).expect("by force");
    assert_eq!(std::fs::read(shards.path("a/sums.bin")).expect("there"), first);
    shards.bake("a", &scene, &settings, (1, 2));
}
