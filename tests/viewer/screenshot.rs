//! The picture of the window as files.

use std::path::Path;

use nephroid::export::FloatImage;
use nephroid::eye_pass::{Picture, ToneMap, View, tone_mapping};
use nephroid::optics::LinearSrgb;
use nephroid::optics::spectrum::xyz::IDENTITY;
use nephroid::scene::Camera;
use nephroid::viewer::screenshot;

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

fn view() -> View {
    View {
        camera: Camera::framing("all", (-glam::DVec3::ONE, glam::DVec3::ONE), 1.5),
        width: 3,
        height: 2,
        exposure_stops: -1.5,
        tone_map: ToneMap::AgX,
        background: LinearSrgb::BLACK,
    }
}

fn save(folder: &Path, scene: &str, has_radiance: bool) -> Vec<String> {
    let files =
        screenshot::save(folder, scene, &picture(), &view(), &IDENTITY, has_radiance).expect("it is saved");
    let name = |file: &std::path::PathBuf| {
        assert_eq!(file.parent(), Some(folder), "nothing leads elsewhere");
        assert!(file.is_file(), "{}", file.display());
        file.file_name().expect("a name").to_string_lossy().into_owned()
    };
    files.iter().map(name).collect()
}

#[test]
fn files_hold_what_is_seen_and_the_radiance_behind_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let names = save(folder.path(), "ring", true);
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
fn no_file_is_written_over_and_a_pair_has_one_number() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("nephroid-ring-0001.exr"), "mine").expect("it is written");
    assert_eq!(save(folder.path(), "ring", true)[0], "nephroid-ring-0002.png");
    assert_eq!(save(folder.path(), "ring", false), ["nephroid-ring-0003.png"]);
    assert_eq!(save(folder.path(), "ring", true)[1], "nephroid-ring-0004.exr");
    let mine = std::fs::read(folder.path().join("nephroid-ring-0001.exr")).expect("it is there");
    assert_eq!(mine, b"mine");
    assert_eq!(save(folder.path(), "ball", false), ["nephroid-ball-0001.png"]);
}

#[test]
fn a_scenes_name_forms_no_path() {
    let folder = tempfile::tempdir().expect("a folder");
    for (scene, name) in [
        ("../../etc/passwd", "nephroid-etc-passwd-0001.png"),
        ("床", "nephroid-scene-0001.png"),
        ("A\0b", "nephroid-a-b-0001.png"),
    ] {
        assert_eq!(save(folder.path(), scene, false), [name]);
    }
}

#[test]
fn a_place_that_cannot_be_written_is_told_in_one_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    let gone = folder.path().join("gone");
    let error = screenshot::save(&gone, "ring", &picture(), &view(), &IDENTITY, true).expect_err("no folder");
    let sentence = error.to_string();
    assert!(
        sentence.contains("gone") && sentence.contains("folder does not exist"),
        "{sentence}"
    );
    assert!(!sentence.contains('\n') && !gone.exists());
    // A folder has the picture's name: its number is taken, and nothing is lost.
    std::fs::create_dir(folder.path().join("nephroid-ring-0001.png")).expect("it is made");
    assert_eq!(save(folder.path(), "ring", true)[0], "nephroid-ring-0002.png");
}
