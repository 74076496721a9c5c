//! An edited scene as a file: the original, with nothing changed but what was edited.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use nephroid::optics::spectrum::illuminant;
use nephroid::optics::{Glass, LinearSrgb};
use nephroid::scene::changes::Changes;
use nephroid::scene::load::save;
use nephroid::scene::{Edit, LightSize, LoadOptions, Scene, Wave, Waves, load};
use nephroid::units::RadiantIntensity;
use serde_json::Value;

use super::scene_file;

fn read(path: &Path) -> Scene {
    load(&path.display().to_string(), &LoadOptions::default()).expect("it is read")
}

fn edited(scene: &Scene, edits: &[Edit]) -> Scene {
    edits.iter().fold(scene.clone(), |scene, edit| {
        edit.apply(&scene).expect("it can be edited").0
    })
}

/// Everything that can be edited of the scene, without a look at what stands in its file.
fn edits() -> Vec<Edit> {
    let wave = Wave {
        amplitude_m: 0.01,
        wavelength_m: 0.25,
        direction: DVec3::X,
        phase_rad: 0.5,
    };
    vec![
        Edit::LightIntensity {
            light: 0,
            intensity: RadiantIntensity(2.5),
        },
        Edit::LightPosition {
            light: 0,
            position: DVec3::new(0.25, 2.0, 0.5),
        },
        Edit::LightColour {
            light: 0,
            colour: LinearSrgb::from([1.0, 0.5, 0.25]),
        },
        Edit::LightSize {
            light: 0,
            size: LightSize::Radius { radius_m: 0.05 },
        },
        Edit::MaterialTint {
            material: 0,
            base_colour: LinearSrgb::from([0.1, 0.2, 0.3]),
        },
        Edit::MaterialRoughness {
            material: 1,
            roughness: 0.25,
        },
        Edit::MaterialWaves {
            material: 1,
            waves: Some(Waves::new(vec![wave]).expect("it is one")),
        },
        Edit::ObjectMoved {
            object: 1,
            rotation: DQuat::from_rotation_y(0.3),
            translation: DVec3::new(0.1, 0.2, -0.3),
        },
        Edit::ObjectMoved {
            object: 0,
            rotation: DQuat::IDENTITY,
            translation: DVec3::new(0.0, -0.125, 0.0),
        },
    ]
}

/// A scene that is read back is the one that was saved: lights and materials to what 32-bit numbers hold.
fn is_same(read: &Scene, saved: &Scene) {
    for (a, b) in read.objects.iter().zip(&saved.objects) {
        assert_eq!(a.name, b.name);
        for (a, b) in a.mesh.positions.iter().zip(&b.mesh.positions) {
            assert!(a.distance(*b) < 1e-9, "{a} where {b} was saved");
        }
    }
    for (a, b) in read.materials.iter().zip(&saved.materials) {
        assert!((a.roughness - b.roughness).abs() < 1e-6);
        assert!((a.ior - b.ior).abs() < 1e-6);
        let pairs = a.base_colour.to_array().into_iter().zip(b.base_colour.to_array());
        pairs.for_each(|(a, b)| assert!((a - b).abs() < 1e-6));
        assert_eq!((a.surface, &a.waves), (b.surface, &b.waves));
    }
    for (a, b) in read.lights.iter().zip(&saved.lights) {
        let (strengths, size) = ((a.kind.strength(), b.kind.strength()), (a.size, b.size));
        assert!((strengths.0 / strengths.1 - 1.0).abs() < 1e-6, "{strengths:?}");
        assert_eq!(size.0, size.1);
        assert_eq!(a.spectrum, b.spectrum);
        let places = a.kind.position().zip(b.kind.position());
        assert!(places.is_none_or(|(a, b)| a.distance(b) < 1e-9));
    }
}

/// What the program does not know, as the file has it.
const UNKNOWN: [&str; 7] = [
    r#""VENDOR_invented_thing": { "deep": [1.50, 1e-0, {"x":"caf\u00e9"}], "big": 12345678901234567890123 }"#,
    r#""generator": "Hand \u0026 Co""#,
    r#""VENDOR_invented_thing":{"of":"lamp"}"#,
    r#""extras":{"note":"kept"}"#,
    r#""VENDOR":{"a":1.10}"#,
    r#""name":"bulb""#,
    r#""rotation":[0.0, 0.38268343236508977, 0.0, 0.92387953251128674]"#,
];

