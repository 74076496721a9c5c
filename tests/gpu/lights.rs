//! Light straight from the lamps by shadow rays, against the baked layer.

use std::sync::Arc;

use glam::DVec3;
use nephroid::eye_pass::renderer::{EyeQuality, Renderer};
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::gpu::Gpu;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Camera, Light, LightKind, PanelShape, Scene, Volume};
use nephroid::session::BakeSession;
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::units::{Irradiance, Radiance, RadiantIntensity};

use crate::device::gpu;
use crate::scenes::{diffuse, floor_scene};

fn lamp(colour: LinearSrgb, kind: LightKind) -> Light {
    Light {
        name: "lamp".into(),
        colour,
        spectrum: None,
        kind,
        size: nephroid::scene::LightSize::None,
    }
}

/// One lamp of each kind, each of a colour of its own.
fn lamps() -> [Light; 3] {
    let position = DVec3::new(0.1, 0.9, 0.2);
    [
        lamp(
            LinearSrgb::new(1.0, 0.2, 0.1),
            LightKind::Point {
                position,
                intensity: RadiantIntensity(2.0),
            },
        ),
        lamp(
            LinearSrgb::new(0.1, 1.0, 0.3),
            LightKind::Spot {
                position: DVec3::new(0.8, 0.7, 0.4),
                direction: DVec3::new(-0.3, -1.0, 0.1).normalize(),
                intensity: RadiantIntensity(3.0),
                inner_cone_rad: 0.2,
                outer_cone_rad: 0.5,
            },
        ),
        lamp(
            LinearSrgb::new(0.2, 0.3, 1.0),
            LightKind::Sun {
                direction: DVec3::new(0.4, -1.0, -0.3).normalize(),
                normal_irradiance: Irradiance(2.0),
            },
        ),
    ]
}

/// A floor with a matte box, a glass ball that casts a shadow, and a mirror behind them.
fn scene(lights: Vec<Light>) -> Scene {
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.8)));
    let cuboid = shapes::cuboid(DVec3::new(0.3, 0.0, 0.5), DVec3::new(0.5, 0.2, 0.7));
    parts::add(
        &mut scene,
        "box",
        cuboid,
        parts::matte("box", LinearSrgb::grey(0.5)),
    );
    let ball = shapes::sphere(DVec3::new(0.7, 0.15, 0.7), 0.1, 3);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let mirror = shapes::cuboid(DVec3::new(0.0, 0.0, -0.1), DVec3::new(1.0, 0.6, -0.05));
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    scene.lights = lights;
    scene
}

fn view() -> View {
    View {
        camera: Camera::look_at("eye", DVec3::new(0.45, 0.7, 1.7), DVec3::new(0.5, 0.1, 0.3), 0.8),
        width: 150,
        height: 100,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::BLACK,
    }
}

fn renderer(gpu: &Gpu, scene: &Scene) -> Renderer {
    let mut renderer = Renderer::new(gpu, scene, wgpu::TextureFormat::Rgba8Unorm, 1).expect("it is uploaded");
    renderer.set_quality(EyeQuality {
        minifies: false,
        ..EyeQuality::STILL
    });
    renderer
}

fn by_layer(gpu: &Gpu, scene: &Scene) -> Picture {
    let mut session = BakeSession::new(Arc::new(scene.clone())).expect("it is sound");
    let settings = BakeSettings {
        density_per_sr: 500.0,
        map_resolution: MapResolution::Fixed {
            width: 512,
            height: 512,
        },
        layers: vec![LayerKind::Direct],
        ..BakeSettings::default()
    };
    let maps = session
        .bake(&settings, &(), &Default::default())
        .expect("it bakes")
        .maps;
    let mut renderer = renderer(gpu, scene);
    renderer.set_maps(gpu, scene, &maps).expect("the maps fit");
    renderer.radiance(gpu, &view()).expect("it renders")
}

