//! Edits of the scene that the panel asks for, and one history of settings, display, camera path and scene.

use std::f64::consts::FRAC_PI_2;

use nephroid::scene::PanelShape;
use nephroid::viewer::panel::PlaceTool;

use super::fixtures::chosen;
use super::headless::Gesture::{Choose, Drag, Press, Type};
use super::{fixtures, *};

fn panel_of(scene: Scene) -> Headless {
    let mut panel = Headless::with_scene(scene, splats(), ((1280.0, 1800.0), 1.0));
    panel.open("Scene");
    panel
}

fn scene() -> Scene {
    let mut scene = fixtures::scene();
    let sides = [DVec3::X, DVec3::Z];
    let panel = support::scenes::panel(DVec3::Y * 4.0, sides, PanelShape::Rectangle, 3.0);
    let sky = support::scenes::light(LightKind::Environment { scale: 1.0 });
    for (name, lamp) in [("panel", panel), ("sky", sky)] {
        scene.lights.push(with(lamp, |it| it.name = name.into()));
    }
    scene
}

fn panel() -> Headless {
    panel_of(scene())
}

/// What a slider's edit is of, by kind and index, and the value.
fn slid(edit: Edit) -> (&'static str, usize, f64) {
    match edit {
        Edit::Light(light, LightEdit::Strength(strength)) => ("strength", light, strength),
        Edit::Material(material, MaterialEdit::Ior(ior)) => ("ior", material, ior),
        Edit::Material(material, MaterialEdit::Roughness(roughness)) => ("roughness", material, roughness),
        other => panic!("{other:?}"),
    }
}

#[test]
fn sliders_ask_for_their_edit() {
    let mut panel = panel();
    // On logarithmic scales a quarter of four decades is one decade.
    let lamp = 100.0 / (4.0 * PI);
    let power = Drag("Intensity [W/sr]", 0.5, 0.75);
    let beam = Drag("Irradiance [W/m²]", 0.5, 0.25);
    let (brighter, darker) = (Drag("Brightness", 0.5, 0.75), Drag("Brightness", 0.5, 0.25));
    let (bent, rough) = (Drag("Refractive index", 0.25, 0.5), Drag("Roughness", 0.0, 0.5));
    for (list, name, gesture, kind, range) in [
        ("Light", "lamp", power, ("strength", 0), 5.0 * lamp..20.0 * lamp),
        ("Light", "sun", beam, ("strength", 1), 0.1..0.4),
        ("Light", "panel", brighter, ("strength", 3), 15.0..60.0),
        ("Light", "sky", darker, ("strength", 4), 0.05..0.2),
        ("Object", "ball", bent, ("ior", 1), 1.7..2.3),
        ("Object", "ball", rough, ("roughness", 1), 0.3..0.7),
    ] {
        panel.choose(list, name);
        assert_eq!(panel.edit(), None, "choosing is no edit");
        panel.make(gesture);
        let (what, index, value) = slid(panel.edit().expect("an edit"));
        assert_eq!((what, index), kind, "{gesture:?}");
        assert!(range.contains(&value), "{gesture:?}: {value}");
    }
    assert_eq!(panel.asked(), []);
}

