//! The panel: what its controls set, what it tells, and how it is laid out.

use std::collections::BTreeSet;

use egui::Pos2;
use nephroid::eye_pass::WhiteBalance;
use nephroid::light_pass::ledger::{CarriedFlux, EnergyLedger, LightLedger, Truncated};
use nephroid::settings::{Footprint, ItemBufferKind, Kernel, Preset, RayPlacement};
use nephroid::viewer::panel::accuracy::target::preset_of;

use super::headless::Gesture::{Check, Choose, Drag, Radio, Type};
use super::headless::{Gesture, SCREEN, edit_power};
use super::*;

/// The smallest window, on a dense screen.
const SMALL: ((f32, f32), f32) = ((700.0, 400.0), 2.0);

fn panel() -> Headless {
    Headless::new(splats())
}

fn fixed(width: usize, height: usize) -> MapResolution {
    MapResolution::Fixed { width, height }
}

#[test]
fn controls_set_what_they_name() {
    let mut panel = Headless::baked(splats(), SMALL);
    panel.open("Rays and kernels");
    panel.open("Limits");
    type Set = fn(&mut BakeSettings);
    let rows: [(Gesture, Set); 9] = [
        (Check("indirect"), |set| set.layers.push(LayerKind::Indirect)),
        (Type("Sigma [radii²]", "2.5"), |set| {
            set.sigma = Sigma::Constant(2.5)
        }),
        (Check("Adaptive sigma"), |set| set.sigma = Sigma::Adaptive),
        (Choose("Footprint", "fixed"), |set| {
            set.footprint = Footprint::Fixed
        }),
        (Choose("Rays", "jittered"), |set| {
            set.rays = RayPlacement::Jittered
        }),
        (Choose("Item buffer", "cube"), |set| {
            set.item_buffer = ItemBufferKind::Cube
        }),
        (Choose("Kernel", "disc"), |set| set.kernel = Kernel::Disc),
        (Choose("Map size [texels]", "256"), |set| {
            set.map_resolution = fixed(256, 256)
        }),
        (Type("Max depth", "4"), |set| set.max_depth = Some(4)),
    ];
    let mut expected = splats();
    for (gesture, set) in rows {
        panel.make(gesture);
        set(&mut expected);
        assert_eq!(*panel.settings(), expected, "{gesture:?}");
    }
    panel.tell(|model| drop(model.apply(Command::Undo)));
    assert_eq!(panel.settings().max_depth, None, "what was before is known");
}

#[test]
fn sliders_set_one_value() {
    fn sigma(set: &mut BakeSettings) -> &mut f64 {
        let Sigma::Constant(sigma) = &mut set.sigma else {
            panic!("it is constant")
        };
        sigma
    }
    let timed = BakeSettings {
        max_error: Some(MIN_MAX_ERROR),
        max_time_s: Some(10.0),
        density_per_sr: BakeSettings::starting_density_per_sr(MIN_MAX_ERROR),
        ..BakeSettings::default()
    };
    type Field = fn(&mut BakeSettings) -> &mut f64;
    let density: Field = |set| &mut set.density_per_sr;
    let time: Field = |set| set.max_time_s.as_mut().expect("a time");
    let branch: Field = |set| set.branch_threshold.get_or_insert(0.0);
    let rows: [(_, _, Field, _); 4] = [
        // A quarter of four decades is one decade.
        (splats(), Drag("Sigma [radii²]", 0.5, 0.75), sigma, 5.0..20.0),
        (
            splats(),
            Drag("Ray density [rays/sr]", 0.4, 0.8),
            density,
            4e5..1e12,
        ),
        (timed.clone(), Drag("Max time [s]", 0.57, 0.3), time, 0.01..2.0),
        (timed, Drag("Weakest branch", 0.4, 0.8), branch, 1e-3..1.0),
    ];
    for (mut before, gesture, field, range) in rows {
        let mut panel = Headless::new(before.clone());
        panel.open("Limits");
        panel.make(gesture);
        let mut after = panel.settings().clone();
        assert!(range.contains(field(&mut after)), "{gesture:?}: {after:?}");
        after.validate().expect("in range");
        if matches!(gesture, Drag("Ray density [rays/sr]", ..)) {
            let steps = (after.density_per_sr / 100_000.0).log(4.0);
            assert!((steps - steps.round()).abs() < 1e-9, "nested steps: {steps}");
        }
        *field(&mut before) = *field(&mut after);
        assert_eq!(after, before, "{gesture:?} changes nothing else");
    }
}

