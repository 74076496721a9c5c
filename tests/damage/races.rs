//! Files that are changed, cut off or deleted while they are read.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use nephroid::scene::LoadOptions;
use serde_json::json;

use crate::glb::{Glb, load_path};
use crate::mutate::effort;
use crate::support::sound::scene_fault;
use crate::watch::Tally;

/// Memory that so small a scene may take [bytes].
const MOST_BYTES: usize = 16 << 20;

/// Every state that a file can be in, one after the other until it is told to stop.
fn disturb(path: &Path, whole: &[u8], stop: &AtomicBool) {
    let aside = path.with_extension("aside");
    while !stop.load(Ordering::Relaxed) {
        for length in [whole.len(), whole.len() / 2, 0, whole.len() - 1] {
            // In place: whoever reads sees the change.
            std::fs::write(path, &whole[..length]).expect("can be written");
        }
        std::fs::remove_file(path).expect("it was there");
        std::fs::write(&aside, whole).expect("can be written");
        std::fs::rename(&aside, path).expect("can be renamed");
        std::fs::remove_file(path).expect("it was there");
        std::fs::create_dir(path).expect("nothing has the name");
        std::fs::remove_dir(path).expect("it is empty");
        std::fs::write(path, whole).expect("can be written");
    }
}

#[test]
fn scenes_that_change_while_they_are_read() {
    let _alone = crate::watch::alone();
    let folder = tempfile::tempdir().expect("temporary folder");
    let mut scene = Glb::tetrahedron().with_light("lamp", json!({ "type": "point" }));
    let data = scene.binary.clone();
    scene.json["buffers"] = json!([{ "byteLength": data.len(), "uri": "data.bin" }]);
    let text = scene.json.to_string().into_bytes();
    let [path, beside] = ["scene.gltf", "data.bin"].map(|name| folder.path().join(name));
    std::fs::write(&path, &text).expect("can be written");
    std::fs::write(&beside, &data).expect("can be written");
    let tally = Tally::default();
    let stop = AtomicBool::new(false);
    std::thread::scope(|threads| {
        threads.spawn(|| disturb(&path, &text, &stop));
        threads.spawn(|| disturb(&beside, &data, &stop));
        for number in 0..2_000 * effort() {
            let load = || load_path(&path, &LoadOptions::default());
            if let Some(scene) = tally.watch((&format!("{number}-race"), &[]), MOST_BYTES, load) {
                assert_eq!(scene_fault(&scene), None);
            }
        }
        stop.store(true, Ordering::Relaxed);
    });
    println!("scenes that change: {tally:?}");
    assert!(tally.refused.get() > 100, "{tally:?}");
    // Let alone, it is read.
    std::fs::write(&path, &text).expect("can be written");
    std::fs::write(&beside, &data).expect("can be written");
    assert!(load_path(&path, &LoadOptions::default()).is_ok());
}