#[test]
fn an_edited_scene_is_read_back_and_what_is_unknown_survives_byte_for_byte() {
    let folder = tempfile::tempdir().expect("a folder");
    let sources = [
        scene_file::glb(folder.path(), "a", "300"),
        scene_file::gltf(folder.path(), "b", "300"),
    ];
    for source in sources {
        let loaded = read(&source);
        let scene = edited(&loaded, &edits());
        let elsewhere = tempfile::tempdir().expect("a folder");
        let target = elsewhere.path().join("saved.glb");
        save(&target, &loaded, &scene, &LoadOptions::default()).expect("it is saved");
        let read = read(&target);
        is_same(&read, &scene);
        let text = scene_file::text_of(&target);
        for unknown in UNKNOWN {
            assert!(text.contains(unknown), "{unknown} in {text}");
        }
        let value: Value = serde_json::from_str(text.trim_end()).expect("it is JSON");
        assert_eq!(value["nodes"][1]["name"], "frame");
        assert_eq!(value["nodes"][1].as_object().map(|node| node.len()), Some(4));
        assert_eq!(fs::read_dir(elsewhere.path()).expect("it is there").count(), 1);
    }
}

#[test]
fn without_an_edit_the_file_stays_as_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = scene_file::glb(folder.path(), "a", "300");
    let loaded = read(&source);
    let target = folder.path().join("b.glb");
    save(&target, &loaded, &loaded, &LoadOptions::default()).expect("it is saved");
    let [a, b] = [&source, &target].map(|path| fs::read(path).expect("it is there"));
    assert_eq!(a, b);
}

#[test]
fn glass_spectra_and_turned_lamps_are_named_as_the_program_reads_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = scene_file::glb(folder.path(), "a", "300");
    let spot = scene_file::text_of(&source).replace(
        "\"type\":\"point\"",
        "\"type\":\"spot\",\"spot\":{\"outerConeAngle\":0.5}",
    );
    // A text of another length: as a `.gltf` with its buffer beside it.
    let text = spot
        .replace("\"byteLength\":204", "\"uri\":\"a.bin\",\"byteLength\":204")
        .replace("\"metallicFactor\":1.0", "\"metallicFactor\":0.0");
    let source = folder.path().join("spot.gltf");
    scene_file::gltf(folder.path(), "a", "300");
    fs::write(&source, text.trim_end()).expect("it is written");
    let loaded = read(&source);
    let lamp = Arc::new(illuminant("A").expect("it is known"));
    for glass in [
        Glass::parse("N-BK7").expect("it is known"),
        Glass::with_abbe_number(1.7, 30.0),
    ] {
        let n_d = glass.dispersion.index(nephroid::optics::wavelength::D_LINE);
        let scene = edited(
            &loaded,
            &[
                Edit::MaterialSubstance {
                    material: 1,
                    ior: n_d,
                    glass: Some(Arc::new(glass.clone())),
                    base_colour: loaded.materials[1].base_colour,
                    metal: None,
                },
                Edit::LightSpectrum {
                    light: 0,
                    colour: lamp.xyz().to_linear_srgb(),
                    spectrum: Some(Arc::clone(&lamp)),
                },
                Edit::LightDirection {
                    light: 0,
                    direction: DVec3::new(0.2, -1.0, 0.1),
                },
            ],
        );
        let target = folder.path().join("saved.glb");
        save(&target, &loaded, &scene, &LoadOptions::default()).expect("it is saved");
        let read = read(&target);
        is_same(&read, &scene);
        let found = read.materials[1].glass.as_ref().expect("it is of glass");
        let [blue, red] = [450.0, 650.0].map(|nm| {
            let wavelength = nephroid::optics::Nanometres(nm);
            found.dispersion.index(wavelength) - glass.dispersion.index(wavelength)
        });
        assert!(blue.abs() < 1e-6 && red.abs() < 1e-6, "{blue}, {red}");
        let Changes { changes, lost } = Changes::between(&scene, &read);
        let is_turned = |edit: &Edit| {
            matches!(edit, Edit::LightDirection { direction, .. }
            if direction.distance(DVec3::new(0.2, -1.0, 0.1).normalize()) > 1e-9)
        };
        assert!(lost.is_empty() && !changes.iter().any(|change| is_turned(&change.edit)));
    }
}

#[test]
fn what_no_file_can_hold_is_refused_in_a_sentence_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = scene_file::glb(folder.path(), "a", "300");
    let loaded = read(&source);
    let target = folder.path().join("saved.glb");
    let options = LoadOptions::default();
    let mut squeezed = (*loaded.objects[1].mesh).clone();
    squeezed.positions.iter_mut().for_each(|corner| corner.y *= 0.5);
    let other_shape = edited(
        &loaded,
        &[Edit::ObjectMesh {
            object: 1,
            mesh: Arc::new(squeezed),
        }],
    );
    let error = save(&target, &loaded, &other_shape, &options).expect_err("it is another shape");
    assert!(error.to_string().contains("object `mirror`"), "{error}");

    let ring = nephroid::scene::builtin::build("ring").expect("it is built in");
    let error = save(&target, &ring, &ring, &options).expect_err("it has no file");
    assert!(error.to_string().contains("built in"), "{error}");

    // Another program took the mirror away in between.
    fs::write(
        &source,
        fs::read(scene_file::no_scene(folder.path())).expect("it is there"),
    )
    .expect("it is written");
    assert!(save(&target, &loaded, &loaded, &options).is_err());
    assert!(!target.exists());
}

