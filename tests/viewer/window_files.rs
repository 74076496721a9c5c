//! Scenes opened, dropped, kept and read again, in a real window.

use std::time::Duration;

use image::RgbImage;
use nephroid::viewer::panel::WIDTH;

use super::desktop::{Screen, Viewer};
use super::drop::drop_file;
use super::scene_file;
use super::window::{ALIKE, difference};

/// Coarse enough to be baked in a second.
const COARSE: [&str; 4] = ["--density", "300", "--map-resolution", "32"];

fn name(event: &serde_json::Value) -> &str {
    event["scene"].as_str().unwrap_or_default()
}

#[test]
fn scenes_are_opened_by_argument_by_path_and_by_drop_and_a_broken_one_is_refused() {
    let Some(screen) = Screen::start("viewer files") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let first = scene_file::glb(folder.path(), "first", "300");
    let second = scene_file::gltf(folder.path(), "second", "3000");
    let first = first.display().to_string();
    let mut viewer = Viewer::open(&screen, &[&[first.as_str()], &COARSE[..]].concat());
    viewer.wait_for("done", |done| done["maps"].as_u64() > Some(0));
    viewer.wait_for("rest", |_| true);
    let title = || screen.title_of(&viewer);
    assert!(title().contains("first"), "{}", title());
    keep(&viewer, "first");

    // By the path field.
    let exposures = viewer.all("exposure").len();
    open_section(&viewer);
    viewer.type_into("TextInput", "File", &second.display().to_string());
    let opened = viewer.wait_for("opened", |_| true);
    assert_eq!(name(&opened), "second", "{opened}");
    viewer.wait_for("done", |done| done["maps"].as_u64() > Some(0));
    viewer.wait_for("rest", |_| true);
    assert!(viewer.all("exposure").len() > exposures, "it is measured anew");
    assert!(screen.title_of(&viewer).contains("second"));
    keep(&viewer, "second");

    // By a drop.
    let third = scene_file::glb(folder.path(), "third scene", "300");
    drop_file(
        viewer.display(),
        viewer.window(),
        &third.canonicalize().expect("it is there"),
    );
    let opened = viewer.wait_for("opened", |_| true);
    assert_eq!(name(&opened), "third scene", "{opened}");
    viewer.wait_for("done", |done| done["maps"].as_u64() > Some(0));
    viewer.wait_for("rest", |_| true);

    // What is no scene leaves what there is, and the window goes on.
    let broken = scene_file::no_scene(folder.path()).display().to_string();
    viewer.type_into("TextInput", "File", &broken);
    let refused = viewer.wait_for("not_opened", |_| true);
    assert!(
        refused["sentence"]
            .as_str()
            .is_some_and(|sentence| sentence.contains("broken.gltf")),
        "{refused}"
    );
    std::thread::sleep(Duration::from_secs(1));
    assert!(screen.title_of(&viewer).contains("third scene"));
    keep(&viewer, "refused");

    // Without a dialog to name it in, the scene is saved beside its file.
    viewer.click("Button", "Save scene…");
    let saved = viewer.wait_for("saved", |_| true);
    let path = saved["files"][0].as_str().expect("it is named");
    assert!(path.ends_with("third scene-edited-0001.glb"), "{saved}");
    let bytes = |path: &str| std::fs::read(path).expect("it is there");
    assert_eq!(
        bytes(path),
        bytes(&third.display().to_string()),
        "nothing was edited"
    );
    keep(&viewer, "saved");

    // A list of the built-in scenes, with other objects and lights than before.
    viewer.click("Button", "Built-in");
    viewer.click("Button", "slab");
    viewer.wait_for("opened", |opened| name(opened) == "slab");
    viewer.wait_for("done", |done| done["maps"].as_u64() > Some(0));
    viewer.wait_for("rest", |_| true);
    keep(&viewer, "slab");
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn a_window_closes_while_it_reads_and_while_it_bakes() {
    let Some(screen) = Screen::start("viewer closed early") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &["builtin:ring", "--density", "3e7"]);
    open_section(&viewer);
    viewer.type_into("TextInput", "File", "builtin:showroom");
    viewer.wait_for("opening", |_| true);
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn a_scene_that_took_the_place_of_another_looks_as_it_does_by_itself() {
    let Some(screen) = Screen::start("viewer changes scenes") else {
        return;
    };
    let picture = |viewer: &mut Viewer<'_>| {
        viewer.wait_for("done", |done| done["maps"].as_u64() > Some(0));
        viewer.wait_for("rest", |_| true);
        // What the log tells takes a moment to reach the screen.
        std::thread::sleep(Duration::from_secs(1));
        viewer.screenshot()
    };
    // As many objects, lights and images, and others of each.
    let arguments = [&["builtin:ring"], &COARSE[..]].concat();
    let mut viewer = Viewer::open(&screen, &arguments);
    let ring = picture(&mut viewer);
    open_section(&viewer);
    viewer.type_into("TextInput", "File", "builtin:slab");
    viewer.wait_for("opened", |opened| name(opened) == "slab");
    let changed = picture(&mut viewer);
    keep(&viewer, "changed");
    assert!(difference(&ring, &changed) > 0.05, "it is another scene");
    drop(viewer);
    let arguments = [&["builtin:slab"], &COARSE[..]].concat();
    let mut viewer = Viewer::open(&screen, &arguments);
    let fresh = picture(&mut viewer);
    let differs = difference(&fresh, &changed);
    assert!(differs < ALIKE, "{differs} of the picture differs");
}