#[test]
fn display_controls_set_the_display() {
    let mut panel = Headless::baked(splats(), SMALL);
    type IsSet = fn(&Display) -> bool;
    let is_kelvin: IsSet = |set| matches!(set.white_balance, WhiteBalance::Kelvin(_));
    let is_warm: IsSet = |set| matches!(set.white_balance, WhiteBalance::Kelvin(..5000.0));
    let rows: [(Gesture, IsSet); 6] = [
        (Drag("Exposure [stops]", 0.5, 0.7), |set| set.exposure_stops > 1.0),
        (Choose("Tone map", "aces"), |set| set.tone_map == ToneMap::Aces),
        (Choose("White balance", "temperature"), is_kelvin),
        (Drag("White balance [K]", 0.58, 0.3), is_warm),
        (Radio("caustic"), |set| {
            set.layer == LayerShown::Only(LayerKind::Caustic)
        }),
        (Choose("View", "error"), |set| set.quantity == Quantity::Error),
    ];
    for (gesture, is_set) in rows {
        panel.make(gesture);
        assert!(
            is_set(&panel.model.choices.display),
            "{gesture:?}: {:?}",
            panel.model.choices.display
        );
    }
    panel.press("Auto");
    assert_eq!(panel.asked(), [Command::MeasureExposure]);
    assert_eq!(*panel.settings(), splats(), "no bake depends on it");
}

#[test]
fn bake_ends_by_density_error_or_time() {
    let ends = |panel: &Headless| {
        let set = panel.settings();
        (set.max_error, set.max_time_s, set.density_per_sr)
    };
    let mut panel = Headless::new(BakeSettings {
        layers: vec![LayerKind::Caustic],
        ..BakeSettings::default()
    });
    let starting = BakeSettings::starting_density_per_sr(0.03);
    let timed = |time_s| (Some(MIN_MAX_ERROR), Some(time_s));
    panel.choose("Bake until", "max error");
    assert_eq!(ends(&panel), (Some(0.03), None, starting));
    panel.type_into("Max error [%]", "0.5");
    assert_eq!(panel.settings().max_error, Some(0.005));
    panel.choose("Bake until", "max time");
    let (error, time, _) = ends(&panel);
    assert_eq!((error, time), timed(10.0), "as far as the time goes");
    panel.type_into("Max time [s]", "0.25");
    assert_eq!(panel.settings().max_time_s, Some(0.25));
    panel.choose("Bake until", "ray density");
    assert_eq!(ends(&panel), (None, None, 25_000.0));
    panel.choose("Bake until", "max error");
    panel.choose("Estimator", "splat");
    assert_eq!(panel.settings().estimator, Estimator::Splat);
    assert_eq!(ends(&panel), (None, None, 100_000.0), "splats do not refine");
}

#[test]
fn presets_are_told_from_custom() {
    let mut panel = Headless::baked(BakeSettings::default(), SMALL);
    let shows = |panel: &Headless, name: &str| {
        let shown = panel.named(Role::ComboBox, "Preset").value();
        assert_eq!(shown.as_deref(), Some(name));
    };
    shows(&panel, "custom");
    for of in [Preset::Draft, Preset::Final, Preset::Preview] {
        panel.choose("Preset", of.name());
        assert_eq!(panel.settings().max_error, Some(of.max_error()));
        assert_eq!(preset_of(panel.settings()), Some(of));
        shows(&panel, of.name());
    }
    panel.type_into("Max error [%]", "0.5");
    shows(&panel, "custom");
    panel.press("Reset Max error [%]");
    assert_eq!(preset_of(panel.settings()), Some(Preset::Preview));
    panel.choose("Map size [texels]", "256");
    assert_eq!(preset_of(panel.settings()), None);

    let mut panel = Headless::new(splats());
    panel.choose("Preset", "final");
    let set = panel.settings();
    assert_eq!((set.density_per_sr, set.max_error), (800_000.0, None));
    assert_eq!(preset_of(set), Some(Preset::Final));
}

