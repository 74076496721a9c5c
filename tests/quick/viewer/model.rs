//! The window's state, with real bakes and without a window.

use super::fixtures::chosen;
use super::*;

/// Rays per steradian of a bake that takes longer than a test waits between its steps.
const LONG: f64 = 3e7;

fn model() -> (Model, tempfile::NamedTempFile) {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let model = fixtures::model(&with(options("ring"), |it| {
        it.event_log = Some(log.path().to_owned())
    }));
    (model, log)
}

fn baked() -> (Model, tempfile::NamedTempFile) {
    let (mut model, log) = model();
    bake(&mut model);
    (model, log)
}

fn act_at(model: &mut Model, now: Instant) {
    model.act(vec![Command::Release], now);
}

fn set_at(model: &mut Model, now: Instant, set: impl FnOnce(&mut Choices)) {
    let command = chosen(model, set);
    model.act(vec![command, Command::Release], now);
}

/// Names of events, levels left out: how many of them are seen depends on when one looks.
fn logged(log: &tempfile::NamedTempFile) -> Vec<String> {
    let events = events(log.path()).into_iter().map(|event| {
        assert!(event["seconds"].as_f64() >= Some(0.0), "{event}");
        event["event"].as_str().expect("a name").to_owned()
    });
    events.filter(|event| event != "level").collect()
}

#[test]
fn bakes_on_start_and_on_a_changed_setting() {
    let (mut model, log) = model();
    assert!(model.state.is_baking());
    bake(&mut model);
    assert_eq!(model.state, BakeState::Done);
    assert_eq!(model.layers(), [LayerKind::Caustic, LayerKind::Direct]);
    assert_eq!(logged(&log), ["baking", "done"]);

    set(&mut model, |it| it.settings.sigma = Sigma::Constant(4.0));
    assert!(model.state.is_baking());
    bake(&mut model);
    let sigma = model.last.as_ref().map(|last| last.request.settings.sigma);
    assert_eq!(sigma, Some(Sigma::Constant(4.0)));
    assert_eq!(logged(&log), ["baking", "done", "settings", "baking", "done"]);
}

