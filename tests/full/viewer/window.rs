//! The real program in a real window, used as a person would: seen only by screenshots and its event log.

use std::path::Path;
use std::time::Duration;

use image::RgbImage;
use nephroid::export::FloatImage;
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::eye_pass::{Picture, ToneMap};
use nephroid::gpu::Gpu;
use nephroid::scene::builtin;
use nephroid::viewer::panel::WIDTH;
use nephroid::viewer::walking::EYE_M;
use serde_json::Value;

use support::desktop::{ALIKE, SIZE, Screen, Viewer, difference, picture, position, wait_until};
use support::or_skip;

/// The caustic alone, coarse enough to be baked in a second, by the estimator whose sigma changes the picture most.
const RING: &str = "builtin:ring --estimator splat --density 10000 --map-resolution 128 --layers caustic";

#[test]
fn picture_is_saved_flown_and_resized() {
    let screen = or_skip!(Screen::start());
    let mut viewer = Viewer::open(&screen, RING);
    viewer.wait_for("exposure", |_| true);
    let rest = viewer.wait_for("rest", |_| true);
    let stops = rest["exposure_stops"].as_f64();
    // What the picture took has come back by then, from a device that can tell.
    let gpu = Gpu::headless().expect("the window has an adapter too");
    let tells = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    let device_ms = rest["device_ms"].as_f64();
    assert!(
        device_ms.is_some_and(|ms| ms > 0.0 && ms < 1e5) == tells,
        "{rest}"
    );
    drop(gpu);
    let seen = viewer.screenshot();
    save(&mut viewer, &seen, stops.expect("a number"));
    takes_no_time_at_rest(&viewer);
    for size in ["1 1", "345 2", "3000 2000", "700 400", "1280 720"] {
        viewer.hands(&format!("windowsize {} {size}", viewer.place().1));
    }
    viewer.screenshot_that("shows the same again", |again| difference(&seen, again) < ALIKE);
    fly(&mut viewer, &seen, &rest);
    viewer.close();
}

/// A pair of files that the log tells of: the PNG's pixels and the EXR's radiance.
fn saved(event: &Value) -> (RgbImage, Picture) {
    let file = |index: usize| Path::new(event["files"][index].as_str().expect("a path")).to_owned();
    let shown = image::open(file(0)).expect("a PNG").to_rgb8();
    let image = FloatImage::read(&file(1)).expect("an EXR");
    let radiance = Picture {
        width: image.width as u32,
        height: image.height as u32,
        radiance: image.rgb("").expect("R, G, B"),
    };
    (shown, radiance)
}

/// The picture is saved by key as it is seen, and as radiance.
fn save(viewer: &mut Viewer<'_>, seen: &RgbImage, stops: f64) {
    // The PNG is the screen beside the panel, and the EXR, shown by the CPU, is the PNG.
    viewer.hands("key F12");
    let event = viewer.wait_for("saved", |_| true);
    let name = event["files"][0].to_string();
    assert!(name.ends_with("nephroid-ring-0001.png\""), "{event}");
    let (shown, radiance) = saved(&event);
    assert_eq!(shown.dimensions(), (SIZE.0 - WIDTH as u32, SIZE.1));
    let most = |a: &[u8], b: &[u8]| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max();
    let on_screen: Vec<u8> = picture(seen).flat_map(|(.., rgb)| rgb).collect();
    let off = most(&on_screen, shown.as_raw());
    assert!(off <= Some(1), "{off:?} codes between the screen and the file");
    let by_cpu = display_rgba8(&radiance, stops, ToneMap::default());
    let by_cpu: Vec<u8> = by_cpu.chunks(4).flat_map(|rgba| rgba[..3].to_vec()).collect();
    let off = most(&by_cpu, shown.as_raw());
    assert!(off <= Some(1), "{off:?} codes between the two files");
    assert!(by_cpu.iter().any(|code| *code > 100), "it is not dark");

    // Where it lies is told over the picture, and the next key takes that away.
    viewer.screenshot_that("tells where", |shot| difference(seen, shot) > 0.001);
    viewer.hands("key b");
    viewer.screenshot_that("is clear again", |shot| difference(seen, shot) == 0.0);
}

/// However long it takes to come to rest.
fn takes_no_time_at_rest(viewer: &Viewer<'_>) {
    wait_until("2 s with less than 0.1 s of processor time", || {
        let before = viewer.cpu_s();
        std::thread::sleep(Duration::from_secs(2));
        (viewer.cpu_s() - before < 0.1).then_some(())
    });
}

/// W flies towards what is seen; the right mouse button looks around.
fn fly(viewer: &mut Viewer<'_>, seen: &RgbImage, rest: &Value) {
    let path = viewer.fly("w", position(rest)) - position(rest);
    let camera = &builtin::build("ring").expect("it is built in").cameras[0];
    assert!(
        path.normalize().dot(camera.forward) > 0.999,
        "it flew along {path}"
    );
    let closer = viewer.screenshot_that("shows the flight", |shot| difference(seen, shot) > 0.05);
    viewer.hands("mousemove 800 400");
    viewer.hands("mousedown 3");
    for _ in 0..4 {
        viewer.hands("mousemove_relative 30 0");
    }
    viewer.hands("mouseup 3");
    viewer.screenshot_that("looks elsewhere", |shot| difference(&closer, shot) > 0.05);
}

#[test]
fn kept_maps_are_shown_beside_the_present_ones() {
    let screen = or_skip!(Screen::start());
    let mut viewer = Viewer::open(&screen, RING);
    viewer.wait_for_bake();
    viewer.close_sections(&["Light pass", "Accuracy"]);
    viewer.open_sections(&["Scene", "Compare"]);
    split(&mut viewer);
    viewer.close();
}

