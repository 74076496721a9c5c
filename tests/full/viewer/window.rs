//! The real program in a real window, used as a person would, seen only by screenshots and its event log: it starts, a file
//! is dropped on it, it is killed and comes back, it ends whatever it is at; and hands that know nothing.

use std::path::Path;
use std::time::{Duration, Instant};

use image::RgbImage;
use nephroid::export::FloatImage;
use nephroid::eye_pass::ToneMap;
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::gpu::Gpu;
use nephroid::viewer::files::config::ConfigFolder;
use nephroid::viewer::panel::WIDTH;

use super::scene_file;
use crate::damage::mutate::{Damage, effort};
use support::desktop::{ALIKE, SIZE, Screen, Viewer, difference, picture, position, wait_until};
use support::file_drop::drop_file;
use support::or_skip;
use support::prelude::*;

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

/// Coarse enough to be baked in a second.
const COARSE: &str = "--density 300 --map-resolution 32";

#[test]
fn a_dropped_file_is_opened_unless_it_is_no_scene() {
    let screen = or_skip!(Screen::start());
    let mut viewer = Viewer::open(&screen, &format!("builtin:ring {COARSE}"));
    viewer.wait_for_bake();
    let ring = viewer.screenshot();
    let folder = tempfile::tempdir().expect("a folder");
    let exposures = viewer.all("exposure").len();
    let dropped = scene_file::glb(folder.path(), "a dropped scene", "300");
    drop_file(viewer.place(), &dropped.canonicalize().expect("it is there"));
    viewer.wait_for("opened", |opened| opened["scene"] == "a dropped scene");
    let (done, _) = viewer.wait_for_bake();
    assert!(done["maps"].as_u64() > Some(0), "{done}");
    assert!(viewer.title().contains("a dropped scene"), "{}", viewer.title());
    assert!(viewer.all("exposure").len() > exposures, "it is measured anew");
    viewer.screenshot_that("of another scene", |shot| difference(&ring, shot) > 0.05);

    // What is no scene leaves what there is, and the window goes on.
    let broken = scene_file::no_scene(folder.path());
    drop_file(viewer.place(), &broken.canonicalize().expect("it is there"));
    let refused = viewer.wait_for("not_opened", |_| true);
    assert!(
        refused["sentence"].to_string().contains("broken.gltf"),
        "{refused}"
    );
    assert!(viewer.title().contains("a dropped scene"), "{}", viewer.title());

    // Without a dialog to name it in, the scene is saved beside its file.
    viewer.click("Button", "Save scene…");
    let saved = viewer.wait_for("saved", |_| true);
    let path = saved["files"][0].as_str().expect("it is named");
    assert!(path.ends_with("a dropped scene-edited-0001.glb"), "{saved}");
    let bytes = |path: &Path| std::fs::read(path).expect("it is there");
    assert_eq!(bytes(Path::new(path)), bytes(&dropped), "nothing was edited");
    viewer.close();
}

/// Bookmarks, settings and camera are found again after the program was killed.
#[test]
fn killed_window_comes_back() {
    let screen = or_skip!(Screen::start());
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
        event["settings"]["layers"] == json!(["direct", "indirect"])
    });
    viewer.wait_for("done", |_| true);
    // It is written within a second, or what that is on a busy machine.
    let kept = ConfigFolder::new(config.clone()).scene_file(&source);
    wait_until("what was set is kept", || {
        let kept = std::fs::read(&kept).ok()?;
        let kept: Value = serde_json::from_slice(&kept).ok()?;
        (kept["settings"]["layers"] == json!(["direct", "indirect"])).then_some(())
    });
    viewer.signal("KILL");

    let arguments = format!("{source} --exposure 0");
    let mut viewer = Viewer::open_with(&screen, &arguments, Some(&config));
    assert_eq!(viewer.all("found_again").len(), 1);
    let baking = &viewer.all("baking")[0];
    assert_eq!(
        baking["settings"]["layers"],
        json!(["direct", "indirect"]),
        "{baking}"
    );
    let found = position(&viewer.wait_for_bake().1);
    assert!(found.distance(last) < 1e-6, "{found}, {last}");
    viewer.hands("mousemove 900 300 key 3");
    viewer.wait_for("bookmark", |event| event["number"] == 3 && event["kept"] == false);
    let back = viewer.wait_for_move(found);
    assert!(back.distance(marked) < 1e-6, "{back}, {marked}");

    viewer.close();
}

/// Whether it is asked to close or its window is taken away, whatever it is at.
#[test]
fn it_ends_quietly_while_it_bakes() {
    let screen = or_skip!(Screen::start());
    for what_comes_first in ["upload", "level", "exposure"] {
        for end in [Viewer::close, Viewer::destroy] {
            let gallery = "builtin:gallery --preset draft --layers caustic,direct,indirect";
            let mut viewer = Viewer::open(&screen, gallery);
            viewer.wait_for(what_comes_first, |_| true);
            end(viewer);
        }
    }
}

