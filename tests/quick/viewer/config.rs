//! What is kept of scenes from one window to the next.

use nephroid::viewer::files::autosaver::SOON;
use nephroid::viewer::files::config::ConfigFolder;

use super::fixtures::model;
use super::*;

/// A window on `ring` that keeps what is set in a folder of its own.
struct SavedState {
    folder: tempfile::TempDir,
    options: ViewerOptions,
}

impl SavedState {
    fn new() -> Self {
        let folder = folder();
        let mut options = options("ring");
        options.files.config = Some(ConfigFolder::new(folder.path().to_owned()));
        Self { folder, options }
    }

    fn model(&self) -> Model {
        model(&self.options)
    }

    fn other(&self, change: impl FnOnce(&mut ViewerOptions)) -> Model {
        let mut options = self.options.clone();
        change(&mut options);
        model(&options)
    }

    fn file(&self) -> std::path::PathBuf {
        ConfigFolder::new(self.folder.path().to_owned()).scene_file("builtin:ring")
    }
}

/// A camera elsewhere, two bookmarks, a setting, an exposure and an edit.
fn use_it(model: &mut Model) {
    model.navigator.look(dvec2(100.0, 30.0));
    assert!(model.navigator.set_bookmark(0));
    model.navigator.look(dvec2(40.0, 0.0));
    assert!(model.navigator.set_bookmark(8));
    model.travel(NavigationMode::Orbit);
    model.choices.settings.seed = 7;
    model.choices.display.exposure_stops = 1.5;
    act(model, change(intensity(0, 5.0)));
}

fn undoable(model: &Model) -> usize {
    model.edits().history().undoable()
}

#[test]
fn what_was_set_is_found_again() {
    let kept = SavedState::new();
    let mut first = kept.model();
    use_it(&mut first);
    let changes = Change::diff(first.edits().loaded(), first.edits().scene());
    assert_eq!(changes.len(), 1);
    let (settings, scene) = (first.choices.settings.clone(), Arc::clone(first.scene()));
    let views = first.navigator.views();
    // At the end everything is written, however little time passed.
    drop(first);

    let mut second = kept.model();
    assert_eq!(second.choices.settings, settings);
    near(second.choices.display.exposure_stops, 1.5, 1e-12, "exposure");
    assert!(second.exposure_is_kept);
    assert_eq!(second.navigator.travel(), NavigationMode::Orbit);
    assert_eq!(second.scene().lights, scene.lights);
    for (number, bookmark) in views.bookmarks.iter().enumerate() {
        assert_eq!(bookmark.is_some(), [0, 8].contains(&number));
        assert_eq!(second.navigator.go_to_bookmark(number), bookmark.is_some());
    }
    assert_eq!(undoable(&second), 1);
    act(&mut second, vec![Command::Undo]);
    assert_eq!(second.scene().lights, second.edits().loaded().lights);

    // Another scene has nothing of it.
    let slab = Arc::new(built_in("slab"));
    assert!(!kept.other(|options| options.scene = slab).exposure_is_kept);
}

#[test]
fn what_is_asked_for_comes_first() {
    let kept = SavedState::new();
    use_it(&mut kept.model());
    let mut asked = kept.other(|options| {
        options.exposure_stops = Some(-2.0);
        options.files.settings_given = true;
    });
    assert_eq!(asked.choices.settings, kept.options.settings);
    near(asked.choices.display.exposure_stops, -2.0, 1e-12, "exposure");
    assert_eq!(undoable(&asked), 1, "edits were not asked away");
    // Who only looks around with other settings, or at other maps, takes none of what was kept away.
    let look = |model: &mut Model| {
        model.navigator.look(dvec2(5.0, 5.0));
        act(model, Vec::new());
    };
    look(&mut asked);
    drop(asked);
    let mut looking = kept.other(|options| options.maps = Some(Vec::new()));
    assert_eq!(undoable(&looking), 0);
    look(&mut looking);
    drop(looking);
    let again = kept.model();
    assert_eq!((undoable(&again), again.choices.settings.seed), (1, 7));
    drop(again);

    let camera = |model: &Model| {
        let camera = model.navigator.camera();
        (camera.position, camera.forward)
    };
    let untouched = kept.other(|options| options.files.config = None);
    let fresh = kept.other(|options| options.files.fresh = true);
    assert_eq!(undoable(&fresh), 0);
    let (found, expected) = (camera(&fresh), camera(&untouched));
    near(found.0, expected.0, 1e-9, "position");
    near(found.1, expected.1, 1e-9, "forward");
    drop(fresh);
    assert_eq!(undoable(&kept.model()), 1, "nothing was changed, nothing is lost");
}

