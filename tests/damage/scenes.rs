//! Scenes: every file of the collections beside the project, and some made here, with damage of every kind.

use std::path::{Path, PathBuf};

use nephroid::scene::{LoadOptions, Scene};
use serde_json::json;

use crate::baked;
use crate::glb::{Glb, load_path};
use crate::mutate::{Damage, effort};
use crate::support::shared_or_skip;
use crate::support::sound::scene_fault;
use crate::watch::Tally;

/// Most memory that loading may take by itself [bytes].
const LIMIT_BYTES: u64 = 64 << 20;

/// Memory that a file of so many bytes may take: the limit twice, since data is copied on its way, and what its text
/// takes as a document.
fn most_bytes(file: usize) -> usize {
    2 * LIMIT_BYTES as usize + 100 * file
}

/// A scene's file with what lies beside it.
struct Original {
    name: String,
    bytes: Vec<u8>,
    beside: Vec<(PathBuf, Vec<u8>)>,
}

impl Original {
    fn read(path: &Path) -> Self {
        let read = |path: &Path| std::fs::read(path).expect("a collection can be read");
        let is_scene = |path: &Path| {
            path.extension()
                .is_some_and(|kind| kind == "gltf" || kind == "glb")
        };
        let folder = path.parent().expect("it lies in a folder");
        let is_alone = path.extension().is_some_and(|kind| kind == "glb");
        let others = files_below(folder)
            .into_iter()
            .filter(|other| !is_scene(other) && !is_alone);
        let beside = others.map(|other| {
            let name = other.strip_prefix(folder).expect("it lies below").to_path_buf();
            (name, read(&other))
        });
        Self {
            name: path.file_name().expect("a name").to_string_lossy().into_owned(),
            bytes: read(path),
            beside: beside.collect(),
        }
    }

    /// Tries one kind of damage to it, now and then to what lies beside it.
    fn try_damage(&self, number: usize, tally: &Tally, bakes: &Tally) {
        let mut damage = Damage::to(&self.name, number);
        let folder = tempfile::tempdir().expect("temporary folder");
        let hits_another = !self.beside.is_empty() && damage.below(4) == 0;
        let hit = hits_another.then(|| damage.below(self.beside.len()));
        for (index, (name, bytes)) in self.beside.iter().enumerate() {
            let mut bytes = bytes.clone();
            if hit == Some(index) {
                damage.bytes(&mut bytes);
            }
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("can be made");
            std::fs::write(path, bytes).expect("can be written");
        }
        let bytes = if hits_another {
            self.bytes.clone()
        } else {
            damage.scene(&self.bytes)
        };
        let path = folder.path().join(&self.name);
        std::fs::write(&path, &bytes).expect("can be written");
        let options = LoadOptions {
            memory_limit_bytes: LIMIT_BYTES,
            default_light: true,
            ..LoadOptions::default()
        };
        let name = format!("{number}-{}", self.name);
        let load = || load_path(&path, &options);
        let Some(scene) = tally.watch((&name, &bytes), most_bytes(bytes.len()), load) else {
            return;
        };
        assert_eq!(scene_fault(&scene), None, "{name}: {}", keep(&name, &bytes));
        // Some are baked as well, as far as there is time.
        if number.is_multiple_of(12) {
            try_bake(&name, &bytes, scene, bakes);
        }
    }
}

fn keep(name: &str, bytes: &[u8]) -> String {
    crate::support::evidence::keep_bytes(name, bytes)
}

fn try_bake(name: &str, bytes: &[u8], scene: Scene, bakes: &Tally) {
    if !baked::is_small(&scene) {
        return;
    }
    if let Some(result) = bakes.watch((name, bytes), baked::MOST_BYTES, || baked::bake(scene)) {
        assert_eq!(baked::fault(&result), None, "{name}: {}", keep(name, bytes));
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

/// Tries so many kinds of damage to each scene, `times` for `NEPHROID_MUTATIONS` = 1.
fn damage_all(what: &str, originals: &[Original], times: usize) {
    let (tally, bakes) = (Tally::default(), Tally::default());
    for original in originals {
        for number in 0..times * effort() {
            original.try_damage(number, &tally, &bakes);
        }
    }
    println!(
        "{what}: {} damaged files of {}: {} taken, {} refused; {} bakes",
        tally.count(),
        originals.len(),
        tally.taken.get(),
        tally.refused.get(),
        bakes.count()
    );
    let enough = tally.count() / 20;
    assert!(
        tally.taken.get() > enough && tally.refused.get() > enough,
        "{tally:?}"
    );
    assert!(bakes.refused.get() == 0, "what loads can be baked: {bakes:?}");
}

fn scenes_of(folder: &Path) -> Vec<Original> {
    let is_scene = |path: &PathBuf| {
        path.extension()
            .is_some_and(|kind| kind == "gltf" || kind == "glb")
    };
    let paths = files_below(folder).into_iter().filter(is_scene);
    paths.map(|path| Original::read(&path)).collect()
}

#[test]
fn files_of_the_validator() {
    let _alone = crate::watch::alone();
    let Some(folder) = shared_or_skip("validator") else {
        return;
    };
    damage_all("validator", &scenes_of(&folder), 12);
}

/// Changes a file so that it states more than it holds.
type Claim = Box<dyn Fn(&mut Glb)>;

/// Counts that a file only states are worth nothing: a kilobyte must not take a gigabyte.
#[test]
fn stated_counts_take_no_memory() {
    let _alone = crate::watch::alone();
    let tally = Tally::default();
    for count in [1_u64 << 20, 1 << 31, u64::from(u32::MAX), 1 << 53] {
        let claims: [(&str, Claim); 5] = [
            (
                "zeros",
                Box::new(move |file| {
                    file.json["accessors"][0] =
                        json!({ "componentType": 5126, "count": count, "type": "VEC3" });
                }),
            ),
            (
                "elements",
                Box::new(move |file| file.json["accessors"][0]["count"] = json!(count)),
            ),
            (
                "bytes",
                Box::new(move |file| file.json["bufferViews"][0]["byteLength"] = json!(count)),
            ),
            (
                "stride",
                Box::new(move |file| file.json["bufferViews"][0]["byteStride"] = json!(count)),
            ),
            (
                "sparse",
                Box::new(move |file| {
                    file.json["accessors"][0]["sparse"] = json!({ "count": count,
                    "indices": { "bufferView": 0, "componentType": 5125 }, "values": { "bufferView": 0 } });
                }),
            ),
        ];
        for (what, claim) in claims {
            let mut file = Glb::tetrahedron();
            claim(&mut file);
            let bytes = file.bytes();
            let options = LoadOptions {
                memory_limit_bytes: LIMIT_BYTES,
                ..LoadOptions::default()
            };
            let name = format!("{count}-{what}.glb");
            tally.watch((&name, &bytes), most_bytes(bytes.len()), || {
                crate::glb::load_bytes(&bytes, &options)
            });
        }
    }
    assert!(tally.refused.get() >= 12, "{tally:?}");
}