fn traced(gpu: &Gpu, renderer: &mut Renderer) -> Picture {
    renderer.set_traces_lights(true);
    renderer.radiance(gpu, &view()).expect("it renders")
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

#[test]
fn shadow_rays_show_what_the_baked_layer_shows() {
    let Some(gpu) = gpu() else { return };
    let all = lamps();
    let [point, spot, sun] = all.clone();
    for lights in [vec![point], vec![spot], vec![sun], all.to_vec()] {
        let scene = scene(lights);
        let mut renderer = renderer(&gpu, &scene);
        let (found, expected) = (traced(&gpu, &mut renderer), by_layer(&gpu, &scene));
        let off = unlike(&expected, &found);
        assert!(off < 0.02, "{:?}: {off} of the channels", scene.lights[0].kind);
        // The comparison sees that a lamp has moved.
        let mut moved = scene.clone();
        for light in &mut moved.lights {
            light.kind = match light.kind.moved(DVec3::new(0.1, 0.0, 0.0)) {
                LightKind::Sun {
                    normal_irradiance, ..
                } => LightKind::Sun {
                    direction: DVec3::NEG_Y,
                    normal_irradiance,
                },
                kind => kind,
            };
        }
        renderer.set_scene(&gpu, &moved).expect("it is uploaded");
        let after = traced(&gpu, &mut renderer);
        assert!(unlike(&expected, &after) > 0.1);
        assert!(unlike(&by_layer(&gpu, &moved), &after) < 0.02);
    }
    assert_eq!(gpu.take_error(), None);
}

/// Under water, which takes its share on the way.
#[test]
fn shadow_rays_of_a_lamp_under_water_are_weakened_as_the_baked_layer_is() {
    let Some(gpu) = gpu() else { return };
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
    let mut renderer = renderer(&gpu, &scene);
    let (found, expected) = (traced(&gpu, &mut renderer), by_layer(&gpu, &scene));
    assert!(unlike(&expected, &found) < 0.02, "{}", unlike(&expected, &found));
    // The comparison sees what the water takes.
    let water = scene
        .materials
        .iter_mut()
        .find(|material| material.name == "water");
    water.expect("it is there").volume = None;
    assert!(unlike(&expected, &by_layer(&gpu, &scene)) > 0.1);
    assert_eq!(gpu.take_error(), None);
}

/// While hands move, a lamp with a surface is its middle: so small a one is nothing else.
#[test]
fn small_panels_and_glowing_surfaces_are_traced_as_their_middles() {
    let Some(gpu) = gpu() else { return };
    let half_m = 1e-3;
    let centre = DVec3::new(0.3, 0.8, 0.6);
    let radiance = Radiance(0.5 / (4.0 * half_m * half_m));
    let panel = lamp(
        LinearSrgb::new(1.0, 0.6, 0.2),
        LightKind::Panel {
            centre,
            across: DVec3::X * half_m,
            down: DVec3::Z * -half_m,
            shape: PanelShape::Rectangle,
            radiance,
        },
    );
    // It shines up, on nothing; turned, down.
    let mut up = scene(vec![panel.clone()]);
    assert_eq!(
        traced(&gpu, &mut renderer(&gpu, &up))
            .radiance
            .iter()
            .flatten()
            .sum::<f32>(),
        0.0
    );
    let LightKind::Panel { down, .. } = &mut up.lights[0].kind else {
        panic!("it is a panel");
    };
    *down = -*down;
    let below = up;
    let (found, expected) = (traced(&gpu, &mut renderer(&gpu, &below)), by_layer(&gpu, &below));
    assert!(unlike(&expected, &found) < 0.02, "{}", unlike(&expected, &found));
    // The same lamp as a surface that glows.
    let mut glowing = scene(Vec::new());
    let patch = shapes::floor([-half_m, half_m], [-half_m, half_m], 0.0);
    let mut material = parts::matte("lamp", LinearSrgb::BLACK);
    material.double_sided = false;
    parts::add(&mut glowing, "lamp", patch, material);
    let mesh = Arc::make_mut(&mut glowing.objects[4].mesh);
    mesh.positions
        .iter_mut()
        .for_each(|corner| *corner = centre + *corner);
    mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    glowing.lights = vec![lamp(panel.colour, LightKind::Surface { object: 4, radiance })];
    let found = traced(&gpu, &mut renderer(&gpu, &glowing));
    assert!(unlike(&expected, &found) < 0.02, "{}", unlike(&expected, &found));
    assert_eq!(gpu.take_error(), None);
}

#[test]
fn a_moved_object_takes_its_shadow_along() {
    let Some(gpu) = gpu() else { return };
    let mut scene = scene(lamps().to_vec());
    let mut renderer = renderer(&gpu, &scene);
    let before = traced(&gpu, &mut renderer);
    let mesh = Arc::make_mut(&mut scene.objects[1].mesh);
    mesh.positions.iter_mut().for_each(|corner| corner.x -= 0.2);
    renderer.set_scene(&gpu, &scene).expect("it is uploaded");
    let after = traced(&gpu, &mut renderer);
    assert!(unlike(&before, &after) > 0.02);
    assert!(unlike(&by_layer(&gpu, &scene), &after) < 0.02);
}

#[test]
fn lamps_cost_nothing_where_they_are_not_traced() {
    let Some(gpu) = gpu() else { return };
    let mut scene = scene(lamps().to_vec());
    scene.objects.truncate(2);
    let mut renderer = renderer(&gpu, &scene);
    renderer.radiance(&gpu, &view()).expect("it renders");
    let counts = renderer.counts();
    assert_eq!((counts.pipelines, counts.chain_bytes), (1, 0));
    traced(&gpu, &mut renderer);
    assert!(renderer.counts().chain_bytes > 0);
}
