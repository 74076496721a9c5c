//! The panel, driven by pointer events without a window.

use std::sync::Arc;
use std::time::Instant;

use egui::accesskit::Role;
use egui::{Pos2, Rect, pos2};
use glam::DVec3;
use nephroid::light_pass::ledger::{EnergyLedger, LightLedger, Truncated};
use nephroid::progress::Stage;
use nephroid::scene::builtin::{self, parts, shapes};
use nephroid::scene::{Edit, Light, LightKind, LightSize, PanelShape, Scene, Wave, Waves};
use nephroid::session::StopReason;
use nephroid::settings::{BakeSettings, Footprint, Kernel, LEAST_MAX_ERROR, LayerKind, MapResolution, Sigma};
use nephroid::units::{Flux, Irradiance, Radiance, RadiantIntensity};
use nephroid::viewer::panel::{LayerShown, Quantity};
use nephroid::viewer::worker::BakeState;

use super::headless::{Headless, finished};

const SIZE: (f32, f32) = (1280.0, 720.0);

fn settings() -> BakeSettings {
    BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..BakeSettings::splat()
    }
}

/// Every section open.
const TALL: (f32, f32) = (1280.0, 1400.0);

/// A floor, a ball of glass, a lamp, a sun and a spot.
pub fn scene() -> Scene {
    let mut scene = parts::reference_scene(0.6);
    let ball = shapes::sphere(DVec3::new(0.0, 0.8, 0.0), 0.5, 1);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    scene
        .lights
        .push(parts::point_light("lamp", DVec3::Y * 3.0, Flux(100.0)));
    scene
        .lights
        .push(parts::sun("sun", DVec3::new(0.0, -1.0, -1.0), Irradiance(2.0)));
    let mut spot = scene.lights[0].clone();
    spot.name = "spot".into();
    spot.kind = LightKind::Spot {
        position: DVec3::Y,
        direction: DVec3::NEG_Y,
        intensity: RadiantIntensity(3.0),
        inner_cone_rad: 0.1,
        outer_cone_rad: 0.4,
    };
    scene.lights.push(spot);
    scene
}

/// The panel with section Scene open.
fn with_scene(scene: Scene) -> Headless {
    let mut panel = Headless::with_scene(scene, settings(), TALL);
    open(&mut panel, "Scene");
    panel
}

/// Types a number into the first field whose text begins like this.
fn type_into(panel: &mut Headless, shown: &str, text: &str) {
    let begins = |text: Option<&str>| text.is_some_and(|text| text.starts_with(shown));
    let mut fields = panel.nodes().filter(|node| {
        matches!(node.role(), Role::SpinButton | Role::Button)
            && (begins(node.label()) || begins(node.value()))
    });
    let field = fields
        .next()
        .unwrap_or_else(|| panic!("no {shown:?} in {:#?}", panel.texts()));
    let centre = Headless::rect_of(field).center();
    drop(fields);
    panel.click(centre);
    panel.type_text(text);
}

#[test]
fn power_is_dragged_on_a_logarithmic_scale_with_its_unit() {
    let mut panel = with_scene(scene());
    drag(&mut panel, "Intensity [W/sr]", 0.5, 0.75);
    let Some(Edit::LightIntensity { light: 0, intensity }) = panel.wishes.edit else {
        panic!("{:?}", panel.wishes.edit)
    };
    let times = intensity.0 / (100.0 / (4.0 * std::f64::consts::PI));
    assert!(
        (5.0..20.0).contains(&times),
        "a quarter of four decades is one decade: {times}"
    );
    assert!(!panel.wishes.undo);

    choose(&mut panel, "Light", "sun");
    drag(&mut panel, "Irradiance [W/m²]", 0.5, 0.25);
    let Some(Edit::LightNormalIrradiance {
        light: 1,
        normal_irradiance,
    }) = panel.wishes.edit
    else {
        panic!("{:?}", panel.wishes.edit)
    };
    assert!((0.1..0.4).contains(&normal_irradiance.0), "{normal_irradiance:?}");
}

