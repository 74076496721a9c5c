//! What glass that parts wavelengths shows: the device against the processor.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use nephroid::effect::EffectSwitch;
use nephroid::eye_pass::reference::{ChainLimits, EyeRays, ReferenceSettings, render_counted};
use nephroid::eye_pass::renderer::{EyeQuality, Renderer};
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::gpu::Gpu;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Camera, Material, Scene};
use nephroid::transport::Tracer;

use crate::chain_pictures::keep;
use crate::device::{self, gpu};
use crate::flip::mean_flip;
use crate::scenes::{diffuse, floor_map, floor_scene};

/// Largest mean FLIP between the device's picture at rest and the CPU's of the same chains. Nearly all of it is that
/// they look through other places of the pixels: without dispersion they differ as much.
const LARGEST_FLIP: f64 = 0.02;
/// Pictures of which the one at rest is the mean.
const PICTURES: u32 = 64;
const SIZE: [u32; 2] = [96, 64];
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const QUALITY: EyeQuality = EyeQuality {
    traced_scale: 1.0,
    branching_depth: 4,
    minifies: false,
};

/// A ball and a lying prism over a floor of bright lines, two of them coloured.
fn exhibit(glass: &Material) -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let ball = shapes::sphere(DVec3::new(0.3, 0.24, 0.55), 0.2, 5);
    parts::add(&mut scene, "ball", ball, glass.clone());
    let outline = [
        DVec3::new(0.62, 0.1, 0.2),
        DVec3::new(0.82, 0.1, 0.35),
        DVec3::new(0.66, 0.35, 0.3),
    ];
    let prism = shapes::prism(outline, DVec3::new(0.1, 0.0, 0.4));
    parts::add(&mut scene, "prism", prism, glass.clone());
    // Wide lines with soft edges: what differs by the places of samples is little beside what glass parts.
    let wave = |place: usize| 0.5 + 0.5 * (std::f64::consts::TAU * (place as f64 + 0.5) / 8.0).cos();
    let line = |index: usize| {
        let (column, row) = (index % 32, index / 32);
        let (across, along) = (wave(column), wave(row));
        let lit = across.max(along).powi(2);
        [
            0.1 + 3.0 * lit,
            0.1 + 3.0 * lit * along.max(0.3),
            0.1 + 3.0 * lit * across.max(0.2),
        ]
        .map(|channel| channel as f32)
    };
    let maps = vec![floor_map(0, 32, 32, (0..32 * 32).map(line).collect())];
    (scene, maps)
}

fn view() -> View {
    View {
        camera: Camera::look_at("eye", DVec3::new(0.5, 0.9, 1.7), DVec3::new(0.46, 0.2, 0.5), 0.26),
        width: SIZE[0],
        height: SIZE[1],
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::grey(0.1),
    }
}

fn on_cpu((scene, maps): &(Scene, Vec<IlluminationMap>), wavelengths: u32) -> (Picture, EyeRays) {
    let settings = ReferenceSettings {
        samples_per_side: 4,
        limits: ChainLimits {
            branching_depth: QUALITY.branching_depth,
            ..ChainLimits::default()
        },
        wavelengths,
    };
    let tracer = Tracer::new(Arc::new(scene.clone()));
    render_counted(&tracer, maps, &view(), &settings, &(), &Default::default()).expect("nobody cancels")
}

fn renderer(gpu: &Gpu, (scene, maps): &(Scene, Vec<IlluminationMap>)) -> Renderer {
    let mut renderer = Renderer::new(gpu, scene, FORMAT, 1).expect("it is uploaded");
    renderer.set_quality(QUALITY);
    renderer.set_maps(gpu, scene, maps).expect("the maps fit");
    renderer
}

/// The picture at rest, and how long each picture took [ms].
fn at_rest(gpu: &Gpu, renderer: &mut Renderer, pictures: u32) -> (Picture, f64) {
    let target = device::target(gpu, SIZE, FORMAT).create_view(&Default::default());
    // From the first picture on.
    renderer.set_quality(QUALITY);
    let mut taken_ms = Vec::new();
    for _ in 0..pictures {
        let start = Instant::now();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer
            .refine(gpu, &mut encoder, &target, &view())
            .expect("it draws");
        gpu.queue.submit([encoder.finish()]);
        gpu.wait().expect("no fault");
        taken_ms.push(1e3 * start.elapsed().as_secs_f64());
    }
    assert_eq!(renderer.counts().samples, pictures);
    assert_eq!((gpu.take_error(), renderer.chain_refusal()), (None, None));
    taken_ms.sort_by(f64::total_cmp);
    let picture = renderer.shown_radiance(gpu, &view()).expect("it is read back");
    (picture, taken_ms[taken_ms.len() / 2])
}