#[test]
fn numbers_ask_for_their_edit() {
    let mut panel = panel();
    let at = |light, position| Edit::Light(light, LightEdit::Position(position));
    let ball = |light, radius_m| {
        let size = LightSize::Radius { radius_m };
        Edit::Light(light, LightEdit::Size(size))
    };
    let disc = |degrees: f64| {
        let diameter_rad = degrees.to_radians();
        let size = LightSize::Angle { diameter_rad };
        Edit::Light(1, LightEdit::Size(size))
    };
    let (y, z) = (Type("Position [m]: y", "2.5"), Type("Position [m]: z", "2.5"));
    for (light, gesture, expected) in [
        ("lamp", y, at(0, DVec3::Y * 2.5)),
        ("lamp", z, at(0, dvec3(0.0, 3.0, 2.5))),
        ("panel", Type("Position [m]: y", "3"), at(3, DVec3::Y * 3.0)),
        ("lamp", Type("Radius [m]", "0.25"), ball(0, 0.25)),
        ("spot", Type("Radius [m]", "0.5"), ball(2, 0.5)),
        ("sun", Type("Diameter [°]", "0.53"), disc(0.53)),
        // No disc is wider.
        ("sun", Type("Diameter [°]", "500"), disc(180.0)),
        ("sun", Press("Remove light"), Edit::RemoveLight(1)),
    ] {
        panel.choose("Light", light);
        panel.make(gesture);
        assert_eq!(panel.edit(), Some(expected), "{light}: {gesture:?}");
    }
    panel.choose("Light", "sun");
    panel.type_into("Diameter [°]", "0.5");
    panel.apply();
    panel.type_into("Diameter [°]", "0");
    let size = LightSize::None;
    assert_eq!(panel.edit(), Some(Edit::Light(1, LightEdit::Size(size))));
    // From 45° above the horizon to straight down, with the azimuth kept.
    panel.type_into("Direction [°]: elevation", "-90");
    let Some(Edit::Light(1, LightEdit::Direction(direction))) = panel.edit() else {
        panic!("no direction")
    };
    assert!(direction.y < -0.999_999 && direction.z < 0.0, "{direction}");
    for light in NewLight::ALL {
        panel.press(&format!("Add {}", light.name()));
        assert_eq!(panel.asked(), [Command::AddLight(light)]);
    }
}

#[test]
fn rows_are_those_of_the_light() {
    let mut panel = panel();
    let rows = ["Position [m]", "Direction [°]", "Radius [m]", "Diameter [°]"];
    for (light, has) in [
        ("lamp", [true, false, true, false]),
        ("sun", [false, true, false, true]),
        ("spot", [true, true, true, false]),
        ("panel", [true, false, false, false]),
        ("sky", [false, false, false, false]),
    ] {
        panel.choose("Light", light);
        assert_eq!(rows.map(|row| panel.says(row)), has, "{light}");
    }
    assert!(panel.is_disabled(Role::Slider, "Refractive index"));
    panel.hover(Role::Slider, "Refractive index");
    panel.assert_says(&["Only glass, water and coats have one"]);
}

#[test]
fn objects_move_from_their_place_in_the_file() {
    let mut panel = panel();
    panel.choose("Object", "ball");
    let loaded = Arc::clone(panel.model.scene());
    let low = |scene: &Scene| scene.objects[1].mesh_in_scene().bounds().expect("a ball").0;
    panel.type_into("Offset [m]: y", "0.25");
    let moved = panel.apply();
    near(low(&moved) - low(&loaded), DVec3::Y * 0.25, 1e-12, "offset");
    panel.assert_says(&["y: 0.25"]);
    panel.type_into("Offset [m]: y", "0");
    let back = panel.apply();
    let (back, loaded) = (back.objects[1].mesh_in_scene(), loaded.objects[1].mesh_in_scene());
    assert!(Arc::ptr_eq(back, loaded), "the file's place exactly");
    panel.type_into("Turn [°]", "90");
    let turned = panel.apply();
    let yaw_rad = turned.objects[1].motion().yaw_rad().expect("a turn");
    near(yaw_rad, FRAC_PI_2, 1e-8, "turn");
}

#[test]
fn waves_keep_their_proportions() {
    let scene = built_in("pool-bump");
    let waves = scene.materials[1].waves.clone().expect("it has waves");
    let mut panel = panel_of(scene);
    assert!(!panel.says("Waves' slope"), "the floor is chosen first");
    panel.choose("Object", "water");
    assert_eq!(panel.edit(), None);
    let asked = |panel: &mut Headless| match panel.edit() {
        Some(Edit::Material(1, MaterialEdit::Waves(Some(waves)))) => waves,
        other => panic!("{other:?}"),
    };
    panel.drag("Waves' slope", 0.48, 0.24);
    let lower = asked(&mut panel);
    let slope = |waves: &Waves| waves.list().iter().map(Wave::slope).sum::<f64>();
    assert!((0.15..0.35).contains(&slope(&lower)), "{}", slope(&lower));
    for (low, high) in lower.list().iter().zip(waves.list()) {
        let part = low.amplitude_m / high.amplitude_m;
        near(part, slope(&lower) / slope(&waves), 1e-9, "proportions");
        assert_eq!(low.wavelength_m, high.wavelength_m);
        assert_eq!(low.direction, high.direction);
    }
    panel.type_into("Wave: length [m]", "0.5");
    assert_eq!(asked(&mut panel).list()[0].wavelength_m, 0.5);
}

