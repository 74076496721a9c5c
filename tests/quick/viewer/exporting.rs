//! Maps written by a thread of their own, and the picture of the window as files.

use nephroid::eye_pass::{Picture, View, tone_mapping};
use nephroid::optics::spectrum::xyz::IDENTITY;
use nephroid::viewer::background::Wake;
use nephroid::viewer::exporting::{Exporter, folder_name, save_picture};

use super::fixtures::{map, scene};
use super::*;

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
    let view = View {
        camera: Camera::framing("all", (-DVec3::ONE, DVec3::ONE), 1.5),
        width: 3,
        height: 2,
        exposure_stops: -1.5,
        tone_map: ToneMap::AgX,
        background: LinearSrgb::BLACK,
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
