//! Environments: seen behind everything, in mirrors and through glass, the same as by the CPU eye pass.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use nephroid::eye_pass::reference::{ReferenceSettings, render};
use nephroid::eye_pass::renderer::{EyeQuality, MapStyle, Renderer};
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::gpu::Gpu;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Camera, Environment, Light, LightKind, LightSize, Scene};
use nephroid::transport::Tracer;

use crate::device::gpu;
use crate::scenes::{diffuse, floor_scene};

/// Smooth but for its seam, brighter upwards, of other colours all around.
fn gradient(width: usize, height: usize) -> Environment {
    let pixels = (0..width * height)
        .map(|index| {
            let (x, y) = (
                (index % width) as f32 / width as f32,
                (index / width) as f32 / height as f32,
            );
            [0.2 + x, 1.2 - x, 2.0 * (1.0 - y) + 0.1]
        })
        .collect();
    Environment::new(width, height, pixels).expect("a sound image")
}

fn light(scale: f64, colour: LinearSrgb) -> Light {
    Light {
        name: "environment".into(),
        colour,
        spectrum: None,
        kind: LightKind::Environment { scale },
        size: LightSize::None,
    }
}

/// A mirror ball and a glass ball over a dark floor under a sky.
fn scene(sky: Environment) -> Scene {
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.1)));
    let mirror = shapes::sphere(DVec3::new(0.3, 0.3, 0.5), 0.2, 4);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    let glass = shapes::sphere(DVec3::new(0.75, 0.3, 0.5), 0.2, 4);
    parts::add(&mut scene, "glass", glass, parts::dielectric("glass", 1.5));
    scene.environment = Some(Arc::new(sky));
    scene.lights = vec![light(1.5, LinearSrgb::new(1.0, 0.5, 2.0))];
    scene
}

fn view(forward_to: DVec3) -> View {
    View {
        camera: Camera::look_at("eye", DVec3::new(0.5, 0.6, 1.7), forward_to, 1.0),
        width: 120,
        height: 80,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::new(9.0, 9.0, 9.0),
    }
}

fn renderer(gpu: &Gpu, scene: &Scene) -> Renderer {
    let mut renderer = Renderer::new(gpu, scene, wgpu::TextureFormat::Rgba8Unorm, 1).expect("it is uploaded");
    renderer.set_quality(EyeQuality::STILL);
    renderer
}

fn on_cpu(scene: &Scene, view: &View) -> Picture {
    let tracer = Tracer::new(Arc::new(scene.clone()));
    render(
        &tracer,
        &[],
        view,
        &ReferenceSettings::default(),
        &(),
        &Default::default(),
    )
    .expect("nobody cancels it")
}

/// Share of the channels that differ by more than 1 % of the brightest or themselves.
fn unlike(a: &Picture, b: &Picture) -> f64 {
    let channels = || a.radiance.iter().flatten().zip(b.radiance.iter().flatten());
    let peak = channels().fold(0.0_f32, |peak, (a, _)| peak.max(*a));
    let far = channels().filter(|(a, b)| (*a - *b).abs() > 0.01 * a.max(0.2 * peak));
    far.count() as f64 / (3 * a.radiance.len()) as f64
}

#[test]
fn a_sky_is_the_same_on_both() {
    let Some(gpu) = gpu() else { return };
    for (width, height) in [(64, 32), (1, 1), (7, 3)] {
        let scene = scene(gradient(width, height));
        let mut renderer = renderer(&gpu, &scene);
        // Ahead, and back over the seam of the image with the pole in view.
        for target in [
            DVec3::new(0.5, 0.3, 0.5),
            DVec3::new(0.4, 2.5, 1.9),
            DVec3::new(1.5, 0.2, 2.0),
        ] {
            let view = view(target);
            let (expected, found) = (
                on_cpu(&scene, &view),
                renderer.radiance(&gpu, &view).expect("it renders"),
            );
            let off = unlike(&expected, &found);
            // Chains that end at the ball's outline, or go on over many surfaces, may differ.
            assert!(
                off < 0.01,
                "{width}x{height} towards {target}: {off} of the channels"
            );
        }
    }
    assert_eq!(gpu.take_error(), None);
}

