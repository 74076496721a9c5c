//! Files of other programs, edited and saved.

use std::fs;
use std::path::Path;

use glam::DVec3;
use nephroid::scene::load::save;
use nephroid::scene::{Edit, LoadOptions, MaterialEdit, Motion};
use serde_json::Value;

use super::fixtures::{edited, folder, intensity, read};
use super::scene_file;

/// What an edit may touch; every other member of a file is to stay.
const TOUCHED: [&str; 5] = ["nodes", "materials", "extensions", "extensionsUsed", "buffers"];

#[test]
fn real_files_are_saved_with_edits() {
    let Some(sources) = support::shared_or_skip("scenes") else {
        return;
    };
    let folder = folder();
    let target = folder.path().join("saved.glb");
    let sources = fs::read_dir(sources).expect("a readable folder");
    let mut sources: Vec<_> = sources.map(|entry| entry.expect("an entry").path()).collect();
    sources.retain(|path| path.extension().is_some_and(|extension| extension == "glb"));
    let saved = sources.iter().filter(|source| is_saved(source, &target)).count();
    // Some hold what no edit may change.
    assert!(saved > sources.len() / 2, "{saved} of {}", sources.len());
}

/// Edits the first of everything, saves and reads back.
fn is_saved(source: &Path, target: &Path) -> bool {
    let loaded = read(source);
    let mut edits = vec![
        Edit::Material(0, MaterialEdit::Roughness(0.375)),
        Edit::Material(0, MaterialEdit::Ior(1.75)),
        Edit::Place(0, Motion::turned(0.0, DVec3::new(0.125, 0.25, -0.5))),
    ];
    let double = loaded
        .lights
        .first()
        .map(|light| intensity(0, 2.0 * light.kind.strength()));
    edits.extend(double.filter(|edit| edit.apply(&loaded).is_ok()));
    let scene = edited(&loaded, &edits);
    if save(target, &loaded, &scene, &LoadOptions::default()).is_err() {
        return false;
    }
    let read = read(target);
    let extent_m = scene.bounds().map_or(1.0, |(low, high)| (high - low).length());
    let shift = read.origin_world - scene.origin_world;
    for (a, b) in read.objects.iter().zip(&scene.objects) {
        let mut corners = a
            .mesh_in_scene()
            .positions
            .iter()
            .zip(&b.mesh_in_scene().positions);
        assert!(corners.all(|(a, b)| (*a + shift).distance(*b) < 1e-9 * extent_m));
    }
    assert_eq!(read.lights.len(), scene.lights.len());
    let [before, after] = [source, target].map(|path| -> Value {
        let text = scene_file::text_of(path);
        serde_json::from_str(text.trim_end_matches(['\0', ' '])).expect("it is JSON")
    });
    for (name, value) in before.as_object().expect("an object") {
        let is_same = TOUCHED.contains(&name.as_str()) || after[name] == *value;
        assert!(is_same, "{name} of {}", source.display());
    }
    true
}
