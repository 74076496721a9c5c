//! The window's state, with real bakes and without a window.

use std::sync::Arc;
use std::time::{Duration, Instant};

use nephroid::effect::{Effect, EffectSwitch};
use nephroid::progress::Control;
use nephroid::scene::{Edit, LightKind, Scene, builtin};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution, Sigma};
use nephroid::units::RadiantIntensity;
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::debounce::QUIET;
use nephroid::viewer::files::FilesOptions;
use nephroid::viewer::model::Model;
use nephroid::viewer::panel::{LayerShown, Wishes};
use nephroid::viewer::worker::BakeState;

const PATIENCE: Duration = Duration::from_secs(120);

fn options(log: &tempfile::NamedTempFile, density_per_sr: f64) -> ViewerOptions {
    ViewerOptions {
        scene: Arc::new(builtin::build("ring").expect("it is built in")),
        settings: BakeSettings {
            density_per_sr,
            map_resolution: MapResolution::Fixed {
                width: 32,
                height: 32,
            },
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..BakeSettings::splat()
        },
        maps: None,
        size: (640, 480),
        camera: None,
        exposure_stops: None,
        stop: Some(Arc::new(Control::default())),
        event_log: Some(log.path().to_owned()),
        files: FilesOptions::default(),
    }
}

fn model(density_per_sr: f64) -> (Model, tempfile::NamedTempFile) {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let model = Model::new(&options(&log, density_per_sr), || ()).expect("threads are to be had");
    (model, log)
}

