//! Frames that the exporting thread draws and writes.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nephroid::effect::EffectSwitches;
use nephroid::eye_pass::{ToneMap, View};
use nephroid::optics::LinearSrgb;
use nephroid::optics::spectrum::xyz::IDENTITY;
use nephroid::scene::{Camera, turntable};
use nephroid::viewer::background::Wake;
use nephroid::viewer::exporting::{ExportState, Exporter};
use nephroid::viewer::filming::Shooting;

use super::fixtures::{folder, scene, wait_for};

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
fn frames_are_written_and_can_be_stopped() {
    let folder = folder();
    let news = Arc::new(AtomicUsize::new(0));
    let of_thread = Arc::clone(&news);
    let mut exporter = Exporter::new(&Wake::new(move || {
        of_thread.fetch_add(1, Ordering::SeqCst);
    }));
    exporter.film(shooting(3), folder.path().to_owned());
    assert_eq!(exporter.state, ExportState::Filming { done: 0, total: 3 });
    wait_for("the film", || exporter.poll());
    let path = match &exporter.state {
        ExportState::Done(path) => path.clone(),
        ExportState::Failed(sentence) if sentence.contains("adapter") => {
            return support::skip("frames from the window", sentence);
        }
        other => panic!("{other:?}"),
    };
    assert!(news.load(Ordering::SeqCst) >= 4, "each frame, and the end");
    assert!(path.ends_with("nephroid-test-turntable-0001"), "{path:?}");
    let files = std::fs::read_dir(&path).expect("a folder");
    let mut names: Vec<_> = files.map(|file| file.expect("a file").file_name()).collect();
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

    // One that is stopped says so.
    exporter.film(shooting(10_000), folder.path().to_owned());
    std::thread::sleep(std::time::Duration::from_millis(300));
    exporter.stop();
    wait_for("the end", || exporter.poll());
    assert!(
        matches!(exporter.state, ExportState::Failed(_)),
        "{:?}",
        exporter.state
    );
}
