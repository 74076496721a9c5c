//! Light straight from the lamps by shadow rays, against the baked layer.

use glam::DVec3;
use nephroid::eye_pass::{Picture, View};
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, LightKind, PanelShape, Scene, Volume};
use nephroid::settings::LayerKind;
use nephroid::units::{Irradiance, Radiance, RadiantIntensity};

use crate::gpu::rig::{AS_CPU, Rig, or_skip};
use support::floors::{diffuse, floor_scene};
use support::scenes::{light, view};
use support::tools::{at, bake, set};

fn lamp(colour: [f64; 3], kind: LightKind) -> Light {
    Light {
        colour: colour.into(),
        ..light(kind)
    }
}

/// One lamp of each kind, each of a colour of its own.
fn lamps() -> [Light; 3] {
    let point = LightKind::Point {
        position: DVec3::new(0.1, 0.9, 0.2),
        intensity: RadiantIntensity(2.0),
    };
    let spot = LightKind::Spot {
        position: DVec3::new(0.8, 0.7, 0.4),
        direction: DVec3::new(-0.3, -1.0, 0.1).normalize(),
        intensity: RadiantIntensity(3.0),
        inner_cone_rad: 0.2,
        outer_cone_rad: 0.5,
    };
    let sun = LightKind::Sun {
        direction: DVec3::new(0.4, -1.0, -0.3).normalize(),
        normal_irradiance: Irradiance(2.0),
    };
    [
        lamp([1.0, 0.2, 0.1], point),
        lamp([0.1, 1.0, 0.3], spot),
        lamp([0.2, 0.3, 1.0], sun),
    ]
}

/// A floor with a matte box, a glass ball that casts a shadow, and a mirror behind them.
fn scene(lights: Vec<Light>) -> Scene {
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.8)));
    let cuboid = shapes::cuboid(DVec3::new(0.3, 0.0, 0.5), DVec3::new(0.5, 0.2, 0.7));
    let grey = parts::matte("box", LinearSrgb::grey(0.5));
    parts::add(&mut scene, "box", cuboid, grey);
    let ball = shapes::sphere(DVec3::new(0.7, 0.15, 0.7), 0.1, 3);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let mirror = shapes::cuboid(DVec3::new(0.0, 0.0, -0.1), DVec3::new(1.0, 0.6, -0.05));
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    scene.lights = lights;
    scene
}

fn ahead() -> View {
    view(
        DVec3::new(0.45, 0.7, 1.7),
        DVec3::new(0.5, 0.1, 0.3),
        0.8,
        [150, 100],
    )
}

fn by_layer(scene: &Scene) -> Picture {
    let settings = set(at(500.0, 512), |s| s.layers = vec![LayerKind::Direct]);
    let maps = bake(scene.clone(), &settings).maps;
    let mut rig = Rig::at(AS_CPU, scene, &maps).expect("there is a device");
    rig.picture(&ahead())
}

/// A renderer that traces lamps.
fn tracing(scene: &Scene) -> Option<Rig<'static>> {
    let mut rig = Rig::at(AS_CPU, scene, &[])?;
    rig.renderer.set_traces_lights(true);
    Some(rig)
}

/// Share of the channels that differ by more than 1 % of the brightest or themselves: borders of shadows, which a map
/// softens over a texel.
fn unlike(a: &Picture, b: &Picture) -> f64 {
    let channels = || a.radiance.iter().flatten().zip(b.radiance.iter().flatten());
    let peak = channels().fold(0.0_f32, |peak, (a, _)| peak.max(*a));
    assert!(peak > 0.0, "it is not dark");
    let far = channels().filter(|(a, b)| (*a - *b).abs() > 0.01 * a.max(0.1 * peak));
    far.count() as f64 / (3 * a.radiance.len()) as f64
}

/// Fails unless shadow rays show what the baked layer shows, which is returned.
#[track_caller]
fn assert_traced(rig: &mut Rig) -> Picture {
    let (found, expected) = (rig.picture(&ahead()), by_layer(&rig.scene));
    let off = unlike(&expected, &found);
    assert!(off < 0.02, "{:?} {off}", rig.scene.lights[0].kind);
    expected
}