/// Mean display value of the picture's left and right half, below what is written over it and without the line between
/// them, wherever it is.
fn halves(shot: &RgbImage) -> [f64; 2] {
    let left = WIDTH as u32;
    let middle = (left + SIZE.0) / 2;
    [(left + 60, middle - 10), (middle + 10, SIZE.0)].map(|(from, to)| {
        let pixels = picture(shot).filter(|(x, y, _)| (from..to).contains(x) && *y >= 150);
        let (sum, count) = pixels.fold((0.0, 0.0), |(sum, count), (.., rgb)| {
            (sum + f64::from(rgb[1]), count + 1.0)
        });
        sum / count
    })
}

/// What was kept stays in the picture's right part while the lamp gets brighter in the left one; the line between them
/// is dragged.
fn split(viewer: &mut Viewer<'_>) {
    viewer.forget();
    viewer.click("Button", "Keep as before");
    let against = viewer.wait_for("against", |_| true);
    assert_eq!(against["relative_rmse"].as_f64(), Some(0.0), "{against}");
    let before = halves(&viewer.screenshot());
    viewer.centre("Slider", "Intensity [W/sr]");
    let slider = viewer.on_slider("Intensity [W/sr]", [0.5, 0.65]);
    viewer.pull(&slider);
    viewer.wait_for("edit", |_| true);
    viewer.let_go();
    // Brighter by one factor everywhere: the maps differ by no less than their mean does.
    viewer.wait_for("against", |against| against["relative_rmse"].as_f64() > Some(1.0));
    let brighter = |shot: &RgbImage| [0, 1].map(|half| halves(shot)[half] / before[half]);
    viewer.screenshot_that("is brighter at the left alone", |shot| {
        let [left, right] = brighter(shot);
        left > 1.1 && (right - 1.0).abs() < 0.02
    });
    // The line goes to the left, and with it the right part.
    let (x, y) = viewer.centre("Slider", "Divider");
    viewer.pull(&[(x, y), (WIDTH as i32 + 40, y)]);
    viewer.let_go();
    viewer.screenshot_that("shows the kept maps nearly everywhere", |shot| {
        brighter(shot).iter().all(|factor| (factor - 1.0).abs() < 0.02)
    });
    viewer.click("Button", "End comparison");
    viewer.screenshot_that("shows the present maps everywhere", |shot| {
        brighter(shot).iter().all(|factor| *factor > 1.1)
    });
}

#[test]
fn exposure_suits_a_room_that_is_walked() {
    let screen = or_skip!(Screen::start());
    let mut viewer = Viewer::open(
        &screen,
        "builtin:showroom --map-resolution 64 --max-error 50% --camera basin",
    );
    let (_, rest) = viewer.wait_for_bake();
    let measured = viewer.all("exposure");
    let stops: Vec<f64> = measured
        .iter()
        .filter_map(|event| event["exposure_stops"].as_f64())
        .collect();
    assert!(!stops.is_empty());
    for of_maps in &stops {
        assert!(
            of_maps.abs() < 2.0 && (of_maps - stops[0]).abs() <= 0.5,
            "{stops:?}"
        );
    }
    let shot = viewer.screenshot();
    let share = |is_so: fn([u8; 3]) -> bool| {
        picture(&shot).filter(|(.., rgb)| is_so(*rgb)).count() as f64 / picture(&shot).count() as f64
    };
    let (white, dark) = (share(|rgb| rgb == [255; 3]), share(|rgb| rgb[1] < 32));
    assert!(white < 0.2 && dark < 0.5, "{white} of it white, {dark} dark");
    // Who walks falls to the ground: over the floor, the camera is lower than eyes are.
    viewer.hands("mousemove 900 300");
    viewer.hands("key v");
    viewer.wait_for("travel", |event| event["way"] == "walk");
    let standing = viewer.wait_for_move(position(&rest));
    let room = builtin::build("showroom").and_then(|scene| scene.bounds());
    let (low, _) = room.expect("a room");
    assert!((standing.y - low.y - EYE_M).abs() < 0.01, "{standing} over {low}");
    viewer.close();
}

const GALLERY: &str = "builtin:gallery --preset draft --layers caustic,direct,indirect";

/// Direct and indirect light come before any caustic, and the exposure that suits them stays.
#[test]
fn the_room_is_lit_before_its_caustics() {
    let screen = or_skip!(Screen::start());
    let mut viewer = Viewer::open(&screen, GALLERY);
    let first = viewer.wait_for("level", |_| true);
    assert_eq!((&first["rays"], &first["shown"]), (&0.into(), &true.into()));
    let stops = |event: Value| event["exposure_stops"].as_f64().expect("a number");
    let exposed = stops(viewer.wait_for("exposure", |_| true));
    viewer.wait_for("level", |level| level["rays"].as_u64() > Some(0));
    let moved = stops(viewer.wait_for("exposure", |_| true)) - exposed;
    assert!(moved.abs() <= 0.5, "{moved} stops");
    viewer.close();
}

/// Whether it is asked to close or its window is taken away, whatever it is at.
#[test]
fn it_ends_quietly_while_it_bakes() {
    let screen = or_skip!(Screen::start());
    for what_comes_first in ["upload", "level", "exposure"] {
        for end in [Viewer::close, Viewer::destroy] {
            let mut viewer = Viewer::open(&screen, GALLERY);
            viewer.wait_for(what_comes_first, |_| true);
            end(viewer);
        }
    }
}
