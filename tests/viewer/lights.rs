//! Lights that are added and removed in the window, and the brightest spot that they make.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};
use nephroid::geometry::Ray;
use nephroid::illumination::{Chart, IlluminationMap, Layer, Receiver, UvSet};
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{self, parts};
use nephroid::scene::changes::{Change, Changes};
use nephroid::scene::load::save;
use nephroid::scene::{Edit, Light, LightKind, LightOrigin, LoadOptions, Scene, load};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::transport::Tracer;
use nephroid::units::Flux;
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::brightest;
use nephroid::viewer::edits::EditedScene;
use nephroid::viewer::files::FilesOptions;
use nephroid::viewer::model::Model;
use nephroid::viewer::new_light::{Aim, NewLight};
use nephroid::viewer::panel::Wishes;

use super::{panel, scene_file};

const PATIENCE: Duration = Duration::from_secs(120);

fn added(light: Light) -> Edit {
    Edit::LightAdded {
        light: None,
        added: Arc::new(light),
        origin: LightOrigin::New,
    }
}

fn lamp(name: &str) -> Light {
    parts::point_light(name, DVec3::new(0.3, 2.0, 0.1), Flux(30.0))
}

/// The first is dimmed, the second taken out, two come, and of these the first goes again and the second moves.
fn edits(scene: &Scene) -> Vec<Edit> {
    let count = scene.lights.len();
    vec![
        Edit::LightColour {
            light: 0,
            colour: LinearSrgb::from([1.0, 0.5, 0.25]),
        },
        added(lamp("new")),
        added(lamp("newer")),
        Edit::LightRemoved { light: 1 },
        Edit::LightRemoved { light: count - 1 },
        Edit::LightPosition {
            light: count - 1,
            position: DVec3::new(-0.5, 1.5, 0.25),
        },
    ]
}

#[test]
fn lights_that_come_and_go_are_taken_back_one_by_one_and_done_again() {
    let loaded = Arc::new(panel::scene());
    let mut edited = EditedScene::new(Arc::clone(&loaded));
    let state = |edited: &EditedScene| {
        let scene = edited.scene();
        (scene.lights.clone(), scene.light_list.clone())
    };
    let mut states = vec![state(&edited)];
    for edit in edits(&loaded) {
        edited.edit(&edit).expect("it can be edited");
        states.push(state(&edited));
    }
    let names = |edited: &EditedScene| -> Vec<String> {
        edited
            .scene()
            .lights
            .iter()
            .map(|light| light.name.clone())
            .collect()
    };
    assert_eq!(names(&edited), ["lamp", "spot", "newer"]);
    assert_eq!(edited.scene().light_when_loaded(1), Some(2));
    assert_eq!(edited.scene().light_when_loaded(2), None);
    // As it came, and not as it is now.
    assert_eq!(edited.scene().light_at_first(2, &loaded), &lamp("newer"));
    for before in states.iter().rev().skip(1) {
        edited.undo().expect("it is taken back");
        assert_eq!(state(&edited), *before);
    }
    for after in &states[1..] {
        edited.redo().expect("it is done again");
        assert_eq!(state(&edited), *after);
    }
    assert_eq!(edited.history().next_undo(), Some("position of `newer`"));
    edited.undo().expect("it is taken back");
    assert_eq!(edited.history().next_undo(), Some("removal of `new`"));
}

#[test]
fn what_is_kept_of_lights_leads_to_the_same_lights_at_another_time() {
    let loaded = panel::scene();
    let edited = edits(&loaded).iter().fold(loaded.clone(), |scene, edit| {
        edit.apply(&scene).expect("it can be edited").0
    });
    let Changes { changes, lost } = Changes::between(&loaded, &edited);
    assert!(lost.is_empty());
    let text = serde_json::to_string(&changes).expect("it can be written");
    let read: Vec<Change> = serde_json::from_str(&text).expect("it can be read");
    let again = read.iter().fold(loaded.clone(), |scene, change| {
        let edit = change.for_scene(&loaded).expect("it has a place");
        edit.apply(&scene).expect("it can be edited").0
    });
    assert_eq!(again.lights, edited.lights);
    assert_eq!(again.light_list.removed, edited.light_list.removed);
    // A file that was saved with them needs none of it.
    let is_done = |change: &&Change| change.is_done_in(&edited);
    assert_eq!(read.iter().filter(is_done).count(), 2);
    assert!(!read.iter().any(|change| change.is_done_in(&loaded)));
}

