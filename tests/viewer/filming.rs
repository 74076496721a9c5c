//! The camera's path: recorded, played, written and filmed.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use egui::accesskit::Role;
use glam::DVec3;
use nephroid::effect::EffectSwitches;
use nephroid::eye_pass::{ToneMap, View};
use nephroid::optics::LinearSrgb;
use nephroid::optics::spectrum::xyz::IDENTITY;
use nephroid::scene::{Camera, CameraPath, turntable};
use nephroid::settings::BakeSettings;
use nephroid::viewer::exporting::{ExportState, Exporter};
use nephroid::viewer::filming::{Film, Player, Shooting};
use nephroid::viewer::panel::FilmWish;

use super::headless::Headless;
use super::panel::scene;
use super::support::skip::skip;
use super::worker::wait_for;

fn camera(x: f64) -> Camera {
    let target = DVec3::new(0.5 * x, 0.2, -4.0);
    Camera::look_at("here", DVec3::new(x, 1.5, 3.0), target, 0.7)
}

/// From x = 0 to x = 2 [m].
fn film() -> Film {
    let mut film = Film::default();
    for x in [0.0, 2.0] {
        film.record(None, &camera(x), DVec3::ZERO, 5.0);
    }
    film
}

#[test]
fn a_recorded_key_is_the_camera_that_was_there() {
    let origin = DVec3::new(1e6, 0.0, -2e6);
    let mut film = Film::default();
    film.record(None, &camera(1.0), origin, 3.0);
    let there = film.camera_at(0, origin).expect("it is recorded");
    assert!(there.position.distance(camera(1.0).position) < 1e-8, "{there:?}");
    assert!(there.forward.distance(camera(1.0).forward) < 1e-8, "{there:?}");
    assert!((there.vertical_fov_rad - 0.7).abs() < 1e-12, "{there:?}");
    film.record(Some(0), &camera(-1.0), origin, 3.0);
    assert_eq!(film.keys.len(), 1, "in the first one's place");
    let there = film.camera_at(0, origin).expect("it is recorded");
    assert!(there.position.x < 0.0 && film.camera_at(1, origin).is_none());
    film.record(Some(7), &camera(9.0), origin, 3.0);
    assert_eq!(film.keys.len(), 1, "there is no such key");
}