/// A ray straight ahead sees the image's middle at +z, and its left quarter at −x… by the convention that `Environment`
/// states; and the light's strength counts as it is edited.
#[test]
fn directions_and_strength_of_a_sky() {
    let Some(gpu) = gpu() else { return };
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.5)));
    // Four quarters around, of one row: from −z over +x, +z and −x.
    let pixels = vec![[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [4.0, 0.0, 0.0]];
    scene.environment = Some(Arc::new(Environment::new(4, 1, pixels).expect("sound")));
    scene.lights = vec![light(2.0, LinearSrgb::WHITE)];
    let mut renderer = renderer(&gpu, &scene);
    let mut middle = |scene: &Scene, azimuth: f64| {
        renderer.set_scene(&gpu, scene).expect("it is uploaded");
        let eye = DVec3::new(0.5, 5.0, 0.5);
        let ahead = DVec3::new(azimuth.sin(), 0.0, -azimuth.cos());
        let view = View {
            camera: Camera::look_at("eye", eye, eye + ahead, 0.1),
            width: 9,
            height: 9,
            ..view(DVec3::ZERO)
        };
        let picture = renderer.radiance(&gpu, &view).expect("it renders");
        f64::from(picture.radiance[4 * 9 + 4][0])
    };
    for (quarter, expected) in [
        (0.5, 1.0),
        (1.5, 2.0),
        (2.5, 3.0),
        (3.5, 4.0),
        (1.0, 1.5),
        (4.0, 2.5),
    ] {
        let found = middle(&scene, quarter * PI / 2.0);
        assert!(
            (found / (2.0 * expected) - 1.0).abs() < 2e-3,
            "{quarter} quarters: {found}"
        );
    }
    scene.lights = vec![light(0.5, LinearSrgb::new(0.5, 1.0, 1.0))];
    let found = middle(&scene, PI / 4.0);
    assert!((found / 0.25 - 1.0).abs() < 2e-3, "{found}");
}

#[test]
fn a_scene_without_a_sky_has_none_on_the_device() {
    let Some(gpu) = gpu() else { return };
    let mut scene = scene(gradient(4, 2));
    let view = view(DVec3::new(0.5, 0.3, 0.5));
    let mut under = renderer(&gpu, &scene);
    under.radiance(&gpu, &view).expect("it renders");
    assert_eq!(under.counts().sky_bytes, 4 * 2 * 16);
    // Colours of maps are shown before a plain background.
    under.set_map_style(MapStyle::AsItIs);
    let plain = under.radiance(&gpu, &view).expect("it renders");
    assert_eq!(plain.radiance[0], [9.0; 3]);
    scene.environment = None;
    scene.lights.clear();
    let mut without = renderer(&gpu, &scene);
    let plain = without.radiance(&gpu, &view).expect("it renders");
    assert_eq!((without.counts().sky_bytes, plain.radiance[0]), (0, [9.0; 3]));
    under.set_map_style(MapStyle::Lit);
    under.set_scene(&gpu, &scene).expect("it is uploaded");
    assert_eq!(under.radiance(&gpu, &view).expect("it renders"), plain);
    assert_eq!(under.counts().sky_bytes, 0);
}

#[test]
fn a_bright_sun_in_a_sky_leaves_surfaces_their_digits() {
    let Some(gpu) = gpu() else { return };
    let mut pixels = vec![[0.5_f32; 3]; 32 * 16];
    pixels[3 * 32 + 17] = [1e9; 3];
    let mut scene = scene(Environment::new(32, 16, pixels).expect("sound"));
    scene.lights = vec![light(1.0, LinearSrgb::WHITE)];
    let floor = &mut scene.materials[0];
    floor.emitted_radiance = LinearSrgb::grey(0.25);
    let view = view(DVec3::new(0.5, 0.0, 0.9));
    let found = renderer(&gpu, &scene).radiance(&gpu, &view).expect("it renders");
    let floor = found.radiance[40 * 120 + 60];
    assert!((floor[0] / 0.25 - 1.0).abs() < 1e-3, "{floor:?}");
    assert!(found.radiance.iter().flatten().all(|channel| channel.is_finite()));
}