#[test]
fn glow_and_sky_stay_and_lights_without_power_do_not_come() {
    let mut scene = panel::scene();
    scene.lights[0].kind = LightKind::Environment { scale: 1.0 };
    let refused = Edit::LightRemoved { light: 0 }
        .apply(&scene)
        .expect_err("it would still be seen");
    assert!(refused.to_string().contains("lamp"), "{refused}");
    assert!(Edit::LightRemoved { light: 9 }.apply(&scene).is_err());
    let mut dark = lamp("dark");
    dark.colour = LinearSrgb::BLACK;
    assert!(added(dark).apply(&scene).is_err());
    let misplaced = Edit::LightAdded {
        light: Some(0),
        added: Arc::new(lamp("new")),
        origin: LightOrigin::New,
    };
    assert!(misplaced.apply(&scene).is_err(), "those of the file come first");
}

fn gaze(from: DVec3, to: DVec3) -> Ray {
    Ray {
        origin: from,
        direction: (to - from).normalize(),
    }
}

#[test]
fn new_lights_have_room_and_give_what_suits_the_exposure() {
    for name in ["ring", "ball", "pool", "showroom"] {
        let scene = Arc::new(builtin::build(name).expect("it is built in"));
        let tracer = Tracer::new(Arc::clone(&scene));
        let (low, high) = scene.bounds().expect("there are surfaces");
        let radius_m = 0.5 * (high - low).length();
        let middle = 0.5 * (low + high);
        for from in [
            DVec3::new(1.0, 1.2, 1.5),
            DVec3::new(-2.0, 0.7, 0.1),
            DVec3::Y * 2.0,
        ] {
            let gaze = gaze(middle + from * radius_m, middle);
            let aim = Aim::of(&tracer, &gaze, middle);
            for stops in [0.0, -3.0] {
                for kind in NewLight::ALL {
                    let light = kind.make((&tracer, radius_m), &aim, stops, &scene);
                    let edit = added(light.clone());
                    let (lit, _) = edit.apply(&scene).expect("it is a light");
                    assert_eq!(lit.lights.len(), scene.lights.len() + 1);
                    assert!(scene.lights.iter().all(|other| other.name != light.name));
                    suits(&tracer, &light, &aim, 4.0 * f64::exp2(-stops));
                }
            }
        }
    }
}

/// Nothing stands between a light and what it is for, which faces it, and its irradiance across the way is that.
fn suits(tracer: &Tracer, light: &Light, aim: &Aim, irradiance_w_m2: f64) {
    let strength = light.kind.strength();
    if let LightKind::Sun { direction, .. } = light.kind {
        assert_eq!(strength, irradiance_w_m2);
        assert!(direction.is_normalized() && direction.y < 0.0);
        return;
    }
    let position = light.kind.position().expect("it has a place");
    let way = aim.point - position;
    assert!(way.dot(aim.normal) < 0.0, "{light:?} is behind {aim:?}");
    let ray = Ray {
        origin: position,
        direction: way.normalize(),
    };
    let met = tracer.closest_place(&ray).expect("it is aimed at a surface");
    assert!(
        (met.distance_m / way.length() - 1.0).abs() < 1e-3,
        "{light:?} is hidden from {aim:?}"
    );
    let per_m2 = way.length_squared().recip();
    let found = match light.kind {
        // Of a panel that is small against its distance: radiance times solid angle.
        LightKind::Panel { across, down, .. } => {
            let normal = across.cross(down);
            assert!(normal.normalize().dot(way.normalize()) > 0.999);
            strength * 4.0 * normal.length() * per_m2
        }
        _ => strength * per_m2,
    };
    assert!((found / irradiance_w_m2 - 1.0).abs() < 1e-9, "{found} W/m²");
    if let LightKind::Spot { direction, .. } = light.kind {
        assert!(direction.dot(way.normalize()) > 1.0 - 1e-9);
    }
}

fn read(path: &std::path::Path, default_light: bool) -> Scene {
    let options = LoadOptions {
        default_light,
        ..LoadOptions::default()
    };
    load(&path.display().to_string(), &options).expect("it is read")
}

