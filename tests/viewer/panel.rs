//! The panel, driven by pointer events without a window.

use std::time::Instant;

use egui::accesskit::Role;
use egui::{Pos2, Rect, pos2};
use nephroid::light_pass::ledger::{EnergyLedger, LightLedger, Truncated};
use nephroid::plan::{Effect, EffectLine, EffectPlan};
use nephroid::progress::Stage;
use nephroid::settings::{BakeSettings, Footprint, Kernel, LayerKind, MapResolution, Sigma};
use nephroid::viewer::panel::LayerShown;
use nephroid::viewer::worker::BakeState;

use super::headless::{Headless, finished};

const SIZE: (f32, f32) = (1280.0, 720.0);

fn settings() -> BakeSettings {
    BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..BakeSettings::splat()
    }
}

fn panel() -> Headless {
    Headless::new(settings(), SIZE)
}

fn slider(panel: &Headless, label: &str) -> Rect {
    Headless::rect_of(panel.labelled(Role::Slider, label))
}

fn drag(panel: &mut Headless, label: &str, from: f32, to: f32) {
    let rect = slider(panel, label);
    let at = |share: f32| pos2(rect.left() + 4.0 + share * 100.0, rect.center().y);
    panel.drag(at(from), at(to));
}

fn click(panel: &mut Headless, role: Role, name: &str) {
    let centre = Headless::rect_of(panel.named(role, name)).center();
    panel.click(centre);
}

fn choose(panel: &mut Headless, label: &str, value: &str) {
    let centre = Headless::rect_of(panel.labelled(Role::ComboBox, label)).center();
    panel.click(centre);
    click(panel, Role::Button, value);
}

#[test]
fn nothing_is_changed_by_looking() {
    let odd = BakeSettings {
        density_per_sr: 123_456.7,
        sigma: Sigma::Constant(5000.0),
        map_resolution: MapResolution::Fixed {
            width: 300,
            height: 7,
        },
        ..settings()
    };
    let mut panel = Headless::new(odd.clone(), SIZE);
    for y in (0..720).step_by(8) {
        panel.move_to(pos2(250.0, y as f32));
    }
    assert_eq!(
        panel.panel.settings, odd,
        "values beyond the sliders' ends are kept until they are touched"
    );
    assert!(panel.says("300 × 7"));
}

#[test]
fn sigma_is_dragged_on_a_logarithmic_scale() {
    let mut panel = panel();
    drag(&mut panel, "Sigma [radii²]", 0.5, 0.75);
    let Sigma::Constant(sigma) = panel.panel.settings.sigma else {
        panic!("it is constant")
    };
    assert!(
        (5.0..20.0).contains(&sigma),
        "a quarter of four decades is one decade: {sigma}"
    );
    assert_eq!(
        panel.panel.settings,
        BakeSettings {
            sigma: Sigma::Constant(sigma),
            ..settings()
        },
        "nothing else"
    );
}

#[test]
fn density_moves_in_doublings() {
    let mut panel = panel();
    drag(&mut panel, "Ray density [rays/sr]", 0.4, 0.8);
    let steps = (panel.panel.settings.density_per_sr / 100_000.0).log2();
    assert!(steps > 3.0 && (steps - steps.round()).abs() < 1e-9, "{steps}");
    assert_eq!(
        panel.panel.settings,
        BakeSettings {
            density_per_sr: panel.panel.settings.density_per_sr,
            ..settings()
        }
    );
}

#[test]
fn every_list_changes_its_setting() {
    let mut panel = panel();
    choose(&mut panel, "Footprint", "fixed");
    choose(&mut panel, "Map size [texels]", "256");
    choose(&mut panel, "Kernel", "disc");
    let changed = &panel.panel.settings;
    assert_eq!(changed.footprint, Footprint::Fixed);
    assert_eq!(
        changed.map_resolution,
        MapResolution::Fixed {
            width: 256,
            height: 256
        }
    );
    assert_eq!(changed.kernel, Kernel::Disc);
}

