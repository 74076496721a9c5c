//! The real program in a real window on a screen without a monitor, used as a person would: seen only by screenshots
//! and its event log.

use std::path::Path;
use std::time::{Duration, Instant};

use glam::DVec3;
use image::RgbImage;
use nephroid::export::FloatImage;
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::eye_pass::{Picture, ToneMap};
use nephroid::gpu::Gpu;
use nephroid::scene::builtin;
use nephroid::viewer::navigation::Navigator;
use nephroid::viewer::panel::WIDTH;
use nephroid::viewer::walking::EYE_M;

use super::desktop::{SIZE, Screen, Viewer};

/// The caustic alone, coarse enough to be baked in a second.
const RING: [&str; 9] = [
    "builtin:ring",
    // Its sigma changes the picture most.
    "--estimator",
    "splat",
    "--density",
    "10000",
    "--map-resolution",
    "128",
    "--layers",
    "caustic",
];

/// Share of pixels by which two pictures of the same view at rest may differ visibly: each is the mean of as many samples
/// as time allowed, which shows at the edges of what is seen in the mirror.
pub const ALIKE: f64 = 0.005;

/// Where a point of a built-in scene is seen at the start [pixels of the window].
pub fn pixel_of(scene: &str, point: DVec3) -> (f64, f64) {
    let scene = builtin::build(scene).expect("it is built in");
    let camera =
        Navigator::new(&scene, None).camera_for((f64::from(SIZE.0) - f64::from(WIDTH)) / f64::from(SIZE.1));
    let d = point - camera.position;
    let (left, height) = (f64::from(WIDTH), f64::from(SIZE.1));
    let width = f64::from(SIZE.0) - left;
    let scale = 0.5 * height / (0.5 * camera.vertical_fov_rad).tan() / d.dot(camera.forward);
    let x = left + 0.5 * width + scale * d.dot(camera.right());
    let y = 0.5 * height - scale * d.dot(camera.up);
    (x, y)
}

/// Luminance of display values [0, 1], of a square of 5 pixels around a point of the floor.
fn brightness(shot: &RgbImage, floor: DVec3) -> f64 {
    let (x, y) = pixel_of("ring", floor);
    let square = (0..25).map(|index| {
        let pixel = shot.get_pixel(x as u32 + index % 5 - 2, y as u32 + index / 5 - 2);
        let [r, g, b] = pixel.0.map(|channel| f64::from(channel) / 255.0);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    });
    square.sum::<f64>() / 25.0
}

/// Share of the picture's pixels, the panel left out, that differ visibly.
pub fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    let differs = |x: u32, y: u32| {
        let (p, q) = (a.get_pixel(x, y).0, b.get_pixel(x, y).0);
        p.iter().zip(q).any(|(p, q)| p.abs_diff(q) > 8)
    };
    let left = WIDTH as u32;
    let count = (left..SIZE.0)
        .flat_map(|x| (0..SIZE.1).map(move |y| (x, y)))
        .filter(|&(x, y)| differs(x, y))
        .count();
    count as f64 / (f64::from(SIZE.0 - left) * f64::from(SIZE.1))
}

/// The first screenshot that fits: what the log tells takes a moment to reach the screen.
pub fn screenshot_that(viewer: &Viewer<'_>, what: &str, fits: impl Fn(&RgbImage) -> bool) -> RgbImage {
    let start = Instant::now();
    loop {
        let shot = viewer.screenshot();
        if fits(&shot) {
            return shot;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "no picture {what}");
    }
}

/// A camera's place from the log.
fn position(rest: &serde_json::Value) -> DVec3 {
    let coordinate = |axis: usize| rest["position_m"][axis].as_f64().expect("a number");
    DVec3::new(coordinate(0), coordinate(1), coordinate(2))
}

