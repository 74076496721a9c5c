//! What is kept of scenes, without a window.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec2;
use nephroid::scene::changes::Changes;
use nephroid::scene::{Edit, builtin};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::units::RadiantIntensity;
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::files::FilesOptions;
use nephroid::viewer::files::config::ConfigFolder;
use nephroid::viewer::files::keeper::SOON;
use nephroid::viewer::files::loader::Purpose;
use nephroid::viewer::model::Model;
use nephroid::viewer::navigation::Travel;
use nephroid::viewer::panel::Wishes;

use super::scene_file;

const PATIENCE: Duration = Duration::from_secs(120);

fn options(config: &Path) -> ViewerOptions {
    ViewerOptions {
        scene: Arc::new(builtin::build("ring").expect("it is built in")),
        settings: BakeSettings {
            density_per_sr: 300.0,
            map_resolution: MapResolution::Fixed {
                width: 16,
                height: 16,
            },
            layers: vec![LayerKind::Caustic],
            ..BakeSettings::splat()
        },
        maps: None,
        size: (640, 480),
        camera: None,
        exposure_stops: None,
        stop: None,
        event_log: None,
        files: FilesOptions {
            config: Some(ConfigFolder::new(config.to_owned())),
            ..FilesOptions::default()
        },
    }
}

fn model(options: &ViewerOptions) -> Model {
    Model::new(options, || ()).expect("threads are to be had")
}

/// A camera elsewhere, two bookmarks, a setting and an edit.
fn use_it(model: &mut Model) {
    model.navigator.look(DVec2::new(100.0, 30.0));
    assert!(model.navigator.set_bookmark(0));
    model.navigator.look(DVec2::new(40.0, 0.0));
    assert!(model.navigator.set_bookmark(8));
    model.travel(Travel::Orbit);
    model.panel.settings.seed = 7;
    model.panel.display.exposure_stops = 1.5;
    let wishes = Wishes {
        edit: Some(Edit::LightIntensity {
            light: 0,
            intensity: RadiantIntensity(5.0),
        }),
        ..Wishes::default()
    };
    model.act(&wishes, Instant::now());
}

fn is_near(a: &Model, b: &Model) -> bool {
    let (a, b) = (a.navigator.camera(), b.navigator.camera());
    a.position.distance(b.position) < 1e-9 && a.forward.distance(b.forward) < 1e-9
}

#[test]
fn what_was_set_is_found_again_and_edits_can_be_taken_back() {
    let config = tempfile::tempdir().expect("a folder");
    let options = options(config.path());
    let mut first = model(&options);
    use_it(&mut first);
    // At the end everything is written, however little time passed.
    let Changes { changes, lost } = Changes::between(first.edits().loaded(), first.edits().scene());
    assert_eq!((changes.len(), lost.len()), (1, 0));
    let was = (first.navigator.views(), first.panel.settings.clone());
    let scene = Arc::clone(first.scene());
    drop(first);

    let mut second = model(&options);
    assert_eq!(second.panel.settings, was.1);
    assert!((second.panel.display.exposure_stops - 1.5).abs() < 1e-12);
    assert!(second.keeps_exposure());
    assert_eq!(second.navigator.travel(), Travel::Orbit);
    assert_eq!(second.scene().lights, scene.lights);
    assert_eq!(second.edits().history().undoable(), 1);
    let views = second.navigator.views();
    for (kept, found) in was.0.bookmarks.iter().zip(&views.bookmarks) {
        assert_eq!(kept.is_some(), found.is_some());
    }
    assert!(second.navigator.go_to_bookmark(0) && second.navigator.go_to_bookmark(8));
    assert!(!second.navigator.go_to_bookmark(4));
    let undo = Wishes {
        undo: true,
        ..Wishes::default()
    };
    second.act(&undo, Instant::now());
    assert_eq!(second.scene().lights, second.edits().loaded().lights);

    // Another scene has nothing of it.
    let other = ViewerOptions {
        scene: Arc::new(builtin::build("slab").expect("it is built in")),
        ..options.clone()
    };
    assert!(!model(&other).keeps_exposure());
}

