//! Files by others: none may crash or hang, and what is broken is refused or named.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nephroid::error::Result;
use nephroid::scene::{LoadOptions, Scene, load};
use serde_json::{Value, json};

use support::shared_or_skip;
use support::sound::scene_fault;

/// Far more than any of the small files needs: a test for endless loops, not for speed.
const PATIENCE: Duration = Duration::from_secs(20);

fn load_in_time(path: &Path) -> Result<Scene> {
    let start = Instant::now();
    let result = load(path.to_str().expect("path is UTF-8"), &LoadOptions::default());
    assert!(
        start.elapsed() < PATIENCE,
        "{} took {:?}",
        path.display(),
        start.elapsed()
    );
    if let Ok(scene) = &result {
        assert_eq!(scene_fault(scene), None, "{}", path.display());
    }
    result
}

struct Case {
    file: String,
    errors: usize,
    codes: Vec<String>,
}

fn validator_cases(folder: &Path) -> Vec<Case> {
    let table = std::fs::read_to_string(folder.join("EXPECTED.csv")).expect("table can be read");
    let cases: Vec<Case> = table
        .lines()
        .skip(1)
        .map(|line| {
            let mut fields = line.splitn(3, ',');
            let mut field = || fields.next().expect("table has three columns").to_owned();
            Case {
                file: field(),
                errors: field().parse().expect("second column counts errors"),
                codes: field().split_whitespace().map(str::to_owned).collect(),
            }
        })
        .collect();
    assert!(cases.len() > 100, "the table has {} files", cases.len());
    cases
}

/// A copy of a file, in a folder of its own with the files beside it, whose scene has a node for every mesh, camera
/// and light and a material for every image and texture, so that all of them are read. `None` where the JSON is not that whole.
fn with_everything_placed(path: &Path) -> Option<(tempfile::TempDir, PathBuf)> {
    let mut file: Value = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
    let count = |list: Option<&Value>| list.and_then(Value::as_array).map_or(0, Vec::len);
    let (meshes, cameras, images) = (
        count(file.get("meshes")),
        count(file.get("cameras")),
        count(file.get("images")),
    );
    let lights = count(file.pointer("/extensions/KHR_lights_punctual/lights"));
    let mut nodes: Vec<Value> = (0..meshes).map(|mesh| json!({ "mesh": mesh })).collect();
    nodes.extend((0..cameras).map(|camera| json!({ "camera": camera })));
    nodes.extend(
        (0..lights).map(|light| json!({ "extensions": { "KHR_lights_punctual": { "light": light } } })),
    );
    let fields = file.as_object_mut()?;
    let mut append = |key: &str, added: Vec<Value>| {
        let list = fields.entry(key).or_insert_with(|| json!([])).as_array_mut()?;
        let first = list.len();
        list.extend(added);
        Some(first)
    };
    let textures = append(
        "textures",
        (0..images).map(|image| json!({ "source": image })).collect(),
    )?;
    let material =
        |texture: usize| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } } });
    append("materials", (0..textures + images).map(material).collect())?;
    let count_added = nodes.len();
    let first = append("nodes", nodes)?;
    fields.insert(
        "scenes".into(),
        json!([{ "nodes": (first..first + count_added).collect::<Vec<_>>() }]),
    );
    fields.insert("scene".into(), json!(0));
    let folder = tempfile::tempdir().expect("temporary folder");
    for entry in std::fs::read_dir(path.parent()?).ok()? {
        let entry = entry.ok()?.path();
        if entry
            .extension()
            .is_some_and(|kind| kind != "gltf" && kind != "glb")
        {
            std::fs::copy(&entry, folder.path().join(entry.file_name()?)).ok()?;
        }
    }
    let copy = folder.path().join("placed.gltf");
    std::fs::write(&copy, file.to_string()).expect("copy can be written");
    Some((folder, copy))
}