#[test]
fn a_user_sees_the_caustic_drags_sigma_flies_looks_and_closes() {
    let Some(screen) = Screen::start("viewer window") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &RING);

    // The caustic is there: its cusp far brighter than the floor beside it, and the rest is not blank.
    let done = viewer.wait_for("done", |_| true);
    assert!(
        done["rays"].as_u64() > Some(1000) && done["splats"].as_u64() > Some(1000),
        "{done}"
    );
    let rest = viewer.wait_for("rest", |_| true);
    let baked = viewer.screenshot();
    assert_eq!(baked.dimensions(), SIZE);
    // A mirror of radius 1 m images the lamp's axis, 1.7 m before it, at 1/(2 − 1/1.7) = 0.708 m.
    let cusp = brightness(&baked, DVec3::new(1.0 - 0.708, 0.0, 0.0));
    let beside = brightness(&baked, DVec3::new(-0.4, 0.0, 0.0));
    assert!(cusp > 0.5 && cusp > 5.0 * beside, "cusp {cusp}, beside {beside}");

    // Sigma is dragged: a bake with it, and another picture.
    let [(x0, y), (x1, _)] = [0.5, 0.75].map(|share| viewer.on_slider("Sigma [radii²]", share));
    viewer.hands(&format!(
        "mousemove {x0} {y} sleep 1 mousedown 1 sleep 1 mousemove {} {y}",
        (x0 + x1) / 2
    ));
    viewer.hands(&format!(
        "sleep 0.2 mousemove {x1} {y} sleep 0.4 mouseup 1 sleep 0.4 mousemove 900 300"
    ));
    viewer.wait_for("settings", |_| true);
    let sigma = |event: &serde_json::Value| event["settings"]["sigma"]["constant"].as_f64().unwrap_or(0.0);
    let done = viewer.wait_for("done", |event| sigma(event) > 3.0);
    assert!((3.0..40.0).contains(&sigma(&done)), "{done}");
    viewer.wait_for("rest", |_| true);
    let blurred = screenshot_that(&viewer, "is blurred", |shot| difference(&baked, shot) > 0.005);

    // W flies towards what is seen.
    viewer.forget();
    viewer.hands("keydown w sleep 0.5 keyup w");
    let flown = viewer.wait_for("rest", |event| position(event) != position(&rest));
    let closer = screenshot_that(&viewer, "shows the flight", |shot| {
        difference(&blurred, shot) > 0.05
    });
    let camera = &builtin::build("ring").expect("it is built in").cameras[0];
    let path = position(&flown) - position(&rest);
    assert!(
        path.normalize().dot(camera.forward) > 0.999,
        "it flew along {path}"
    );

    // The right mouse button looks around.
    viewer.forget();
    viewer.hands("mousemove 800 400 mousedown 3 sleep 0.2");
    for _ in 0..4 {
        viewer.hands("mousemove_relative 30 0 sleep 0.05");
    }
    viewer.hands("mouseup 3");
    viewer.wait_for("rest", |_| true);
    std::thread::sleep(Duration::from_millis(300));
    assert!(
        difference(&closer, &viewer.screenshot()) > 0.05,
        "it looks elsewhere"
    );

    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn who_walks_falls_to_the_ground_stops_at_walls_and_finds_a_kept_view_again() {
    let Some(screen) = Screen::start("viewer on foot") else {
        return;
    };
    let mut viewer = Viewer::open(
        &screen,
        &["builtin:showroom", "--density", "100", "--map-resolution", "32"],
    );
    viewer.wait_for("done", |_| true);
    let position = |event: &serde_json::Value| {
        let axis = |index: usize| event["position_m"][index].as_f64().expect("a number");
        DVec3::new(axis(0), axis(1), axis(2))
    };
    let outside = position(&viewer.wait_for("rest", |_| true));
    // Over the floor, lower than eyes are.
    viewer.hands("mousemove 900 300 keydown w sleep 1 keyup w");
    let start = position(&viewer.wait_for("rest", |event| position(event) != outside));
    viewer.hands("key ctrl+1");
    viewer.wait_for("bookmark", |event| event["number"] == 1 && event["kept"] == true);
    viewer.hands("key v");
    viewer.wait_for("travel", |event| event["way"] == "walk");
    let standing = position(&viewer.wait_for("rest", |event| position(event) != start));
    let floor = builtin::build("showroom")
        .expect("it is built in")
        .bounds()
        .expect("a room");
    assert!(
        (standing.y - floor.0.y - EYE_M).abs() < 0.01,
        "{standing} in {floor:?}"
    );
    // Through the room and on, at a run: ten seconds would be fifty metres. Where pictures take longer than the half
    // second that a step may last, it takes another run to come to the wall; each must lead somewhere.
    let mut stopped = standing;
    let from_wall_m = |place: DVec3| place.z - (floor.0.z + 0.25);
    for _ in 0..8 {
        let before = stopped;
        viewer.forget();
        viewer.hands("keydown shift keydown w sleep 10 keyup w keyup shift");
        stopped = position(&viewer.wait_for("rest", |event| position(event) != before));
        let walked_m = before.distance(stopped);
        assert!(walked_m > 0.3, "it walked {walked_m} m");
        if from_wall_m(stopped).abs() < 0.02 {
            break;
        }
    }
    // A quarter of a metre before the wall behind the exhibits, and along that on to wherever it led.
    assert!(from_wall_m(stopped).abs() < 0.02, "{stopped} in {floor:?}");
    assert!(
        stopped.x >= floor.0.x && stopped.x <= floor.1.x,
        "{stopped} in {floor:?}"
    );
    // A wall that is pressed against does not let go on.
    viewer.hands("keydown w sleep 2 keyup w");
    std::thread::sleep(Duration::from_millis(500));
    let shot = viewer.screenshot();
    viewer.hands("key 1");
    viewer.wait_for("bookmark", |event| event["number"] == 1 && event["kept"] == false);
    let back = position(&viewer.wait_for("rest", |event| position(event).distance(stopped) > 0.1));
    // On foot again: over the place that was kept, on the ground.
    assert!((back - start).with_y(0.0).length() < 1e-6, "{back}, {start}");
    screenshot_that(&viewer, "from elsewhere", |seen| difference(&shot, seen) > 0.05);
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn a_window_at_rest_takes_no_time_and_survives_every_size() {
    let Some(screen) = Screen::start("viewer at rest") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &RING);
    viewer.wait_for("done", |_| true);
    let rest = viewer.wait_for("rest", |_| true);
    // What the picture took has come back by then, from a device that can tell.
    let gpu = Gpu::headless().expect("the window has an adapter too");
    let tells = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    let device_ms = rest["device_ms"].as_f64();
    assert!(
        device_ms.is_some_and(|ms| ms > 0.0 && ms < 1e5) == tells,
        "{rest}"
    );
    drop(gpu);
    std::thread::sleep(Duration::from_millis(500));
    let before = viewer.cpu_s();
    std::thread::sleep(Duration::from_secs(2));
    let spent = viewer.cpu_s() - before;
    assert!(spent < 0.1, "{spent} s of processor time in 2 s at rest");

    let whole = viewer.screenshot();
    for size in ["1 1", "345 2", "3000 2000", "700 400", "1280 720"] {
        viewer.forget();
        viewer.hands(&format!("windowsize {} {size} sleep 0.3", viewer.window()));
    }
    screenshot_that(&viewer, "shows the same again", |again| {
        difference(&whole, again) < ALIKE
    });
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn a_signal_closes_the_window_even_while_it_bakes() {
    let Some(screen) = Screen::start("viewer and signals") else {
        return;
    };
    // The bake begins before the window is there.
    let viewer = Viewer::open(&screen, &["builtin:ring", "--density", "3e7"]);
    assert_eq!(viewer.signal("TERM").code(), Some(143));
}

/// The caustic alone, refined until its error is small: several levels.
/// A bake of seconds, so that no window is so slow that it sees the last maps only.
const REFINED: [&str; 7] = [
    "builtin:ring",
    "--max-error",
    "0.05%",
    "--map-resolution",
    "128",
    "--layers",
    "caustic",
];

#[test]
fn levels_come_before_the_end_edits_are_baked_while_dragged_and_errors_are_shown() {
    let Some(screen) = Screen::start("viewer edits") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &REFINED);
    // The last maps are not the first.
    let done = viewer.wait_for("done", |_| true);
    assert!(done["level"].as_u64() > Some(1), "{done}");
    let error = done["error"].as_f64().expect("it is estimated");
    assert!(error > 0.0 && error <= 0.000_5, "{done}");
    viewer.wait_for("rest", |_| true);
    let baked = viewer.screenshot();

    // The lamp is moved: coarse maps are shown before the last ones.
    viewer.click("DisclosureTriangle", "Scene");
    let (x, y) = viewer.centre("SpinButton", "Position [m]");
    viewer.hands(&format!(
        "mousemove {x} {y} sleep 1 mousedown 1 sleep 1 mousemove {} {y} sleep 1 mouseup 1",
        x + 60
    ));
    viewer.wait_for("edit", |edit| edit["target"] == "LightPosition(0)");
    let level = viewer.wait_for("level", |level| level["shown"] == true);
    assert!(level["maps"].as_u64() > Some(0), "{level}");
    viewer.wait_for("done", |done| {
        done["request"].as_u64() >= level["request"].as_u64()
    });
    viewer.forget();
    viewer.hands("mousemove 900 300 key ctrl+z");
    viewer.wait_for("undone", |_| true);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);

    // Four times the power, at the place where the mouse is held: no ray is traced for it.
    let (x0, y) = viewer.on_slider("Intensity [W/sr]", 0.5);
    let (x1, _) = viewer.on_slider("Intensity [W/sr]", 0.65);
    viewer.forget();
    viewer.hands(&format!(
        "mousemove {x0} {y} sleep 1 mousedown 1 sleep 1 mousemove {x1} {y}"
    ));
    viewer.wait_for("edit", |edit| edit["target"] == "LightPower(0)");
    let done = viewer.wait_for("done", |_| true);
    assert_eq!(done["rays"].as_u64(), Some(0), "{done}");
    let uploaded = viewer.wait_for("upload", |upload| upload["tiles"].as_u64() > Some(0));
    assert!(
        uploaded["tiles"].as_u64() <= Some(7),
        "two by two tiles, and one on each of three coarser levels: {uploaded}"
    );
    screenshot_that(&viewer, "is brighter", |shot| difference(&baked, shot) > 0.05);
    viewer.hands("mouseup 1 sleep 0.2");

    // Ctrl+Z brings the old light back.
    viewer.forget();
    viewer.hands("mousemove 900 300 key ctrl+z");
    viewer.wait_for("undone", |_| true);
    viewer.wait_for("done", |_| true);
    screenshot_that(&viewer, "is as before", |shot| difference(&baked, shot) < ALIKE);

    // The error takes the place of the light, with a legend, and goes again.
    viewer.click("ComboBox", "View");
    viewer.click("Button", "error");
    viewer.wait_for("shows", |shows| shows["what"] == "error");
    let false_colours = screenshot_that(&viewer, "shows errors", |shot| difference(&baked, shot) > 0.1);
    let coloured = |shot: &RgbImage| {
        let spread = |rgb: [u8; 3]| rgb.into_iter().max().zip(rgb.into_iter().min());
        let is_coloured = |rgb: [u8; 3]| spread(rgb).is_some_and(|(most, least)| most - least > 20);
        let pixels = shot.enumerate_pixels();
        pixels
            .filter(|(x, _, pixel)| *x > WIDTH as u32 && is_coloured(pixel.0))
            .count()
    };
    assert_eq!(coloured(&baked), 0, "the light is white");
    assert!(coloured(&false_colours) > 20_000, "{}", coloured(&false_colours));
    viewer.click("ComboBox", "View");
    viewer.click("Button", "light");
    viewer.wait_for("shows", |shows| shows["what"] == "light");
    screenshot_that(&viewer, "shows light again", |shot| {
        difference(&baked, shot) < ALIKE
    });

    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn the_exposure_suits_the_whole_light_and_not_only_the_first_maps() {
    let Some(screen) = Screen::start("viewer exposure") else {
        return;
    };
    // Caustic and direct light: the first maps come without the second, unless the bake outruns the window.
    let arguments = ["builtin:showroom", "--map-resolution", "64", "--max-error", "50%"];
    let mut viewer = Viewer::open(&screen, &arguments);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let measured = viewer.all("exposure");
    let stops = |event: &serde_json::Value| event["stops"].as_f64().expect("a number");
    match &measured[..] {
        [of_the_caustic, of_both] => {
            let (of_the_caustic, of_both) = (stops(of_the_caustic), stops(of_both));
            assert!(
                of_both < of_the_caustic - 2.0,
                "{of_the_caustic}, then {of_both} stops"
            );
        }
        [of_both] => assert!(stops(of_both).abs() < 2.0, "{of_both}"),
        _ => panic!("measured again and again: {measured:?}"),
    }
    let shot = viewer.screenshot();
    let pixels = shot.enumerate_pixels().filter(|(x, ..)| *x > WIDTH as u32);
    let white = pixels.clone().filter(|(.., pixel)| pixel.0 == [255; 3]).count();
    let dark = pixels.filter(|(.., pixel)| pixel.0[1] < 32).count();
    let all = f64::from((SIZE.0 - WIDTH as u32) * SIZE.1);
    assert!((white as f64) < 0.2 * all, "{white} white pixels");
    assert!((dark as f64) < 0.5 * all, "{dark} dark pixels");
}

