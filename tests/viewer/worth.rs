//! What an effect is worth: a second bake that leaves the first one alone.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use egui::accesskit::Role;
use nephroid::effect::{Effect, EffectSwitch};
use nephroid::illumination::difference::Difference;
use nephroid::plan::{EffectLine, EffectPlan};
use nephroid::progress::{Control, Stage};
use nephroid::scene::builtin;
use nephroid::settings::{BakeSettings, MapResolution};
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::files::FilesOptions;
use nephroid::viewer::model::Model;
use nephroid::viewer::panel::{Quantity, Wishes};
use nephroid::viewer::worker::{BakeRequest, BakeState, BakedLevel, Worth};

use super::headless::{Headless, finished};
use super::worker::{AT_ONCE, Bench, ENDLESS, FAILING, PANICKING, STUBBORN, asked, bench, result, wait_for};

/// Maps that a script would bake at this density.
fn level(density_per_sr: f64) -> Arc<BakedLevel> {
    Arc::new(BakedLevel {
        serial: 1,
        request: asked(density_per_sr),
        level: 1,
        is_final: true,
        result: result(1, false),
        seconds: 0.0,
    })
}

/// A bench whose session has baked once.
fn baked() -> Bench {
    let bench = bench();
    bench.worker.request(asked(AT_ONCE));
    wait_for("the bake", || bench.worker.state() == BakeState::Done);
    assert!(bench.worker.take_level().is_some());
    bench
}

fn alive(bench: &Bench) -> usize {
    bench.alive.load(Ordering::SeqCst)
}

#[test]
fn a_comparison_has_a_session_of_its_own_and_leaves_the_maps_alone() {
    let bench = baked();
    let with = level(STUBBORN);
    assert!(bench.worker.compare(Effect::Refraction, Arc::clone(&with)));
    wait_for("the comparison", || alive(&bench) == 2);
    assert!(matches!(
        bench.worker.state(),
        BakeState::Comparing {
            effect: Effect::Refraction,
            ..
        }
    ));
    assert!(bench.worker.state().is_working() && !bench.worker.state().is_baking());
    bench.gate.send(()).expect("the baker waits");
    wait_for("its end", || bench.worker.state() == BakeState::Done);
    let worth = bench.worker.take_worth().expect("it was found");
    assert!(worth.effect == Effect::Refraction && Arc::ptr_eq(&worth.with, &with));
    assert!(worth.difference.is_ok());
    assert!(bench.worker.take_worth().is_none(), "only once");
    assert!(bench.worker.take_level().is_none(), "no maps are replaced");
    assert_eq!((alive(&bench), bench.made.load(Ordering::SeqCst)), (1, 2));
    // The session goes on with what it has.
    bench.worker.request(asked(AT_ONCE));
    wait_for("the next bake", || bench.worker.take_level().is_some());
    assert_eq!(bench.made.load(Ordering::SeqCst), 2);
}

#[test]
fn a_comparison_gives_way_to_every_later_request() {
    let bench = baked();
    assert!(bench.worker.compare(Effect::Direct, level(ENDLESS)));
    wait_for("the comparison", || alive(&bench) == 2);
    bench.worker.request(asked(AT_ONCE));
    wait_for("maps", || bench.worker.take_level().is_some());
    wait_for("its end", || bench.worker.state() == BakeState::Done);
    assert!(bench.worker.take_worth().is_none() && alive(&bench) == 1);

    // Another comparison takes its place too; and cancelling leaves everything as it was.
    assert!(bench.worker.compare(Effect::Direct, level(ENDLESS)));
    assert!(bench.worker.compare(Effect::Textures, level(AT_ONCE)));
    let mut found = None;
    wait_for("the second one", || {
        found = bench.worker.take_worth();
        found.is_some()
    });
    assert!(found.is_some_and(|worth| worth.effect == Effect::Textures));
    assert!(bench.worker.compare(Effect::Direct, level(ENDLESS)));
    wait_for("the comparison", || alive(&bench) == 2);
    bench.worker.cancel();
    wait_for("its end", || bench.worker.state() == BakeState::Done);
    assert!(bench.worker.take_worth().is_none() && alive(&bench) == 1);
}

