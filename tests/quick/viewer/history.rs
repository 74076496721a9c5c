//! One history of settings, display, camera path and scene.

use super::fixtures::chosen;
use super::*;

/// A window that bakes nothing by itself, with its event log.
fn model() -> (Model, tempfile::NamedTempFile) {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let mut model = fixtures::model(&ViewerOptions {
        maps: Some(Vec::new()),
        exposure_stops: Some(0.0),
        event_log: Some(log.path().to_owned()),
        ..options("ring")
    });
    model.choices.automatic = false;
    (model, log)
}

fn next(model: &Model) -> (Option<&str>, Option<&str>) {
    let history = model.edits().history();
    (history.next_undo(), history.next_redo())
}

#[test]
fn all_changes_are_undone_in_one_order() {
    let (mut model, log) = model();
    let (settings, scene) = (model.choices.settings.clone(), Arc::clone(model.scene()));
    let power = format!("power of `{}`", scene.lights[0].name);
    let order = ["sigma", &power, "tone map"];
    set(&mut model, |it| it.settings.sigma = Sigma::Constant(4.0));
    act(&mut model, change(intensity(0, 7.0)));
    let edited = Arc::clone(model.scene());
    set(&mut model, |it| it.display.tone_map = ToneMap::Aces);
    // A change of the window's own, which no undo takes back.
    model.choices.display.exposure_stops = 3.5;

    for (index, what) in order.iter().enumerate().rev() {
        assert_eq!(next(&model), (Some(*what), order.get(index + 1).copied()));
        act(&mut model, vec![Command::Undo]);
    }
    assert_eq!(next(&model), (None, Some("sigma")));
    act(&mut model, vec![Command::Undo]);
    assert_eq!(model.choices.display.tone_map, Display::default().tone_map);
    assert_eq!(model.choices.display.exposure_stops, 3.5);
    assert_eq!(model.scene().lights, scene.lights);
    assert_eq!(model.choices.settings, settings);

    for what in order {
        assert_eq!(next(&model).1, Some(what));
        act(&mut model, vec![Command::Redo]);
    }
    assert_eq!(model.choices.settings.sigma, Sigma::Constant(4.0));
    assert_eq!(model.scene().lights, edited.lights);
    assert_eq!(model.choices.display.tone_map, ToneMap::Aces);
    assert_eq!(next(&model), (Some("tone map"), None));

    let mut logged = events(log.path());
    logged.retain(|event| event["event"] == "undone" || event["event"] == "redone");
    let logged: Vec<_> = logged.iter().map(|event| &event["what"]).collect();
    assert_eq!(logged, ["tone map", &power, "sigma", "sigma", &power, "tone map"]);
}

#[test]
fn camera_path_and_automatic_are_undone() {
    let (mut model, _log) = model();
    for _ in 0..2 {
        act(&mut model, vec![Command::Film(FilmCommand::Record(None))]);
    }
    let before = model.choices.film.clone();
    assert_eq!(before.keys.len(), 2);
    set(&mut model, |it| {
        it.film.keys.remove(0);
        it.automatic = true;
    });
    assert_eq!(next(&model), (Some("automatic"), None));
    act(&mut model, vec![Command::Undo]);
    assert!(!model.choices.automatic);
    for left in [2, 1, 0] {
        act(&mut model, vec![Command::Undo]);
        assert_eq!(model.choices.film.keys, before.keys[..left]);
    }
    assert_eq!(next(&model), (None, Some("keys of the camera's path")));
    for _ in 0..4 {
        act(&mut model, vec![Command::Redo]);
    }
    assert_eq!(model.choices.film.keys, before.keys[1..]);
    assert!(model.choices.automatic);
}

#[test]
fn a_drag_is_one_step() {
    let (mut model, _log) = model();
    for drag in [&[2.0, 3.0, 4.0][..], &[5.0]] {
        for value in drag {
            let command = chosen(&model, |it| it.settings.sigma = Sigma::Constant(*value));
            model.act(vec![command], Instant::now());
        }
        act(&mut model, Vec::new());
    }
    assert_eq!(model.edits().history().undoable(), 2);
    for (step, sigma) in [(Command::Undo, 4.0), (Command::Undo, 1.0), (Command::Redo, 4.0)] {
        act(&mut model, vec![step]);
        assert_eq!(model.choices.settings.sigma, Sigma::Constant(sigma));
    }
    // Another change forgets what was undone.
    set(&mut model, |it| {
        it.settings.effects.set(Effect::Refraction, EffectSwitch::Off)
    });
    assert_eq!(next(&model), (Some("effects"), None));
    act(&mut model, vec![Command::Redo]);
    assert_eq!(model.choices.settings.sigma, Sigma::Constant(4.0));

    // A thousand steps are kept.
    let mut edits = EditedScene::new(options("ring").scene);
    let of_seed = |seed| with(BakeSettings::default(), |it| it.seed = seed);
    for seed in 0..1100 {
        edits.note_settings(&of_seed(seed), &of_seed(seed + 1));
        edits.release();
    }
    assert_eq!(edits.history().undoable(), 1000);
}
