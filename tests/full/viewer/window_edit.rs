//! Objects and lights moved by the mouse in the real window, while the caustic follows.

use glam::DVec3;
use image::RgbImage;
use nephroid::scene::builtin;
use serde_json::Value;

use support::desktop::{ALIKE, Screen, Viewer, difference, picture, pixel_of};
use support::or_skip;

/// The caustic alone, refined until its error is small: several levels, and a bake of seconds, so that no window is so slow
/// that it sees the last maps only.
const REFINED: &str =
    "builtin:ring --error-metric rmse --max-error 0.05% --map-resolution 128 --layers caustic";

/// Takes the last change back.
fn undo(viewer: &mut Viewer<'_>) {
    viewer.forget();
    viewer.hands("key ctrl+z");
    viewer.wait_for("undone", |_| true);
    viewer.wait_for("done", |_| true);
}

fn is_edit_of(target: &str) -> impl Fn(&Value) -> bool {
    move |edit| {
        edit["target"]
            .as_str()
            .is_some_and(|found| found.starts_with(target))
    }
}

#[test]
fn handles_and_lamps_are_pulled_and_undone() {
    let screen = or_skip!(Screen::start());
    let mut viewer = Viewer::open(&screen, REFINED);
    let (done, _) = viewer.wait_for_bake();
    assert!(
        done["level"].as_u64() > Some(1),
        "the last maps are not the first: {done}"
    );
    let error = done["error"].as_f64().expect("it is estimated");
    assert!(error > 0.0 && error <= 0.000_5, "{done}");
    let before = viewer.screenshot();

    // The inner wall that faces the eye.
    viewer.click_at(pixel_of("ring", DVec3::new(0.0, 0.25, -1.0)));
    viewer.wait_for("picked", |event| event["name"] == "ring");
    let (x, y) = viewer.centre("Slider", "Move x");
    viewer.pull(&[(x, y), (x + 25, y), (x + 50, y)]);
    viewer.wait_for("edit", is_edit_of("ObjectPlace(1)"));
    // The mouse is still down.
    let maps = viewer.wait_for_maps();
    assert!(maps["maps"].as_u64() > Some(0), "{maps}");
    viewer.screenshot_that("shows it moved", |shot| difference(&before, shot) > 0.03);
    viewer.let_go();
    viewer.wait_for("done", |_| true);
    // One pull is one step back; Esc takes the handles away.
    undo(&mut viewer);
    viewer.hands("key Escape");
    viewer.screenshot_that("is as before", |shot| difference(&before, shot) < 0.01);

    // The lamp over another place of the floor, as high as before: coarse maps are shown before the last ones.
    viewer.click("Button", "Place light");
    let floor = [(-0.3, 0.5), (0.3, 0.5), (0.45, 0.3)];
    viewer.pull(&floor.map(|(x, z)| pixel_of("ring", DVec3::new(x, 0.0, z))));
    viewer.wait_for("edit", is_edit_of("LightPosition(0)"));
    let level = viewer.wait_for("level", |level| level["shown"] == true);
    assert!(level["maps"].as_u64() > Some(0), "{level}");
    viewer.let_go();
    viewer.wait_for("done", |done| {
        done["request"].as_u64() >= level["request"].as_u64()
    });
    viewer.screenshot_that("has another caustic", |shot| difference(&before, shot) > 0.05);
    undo(&mut viewer);

    // Four times the power, at the place where the mouse is held: no ray is traced for it.
    viewer.open_sections(&["Scene"]);
    viewer.centre("Slider", "Intensity [W/sr]");
    let slider = viewer.on_slider("Intensity [W/sr]", [0.5, 0.65]);
    viewer.pull(&slider);
    viewer.wait_for("edit", is_edit_of("LightPower(0)"));
    let done = viewer.wait_for("done", |_| true);
    assert_eq!(done["rays"].as_u64(), Some(0), "{done}");
    let uploaded = viewer.wait_for("upload", |upload| upload["tiles"].as_u64() > Some(0));
    assert!(
        uploaded["tiles"].as_u64() <= Some(7),
        "two by two tiles, and one on each of three coarser levels: {uploaded}"
    );
    viewer.screenshot_that("is brighter", |shot| difference(&before, shot) > 0.05);
    viewer.let_go();
    undo(&mut viewer);
    viewer.screenshot_that("is as before", |shot| difference(&before, shot) < ALIKE);

    viewer.close();
}

/// What is clicked in the picture is what is told of, and what the panel changes.
#[test]
fn glass_ball_is_probed_and_bends_otherwise() {
    let screen = or_skip!(Screen::start());
    let mut viewer = Viewer::open(
        &screen,
        "builtin:ball --max-error 2% --map-resolution 128 --layers caustic,direct",
    );
    viewer.wait_for_bake();
    probe(&mut viewer);
    viewer.hands("key p");

    let scene = builtin::build("ball").expect("it is built in");
    let glass = scene.objects.iter().find(|object| object.name == "ball");
    let (low, high) = glass
        .and_then(|glass| glass.mesh_in_scene().bounds())
        .expect("it has corners");
    viewer.click_at(pixel_of("ball", 0.5 * (low + high)));
    viewer.wait_for("picked", |event| event["name"] == "ball");
    viewer.centre("Slider", "Refractive index");
    let before = viewer.screenshot();
    let slider = viewer.on_slider("Refractive index", [0.25, 0.6]);
    viewer.pull(&slider);
    viewer.wait_for("edit", is_edit_of("MaterialIor"));
    viewer.let_go();
    viewer.wait_for("done", |_| true);
    viewer.screenshot_that("bends otherwise", |shot| difference(&before, shot) > 0.01);
    viewer.close();
}

/// A click on the floor under the glass ball tells what lights it there, and draws the way of the light through the ball.
fn probe(viewer: &mut Viewer<'_>) {
    let before = viewer.screenshot();
    let point = DVec3::new(0.2, 0.0, 0.1);
    let (x, y) = pixel_of("ball", point);
    viewer.hands("key p");
    viewer.click_at((x, y));
    let probe = viewer.wait_for("probe", |_| true);
    assert_eq!(probe["surface"], "floor", "{probe}");
    let number = |value: &Value| value.as_f64().expect("a number");
    for axis in 0..3 {
        // Half a pixel of a picture of 700 or so.
        assert!(
            (number(&probe["position_m"][axis]) - point[axis]).abs() < 0.02,
            "{probe}"
        );
    }
    let paths = probe["paths"].as_array().expect("paths");
    let vertices = |path: &Value| path["vertices_m"].as_array().map_or(0, Vec::len);
    assert!(paths.iter().any(|path| vertices(path) > 0), "{probe}");
    let shares: f64 = paths.iter().map(|path| number(&path["share"])).sum();
    assert!((shares - 1.0).abs() < 1e-9, "nothing else lights it: {probe}");

    // Lines in a colour that nothing else has, from high above the floor down to the point.
    let is_line = |[r, g, b]: [u8; 3]| r > 200 && (120..230).contains(&g) && b < 120;
    let count = |shot: &RgbImage| picture(shot).filter(|(.., rgb)| is_line(*rgb)).count();
    let coloured_before = count(&before);
    let drawn = viewer.screenshot_that("shows the paths", |shot| count(shot) > coloured_before + 200);
    let is_near = |px: u32, py: u32| (px as i32 - x).abs() < 8 && (py as i32 - y).abs() < 8;
    let mut near = picture(&drawn).filter(|(px, py, _)| is_near(*px, *py));
    assert!(near.any(|(.., rgb)| rgb[0] > 200), "the point is marked");
}