#[test]
fn lights_come_into_files_and_go_from_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = scene_file::glb(folder.path(), "a", "300");
    let loaded = read(&source, false);
    let tracer = Tracer::new(Arc::new(loaded.clone()));
    let aim = Aim {
        point: DVec3::new(0.2, 0.0, 0.4),
        normal: DVec3::Y,
        to_eye: DVec3::new(0.6, 0.8, 0.0),
    };
    let mut scene = loaded.clone();
    for kind in NewLight::ALL {
        let light = kind.make((&tracer, 2.0), &aim, 0.0, &scene);
        (scene, _) = added(light).apply(&scene).expect("it is a light");
    }
    (scene, _) = Edit::LightRemoved { light: 0 }.apply(&scene).expect("it can go");
    let target = folder.path().join("saved.glb");
    save(&target, &loaded, &scene, &LoadOptions::default()).expect("it is saved");
    let again = read(&target, false);
    assert_eq!(again.lights.len(), 4);
    for (is, saved) in again.lights.iter().zip(&scene.lights) {
        assert_eq!(is.name, saved.name);
        let strengths = is.kind.strength() / saved.kind.strength();
        assert!((strengths - 1.0).abs() < 1e-6, "{is:?}");
        let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-6, "{is:?} for {saved:?}");
        match (is.kind, saved.kind) {
            (LightKind::Sun { direction: a, .. }, LightKind::Sun { direction: b, .. }) => near(a, b),
            (
                LightKind::Panel {
                    centre: a,
                    across: x,
                    down: y,
                    ..
                },
                LightKind::Panel {
                    centre: b,
                    across: u,
                    down: v,
                    ..
                },
            ) => {
                near(a, b);
                near(x, u);
                near(y, v);
            }
            (
                LightKind::Spot {
                    direction: a,
                    inner_cone_rad: x,
                    outer_cone_rad: y,
                    ..
                },
                LightKind::Spot {
                    direction: b,
                    inner_cone_rad: u,
                    outer_cone_rad: v,
                    ..
                },
            ) => {
                near(a, b);
                near(DVec3::new(x, y, 0.0), DVec3::new(u, v, 0.0));
            }
            (a, b) => near(a.position().expect("a place"), b.position().expect("a place")),
        }
    }
}

/// A file without light has the program's sun in the window. The file gets it when it is edited, or when other light comes,
/// with which nobody would give the file a sun any more.
#[test]
fn the_sun_of_a_dark_file_is_written_when_it_must_be() {
    let folder = tempfile::tempdir().expect("a folder");
    // A lamp without power is none.
    let source = scene_file::glb(folder.path(), "dark", "0");
    assert!(read(&source, false).lights.is_empty());
    let loaded = read(&source, true);
    assert_eq!(loaded.lights.len(), 1);
    let target = folder.path().join("saved.glb");
    let saved = |scene: &Scene| {
        save(&target, &loaded, scene, &LoadOptions::default()).expect("it is saved");
        read(&target, false).lights.len()
    };
    assert_eq!(saved(&loaded), 0);
    let mut turned = loaded.clone();
    let direction = DVec3::new(0.3, -0.9, 0.2);
    (turned, _) = Edit::LightDirection { light: 0, direction }
        .apply(&turned)
        .expect("a sun turns");
    assert_eq!(saved(&turned), 1);
    let (with_lamp, _) = added(lamp("new")).apply(&loaded).expect("it comes");
    assert_eq!(saved(&with_lamp), 2);
    let (alone, _) = Edit::LightRemoved { light: 0 }
        .apply(&with_lamp)
        .expect("it goes");
    assert_eq!(saved(&alone), 1);
}

