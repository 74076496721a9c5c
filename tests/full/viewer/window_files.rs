//! Scenes opened, dropped, kept, filmed and read again, in a real window.

use std::path::{Path, PathBuf};

use glam::DVec3;
use nephroid::scene::CameraPath;
use nephroid::viewer::files::config::ConfigFolder;
use serde_json::{Value, json};

use super::scene_file;
use support::desktop::{ALIKE, Screen, Viewer, difference, picture, position, wait_until};
use support::file_drop::drop_file;

/// Coarse enough to be baked in a second.
const COARSE: &str = "--density 300 --map-resolution 32";

/// The end of the bake of a scene that was opened under that name.
#[track_caller]
fn wait_for_scene(viewer: &mut Viewer<'_>, name: &str) {
    viewer.wait_for("opened", |opened| opened["scene"] == name);
    let (done, _) = viewer.wait_for_bake();
    assert!(done["maps"].as_u64() > Some(0), "{done}");
    assert!(viewer.title().contains(name), "{}", viewer.title());
}

#[test]
fn scenes_take_each_others_place() {
    let Some(screen) = Screen::start() else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &format!("builtin:slab {COARSE}"));
    viewer.wait_for_bake();
    let slab = viewer.screenshot();
    viewer.close();
    let mut viewer = Viewer::open(&screen, &format!("builtin:ring {COARSE}"));
    viewer.wait_for_bake();
    assert!(difference(&slab, &viewer.screenshot()) > 0.05);
    viewer.open_sections(&["Scene"]);

    // From a list, as many objects, lights and images, and others of each.
    viewer.click("Button", "Built-in");
    viewer.click("Button", "slab");
    wait_for_scene(&mut viewer, "slab");
    viewer.screenshot_that("of the slab as it is by itself", |shot| {
        difference(&slab, shot) < ALIKE
    });

    // By the path field, where a file is found beside the scene's own.
    let folder = tempfile::tempdir().expect("a folder");
    let second = scene_file::gltf(folder.path(), "second", "3000");
    let exposures = viewer.all("exposure").len();
    viewer.type_into("TextInput", "File", &second.display().to_string());
    wait_for_scene(&mut viewer, "second");
    assert!(viewer.all("exposure").len() > exposures, "it is measured anew");

    // By a drop.
    let third = scene_file::glb(folder.path(), "third scene", "300");
    drop_file(viewer.place(), &third.canonicalize().expect("it is there"));
    wait_for_scene(&mut viewer, "third scene");

    // What is no scene leaves what there is, and the window goes on.
    let broken = scene_file::no_scene(folder.path());
    viewer.type_into("TextInput", "File", &broken.display().to_string());
    let refused = viewer.wait_for("not_opened", |_| true);
    assert!(
        refused["sentence"].to_string().contains("broken.gltf"),
        "{refused}"
    );
    assert!(viewer.title().contains("third scene"), "{}", viewer.title());

    // Without a dialog to name it in, the scene is saved beside its file.
    viewer.click("Button", "Save scene…");
    let saved = viewer.wait_for("saved", |_| true);
    let path = saved["files"][0].as_str().expect("it is named");
    assert!(path.ends_with("third scene-edited-0001.glb"), "{saved}");
    let bytes = |path: &Path| std::fs::read(path).expect("it is there");
    assert_eq!(bytes(Path::new(path)), bytes(&third), "nothing was edited");
    viewer.close();
}