#[test]
fn glass_is_set_by_name_or_number() {
    let mut panel = panel();
    panel.choose("Object", "ball");
    // SCHOTT's data sheet of N-BK7: n_d = 1.51680, V_d = 64.17; and 20 over 0.5 is 40.
    for (gesture, name, number, abbe) in [
        (Choose("Glass", "N-BK7"), "N-BK7", "0.312", 64.17),
        (Type("Dispersion [20/V]", "0.5"), "by numbers", "0.500", 40.0),
    ] {
        panel.make(gesture);
        let scene = panel.apply();
        let material = &scene.materials[scene.objects[1].material];
        near(material.ior, 1.5168, 1e-5, name);
        let glass = material.glass.as_ref().expect("it has one");
        near(glass.dispersion.abbe_number(), abbe, 5e-3, name);
        panel.assert_says(&[name, number]);
    }
    panel.press("Reset Glass");
    let scene = panel.apply();
    assert_eq!(scene.materials[scene.objects[1].material].glass, None);
}

#[test]
fn spectra_are_set_by_name() {
    let mut panel = panel();
    panel.choose("Spectrum", "A");
    let light = &panel.apply().lights[0];
    let spectrum = light.spectrum.as_ref().expect("it has one");
    assert_eq!(spectrum.name(), Some("A"));
    // Incandescent light is reddish, and as bright as before.
    let colour = light.colour;
    assert!(colour.r > 1.0 && colour.b < 0.5, "{colour:?}");
    near(colour.luminance(), 1.0, 1e-3, "as bright");
    panel.press("Reset Spectrum");
    assert_eq!(panel.apply().lights[0], panel.model.loaded().lights[0]);
}

#[test]
fn mouse_holds_one_thing_and_looking_edits_nothing() {
    let mut panel = panel();
    for (light, object) in [("sun", "ball"), ("spot", "floor"), ("lamp", "ball")] {
        panel.choose("Light", light);
        panel.choose("Object", object);
        for y in (80..720).step_by(16) {
            panel.move_to(pos2(250.0, y as f32));
        }
    }
    assert_eq!(panel.edit(), None);
    panel.choose("Object", "ball");
    assert_eq!(panel.model.choices.selection.held(), None);
    for (button, held, placed) in [
        ("Move object", Some(GizmoTarget::Object(1)), None),
        ("Place light", Some(GizmoTarget::Light(0)), Some(PlaceTool::At(0))),
        ("Move light", Some(GizmoTarget::Light(0)), None),
        ("Move light", None, None),
    ] {
        panel.press(button);
        assert_eq!(
            (
                panel.model.choices.selection.held(),
                panel.model.choices.selection.placed()
            ),
            (held, placed)
        );
    }
}

#[test]
fn a_placed_lamp_keeps_its_height_over_the_floor() {
    let mut panel = panel();
    panel.press("Place light");
    let model = &mut panel.model;
    let down = |x, z| Ray {
        origin: dvec3(x, 5.0, z),
        direction: DVec3::NEG_Y,
    };
    let assert_placed = |model: &mut Model, x: f64, z: f64| {
        let mut edit = None;
        wait_for("the surfaces", || {
            model.poll();
            edit = model.placed();
            edit.is_some()
        });
        let Some(Edit::Light(0, LightEdit::Position(place))) = edit else {
            panic!("{edit:?}")
        };
        near(place, dvec3(x, 3.0, z), 1e-9, "the lamp's place");
    };
    model.begin_placing(down(0.5, 0.4));
    assert_placed(model, 0.5, 0.4);
    model.go_on_placing(down(-0.5, 0.3));
    model.end_placing();
    assert_placed(model, -0.5, 0.3);
    // The button is up.
    model.go_on_placing(down(0.5, 0.4));
    assert_eq!(model.placed(), None);
}

/// A window that bakes nothing by itself, with its event log.
fn model() -> (Model, tempfile::NamedTempFile) {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let mut model = fixtures::model(&ViewerOptions {
        maps: Some(Vec::new()),
        exposure_stops: Some(0.0),
        event_log: Some(log.path().to_owned()),
        ..options("ring")
    });
    model.choices.automatic = false;
    (model, log)
}