#[test]
fn the_worth_of_the_light_pass_is_found_beside_the_maps_and_shown_in_false_colours() {
    let Some(screen) = Screen::start("viewer worth") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &RING);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let baked = viewer.screenshot();

    for section in ["Light pass", "Accuracy", "Effects"] {
        viewer.click("DisclosureTriangle", section);
    }
    viewer.click("Button", "light pass: worth");
    let compared = viewer.wait_for("compared", |_| true);
    assert_eq!(compared["effect"], "light_pass");
    assert!(compared["with_w"].as_f64() > Some(0.0), "{compared}");
    viewer.wait_for("shows", |shows| shows["what"] == "difference");
    screenshot_that(&viewer, "shows the difference", |shot| {
        difference(&baked, shot) > 0.1
    });
    viewer.hands("mousemove 900 300");
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
}

/// A pair of files that the log tells of: the PNG's pixels and the EXR's radiance.
fn saved(event: &serde_json::Value) -> (RgbImage, Picture) {
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

#[test]
fn the_picture_is_saved_as_it_is_seen_and_as_radiance() {
    let Some(screen) = Screen::start("viewer screenshot") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &RING);
    let stops = viewer.wait_for("exposure", |_| true)["stops"]
        .as_f64()
        .expect("a number");
    viewer.wait_for("rest", |_| true);
    let seen = viewer.screenshot();

    // By key: the PNG is the screen beside the panel, and the EXR, shown by the CPU, is the PNG.
    viewer.hands("key F12");
    let event = viewer.wait_for("saved", |_| true);
    let names: Vec<_> = (0..2).map(|index| event["files"][index].to_string()).collect();
    assert!(names[0].ends_with("nephroid-ring-0001.png\""), "{names:?}");
    let (shown, radiance) = saved(&event);
    let left = WIDTH as u32;
    assert_eq!(shown.dimensions(), (SIZE.0 - left, SIZE.1));
    let most = |a: &[u8], b: &[u8]| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max();
    let on_screen = image::imageops::crop_imm(&seen, left, 0, SIZE.0 - left, SIZE.1).to_image();
    let off = most(on_screen.as_raw(), shown.as_raw());
    assert!(off <= Some(1), "{off:?} codes between the screen and the file");
    let by_cpu = display_rgba8(&radiance, stops, ToneMap::Neutral);
    let by_cpu: Vec<u8> = by_cpu
        .chunks(4)
        .flat_map(|rgba| [rgba[0], rgba[1], rgba[2]])
        .collect();
    let off = most(&by_cpu, shown.as_raw());
    assert!(off <= Some(1), "{off:?} codes between the two files");
    assert!(by_cpu.iter().any(|code| *code > 100), "it is not dark");

    // Where it lies is told over the picture, and the next key takes that away.
    screenshot_that(&viewer, "tells where", |shot| difference(&seen, shot) > 0.001);
    viewer.hands("key b");
    screenshot_that(&viewer, "is clear again", |shot| difference(&seen, shot) == 0.0);

    // By the button: the next number.
    viewer.click("Button", "Save picture");
    let event = viewer.wait_for("saved", |_| true);
    assert!(
        event["files"][1]
            .to_string()
            .ends_with("nephroid-ring-0002.exr\""),
        "{event}"
    );
    assert_eq!(saved(&event), (shown, radiance), "the same picture again");

    // Where it cannot be written the window says so and goes on.
    std::fs::remove_dir_all(viewer.working_folder()).expect("it was there");
    viewer.hands("mousemove 900 300 key F12");
    let event = viewer.wait_for("not_saved", |_| true);
    let sentence = event["sentence"].as_str().expect("a sentence");
    assert!(
        sentence.contains("nephroid-ring-0001") && !sentence.contains('\n'),
        "{sentence}"
    );
    viewer.hands("key b");
    screenshot_that(&viewer, "goes on", |shot| difference(&seen, shot) == 0.0);
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn a_setting_is_taken_back_and_set_again_and_maps_are_looked_at_and_exported() {
    let Some(screen) = Screen::start("viewer maps") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &RING);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let [(x0, y), (x1, _)] = [0.5, 0.75].map(|share| viewer.on_slider("Sigma [radii²]", share));
    viewer.forget();
    viewer.hands(&format!(
        "mousemove {x0} {y} sleep 1 mousedown 1 sleep 1 mousemove {x1} {y} sleep 1 mouseup 1 sleep 1"
    ));
    let sigma = |event: &serde_json::Value| event["settings"]["sigma"]["constant"].as_f64().unwrap_or(0.0);
    let blurred = viewer.wait_for("done", |event| sigma(event) > 3.0);
    // All of the drag is one step.
    viewer.hands("mousemove 900 300 key ctrl+z");
    viewer.wait_for("undone", |event| event["what"] == "sigma");
    viewer.wait_for("done", |event| sigma(event) == 1.0);
    viewer.hands("key ctrl+shift+z");
    viewer.wait_for("redone", |event| event["what"] == "sigma");
    viewer.wait_for("done", |event| sigma(event) == sigma(&blurred));
    viewer.wait_for("rest", |_| true);

    for section in ["Light pass", "Accuracy", "Maps"] {
        viewer.click("DisclosureTriangle", section);
    }
    let scene = builtin::build("ring").expect("it is built in");
    let floor = &scene.objects[0].name;
    let before = viewer.screenshot();
    viewer.click("Button", &format!("Map of {floor}"));
    screenshot_that(&viewer, "shows the map", |shot| difference(&before, shot) > 0.2);
    viewer.click("Button", &format!("Export map of {floor}"));
    let path = |event: serde_json::Value| event["path"].as_str().map(ToOwned::to_owned).expect("a path");
    let file = path(viewer.wait_for("exported", |_| true));
    let name = format!("nephroid-ring-0000_{floor}-0001.exr");
    assert!(file.ends_with(&name), "{file}");
    let map = FloatImage::read(Path::new(&file)).expect("an EXR");
    assert_eq!((map.width, map.height), (128, 128));
    let light = map.rgb("caustic").expect("the layer");
    assert!(light.iter().any(|e| e[1] > 0.0));
    viewer.click("Button", "Export all");
    let folder = path(viewer.wait_for("exported", |_| true));
    assert!(Path::new(&folder).join("manifest.json").exists(), "{folder}");

    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

/// A click on the floor under the glass ball tells what lights it there, and draws the way of the light through the ball.
#[test]
fn a_probed_point_tells_its_light_and_the_paths_are_drawn() {
    let Some(screen) = Screen::start("viewer probe") else {
        return;
    };
    let arguments = [
        "builtin:ball",
        "--map-resolution",
        "128",
        "--layers",
        "caustic,direct",
    ];
    let mut viewer = Viewer::open(&screen, &arguments);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let before = viewer.screenshot();
    let point = DVec3::new(0.2, 0.0, 0.1);
    let (x, y) = pixel_of("ball", point);
    viewer.hands(&format!(
        "key p sleep 0.3 mousemove {x} {y} sleep 0.2 mousedown 1 sleep 0.2 mouseup 1"
    ));
    let probe = viewer.wait_for("probe", |_| true);
    assert_eq!(probe["surface"], "floor", "{probe}");
    for axis in 0..3 {
        let found = probe["position_m"][axis].as_f64().expect("a number");
        // Half a pixel of a picture of 700 or so.
        assert!((found - point[axis]).abs() < 0.02, "{probe}");
    }
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let texel = &probe["texel"];
    let caustic = number(&texel["irradiance_w_m2"]["caustic"]);
    let paths = probe["paths"].as_array().expect("paths");
    let over_glass = paths
        .iter()
        .filter(|path| !path["vertices_m"].as_array().expect("places").is_empty());
    let sum: f64 = over_glass
        .clone()
        .map(|path| number(&path["irradiance_w_m2"]))
        .sum();
    let error = number(&texel["error_w_m2"]);
    assert!(over_glass.count() > 0, "{probe}");
    assert!(
        (sum - caustic).abs() < 3.0 * error + 0.02 * caustic,
        "{sum}: {probe}"
    );
    let shares: f64 = paths.iter().map(|path| number(&path["share"])).sum();
    assert!((shares - 1.0).abs() < 1e-9, "nothing else lights it: {probe}");
    let lx = number(&texel["illuminance_lx"]);
    let layers = texel["irradiance_w_m2"].as_object().expect("layers");
    let total: f64 = layers.values().map(number).sum();
    assert!((lx - 683.0 * total).abs() < 1e-6 * lx, "{probe}");

    // Lines in a colour that nothing else has, from high above the floor down to the point.
    let is_line =
        |pixel: &image::Rgb<u8>| pixel.0[0] > 200 && (120..230).contains(&pixel.0[1]) && pixel.0[2] < 120;
    let count = |shot: &RgbImage| {
        let pixels = shot.enumerate_pixels();
        pixels
            .filter(|(x, _, pixel)| *x > WIDTH as u32 && is_line(pixel))
            .count()
    };
    let coloured_before = count(&before);
    let drawn = screenshot_that(&viewer, "shows the paths", |shot| {
        count(shot) > coloured_before + 200
    });
    let near_point = drawn.enumerate_pixels().any(|(px, py, pixel)| {
        (f64::from(px) - x).abs() < 8.0 && (f64::from(py) - y).abs() < 8.0 && pixel.0[0] > 200
    });
    assert!(near_point, "the point is marked");
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("probe.png");
    drawn.save(kept).expect("it is kept to be looked at");
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

/// Mean display value of the picture's left and right half, below what is written over it.
fn halves(shot: &RgbImage) -> [f64; 2] {
    let left = WIDTH as u32;
    let middle = (left + SIZE.0) / 2;
    // Without the line between them, wherever it is.
    [(left + 60, middle - 10), (middle + 10, SIZE.0)].map(|(from, to)| {
        let rows = 150..SIZE.1;
        let pixels = rows.flat_map(|y| (from..to).map(move |x| (x, y)));
        let sum: f64 = pixels.map(|(x, y)| f64::from(shot.get_pixel(x, y).0[1])).sum();
        sum / (f64::from(to - from) * f64::from(SIZE.1 - 150))
    })
}

/// What was kept stays in the picture's right part while the lamp gets brighter in the left one; the line between them
/// is dragged.
#[test]
fn what_was_kept_is_shown_beside_what_is_baked_now() {
    let Some(screen) = Screen::start("viewer split") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &RING);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    for section in ["Light pass", "Accuracy", "Scene", "Compare"] {
        viewer.click("DisclosureTriangle", section);
    }
    viewer.click("Button", "Keep as before");
    let against = viewer.wait_for("against", |_| true);
    assert_eq!(against["relative_rmse"].as_f64(), Some(0.0), "{against}");
    viewer.wait_for("rest", |_| true);
    let before = viewer.screenshot();

    // Scrolled to where it was before.
    viewer.centre("Slider", "Intensity [W/sr]");
    let (x0, y) = viewer.on_slider("Intensity [W/sr]", 0.5);
    let (x1, _) = viewer.on_slider("Intensity [W/sr]", 0.65);
    viewer.forget();
    viewer.hands(&format!(
        "mousemove {x0} {y} sleep 1 mousedown 1 sleep 1 mousemove {x1} {y} sleep 1 mouseup 1 sleep 1 mousemove 1200 680"
    ));
    viewer.wait_for("done", |_| true);
    // Brighter by one factor everywhere: the maps differ by no less than their mean does.
    viewer.wait_for("against", |against| against["relative_rmse"].as_f64() > Some(1.0));
    let before = halves(&before);
    let brighter = |shot: &RgbImage| [0, 1].map(|half| halves(shot)[half] / before[half]);
    let split = screenshot_that(&viewer, "is brighter at the left alone", |shot| {
        let [left, right] = brighter(shot);
        left > 1.1 && (right - 1.0).abs() < 0.02
    });
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("split.png");
    split.save(kept).expect("it is kept to be looked at");

    // The line goes to the left, and with it the right part.
    let (x, y) = viewer.centre("Slider", "Divider");
    let left = f64::from(WIDTH) + 40.0;
    viewer.hands(&format!(
        "mousemove {x} {y} sleep 1 mousedown 1 sleep 1 mousemove {left} {y} sleep 1 mouseup 1 sleep 1 mousemove 900 300"
    ));
    screenshot_that(&viewer, "shows the kept maps nearly everywhere", |shot| {
        brighter(shot).iter().all(|factor| (factor - 1.0).abs() < 0.02)
    });
    viewer.click("Button", "End comparison");
    screenshot_that(&viewer, "shows the present maps everywhere", |shot| {
        brighter(shot).iter().all(|factor| *factor > 1.1)
    });
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn every_view_is_another_picture_and_the_light_comes_back() {
    let Some(screen) = Screen::start("viewer views") else {
        return;
    };
    let mut viewer = Viewer::open(&screen, &RING);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);
    let light = viewer.screenshot();
    let mut before = light.clone();
    for view in [
        "irradiance",
        "texels",
        "texel density",
        "normals",
        "texture uv",
        "map uv",
        "wavelength",
    ] {
        viewer.click("ComboBox", "View");
        viewer.click("Button", view);
        viewer.wait_for("shows", |shows| shows["what"] == view);
        let told = format!("shows {view}");
        before = screenshot_that(&viewer, &told, |shot| difference(&before, shot) > 0.05);
        let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("view-{view}.png"));
        before.save(kept).expect("it is kept to be looked at");
    }
    viewer.click("ComboBox", "View");
    viewer.click("Button", "light");
    screenshot_that(&viewer, "shows light again", |shot| {
        difference(&light, shot) < ALIKE
    });
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
}
