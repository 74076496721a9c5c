//! Scenes: every file of the collection beside the project, and some made here, with damage of every kind.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use nephroid::bake::Baker;
use nephroid::error::Result;

use super::files::result_fault;
use super::mutate::{Damage, Tally, Way, alone, attack, attack_alone, effort};
use support::glb::{golden, load_bytes, load_path};
use support::prelude::*;
use support::sound::scene_fault;
use support::tools::{energy_fault, to};
use support::{or_skip, shared_or_skip};

/// Most memory that loading may take by itself [bytes].
const LIMIT_BYTES: u64 = 64 << 20;

/// Memory that a small bake may take [bytes].
const MAX_BYTES_OF_BAKE: usize = 512 << 20;

/// Memory that a file of so many bytes may take: the limit twice, since data is copied on its way, and what its text
/// takes as a document.
fn most_bytes(file: usize) -> usize {
    2 * LIMIT_BYTES as usize + 100 * file
}

fn options() -> LoadOptions {
    LoadOptions {
        memory_limit_bytes: LIMIT_BYTES,
        default_light: true,
        ..LoadOptions::default()
    }
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("folder can be listed");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("entry can be read").path())
        .collect();
    paths.sort();
    let below = |path: PathBuf| {
        if path.is_dir() {
            files_below(&path)
        } else {
            vec![path]
        }
    };
    paths.into_iter().flat_map(below).collect()
}

/// Bakes as little as can be asked for.
fn bake(scene: Scene) -> Result<Bake> {
    let mut session = Baker::new(Arc::new(scene))?;
    let settings = BakeSettings {
        max_depth: Some(3),
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        memory_bytes: 64 << 20,
        threads: 2,
        ..to(0.3, 8)
    };
    session.bake(&settings, &(), &Control::default())
}

/// Damages a scene's file, and what it names beside it. The first of each whose damage goes unnoticed is baked: what loads
/// keeps the laws all the same. More triangles or lights take longer than there is time for.
fn attack_scene(path: &Path, tally: &Tally, bakes: &Tally) {
    let text = String::from_utf8_lossy(&std::fs::read(path).expect("it can be read")).into_owned();
    let folder = path.parent().expect("it lies in a folder");
    let copies = tempfile::tempdir().expect("temporary folder");
    let copy_of = |file: &Path| {
        copies
            .path()
            .join(file.strip_prefix(folder).expect("it lies below"))
    };
    let name_of = |file: &Path| file.file_name().expect("a name").display().to_string();
    let mut files = files_below(folder);
    files.retain(|file| file == path || text.contains(&name_of(file)));
    for file in &files {
        std::fs::create_dir_all(copy_of(file).parent().expect("a folder")).expect("can be made");
        std::fs::copy(file, copy_of(file)).expect("can be written");
    }
    for file in &files {
        let whole = std::fs::read(file).expect("it can be read");
        let is_scene = file == path;
        let name = name_of(file);
        let (damage, times) = match files.len() {
            _ if is_scene => (Damage::scene as Way, 10),
            count => (Damage::bytes as Way, 3_usize.div_ceil(count - 1)),
        };
        // Damage makes a file longer, but by little.
        let bounds = (times, most_bytes(whole.len() + 10_000));
        let read = |bytes: &[u8]| {
            std::fs::write(copy_of(file), bytes).expect("can be written");
            load_path(&copy_of(path), &options())
        };
        let must_bake = Cell::new(is_scene);
        attack(tally, bounds, &[(&name, whole.clone(), damage)], read, |scene| {
            let fault = scene_fault(&scene);
            let is_small = scene.triangle_count() <= 3_000 && scene.lights.len() <= 8;
            if fault.is_some() || !is_small || !must_bake.replace(false) {
                return fault;
            }
            let bytes = std::fs::read(copy_of(file)).expect("it was written");
            let result = bakes.watch((&name, &bytes), MAX_BYTES_OF_BAKE, || bake(scene));
            result.and_then(|result| result_fault(&result).or_else(|| energy_fault(&result)))
        });
        std::fs::write(copy_of(file), whole).expect("can be written");
    }
}

#[test]
fn files_of_the_validator() {
    let folder = or_skip!(shared_or_skip("validator"));
    alone(|| {
        let (tally, bakes) = (Tally::default(), Tally::default());
        let is_scene = |path: &PathBuf| {
            path.extension()
                .is_some_and(|kind| kind == "gltf" || kind == "glb")
        };
        for path in files_below(&folder).into_iter().filter(is_scene) {
            attack_scene(&path, &tally, &bakes);
        }
        tally.expect(90, 90);
        assert!(
            bakes.taken.get() > 20 && bakes.refused.get() == 0,
            "what loads can be baked: {bakes:?}"
        );
    });
}

