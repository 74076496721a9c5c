//! Objects and lights moved by the mouse in the real window, while the caustic follows.

use std::path::Path;

use glam::DVec3;
use nephroid::scene::builtin;
use nephroid::viewer::panel::WIDTH;

use super::desktop::{SIZE, Screen, Viewer};
use super::scene_file;
use super::window::{difference, pixel_of, screenshot_that};
use super::window_files::open_section;

const RING: [&str; 7] = [
    "builtin:ring",
    "--max-error",
    "10%",
    "--map-resolution",
    "128",
    "--layers",
    "caustic",
];

#[test]
fn an_object_is_picked_pulled_and_turned_and_a_lamp_is_placed() {
    let Some(screen) = Screen::start("viewer handles") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &RING);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let before = viewer.screenshot();

    // The inner wall that faces the eye.
    let (x, y) = pixel_of("ring", DVec3::new(0.0, 0.25, -1.0));
    viewer.hands(&format!(
        "mousemove {x} {y} sleep 0.3 mousedown 1 sleep 0.1 mouseup 1 sleep 0.3 mousemove 900 300"
    ));
    viewer.wait_for("picked", |event| event["name"] == "ring");
    let (x, y) = viewer.centre("Slider", "Move x");
    viewer.forget();
    viewer.hands(&format!(
        "mousemove {x} {y} sleep 1 mousedown 1 sleep 1 mousemove {} {y} sleep 0.2 mousemove {} {y}",
        x + 25,
        x + 50
    ));
    viewer.wait_for("edit", |edit| edit["target"] == "ObjectPlace(1)");
    // The mouse is still down.
    let maps = viewer.wait_for_maps();
    assert!(maps["maps"].as_u64() > Some(0), "{maps}");
    let moved = screenshot_that(&viewer, "shows it moved", |shot| difference(&before, shot) > 0.03);
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR"));
    moved
        .save(kept.join("handles.png"))
        .expect("it is kept to be looked at");
    viewer.hands("sleep 0.2 mouseup 1 sleep 0.3 mousemove 900 300");
    viewer.wait_for("done", |_| true);
    // One pull is one step back; Esc takes the handles away.
    viewer.forget();
    viewer.hands("key ctrl+z");
    viewer.wait_for("undone", |_| true);
    viewer.wait_for("done", |_| true);
    viewer.hands("key Escape");
    screenshot_that(&viewer, "is as before", |shot| difference(&before, shot) < 0.01);

    // The lamp over another place of the floor, as high as before.
    viewer.click("Button", "Place light");
    let points = [(-0.3, 0.5), (0.3, 0.5), (0.45, 0.3)].map(|(x, z)| pixel_of("ring", DVec3::new(x, 0.0, z)));
    let [(x0, y0), (x1, y1), (x2, y2)] = points;
    viewer.forget();
    viewer.hands(&format!(
        "mousemove {x0} {y0} sleep 0.3 mousedown 1 sleep 1 mousemove {x1} {y1} sleep 1 mousemove {x2} {y2}"
    ));
    viewer.wait_for("edit", |edit| edit["target"] == "LightPosition(0)");
    viewer.wait_for_maps();
    viewer.hands("sleep 1 mouseup 1 sleep 0.3 mousemove 1200 650");
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let placed = screenshot_that(&viewer, "has another caustic", |shot| {
        difference(&before, shot) > 0.05
    });
    placed
        .save(kept.join("placed.png"))
        .expect("it is kept to be looked at");
    viewer.forget();
    viewer.hands("key ctrl+z");
    viewer.wait_for("undone", |_| true);
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