/// A camera that leans comes back as it leant, and between two it leans the shorter way.
#[test]
fn a_leaning_camera_leans_in_its_key_and_on_the_way() {
    let leaning = |degrees: f64| {
        let level = camera(1.0);
        let (sine, cosine) = degrees.to_radians().sin_cos();
        Camera {
            up: level.up * cosine + level.right() * sine,
            ..level
        }
    };
    let mut film = Film {
        frames: 3,
        ..Film::default()
    };
    for degrees in [170.0, -150.0] {
        film.record(None, &leaning(degrees), DVec3::ZERO, 3.0);
        let there = film
            .camera_at(film.keys.len() - 1, DVec3::ZERO)
            .expect("it is recorded");
        assert!(there.up.distance(leaning(degrees).up) < 1e-9, "{there:?}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = film.save(folder.path(), "leaning").expect("it can be written");
    let cameras = CameraPath::read(&path)
        .expect("it can be read")
        .cameras(DVec3::ZERO);
    assert!(
        cameras[1].up.distance(leaning(-170.0).up) < 1e-9,
        "{:?}",
        cameras[1]
    );
    assert!(cameras.iter().all(Camera::is_sound));
    // Who stands level writes what was read before there was such a thing.
    let mut level = Film::default();
    level.record(None, &camera(1.0), DVec3::ZERO, 3.0);
    assert_eq!(level.keys[0].roll_deg, 0.0);
}

#[test]
fn a_path_is_written_as_render_reads_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let film = Film { frames: 5, ..film() };
    let path = film.save(folder.path(), "my scene").expect("it can be written");
    assert!(path.ends_with("nephroid-my-scene-path-0001.json"), "{path:?}");
    let again = film.save(folder.path(), "my scene").expect("it can be written");
    assert_ne!(path, again);
    let cameras = CameraPath::read(&path)
        .expect("it is a path")
        .cameras(DVec3::ZERO);
    assert_eq!(cameras.len(), 5);
    for (frame, camera) in cameras.iter().enumerate() {
        let expected = DVec3::new(0.5 * frame as f64, 1.5, 3.0);
        assert!(camera.position.distance(expected) < 1e-12, "{camera:?}");
    }
    let one = Film {
        keys: film.keys[..1].to_vec(),
        ..film
    };
    let sentence = one
        .save(folder.path(), "one")
        .expect_err("it leads nowhere")
        .to_string();
    assert!(sentence.contains("keys"), "{sentence}");
}

#[test]
fn a_path_is_played_in_its_own_time() {
    let cameras = Film { frames: 61, ..film() }
        .path()
        .expect("it is a path")
        .cameras(DVec3::ZERO);
    let mut player = Player::new(cameras).expect("there are frames");
    let (camera, is_last) = player.advance(0.0);
    assert!(camera.position.x == 0.0 && !is_last);
    // In one step or in many.
    for _ in 0..100 {
        player.advance(0.01001);
    }
    let (camera, is_last) = player.advance(0.0);
    assert!((camera.position.x - 1.0).abs() < 1e-9 && !is_last, "{camera:?}");
    let (camera, is_last) = player.advance(50.0);
    assert!(camera.position.x == 2.0 && is_last, "{camera:?}");
    assert!(Player::new(Vec::new()).is_none());
}

fn shooting(frames: usize) -> Shooting {
    let scene = Arc::new(scene());
    let first = Camera::framing("all", scene.bounds().expect("it has surfaces"), 1.5);
    Shooting {
        maps: Vec::new(),
        cameras: turntable::around(&scene, &first, frames),
        view: View {
            camera: first,
            width: 48,
            height: 32,
            exposure_stops: 0.0,
            tone_map: ToneMap::None,
            background: LinearSrgb::WHITE,
        },
        effects: EffectSwitches::default(),
        white_balance: IDENTITY,
        name: "turntable",
        scene,
    }
}

#[test]
fn frames_are_written_by_the_exporting_thread_which_tells_how_it_gets_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let news = Arc::new(AtomicUsize::new(0));
    let of_thread = Arc::clone(&news);
    let mut exporter = Exporter::new(Arc::new(move || {
        of_thread.fetch_add(1, Ordering::SeqCst);
    }));
    exporter.film(shooting(3), folder.path().to_owned());
    assert_eq!(*exporter.state(), ExportState::Filming { done: 0, total: 3 });
    wait_for("the film", || exporter.poll());
    let path = match exporter.state() {
        ExportState::Done(path) => path.clone(),
        ExportState::Failed(sentence) if sentence.contains("adapter") => {
            return skip("frames from the window", sentence);
        }
        other => panic!("{other:?}"),
    };
    assert!(news.load(Ordering::SeqCst) >= 4, "each frame, and the end");
    assert!(path.ends_with("nephroid-test-turntable-0001") || path.to_string_lossy().contains("turntable"));
    let mut names: Vec<_> = std::fs::read_dir(&path)
        .expect("a folder")
        .map(|entry| entry.expect("a file").file_name().into_string().expect("a name"))
        .collect();
    names.sort();
    assert_eq!(names, ["frame-00001.png", "frame-00002.png", "frame-00003.png"]);
    let frame = image::open(path.join(&names[0])).expect("a PNG").to_rgb8();
    assert_eq!(frame.dimensions(), (48, 32));
    assert_eq!(
        frame.get_pixel(0, 0).0,
        [255; 3],
        "nothing is before the background"
    );
    assert!(frame.pixels().any(|pixel| pixel.0 != [255; 3]), "the scene is");

    // One that is stopped says so, and keeps what it has.
    exporter.film(shooting(10_000), folder.path().to_owned());
    std::thread::sleep(Duration::from_millis(300));
    exporter.stop();
    wait_for("the end", || exporter.poll());
    assert!(
        matches!(exporter.state(), ExportState::Failed(_)),
        "{:?}",
        exporter.state()
    );
}

fn press(panel: &mut Headless, role: Role, name: &str) {
    let centre = Headless::rect_of(panel.named(role, name)).center();
    panel.click(centre);
}

#[test]
fn keys_are_recorded_edited_and_played_by_buttons() {
    let mut panel = Headless::new(BakeSettings::splat(), (1280.0, 1600.0));
    press(&mut panel, Role::DisclosureTriangle, "Camera path");
    let wish = |panel: &mut Headless, name: &str| {
        press(panel, Role::Button, name);
        std::mem::take(&mut panel.wishes).film
    };
    assert_eq!(wish(&mut panel, "Play"), None, "there is nothing to be played");
    assert_eq!(wish(&mut panel, "Add key"), Some(FilmWish::Record(None)));
    panel.panel.film = film();
    panel.settle();
    assert!(panel.says("2 keys, 4.0 s"), "{:#?}", panel.texts());
    for (name, expected) in [
        ("Play", FilmWish::Play(true)),
        ("Key 1: go", FilmWish::GoTo(0)),
        ("Key 2: set", FilmWish::Record(Some(1))),
        ("Save path", FilmWish::Save),
        ("Export frames", FilmWish::Shoot { turns: false }),
        ("Export turntable", FilmWish::Shoot { turns: true }),
    ] {
        assert_eq!(wish(&mut panel, name), Some(expected), "{name}");
    }
    panel.export = ExportState::Filming { done: 3, total: 120 };
    panel.settle();
    assert!(panel.says("3 of 120 frames"), "{:#?}", panel.texts());
    assert_eq!(wish(&mut panel, "Stop"), Some(FilmWish::Stop));
    assert_eq!(wish(&mut panel, "Export frames"), None, "one at a time");
    press(&mut panel, Role::Button, "Key 1: delete");
    assert_eq!(panel.panel.film.keys, film().keys[1..]);
    assert_eq!(wish(&mut panel, "Save path"), None, "one key is no path");
}
