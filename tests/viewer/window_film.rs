//! The camera's path in the real window: recorded by key, played, saved and filmed.

use std::path::PathBuf;

use glam::DVec3;
use nephroid::scene::CameraPath;
use serde_json::Value;

use super::desktop::{Screen, Viewer};

fn position(event: &Value) -> DVec3 {
    let coordinate = |axis: usize| event["position_m"][axis].as_f64().expect("a number");
    DVec3::new(coordinate(0), coordinate(1), coordinate(2))
}

#[test]
fn a_path_is_recorded_played_saved_and_filmed() {
    let Some(screen) = Screen::start("viewer film") else {
        return;
    };
    let arguments = ["builtin:ring", "--density", "1000", "--map-resolution", "64"];
    let mut viewer = Viewer::open(&screen, &arguments);
    viewer.wait_for("done", |_| true);
    let start = position(&viewer.wait_for("rest", |_| true));
    viewer.hands("mousemove 900 300 key k");
    viewer.wait_for("recorded", |event| event["keys"] == 1);
    viewer.hands("keydown d sleep 0.5 keyup d");
    let end = position(&viewer.wait_for("rest", |event| position(event) != start));
    viewer.hands("key k");
    viewer.wait_for("recorded", |event| event["keys"] == 2);

    for section in ["Light pass", "Accuracy", "Display", "Camera path"] {
        viewer.click("DisclosureTriangle", section);
    }
    viewer.click("Button", "Key 1: go");
    viewer.wait_for("rest", |event| position(event).distance(start) < 1e-9);
    viewer.type_into("SpinButton", "Frames", "4");
    viewer.click("Button", "Play");
    viewer.wait_for("plays", |_| true);
    viewer.wait_for("played", |_| true);
    viewer.wait_for("rest", |event| position(event).distance(end) < 1e-9);

    viewer.click("Button", "Save path");
    let saved = viewer.wait_for("saved", |_| true);
    let file = PathBuf::from(saved["files"][0].as_str().expect("a path"));
    let cameras = CameraPath::read(&file)
        .expect("render reads it")
        .cameras(DVec3::ZERO);
    assert_eq!(cameras.len(), 4);
    assert!(cameras[0].position.distance(start) < 1e-9 && cameras[3].position.distance(end) < 1e-9);

    viewer.click("Button", "Export frames");
    let exported = viewer.wait_for("exported", |_| true);
    let folder = PathBuf::from(exported["path"].as_str().expect("a path"));
    let frames: Vec<_> = (1..=4)
        .map(|number| {
            let file = folder.join(format!("frame-{number:05}.png"));
            image::open(file).expect("a PNG").to_rgb8()
        })
        .collect();
    assert_eq!(frames[0].dimensions(), (1280, 720));
    for pair in frames.windows(2) {
        let bright = pair[0].pixels().filter(|pixel| pixel.0[1] > 60).count();
        assert!(bright > 5000, "{bright} pixels of light");
        let moved = pair[0].pixels().zip(pair[1].pixels());
        let moved = moved.filter(|(a, b)| a.0[1].abs_diff(b.0[1]) > 20).count();
        assert!(moved > 1000, "{moved} pixels differ from frame to frame");
    }
    assert!(!folder.join("frame-00005.png").exists());
    let kept = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    viewer
        .screenshot()
        .save(kept.join("film.png"))
        .expect("it is kept to be looked at");
    frames[3]
        .save(kept.join("film-frame.png"))
        .expect("it is kept to be looked at");
    let (status, stderr) = viewer.close();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}