/// The same where no files are shared.
#[test]
fn a_small_scene() {
    let glass = json!({ "extensions": {
        "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_volume": { "thicknessFactor": 1.0, "attenuationDistance": 2.0 },
    } });
    let whole = Glb::tetrahedron()
        .with_material(glass)
        .with_light("lamp", json!({ "type": "spot", "spot": {} }))
        .bytes();
    assert!(load_bytes(&whole, &options()).is_ok());
    let bounds = (1_500, most_bytes(whole.len() + 10_000));
    let read = |bytes: &[u8]| load_bytes(bytes, &options());
    let subject = ("small.glb", whole, Damage::scene as Way);
    attack_alone(bounds, &[subject], read, |scene| scene_fault(&scene), (90, 90));
}

/// Compressed data is unpacked by what it says of itself.
#[test]
fn compressed_scenes() {
    let with_image = |name: &str| {
        let basisu = json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } });
        let file = Glb::triangle().with_texture(&golden(name), json!({}), basisu);
        file.bytes()
    };
    alone(|| {
        for (name, whole) in [
            ("draco.glb", golden("draco.glb")),
            ("draco_sequential.glb", golden("draco_sequential.glb")),
            ("meshopt.glb", golden("meshopt.glb")),
            ("etc1s.glb", with_image("etc1s.ktx2")),
            ("uastc.glb", with_image("uastc.ktx2")),
        ] {
            assert!(load_bytes(&whole, &options()).is_ok(), "{name}");
            let (tally, bounds) = (Tally::default(), (1_000, most_bytes(whole.len() + 10_000)));
            let read = |bytes: &[u8]| load_bytes(bytes, &options());
            let subjects = [
                (name, whole.clone(), Damage::scene as Way),
                (name, whole, Damage::binary as Way),
            ];
            attack(&tally, bounds, &subjects, read, |scene| scene_fault(&scene));
            tally.expect(90, 90);
        }
    });
}

/// Counts that a file only states are worth nothing: a kilobyte must not take a gigabyte.
#[test]
fn stated_counts_take_no_memory() {
    alone(|| {
        let tally = Tally::default();
        for count in [1_u64 << 20, 1 << 31, u64::from(u32::MAX), 1 << 53] {
            let sparse = json!({ "count": count, "indices": { "bufferView": 0, "componentType": 5125 },
                "values": { "bufferView": 0 } });
            for (what, claim) in [
                (
                    "accessors",
                    json!({ "componentType": 5126, "count": count, "type": "VEC3", "bufferView": null }),
                ),
                ("accessors", json!({ "count": count })),
                ("accessors", json!({ "sparse": sparse })),
                ("bufferViews", json!({ "byteLength": count })),
                ("bufferViews", json!({ "byteStride": count })),
            ] {
                let mut file = Glb::tetrahedron();
                let stated = file.json[what][0].as_object_mut().expect("it is there");
                stated.extend(claim.as_object().cloned().unwrap_or_default());
                stated.retain(|_, value| !value.is_null());
                let bytes = file.bytes();
                let load = || load_bytes(&bytes, &options());
                tally.watch(
                    (&format!("{count}-{what}.glb"), &bytes),
                    most_bytes(bytes.len()),
                    load,
                );
            }
        }
        assert!(tally.refused.get() >= 12, "{tally:?}");
    });
}

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
    alone(|| {
        let folder = tempfile::tempdir().expect("temporary folder");
        let mut scene = Glb::tetrahedron().with_light("lamp", json!({ "type": "point" }));
        let data = scene.binary.clone();
        scene.json["buffers"] = json!([{ "byteLength": data.len(), "uri": "data.bin" }]);
        let text = scene.json.to_string().into_bytes();
        let [path, beside] = ["scene.gltf", "data.bin"].map(|name| folder.path().join(name));
        std::fs::write(&path, &text).expect("can be written");
        std::fs::write(&beside, &data).expect("can be written");
        let load = || load_path(&path, &LoadOptions::default());
        let (tally, stop) = (Tally::default(), AtomicBool::new(false));
        std::thread::scope(|threads| {
            threads.spawn(|| disturb(&path, &text, &stop));
            threads.spawn(|| disturb(&beside, &data, &stop));
            for number in 0..2_000 * effort() {
                if let Some(scene) = tally.watch((&format!("{number}-race"), &[]), 16 << 20, load) {
                    assert_eq!(scene_fault(&scene), None);
                }
            }
            stop.store(true, Ordering::Relaxed);
        });
        assert!(tally.refused.get() > 100, "{tally:?}");
        // Let alone, it is read.
        assert!(load().is_ok());
    });
}