#[test]
fn looking_changes_nothing() {
    // Beyond the ends of the sliders.
    let odd = BakeSettings {
        density_per_sr: 123_456.7,
        sigma: Sigma::Constant(5000.0),
        map_resolution: fixed(300, 7),
        ..splats()
    };
    let mut panel = Headless::new(odd.clone());
    for y in (0..720).step_by(16) {
        panel.move_to(pos2(250.0, y as f32));
    }
    assert_eq!(*panel.settings(), odd);
    assert!(panel.says("300 × 7") && panel.model.edits().history().undoable() == 0);
}

#[test]
fn what_means_nothing_cannot_be_set() {
    let mut panel = Headless::new(with(splats(), |it| it.kernel = Kernel::Disc));
    assert!(panel.is_disabled(Role::Slider, "Sigma [radii²]"));
    panel.drag("Sigma [radii²]", 0.5, 0.9);
    assert_eq!(panel.settings().sigma, Sigma::Constant(1.0));
    panel.hover(Role::Slider, "Sigma [radii²]");
    panel.assert_says(&["the chosen kernel has none"]);

    let mut panel = self::panel();
    let (caustic, direct) = (LayerKind::Caustic, LayerKind::Direct);
    for (layer, left) in [
        ("caustic", vec![direct]),
        // The last stays on.
        ("direct", vec![direct]),
        // In the files' order.
        ("caustic", vec![caustic, direct]),
    ] {
        panel.make(Check(layer));
        assert_eq!(panel.settings().layers, left);
        // Direct light has no density.
        let is_greyed = panel.is_disabled(Role::Slider, "Ray density [rays/sr]");
        assert_eq!(is_greyed, left.len() == 1);
    }

    // What was not baked or estimated cannot be shown.
    panel.tell(|model| model.given[0].layers.truncate(1));
    for (layer, shown) in [
        ("direct", LayerShown::All),
        ("caustic", LayerShown::Only(caustic)),
    ] {
        panel.make(Radio(layer));
        assert_eq!(panel.model.choices.display.layer, shown);
    }
    panel.choose("View", "error");
    assert_eq!(panel.model.choices.display.quantity, Quantity::Light);
    panel.click(Role::ComboBox, "View");
    panel.move_to(panel.named(Role::Button, "error").rect().center());
    panel.settle();
    panel.assert_says(&["come without an estimate of their error"]);

    let mut panel = Headless::new(with(splats(), |it| it.branch_threshold = Some(-1.0)));
    let sentence = panel.settings().validate().expect_err("negative").to_string();
    panel.assert_says(&[&sentence]);
    panel.press("Re-bake");
    assert_eq!(panel.asked(), []);
}

#[test]
fn buttons_tell_what_was_pressed() {
    let mut panel = Headless::with_scene(fixtures::scene(), splats(), ((1280.0, 1800.0), 1.0));
    for name in ["Cancel", "Undo (Ctrl+Z)", "Redo (Ctrl+Y)"] {
        assert!(panel.is_disabled(Role::Button, name), "{name}");
    }
    panel.press("Re-bake");
    assert_eq!(panel.asked(), [Command::Rebake]);
    panel.tell(|model| {
        model.state = BakeState::Baking {
            stage: Stage::Caustic,
            fraction: 0.25,
            since: Instant::now(),
        };
        edit_power(model);
        model.refusal = Some("light `lamp`: no; yes".into());
    });
    panel.assert_says(&["caustic 25 %", "light `lamp`: no; yes"]);
    panel.hover(Role::Button, "Undo (Ctrl+Z)");
    panel.assert_says(&["Takes back: power of `lamp`"]);
    panel.press("Undo (Ctrl+Z)");
    assert_eq!(panel.asked(), [Command::Undo]);
    panel.press("Redo (Ctrl+Y)");
    assert_eq!(panel.asked(), [Command::Redo]);
    panel.press("Cancel");
    assert!(panel.asked() == [Command::Cancel] && panel.model.choices.automatic);
    panel.make(Check("automatic"));
    assert!(!panel.model.choices.automatic);
}