#[test]
fn shadow_rays_show_the_baked_layer() {
    let all = lamps();
    for lights in all.iter().map(|lamp| vec![lamp.clone()]).chain([all.to_vec()]) {
        let mut scene = scene(lights);
        let mut rig = or_skip!(tracing(&scene));
        let before = assert_traced(&mut rig);
        // The comparison sees that a lamp has moved.
        for light in &mut scene.lights {
            light.kind = light.kind.moved(DVec3::new(0.1, 0.0, 0.0));
            if let LightKind::Sun { direction, .. } = &mut light.kind {
                *direction = DVec3::NEG_Y;
            }
        }
        rig.set_scene(&scene);
        assert!(unlike(&before, &assert_traced(&mut rig)) > 0.1);
    }
}

#[test]
fn moved_object_takes_its_shadow_along() {
    let mut scene = scene(lamps().to_vec());
    let mut rig = or_skip!(tracing(&scene));
    let before = rig.picture(&ahead());
    let mesh = scene.objects[1].mesh_in_scene_mut();
    mesh.positions.iter_mut().for_each(|corner| corner.x -= 0.2);
    rig.set_scene(&scene);
    assert!(unlike(&before, &assert_traced(&mut rig)) > 0.02);
}

/// Under water, which takes its share on the way.
#[test]
fn water_weakens_shadow_rays_as_the_layer() {
    let [point, ..] = lamps();
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.8)));
    let mut water = parts::dielectric("water", 1.33);
    water.volume = Some(Volume {
        attenuation_distance_m: 0.5,
        attenuation_colour: LinearSrgb::new(0.3, 0.7, 0.9),
    });
    let body = shapes::cuboid(DVec3::new(-1.0, -0.5, -1.0), DVec3::new(2.0, 1.2, 2.5));
    parts::add(&mut scene, "water", body, water);
    scene.lights = vec![point];
    let mut rig = or_skip!(tracing(&scene));
    let expected = assert_traced(&mut rig);
    // The comparison sees what the water takes.
    scene.materials[1].volume = None;
    assert!(unlike(&expected, &by_layer(&scene)) > 0.1);
}

/// While hands move, a lamp with a surface is its middle: so small a one is nothing else.
#[test]
fn small_surfaces_are_traced_as_their_middles() {
    let half_m = 1e-3;
    let (centre, colour) = (DVec3::new(0.3, 0.8, 0.6), [1.0, 0.6, 0.2]);
    let radiance = Radiance(0.5 / (4.0 * half_m * half_m));
    let panel = |down: DVec3| LightKind::Panel {
        centre,
        across: DVec3::X * half_m,
        down: down * half_m,
        shape: PanelShape::Rectangle,
        radiance,
    };
    // It shines up, on nothing; turned, down.
    let mut up = or_skip!(tracing(&scene(vec![lamp(colour, panel(DVec3::NEG_Z))])));
    let dark = up.picture(&ahead());
    assert!(dark.radiance.iter().flatten().all(|channel| *channel == 0.0));
    up.set_scene(&scene(vec![lamp(colour, panel(DVec3::Z))]));
    let expected = assert_traced(&mut up);

    // The same lamp as a surface that glows.
    let mut glowing = scene(vec![lamp(colour, LightKind::Surface { object: 4, radiance })]);
    let mut patch = shapes::floor([-half_m, half_m], [-half_m, half_m], 0.0);
    patch.positions.iter_mut().for_each(|corner| *corner += centre);
    patch.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    patch.normals.iter_mut().for_each(|normal| *normal = -*normal);
    let mut material = parts::matte("lamp", LinearSrgb::BLACK);
    material.double_sided = false;
    parts::add(&mut glowing, "lamp", patch, material);
    let found = tracing(&glowing).expect("there is a device").picture(&ahead());
    assert!(unlike(&expected, &found) < 0.02, "{}", unlike(&expected, &found));
}

#[test]
fn lamps_cost_nothing_where_not_traced() {
    let mut scene = scene(lamps().to_vec());
    scene.objects.truncate(2);
    let mut rig = or_skip!(Rig::at(AS_CPU, &scene, &[]));
    rig.picture(&ahead());
    let counts = rig.renderer.counts();
    assert_eq!((counts.pipelines, counts.chain_bytes), (1, 0));
    rig.renderer.set_traces_lights(true);
    rig.picture(&ahead());
    assert!(rig.renderer.counts().chain_bytes > 0);
}
