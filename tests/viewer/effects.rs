//! The panel's list of effects.

use egui::accesskit::Role;
use egui::{Key, pos2};
use nephroid::effect::{Effect, EffectSwitch};
use nephroid::plan::{EffectLine, EffectPlan, LightLine};
use nephroid::session::{EffectCounts, EffectReport};
use nephroid::settings::BakeSettings;
use nephroid::viewer::panel::WIDTH;
use nephroid::viewer::worker::BakeState;

use super::headless::{Headless, finished};

fn line(effect: Effect, on: bool, reason: &str) -> EffectLine {
    EffectLine {
        effect,
        switch: EffectSwitch::Auto,
        on,
        reason: reason.into(),
    }
}

fn report(line: EffectLine, counts: EffectCounts) -> EffectReport {
    EffectReport { line, counts }
}

/// The section open, after a bake with these reports.
fn panel(effects: Vec<EffectReport>) -> Headless {
    let mut panel = Headless::new(BakeSettings::default(), (1280.0, 1400.0));
    let mut last = finished(&panel.scene, &panel.panel.settings);
    last.result.plan = EffectPlan {
        effects: vec![line(Effect::Refraction, true, "`ball` is lit by `lamp`")],
        lights: vec![LightLine {
            light: "lamp".into(),
            on: true,
            reason: "sees `ball`".into(),
        }],
    };
    last.result.effects = effects;
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

#[test]
fn the_section_is_closed_at_first() {
    let panel = Headless::new(BakeSettings::default(), (1280.0, 720.0));
    assert!(!panel.says("refraction"));
}

#[test]
fn before_there_are_reports_the_plan_is_shown() {
    let panel = panel(Vec::new());
    assert!(panel.says("refraction: on") && panel.says("`ball` is lit by `lamp`"));
    assert!(panel.says("light lamp: on") && panel.says("sees `ball`"));
    assert!(panel.says("Known after the first bake.") && panel.says("Known with the first picture."));
}

#[test]
fn reports_come_with_what_the_effects_took() {
    let took = EffectCounts {
        rays: 12_345,
        deposits: 678,
        bytes: 2_500_000,
        cpu_ms: Some(3.21),
        ..EffectCounts::default()
    };
    let mut panel = panel(vec![
        report(line(Effect::Refraction, true, "`glass` is lit by `sun`"), took),
        report(
            line(Effect::Absorption, false, "no solid absorbs"),
            EffectCounts::default(),
        ),
    ]);
    for text in [
        "refraction: on",
        "`glass` is lit by `sun`",
        "12,345 rays",
        "678 deposits",
        "2.5 MB",
        "3.2 ms CPU",
        "absorption: off",
        "no solid absorbs",
        "takes no rays, no memory, no time",
    ] {
        assert!(panel.says(text), "{text} is not in {:#?}", panel.texts());
    }
    assert!(
        !panel.says("`ball` is lit by `lamp`"),
        "the report counts, not the plan"
    );

    let centre = Headless::rect_of(panel.named(Role::Label, "refraction: on")).center();
    panel.hover(centre);
    assert!(panel.says(Effect::Refraction.description()));
    let centre = Headless::rect_of(panel.named(Role::Label, "3.2 ms CPU")).center();
    panel.hover(centre);
    assert!(panel.says("CPU time over all threads, in milliseconds"));
}

#[test]
fn chains_are_those_of_the_picture() {
    let mut panel = panel(Vec::new());
    let counts = EffectCounts {
        pipelines: Some(2),
        bytes: 525_352,
        gpu_ms: Some(1.26),
        ..EffectCounts::default()
    };
    panel.chains = Some(report(
        line(Effect::Chains, true, "`ball` is in view of `camera`"),
        counts,
    ));
    panel.settle();
    for text in [
        "chains: on",
        "`ball` is in view of `camera`",
        "2 pipelines",
        "525.4 kB",
        "1.3 ms GPU",
    ] {
        assert!(panel.says(text), "{text} is not in {:#?}", panel.texts());
    }
    if let Some(chains) = &mut panel.chains {
        chains.counts.gpu_ms = None;
    }
    panel.settle();
    assert!(panel.says("GPU time unknown"));
}

#[test]
fn every_effect_is_switched_by_pointer_and_by_keyboard() {
    let mut panel = panel(Vec::new());
    for effect in Effect::ALL {
        let name = effect.name().replace('_', " ");
        for (switch, label) in [
            (EffectSwitch::On, "on"),
            (EffectSwitch::Off, "off"),
            (EffectSwitch::Auto, "auto"),
            (EffectSwitch::Off, "off"),
        ] {
            click(&mut panel, Role::RadioButton, &format!("{name}: {label}"));
            assert_eq!(panel.panel.settings.effects.get(effect), switch, "{name}");
        }
    }
    panel.move_to(pos2(900.0, 400.0));
    let mut steps = 0;
    while panel.focused() != Some("reflection: on") {
        panel.strike(Key::Tab);
        steps += 1;
        assert!(steps < 200, "the keyboard never gets there");
    }
    panel.strike(Key::Space);
    let effects = &panel.panel.settings.effects;
    assert_eq!(effects.get(Effect::Reflection), EffectSwitch::On);
    assert_eq!(effects.get(Effect::Refraction), EffectSwitch::Off);
}

#[test]
fn the_switch_of_the_chains_is_none_of_the_bakes() {
    let mut panel = panel(Vec::new());
    click(&mut panel, Role::RadioButton, "chains: off");
    assert!(panel.says("Done: the maps belong to these settings."));
    click(&mut panel, Role::RadioButton, "absorption: off");
    assert!(panel.says("Settings changed since the last bake."));
}

#[test]
fn the_list_stays_within_the_panel() {
    let took = EffectCounts {
        rays: 12_345_678_901,
        deposits: 2_345_678_901,
        bytes: 12_500_000_000,
        cpu_ms: Some(123_456.7),
        ..EffectCounts::default()
    };
    let reason = "`a body of glass with a very long name that goes on` is lit by `a lamp with one as long`";
    let reports = Effect::ALL.map(|effect| report(line(effect, true, reason), took));
    let panel = panel(reports.to_vec());
    let roles = [Role::RadioButton, Role::Label, Role::Button];
    for node in panel.nodes().filter(|node| roles.contains(&node.role())) {
        let rect = Headless::rect_of(node);
        assert!(rect.left() >= 0.0 && rect.right() <= WIDTH, "{node:?}");
    }
}
