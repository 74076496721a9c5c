//! Opening scenes while the window is open, without the window.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::accesskit::Role;
use nephroid::scene::{Edit, builtin};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::units::RadiantIntensity;
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::files::recent::{MOST, Recent};
use nephroid::viewer::files::{FilesOptions, typed};
use nephroid::viewer::model::Model;
use nephroid::viewer::panel::Wishes;

use super::headless::Headless;
use super::scene_file;

const PATIENCE: Duration = Duration::from_secs(120);

fn options(log: &Path) -> ViewerOptions {
    ViewerOptions {
        scene: Arc::new(builtin::build("ring").expect("it is built in")),
        settings: BakeSettings {
            density_per_sr: 300.0,
            map_resolution: MapResolution::Fixed {
                width: 16,
                height: 16,
            },
            layers: vec![LayerKind::Caustic],
            ..BakeSettings::splat()
        },
        maps: None,
        size: (640, 480),
        camera: None,
        exposure_stops: None,
        stop: None,
        event_log: Some(log.to_owned()),
        files: FilesOptions::default(),
    }
}

fn until(model: &mut Model, what: &str, is_so: impl Fn(&Model) -> bool) {
    let start = Instant::now();
    while !is_so(model) {
        model.poll_files();
        model.poll();
        model.act(&Wishes::default(), Instant::now());
        assert!(start.elapsed() < PATIENCE, "never {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn is_baked(model: &Model) -> bool {
    let is_done = !model.state().is_baking() && model.last.as_ref().is_some_and(|last| last.is_final);
    is_done && model.files.loader.loading().is_none()
}

fn brighter() -> Wishes {
    Wishes {
        edit: Some(Edit::LightIntensity {
            light: 0,
            intensity: RadiantIntensity(77.0),
        }),
        ..Wishes::default()
    }
}

fn opened(log: &Path) -> Vec<String> {
    let text = fs::read_to_string(log).expect("it is written");
    let lines = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("a line is JSON"));
    lines
        .filter(|line: &serde_json::Value| line["event"] == "opened")
        .map(|line| line["scene"].as_str().expect("it has a name").to_owned())
        .collect()
}

#[test]
fn another_scene_takes_the_place_of_the_first_with_nothing_of_it_left() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("log");
    let mut model = Model::new(&options(&log), || ()).expect("threads are to be had");
    until(&mut model, "baked", is_baked);
    model.act(&brighter(), Instant::now());
    assert_eq!(model.edits().history().undoable(), 1);
    let ring = Arc::clone(model.scene());

    let path = scene_file::glb(folder.path(), "second", "100");
    model.open(&format!(" \"{}\" ", path.display()));
    assert!(
        Arc::ptr_eq(model.scene(), &ring),
        "until it is there the first one stays"
    );
    until(&mut model, "opened", |model| model.scene().name == "second");
    assert_eq!(model.edits().history().undoable(), 0);
    assert!(Arc::ptr_eq(model.edits().loaded(), model.scene()));
    until(&mut model, "baked", is_baked);
    let last = model.last.as_ref().expect("it was baked");
    assert!(
        Arc::ptr_eq(&last.request.scene, model.scene()),
        "its maps are its own"
    );
    assert_eq!(
        model.files.recent.paths(),
        [path.canonicalize().expect("it is there")]
    );
    // What is asked for while another is being read takes its place.
    model.open("builtin:slab");
    model.open("builtin:ball");
    until(&mut model, "opened", |model| model.scene().name == "ball");
    until(&mut model, "baked", is_baked);
    assert_eq!(opened(&log), ["second", "ball"]);
    assert_eq!(
        model.files.recent.paths().len(),
        1,
        "built-in scenes are no files"
    );
}