fn next(model: &Model) -> (Option<&str>, Option<&str>) {
    let history = model.edits().history();
    (history.next_undo(), history.next_redo())
}

#[test]
fn all_changes_are_undone_in_one_order() {
    let (mut model, log) = model();
    let (settings, scene) = (model.choices.settings.clone(), Arc::clone(model.scene()));
    let power = format!("power of `{}`", scene.lights[0].name);
    let order = ["sigma", &power, "tone map"];
    set(&mut model, |it| it.settings.sigma = Sigma::Constant(4.0));
    act(&mut model, change(intensity(0, 7.0)));
    let edited = Arc::clone(model.scene());
    set(&mut model, |it| it.display.tone_map = ToneMap::Aces);
    // A change of the window's own, which no undo takes back.
    model.choices.display.exposure_stops = 3.5;

    for (index, what) in order.iter().enumerate().rev() {
        assert_eq!(next(&model), (Some(*what), order.get(index + 1).copied()));
        act(&mut model, vec![Command::Undo]);
    }
    assert_eq!(next(&model), (None, Some("sigma")));
    act(&mut model, vec![Command::Undo]);
    assert_eq!(model.choices.display.tone_map, Display::default().tone_map);
    assert_eq!(model.choices.display.exposure_stops, 3.5);
    assert_eq!(model.scene().lights, scene.lights);
    assert_eq!(model.choices.settings, settings);

    for what in order {
        assert_eq!(next(&model).1, Some(what));
        act(&mut model, vec![Command::Redo]);
    }
    assert_eq!(model.choices.settings.sigma, Sigma::Constant(4.0));
    assert_eq!(model.scene().lights, edited.lights);
    assert_eq!(model.choices.display.tone_map, ToneMap::Aces);
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
        act(&mut model, vec![Command::Film(FilmCommand::Record(None))]);
    }
    let before = model.choices.film.clone();
    assert_eq!(before.keys.len(), 2);
    set(&mut model, |it| {
        it.film.keys.remove(0);
        it.automatic = true;
    });
    assert_eq!(next(&model), (Some("automatic"), None));
    act(&mut model, vec![Command::Undo]);
    assert!(!model.choices.automatic);
    for left in [2, 1, 0] {
        act(&mut model, vec![Command::Undo]);
        assert_eq!(model.choices.film.keys, before.keys[..left]);
    }
    assert_eq!(next(&model), (None, Some("keys of the camera's path")));
    for _ in 0..4 {
        act(&mut model, vec![Command::Redo]);
    }
    assert_eq!(model.choices.film.keys, before.keys[1..]);
    assert!(model.choices.automatic);
}

#[test]
fn a_drag_is_one_step() {
    let (mut model, _log) = model();
    for drag in [&[2.0, 3.0, 4.0][..], &[5.0]] {
        for value in drag {
            let command = chosen(&model, |it| it.settings.sigma = Sigma::Constant(*value));
            model.act(vec![command], Instant::now());
        }
        act(&mut model, Vec::new());
    }
    assert_eq!(model.edits().history().undoable(), 2);
    for (step, sigma) in [(Command::Undo, 4.0), (Command::Undo, 1.0), (Command::Redo, 4.0)] {
        act(&mut model, vec![step]);
        assert_eq!(model.choices.settings.sigma, Sigma::Constant(sigma));
    }
    // Another change forgets what was undone.
    set(&mut model, |it| {
        it.settings.effects.set(Effect::Refraction, EffectSwitch::Off)
    });
    assert_eq!(next(&model), (Some("effects"), None));
    act(&mut model, vec![Command::Redo]);
    assert_eq!(model.choices.settings.sigma, Sigma::Constant(4.0));

    // A thousand steps are kept.
    let mut edits = EditedScene::new(options("ring").scene);
    let of_seed = |seed| Choices::new(with(BakeSettings::default(), |it| it.seed = seed));
    for seed in 0..1100 {
        edits.note(&of_seed(seed), &of_seed(seed + 1));
        edits.release();
    }
    assert_eq!(edits.history().undoable(), 1000);
}
