//! A scene that another program changes while the window is open.

use std::fs;
use std::sync::Arc;

use glam::DVec2;
use nephroid::scene::{Edit, MaterialEdit};
use nephroid::settings::Estimator;
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::files::FilesOptions;

use super::fixtures::{act, bake, change, folder, model, options, read, set, until};
use super::scene_file;

#[test]
fn camera_settings_and_edits_stay() {
    let folder = folder();
    let path = scene_file::gltf(folder.path(), "watched", "300");
    let mut model = model(&ViewerOptions {
        scene: Arc::new(read(&path)),
        files: FilesOptions {
            watch: true,
            ..FilesOptions::default()
        },
        ..options("ring")
    });
    let rough = Edit::Material(1, MaterialEdit::Roughness(0.25));
    act(&mut model, change(rough));
    model.navigator.look(DVec2::new(100.0, 30.0));
    set(&mut model, |it| {
        (it.settings.seed, it.settings.estimator) = (7, Estimator::Photon)
    });
    bake(&mut model);
    let (gaze, was) = (model.navigator.camera().forward, Arc::clone(model.scene()));

    // Half a file says what is wrong with it, and the scene stays.
    scene_file::break_off(&path);
    until(&mut model, "refused", |model| model.files.refusal.is_some());
    assert!(Arc::ptr_eq(model.scene(), &was));
    let sentence = model.files.refusal.clone().expect("it is refused");
    assert!(sentence.contains("watched.gltf"), "{sentence}");

    // The next change tries again: a lamp ten times as strong.
    scene_file::gltf(folder.path(), "watched", "3000");
    until(&mut model, "read again", |model| {
        !Arc::ptr_eq(model.scene(), &was)
    });
    assert!(model.files.refusal.is_none());
    let times = model.scene().lights[0].kind.strength() / was.lights[0].kind.strength();
    assert!((times - 10.0).abs() < 1e-9, "{times}");
    assert_eq!(model.scene().materials[1].roughness, 0.25, "the edit stays");
    assert_eq!(model.choices.settings.seed, 7);
    assert!(model.navigator.camera().forward.distance(gaze) < 1e-12);
    let [mesh, before] = [model.scene(), &was].map(|scene| scene.objects[0].mesh_in_scene());
    assert!(Arc::ptr_eq(mesh, before), "what is the same is shared");
    assert!(
        !model.maps().is_empty(),
        "shapes are the same, so that there is light meanwhile"
    );

    // So does a change of the buffer alone.
    let now = Arc::clone(model.scene());
    let buffer = folder.path().join("watched.bin");
    let mut bytes = fs::read(&buffer).expect("it is there");
    bytes[..4].copy_from_slice(&(-2.0_f32).to_le_bytes());
    fs::write(&buffer, bytes).expect("it is written");
    until(&mut model, "read again", |model| {
        !Arc::ptr_eq(model.scene(), &now)
    });
    assert_eq!(model.scene().objects[0].mesh_in_scene().positions[0].x, -2.0);
    // A material that is gone takes its edits with it.
    let text = fs::read_to_string(&path).expect("it is there");
    fs::write(&path, text.replace("\"silver\"", "\"gold\"")).expect("it is written");
    until(&mut model, "warned", |model| model.files.warning.is_some());
    let warning = model.files.warning.clone().expect("it is told");
    assert!(warning.contains("`silver`"), "{warning}");
    assert_eq!(model.edits().history().undoable(), 0);
}