#[test]
fn a_lamp_that_several_nodes_share_gets_an_entry_of_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = scene_file::json_text("300", Some("a.bin"))
        .replace("\"nodes\":[0,1,3]}", "\"nodes\":[0,1,3,4]}")
        .replace(
            "\"of\":\"lamp\"}}}",
            "\"of\":\"lamp\"}}},{\"name\":\"twin\",\"translation\":[0,2,0],\"extensions\":\
             {\"KHR_lights_punctual\":{\"light\":0}}}",
        );
    scene_file::gltf(folder.path(), "a", "300");
    let source = folder.path().join("twins.gltf");
    fs::write(&source, text).expect("it is written");
    let loaded = read(&source);
    assert_eq!(loaded.lights.len(), 2);
    let scene = edited(
        &loaded,
        &[Edit::LightIntensity {
            light: 1,
            intensity: RadiantIntensity(9.0),
        }],
    );
    let target = folder.path().join("saved.glb");
    save(&target, &loaded, &scene, &LoadOptions::default()).expect("it is saved");
    is_same(&read(&target), &scene);
}

/// What an edit may touch; every other member of a file is to stay.
const TOUCHED: [&str; 5] = ["nodes", "materials", "extensions", "extensionsUsed", "buffers"];

#[cfg(target_os = "linux")]
#[test]
#[allow(clippy::print_stdout, reason = "the list is what `--nocapture` is for")]
fn real_files_are_saved_with_every_first_thing_edited() {
    let Some(folder) = super::support::shared_or_skip("scenes") else {
        return;
    };
    let target_folder = tempfile::tempdir().expect("a folder");
    let target = target_folder.path().join("saved.glb");
    let (mut files, mut saved) = (0, 0);
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "glb") {
            continue;
        }
        files += 1;
        let loaded = read(&path);
        let mut edits = vec![
            Edit::MaterialRoughness {
                material: 0,
                roughness: 0.375,
            },
            Edit::MaterialIor {
                material: 0,
                ior: 1.75,
            },
        ];
        // All parts of the first object's node, turned together about one point, would be a gizmo's edit; moved they are the
        // panel's.
        let node = loaded.objects[0].node;
        let parts = (0..loaded.objects.len()).filter(|object| loaded.objects[*object].node == node);
        edits.extend(parts.map(|object| Edit::ObjectMoved {
            object,
            rotation: DQuat::IDENTITY,
            translation: DVec3::new(0.125, 0.25, -0.5),
        }));
        if let Some(intensity) = loaded.lights.first().map(|light| light.kind.strength()) {
            let double = Edit::LightIntensity {
                light: 0,
                intensity: RadiantIntensity(2.0 * intensity),
            };
            // A sun or a lamp with a surface is not asked here.
            edits.extend(double.apply(&loaded).is_ok().then_some(double));
        }
        let scene = edited(&loaded, &edits);
        match save(&target, &loaded, &scene, &LoadOptions::default()) {
            Ok(()) => saved += 1,
            Err(error) => {
                println!("{}: {error}", path.display());
                continue;
            }
        }
        let read = read(&target);
        let extent_m = scene.bounds().map_or(1.0, |(low, high)| (high - low).length());
        for (a, b) in read.objects.iter().zip(&scene.objects) {
            let shift = read.origin_world - scene.origin_world;
            let mut corners = a.mesh.positions.iter().zip(&b.mesh.positions);
            assert!(corners.all(|(a, b)| (*a + shift).distance(*b) < 1e-9 * extent_m));
        }
        assert_eq!(read.lights.len(), scene.lights.len());
        let [before, after] = [&path, &target].map(|path| -> Value {
            serde_json::from_str(scene_file::text_of(path).trim_end_matches(['\0', ' '])).expect("it is JSON")
        });
        for (name, value) in before.as_object().expect("an object") {
            assert!(
                TOUCHED.contains(&name.as_str()) || after[name] == *value,
                "{name} of {}",
                path.display()
            );
        }
    }
    println!("{saved} of {files} files saved");
    assert!(saved > files / 2, "{saved} of {files}");
}