/// Bookmarks, settings and camera are found again after the program was killed; a file that changes is read again, and half
/// of one is not.
#[test]
fn killed_window_comes_back_and_watches() {
    let Some(screen) = Screen::start() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let config = folder.path().join("config");
    let path = scene_file::glb(folder.path(), "kept", "30");
    let source = path.display().to_string();
    let mut viewer = Viewer::open_with(&screen, &format!("{source} {COARSE}"), Some(&config));
    let (_, rest) = viewer.wait_for_bake();
    let marked = viewer.fly("w", position(&rest));
    viewer.hands("key ctrl+3");
    viewer.wait_for("bookmark", |event| event["kept"] == true);
    let last = viewer.fly("s", marked);
    viewer.click("CheckBox", "caustic");
    viewer.wait_for("settings", |event| {
        event["settings"]["layers"] == json!(["direct"])
    });
    viewer.wait_for("done", |_| true);
    // It is written within a second, or what that is on a busy machine.
    let kept = ConfigFolder::new(config.clone()).scene_file(&source);
    wait_until("what was set is kept", || {
        let kept = std::fs::read(&kept).ok()?;
        let kept: Value = serde_json::from_slice(&kept).ok()?;
        (kept["settings"]["layers"] == json!(["direct"])).then_some(())
    });
    viewer.signal("KILL");

    let arguments = format!("{source} --watch --exposure 0");
    let mut viewer = Viewer::open_with(&screen, &arguments, Some(&config));
    assert_eq!(viewer.all("found_again").len(), 1);
    let baking = &viewer.all("baking")[0];
    assert_eq!(baking["settings"]["layers"], json!(["direct"]), "{baking}");
    let found = position(&viewer.wait_for_bake().1);
    assert!(found.distance(last) < 1e-6, "{found}, {last}");
    viewer.hands("mousemove 900 300 key 3");
    viewer.wait_for("bookmark", |event| event["number"] == 3 && event["kept"] == false);
    let back = viewer.wait_for_move(found);
    assert!(back.distance(marked) < 1e-6, "{back}, {marked}");

    let mean = |shot: &image::RgbImage| {
        let sum: f64 = picture(shot).flat_map(|(.., rgb)| rgb.map(f64::from)).sum();
        sum / picture(shot).count() as f64
    };
    let dark = mean(&viewer.screenshot());
    scene_file::break_off(&path);
    let refused = viewer.wait_for("not_opened", |_| true);
    assert!(
        refused["sentence"]
            .as_str()
            .is_some_and(|sentence| !sentence.is_empty())
    );
    scene_file::glb(folder.path(), "kept", "3000");
    let opened = viewer.wait_for("opened", |_| true);
    assert_eq!(opened["again"], true, "{opened}");
    assert_eq!(position(&viewer.wait_for_bake().1), back, "the camera stays");
    viewer.screenshot_that("is brighter", |shot| mean(shot) > 2.0 * dark);
    viewer.close();
}

#[test]
fn path_is_recorded_played_and_filmed() {
    let Some(screen) = Screen::start() else {
        return;
    };
    let mut viewer = Viewer::open(&screen, "builtin:ring --density 1000 --map-resolution 64");
    let start = position(&viewer.wait_for_bake().1);
    viewer.hands("mousemove 900 300 key k");
    viewer.wait_for("recorded", |event| event["keys"] == 1);
    let end = viewer.fly("d", start);
    viewer.hands("key k");
    viewer.wait_for("recorded", |event| event["keys"] == 2);

    viewer.close_sections(&["Light pass", "Accuracy", "Display"]);
    viewer.open_sections(&["Camera path"]);
    viewer.click("Button", "Key 1: go");
    viewer.wait_for("rest", |event| position(event).distance(start) < 1e-9);
    viewer.type_into("SpinButton", "Frames", "4");
    viewer.click("Button", "Play");
    viewer.wait_for("plays", |_| true);
    viewer.wait_for("played", |_| true);
    viewer.wait_for("rest", |event| position(event).distance(end) < 1e-9);

    viewer.click("Button", "Save path");
    let path = |value: &Value| PathBuf::from(value.as_str().expect("a path"));
    let file = path(&viewer.wait_for("saved", |_| true)["files"][0]);
    let cameras = CameraPath::read(&file)
        .expect("render reads it")
        .cameras(DVec3::ZERO);
    assert_eq!(cameras.len(), 4);
    assert!(cameras[0].position.distance(start) < 1e-9 && cameras[3].position.distance(end) < 1e-9);

    viewer.click("Button", "Export frames");
    let folder = path(&viewer.wait_for("exported", |_| true)["path"]);
    let frame = |number: usize| image::open(folder.join(format!("frame-{number:05}.png")));
    let frames: Vec<_> = (1..=4)
        .map(|number| frame(number).expect("a PNG").to_rgb8())
        .collect();
    assert!(frame(5).is_err());
    assert_eq!(frames[0].dimensions(), (1280, 720));
    for pair in frames.windows(2) {
        let bright = pair[0].pixels().filter(|pixel| pixel.0[1] > 60).count();
        assert!(bright > 5000, "{bright} pixels of light");
        let moved = pair[0].pixels().zip(pair[1].pixels());
        let moved = moved.filter(|(a, b)| a.0[1].abs_diff(b.0[1]) > 20).count();
        assert!(moved > 1000, "{moved} pixels differ from frame to frame");
    }
    viewer.close();
}