/// A file without light, as a person meets it: the program's sun, a light of one's own, turned, removed and brought back, and
/// why it is bright where it is brightest.
#[test]
fn who_opens_a_dark_file_lights_it_and_finds_the_brightest_spot() {
    let Some(screen) = Screen::start("viewer dark file") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let dark = scene_file::glb(folder.path(), "dark", "0").display().to_string();
    let mut viewer = Viewer::open(&screen, &[&dark, "--max-error", "20%", "--map-resolution", "64"]);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let under_sun = viewer.screenshot();
    open_section(&viewer);
    viewer.forget();
    viewer.click("Button", "Add spot");
    viewer.wait_for("edit", |edit| edit["target"] == "LightList");
    viewer.wait_for("picked", |event| event["name"] == "spot");
    viewer.wait_for("done", |_| true);
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let lit = screenshot_that(&viewer, "shows its light", |shot| {
        difference(&under_sun, shot) > 0.03
    });
    lit.save(kept.join("lit.png"))
        .expect("it is kept to be looked at");

    viewer.click("Button", "Aim light");
    let (x, y) = ((WIDTH as u32 + SIZE.0) / 2, SIZE.1 / 2);
    viewer.forget();
    viewer.hands(&format!(
        "mousemove {x} {y} sleep 1 mousedown 1 sleep 1 mousemove {x} {} sleep 1 mouseup 1",
        y + 40
    ));
    viewer.wait_for("edit", |edit| edit["target"] == "LightDirection(1)");
    viewer.wait_for("done", |_| true);

    viewer.forget();
    viewer.click("Button", "Remove light");
    viewer.wait_for("edit", |edit| edit["target"] == "LightList");
    viewer.wait_for("done", |_| true);
    viewer.forget();
    viewer.hands("key ctrl+z");
    viewer.wait_for("undone", |undone| undone["what"] == "removal of `spot`");
    viewer.wait_for("done", |_| true);

    viewer.hands("key p");
    viewer.forget();
    for what in ["hits", "patches"] {
        viewer.click("CheckBox", what);
    }
    let sketched = viewer.wait_for("sketched", |_| true);
    assert!(sketched["landings"].as_u64() > Some(0), "{sketched}");
    assert!(sketched["patches"].as_u64() > Some(0), "{sketched}");
    viewer.forget();
    viewer.click("Button", "Brightest spot");
    let told = viewer.wait_for("probe", |told| told["paths"].is_array());
    let texel = &told["texel"];
    assert!(texel["illuminance_lx"].as_f64() > Some(0.0), "{told:#}");
    let shares = told["paths"].as_array().into_iter().flatten();
    let sum: f64 = shares.filter_map(|path| path["share"].as_f64()).sum();
    assert!((sum - 1.0).abs() < 0.05, "{told:#}");
    viewer.wait_for("rest", |_| true);
    let shot = viewer.screenshot();
    shot.save(kept.join("brightest.png"))
        .expect("it is kept to be looked at");
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(stderr.contains("the scene has no light, so a sun"), "{stderr}");
}

const BALL: [&str; 7] = [
    "builtin:ball",
    "--density",
    "20000",
    "--map-resolution",
    "64",
    "--layers",
    "caustic",
];

/// What is clicked in the picture is what the panel changes; and more rays are traced where more are asked for.
#[test]
fn glass_is_picked_and_bends_light_otherwise_and_the_density_is_dragged() {
    let Some(screen) = Screen::start("viewer index") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &BALL);
    let first = viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let before = viewer.screenshot();
    let scene = builtin::build("ball").expect("it is built in");
    let glass = scene.objects.iter().find(|object| object.name == "ball");
    let (low, high) = glass
        .and_then(|glass| glass.mesh.bounds())
        .expect("it has corners");
    let (x, y) = pixel_of("ball", 0.5 * (low + high));
    viewer.hands(&format!(
        "mousemove {x} {y} sleep 0.3 mousedown 1 sleep 0.1 mouseup 1 sleep 0.3"
    ));
    viewer.wait_for("picked", |event| event["name"] == "ball");
    viewer.hands("mousemove 900 300");
    viewer.centre("Slider", "Refractive index");
    let [(x0, y), (x1, _)] = [0.25, 0.6].map(|share| viewer.on_slider("Refractive index", share));
    viewer.forget();
    viewer.hands(&format!(
        "mousemove {x0} {y} sleep 1 mousedown 1 sleep 1 mousemove {x1} {y} sleep 1 mouseup 1 sleep 1 \\
         mousemove 900 300"
    ));
    viewer.wait_for("edit", |edit| {
        edit["target"]
            .as_str()
            .is_some_and(|target| target.starts_with("MaterialIor"))
    });
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let bent = screenshot_that(&viewer, "bends otherwise", |shot| {
        difference(&before, shot) > 0.01
    });
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR"));
    bent.save(kept.join("bent.png"))
        .expect("it is kept to be looked at");

    viewer.centre("Slider", "Ray density [rays/sr]");
    let [(x0, y), (x1, _)] = [0.2, 0.3].map(|share| viewer.on_slider("Ray density [rays/sr]", share));
    viewer.forget();
    viewer.hands(&format!(
        "mousemove {x0} {y} sleep 1 mousedown 1 sleep 1 mousemove {x1} {y} sleep 1 mouseup 1 sleep 1 \\
         mousemove 900 300"
    ));
    let density = |event: &serde_json::Value| event["settings"]["density_per_sr"].as_f64();
    let set = viewer.wait_for("settings", |set| density(set) > density(&first));
    let done = viewer.wait_for("done", |done| density(done) >= density(&set));
    assert!(done["rays"].as_u64() > Some(0), "{done}");
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
}
