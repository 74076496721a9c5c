//! The camera's path: recorded, played and written; and maps written by a thread of their own, and the picture of the window
//! as files.

use nephroid::eye_pass::tone_mapping;
use nephroid::optics::spectrum::xyz::IDENTITY;
use nephroid::scene::CameraPath;
use nephroid::viewer::background::Wake;
use nephroid::viewer::exporting::{Exporter, folder_name, save_picture};
use nephroid::viewer::filming::{Film, Player};

use super::fixtures::{map, scene};
use super::*;

fn camera(x: f64) -> Camera {
    let target = dvec3(0.5 * x, 0.2, -4.0);
    Camera::look_at("here", dvec3(x, 1.5, 3.0), target, 0.7)
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
fn keys_are_the_camera_that_was_there() {
    let origin = dvec3(1e6, 0.0, -2e6);
    let mut film = Film::default();
    // The third has no place to go to.
    for (place, x, stands) in [(None, 1.0, 1.0), (Some(0), -1.0, -1.0), (Some(7), 9.0, -1.0)] {
        film.record(place, &camera(x), origin, 3.0);
        let there = film.camera_at(0, origin).expect("it is recorded");
        near(there.position, camera(stands).position, 1e-8, "position");
        near(there.forward, camera(stands).forward, 1e-8, "forward");
        near(there.vertical_fov_rad, 0.7, 1e-12, "angle of view");
        assert!(film.keys.len() == 1 && film.camera_at(1, origin).is_none());
    }
    assert_eq!(film.keys[0].roll_deg, 0.0, "who stands level writes no roll");
}

#[test]
fn a_lean_takes_the_shorter_way() {
    let leaning = |degrees: f64| {
        let level = camera(1.0);
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let up = level.up * cosine + level.right() * sine;
        with(level, |it| it.up = up)
    };
    let mut film = with(Film::default(), |it| it.frames = 3);
    for (key, degrees) in [170.0, -150.0].into_iter().enumerate() {
        film.record(None, &leaning(degrees), DVec3::ZERO, 3.0);
        let there = film.camera_at(key, DVec3::ZERO).expect("it is recorded");
        near(there.up, leaning(degrees).up, 1e-9, degrees);
    }
    let folder = folder();
    let path = film.save(folder.path(), "leaning").expect("it can be written");
    let path = CameraPath::read(&path).expect("it can be read");
    let cameras = path.cameras(DVec3::ZERO);
    near(cameras[1].up, leaning(-170.0).up, 1e-9, "half-way");
    assert!(cameras.iter().all(Camera::is_sound));
}

#[test]
fn paths_are_written_as_render_reads_them() {
    let folder = folder();
    let film = Film { frames: 5, ..film() };
    for number in 1..=2 {
        let path = film.save(folder.path(), "my scene").expect("it can be written");
        let name = format!("nephroid-my-scene-path-000{number}.json");
        assert!(path.ends_with(name), "{path:?}");
        let cameras = CameraPath::read(&path)
            .expect("it is a path")
            .cameras(DVec3::ZERO);
        assert_eq!(cameras.len(), 5);
        for (frame, camera) in cameras.iter().enumerate() {
            near(camera.position, dvec3(0.5 * frame as f64, 1.5, 3.0), 1e-12, frame);
        }
    }
    let mut one = film;
    one.keys.truncate(1);
    says(
        one.save(folder.path(), "one").expect_err("it leads nowhere"),
        "keys",
    );
}

#[test]
fn paths_are_played_in_their_own_time() {
    let film = Film { frames: 61, ..film() };
    let cameras = film.path().expect("it is a path").cameras(DVec3::ZERO);
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

#[test]
fn tours_lead_past_all_cameras_and_back() {
    let scene = support::tools::builtin_scene("showroom");
    let tour = film().tour(&scene.cameras, scene.origin_world, 1.0);
    assert!(scene.cameras.len() > 1);
    assert_eq!(tour.keys.len(), scene.cameras.len() + 1);
    assert_eq!(tour.size, film().size);
    let way = tour.path().expect("a path").cameras(scene.origin_world);
    for camera in scene.cameras.iter().chain(scene.cameras.first()) {
        let nearest = way.iter().min_by(|a, b| {
            let [a, b] = [a, b].map(|on_way| on_way.position.distance(camera.position));
            a.total_cmp(&b)
        });
        let nearest = nearest.expect("frames");
        assert!(
            nearest.position.distance(camera.position) < 0.1,
            "{}",
            camera.name
        );
        assert!(nearest.forward.dot(camera.forward) > 0.99, "{}", camera.name);
    }
    let ends = [&way[0], &way[way.len() - 1]].map(|end| end.position);
    assert!(ends[0].distance(ends[1]) < 1e-9);

    let mut panel = Headless::with_scene(scene, BakeSettings::splat(), ((1280.0, 1800.0), 1.0));
    panel.open("Camera path");
    panel.press("Tour");
    assert_eq!(panel.asked(), [Command::Film(FilmCommand::Tour)]);
}

#[test]
fn buttons_record_play_and_film() {
    let mut panel = Headless::new(BakeSettings::splat());
    panel.open("Camera path");
    let asked = |panel: &mut Headless, name: &str| {
        panel.press(name);
        panel.asked().pop()
    };
    assert_eq!(asked(&mut panel, "Play"), None, "there is nothing to be played");
    assert_eq!(asked(&mut panel, "Tour"), None, "nor is there a camera");
    assert_eq!(
        asked(&mut panel, "Add key"),
        Some(Command::Film(FilmCommand::Record(None)))
    );
    panel.model.choices.film = film();
    panel.settle();
    panel.assert_says(&["2 keys, 4.0 s"]);
    for (name, expected) in [
        ("Play", FilmCommand::Play(true)),
        ("Key 1: go", FilmCommand::GoTo(0)),
        ("Key 2: set", FilmCommand::Record(Some(1))),
        ("Save path", FilmCommand::Save),
        ("Export frames", FilmCommand::Shoot { turns: false }),
        ("Export turntable", FilmCommand::Shoot { turns: true }),
    ] {
        assert_eq!(asked(&mut panel, name), Some(Command::Film(expected)), "{name}");
    }
    panel.tell(|model| model.exporter.state = ExportState::Filming { done: 3, total: 120 });
    panel.assert_says(&["3 of 120 frames"]);
    assert_eq!(asked(&mut panel, "Stop"), Some(Command::Film(FilmCommand::Stop)));
    assert_eq!(asked(&mut panel, "Export frames"), None, "one at a time");
    panel.press("Key 1: delete");
    assert_eq!(panel.model.choices.film.keys, film().keys[1..]);
    assert_eq!(asked(&mut panel, "Save path"), None, "one key is no path");
}

fn export(what: Export, folder: &Path) -> ExportState {
    let news = Arc::new(AtomicUsize::new(0));
    let of_thread = Arc::clone(&news);
    let mut exporter = Exporter::new(&Wake::new(move || {
        of_thread.fetch_add(1, Ordering::SeqCst);
    }));
    assert!(!exporter.poll() && exporter.state == ExportState::Idle);
    let mut level = finished(&Arc::new(scene()), &BakeSettings::default());
    level.result.maps = vec![map()];
    exporter.start(what, Arc::new(level), folder.to_owned());
    wait_for("the export", || news.load(Ordering::SeqCst) == 1);
    assert!(exporter.poll() && !exporter.poll(), "it ends once");
    exporter.state.clone()
}

/// Caustic and direct light of the last texel, its coordinates beside it.
fn check_map(path: &Path) {
    let image = FloatImage::read(path).expect("an EXR");
    assert_eq!((image.width, image.height), (4, 2));
    assert_eq!(image.rgb("").expect("R, G, B")[7][1], 9.0);
    assert!(path.with_extension("uv").exists());
}

#[test]
fn one_map_is_never_written_over_another() {
    let folder = folder();
    for number in 1..=2 {
        let name = format!("nephroid-test-0000_floor-000{number}.exr");
        let path = folder.path().join(name);
        let state = export(Export::Map(0), folder.path());
        assert_eq!(state, ExportState::Done(path.clone()));
        check_map(&path);
    }
}

#[test]
fn all_maps_replace_those_before() {
    let folder = folder();
    let name = folder_name("a scene");
    assert_eq!(name, "nephroid-a-scene-maps");
    let maps = folder.path().join(&name);
    for _ in 0..2 {
        let state = export(Export::All(name.clone().into()), folder.path());
        assert_eq!(state, ExportState::Done(maps.clone()));
    }
    check_map(&maps.join("maps/0000_floor.exr"));
    let manifest = fs::read_to_string(maps.join("manifest.json")).expect("a manifest");
    assert!(manifest.contains("maps/0000_floor.exr") && manifest.contains("maps/0000_floor.uv"));
}

#[test]
fn failures_are_told_in_a_sentence() {
    let folder = folder();
    fs::write(folder.path().join("mine.txt"), "mine").expect("a file");
    for what in [
        Export::All(".".into()),
        Export::All("mine.txt".into()),
        Export::Map(7),
    ] {
        let ExportState::Failed(sentence) = export(what.clone(), folder.path()) else {
            panic!("{what:?}")
        };
        assert!(!sentence.contains('\n') && sentence.len() > 20, "{sentence}");
    }
    let left = fs::read_dir(folder.path()).expect("it is there");
    assert_eq!(left.count(), 1, "nothing else is left there");
}

fn picture() -> Picture {
    let radiance = (0..6).map(|index| {
        let level = 0.01 * 4.0_f32.powi(index);
        [level, 0.5 * level, 0.0]
    });
    Picture {
        width: 3,
        height: 2,
        radiance: radiance.collect(),
    }
}

fn save(folder: &Path, scene: &str, has_radiance: bool) -> Result<Vec<String>, String> {
    let camera = Camera::framing("all", (-DVec3::ONE, DVec3::ONE), 1.5);
    let view = View {
        exposure_stops: -1.5,
        tone_map: ToneMap::AgX,
        ..View::new(camera, [3, 2])
    };
    let saved = save_picture(folder, scene, &picture(), &view, &IDENTITY, has_radiance);
    let files = saved.map_err(|error| error.to_string())?;
    let name = |file: &std::path::PathBuf| {
        assert!(
            file.parent() == Some(folder) && file.is_file(),
            "{}",
            file.display()
        );
        file.file_name().expect("a name").to_string_lossy().into_owned()
    };
    Ok(files.iter().map(name).collect())
}

#[test]
fn files_hold_the_picture_and_its_radiance() {
    let folder = folder();
    let names = save(folder.path(), "ring", true).expect("it is saved");
    assert_eq!(names, ["nephroid-ring-0001.png", "nephroid-ring-0001.exr"]);
    let radiance = FloatImage::read(&folder.path().join(&names[1])).expect("a picture");
    assert_eq!(radiance.rgb("").expect("R, G, B"), picture().radiance);
    let shown = image::open(folder.path().join(&names[0]))
        .expect("a PNG")
        .to_rgba8();
    assert_eq!(shown.dimensions(), (3, 2));
    let expected = tone_mapping::display_rgba8(&picture(), -1.5, ToneMap::AgX);
    assert_eq!(shown.into_raw(), expected);
}

#[test]
fn names_are_new_and_form_no_path() {
    let folder = folder();
    let mine = folder.path().join("nephroid-ring-0001.exr");
    fs::write(&mine, "mine").expect("it is written");
    // A folder takes a number too.
    fs::create_dir(folder.path().join("nephroid-ring-0005.png")).expect("it is made");
    for (scene, has_radiance, last) in [
        ("ring", true, "nephroid-ring-0002.exr"),
        ("ring", false, "nephroid-ring-0003.png"),
        ("ring", true, "nephroid-ring-0004.exr"),
        ("ring", true, "nephroid-ring-0006.exr"),
        ("ball", false, "nephroid-ball-0001.png"),
        ("../../etc/passwd", false, "nephroid-etc-passwd-0001.png"),
        ("床", false, "nephroid-scene-0001.png"),
        ("A\0b", false, "nephroid-a-b-0001.png"),
    ] {
        let names = save(folder.path(), scene, has_radiance).expect("it is saved");
        assert_eq!(names.len(), 1 + usize::from(has_radiance));
        assert_eq!(names.last().map(String::as_str), Some(last));
        // One number.
        assert_eq!(names[0].strip_suffix(".png"), last.get(..last.len() - 4));
    }
    assert_eq!(fs::read(mine).expect("it is there"), b"mine");
    let gone = folder.path().join("gone");
    let sentence = save(&gone, "ring", true).expect_err("no folder");
    says(sentence, "gone | folder does not exist");
    assert!(!gone.exists());
}
