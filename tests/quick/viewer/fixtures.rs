//! Scenes, maps and windows without a display that several tests use.

use std::path::Path;
use std::time::{Duration, Instant};

use nephroid::illumination::{Chart, Layer, Receiver};
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::background::Wake;
use nephroid::viewer::command::{Choices, Command};
use nephroid::viewer::files::FilesOptions;
use nephroid::viewer::model::Model;
use nephroid::viewer::worker::BakedLevel;
use support::prelude::*;
use support::scenes::{chart_of, map_of, spot};
use tempfile::TempDir;

/// Only a failing test waits as long.
const PATIENCE: Duration = Duration::from_secs(120);

/// A floor, a ball of glass, a lamp, a sun and a spot.
pub fn scene() -> Scene {
    let mut scene = parts::reference_scene(0.6);
    scene.name = "test".into();
    let ball = shapes::sphere(DVec3::new(0.0, 0.8, 0.0), 0.5, 1);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let lamp = parts::point_light("lamp", DVec3::Y * 3.0, Flux(100.0));
    let sun = parts::sun("sun", DVec3::new(0.0, -1.0, -1.0), Irradiance(2.0));
    let mut spot = spot(DVec3::Y, DVec3::NEG_Y, 3.0, [0.1, 0.4]);
    spot.name = "spot".into();
    scene.lights.extend([lamp, sun, spot]);
    scene
}

/// A chart of one triangle, with areas [m²] of its texels.
pub fn chart(object: usize, width: usize, height: usize, texel_areas_m2: Vec<f64>) -> Arc<Chart> {
    let corner_uvs = vec![[DVec2::ZERO, DVec2::X, DVec2::Y]];
    Arc::new(Chart {
        receiver: Receiver::front(object),
        ..chart_of(corner_uvs, (width, height), texel_areas_m2)
    })
}

/// Four by two texels on the floor, brightest at the right, with known errors.
pub fn map() -> IlluminationMap {
    let ramp = |scale: f32| (0..8).map(|texel| [scale * (texel % 4) as f32; 3]).collect();
    let mut map = map_of(chart(0, 4, 2, vec![1.0]), ramp(2.0));
    map.layers.push(Layer {
        kind: LayerKind::Direct,
        irradiance: ramp(1.0),
    });
    map.error = Some(vec![0.25; 8]);
    map.estimated_relative_rmse = Some(0.0213);
    map
}

/// A window on a built-in scene whose bakes take milliseconds.
pub fn options(scene: &str) -> ViewerOptions {
    ViewerOptions {
        scene: Arc::new(builtin::build(scene).expect("it is built in")),
        settings: BakeSettings {
            density_per_sr: 1000.0,
            map_resolution: MapResolution::Fixed {
                width: 16,
                height: 16,
            },
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..BakeSettings::splat()
        },
        maps: None,
        size: (640, 480),
        camera: None,
        exposure_stops: None,
        stop: None,
        event_log: None,
        files: FilesOptions::default(),
    }
}

pub fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

pub fn model(options: &ViewerOptions) -> Model {
    Model::new(options, &Wake::new(|| ())).expect("threads are to be had")
}

/// One frame, with the mouse up.
pub fn act(model: &mut Model, mut commands: Vec<Command>) {
    commands.push(Command::Release);
    model.act(commands, Instant::now());
}

/// One frame in which something is set.
pub fn set(model: &mut Model, set: impl FnOnce(&mut Choices)) {
    let command = chosen(model, set);
    act(model, vec![command]);
}

pub fn chosen(model: &Model, set: impl FnOnce(&mut Choices)) -> Command {
    let mut choices = model.choices.clone();
    set(&mut choices);
    Command::Choose(Box::new(choices))
}

/// Frames until something is so.
#[track_caller]
pub fn until(model: &mut Model, what: &str, is_so: impl Fn(&Model) -> bool) {
    let start = Instant::now();
    while !is_so(model) {
        model.poll_files();
        model.poll();
        act(model, Vec::new());
        assert!(start.elapsed() < PATIENCE, "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Frames until the maps are those of the scene and the settings.
#[track_caller]
pub fn bake(model: &mut Model) {
    until(model, "the bake", |model| {
        let is_of_scene = |last: &BakedLevel| Arc::ptr_eq(&last.request.scene, model.scene());
        let last = model.last.as_deref().filter(|last| last.is_final);
        !model.state.is_working() && last.is_some_and(is_of_scene)
    });
}

pub fn change(edit: Edit) -> Vec<Command> {
    vec![Command::Edit(edit)]
}

pub fn intensity(light: usize, value: f64) -> Edit {
    Edit::Light(light, LightEdit::Strength(value))
}

/// A light that somebody adds.
pub fn added(light: Light) -> Edit {
    Edit::AddLight(Arc::new(light))
}

/// The lines of an event log.
pub fn events(log: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(log).expect("there is a log");
    let event = |line| serde_json::from_str(line).expect("a line is JSON");
    text.lines().map(event).collect()
}

pub fn read(path: &Path) -> Scene {
    Scene::load(&path.display().to_string(), &LoadOptions::default()).expect("it can be read")
}

/// A scene after some edits.
pub fn edited(scene: &Scene, edits: &[Edit]) -> Scene {
    edits.iter().fold(scene.clone(), |scene, edit| {
        edit.apply(&scene).expect("the edit is possible")
    })
}

/// Waits for what another thread does.
#[track_caller]
pub fn wait_for(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < PATIENCE, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}
