//! The panel's section *Effects*.

use nephroid::plan::{EffectLine, EffectPlan, LightLine};

use super::*;

pub fn line(effect: Effect, on: bool, reason: &str) -> EffectLine {
    EffectLine {
        effect,
        switch: EffectSwitch::Auto,
        on,
        reason: reason.into(),
    }
}

pub fn panel(effects: Vec<EffectLine>) -> Headless {
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

#[test]
fn long_reasons_stay_within_the_panel() {
    let reason = "`a body of glass with a very long name that goes on` is lit by `a lamp with one as long`";
    let panel = panel(Effect::ALL.map(|effect| line(effect, true, reason)).to_vec());
    let roles = [Role::RadioButton, Role::Label, Role::Button];
    for node in panel
        .nodes()
        .filter(|node| roles.contains(&node.accesskit_node().role()))
    {
        assert!(Headless::is_inside(node.rect()), "{node:?}");
    }
}