#[test]
fn who_asks_for_something_gets_that_and_fresh_leaves_what_was_kept_alone() {
    let config = tempfile::tempdir().expect("a folder");
    let options = options(config.path());
    let mut first = model(&options);
    use_it(&mut first);
    let moved = first;
    let asked = ViewerOptions {
        exposure_stops: Some(-2.0),
        files: FilesOptions {
            settings_given: true,
            ..options.files.clone()
        },
        ..options.clone()
    };
    let untouched = model(&ViewerOptions {
        files: FilesOptions {
            config: None,
            ..options.files.clone()
        },
        ..options.clone()
    });
    drop(moved);
    let mut second = model(&asked);
    assert_eq!(second.panel.settings, options.settings);
    assert!((second.panel.display.exposure_stops + 2.0).abs() < 1e-12);
    assert_eq!(
        second.edits().history().undoable(),
        1,
        "edits were not asked away"
    );
    // Who only looks around with other settings, or at other maps, takes none of what was kept away.
    second.navigator.look(DVec2::new(5.0, 5.0));
    second.act(&Wishes::default(), Instant::now());
    drop(second);
    let maps = ViewerOptions {
        maps: Some(Vec::new()),
        ..options.clone()
    };
    let mut looking = model(&maps);
    assert_eq!(looking.edits().history().undoable(), 0);
    looking.navigator.look(DVec2::new(5.0, 5.0));
    looking.act(&Wishes::default(), Instant::now());
    drop(looking);
    let again = model(&options);
    assert_eq!(again.edits().history().undoable(), 1);
    assert_eq!(again.panel.settings.seed, 7);
    drop(again);

    let fresh = ViewerOptions {
        files: FilesOptions {
            fresh: true,
            ..options.files.clone()
        },
        ..options.clone()
    };
    let third = model(&fresh);
    assert_eq!(third.edits().history().undoable(), 0);
    assert!(is_near(&third, &untouched));
    drop(third);
    assert_eq!(
        model(&options).edits().history().undoable(),
        1,
        "nothing was changed, nothing is lost"
    );
}

#[test]
fn a_change_is_written_within_a_second_while_the_window_goes_on() {
    let config = tempfile::tempdir().expect("a folder");
    let options = options(config.path());
    let file = ConfigFolder::new(config.path().to_owned()).scene_file("builtin:ring");
    let mut model = model(&options);
    let now = Instant::now();
    model.act(&Wishes::default(), now);
    assert!(!file.exists(), "nothing changed");
    model.panel.settings.seed = 1;
    model.act(&Wishes::default(), now);
    assert!(model.due().is_some_and(|due| due <= now + SOON));
    // Changing on does not put it off.
    for tenth in 1..=10 {
        model.panel.settings.seed = 10 + tenth;
        model.act(&Wishes::default(), now + SOON * tenth as u32 / 10);
    }
    let start = Instant::now();
    while !file.exists() {
        assert!(start.elapsed() < PATIENCE, "it is never written");
        std::thread::sleep(Duration::from_millis(2));
    }
    let text = fs::read_to_string(&file).expect("it is there");
    let kept: serde_json::Value = serde_json::from_str(&text).expect("it is whole");
    assert_eq!(kept["settings"]["seed"], 20);
    assert_eq!(kept["source"], "builtin:ring");
}