/// Of one part; there are at most three.
const PART: Duration = Duration::from_secs(20);
const MAX_PARTS: usize = 3;
/// Deeds between two looks at the clock.
const DEEDS: usize = 12;

/// Everything that the window has a meaning for, and some that it has none for.
const KEYS: &str = "w a s d q e c f r h v m p k g 1 2 9 ctrl+1 ctrl+2 ctrl+z ctrl+y ctrl+shift+z Escape Tab shift+Tab space \
    Return Up Down Left Right Page_Down Home BackSpace Delete 0 5 minus period F1 F12 x question shift+w alt+a";
const HELD: [&str; 8] = ["w", "a", "s", "d", "q", "e", "shift", "ctrl"];

/// Something to do, for xdotool.
fn deed(random: &mut Damage, window: &str) -> String {
    let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
    // As often over the panel as over the picture.
    let x = if random.below(2) == 0 {
        random.below(360)
    } else {
        random.below(width)
    };
    let y = random.below(height);
    match random.below(20) {
        0..=5 => format!("key {} ", random.one_of(&KEYS.split(' ').collect::<Vec<_>>())),
        6 | 7 => format!(
            "{} {} ",
            random.one_of(&["keydown", "keyup"]),
            random.one_of(&HELD)
        ),
        8..=12 => format!("mousemove {x} {y} click 1 "),
        13 => format!("mousemove {x} {y} click 3 "),
        14 | 15 => format!(
            "mousemove {x} {y} click --repeat 3 --delay 5 {} ",
            4 + random.below(2)
        ),
        16..=18 => {
            let button = random.one_of(&[1, 1, 3]);
            let (to_x, to_y) = (random.below(width), y + random.below(9));
            let way = format!(
                "mousemove {} {to_y} sleep 0.02 mousemove {to_x} {to_y}",
                (x + to_x) / 2
            );
            format!("mousemove {x} {y} mousedown {button} sleep 0.02 {way} sleep 0.02 mouseup {button} ")
        }
        _ => format!(
            "windowsize {window} {} {} ",
            300 + random.below(1000),
            200 + random.below(600)
        ),
    }
}

#[test]
fn random_input_breaks_nothing() {
    let screen = or_skip!(Screen::start());
    let mut viewer = Viewer::open(&screen, "builtin:ring --map-resolution 128 --max-error 0.05%");
    let mut random = Damage::to("hands", 0);
    let start = Instant::now();
    while start.elapsed() < PART * effort().clamp(1, MAX_PARTS) as u32 {
        let deeds: String = (0..DEEDS).map(|_| deed(&mut random, viewer.place().1)).collect();
        viewer.hasty_hands(&deeds);
        assert!(viewer.runs(), "it ended: {}", viewer.stderr());
    }
    // Everything is let go, and whatever is baked now is stopped.
    let let_go: String = HELD.iter().map(|key| format!("keyup {key} ")).collect();
    let size = format!("windowsize {} {} {}", viewer.place().1, SIZE.0, SIZE.1);
    viewer.hands(&format!("{let_go} mouseup 1 mouseup 3 {size}"));
    viewer.forget();
    viewer.hands("mousemove 900 300 key Escape");
    viewer.hands("key Escape");
    for bad in ["fault", "device_lost"] {
        assert!(viewer.all(bad).is_empty(), "{:?}", viewer.all(bad));
    }
    let (stderr, _) = viewer.close();
    for bad in ["alidation", "overflow"] {
        assert!(!stderr.contains(bad), "{stderr}");
    }
}

/// Both bakes would take minutes: whoever waited for one would see it done.
#[test]
fn long_bake_leaves_room_for_input_and_ends() {
    let screen = or_skip!(Screen::start());
    let long = "builtin:ring --density 3e7";
    let mut viewer = Viewer::open(&screen, &format!("{long} --estimator splat --layers caustic"));
    for step in 0..40 {
        // To and fro between the panel and the picture; every eighth time the camera is set back to where it is.
        let (x, y) = if step % 2 == 0 {
            (100, 200 + 5 * step)
        } else {
            (700 + 5 * step, 300)
        };
        let key = if step % 8 == 7 { "key c" } else { "" };
        viewer.hasty_hands(&format!("mousemove {x} {y} {key} sleep 0.1"));
    }
    // It closes while it reads and while it bakes.
    let folder = tempfile::tempdir().expect("a folder");
    let dropped = scene_file::glb(folder.path(), "dropped", "300");
    drop_file(viewer.place(), &dropped.canonicalize().expect("it is there"));
    viewer.wait_for("opening", |_| true);
    let (_, log) = viewer.close();
    assert!(
        log.iter().all(|event| event["event"] != "done"),
        "it baked all the time"
    );

    // So it does by a signal. The bake begins before the window is there.
    let viewer = Viewer::open(&screen, long);
    assert_eq!(viewer.signal("TERM").code(), Some(143));
}
