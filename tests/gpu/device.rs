//! The adapter that the tests share the need of.

use nephroid::eye_pass::renderer::Renderer;
use nephroid::eye_pass::{ToneMap, View};
use nephroid::gpu::Gpu;
use nephroid::scene::builtin;

use crate::support::skip;

/// A device, or `None` after a counted skip where there is no adapter.
pub fn gpu() -> Option<Gpu> {
    Gpu::headless()
        .map_err(|error| {
            let test = std::thread::current().name().unwrap_or("?").to_owned();
            skip(&test, &error.to_string());
        })
        .ok()
}

#[test]
fn adapter_has_a_name_and_no_fault() {
    let Some(gpu) = gpu() else { return };
    assert!(!gpu.adapter_name().is_empty());
    assert_eq!(gpu.take_error(), None);
    assert!(!gpu.is_lost());
    gpu.wait().expect("an idle device is fine");
}

#[test]
fn faults_are_kept_and_do_not_panic() {
    let Some(gpu) = gpu() else { return };
    // A buffer with contradicting usages: refused by validation.
    let _ = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 16,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::VERTEX,
        mapped_at_creation: false,
    });
    let error = gpu.take_error().expect("the fault was recorded");
    assert!(!error.to_string().contains('\n'), "one sentence: {error}");
    assert_eq!(gpu.take_error(), None, "a fault is handed out once");
}

#[test]
fn a_destroyed_device_is_lost_and_says_so() {
    let Some(gpu) = gpu() else { return };
    gpu.device.destroy();
    let _ = gpu.wait();
    assert!(gpu.is_lost());
}

/// Whatever is asked of a renderer whose device is gone: an answer or one sentence, and never a panic.
#[test]
fn a_renderer_on_a_lost_device_says_so() {
    let Some(gpu) = gpu() else { return };
    let scene = builtin::build("mirror").expect("it is built in");
    let view = View {
        camera: scene.cameras[0].clone(),
        width: 32,
        height: 24,
        exposure_stops: 0.0,
        tone_map: ToneMap::Neutral,
        background: nephroid::optics::LinearSrgb::BLACK,
    };
    let mut renderer = Renderer::new(&gpu, &scene, wgpu::TextureFormat::Rgba8Unorm, 1).expect("a renderer");
    assert!(renderer.radiance(&gpu, &view).is_ok());
    gpu.device.destroy();
    let told = renderer.radiance(&gpu, &view).map(|_| ());
    let error = told.expect_err("nothing can be read from it").to_string();
    assert!(
        error.starts_with("graphics device: ") && !error.contains('\n'),
        "{error}"
    );
    let _ = renderer.set_scene(&gpu, &scene);
    let _ = renderer.set_maps(&gpu, &scene, &[]);
    let _ = renderer.radiance(&gpu, &view);
    assert!(gpu.is_lost());
    // Another device takes its place.
    let Some(gpu) = self::gpu() else { return };
    let mut renderer = Renderer::new(&gpu, &scene, wgpu::TextureFormat::Rgba8Unorm, 1).expect("a renderer");
    assert!(renderer.radiance(&gpu, &view).is_ok());
}

#[test]
fn sizes_beyond_the_device_are_refused_in_one_sentence() {
    let Some(gpu) = gpu() else { return };
    let limit = gpu.limits().max_texture_dimension_2d;
    assert!(gpu.check_texture_size("picture", limit, 1).is_ok());
    for (width, height) in [(limit + 1, 1), (1, limit + 1), (0, 1), (1, 0)] {
        let error = gpu
            .check_texture_size("picture", width, height)
            .expect_err("no texture is like that");
        assert!(error.to_string().contains(&limit.to_string()), "{error}");
    }
}

/// A texture to draw pictures into, as a window has, that can be read back.
pub fn target(gpu: &Gpu, [width, height]: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}