/// Opens the first section, which stands so high that it need not be scrolled to.
pub fn open_section(viewer: &Viewer<'_>) {
    let [left, top, _, bottom] = viewer.control("Scene", |role, name| {
        role == "DisclosureTriangle" && name == "Scene"
    });
    let (x, y) = (left + 20.0, 0.5 * (top + bottom));
    viewer.hands(&format!("mousemove {x:.0} {y:.0} sleep 0.3 click 1 sleep 0.3"));
}

/// Mean of the picture's channels, the panel left out.
fn mean(shot: &RgbImage) -> f64 {
    let pixels = shot.enumerate_pixels().filter(|(x, ..)| *x >= WIDTH as u32);
    let values: Vec<f64> = pixels
        .map(|(_, _, pixel)| pixel.0.map(f64::from).iter().sum())
        .collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn position(rest: &serde_json::Value) -> [f64; 3] {
    [0, 1, 2].map(|axis| rest["position_m"][axis].as_f64().expect("a number"))
}

#[test]
fn bookmarks_settings_and_camera_are_found_again_after_the_program_was_killed() {
    let Some(screen) = Screen::start("viewer killed") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let config = folder.path().join("config");
    let path = scene_file::glb(folder.path(), "kept", "300")
        .display()
        .to_string();
    let mut viewer = Viewer::open_with(&screen, &[&[path.as_str()], &COARSE[..]].concat(), Some(&config));
    viewer.wait_for("done", |_| true);
    let start = position(&viewer.wait_for("rest", |_| true));
    viewer.hands("mousemove 900 300 keydown w sleep 0.4 keyup w");
    let marked = position(&viewer.wait_for("rest", |rest| position(rest) != start));
    viewer.hands("key ctrl+3");
    viewer.wait_for("bookmark", |event| event["kept"] == true);
    viewer.hands("keydown s sleep 0.7 keyup s");
    let last = position(&viewer.wait_for("rest", |rest| position(rest) != marked));
    viewer.click("CheckBox", "caustic");
    viewer.wait_for("settings", |event| {
        event["settings"]["layers"] == serde_json::json!(["direct"])
    });
    viewer.wait_for("done", |_| true);
    // A second, as promised, and what a busy machine needs to write.
    std::thread::sleep(Duration::from_secs(3));
    viewer.signal("KILL");

    let mut viewer = Viewer::open_with(&screen, &[path.as_str()], Some(&config));
    assert_eq!(viewer.all("found_again").len(), 1);
    let baking = &viewer.all("baking")[0];
    assert_eq!(
        baking["settings"]["layers"],
        serde_json::json!(["direct"]),
        "{baking}"
    );
    viewer.wait_for("done", |_| true);
    let found = position(&viewer.wait_for("rest", |_| true));
    let is_at = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(is_at(found, last), "{found:?}, {last:?}");
    viewer.hands("mousemove 900 300 key 3");
    viewer.wait_for("bookmark", |event| event["number"] == 3 && event["kept"] == false);
    let back = position(&viewer.wait_for("rest", |rest| position(rest) != found));
    assert!(is_at(back, marked), "{back:?}, {marked:?}");
    keep(&viewer, "found-again");
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
}

#[test]
fn a_watched_file_is_read_again_and_half_a_file_is_not() {
    let Some(screen) = Screen::start("viewer watches") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = scene_file::glb(folder.path(), "watched", "30");
    let source = path.display().to_string();
    let arguments = [&[source.as_str(), "--watch", "--exposure", "0"], &COARSE[..]].concat();
    let mut viewer = Viewer::open(&screen, &arguments);
    viewer.wait_for("done", |_| true);
    let before = position(&viewer.wait_for("rest", |_| true));
    viewer.hands("mousemove 900 300 keydown w sleep 0.3 keyup w");
    let place = position(&viewer.wait_for("rest", |rest| position(rest) != before));
    let dark = mean(&viewer.screenshot());
    scene_file::break_off(&path);
    let refused = viewer.wait_for("not_opened", |_| true);
    assert!(
        refused["sentence"]
            .as_str()
            .is_some_and(|sentence| !sentence.is_empty())
    );
    keep(&viewer, "half");
    scene_file::glb(folder.path(), "watched", "3000");
    let opened = viewer.wait_for("opened", |_| true);
    assert_eq!(opened["again"], true, "{opened}");
    viewer.wait_for("done", |_| true);
    assert_eq!(
        position(&viewer.wait_for("rest", |_| true)),
        place,
        "the camera stays"
    );
    std::thread::sleep(Duration::from_secs(1));
    let bright = mean(&viewer.screenshot());
    assert!(bright > 2.0 * dark, "{bright} after {dark}");
    keep(&viewer, "read-again");
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
}

/// Keeps a screenshot to be looked at, where somebody asks for it.
fn keep(viewer: &Viewer<'_>, name: &str) {
    if let Some(folder) = std::env::var_os("NEPHROID_TEST_PICTURES") {
        let path = std::path::Path::new(&folder).join(format!("files-{name}.png"));
        viewer.screenshot().save(path).expect("it is written");
    }
}