/// Time of a picture of a walk [ms]: the shortest of some.
fn fastest_alone(gpu: &Gpu, renderer: &mut Renderer) -> f64 {
    let pictures = (0..6).map(|_| at_rest(gpu, renderer, 1).1);
    pictures.fold(f64::INFINITY, f64::min)
}

#[test]
fn a_picture_at_rest_shows_all_wavelengths_as_the_cpu_does() {
    let Some(gpu) = gpu() else { return };
    let exhibit = exhibit(&parts::glass("N-SF66"));
    let (parted, rays) = on_cpu(&exhibit, 16);
    let (unparted, few_rays) = on_cpu(&exhibit, 0);
    let mut device = renderer(&gpu, &exhibit);
    let (walking, _) = at_rest(&gpu, &mut device, 1);
    let walking_ms = fastest_alone(&gpu, &mut device);
    let (found, parted_ms) = at_rest(&gpu, &mut device, PICTURES);
    device.set_dispersion(EffectSwitch::Off);
    let (off, off_ms) = at_rest(&gpu, &mut device, PICTURES);
    let walking_off_ms = fastest_alone(&gpu, &mut device);
    let show = |what: &str, picture: &Picture| {
        let shown = display_rgba8(picture, 0.0, ToneMap::None);
        keep(&format!("parted_{what}"), &shown, &view());
        shown
    };
    let expected = show("cpu", &parted);
    let against = |shown: &[u8]| mean_flip(&expected, shown, SIZE[0] as usize);
    let same = against(&show("gpu", &found));
    let by_three = against(&show("walking", &walking));
    let missing = [against(&show("off", &off)), against(&show("cpu_off", &unparted))];
    let both_off = mean_flip(&show("cpu_off", &unparted), &show("off", &off), SIZE[0] as usize);
    let pixels = f64::from(SIZE[0] * SIZE[1]) * 16.0;
    use std::io::Write as _;
    let _ = writeln!(
        std::io::stdout(),
        "mean FLIP {same:.5} at rest, {by_three:.5} walking, {missing:.5?} without dispersion, {both_off:.5} between \
         those; CPU rays per sample {:.2} by wavelength, {:.2} without; device ms per picture at rest {parted_ms:.1}, \
         {off_ms:.1} without, ratio {:.2}; walking ratio {:.2}",
        rays.chain_rays as f64 / pixels,
        few_rays.chain_rays as f64 / pixels,
        parted_ms / off_ms,
        walking_ms / walking_off_ms
    );
    assert!(
        same <= LARGEST_FLIP && same < 1.25 * both_off,
        "{same} {both_off}"
    );
    assert!(
        missing.iter().all(|missing| *missing > 2.5 * same),
        "{missing:?} {same}"
    );
}

#[test]
fn switched_off_or_without_such_glass_pictures_are_those_of_one_index() {
    let Some(gpu) = gpu() else { return };
    let glass = parts::glass("N-SF66");
    let plain = Material {
        glass: None,
        ..glass.clone()
    };
    let picture = |material: &Material, switch: EffectSwitch| {
        let mut device = renderer(&gpu, &exhibit(material));
        device.set_dispersion(switch);
        let picture = device.radiance(&gpu, &view()).expect("it renders");
        picture.radiance
    };
    let one_index = picture(&plain, EffectSwitch::Auto);
    assert!(picture(&plain, EffectSwitch::On) == one_index);
    assert!(picture(&glass, EffectSwitch::Off) == one_index);
    assert!(picture(&glass, EffectSwitch::Auto) != one_index);
}

#[test]
fn white_surroundings_stay_white_in_every_picture() {
    let Some(gpu) = gpu() else { return };
    let mut scene = Scene::default();
    let slab = shapes::cuboid(DVec3::new(-2.0, 0.1, -2.0), DVec3::new(3.0, 0.4, 3.0));
    parts::add(&mut scene, "slab", slab, parts::glass("N-SF11"));
    let mut device = renderer(&gpu, &(scene, Vec::new()));
    device.set_dispersion(EffectSwitch::Off);
    let (by_one_index, _) = at_rest(&gpu, &mut device, 1);
    device.set_dispersion(EffectSwitch::Auto);
    for pictures in 1..6 {
        let (seen, _) = at_rest(&gpu, &mut device, pictures);
        let pairs = seen
            .radiance
            .iter()
            .flatten()
            .zip(by_one_index.radiance.iter().flatten());
        let off: Vec<f32> = pairs.map(|(a, b)| (a / b - 1.0).abs()).collect();
        let mean = off.iter().sum::<f32>() / off.len() as f32;
        let largest = off.iter().copied().fold(0.0, f32::max);
        // Half floats hold 5e-4; which way is the stronger after four surfaces may differ by wavelength.
        assert!(mean < 1e-3 && largest < 0.02, "{pictures}: {mean}, {largest}");
    }
}