#[test]
fn sigma_is_greyed_where_the_kernel_has_none() {
    let mut panel = Headless::new(
        BakeSettings {
            kernel: Kernel::Disc,
            ..settings()
        },
        SIZE,
    );
    assert!(panel.labelled(Role::Slider, "Sigma [radii²]").is_disabled());
    drag(&mut panel, "Sigma [radii²]", 0.5, 0.9);
    assert_eq!(panel.panel.settings.sigma, Sigma::Constant(1.0));
    let centre = slider(&panel, "Sigma [radii²]").center();
    panel.hover(centre);
    assert!(
        panel.says("the chosen kernel has none"),
        "the reason is told on hover: {:#?}",
        panel.texts()
    );
}

#[test]
fn the_last_layer_cannot_be_switched_off() {
    let mut panel = panel();
    click(&mut panel, Role::CheckBox, "caustic");
    assert_eq!(panel.panel.settings.layers, [LayerKind::Direct]);
    assert!(
        panel
            .labelled(Role::Slider, "Ray density [rays/sr]")
            .is_disabled(),
        "direct light has no density"
    );
    click(&mut panel, Role::CheckBox, "direct");
    assert_eq!(panel.panel.settings.layers, [LayerKind::Direct]);
    click(&mut panel, Role::CheckBox, "caustic");
    assert_eq!(
        panel.panel.settings.layers,
        [LayerKind::Caustic, LayerKind::Direct],
        "in the files' order"
    );
}

#[test]
fn buttons_tell_what_was_pressed() {
    let mut panel = panel();
    assert!(panel.named(Role::Button, "Cancel").is_disabled(), "nothing runs");
    click(&mut panel, Role::Button, "Re-bake");
    assert!(panel.wishes.rebake && !panel.wishes.cancel && !panel.wishes.measure_exposure);
    panel.state = BakeState::Baking {
        stage: Stage::Caustic,
        fraction: 0.25,
        since: Instant::now(),
    };
    panel.settle();
    assert!(panel.says("caustic 25 %"), "{:#?}", panel.texts());
    click(&mut panel, Role::Button, "Cancel");
    assert!(panel.wishes.cancel);
    assert!(panel.panel.automatic);
    click(&mut panel, Role::CheckBox, "automatic");
    assert!(!panel.panel.automatic);
}

#[test]
fn absurd_settings_are_refused_with_the_sentence_of_the_library() {
    let mut panel = Headless::new(
        BakeSettings {
            branch_threshold: -1.0,
            ..settings()
        },
        SIZE,
    );
    let sentence = panel.panel.settings.validate().expect_err("negative").to_string();
    assert!(panel.says(&sentence), "{:#?}", panel.texts());
    click(&mut panel, Role::Button, "Re-bake");
    assert!(!panel.wishes.rebake);
}

#[test]
fn states_are_told_in_words() {
    let mut panel = panel();
    panel.state = BakeState::Failed("floor: too large; make it smaller".into());
    panel.settle();
    assert!(panel.says("floor: too large; make it smaller"));
    panel.state = BakeState::Cancelled;
    panel.settle();
    assert!(panel.says("Cancelled"));
    panel.state = BakeState::Done;
    panel.last = Some(finished(&panel.scene, &settings()));
    panel.settle();
    assert!(panel.says("the maps belong to these settings"));
    panel.panel.settings.seed = 7;
    panel.settle();
    assert!(panel.says("Settings changed since the last bake"));
}

