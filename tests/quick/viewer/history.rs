//! One history of settings, display, camera path and scene.

use nephroid::viewer::panel::Panel;

use super::fixtures::redo;
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
    model.panel.automatic = false;
    (model, log)
}

fn change(model: &mut Model, is_dragging: bool, change: impl FnOnce(&mut Panel)) {
    let before = (model.panel.settings.clone(), model.panel.display);
    change(&mut model.panel);
    let changed = Some(Box::new(before));
    act(
        model,
        Wishes {
            changed,
            is_dragging,
            ..Wishes::default()
        },
    );
}

fn next(model: &Model) -> (Option<&str>, Option<&str>) {
    let history = model.edits().history();
    (history.next_undo(), history.next_redo())
}

#[test]
fn all_changes_are_undone_in_one_order() {
    let (mut model, log) = model();
    let (settings, scene) = (model.panel.settings.clone(), Arc::clone(model.scene()));
    let power = format!("power of `{}`", scene.lights[0].name);
    let order = ["sigma", &power, "tone map"];
    change(&mut model, false, |panel| {
        panel.settings.sigma = Sigma::Constant(4.0)
    });
    act(&mut model, wish(intensity(0, 7.0)));
    let edited = Arc::clone(model.scene());
    change(&mut model, false, |panel| panel.display.tone_map = ToneMap::Aces);
    // A change of the window's own, which no undo takes back.
    model.panel.display.exposure_stops = 3.5;

    for (index, what) in order.iter().enumerate().rev() {
        assert_eq!(next(&model), (Some(*what), order.get(index + 1).copied()));
        act(&mut model, undo());
    }
    assert_eq!(next(&model), (None, Some("sigma")));
    act(&mut model, undo());
    assert_eq!(model.panel.display.tone_map, Display::default().tone_map);
    assert_eq!(model.panel.display.exposure_stops, 3.5);
    assert_eq!(model.scene().lights, scene.lights);
    assert_eq!(model.panel.settings, settings);

    for what in order {
        assert_eq!(next(&model).1, Some(what));
        act(&mut model, redo());
    }
    assert_eq!(model.panel.settings.sigma, Sigma::Constant(4.0));
    assert_eq!(model.scene().lights, edited.lights);
    assert_eq!(model.panel.display.tone_map, ToneMap::Aces);
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
        let film = Some(FilmWish::Record(None));
        act(&mut model, with(Wishes::default(), |it| it.film = film));
    }
    let before = model.panel.film.clone();
    assert_eq!(before.keys.len(), 2);
    model.panel.film.keys.remove(0);
    model.panel.automatic = true;
    let changed = Wishes {
        changed_film: Some(Box::new(before.clone())),
        changed_automatic: true,
        ..Wishes::default()
    };
    act(&mut model, changed);
    assert_eq!(next(&model), (Some("automatic"), None));
    act(&mut model, undo());
    assert!(!model.panel.automatic);
    for left in [2, 1, 0] {
        act(&mut model, undo());
        assert_eq!(model.panel.film.keys, before.keys[..left]);
    }
    assert_eq!(next(&model), (None, Some("keys of the camera's path")));
    for _ in 0..4 {
        act(&mut model, redo());
    }
    assert_eq!(model.panel.film.keys, before.keys[1..]);
    assert!(model.panel.automatic);
}

#[test]
fn a_drag_is_one_step() {
    let (mut model, _log) = model();
    for drag in [&[2.0, 3.0, 4.0][..], &[5.0]] {
        for value in drag {
            change(&mut model, true, |panel| {
                panel.settings.sigma = Sigma::Constant(*value)
            });
        }
        act(&mut model, Wishes::default());
    }
    assert_eq!(model.edits().history().undoable(), 2);
    for (step, sigma) in [(undo(), 4.0), (undo(), 1.0), (redo(), 4.0)] {
        act(&mut model, step);
        assert_eq!(model.panel.settings.sigma, Sigma::Constant(sigma));
    }
    // Another change forgets what was undone.
    change(&mut model, false, |panel| {
        panel.settings.effects.set(Effect::Refraction, EffectSwitch::Off)
    });
    assert_eq!(next(&model), (Some("effects"), None));
    act(&mut model, redo());
    assert_eq!(model.panel.settings.sigma, Sigma::Constant(4.0));

    // A thousand steps are kept.
    let mut edits = EditedScene::new(options("ring").scene);
    let of_seed = |seed| with(BakeSettings::default(), |it| it.seed = seed);
    for seed in 0..1100 {
        edits.note_settings(&of_seed(seed), &of_seed(seed + 1));
        edits.release();
    }
    assert_eq!(edits.history().undoable(), 1000);
}