#[test]
fn a_broken_file_is_set_aside_with_a_sentence_and_never_overwritten() {
    let config = tempfile::tempdir().expect("a folder");
    let options = options(config.path());
    let file = ConfigFolder::new(config.path().to_owned()).scene_file("builtin:ring");
    fs::create_dir_all(file.parent().expect("a folder")).expect("it is made");
    for text in ["{ \"settings\": ", "[1, 2]", "\u{0}\u{1}", "{\"views\": 3}"] {
        fs::write(&file, text).expect("it is written");
        let mut model = model(&options);
        let warning = model.files.warning.clone().expect("it is told");
        assert!(
            warning.contains("renamed to") && warning.lines().count() == 1,
            "{warning}"
        );
        use_it(&mut model);
    }
    let aside = fs::read_dir(file.parent().expect("a folder")).expect("it is there");
    let names: Vec<String> = aside
        .map(|entry| {
            entry
                .expect("it is there")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    let broken = names.iter().filter(|name| name.contains(".broken-")).count();
    assert_eq!((broken, names.len()), (4, 5), "{names:?}");
}

#[test]
fn settings_of_another_version_are_taken_as_far_as_they_are_known() {
    let config = tempfile::tempdir().expect("a folder");
    let options = options(config.path());
    let mut first = model(&options);
    use_it(&mut first);
    drop(first);
    let file = ConfigFolder::new(config.path().to_owned()).scene_file("builtin:ring");
    let text = fs::read_to_string(&file).expect("it is there");
    let mut kept: serde_json::Value = serde_json::from_str(&text).expect("it is whole");
    kept["settings"]["max_depth"] = "many".into();
    kept["settings"]["invented"] = 1.into();
    kept["settings"].as_object_mut().expect("names").remove("kernel");
    kept["invented"] = true.into();
    fs::write(&file, kept.to_string()).expect("it is written");
    let second = model(&options);
    assert!(second.files.warning.is_none(), "{:?}", second.files.warning);
    assert_eq!(second.panel.settings.seed, 7);
    assert_eq!(second.panel.settings.max_depth, options.settings.max_depth);
}

fn until(model: &mut Model, what: &str, is_so: impl Fn(&Model) -> bool) {
    let start = Instant::now();
    while !is_so(model) {
        model.poll_files();
        model.poll();
        model.act(&Wishes::default(), Instant::now());
        assert!(start.elapsed() < PATIENCE, "never {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_watched_scene_is_read_again_and_camera_settings_and_edits_stay() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = scene_file::gltf(folder.path(), "watched", "300");
    let scene = nephroid::scene::load(&path.display().to_string(), &Default::default());
    let options = ViewerOptions {
        scene: Arc::new(scene.expect("it is read")),
        files: FilesOptions {
            watch: true,
            ..FilesOptions::default()
        },
        ..options(folder.path())
    };
    let mut model = model(&options);
    let rough = Wishes {
        edit: Some(Edit::MaterialRoughness {
            material: 1,
            roughness: 0.25,
        }),
        ..Wishes::default()
    };
    model.act(&rough, Instant::now());
    model.navigator.look(DVec2::new(100.0, 30.0));
    model.panel.settings.seed = 7;
    until(&mut model, "baked", |model| {
        !model.state().is_baking() && !model.maps().is_empty()
    });
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
    assert_eq!(model.panel.settings.seed, 7);
    assert!(model.navigator.camera().forward.distance(gaze) < 1e-12);
    assert!(
        Arc::ptr_eq(&model.scene().objects[0].mesh, &was.objects[0].mesh),
        "what is the same is shared"
    );
    assert!(
        !model.maps().is_empty(),
        "shapes are the same, so that there is light meanwhile"
    );

    // So does a change of the buffer alone; an object that is gone takes its edits with it.
    let bytes = fs::read(folder.path().join("watched.bin")).expect("it is there");
    let now = Arc::clone(model.scene());
    let mut lower = bytes;
    lower[..4].copy_from_slice(&(-2.0_f32).to_le_bytes());
    fs::write(folder.path().join("watched.bin"), lower).expect("it is written");
    until(&mut model, "read again", |model| {
        !Arc::ptr_eq(model.scene(), &now)
    });
    assert_eq!(model.scene().objects[0].mesh.positions[0].x, -2.0);
    let text = fs::read_to_string(&path)
        .expect("it is there")
        .replace("\"silver\"", "\"gold\"");
    fs::write(&path, text).expect("it is written");
    until(&mut model, "warned", |model| model.files.warning.is_some());
    let warning = model.files.warning.clone().expect("it is told");
    assert!(warning.contains("`silver`"), "{warning}");
    assert_eq!(model.edits().history().undoable(), 0);
}

#[test]
fn a_scene_that_is_left_is_kept_and_found_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let options = options(folder.path());
    let mut model = model(&options);
    use_it(&mut model);
    model.open("builtin:slab");
    until(&mut model, "opened", |model| model.scene().name == "slab");
    assert_eq!(model.edits().history().undoable(), 0);
    assert_eq!(
        model.panel.settings.seed, 7,
        "a new scene is baked as the one before"
    );
    model.open("builtin:ring");
    until(&mut model, "opened", |model| model.scene().name == "ring");
    assert_eq!(model.edits().history().undoable(), 1);
    assert_eq!(model.navigator.travel(), Travel::Orbit);
    assert_eq!(model.poll_files(), None::<Purpose>);
}