#[test]
fn waves_are_raised_by_their_slope_and_shown_only_where_they_are() {
    let scene = builtin::build("pool-bump").expect("the pool");
    let waves = scene.materials[1].waves.clone().expect("it has waves");
    let mut panel = with_scene(scene);
    assert!(!panel.says("Waves' slope"), "the floor is chosen first");
    choose(&mut panel, "Object", "water");
    assert!(panel.wishes.edit.is_none(), "{:?}", panel.wishes.edit);
    drag(&mut panel, "Waves' slope", 0.48, 0.24);
    let Some(Edit::MaterialWaves {
        material: 1,
        waves: Some(lower),
    }) = &panel.wishes.edit
    else {
        panic!("{:?}", panel.wishes.edit)
    };
    let slope = |waves: &Waves| waves.list().iter().map(Wave::slope).sum::<f64>();
    assert!((0.15..0.35).contains(&slope(lower)), "{}", slope(lower));
    for (low, high) in lower.list().iter().zip(waves.list()) {
        let part = low.amplitude_m / high.amplitude_m;
        assert!((part - slope(lower) / slope(&waves)).abs() < 1e-9);
        assert_eq!(
            (low.wavelength_m, low.direction),
            (high.wavelength_m, high.direction)
        );
    }
    type_into(&mut panel, "λ: 0.698", "0.5");
    let Some(Edit::MaterialWaves {
        waves: Some(shorter), ..
    }) = &panel.wishes.edit
    else {
        panic!("{:?}", panel.wishes.edit)
    };
    assert_eq!(shorter.list()[0].wavelength_m, 0.5);
}

#[test]
fn looking_at_the_scene_edits_nothing() {
    let mut panel = with_scene(scene());
    for light in ["sun", "spot", "lamp"] {
        choose(&mut panel, "Light", light);
        for object in ["ball", "floor"] {
            choose(&mut panel, "Object", object);
            for y in (0..1400).step_by(8) {
                panel.move_to(pos2(250.0, y as f32));
            }
        }
    }
    assert!(panel.wishes.edit.is_none(), "{:?}", panel.wishes.edit);
}

#[test]
fn places_and_directions_are_typed_in_numbers() {
    let mut panel = with_scene(scene());
    type_into(&mut panel, "y: 3", "2.5");
    assert_eq!(
        panel.wishes.edit,
        Some(Edit::LightPosition {
            light: 0,
            position: DVec3::Y * 2.5
        })
    );
    choose(&mut panel, "Light", "sun");
    // From 45° above the horizon to straight down, and on from there.
    type_into(&mut panel, "elev.: -45", "-90");
    let Some(Edit::LightDirection { light: 1, direction }) = panel.wishes.edit else {
        panic!("{:?}", panel.wishes.edit)
    };
    assert!(
        direction.dot(DVec3::NEG_Y) > 0.999_999 && direction.z < 0.0,
        "{direction}"
    );
    choose(&mut panel, "Light", "spot");
    assert!(
        panel.says("elev.: -90.0") && panel.says("y: 1.0"),
        "a spot has both"
    );
}

#[test]
fn sizes_of_lamps_are_typed_and_0_is_none() {
    let mut panel = with_scene(scene());
    let sized = |panel: &mut Headless, label: &str, text: &str| {
        let field = Headless::rect_of(panel.labelled(Role::SpinButton, label)).center();
        panel.click(field);
        panel.type_text(text);
        panel.wishes.edit.take()
    };
    let radius = |light, radius_m| {
        let size = LightSize::Radius { radius_m };
        Some(Edit::LightSize { light, size })
    };
    assert_eq!(sized(&mut panel, "Radius [m]", "0.25"), radius(0, 0.25));
    choose(&mut panel, "Light", "spot");
    assert_eq!(sized(&mut panel, "Radius [m]", "0.5"), radius(2, 0.5));
    choose(&mut panel, "Light", "sun");
    let edit = sized(&mut panel, "Diameter [°]", "0.53").expect("an edit");
    let size = LightSize::Angle {
        diameter_rad: 0.53_f64.to_radians(),
    };
    assert_eq!(edit, Edit::LightSize { light: 1, size });
    panel.scene = Arc::new(edit.apply(&panel.scene).expect("it is in range").0);
    panel.settle();
    let none = Edit::LightSize {
        light: 1,
        size: LightSize::None,
    };
    assert_eq!(sized(&mut panel, "Diameter [°]", "0"), Some(none));
    let widest = Edit::LightSize {
        light: 1,
        size: LightSize::Angle {
            diameter_rad: std::f64::consts::PI,
        },
    };
    assert_eq!(sized(&mut panel, "Diameter [°]", "500"), Some(widest));
}

