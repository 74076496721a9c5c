//! Maps written by a thread of their own.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nephroid::export::FloatImage;
use nephroid::illumination::IlluminationMap;
use nephroid::settings::BakeSettings;
use nephroid::viewer::exporting::{Export, ExportState, Exporter, folder_name};
use nephroid::viewer::worker::BakedLevel;

use super::headless::finished;
use super::panel::scene;
use super::panel_sections::map;
use super::worker::wait_for;

fn level() -> (Arc<BakedLevel>, IlluminationMap) {
    let mut level = finished(&Arc::new(scene()), &BakeSettings::default());
    level.result.maps = vec![map()];
    (Arc::new(level), map())
}

/// What an export comes to; the thread has to say that it is done.
fn export(what: Export, folder: &Path) -> ExportState {
    let news = Arc::new(AtomicUsize::new(0));
    let of_thread = Arc::clone(&news);
    let mut exporter = Exporter::new(Arc::new(move || {
        of_thread.fetch_add(1, Ordering::SeqCst);
    }));
    assert!(!exporter.poll() && *exporter.state() == ExportState::Idle);
    exporter.start(what, level().0, folder.to_owned());
    wait_for("the export", || news.load(Ordering::SeqCst) == 1);
    assert!(exporter.poll() && !exporter.poll(), "it ends once");
    exporter.state().clone()
}

fn sum_at_last_texel(path: &Path) -> f32 {
    let image = FloatImage::read(path).expect("an EXR");
    assert_eq!((image.width, image.height), (4, 2));
    image.rgb("").expect("R, G, B")[7][1]
}

#[test]
fn one_map_goes_to_a_file_of_its_own_and_never_over_another() {
    let folder = tempfile::tempdir().expect("a folder");
    for number in 1..=2 {
        let ExportState::Done(path) = export(Export::Map(0), folder.path()) else {
            panic!("it can be written")
        };
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        assert!(
            name.starts_with("nephroid-") && name.ends_with(&format!("_floor-000{number}.exr")),
            "{name}"
        );
        assert_eq!(sum_at_last_texel(&path), 9.0, "caustic and direct");
        assert!(
            path.with_extension("uv").exists(),
            "its coordinates were made here"
        );
    }
}

#[test]
fn all_maps_go_to_a_folder_with_their_manifest() {
    let folder = tempfile::tempdir().expect("a folder");
    let name = folder_name("a scene");
    assert_eq!(name, "nephroid-a-scene-maps");
    for _ in 0..2 {
        // The second replaces the first.
        let state = export(Export::All(name.clone().into()), folder.path());
        assert_eq!(state, ExportState::Done(folder.path().join(&name)));
    }
    let maps = folder.path().join(name);
    assert_eq!(sum_at_last_texel(&maps.join("maps/0000_floor.exr")), 9.0);
    let manifest = std::fs::read_to_string(maps.join("manifest.json")).expect("a manifest");
    assert!(manifest.contains("maps/0000_floor.exr") && manifest.contains("maps/0000_floor.uv"));
}

#[test]
fn what_cannot_be_written_is_told_in_one_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("mine.txt"), "mine").expect("a file");
    for export_of in [
        (Export::All(".".into())),
        Export::All("mine.txt".into()),
        Export::Map(7),
    ] {
        let ExportState::Failed(sentence) = export(export_of.clone(), folder.path()) else {
            panic!("{export_of:?}")
        };
        assert!(!sentence.contains('\n') && sentence.len() > 20, "{sentence}");
    }
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("it is there").count(),
        1,
        "nothing is left there"
    );
}
