//! Maps written by a thread of their own.

use nephroid::viewer::background::Wake;
use nephroid::viewer::exporting::{Exporter, folder_name};

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
