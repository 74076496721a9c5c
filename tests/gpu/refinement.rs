//! A view at rest becomes a mean of many pictures.

use glam::DVec3;
use nephroid::eye_pass::renderer::{EyeQuality, Renderer};
use nephroid::eye_pass::{ToneMap, View};
use nephroid::gpu::{Gpu, readback};
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Camera, Scene};

use crate::device::{self, gpu};
use crate::scenes::{diffuse, floor_map, floor_scene};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const SIZE: [u32; 2] = [60, 40];

/// A mirror ball on a floor with a coarse check.
fn scene() -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let ball = shapes::sphere(DVec3::new(0.5, 0.2, 0.5), 0.2, 4);
    parts::add(&mut scene, "ball", ball, parts::mirror());
    let check = |index: usize| {
        [if (index / 16 + index % 16).is_multiple_of(2) {
            2.0
        } else {
            0.2
        }; 3]
    };
    (scene, vec![floor_map(0, 16, 16, (0..256).map(check).collect())])
}

fn view(eye: DVec3) -> View {
    View {
        camera: Camera::look_at("eye", eye, DVec3::new(0.5, 0.1, 0.5), 0.7),
        width: SIZE[0],
        height: SIZE[1],
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::grey(0.1),
    }
}

struct Target {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl Target {
    fn new(gpu: &Gpu) -> Self {
        let texture = device::target(gpu, SIZE, FORMAT);
        let view = texture.create_view(&Default::default());
        Self { texture, view }
    }

    fn refined(&self, gpu: &Gpu, renderer: &mut Renderer, view: &View) -> Vec<u8> {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer
            .refine(gpu, &mut encoder, &self.view, view)
            .expect("it draws");
        gpu.queue.submit([encoder.finish()]);
        readback::read_texture(gpu, &self.texture).expect("it is read back")
    }
}

/// Mean absolute difference of bytes.
fn difference(a: &[u8], b: &[u8]) -> f64 {
    let sum: u64 = a.iter().zip(b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.len() as f64
}

#[test]
fn a_mean_of_many_comes_close_to_many_samples_and_another_view_starts_anew() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = scene();
    let mut renderer = Renderer::new(&gpu, &scene, FORMAT, 1).expect("the scene is uploaded");
    renderer.set_quality(EyeQuality::STILL);
    renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
    let (first_view, other_view) = (view(DVec3::new(0.5, 0.8, 1.8)), view(DVec3::new(0.7, 0.8, 1.8)));
    let target = Target::new(&gpu);

    let reference = renderer
        .radiance_sampled(&gpu, &first_view, 8)
        .expect("it renders");
    let reference = nephroid::eye_pass::tone_mapping::display_rgba8(&reference, 0.0, ToneMap::None);
    let first = target.refined(&gpu, &mut renderer, &first_view);
    assert_eq!(renderer.counts().samples, 1, "the first one is drawn");
    let mut last = first.clone();
    for samples in 2..=32 {
        last = target.refined(&gpu, &mut renderer, &first_view);
        assert_eq!(renderer.counts().samples, samples);
    }
    let (alone, mean) = (difference(&first, &reference), difference(&last, &reference));
    assert!(mean < 0.2 * alone, "{mean} after 32 samples, {alone} after one");

    target.refined(&gpu, &mut renderer, &other_view);
    assert_eq!(renderer.counts().samples, 1);
    let again = target.refined(&gpu, &mut renderer, &first_view);
    assert!(again == first, "nothing of the mean is left");
    // What changes the picture ends the mean too.
    target.refined(&gpu, &mut renderer, &first_view);
    renderer.set_maps(&gpu, &scene, &[]).expect("no maps fit");
    target.refined(&gpu, &mut renderer, &first_view);
    assert_eq!(renderer.counts().samples, 1);
    assert_eq!(gpu.take_error(), None);
}

/// Coarser than the picture, finer, and as fine: the same picture but for its sharpness.
#[test]
fn the_traced_picture_may_be_coarser_or_finer() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = scene();
    // Nothing but the ball.
    let mut view = view(DVec3::new(0.5, 0.8, 1.8));
    view.camera = Camera::look_at("eye", view.camera.position, DVec3::new(0.5, 0.2, 0.5), 0.15);
    let mean_of = |traced_scale: f64, samples_per_side: u32| {
        let mut renderer = Renderer::new(&gpu, &scene, FORMAT, 1).expect("the scene is uploaded");
        renderer.set_quality(EyeQuality {
            traced_scale,
            ..EyeQuality::STILL
        });
        renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
        let picture = renderer
            .radiance_sampled(&gpu, &view, samples_per_side)
            .expect("it renders");
        let pixels = u64::from(SIZE[0] * SIZE[1]) as f64 * traced_scale * traced_scale;
        assert_eq!(renderer.counts().traced_pixels, pixels as u64);
        picture.radiance
    };
    let reference = mean_of(1.0, 8);
    let off = |traced_scale| {
        let found = mean_of(traced_scale, 1);
        let pairs = found.iter().flatten().zip(reference.iter().flatten());
        let sum: f32 = pairs.map(|(a, b)| (a - b).abs()).sum();
        f64::from(sum) / found.len() as f64
    };
    let [quarter, half, whole, double] = [0.25, 0.5, 1.0, 2.0].map(off);
    assert!(
        double < whole && whole < half && half < quarter,
        "{double} {whole} {half} {quarter}"
    );
    // A mean of many coarse ones is finer than one, though no finer than their pixels blur.
    let refined = mean_of(0.25, 8);
    let pairs = refined.iter().flatten().zip(reference.iter().flatten());
    let sum: f32 = pairs.map(|(a, b)| (a - b).abs()).sum();
    let off = f64::from(sum) / refined.len() as f64;
    assert!(off < 0.85 * quarter, "{off}, {quarter} of a single one");
    let brightness = |picture: &[[f32; 3]]| picture.iter().flatten().sum::<f32>();
    let ratio = brightness(&mean_of(0.25, 1)) / brightness(&reference);
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}