#[test]
fn states_are_told_in_words() {
    let mut panel = panel();
    let failed = "floor: too large; make it smaller";
    for (state, sentence) in [
        (BakeState::Failed(failed.into()), failed),
        (BakeState::Cancelled, "Cancelled"),
    ] {
        panel.tell(|model| model.state = state);
        panel.assert_says(&[sentence]);
    }
    panel.tell_level(|_| {});
    panel.assert_says(&["the maps belong to these settings"]);
    panel.model.choices.settings.seed = 7;
    panel.settle();
    panel.assert_says(&["Settings changed since the last bake"]);
    for (is_final, error, told) in [
        (
            false,
            Some(0.0213),
            "estimated error 2.1 %, 0.42 s: level 2, goes on",
        ),
        (true, None, "error not estimated, 0.42 s: time is up"),
    ] {
        panel.tell_level(|last| {
            (last.level, last.seconds, last.is_final) = (2, 0.42, is_final);
            last.result.stop_reason = StopReason::MaxTime;
            last.result.estimated_visible = error;
        });
        panel.assert_says(&[told]);
    }
}

#[test]
fn ledgers_are_summed_and_gaps_told() {
    let mut panel = panel();
    let ledger = LightLedger {
        light: "lamp".into(),
        energy_w: EnergyLedger {
            emitted: 2.0,
            deposited: 1.0,
            absorbed: 0.25,
            escaped: 0.6875,
            truncated: with(Truncated::default(), |it| it.depth = 0.125),
            sampling: -0.0625,
        },
        carried_w: CarriedFlux {
            bundles: 0.75,
            photons: 0.25,
            ..CarriedFlux::default()
        },
        not_emitted_w: 0.0,
        emitted_radiant_w: None,
        deposited_radiant_w: None,
    };
    panel.tell_level(|last| {
        last.result.ledgers = vec![ledger.clone(); 2];
        last.result.counts.rays = 1_234_567;
    });
    panel.open("Energy");
    let told = "4.000000 W|2.000000 W|1.375000 W|0.500000 W|0.250000 W|-0.125000 W|0.0e0|Carried by bundles 75.0 %, photons 25.0 %|1,234,567 rays traced";
    panel.assert_says(&told.split('|').collect::<Vec<_>>());
    panel.tell_level(|last| {
        last.result.ledgers = vec![ledger.clone(); 2];
        last.result.ledgers[0].energy_w.escaped = 0.0;
    });
    // 0.6875 of 4 W.
    panel.assert_says(&["1.7e-1"]);
}

#[test]
fn maps_are_listed_read_and_exported() {
    let mut panel = Headless::baked(splats(), SMALL);
    panel.open("Maps");
    panel.assert_says(&["4 × 2 texels, 448 B, error 2.1 %"]);
    panel.press("Export map of floor");
    assert_eq!(panel.asked(), [Command::Export(Export::Map(0))]);
    panel.press("Export all");
    let all = Export::All("nephroid-test-maps".into());
    assert_eq!(panel.asked(), [Command::Export(all)]);

    panel.press("Map of floor");
    let canvas = panel.named(Role::Image, "Map, large").rect();
    // The whole map: 4 × 2 texels across; the middle of its lower right one.
    let texel = canvas.width().min(2.0 * canvas.height()) / 4.0;
    let read = |panel: &mut Headless, at: Pos2| {
        panel.move_to(at);
        panel.settle();
        panel.texts().into_iter().find(|text| text.starts_with("texel "))
    };
    let last = "texel 3, 1: caustic 6.000, direct 3.000 W/m², error ±0.2500";
    let at = canvas.center() + vec2(1.5 * texel, 0.5 * texel);
    assert_eq!(read(&mut panel, at).as_deref(), Some(last));
    // Zoomed in, another texel is there, until the map is dragged.
    panel.press("Zoom in");
    let texel = 1.5 * texel;
    let at = canvas.center() + vec2(0.5 * texel, 0.5 * texel);
    let found = read(&mut panel, at);
    assert!(found.is_some_and(|text| text.starts_with("texel 2, 1: ")));
    panel.drag_at(at, at - vec2(texel, 0.0));
    assert_eq!(read(&mut panel, at).as_deref(), Some(last));
    panel.press("Fit");
}