#[test]
fn changes_are_written_within_a_second() {
    let kept = SavedState::new();
    let (mut model, file) = (kept.model(), kept.file());
    let now = Instant::now();
    model.act(Vec::new(), now);
    assert!(!file.exists(), "nothing changed");
    model.choices.settings.seed = 1;
    model.act(Vec::new(), now);
    assert!(model.due().is_some_and(|due| due <= now + SOON));
    // Changing on does not put it off.
    for tenth in 1..=10 {
        model.choices.settings.seed = 10 + tenth;
        model.act(Vec::new(), now + SOON * tenth as u32 / 10);
    }
    wait_for("the file", || file.exists());
    let text = fs::read_to_string(&file).expect("it is there");
    let written: Value = serde_json::from_str(&text).expect("it is whole");
    assert_eq!(written["settings"]["seed"], 20);
    assert_eq!(written["source"], "builtin:ring");
}

#[test]
fn broken_files_are_set_aside() {
    let kept = SavedState::new();
    let file = kept.file();
    let scenes = file.parent().expect("a folder");
    fs::create_dir_all(scenes).expect("it is made");
    for text in ["{ \"settings\": ", "[1, 2]", "\u{0}\u{1}", "{\"views\": 3}"] {
        fs::write(&file, text).expect("it is written");
        let mut model = kept.model();
        let warning = model.files.warning.clone().expect("it is told");
        says(warning, "renamed to");
        use_it(&mut model);
    }
    let files = fs::read_dir(scenes).expect("it is there");
    let names = files.map(|file| file.expect("a file").file_name().into_string().expect("a name"));
    let names: Vec<String> = names.collect();
    let broken = names.iter().filter(|name| name.contains(".broken-")).count();
    assert_eq!((broken, names.len()), (4, 5), "{names:?}");
}

#[test]
fn settings_of_other_versions_are_taken() {
    let kept = SavedState::new();
    use_it(&mut kept.model());
    let text = fs::read_to_string(kept.file()).expect("it is there");
    let mut value: Value = serde_json::from_str(&text).expect("it is whole");
    let settings = &mut value["settings"];
    settings["max_depth"] = "many".into();
    settings["invented"] = 1.into();
    settings.as_object_mut().expect("names").remove("kernel");
    value["invented"] = true.into();
    fs::write(kept.file(), value.to_string()).expect("it is written");
    let model = kept.model();
    assert!(model.files.warning.is_none(), "{:?}", model.files.warning);
    assert_eq!(model.choices.settings.seed, 7);
    assert_eq!(model.choices.settings.max_depth, kept.options.settings.max_depth);
}

#[test]
fn a_scene_that_is_left_is_kept() {
    let kept = SavedState::new();
    let mut model = kept.model();
    use_it(&mut model);
    for (name, edits) in [("slab", 0), ("ring", 1)] {
        model.open(&format!("builtin:{name}"));
        until(&mut model, "opened", |model| model.scene().name == name);
        assert_eq!(undoable(&model), edits);
        // A new scene is baked as the one before.
        assert_eq!(model.choices.settings.seed, 7);
    }
    assert_eq!(model.navigator.travel(), NavigationMode::Orbit);
    assert!(model.poll_files().is_none());
}
