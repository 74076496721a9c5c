//! One history of settings, display and scene.

use std::time::Instant;

use nephroid::effect::{Effect, EffectSwitch};
use nephroid::eye_pass::ToneMap;
use nephroid::scene::{Edit, builtin};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution, Sigma};
use nephroid::units::RadiantIntensity;
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::edits::EditedScene;
use nephroid::viewer::files::FilesOptions;
use nephroid::viewer::model::Model;
use nephroid::viewer::panel::{Display, FilmWish, Wishes};

/// A window that bakes nothing by itself, with its event log.
fn model() -> (Model, tempfile::NamedTempFile) {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let options = ViewerOptions {
        scene: std::sync::Arc::new(builtin::build("ring").expect("it is built in")),
        settings: BakeSettings {
            layers: vec![LayerKind::Caustic],
            map_resolution: MapResolution::Fixed {
                width: 16,
                height: 16,
            },
            ..BakeSettings::splat()
        },
        maps: Some(Vec::new()),
        size: (1280, 720),
        camera: None,
        exposure_stops: Some(0.0),
        stop: None,
        event_log: Some(log.path().to_owned()),
        files: FilesOptions::default(),
    };
    let mut model = Model::new(&options, || {}).expect("a model");
    model.panel.automatic = false;
    (model, log)
}

/// What a frame does in which the panel was changed like this.
fn change(model: &mut Model, is_dragging: bool, change: impl FnOnce(&mut Model)) {
    let before = (model.panel.settings.clone(), model.panel.display);
    change(model);
    let wishes = Wishes {
        changed: Some(Box::new(before)),
        is_dragging,
        ..Wishes::default()
    };
    model.act(&wishes, Instant::now());
}

fn undo(model: &mut Model) {
    let undo = true;
    model.act(
        &Wishes {
            undo,
            ..Wishes::default()
        },
        Instant::now(),
    );
}

fn redo(model: &mut Model) {
    let redo = true;
    model.act(
        &Wishes {
            redo,
            ..Wishes::default()
        },
        Instant::now(),
    );
}

fn next(model: &Model) -> (Option<&str>, Option<&str>) {
    let history = model.edits().history();
    (history.next_undo(), history.next_redo())
}

#[test]
fn settings_display_and_scene_are_taken_back_in_one_order_and_done_again() {
    let (mut model, log) = model();
    let (settings, scene) = (model.panel.settings.clone(), model.scene().clone());
    change(&mut model, false, |model| {
        model.panel.settings.sigma = Sigma::Constant(4.0);
    });
    let intensity = RadiantIntensity(7.0);
    let edit = Edit::LightIntensity { light: 0, intensity };
    let name = scene.lights[0].name.clone();
    let wishes = Wishes {
        edit: Some(edit),
        ..Wishes::default()
    };
    model.act(&wishes, Instant::now());
    let edited = model.scene().clone();
    change(&mut model, false, |model| {
        model.panel.display.tone_map = ToneMap::Aces;
    });
    // Nobody's change but the window's own: no undo brings it back.
    model.panel.display.exposure_stops = 3.5;

    assert_eq!(next(&model), (Some("tone map"), None));
    undo(&mut model);
    assert_eq!(model.panel.display.tone_map, Display::default().tone_map);
    assert_eq!(model.panel.display.exposure_stops, 3.5);
    let power = format!("power of `{name}`");
    assert_eq!(next(&model), (Some(power.as_str()), Some("tone map")));
    undo(&mut model);
    assert_eq!(model.scene().lights, scene.lights);
    assert_eq!(next(&model), (Some("sigma"), Some(power.as_str())));
    undo(&mut model);
    assert_eq!(model.panel.settings, settings);
    assert_eq!(next(&model), (None, Some("sigma")));
    undo(&mut model);
    assert_eq!(model.panel.settings, settings, "nothing is left to take back");

    for _ in 0..3 {
        redo(&mut model);
    }
    assert_eq!(model.panel.settings.sigma, Sigma::Constant(4.0));
    assert_eq!(model.scene().lights, edited.lights);
    assert_eq!(model.panel.display.tone_map, ToneMap::Aces);
    assert_eq!(next(&model), (Some("tone map"), None));

    let text = std::fs::read_to_string(log.path()).expect("a log");
    let of = |name: &str| {
        let events = text
            .lines()
            .map(|line| -> serde_json::Value { serde_json::from_str(line).expect("a line is JSON") });
        let named = events.filter(|event| event["event"] == name);
        named.map(|event| event["what"].to_string()).collect::<Vec<_>>()
    };
    let quoted = |text: &str| format!("{text:?}");
    let order = [quoted("sigma"), quoted(&power), quoted("tone map")];
    assert_eq!(of("redone"), order);
    assert_eq!(of("undone"), order.iter().rev().cloned().collect::<Vec<_>>());
}