#[test]
fn lamps_with_a_surface_have_a_brightness_and_a_panel_a_place() {
    let mut scene = scene();
    let kinds = [
        (
            "panel",
            LightKind::Panel {
                centre: DVec3::Y * 4.0,
                across: DVec3::X,
                down: DVec3::Z,
                shape: PanelShape::Rectangle,
                radiance: Radiance(3.0),
            },
        ),
        ("sky", LightKind::Environment { scale: 1.0 }),
    ];
    for (name, kind) in kinds {
        scene.lights.push(Light {
            name: name.into(),
            kind,
            ..scene.lights[0].clone()
        });
    }
    let mut panel = with_scene(scene);
    choose(&mut panel, "Light", "panel");
    assert!(!panel.says("Radius [m]") && !panel.says("Diameter [°]"));
    type_into(&mut panel, "y: 4", "3");
    let position = DVec3::Y * 3.0;
    assert_eq!(
        panel.wishes.edit,
        Some(Edit::LightPosition { light: 3, position })
    );
    drag(&mut panel, "Brightness", 0.5, 0.75);
    let Some(Edit::LightBrightness { light: 3, brightness }) = panel.wishes.edit else {
        panic!("{:?}", panel.wishes.edit)
    };
    assert!((15.0..60.0).contains(&brightness), "a decade: {brightness}");
    choose(&mut panel, "Light", "sky");
    assert!(!panel.says("Position [m]"));
    drag(&mut panel, "Brightness", 0.5, 0.25);
    let Some(Edit::LightBrightness { light: 4, brightness }) = panel.wishes.edit else {
        panic!("{:?}", panel.wishes.edit)
    };
    assert!((0.05..0.2).contains(&brightness), "{brightness}");
}

#[test]
fn a_material_shows_what_it_has_and_an_object_moves_from_its_place_in_the_file() {
    let mut panel = with_scene(scene());
    assert!(panel.labelled(Role::Slider, "Refractive index").is_disabled());
    let centre = slider(&panel, "Refractive index").center();
    panel.hover(centre);
    assert!(panel.says("Only glass, water and polish have one"));
    choose(&mut panel, "Object", "ball");
    drag(&mut panel, "Refractive index", 0.25, 0.5);
    let Some(Edit::MaterialIor { material: 1, ior }) = panel.wishes.edit else {
        panic!("{:?}", panel.wishes.edit)
    };
    assert!((1.7..2.3).contains(&ior), "{ior}");
    drag(&mut panel, "Roughness", 0.0, 0.5);
    let Some(Edit::MaterialRoughness {
        material: 1,
        roughness,
    }) = panel.wishes.edit
    else {
        panic!("{:?}", panel.wishes.edit)
    };
    assert!((0.3..0.7).contains(&roughness), "{roughness}");

    type_into(&mut panel, "y: 0", "0.25");
    let edit = panel.wishes.edit.take().expect("it moved");
    let (moved, _) = edit.apply(&panel.scene).expect("it is in range");
    let low = |scene: &Scene| scene.objects[1].mesh.bounds().expect("a ball").0;
    assert!((low(&moved) - low(&panel.scene)).distance(DVec3::Y * 0.25) < 1e-12);
    panel.scene = Arc::new(moved);
    panel.settle();
    assert!(panel.says("y: 0.25"), "{:#?}", panel.texts());
    type_into(&mut panel, "y: 0.25", "0");
    let (back, _) = panel
        .wishes
        .edit
        .take()
        .expect("it moved")
        .apply(&panel.scene)
        .expect("it is in range");
    assert!(
        Arc::ptr_eq(&back.objects[1].mesh, &panel.loaded.objects[1].mesh),
        "the file's place exactly"
    );
}

#[test]
fn undo_and_redo_are_offered_where_there_is_something_to_turn_back() {
    let mut panel = Headless::with_scene(scene(), settings(), SIZE);
    for name in ["Undo (Ctrl+Z)", "Redo (Ctrl+Y)"] {
        assert!(panel.named(Role::Button, name).is_disabled(), "{name}");
    }
    panel.undo = Some("power of `lamp`".into());
    panel.refusal = Some("light `lamp`: no; yes".into());
    panel.settle();
    let centre = Headless::rect_of(panel.named(Role::Button, "Undo (Ctrl+Z)")).center();
    panel.hover(centre);
    assert!(panel.says("Takes back: power of `lamp`"), "{:#?}", panel.texts());
    click(&mut panel, Role::Button, "Undo (Ctrl+Z)");
    assert!(panel.wishes.undo && !panel.wishes.redo && panel.says("light `lamp`: no; yes"));
    panel.redo = Some("sigma".into());
    panel.settle();
    click(&mut panel, Role::Button, "Redo (Ctrl+Y)");
    assert!(panel.wishes.redo);
}

