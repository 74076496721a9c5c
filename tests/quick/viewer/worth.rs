//! The panel's section *Effects*, and what an effect is worth: a second bake that leaves the first one alone.

use nephroid::plan::{EffectLine, EffectPlan, LightLine};
use nephroid::viewer::worker::EffectDifference;

use super::worker::{AT_ONCE, Bench, ENDLESS, FAILING, PANICKING, STUBBORN, asked, bench};
use super::*;

fn level(density_per_sr: f64) -> Arc<BakedLevel> {
    let request = asked(density_per_sr);
    Arc::new(finished(&request.scene, &request.settings))
}

fn baked() -> Bench {
    let bench = bench();
    assert!(bench.answer(AT_ONCE).is_some());
    bench
}

/// Sessions that are there, and that were made.
fn sessions(bench: &Bench) -> (usize, usize) {
    let count = |of: &AtomicUsize| of.load(Ordering::SeqCst);
    (count(&bench.alive), count(&bench.made))
}

fn found(bench: &Bench) -> EffectDifference {
    let mut found = None;
    wait_for("the comparison", || {
        found = bench.worker.take_worth();
        found.is_some()
    });
    found.expect("it was waited for")
}

fn begin(bench: &Bench, with: Arc<BakedLevel>) {
    assert!(bench.worker.compare(Effect::Refraction, with));
    wait_for("the comparison", || sessions(bench).0 == 2);
}

#[test]
fn has_its_own_session() {
    let bench = baked();
    let with = level(STUBBORN);
    begin(&bench, Arc::clone(&with));
    let state = bench.worker.state();
    assert!(state.is_working() && !state.is_baking());
    let effect = Effect::Refraction;
    assert!(
        matches!(state, BakeState::Comparing { effect: of, .. } if of == effect),
        "{state:?}"
    );
    bench.open_gate();
    assert_eq!(bench.settled(), BakeState::Done);
    let worth = bench.worker.take_worth().expect("it was found");
    assert!(worth.effect == Effect::Refraction && Arc::ptr_eq(&worth.with, &with));
    assert!(worth.difference.is_ok());
    assert!(bench.worker.take_worth().is_none(), "only once");
    assert!(bench.worker.take_level().is_none(), "no maps are replaced");
    assert_eq!(sessions(&bench), (1, 2));
    // The session goes on with what it has.
    assert!(bench.answer(AT_ONCE).is_some());
    assert_eq!(sessions(&bench).1, 2);
}

#[test]
fn gives_way_to_later_requests() {
    let bench = baked();
    let ends_for_nothing = || {
        assert_eq!(bench.settled(), BakeState::Done);
        assert!(bench.worker.take_worth().is_none() && sessions(&bench).0 == 1);
    };
    begin(&bench, level(ENDLESS));
    assert!(bench.answer(AT_ONCE).is_some());
    ends_for_nothing();

    assert!(bench.worker.compare(Effect::Direct, level(ENDLESS)));
    assert!(bench.worker.compare(Effect::Textures, level(AT_ONCE)));
    assert_eq!(found(&bench).effect, Effect::Textures);

    begin(&bench, level(ENDLESS));
    bench.worker.cancel();
    ends_for_nothing();
}

#[test]
fn failures_spoil_nothing_and_bakes_come_first() {
    let bench = bench();
    bench.ask(ENDLESS);
    assert!(!bench.worker.compare(Effect::Direct, level(AT_ONCE)));
    wait_for("the start", || sessions(&bench).0 == 1);
    assert!(!bench.worker.compare(Effect::Direct, level(AT_ONCE)));
    assert!(bench.worker.state().is_baking());

    let bench = baked();
    for density in [FAILING, PANICKING] {
        assert!(bench.worker.compare(Effect::Direct, level(density)));
        let sentence = found(&bench).difference.err();
        assert!(sentence.is_some_and(|sentence| !sentence.is_empty()));
        assert_eq!(bench.worker.state(), BakeState::Done);
    }
    assert!(bench.answer(AT_ONCE).is_some());
    // Its own session is still the first one.
    assert_eq!(sessions(&bench), (1, 3));
}

#[test]
fn shown_until_other_maps_come() {
    let mut model = fixtures::model(&options("ring"));
    let asked = || vec![Command::EffectDifference(Effect::Reflection)];
    act(&mut model, asked());
    // Nothing is compared before there are maps.
    assert!(model.state.is_baking());
    bake(&mut model);
    let before = Arc::clone(model.last.as_ref().expect("there are maps"));
    assert_eq!(model.quantity(), Quantity::Light);

    act(&mut model, asked());
    until(&mut model, "the comparison", |model| model.worth.is_some());
    bake(&mut model);
    assert!(Arc::ptr_eq(&before, model.last.as_ref().expect("there are maps")));
    assert_eq!(model.quantity(), Quantity::Difference, "it is shown by itself");
    let worth = model.worth.as_ref().expect("it was asked for");
    let found = worth.difference.as_ref().expect("it was found");
    let map = &before.result.maps[0];
    let layers = map.layers.iter();
    let flux_w: f64 = layers.map(|layer| map.flux_w(layer.kind).luminance()).sum();
    near(found.with_w / flux_w, 1.0, 1e-6, "watts");
    assert_eq!(model.shown_maps().len(), found.maps.len());
    let switch = model.choices.settings.effects.get(Effect::Reflection);
    assert_eq!(switch, EffectSwitch::Auto, "the settings are those of the maps");

    for quantity in [Quantity::Light, Quantity::Difference] {
        model.choices.display.quantity = quantity;
        assert_eq!(model.quantity(), quantity);
    }
    set(&mut model, |it| it.settings.density_per_sr *= 4.0);
    bake(&mut model);
    assert!(model.worth.is_none(), "it belonged to other maps");
    assert_eq!(model.quantity(), Quantity::Light);
}