#[test]
fn nothing_is_compared_while_maps_are_baked() {
    let bench = bench();
    bench.worker.request(asked(ENDLESS));
    assert!(!bench.worker.compare(Effect::Direct, level(AT_ONCE)));
    wait_for("the start", || alive(&bench) == 1);
    assert!(!bench.worker.compare(Effect::Direct, level(AT_ONCE)));
    assert!(bench.worker.state().is_baking());
}

#[test]
fn a_comparison_that_fails_says_so_and_spoils_nothing() {
    let bench = baked();
    for density in [FAILING, PANICKING] {
        assert!(bench.worker.compare(Effect::Direct, level(density)));
        let mut found = None;
        wait_for("what failed", || {
            found = bench.worker.take_worth();
            found.is_some()
        });
        let sentence = found.and_then(|worth: Worth| worth.difference.err());
        assert!(sentence.is_some_and(|sentence| !sentence.is_empty()));
        assert_eq!(bench.worker.state(), BakeState::Done);
    }
    bench.worker.request(asked(AT_ONCE));
    wait_for("the next bake", || bench.worker.take_level().is_some());
    // Its own session is still the first one.
    assert_eq!((alive(&bench), bench.made.load(Ordering::SeqCst)), (1, 3));
}

fn frame(model: &mut Model, wishes: &Wishes) -> bool {
    let has_maps = model.poll();
    model.act(wishes, Instant::now());
    has_maps
}

fn run(model: &mut Model) {
    wait_for("the worker", || {
        frame(model, &Wishes::default());
        !model.state().is_working()
    });
    frame(model, &Wishes::default());
}

#[test]
fn a_worth_is_shown_until_other_maps_come_and_the_maps_stay() {
    let options = ViewerOptions {
        scene: Arc::new(builtin::build("ring").expect("it is built in")),
        settings: BakeSettings {
            density_per_sr: 1000.0,
            map_resolution: MapResolution::Fixed {
                width: 32,
                height: 32,
            },
            ..BakeSettings::splat()
        },
        maps: None,
        size: (640, 480),
        camera: None,
        exposure_stops: None,
        stop: Some(Arc::new(Control::default())),
        event_log: None,
        files: FilesOptions::default(),
    };
    let mut model = Model::new(&options, || ()).expect("threads are to be had");
    let worth = Wishes {
        worth: Some(Effect::Reflection),
        ..Wishes::default()
    };
    frame(&mut model, &worth);
    assert!(
        model.state().is_baking(),
        "nothing is compared before there are maps"
    );
    run(&mut model);
    let before = Arc::clone(model.last.as_ref().expect("there are maps"));
    assert_eq!(model.quantity(), Quantity::Light);

    frame(&mut model, &worth);
    run(&mut model);
    assert!(Arc::ptr_eq(&before, model.last.as_ref().expect("there are maps")));
    assert_eq!(model.quantity(), Quantity::Difference, "it is shown by itself");
    let found = model
        .worth
        .as_ref()
        .and_then(|worth| worth.difference.as_ref().ok());
    let found = found.expect("it was found");
    let flux_w: f64 = before.result.maps[0]
        .layers
        .iter()
        .map(|layer| before.result.maps[0].flux_w(layer.kind).luminance())
        .sum();
    assert!((found.with_w / flux_w - 1.0).abs() < 1e-6, "{found:?}");
    assert_eq!(model.shown_maps().len(), found.maps.len());
    assert_eq!(
        *model.state(),
        BakeState::Done,
        "the settings are those of the maps"
    );
    assert_eq!(
        model.panel.settings.effects.get(Effect::Reflection),
        EffectSwitch::Auto
    );

    model.panel.display.quantity = Quantity::Light;
    assert_eq!(model.quantity(), Quantity::Light);
    model.panel.display.quantity = Quantity::Difference;
    model.panel.settings.density_per_sr *= 4.0;
    frame(&mut model, &Wishes::default());
    run(&mut model);
    assert!(model.worth.is_none(), "it belonged to other maps");
    assert_eq!(model.quantity(), Quantity::Light);
}