/// Frames until the bake is settled.
fn run(model: &mut Model) {
    let start = Instant::now();
    loop {
        model.poll();
        model.act(&Wishes::default(), Instant::now());
        if !model.state().is_baking() {
            model.poll();
            return;
        }
        assert!(start.elapsed() < PATIENCE, "it never ends");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Names of events, levels left out: how many of them are seen depends on when one looks.
fn logged(log: &tempfile::NamedTempFile) -> Vec<String> {
    let mut events = all_logged(log);
    events.retain(|event| event != "level");
    events
}

fn all_logged(log: &tempfile::NamedTempFile) -> Vec<String> {
    let text = std::fs::read_to_string(log.path()).expect("it is written");
    let event = |line: &str| {
        let event: serde_json::Value = serde_json::from_str(line).expect("a line is JSON");
        assert!(event["seconds"].as_f64() >= Some(0.0), "{line}");
        event["event"].as_str().expect("it has a name").to_owned()
    };
    text.lines().map(event).collect()
}

#[test]
fn it_bakes_on_start_and_shows_every_layer() {
    let (mut model, log) = model(1000.0);
    assert!(model.state().is_baking());
    run(&mut model);
    assert_eq!(*model.state(), BakeState::Done);
    assert_eq!(model.layers(), [LayerKind::Caustic, LayerKind::Direct]);
    assert!(model.last.as_ref().is_some_and(|last| last.is_final));
    assert_eq!(logged(&log), ["baking", "done"]);
}

#[test]
fn levels_are_shown_before_the_bake_is_done_and_a_finer_bake_never_shows_coarser_ones() {
    let (mut model, log) = model(20_000.0);
    let mut errors = Vec::new();
    let mut watch = |model: &mut Model| {
        let start = Instant::now();
        while model.state().is_baking() {
            model.act(&Wishes::default(), Instant::now());
            if model.poll() {
                let last = model.last.as_ref().expect("there are new maps");
                errors.push((last.is_final, last.result.estimated_relative_rmse));
                assert!(!model.maps().is_empty());
            }
            assert!(start.elapsed() < PATIENCE, "it never ends");
            std::thread::sleep(Duration::from_millis(1));
        }
        model.poll();
    };
    watch(&mut model);
    let first = all_logged(&log);
    assert_eq!(first[..2], ["baking", "level"], "{first:?}");
    model.panel.settings.density_per_sr *= 4.0;
    model.act(&Wishes::default(), Instant::now());
    watch(&mut model);
    let done = errors.iter().position(|(is_final, _)| *is_final);
    let (before, after) = errors.split_at(done.expect("the first bake ends") + 1);
    let limit = before[before.len() - 1].1.expect("it is estimated");
    for (is_final, error) in after {
        assert!(
            *is_final || error.is_some_and(|error| error <= limit),
            "{error:?} was shown after {limit}"
        );
    }
    assert!(after.last().is_some_and(|(is_final, _)| *is_final));
}

/// A bake that takes longer than a test waits between its steps.
const LONG: f64 = 3e7;

#[test]
fn the_eyes_chains_are_switched_without_a_bake() {
    let (mut model, log) = model(1000.0);
    run(&mut model);
    let effects = &mut model.panel.settings.effects;
    effects.set(Effect::Chains, EffectSwitch::Off);
    let later = Instant::now() + 2 * QUIET;
    for now in [Instant::now(), later, later + QUIET] {
        model.act(&Wishes::default(), now);
        assert!(!model.state().is_baking() && model.due().is_none());
    }
    assert_eq!(logged(&log), ["baking", "done"]);
}

#[test]
fn a_changed_setting_is_baked_at_once() {
    let (mut model, log) = model(1000.0);
    run(&mut model);
    model.panel.settings.sigma = Sigma::Constant(4.0);
    model.act(&Wishes::default(), Instant::now());
    assert!(model.state().is_baking());
    run(&mut model);
    let sigma = model.last.as_ref().map(|last| last.request.settings.sigma);
    assert_eq!(sigma, Some(Sigma::Constant(4.0)));
    assert_eq!(logged(&log), ["baking", "done", "settings", "baking", "done"]);
}

#[test]
fn while_a_request_has_shown_nothing_changes_wait_until_they_rest() {
    let (mut model, log) = model(1000.0);
    run(&mut model);
    model.panel.settings.density_per_sr = LONG;
    let now = Instant::now();
    model.act(&Wishes::default(), now);
    assert!(model.state().is_baking());
    for (step, sigma) in [2.0, 3.0, 4.0].into_iter().enumerate() {
        model.panel.settings.sigma = Sigma::Constant(sigma);
        model.act(&Wishes::default(), now + QUIET / 2 * step as u32);
    }
    assert_eq!(model.due(), Some(now + QUIET * 2));
    let events = logged(&log);
    assert_eq!(
        events[events.len() - 3..],
        ["settings"; 3],
        "what runs is not stopped before it has shown something"
    );
    model.panel.settings.density_per_sr = 1000.0;
    model.act(&Wishes::default(), now + QUIET * 2);
    model.act(&Wishes::default(), now + QUIET * 3);
    run(&mut model);
    let last = model.last.as_ref().expect("it is baked");
    assert_eq!(last.request.settings.sigma, Sigma::Constant(4.0));
    assert_eq!(logged(&log).last().map(String::as_str), Some("done"));
}

#[test]
fn a_change_that_is_taken_back_before_it_is_baked_bakes_nothing() {
    let (mut model, log) = model(1000.0);
    run(&mut model);
    model.panel.settings.density_per_sr = LONG;
    let now = Instant::now();
    model.act(&Wishes::default(), now);
    let asked = model.panel.settings.clone();
    model.panel.settings.seed = 5;
    model.act(&Wishes::default(), now);
    model.panel.settings = asked;
    model.act(&Wishes::default(), now);
    model.act(&Wishes::default(), now + QUIET * 2);
    assert!(model.state().is_baking());
    let bakes = logged(&log).into_iter().filter(|event| event == "baking");
    assert_eq!(bakes.count(), 2);
}

#[test]
fn an_edited_scene_is_baked_and_an_edit_taken_back_too() {
    let (mut model, log) = model(1000.0);
    run(&mut model);
    let flux = |model: &Model| -> f64 {
        let maps = model.maps().iter();
        maps.map(|map| map.flux_w(LayerKind::Direct).luminance()).sum()
    };
    let (before, original) = (flux(&model), Arc::clone(model.scene()));
    let brighter = |times: f64| Wishes {
        edit: Some(Edit::LightIntensity {
            light: 0,
            intensity: intensity(&original) * times,
        }),
        is_dragging: true,
        ..Wishes::default()
    };
    assert!(!model.traces_lights(), "the layer holds it");
    // Two steps of one drag, then the mouse is let go.
    for times in [2.0, 4.0] {
        model.act(&brighter(times), Instant::now());
        // Until maps of this light come, its direct light is not that of the layer.
        assert!(model.traces_lights());
        let shown = model.maps_without_direct();
        let layers = shown.iter().flat_map(|map| &map.layers).map(|layer| layer.kind);
        assert_eq!(layers.collect::<Vec<_>>(), [LayerKind::Caustic]);
        model.panel.display.layer = LayerShown::Only(LayerKind::Caustic);
        assert!(!model.traces_lights(), "no direct light is shown");
        model.panel.display.layer = LayerShown::All;
    }
    model.act(&Wishes::default(), Instant::now());
    assert_eq!(
        model.edits().history().undoable(),
        1,
        "a drag is taken back as one"
    );
    wait_until_baked(&mut model);
    assert!(
        (flux(&model) / before - 4.0).abs() < 1e-5,
        "{}",
        flux(&model) / before
    );
    assert!(!model.traces_lights(), "the layer is that of the brighter light");

    let undo = Wishes {
        undo: true,
        ..Wishes::default()
    };
    model.act(&undo, Instant::now());
    assert_eq!(model.scene().lights, original.lights);
    wait_until_baked(&mut model);
    assert_eq!(flux(&model), before);
    model.act(&undo, Instant::now());
    assert_eq!(
        model.scene().lights,
        original.lights,
        "nothing is left to take back"
    );

    // The end of a drag and the wish to take it back may come in one frame.
    let both = Wishes {
        undo: true,
        ..brighter(8.0)
    };
    model.act(&both, Instant::now());
    assert_eq!(model.scene().lights, original.lights);
    wait_until_baked(&mut model);

    let wrong = Wishes {
        edit: Some(Edit::MaterialIor {
            material: 0,
            ior: 0.5,
        }),
        ..Wishes::default()
    };
    model.act(&wrong, Instant::now());
    assert!(
        model
            .refusal
            .as_ref()
            .is_some_and(|sentence| sentence.contains("0.5")),
        "{:?}",
        model.refusal
    );
    assert!(!model.state().is_baking());
    let log = logged(&log);
    assert!(
        log.contains(&"edit".into()) && log.contains(&"undone".into()),
        "{log:?}"
    );
}

fn intensity(scene: &Scene) -> RadiantIntensity {
    match scene.lights[0].kind {
        LightKind::Point { intensity, .. } => intensity,
        _ => panic!("the ring has a lamp"),
    }
}

/// Frames until the shown maps are what is wanted now.
fn wait_until_baked(model: &mut Model) {
    let start = Instant::now();
    loop {
        run(model);
        let last = model.last.as_ref().expect("it was baked");
        if last.is_final && Arc::ptr_eq(&last.request.scene, model.scene()) {
            return;
        }
        assert!(start.elapsed() < PATIENCE, "it never comes");
    }
}

#[test]
fn without_automatic_only_the_button_bakes() {
    let (mut model, _log) = model(1000.0);
    run(&mut model);
    let now = Instant::now();
    model.panel.automatic = false;
    model.panel.settings.seed = 5;
    model.act(&Wishes::default(), now);
    model.act(&Wishes::default(), now + QUIET * 10);
    assert!(!model.state().is_baking() && model.due().is_none());
    model.act(
        &Wishes {
            rebake: true,
            ..Wishes::default()
        },
        now,
    );
    assert!(model.state().is_baking());
    run(&mut model);
    model.panel.settings.seed = 6;
    model.act(&Wishes::default(), now);
    model.panel.automatic = true;
    model.act(&Wishes::default(), now);
    model.act(&Wishes::default(), now + QUIET);
    assert!(model.state().is_baking(), "switched on, it catches up");
}

#[test]
fn settings_out_of_range_are_not_baked() {
    let (mut model, log) = model(1000.0);
    run(&mut model);
    model.panel.settings.sigma = Sigma::Constant(-1.0);
    let now = Instant::now();
    model.act(
        &Wishes {
            rebake: true,
            ..Wishes::default()
        },
        now,
    );
    model.act(&Wishes::default(), now + QUIET);
    assert!(!model.state().is_baking());
    assert_eq!(logged(&log), ["baking", "done", "settings"]);
}

#[test]
fn cancelling_keeps_the_maps_that_are_shown() {
    let (mut model, _log) = model(1000.0);
    run(&mut model);
    model.panel.settings.density_per_sr = 3e7;
    model.act(
        &Wishes {
            rebake: true,
            ..Wishes::default()
        },
        Instant::now(),
    );
    model.act(
        &Wishes {
            cancel: true,
            ..Wishes::default()
        },
        Instant::now(),
    );
    run(&mut model);
    assert_eq!(*model.state(), BakeState::Cancelled);
    assert_eq!(
        model
            .last
            .as_ref()
            .map(|last| last.request.settings.density_per_sr),
        Some(1000.0)
    );
    assert!(!model.maps().is_empty());
}

#[test]
fn one_layer_can_be_shown_alone() {
    let (mut model, _log) = model(1000.0);
    run(&mut model);
    assert!(model.shown_maps().iter().any(|map| map.layers.len() == 2));
    for kind in [LayerKind::Caustic, LayerKind::Direct] {
        model.panel.display.layer = LayerShown::Only(kind);
        let shown = model.shown_maps();
        assert!(!shown.is_empty());
        for map in shown.iter() {
            assert!(map.layers.len() == 1 && map.layers[0].kind == kind);
            let whole = model
                .maps()
                .iter()
                .find(|whole| Arc::ptr_eq(&whole.chart, &map.chart));
            assert_eq!(whole.and_then(|whole| whole.layer(kind)), Some(&map.layers[0]));
        }
    }
}

#[test]
fn given_maps_are_shown_without_a_bake() {
    let (mut first, log) = model(1000.0);
    run(&mut first);
    let maps = first.maps().to_vec();
    let options = ViewerOptions {
        maps: Some(maps),
        ..options(&log, 1000.0)
    };
    let mut model = Model::new(&options, || ()).expect("threads are to be had");
    assert!(!model.poll());
    assert_eq!(*model.state(), BakeState::Idle);
    assert_eq!(model.maps().len(), first.maps().len());
    let now = Instant::now();
    model.act(&Wishes::default(), now);
    model.act(&Wishes::default(), now + QUIET);
    assert_eq!(
        *model.state(),
        BakeState::Idle,
        "nothing changed, nothing is baked"
    );
    model.panel.settings.seed = 3;
    model.act(&Wishes::default(), now);
    model.act(&Wishes::default(), now + QUIET);
    assert!(model.state().is_baking());
}

#[test]
fn a_log_that_cannot_be_written_is_told_before_the_window_opens() {
    let (_, log) = model(1000.0);
    let options = ViewerOptions {
        event_log: Some(log.path().join("x")),
        ..options(&log, 1000.0)
    };
    let error = Model::new(&options, || ()).expect_err("a file is no folder");
    assert!(
        error.to_string().contains("event log cannot be written"),
        "{error}"
    );
}