#[test]
fn exports_tell_how_they_got_on() {
    let mut panel = Headless::baked(splats(), SCREEN);
    panel.click(Role::TextInput, "Maps folder");
    panel.type_text("elsewhere");
    panel.press("Export maps");
    let all = Export::All("elsewhere".into());
    assert_eq!(panel.asked(), [Command::Export(all)]);
    panel.press("Save picture");
    assert_eq!(panel.asked(), [Command::SavePicture]);
    let sentence = "elsewhere: the folder holds files; choose another";
    panel.tell(|model| model.exporter.state = ExportState::Failed(sentence.into()));
    panel.assert_says(&[sentence]);
    panel.tell(|model| model.exporter.state = ExportState::Writing);
    panel.press("Export maps");
    assert_eq!(panel.asked(), [], "one at a time");
}

#[test]
fn values_have_a_button_that_resets_them() {
    let settings = with(splats(), |it| it.layers = LayerKind::ALL.to_vec());
    let mut panel = Headless::baked(settings.clone(), SCREEN);
    panel.open("Rays and kernels");
    let resets = |panel: &Headless| -> BTreeSet<String> {
        let names = panel.controls().into_iter().map(|(_, name, _)| name);
        names.filter(|name| name.starts_with("Reset ")).collect()
    };
    panel.choose("Preset", "preview");
    // The program begins with another estimator.
    let first = BTreeSet::from(["Reset Estimator".to_owned()]);
    assert_eq!(resets(&panel), first);
    for gesture in [
        Type("Sigma [radii²]", "2.5"),
        Choose("Kernel", "gaussian"),
        Choose("Footprint", "disc"),
        Choose("Map size [texels]", "64"),
        Choose("Tone map", "agx"),
        Check("direct"),
    ] {
        panel.make(gesture);
    }
    // That of the preset also sets the map size back.
    let there = [
        "Preset",
        "Layers",
        "Sigma [radii²]",
        "Footprint",
        "Map size [texels]",
        "Tone map",
    ];
    let there = there.map(|name| format!("Reset {name}"));
    assert_eq!(&resets(&panel) - &first, there.clone().into());
    for name in &there[1..] {
        panel.press(name);
    }
    assert_eq!(resets(&panel), first);
    assert_eq!(*panel.settings(), settings);
}

#[test]
fn all_of_use_is_in_sight_at_first() {
    for pixels_per_point in [1.0, 2.0] {
        let settings = BakeSettings::default();
        let panel = Headless::with_scene(fixtures::scene(), settings, (SCREEN.0, pixels_per_point));
        for (role, name) in [
            (Role::Button, "Re-bake"),
            (Role::Button, "Cancel"),
            (Role::Slider, "Ray density [rays/sr]"),
            (Role::Slider, "Sigma [radii²]"),
            (Role::ComboBox, "Map size [texels]"),
            (Role::Slider, "Exposure [stops]"),
            (Role::ComboBox, "Tone map"),
            (Role::ComboBox, "View"),
            (Role::Button, "Save picture"),
        ] {
            panel.named(role, name);
        }
        for (role, name, rect) in panel.controls() {
            let is_in_sight = rect.top() > 0.0 && rect.bottom() < 712.0 && Headless::is_inside(rect);
            assert!(is_in_sight, "{role:?} {name} at {rect}");
        }
    }
}

#[test]
fn controls_are_named_and_apart() {
    let mut panel = Headless::opened(splats(), SCREEN);
    panel.choose("Bake until", "max time");
    panel.assert_names();
    panel.assert_layout();
}

#[test]
fn labels_say_range_default_accuracy_cost() {
    let mut panel = Headless::baked(splats(), ((1280.0, 1800.0), 1.0));
    for part in ["Scene", "Rays and kernels", "Limits"] {
        panel.open(part);
    }
    let mut labels = BTreeSet::new();
    for node in panel.nodes() {
        labels.extend(
            node.accesskit_node()
                .labelled_by()
                .filter_map(|label| label.value()),
        );
    }
    assert!(labels.len() >= 28, "{labels:?}");
    for label in labels {
        let centre = panel.named(Role::Label, &label).rect().center();
        panel.move_to(centre);
        panel.settle();
        let told = panel.texts().into_iter().find(|text| text.contains("Accuracy:"));
        let told = told.unwrap_or_else(|| panic!("{label}: no hover text"));
        for part in ["Range:", "Default:", "Cost:"] {
            assert!(told.contains(part), "{label}: {told}");
        }
        panel.move_to(pos2(900.0, 400.0));
    }
}
