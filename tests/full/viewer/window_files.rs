//! In a real window: scenes opened, dropped, kept, filmed and read again; how long a bake is said to take still; and hands
//! that know nothing.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use nephroid::bake::CostPoint;
use nephroid::progress::Stage;
use nephroid::scene::CameraPath;
use nephroid::settings::BakeSettings;
use nephroid::viewer::files::config::ConfigFolder;
use nephroid::viewer::time_left::{in_words, time_left_s};
use nephroid::viewer::worker::{BakeRequest, BakeState, BakedLevel};
use serde_json::{Value, json};

use super::scene_file;
use crate::damage::mutate::{Damage, effort};
use support::desktop::{ALIKE, SIZE, Screen, Viewer, difference, position, wait_until};
use support::file_drop::drop_file;
use support::or_skip;
use support::tools::{bake, builtin_scene, set, to};

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
    let screen = or_skip!(Screen::start());
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

    let arguments = format!("{source} --exposure 0");
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

    viewer.close();
}

#[test]
fn path_is_recorded_played_and_filmed() {
    let screen = or_skip!(Screen::start());
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
    viewer.open_sections(&["Scene"]);
    viewer.type_into("TextInput", "File", "builtin:showroom");
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

fn request(settings: BakeSettings) -> BakeRequest {
    BakeRequest::new(Arc::new(builtin_scene("ring")), settings)
}

/// So many seconds after the start, at a share of a stage that began then.
fn left(wanted: &BakeRequest, level: Option<&BakedLevel>, fraction: f64, seconds: f64) -> Option<f64> {
    let (stage, since) = (Stage::Caustic, Instant::now());
    let state = BakeState::Baking {
        stage,
        fraction,
        since,
    };
    time_left_s(&state, wanted, level, since + Duration::from_secs_f64(seconds))
}

#[test]
fn a_stage_keeps_its_pace_within_a_limit() {
    let limited = |max_time_s| request(set(BakeSettings::default(), |s| s.max_time_s = max_time_s));
    for (max_time_s, expected) in [
        (None, 12.0),
        (Some(10.0), 6.0),
        (Some(100.0), 12.0),
        (Some(3.0), 0.0),
    ] {
        let left = left(&limited(max_time_s), None, 0.25, 4.0).expect("it is known");
        assert!((left - expected).abs() < 1e-9, "{left} s with {max_time_s:?}");
    }
    // Too little is done, or nothing is to be done.
    assert_eq!(left(&limited(None), None, 0.01, 5.0), None);
    assert_eq!(
        time_left_s(&BakeState::Done, &limited(None), None, Instant::now()),
        None
    );
}

#[test]
fn the_course_tells_what_is_left_of_it() {
    let wanted = request(set(BakeSettings::default(), |s| s.max_error = Some(0.01)));
    let point = |cpu_s, error| CostPoint {
        rays: 1000,
        cpu_s,
        wall_s: cpu_s / 2.0,
        bytes: 0,
        error,
        is_by_photons: false,
    };
    let mut level = BakedLevel {
        serial: 1,
        request: wanted.clone(),
        level: 1,
        is_final: false,
        result: bake(builtin_scene("ring"), &to(0.05, 8)),
        seconds: 3.0,
    };
    level.result.course = vec![point(2.0, 0.04), point(6.0, 0.02)];
    let after = |level: &BakedLevel, seconds| left(&wanted, Some(level), 0.5, seconds);
    let at_level = after(&level, 3.0).expect("it is known");
    // Half the error takes more than nothing and, at an exponent of at most 2, at most three times as much again; two
    // threads work.
    assert!(at_level > 0.0 && at_level <= 0.5 * 3.0 * 6.0, "{at_level}");
    // A second later a second less, and never less than none.
    let later = after(&level, 4.0).expect("it is known");
    assert!((at_level - later - 1.0).abs() < 1e-9, "{at_level}, {later}");
    assert_eq!(after(&level, 1e6), Some(0.0));
    // Maps of another bake say nothing of this one.
    level.request.settings.seed = 9;
    assert_eq!(after(&level, 3.0), None);
}

#[test]
fn times_are_told_as_well_as_they_are_known() {
    for (seconds, words) in [
        (0.2, "about a second left"),
        (41.7, "about 42 s left"),
        (130.0, "about 3 min left"),
        (7300.0, "about 3 h left"),
    ] {
        assert_eq!(in_words(seconds), words);
    }
}