#[test]
fn what_cannot_be_opened_leaves_scene_maps_and_edits_and_says_why() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("log");
    let mut model = Model::new(&options(&log), || ()).expect("threads are to be had");
    until(&mut model, "baked", is_baked);
    model.act(&brighter(), Instant::now());
    until(&mut model, "baked", is_baked);
    let (scene, last) = (
        Arc::clone(model.scene()),
        model.last.clone().expect("it was baked"),
    );

    let broken = scene_file::no_scene(folder.path());
    for source in [
        broken.display().to_string(),
        "no such file.glb".to_owned(),
        "builtin:nothing".to_owned(),
    ] {
        model.open(&source);
        until(&mut model, "refused", |model| model.files.refusal.is_some());
        let sentence = model.files.refusal.clone().expect("it is refused");
        assert!(sentence.contains(&source), "{sentence}");
        assert!(model.files.loader.loading().is_none());
        assert!(Arc::ptr_eq(model.scene(), &scene));
        assert!(Arc::ptr_eq(model.last.as_ref().expect("it was baked"), &last));
        assert_eq!(model.edits().history().undoable(), 1);
    }
    assert_eq!(opened(&log), [""; 0]);
    model.open("  ");
    assert!(model.files.loader.loading().is_none(), "nothing was typed");
}

#[test]
fn recent_files_come_newest_first_each_once_and_only_while_they_are_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let paths: Vec<_> = (0..MOST + 2)
        .map(|index| {
            let path = folder.path().join(format!("{index}.glb"));
            fs::write(&path, "").expect("it is written");
            path.canonicalize().expect("it is there")
        })
        .collect();
    let mut recent = Recent::default();
    for path in &paths {
        recent.opened(&path.display().to_string());
    }
    let newest_first: Vec<_> = paths.iter().rev().take(MOST).cloned().collect();
    assert_eq!(recent.paths(), newest_first);
    // By another spelling it is the same file.
    recent.opened(&format!("{}/./5.glb", folder.path().display()));
    assert_eq!(recent.paths()[0], paths[5]);
    assert_eq!(recent.paths().len(), MOST);
    fs::remove_file(&paths[5]).expect("it was there");
    assert_eq!(Recent::of(recent.paths().to_vec()).paths().len(), MOST - 1);
    recent.opened("builtin:ring");
    recent.opened("gone.glb");
    assert_eq!(recent.paths().len(), MOST, "neither is a file");
}

#[test]
fn a_path_is_taken_as_it_was_pasted() {
    for (text, meant) in [
        (" a b.glb\n", "a b.glb"),
        ("\"C:\\x.glb\"", "C:\\x.glb"),
        ("'x.glb'", "x.glb"),
        ("\"x.glb", "\"x.glb"),
        ("builtin:ring", "builtin:ring"),
        ("", ""),
    ] {
        assert_eq!(typed(text), meant);
    }
    let home = std::env::var("HOME").expect("tests run in a home");
    assert_eq!(typed("~/x.glb"), format!("{}/x.glb", home.trim_end_matches('/')));
}

fn press(panel: &mut Headless, name: &str) {
    let button = Headless::rect_of(panel.named(Role::Button, name));
    panel.click(button.center());
}

#[test]
fn enter_opens_the_typed_path_and_a_list_the_built_in_scenes() {
    let scene = builtin::build("ring").expect("it is built in");
    let mut panel = Headless::with_scene(scene, BakeSettings::splat(), (1280.0, 720.0));
    let section = Headless::rect_of(panel.named(Role::DisclosureTriangle, "Scene"));
    panel.click(section.center());
    let field = panel
        .nodes()
        .find(|node| node.role() == Role::TextInput)
        .map(Headless::rect_of);
    let field = field.expect("there is a path field");
    assert!(field.width() > 150.0, "a path has room there: {field:?}");
    panel.click(field.center());
    panel.type_text("x.glb");
    assert!(
        panel
            .wishes
            .open
            .as_ref()
            .is_some_and(|open| open.contains("x.glb")),
        "{:?}",
        panel.wishes.open
    );
    panel.wishes = Wishes::default();
    press(&mut panel, "Built-in");
    press(&mut panel, "slab");
    assert_eq!(panel.wishes.open.as_deref(), Some("builtin:slab"));
    panel.wishes = Wishes::default();
    press(&mut panel, "Open…");
    assert!(panel.wishes.browse && panel.wishes.open.is_none());
    panel.loading = Some("y.glb".into());
    panel.file_refusal = Some("y.glb: is no scene".into());
    panel.settle();
    assert!(panel.says("loading y.glb …") && panel.says("y.glb: is no scene"));
    assert!(!panel.says("The graphics device was lost"));
    panel.lost_device = true;
    panel.settle();
    assert!(panel.says("The graphics device was lost and came back"));
}