#[test]
fn the_cameras_path_and_the_switch_of_baking_are_taken_back_too() {
    let (mut model, _log) = model();
    let record = Wishes {
        film: Some(FilmWish::Record(None)),
        ..Wishes::default()
    };
    model.act(&record, Instant::now());
    model.act(&record, Instant::now());
    let keys = model.panel.film.keys.clone();
    assert_eq!(keys.len(), 2);
    let before = model.panel.film.clone();
    model.panel.film.keys.remove(0);
    model.panel.automatic = true;
    let changed = Wishes {
        changed_film: Some(Box::new(before)),
        changed_automatic: true,
        ..Wishes::default()
    };
    model.act(&changed, Instant::now());
    assert_eq!(next(&model), (Some("automatic"), None));
    undo(&mut model);
    assert!(!model.panel.automatic);
    undo(&mut model);
    assert_eq!(model.panel.film.keys, keys);
    for left in [1, 0] {
        undo(&mut model);
        assert_eq!(model.panel.film.keys.len(), left);
    }
    assert_eq!(next(&model), (None, Some("keys of the camera's path")));
    for _ in 0..4 {
        redo(&mut model);
    }
    assert_eq!(model.panel.film.keys, keys[1..]);
    assert!(model.panel.automatic);
}

#[test]
fn a_drag_is_one_step_and_what_follows_it_another() {
    let (mut model, _log) = model();
    let sigma = |value: f64| move |model: &mut Model| model.panel.settings.sigma = Sigma::Constant(value);
    for value in [2.0, 3.0, 4.0] {
        change(&mut model, true, sigma(value));
    }
    model.act(&Wishes::default(), Instant::now());
    change(&mut model, true, sigma(5.0));
    model.act(&Wishes::default(), Instant::now());
    assert_eq!(model.edits().history().undoable(), 2);
    undo(&mut model);
    assert_eq!(model.panel.settings.sigma, Sigma::Constant(4.0));
    undo(&mut model);
    assert_eq!(model.panel.settings.sigma, Sigma::Constant(1.0));
    redo(&mut model);
    assert_eq!(model.panel.settings.sigma, Sigma::Constant(4.0), "the whole drag");
}

#[test]
fn another_change_forgets_what_was_taken_back() {
    let (mut model, _log) = model();
    change(&mut model, false, |model| model.panel.settings.seed = 7);
    undo(&mut model);
    change(&mut model, false, |model| {
        model
            .panel
            .settings
            .effects
            .set(Effect::Refraction, EffectSwitch::Off);
    });
    assert_eq!(next(&model), (Some("effects"), None));
    redo(&mut model);
    assert_eq!(model.panel.settings.seed, 0);
}

#[test]
fn no_more_than_a_thousand_steps_are_kept() {
    let scene = std::sync::Arc::new(builtin::build("ring").expect("it is built in"));
    let mut edits = EditedScene::new(scene);
    let of_seed = |seed| BakeSettings {
        seed,
        ..BakeSettings::default()
    };
    for seed in 0..1100 {
        edits.note_settings(&of_seed(seed), &of_seed(seed + 1));
        edits.release();
    }
    assert_eq!(edits.history().undoable(), 1000);
}