/// The section *Effects* open, after a bake in which refraction was on.
fn panel() -> Headless {
    let mut panel = Headless::new(BakeSettings::default(), (1280.0, 1400.0));
    let mut last = finished(&panel.scene, &panel.panel.settings);
    let line = |effect, on| EffectLine {
        effect,
        switch: EffectSwitch::Auto,
        on,
        reason: "for a reason".into(),
    };
    last.result.plan = EffectPlan {
        effects: vec![line(Effect::Refraction, true), line(Effect::Absorption, false)],
        lights: Vec::new(),
    };
    panel.last = Some(last);
    panel.state = BakeState::Done;
    panel.settle();
    click(&mut panel, Role::DisclosureTriangle, "Effects");
    panel
}

fn click(panel: &mut Headless, role: Role, name: &str) {
    let centre = Headless::rect_of(panel.named(role, name)).center();
    panel.click(centre);
}

fn choose_view(panel: &mut Headless, name: &str) {
    let centre = Headless::rect_of(panel.labelled(Role::ComboBox, "View")).center();
    panel.click(centre);
    click(panel, Role::Button, name);
}

fn worth_of_refraction(panel: &Headless, difference: Result<Difference, String>) -> Worth {
    Worth {
        effect: Effect::Refraction,
        with: Arc::new(BakedLevel {
            request: BakeRequest::new(Arc::clone(&panel.scene), panel.panel.settings.clone()),
            ..finished(&panel.scene, &panel.panel.settings)
        }),
        difference,
    }
}

fn offered(panel: &Headless) -> Vec<&str> {
    let buttons = panel.nodes().filter(|node| node.role() == Role::Button);
    let names = buttons.filter_map(|node| node.label());
    names.filter(|name| name.ends_with(": worth")).collect()
}

#[test]
fn the_panel_offers_the_worth_of_what_is_on_and_tells_it_in_watts() {
    let mut panel = panel();
    assert_eq!(offered(&panel), ["refraction: worth"]);
    panel.state = BakeState::Baking {
        stage: Stage::Caustic,
        fraction: 0.5,
        since: Instant::now(),
    };
    panel.settle();
    assert!(panel.named(Role::Button, "refraction: worth").is_disabled());
    panel.state = BakeState::Done;
    panel.settle();
    click(&mut panel, Role::Button, "refraction: worth");
    assert_eq!(panel.wishes.worth, Some(Effect::Refraction));

    panel.state = BakeState::Comparing {
        effect: Effect::Refraction,
        stage: Stage::Caustic,
        fraction: 0.25,
    };
    panel.settle();
    assert!(panel.says("25 %") && offered(&panel).is_empty());
    assert!(!panel.named(Role::Button, "Cancel").is_disabled());

    panel.state = BakeState::Done;
    let difference = |with_w, without_w, relative_rmse| Difference {
        maps: Vec::new(),
        with_w,
        without_w,
        relative_rmse,
    };
    for (found, told) in [
        (
            difference(16.1, 3.8, Some(0.84)),
            "+12.30 W of 16.10 W deposited; maps differ by 84 % (relative RMSE)",
        ),
        (
            difference(1.0, 1.25, Some(0.0312)),
            "−0.2500 W of 1.000 W deposited; maps differ by 3.1 % (relative RMSE)",
        ),
        (difference(0.0, 1.0, None), "there is no light with it"),
    ] {
        panel.worth = Some(worth_of_refraction(&panel, Ok(found)));
        panel.settle();
        assert!(panel.says(told), "{told} is not in {:#?}", panel.texts());
    }
    choose_view(&mut panel, "difference");
    assert_eq!(panel.panel.display.quantity, Quantity::Difference);
    panel.worth = Some(worth_of_refraction(
        &panel,
        Err("bake: it failed; try again".into()),
    ));
    panel.settle();
    assert!(panel.says("bake: it failed; try again"));
}

#[test]
fn a_difference_is_shown_only_where_there_is_one() {
    let mut panel = panel();
    choose_view(&mut panel, "difference");
    assert_eq!(panel.panel.display.quantity, Quantity::Light);
}
