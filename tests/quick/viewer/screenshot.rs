//! The picture of the window as files.

use nephroid::eye_pass::{Picture, View};
use nephroid::optics::spectrum::xyz::IDENTITY;
use nephroid::viewer::exporting::save_picture;

use super::*;

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
