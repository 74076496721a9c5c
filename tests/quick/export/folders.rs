//! Output folders: ours are replaced file by file, other people's are taken by force alone.

use std::path::Path;

use nephroid::error::Result;
use nephroid::export::frame_folder::FrameFolder;
use nephroid::export::map_folder::MapFolder;
use nephroid::export::shards::ShardFolder;
use nephroid::export::textures::TextureFolder;
use nephroid::light_pass::share::Share;

use super::{Baked, names, two_lamps};
use crate::prelude::*;
use support::tools::{at, bake};

type Open = fn(&Path, bool) -> Result<()>;

const KINDS: [(&str, Open); 3] = [
    ("a bake", |path, force| MapFolder::open(path, force).map(drop)),
    ("an export of textures", |path, force| {
        TextureFolder::open(path, force).map(drop)
    }),
    ("this shard", |path, force| {
        let share = Share::new(1, 2).expect("a share");
        ShardFolder::open(path, share, force).map(drop)
    }),
];

#[test]
fn others_folders_are_taken_only_by_force() {
    let around = folder();
    let photos = around.path().join("photos");
    std::fs::create_dir(&photos).expect("writable");
    std::fs::write(photos.join("cat.jpg"), "a cat").expect("writable");
    // Files of our names do not make it ours.
    for foreign in ["manifest.json", "index.json", "shard.json"] {
        for (kind, open) in KINDS {
            let refused = open(&photos, false).expect_err("it is not ours");
            says(refused, &format!("photos | not from {kind} | --force"));
            open(&photos, true).expect("by force");
        }
        std::fs::write(photos.join(foreign), r#"{"name": "an app"}"#).expect("writable");
    }
    let refused = FrameFolder::open(&photos).expect_err("it is not ours");
    says(refused, "photos | not frames");
    assert_eq!(
        names(&photos),
        ["cat.jpg", "index.json", "manifest.json", "shard.json"]
    );
    std::fs::write(photos.join("frame-00001.png"), "").expect("writable");
    FrameFolder::open(&photos).expect("frames of an earlier time are replaced");
}

#[test]
fn folders_are_made_for_a_result_alone() {
    let around = folder();
    let deep = around.path().join("x/y");
    for (kind, open) in KINDS {
        open(&deep, false).expect("writable");
        assert_eq!(names(around.path()), [""; 0], "{kind}: nothing was written");
    }
    let file = around.path().join("file");
    std::fs::write(&file, "kept").expect("writable");
    for (_, open) in KINDS {
        for place in [&file, &file.join("below")] {
            says(open(place, true).expect_err("a file"), "file");
        }
    }
    assert_eq!(std::fs::read(&file).expect("there"), b"kept");
}

#[test]
fn maps_are_replaced_file_by_file() {
    let baked = Baked::quick(built_in("mirror"), &[LayerKind::Caustic]);
    let out = baked.path("out");
    std::fs::write(out.join("notes.txt"), "keep me").expect("writable");
    std::fs::write(out.join("maps/other.exr"), "not ours").expect("writable");
    let first = names(&out.join("maps"));
    // Another scene: other surfaces receive light, with coordinates of their own.
    let (scene, settings) = (two_lamps().scene(), at(1e3, 16));
    let result = bake(scene.clone(), &settings);
    let folder = MapFolder::open(&out, false).expect("it is ours");
    let manifest = folder.write(&scene, &settings, &result).expect("writable");
    let written = manifest
        .maps
        .iter()
        .flat_map(|map| [Some(&map.file), map.uv_file.as_ref()]);
    let own = written.filter_map(|file| file?.strip_prefix("maps/").map(str::to_string));
    let mut expected: Vec<String> = own.chain(["other.exr".to_string()]).collect();
    expected.sort();
    assert_eq!(names(&out.join("maps")), expected);
    assert_ne!(first, expected);
    assert_eq!(names(&out), ["manifest.json", "maps", "notes.txt"]);
}