#[test]
fn the_ledger_is_summed_over_lights_and_tells_an_open_account() {
    let mut panel = panel();
    let account = |escaped: f64| EnergyLedger {
        emitted: 2.0,
        deposited: 1.0,
        absorbed: 0.25,
        escaped,
        truncated: Truncated {
            depth: 0.125,
            ..Truncated::default()
        },
    };
    let mut last = finished(&panel.scene, &settings());
    last.result.ledgers = [0.625, 0.625]
        .map(|escaped| LightLedger {
            light: "lamp".into(),
            energy_w: account(escaped),
            not_emitted_w: 0.0,
        })
        .to_vec();
    last.result.counts.rays = 1_234_567;
    panel.last = Some(last);
    panel.settle();
    for text in [
        "4.000000 W",
        "2.000000 W",
        "1.250000 W",
        "0.500000 W",
        "0.250000 W",
        "0.0e0",
    ] {
        assert!(panel.says(text), "{text} in {:#?}", panel.texts());
    }
    assert!(panel.says("1,234,567 rays"));
    if let Some(last) = &mut panel.last {
        last.result.ledgers[0].energy_w.escaped = 0.0;
    }
    panel.settle();
    assert!(
        panel.says("1.6e-1"),
        "0.625 of 4 W is missing: {:#?}",
        panel.texts()
    );
}

#[test]
fn effects_are_listed_with_their_reasons() {
    let mut panel = panel();
    let mut last = finished(&panel.scene, &settings());
    last.result.plan = EffectPlan {
        effects: vec![EffectLine {
            effect: Effect::Refraction,
            on: false,
            reason: "no light reaches the glass of 'ball'".into(),
        }],
        lights: Vec::new(),
    };
    panel.last = Some(last);
    panel.settle();
    assert!(
        !panel.says("no light reaches the glass"),
        "the section is closed at first"
    );
    click(&mut panel, Role::DisclosureTriangle, "Effects");
    assert!(panel.says("refraction: off") && panel.says("no light reaches the glass of 'ball'"));
}

#[test]
fn a_layer_that_was_not_baked_cannot_be_shown() {
    let mut panel = panel();
    panel.layers = vec![LayerKind::Caustic];
    panel.settle();
    click(&mut panel, Role::RadioButton, "direct");
    assert_eq!(panel.panel.display.layer, LayerShown::All);
    click(&mut panel, Role::RadioButton, "caustic");
    assert_eq!(panel.panel.display.layer, LayerShown::Only(LayerKind::Caustic));
}

#[test]
fn everything_of_use_is_in_the_window_at_1280_by_720() {
    let mut panel = panel();
    panel.state = BakeState::Done;
    panel.settle();
    let is_control = |role: Role| {
        matches!(
            role,
            Role::Slider
                | Role::ComboBox
                | Role::CheckBox
                | Role::RadioButton
                | Role::Button
                | Role::SpinButton
        )
    };
    let controls: Vec<_> = panel.nodes().filter(|node| is_control(node.role())).collect();
    assert!(controls.len() > 20, "{}", controls.len());
    for control in controls {
        let rect = Headless::rect_of(control);
        assert!(
            panel.is_inside(rect),
            "{:?} {:?} at {rect}",
            control.role(),
            control.label().or(control.value())
        );
    }
    for label in panel.nodes().filter(|node| node.role() == Role::Label) {
        let rect = Headless::rect_of(label);
        assert!(
            rect.left() >= Pos2::ZERO.x && rect.right() <= nephroid::viewer::panel::WIDTH,
            "{label:?}"
        );
    }
}

#[test]
fn every_control_says_what_it_does_to_accuracy_and_cost() {
    let mut panel = panel();
    for label in [
        "Estimator",
        "Layers",
        "Ray density [rays/sr]",
        "Sigma [radii²]",
        "Adaptive sigma",
        "Kernel",
    ]
    .into_iter()
    .chain([
        "Footprint",
        "Rays",
        "Item buffer",
        "Map size [texels]",
        "Exposure [stops]",
        "Tone map",
        "Light shown",
    ]) {
        let centre = Headless::rect_of(panel.named(Role::Label, label)).center();
        panel.hover(centre);
        let told = panel.texts().into_iter().find(|text| text.contains("Accuracy:"));
        let told = told.unwrap_or_else(|| panic!("{label}: nothing on hover in {:#?}", panel.texts()));
        assert!(
            told.contains("Range:") && told.contains("Cost:"),
            "{label}: {told}"
        );
        panel.hover(pos2(900.0, 400.0));
    }
}