/// Two triangles over the whole map of a floor of 4 m × 2 m, in which one texel is the brightest.
#[test]
fn the_brightest_texel_is_found_where_it_lies() {
    let mut scene = Scene::default();
    let corners = [
        DVec3::new(-2.0, 0.0, -1.0),
        DVec3::new(-2.0, 0.0, 1.0),
        DVec3::new(2.0, 0.0, 1.0),
        DVec3::new(2.0, 0.0, -1.0),
    ];
    let mesh = nephroid::scene::Mesh {
        positions: corners.to_vec(),
        normals: vec![DVec3::Y; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..nephroid::scene::Mesh::default()
    };
    parts::add(
        &mut scene,
        "floor",
        mesh,
        parts::matte("grey", LinearSrgb::WHITE * 0.5),
    );
    let uv = |index: usize| DVec2::new(0.25 * (corners[index].x + 2.0), 0.5 * (corners[index].z + 1.0));
    let map = |receiver: Receiver, texel: usize, value: f32| {
        let mut irradiance = vec![[0.5; 3]; 32];
        irradiance[texel] = [value; 3];
        IlluminationMap {
            chart: Arc::new(Chart {
                receiver,
                uv_set: UvSet::Generated,
                corner_uvs: vec![[uv(0), uv(1), uv(2)], [uv(0), uv(2), uv(3)]],
                width: 8,
                height: 4,
                texel_areas_m2: vec![0.25],
                layout: None,
                beyond: Vec::new(),
                joints: Vec::new(),
            }),
            layers: vec![Layer {
                kind: LayerKind::Caustic,
                irradiance,
            }],
            error: None,
            estimated_relative_rmse: None,
        }
    };
    let maps = [map(Receiver::front(0), 13, 2.0), map(Receiver::back(0), 22, 3.0)];
    let spot = brightest::find(&scene, &maps).expect("there is light");
    // Column 6, row 2, seen from below.
    assert!(
        spot.point.distance(DVec3::new(1.25, 0.0, 0.25)) < 1e-12,
        "{spot:?}"
    );
    assert_eq!(spot.normal, DVec3::NEG_Y);
    assert!((spot.irradiance_w_m2 - 3.0).abs() < 1e-6);
    let spot = brightest::find(&scene, &maps[..1]).expect("there is light");
    assert!(
        spot.point.distance(DVec3::new(0.75, 0.0, -0.25)) < 1e-12,
        "{spot:?}"
    );
    assert_eq!(brightest::find(&scene, &[]), None);
}

/// From the buttons to the answers, without a window.
#[test]
fn a_light_is_added_before_what_is_looked_at_and_the_brightest_spot_is_told() {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let options = ViewerOptions {
        scene: Arc::new(builtin::build("ball").expect("it is built in")),
        settings: BakeSettings {
            density_per_sr: 20_000.0,
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
        exposure_stops: Some(0.0),
        stop: None,
        event_log: Some(log.path().to_owned()),
        files: FilesOptions::default(),
    };
    let mut model = Model::new(&options, || ()).expect("threads are to be had");
    let before = model.scene().lights.len();
    let wish = Wishes {
        new_light: Some(NewLight::Spot),
        ..Wishes::default()
    };
    until(&mut model, &wish, |model| model.scene().lights.len() > before);
    assert_eq!(model.edits().history().next_undo(), Some("`spot`, a new light"));
    until(&mut model, &Wishes::default(), |model| {
        let is_of_scene = |last: &Arc<_>| level_is_of(last, model);
        !model.state().is_baking() && model.last.as_ref().is_some_and(is_of_scene)
    });
    let wish = Wishes {
        brightest: true,
        ..Wishes::default()
    };
    until(&mut model, &wish, |model| {
        model.probed().is_some_and(|probed| probed.explanation.is_some())
    });
    let probed = model.probed().expect("it is told");
    let texel = probed.texel.as_ref().expect("light is baked there");
    let values = model.maps().iter().flat_map(IlluminationMap::total);
    let most = values
        .map(|value| LinearSrgb::from(value.map(f64::from)).luminance())
        .fold(0.0, f64::max);
    assert!(
        (texel.total_w_m2() / most - 1.0).abs() < 1e-5,
        "{texel:?} of {most}"
    );
    let camera = model.navigator.camera();
    let way = (probed.point - camera.position).normalize();
    assert!(
        camera.forward.dot(way) > 1.0 - 1e-9 && camera.is_sound(),
        "{camera:?}"
    );
}

fn level_is_of(level: &nephroid::viewer::worker::BakedLevel, model: &Model) -> bool {
    level.is_final && Arc::ptr_eq(&level.request.scene, model.scene())
}

/// Frames, with a wish in the first, until something is so.
fn until(model: &mut Model, wish: &Wishes, mut is_so: impl FnMut(&Model) -> bool) {
    let start = Instant::now();
    model.act(wish, Instant::now());
    while !is_so(model) {
        model.poll();
        model.act(&Wishes::default(), Instant::now());
        assert!(start.elapsed() < PATIENCE, "it never comes");
        std::thread::sleep(Duration::from_millis(2));
    }
}
