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
const ALIKE: f64 = 0.005;

/// Luminance of display values [0, 1], of a square of 5 pixels around a point of the floor.
fn brightness(shot: &RgbImage, floor: DVec3) -> f64 {
    let scene = builtin::build("ring").expect("it is built in");
    let camera =
        Navigator::new(&scene, None).camera_for((f64::from(SIZE.0) - f64::from(WIDTH)) / f64::from(SIZE.1));
    let d = floor - camera.position;
    let (left, height) = (f64::from(WIDTH), f64::from(SIZE.1));
    let width = f64::from(SIZE.0) - left;
    let scale = 0.5 * height / (0.5 * camera.vertical_fov_rad).tan() / d.dot(camera.forward);
    let x = left + 0.5 * width + scale * d.dot(camera.right());
    let y = 0.5 * height - scale * d.dot(camera.up);
    let square = (0..25).map(|index| {
        let pixel = shot.get_pixel(x as u32 + index % 5 - 2, y as u32 + index / 5 - 2);
        let [r, g, b] = pixel.0.map(|channel| f64::from(channel) / 255.0);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    });
    square.sum::<f64>() / 25.0
}

/// Share of the picture's pixels, the panel left out, that differ visibly.
fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
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
fn screenshot_that(viewer: &Viewer<'_>, what: &str, fits: impl Fn(&RgbImage) -> bool) -> RgbImage {
    let start = Instant::now();
    loop {
        let shot = viewer.screenshot();
        if fits(&shot) {
            return shot;
        }
        assert!(start.elapsed() < Duration::from_secs(20), "no picture {what}");
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
        "mousemove {x0} {y} sleep 0.2 mousedown 1 sleep 0.2 mousemove {} {y}",
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
    // Through the room and on, at a run: ten seconds would be fifty metres.
    viewer.hands("keydown shift keydown w sleep 10 keyup w keyup shift");
    let stopped = position(&viewer.wait_for("rest", |event| position(event) != standing));
    let walked_m = standing.distance(stopped);
    assert!(walked_m > 0.3, "it walked {walked_m} m");
    // A quarter of a metre before the wall behind the exhibits, and along that on to wherever it led.
    assert!(
        (stopped.z - (floor.0.z + 0.25)).abs() < 0.02,
        "{stopped} in {floor:?}"
    );
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
const REFINED: [&str; 7] = [
    "builtin:ring",
    "--max-error",
    "3%",
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
    assert!(error > 0.0 && error <= 0.03, "{done}");
    viewer.wait_for("rest", |_| true);
    let baked = viewer.screenshot();

    // The lamp is moved: coarse maps are shown before the last ones.
    let (x, y) = viewer.centre("SpinButton", "Position [m]");
    viewer.hands(&format!(
        "mousemove {x} {y} sleep 0.2 mousedown 1 sleep 0.2 mousemove {} {y} sleep 0.2 mouseup 1",
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
    viewer.wait_for("undo", |_| true);
    viewer.wait_for("done", |_| true);
    viewer.wait_for("rest", |_| true);

    // Four times the power, at the place where the mouse is held: no ray is traced for it.
    let (x0, y) = viewer.on_slider("Intensity [W/sr]", 0.5);
    let (x1, _) = viewer.on_slider("Intensity [W/sr]", 0.65);
    viewer.forget();
    viewer.hands(&format!(
        "mousemove {x0} {y} sleep 0.2 mousedown 1 sleep 0.2 mousemove {x1} {y}"
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
    viewer.wait_for("undo", |_| true);
    viewer.wait_for("done", |_| true);
    screenshot_that(&viewer, "is as before", |shot| difference(&baked, shot) < ALIKE);

    // The error takes the place of the light, with a legend, and goes again.
    viewer.click("RadioButton", "error");
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
    viewer.click("RadioButton", "light");
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

    for section in ["Scene", "Light pass", "Effects"] {
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