/// Faults of things that are not read, by a part of the validator's code or of the file's path.
const NOT_READ: [(&str, &str); 14] = [
    ("ALIGNMENT", "numbers are read at any offset"),
    ("VALUE_MULTIPLE_OF", "numbers are read at any stride"),
    ("EMPTY_ENTITY", "an empty list is as good as none"),
    (
        "MIN_MISMATCH",
        "stated bounds are not relied upon; the real ones are computed",
    ),
    ("data/skin", "skins are not applied"),
    ("SKIN", "skins are not applied"),
    ("ACCESSOR_INVALID_FLOAT", "no mesh uses that accessor"),
    (
        "ACCESSOR_NORMALIZED_INVALID",
        "a float is a float with that mark or without",
    ),
    ("ACCESSOR_NON_CLAMPED", "vertex colours are not read"),
    ("TANGENT_SPACE", "tangents are not read"),
    (
        "UNEXPECTED_EXTENSION_OBJECT",
        "an extension where it means nothing is not looked for",
    ),
    ("KHR_MATERIALS_VARIANTS", "variants are not read"),
    (
        "BUFFER_VIEW_TARGET_OVERRIDE",
        "a view's target is a hint for graphics cards",
    ),
    ("MIME_TYPE", "an image's kind is told by its bytes"),
];

#[test]
fn validator_files_are_refused_or_their_faults_named() {
    let Some(folder) = shared_or_skip("validator") else {
        return;
    };
    let mut unnoticed = Vec::new();
    for case in validator_cases(&folder) {
        let path = folder.join(&case.file);
        let noticed =
            |result: &Result<Scene>| result.as_ref().map_or(true, |scene| !scene.warnings.is_empty());
        let mut seen = noticed(&load_in_time(&path));
        if let Some((_folder, copy)) = with_everything_placed(&path) {
            seen |= noticed(&load_in_time(&copy));
        }
        let named =
            |part: &str| case.file.contains(part) || case.codes.iter().any(|code| code.contains(part));
        let excused = NOT_READ.iter().any(|(part, _)| named(part));
        if case.errors > 0 && !seen && !excused {
            unnoticed.push(format!("{} {:?}", case.file, case.codes));
        }
    }
    assert!(
        unnoticed.is_empty(),
        "loaded without a word:\n{}",
        unnoticed.join("\n")
    );
}

/// Valid files that cannot be read for a reason that their sentence names.
const VALID_BUT_REFUSED: [(&str, &str); 2] = [
    (
        "base/data/root/named_objects.gltf",
        "buffer 0, which does not exist or has no data",
    ),
    (
        "ext/KHR_mesh_quantization/data/primitive/valid.gltf",
        "KHR_mesh_quantization",
    ),
];

#[test]
fn valid_validator_files_load() {
    let Some(folder) = shared_or_skip("validator") else {
        return;
    };
    for case in validator_cases(&folder).iter().filter(|case| case.errors == 0) {
        let result = load_in_time(&folder.join(&case.file));
        match VALID_BUT_REFUSED.iter().find(|(file, _)| *file == case.file) {
            Some((_, why)) => {
                let error = result.expect_err("is on the list of refused files").to_string();
                assert!(error.contains(why), "{error}");
            }
            None => assert!(result.is_ok(), "{}: {:?}", case.file, result.err()),
        }
    }
}

#[test]
fn scenes_of_others_load_with_surfaces() {
    let Some(folder) = shared_or_skip("scenes") else {
        return;
    };
    let entries = std::fs::read_dir(folder).expect("folder can be listed");
    let files = entries.map(|entry| entry.expect("entry can be read").path());
    let glbs: Vec<PathBuf> = files
        .filter(|path| path.extension().is_some_and(|kind| kind == "glb"))
        .collect();
    assert!(glbs.len() >= 13, "{} scenes", glbs.len());
    for path in glbs {
        let scene = load_in_time(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(scene.triangle_count() > 0, "{}", path.display());
    }
}
