//! Opening scenes while the window is open.

use nephroid::viewer::files::{MOST_RECENT as MOST, Recent, typed};

use super::*;

fn model() -> (Model, tempfile::TempDir) {
    let folder = folder();
    let mut model = fixtures::model(&ViewerOptions {
        event_log: Some(folder.path().join("log")),
        ..options("ring")
    });
    act(&mut model, change(intensity(0, 77.0)));
    bake(&mut model);
    (model, folder)
}

fn opened(folder: &tempfile::TempDir) -> Vec<String> {
    let mut events = events(&folder.path().join("log"));
    events.retain(|event| event["event"] == "opened");
    let scene = |event: &Value| event["scene"].as_str().expect("a name").to_owned();
    events.iter().map(scene).collect()
}

#[test]
fn another_scene_takes_the_place_of_the_first() {
    let (mut model, folder) = model();
    assert_eq!(model.edits().history().undoable(), 1);
    let ring = Arc::clone(model.scene());
    let path = scene_file::glb(folder.path(), "second", "100");
    model.open(&format!(" \"{}\" ", path.display()));
    // The first stays until the other is there.
    assert!(Arc::ptr_eq(model.scene(), &ring));
    until(&mut model, "opened", |model| model.scene().name == "second");
    assert_eq!(model.edits().history().undoable(), 0);
    assert!(Arc::ptr_eq(model.edits().loaded(), model.scene()));
    // Its maps are its own.
    bake(&mut model);
    let path = path.canonicalize().expect("it is there");
    assert_eq!(model.files.recent.paths(), [path]);
    // What is asked for while another is being read takes its place.
    model.open("builtin:slab");
    model.open("builtin:ball");
    until(&mut model, "opened", |model| model.scene().name == "ball");
    assert_eq!(opened(&folder), ["second", "ball"]);
    // Built-in scenes are no files.
    assert_eq!(model.files.recent.paths().len(), 1);
}

#[test]
fn a_refused_file_leaves_all_as_it_was() {
    let (mut model, folder) = model();
    let scene = Arc::clone(model.scene());
    let last = model.last.clone().expect("it was baked");
    let broken = scene_file::no_scene(folder.path()).display().to_string();
    for source in [&broken, "no such file.glb", "builtin:nothing"] {
        model.open(source);
        until(&mut model, "refused", |model| model.files.refusal.is_some());
        let sentence = model.files.refusal.clone().expect("it is refused");
        assert!(sentence.contains(source), "{sentence}");
        assert!(model.files.loading().is_none());
        assert!(Arc::ptr_eq(model.scene(), &scene));
        assert!(Arc::ptr_eq(model.last.as_ref().expect("it was baked"), &last));
        assert_eq!(model.edits().history().undoable(), 1);
    }
    assert_eq!(opened(&folder), [""; 0]);
    model.open("  ");
    assert!(model.files.loading().is_none(), "nothing was typed");
}

#[test]
fn recent_files_are_newest_first_and_there() {
    let folder = folder();
    let path = |index: usize| {
        let path = folder.path().join(format!("{index}.glb"));
        fs::write(&path, "").expect("it is written");
        path.canonicalize().expect("it is there")
    };
    let paths: Vec<_> = (0..MOST + 2).map(path).collect();
    let mut recent = Recent::default();
    for path in &paths {
        recent.opened(&path.display().to_string());
    }
    assert!(recent.paths().iter().eq(paths.iter().rev().take(MOST)));
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
fn paths_are_taken_as_pasted() {
    let home = std::env::var("HOME").expect("tests run in a home");
    let at_home = format!("{}/x.glb", home.trim_end_matches('/'));
    for (text, meant) in [
        (" a b.glb\n", "a b.glb"),
        ("\"C:\\x.glb\"", "C:\\x.glb"),
        ("'x.glb'", "x.glb"),
        ("\"x.glb", "\"x.glb"),
        ("builtin:ring", "builtin:ring"),
        ("", ""),
        ("~/x.glb", &at_home),
    ] {
        assert_eq!(typed(text), meant);
    }
}

#[test]
fn panel_opens_paths_and_builtin_scenes() {
    let mut panel = Headless::new(BakeSettings::splat());
    panel.open("Scene");
    let field = panel.find(Role::TextInput, |_| true).expect("a field").rect();
    assert!(field.width() > 150.0, "a path has room there: {field:?}");
    panel.click_at(field.center());
    panel.type_text("x.glb");
    assert_eq!(panel.asked(), [Command::Open("x.glb".into())]);
    panel.press("Built-in");
    panel.press("slab");
    assert_eq!(panel.asked(), [Command::Open("builtin:slab".into())]);
    panel.press("Open…");
    assert_eq!(panel.asked(), [Command::Browse]);
    assert!(!panel.says("The graphics device was lost"));
    panel.tell(|model| {
        model.picture.lost_device = true;
        model.open("y.glb");
        model.files.refusal = Some("y.glb: is no scene".into());
    });
    panel.assert_says(&[
        "loading y.glb …",
        "y.glb: is no scene",
        "device was lost and came back",
    ]);
}
