//! Files by others: none may crash or hang, and what is broken is refused or named.

use std::path::{Path, PathBuf};

use nephroid::error::Result;

use crate::prelude::*;
use support::shared_or_skip;
use support::sound::scene_fault;

fn load_soundly(path: &Path) -> Result<Scene> {
    let result = Scene::load(path.to_str().expect("path is UTF-8"), &LoadOptions::default());
    if let Ok(scene) = &result {
        assert_eq!(scene_fault(scene), None, "{}", path.display());
    }
    result
}

/// Files of the validator, how many errors each has, and their codes.
fn validator_cases(folder: &Path) -> Vec<(String, usize, String)> {
    let table = std::fs::read_to_string(folder.join("EXPECTED.csv")).expect("table can be read");
    let case = |line: &str| {
        let fields: Vec<&str> = line.splitn(3, ',').collect();
        let errors = fields[1].parse().expect("second column counts errors");
        (fields[0].to_owned(), errors, fields[2].to_owned())
    };
    let cases: Vec<_> = table.lines().skip(1).map(case).collect();
    assert!(cases.len() > 100, "the table has {} files", cases.len());
    cases
}

/// A copy of a file, in a folder of its own with the files beside it, whose scene has a node for every mesh, camera
/// and light and a material for every image and texture, so that all of them are read. `None` where the JSON is not that whole.
fn with_everything_placed(path: &Path) -> Option<(tempfile::TempDir, PathBuf)> {
    let mut file: Value = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
    let count = |list: Option<&Value>| list.and_then(Value::as_array).map_or(0, Vec::len);
    let [meshes, cameras, images] = ["meshes", "cameras", "images"].map(|list| count(file.get(list)));
    let lights = count(file.pointer("/extensions/KHR_lights_punctual/lights"));
    let light = |light| json!({ "extensions": { "KHR_lights_punctual": { "light": light } } });
    let mut nodes: Vec<Value> = (0..meshes).map(|mesh| json!({ "mesh": mesh })).collect();
    nodes.extend((0..cameras).map(|camera| json!({ "camera": camera })));
    nodes.extend((0..lights).map(light));
    let fields = file.as_object_mut()?;
    let mut append = |key: &str, added: Vec<Value>| {
        let list = fields.entry(key).or_insert_with(|| json!([])).as_array_mut()?;
        let first = list.len();
        list.extend(added);
        Some(first)
    };
    let image = |image| json!({ "source": image });
    let textures = append("textures", (0..images).map(image).collect())?;
    let material =
        |texture: usize| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } } });
    append("materials", (0..textures + images).map(material).collect())?;
    let count_added = nodes.len();
    let first = append("nodes", nodes)?;
    let nodes: Vec<usize> = (first..first + count_added).collect();
    fields.insert("scenes".into(), json!([{ "nodes": nodes }]));
    fields.insert("scene".into(), json!(0));
    let folder = folder();
    for entry in std::fs::read_dir(path.parent()?).ok()? {
        let entry = entry.ok()?.path();
        let is_other = |kind: &std::ffi::OsStr| kind != "gltf" && kind != "glb";
        if entry.extension().is_some_and(is_other) {
            std::fs::copy(&entry, folder.path().join(entry.file_name()?)).ok()?;
        }
    }
    let copy = folder.path().join("placed.gltf");
    std::fs::write(&copy, file.to_string()).expect("copy can be written");
    Some((folder, copy))
}

/// Faults of things that are not read, by a part of the validator's code or of the file's path, and why.
const NOT_READ: &str = "
    ALIGNMENT => numbers are read at any offset
    VALUE_MULTIPLE_OF => numbers are read at any stride
    EMPTY_ENTITY => an empty list is as good as none
    MIN_MISMATCH => stated bounds are not relied upon; the real ones are computed
    data/skin => no mesh has that skin
    SKIN => no mesh has that skin
    ACCESSOR_INVALID_FLOAT => no mesh uses that accessor
    ACCESSOR_NORMALIZED_INVALID => a float is a float with that mark or without
    ACCESSOR_NON_CLAMPED => vertex colours are brought into [0, 1]
    TANGENT_SPACE => tangents are not read
    UNEXPECTED_EXTENSION_OBJECT => an extension where it means nothing is not looked for
    KHR_MATERIALS_VARIANTS => variants are not read
    KHR_materials_variants/data/variant => variants are not read
    BUFFER_VIEW_TARGET_OVERRIDE => a view's target is a hint for graphics cards
    MIME_TYPE => an image's kind is told by its bytes
";

/// Valid files that cannot be read for a reason that their sentence names.
const VALID_BUT_REFUSED: &str = "
    base/data/root/named_objects.gltf => buffer 0, which does not exist or has no data
";

#[test]
fn validator_files_load_or_their_faults_are_named() {
    let Some(folder) = shared_or_skip("validator") else {
        return;
    };
    let noticed = |result: &Result<Scene>| result.as_ref().map_or(true, |scene| !scene.warnings.is_empty());
    let mut unnoticed = Vec::new();
    for (file, errors, codes) in validator_cases(&folder) {
        let path = folder.join(&file);
        let result = load_soundly(&path);
        let mut seen = noticed(&result);
        if let Some((_folder, copy)) = with_everything_placed(&path) {
            seen |= noticed(&load_soundly(&copy));
        }
        let excused = rows(NOT_READ).any(|(part, _)| file.contains(part) || codes.contains(part));
        if errors > 0 && !seen && !excused {
            unnoticed.push(format!("{file} {codes}"));
        }
        if errors == 0 {
            match rows(VALID_BUT_REFUSED).find(|(refused, _)| *refused == file) {
                Some((_, why)) => says(result.expect_err("is on the list of refused files"), why),
                None => assert!(result.is_ok(), "{file}: {:?}", result.err()),
            }
        }
    }
    assert!(
        unnoticed.is_empty(),
        "loaded without a word:\n{}",
        unnoticed.join("\n")
    );
}