#[test]
fn finer_bakes_never_show_coarser_levels() {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let mut settings = options("ring").settings;
    settings.density_per_sr = 20_000.0;
    let mut model = fixtures::model(&ViewerOptions {
        settings,
        event_log: Some(log.path().to_owned()),
        ..options("ring")
    });
    // Of every level that was shown, whether it is the last, and its error.
    let levels = |model: &mut Model| {
        let mut levels = Vec::new();
        while model.state.is_baking() || levels.is_empty() {
            act(model, Vec::new());
            if model.poll() {
                let last = model.last.as_ref().expect("there are new maps");
                levels.push((last.is_final, last.result.estimated_relative_rmse));
                assert!(!model.maps().is_empty());
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        model.poll();
        levels
    };
    let first = levels(&mut model);
    let names = events(log.path());
    assert!(names[0]["event"] == "baking" && names[1]["event"] == "level");
    let (is_final, limit) = first[first.len() - 1];
    let limit = limit.filter(|_| is_final).expect("it is estimated");
    set(&mut model, |it| it.settings.density_per_sr *= 4.0);
    let second = levels(&mut model);
    for (is_final, error) in &second {
        let is_better = error.is_some_and(|error| error <= limit);
        assert!(*is_final || is_better, "{error:?} was shown after {limit}");
    }
    assert!(second.last().is_some_and(|(is_final, _)| *is_final));
}

#[test]
fn changes_that_need_no_bake_bake_nothing() {
    let (mut model, log) = baked();
    set(&mut model, |it| {
        it.settings.effects.set(Effect::Chains, EffectSwitch::Off)
    });
    let later = Instant::now() + 2 * QUIET;
    for now in [Instant::now(), later, later + QUIET] {
        act_at(&mut model, now);
        assert!(!model.state.is_baking() && model.due().is_none());
    }
    assert_eq!(logged(&log), ["baking", "done"], "chains are the eye's");
    set_at(&mut model, later, |it| it.settings.sigma = Sigma::Constant(-1.0));
    model.act(vec![Command::Rebake], later);
    act_at(&mut model, later + QUIET);
    assert!(!model.state.is_baking(), "it is out of range");
    assert_eq!(logged(&log), ["baking", "done", "settings"]);
}

#[test]
fn changes_wait_until_they_rest() {
    let (mut model, log) = baked();
    let now = Instant::now();
    set_at(&mut model, now, |it| it.settings.density_per_sr = LONG);
    assert!(model.state.is_baking());
    // A change that is taken back bakes nothing.
    for seed in [5, 0] {
        set_at(&mut model, now, |it| it.settings.seed = seed);
    }
    act_at(&mut model, now + QUIET * 2);
    assert!(model.state.is_baking());
    assert_eq!(logged(&log).iter().filter(|event| *event == "baking").count(), 2);
    let now = now + QUIET * 3;
    for (step, sigma) in [2.0, 3.0, 4.0].into_iter().enumerate() {
        set_at(&mut model, now + QUIET / 2 * step as u32, |it| {
            it.settings.sigma = Sigma::Constant(sigma)
        });
    }
    assert_eq!(model.due(), Some(now + QUIET * 2));
    // What runs is not stopped before it has shown something.
    assert!(logged(&log).ends_with(&["settings"; 3].map(String::from)));
    set_at(&mut model, now + QUIET * 2, |it| {
        it.settings.density_per_sr = 1000.0
    });
    act_at(&mut model, now + QUIET * 3);
    bake(&mut model);
    let last = model.last.as_ref().expect("it is baked");
    assert_eq!(last.request.settings.sigma, Sigma::Constant(4.0));
    assert_eq!(logged(&log).last().map(String::as_str), Some("done"));
}

#[test]
fn edits_are_baked_and_undone() {
    let (mut model, log) = baked();
    let flux = |model: &Model| -> f64 {
        let maps = model.maps().iter();
        maps.map(|map| map.flux_w(LayerKind::Direct).luminance()).sum()
    };
    let (before, original) = (flux(&model), Arc::clone(model.scene()));
    let LightKind::Point { intensity: first, .. } = original.lights[0].kind else {
        panic!("the ring has a lamp")
    };
    let drag = |times: f64| Command::Edit(intensity(0, first.0 * times));
    assert!(!model.traces_lights(), "the layer holds direct light");
    // Two steps of one drag, then the mouse is let go.
    for times in [2.0, 4.0] {
        model.act(vec![drag(times)], Instant::now());
        // Until maps of this light come, its direct light is not that of the layer.
        assert!(model.traces_lights());
        let shown = model.maps_without_direct();
        let mut layers = shown.iter().flat_map(|map| &map.layers);
        assert!(!shown.is_empty() && layers.all(|layer| layer.kind == LayerKind::Caustic));
        model.choices.display.layer = LayerShown::Only(LayerKind::Caustic);
        assert!(!model.traces_lights(), "no direct light is shown");
        model.choices.display.layer = LayerShown::All;
    }
    act(&mut model, Vec::new());
    assert_eq!(model.edits().history().undoable(), 1, "a drag is one step");
    bake(&mut model);
    near(flux(&model) / before, 4.0, 1e-5, "four times the light");
    assert!(!model.traces_lights(), "the layer is that of the brighter light");

    // The second finds nothing to take back; the end of a drag and the wish to take it back may come in one frame.
    for commands in [
        vec![Command::Undo],
        vec![Command::Undo],
        vec![Command::Undo, drag(8.0)],
    ] {
        model.act(commands, Instant::now());
        assert_eq!(model.scene().lights, original.lights);
        bake(&mut model);
        assert_eq!(flux(&model), before);
    }

    act(&mut model, change(Edit::Material(0, MaterialEdit::Ior(0.5))));
    let refusal = model.refusal.as_ref().expect("it is refused");
    assert!(refusal.contains("0.5"), "{refusal}");
    assert!(!model.state.is_baking());
    let log = logged(&log).join(" ");
    assert!(log.contains("edit") && log.contains("undone"), "{log}");
}

#[test]
fn without_automatic_only_the_button_bakes() {
    let (mut model, _log) = baked();
    let now = Instant::now();
    model.choices.automatic = false;
    set_at(&mut model, now, |it| it.settings.seed = 5);
    act_at(&mut model, now + QUIET * 10);
    assert!(!model.state.is_baking() && model.due().is_none());
    model.act(vec![Command::Rebake], now);
    assert!(model.state.is_baking());
    bake(&mut model);
    set_at(&mut model, now, |it| it.settings.seed = 6);
    set_at(&mut model, now, |it| it.automatic = true);
    act_at(&mut model, now + QUIET);
    assert!(model.state.is_baking(), "switched on, it catches up");
}

#[test]
fn cancelling_keeps_the_shown_maps() {
    let (mut model, _log) = baked();
    let longer = chosen(&model, |it| it.settings.density_per_sr = LONG);
    act(&mut model, vec![longer, Command::Rebake]);
    act(&mut model, vec![Command::Cancel]);
    until(&mut model, "the end", |model| !model.state.is_baking());
    assert_eq!(model.state, BakeState::Cancelled);
    let last = model.last.as_ref().expect("it was baked");
    assert_eq!(last.request.settings.density_per_sr, 1000.0);
    // Each layer can be shown alone.
    assert!(model.shown_maps().iter().any(|map| map.layers.len() == 2));
    for kind in [LayerKind::Caustic, LayerKind::Direct] {
        model.choices.display.layer = LayerShown::Only(kind);
        let shown = model.shown_maps();
        assert!(!shown.is_empty());
        for map in shown.iter() {
            let mut maps = model.maps().iter();
            let whole = maps.find(|whole| Arc::ptr_eq(&whole.chart, &map.chart));
            let layer = whole.and_then(|whole| whole.layer(kind)).expect("it was baked");
            assert_eq!(map.layers, std::slice::from_ref(layer));
        }
    }
}

#[test]
fn given_maps_are_shown_without_a_bake() {
    let (first, _log) = baked();
    let mut model = fixtures::model(&with(options("ring"), |it| it.maps = Some(first.maps().to_vec())));
    let now = Instant::now();
    assert!(!model.poll());
    for now in [now, now + QUIET] {
        act_at(&mut model, now);
        assert_eq!(model.state, BakeState::Idle, "nothing changed");
    }
    assert_eq!(model.maps().len(), first.maps().len());
    set_at(&mut model, now, |it| it.settings.seed = 3);
    act_at(&mut model, now + QUIET);
    assert!(model.state.is_baking());
}