#[test]
fn a_bake_ends_by_density_error_or_time() {
    let mut panel = Headless::new(
        BakeSettings {
            layers: vec![LayerKind::Caustic],
            ..BakeSettings::default()
        },
        SIZE,
    );
    choose(&mut panel, "Bake until", "max error");
    assert_eq!(panel.panel.settings.max_error, Some(0.03));
    assert_eq!(panel.panel.settings.max_time_s, None);
    let starting = BakeSettings::starting_density_per_sr(0.03);
    assert_eq!(panel.panel.settings.density_per_sr, starting);
    type_into(&mut panel, "3.0 %", "0.5");
    assert_eq!(panel.panel.settings.max_error, Some(0.005));
    choose(&mut panel, "Bake until", "max time");
    assert_eq!(
        panel.panel.settings.max_error,
        Some(LEAST_MAX_ERROR),
        "as far as the time goes"
    );
    type_into(&mut panel, "10 s", "0.25");
    assert_eq!(panel.panel.settings.max_time_s, Some(0.25));
    choose(&mut panel, "Bake until", "ray density");
    assert_eq!(panel.panel.settings.density_per_sr, 25_000.0);
    assert_eq!(
        (panel.panel.settings.max_error, panel.panel.settings.max_time_s),
        (None, None)
    );
    choose(&mut panel, "Bake until", "max error");
    choose(&mut panel, "Estimator", "splat");
    assert_eq!(panel.panel.settings.max_error, None, "splats do not refine");
    assert_eq!(panel.panel.settings.density_per_sr, 100_000.0);
}

#[test]
fn levels_tell_their_error_and_time() {
    let mut panel = panel();
    let mut last = finished(&panel.scene, &settings());
    (last.is_final, last.level, last.seconds) = (false, 2, 0.42);
    last.result.estimated_relative_rmse = Some(0.0213);
    panel.last = Some(last.clone());
    panel.settle();
    assert!(
        panel.says("estimated error 2.1 %, 0.42 s: level 2, goes on"),
        "{:#?}",
        panel.texts()
    );
    last.is_final = true;
    last.result.estimated_relative_rmse = None;
    last.result.stop_reason = StopReason::MaxTime;
    panel.last = Some(last);
    panel.settle();
    assert!(panel.says("error not estimated, 0.42 s: time is up"));
}

#[test]
fn the_error_is_shown_only_where_there_is_one() {
    let mut panel = panel();
    choose(&mut panel, "View", "error");
    assert_eq!(panel.panel.display.quantity, Quantity::Light);
    let list = Headless::rect_of(panel.labelled(Role::ComboBox, "View")).center();
    panel.click(list);
    panel.hover(Headless::rect_of(panel.named(Role::Button, "error")).center());
    assert!(panel.says("come without an estimate of their error"));
    panel.has_errors = true;
    panel.settle();
    click(&mut panel, Role::Button, "error");
    assert_eq!(panel.panel.display.quantity, Quantity::Error);
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

fn open(panel: &mut Headless, section: &str) {
    click(panel, Role::DisclosureTriangle, section);
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
fn density_moves_in_nested_steps() {
    let mut panel = panel();
    drag(&mut panel, "Ray density [rays/sr]", 0.4, 0.8);
    let steps = (panel.panel.settings.density_per_sr / 100_000.0).log(4.0);
    assert!(steps > 1.0 && (steps - steps.round()).abs() < 1e-9, "{steps}");
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
    open(&mut panel, "Rays and kernels");
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
            branch_threshold: Some(-1.0),
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
            emitted_radiant_w: None,
            deposited_radiant_w: None,
        })
        .to_vec();
    last.result.counts.rays = 1_234_567;
    panel.last = Some(last);
    panel.settle();
    open(&mut panel, "Energy");
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
    assert!(panel.says("1,234,567 rays traced"));
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
    let mut panel = Headless::with_scene(scene(), settings(), SIZE);
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
    let mut panel = with_scene(scene());
    open(&mut panel, "Rays and kernels");
    open(&mut panel, "Limits");
    for label in [
        "Light",
        "Intensity [W/sr]",
        "Position [m]",
        "Object",
        "Refractive index",
        "Roughness",
        "Base colour",
        "Offset [m]",
        "Estimator",
        "Layers",
        "Bake until",
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
        "White balance",
        "Tone map",
        "Light shown",
        "View",
        "Preset",
        "Max depth",
        "Weakest branch",
        "Wavefronts",
    ]) {
        let centre = Headless::rect_of(panel.named(Role::Label, label)).center();
        panel.hover(centre);
        let told = panel.texts().into_iter().find(|text| text.contains("Accuracy:"));
        let told = told.unwrap_or_else(|| panic!("{label}: nothing on hover in {:#?}", panel.texts()));
        assert!(
            told.contains("Range:") && told.contains("Default:") && told.contains("Cost:"),
            "{label}: {told}"
        );
        panel.hover(pos2(900.0, 400.0));
    }
}