fn offered(panel: &Headless) -> Vec<String> {
    let names = panel.controls().into_iter().map(|(_, name, _)| name);
    names.filter(|name| name.ends_with(": worth")).collect()
}

#[test]
fn asked_for_and_told_in_watts() {
    let mut panel = panel(vec![
        line(Effect::Refraction, true, "for a reason"),
        line(Effect::Absorption, false, "for a reason"),
    ]);
    panel.choose("View", "difference");
    assert_eq!(
        panel.model.choices.display.quantity,
        Quantity::Light,
        "there is none"
    );
    assert_eq!(offered(&panel), ["refraction: worth"]);
    panel.tell(|model| {
        model.state = BakeState::Baking {
            stage: Stage::Caustic,
            fraction: 0.5,
            since: Instant::now(),
        };
    });
    assert!(panel.is_disabled(Role::Button, "refraction: worth"));
    panel.tell(|model| model.state = BakeState::Done);
    panel.press("refraction: worth");
    assert_eq!(panel.asked(), [Command::EffectDifference(Effect::Refraction)]);

    panel.tell(|model| {
        model.state = BakeState::Comparing {
            effect: Effect::Refraction,
            stage: Stage::Caustic,
            fraction: 0.25,
        };
    });
    assert!(panel.says("25 %") && offered(&panel).is_empty());
    assert!(!panel.is_disabled(Role::Button, "Cancel"));

    panel.tell(|model| model.state = BakeState::Done);
    let found = |with_w, without_w, relative_rmse| {
        let maps = Vec::new();
        Ok(Difference {
            maps,
            with_w,
            without_w,
            relative_rmse,
        })
    };
    let more = "+12.30 W of 16.10 W deposited; maps differ by 84 % (relative RMSE)";
    let less = "−0.2500 W of 1.000 W deposited; maps differ by 3.1 % (relative RMSE)";
    let failed = "bake: it failed; try again";
    for (difference, sentence) in [
        (found(16.1, 3.8, Some(0.84)), more),
        (found(1.0, 1.25, Some(0.0312)), less),
        (found(0.0, 1.0, None), "there is no light with it"),
        (Err(failed.into()), failed),
    ] {
        let has_maps = difference.is_ok();
        let worth = EffectDifference {
            effect: Effect::Refraction,
            with: Arc::new(finished(panel.model.scene(), panel.settings())),
            difference,
        };
        panel.tell(|model| model.worth = Some(worth));
        panel.assert_says(&[sentence]);
        if has_maps {
            panel.choose("View", "difference");
            assert_eq!(panel.model.choices.display.quantity, Quantity::Difference);
        }
    }
}

fn line(effect: Effect, on: bool, reason: &str) -> EffectLine {
    EffectLine {
        effect,
        switch: EffectSwitch::Auto,
        on,
        reason: reason.into(),
    }
}

fn panel(effects: Vec<EffectLine>) -> Headless {
    let mut panel = Headless::new(BakeSettings::default());
    assert!(!panel.says("refraction"), "closed at first");
    panel.tell_level(|last| {
        last.result.plan = EffectPlan {
            effects,
            lights: vec![LightLine {
                light: "lamp".into(),
                on: true,
                reason: "sees `ball`".into(),
            }],
        };
        (last.result.counts.rays, last.result.counts.gather_rays) = (12_345, 678);
    });
    panel.open("Effects");
    panel
}

#[test]
fn plan_and_rays_are_listed() {
    let mut panel = panel(vec![
        line(Effect::LightPass, true, "`glass` is lit by `sun`"),
        line(Effect::Absorption, false, "no solid absorbs"),
    ]);
    let told = "light pass: on|`glass` is lit by `sun`|12,345 light rays|678 gather rays|absorption: off|\
                no solid absorbs|light lamp: on|sees `ball`|Known after the first bake.|Known with the first picture.";
    panel.assert_says(&told.split('|').collect::<Vec<_>>());
    assert!(!panel.says("shadow rays"), "there were none");
    panel.hover(Role::Label, "light pass: on");
    panel.assert_says(&[Effect::LightPass.description()]);
    let reason = "`ball` is in view of `camera`";
    panel.tell(|model| model.picture.chains = Some(line(Effect::Chains, true, reason)));
    panel.assert_says(&["chains: on", reason]);
}

#[test]
fn effects_are_switched() {
    let mut panel = panel(Vec::new());
    for (name, told) in [
        ("chains: off", "Done: the maps belong to these settings."),
        ("absorption: off", "Settings changed since the last bake."),
    ] {
        panel.click(Role::RadioButton, name);
        panel.assert_says(&[told]);
    }
    let labels = [
        (EffectSwitch::On, "on"),
        (EffectSwitch::Auto, "auto"),
        (EffectSwitch::Off, "off"),
    ];
    for effect in Effect::ALL {
        let name = effect.name().replace('_', " ");
        for (switch, label) in labels {
            panel.click(Role::RadioButton, &format!("{name}: {label}"));
            assert_eq!(panel.settings().effects.get(effect), switch, "{name}");
        }
    }
    panel.focus(Role::RadioButton, "refraction: off");
    let target = "reflection: on";
    let steps = (0..200).take_while(|_| {
        panel.strike(Key::Tab);
        !panel.named(Role::RadioButton, target).is_focused()
    });
    assert!(steps.count() < 200, "the keyboard gets there");
    panel.strike(Key::Space);
    let effects = &panel.settings().effects;
    assert_eq!(effects.get(Effect::Reflection), EffectSwitch::On);
    assert_eq!(effects.get(Effect::Refraction), EffectSwitch::Off);
}
