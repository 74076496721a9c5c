//! Faults of a device, and what it is too small for: refused in a sentence, and the rest is drawn.

use nephroid::effect::{EffectSwitch, EffectSwitches};
use nephroid::eye_pass::renderer::{Renderer, render_counted};
use nephroid::gpu::Gpu;
use nephroid::illumination::parametrise;

use crate::gpu::rig::{FORMAT, Rig, gpu, or_skip, own_gpu};
use crate::prelude::*;
use support::floors::{diffuse, floor_map, floor_scene, from_above};
use support::meshes::grid;
use support::scenes::{bits, map_of, view};

fn scene(levels: u32) -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mirror = shapes::rectangle(dvec3(0.5, 0.3, 0.0), DVec3::X * 0.4, DVec3::Y * 0.2);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    let ball = shapes::sphere(dvec3(0.5, 0.3, 0.5), 0.2, levels);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let texels = (0..16).map(|texel| [0.1 + 0.2 * texel as f32; 3]).collect();
    (scene, vec![floor_map(0, 4, 4, texels)])
}

fn ahead() -> View {
    View {
        background: rgb(0.1, 0.2, 0.3),
        ..view(dvec3(0.5, 0.8, 2.0), dvec3(0.5, 0.2, 0.3), 0.7, [48, 32])
    }
}

#[test]
fn faults_are_kept_and_do_not_panic() {
    let gpu = or_skip!(own_gpu(|_| {}));
    assert!(!gpu.adapter_name().is_empty());
    assert_eq!((gpu.take_error(), gpu.is_lost()), (None, false));
    gpu.wait().expect("an idle device is fine");
    // A buffer with contradicting usages: refused by validation.
    let _ = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 16,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::VERTEX,
        mapped_at_creation: false,
    });
    let error = gpu.take_error().expect("the fault was recorded");
    says(&error, "");
    assert_eq!(gpu.take_error(), None, "a fault is handed out once");
}

/// Whatever is asked of a renderer whose device is gone: an answer or one sentence, and never a panic.
#[test]
fn lost_device_is_told_and_replaced() {
    let gpu = or_skip!(own_gpu(|_| {}));
    let (scene, maps) = scene(1);
    let mut renderer = Rig::on(&gpu, &scene, &maps).renderer;
    assert!(renderer.radiance(&gpu, &ahead()).is_ok());
    gpu.device.destroy();
    let told = renderer
        .radiance(&gpu, &ahead())
        .expect_err("nothing can be read");
    says(&told, "graphics device: ");
    let _ = renderer.set_scene(&gpu, &scene);
    let _ = renderer.set_maps(&gpu, &scene, &[]);
    let _ = renderer.radiance(&gpu, &ahead());
    let _ = gpu.wait();
    assert!(gpu.is_lost());
    let mut other = Rig::new(&scene, &maps).expect("another takes its place");
    other.picture(&ahead());
}

#[test]
fn sizes_no_device_holds_are_refused() {
    let gpu = or_skip!(gpu());
    let limit = gpu.limits().max_texture_dimension_2d;
    assert!(gpu.check_texture_size("picture", limit, 1).is_ok());
    for (width, height) in [(limit + 1, 1), (1, limit + 1), (0, 1), (1, 0)] {
        let checked = gpu.check_texture_size("picture", width, height);
        says(checked.expect_err("no texture"), &limit.to_string());
    }
    for (width, words) in [(1 << 24, "picture: 16777216×32 "), (0, "")] {
        let sized = View { width, ..ahead() };
        let drawn = render_counted(gpu, &Scene::default(), &[], &sized, 1, &EffectSwitches::default());
        let error = drawn.expect_err("no texture");
        says(&error, words);
    }
    assert!(Renderer::new(gpu, &Scene::default(), FORMAT, 3).is_err());
    assert_eq!(gpu.take_error(), None);
}

/// Fails unless a device refuses chains by a sentence with these words and draws what it draws without them.
fn assert_refused(small: &Gpu, (scene, maps): &(Scene, Vec<IlluminationMap>), words: &str, view: &View) {
    let mut whole = Rig::new(scene, maps).expect("there is a device");
    let with = whole.picture(view);
    whole.set_chains(EffectSwitch::Off);
    let without = whole.picture(view);
    assert_ne!(with.radiance, without.radiance, "chains would be seen");
    let mut rig = Rig::on(small, scene, maps);
    assert_eq!(rig.renderer.chain_refusal(), None, "nothing was asked of it yet");
    assert_eq!(rig.picture(view).radiance, without.radiance);
    let refusal = rig.renderer.chain_refusal().expect("it is too small");
    says(refusal, words);
    says(refusal, "they are drawn without reflections and refractions");
    let counts = rig.renderer.counts();
    assert_eq!((counts.chain_bytes, counts.specular_pipelines), (0, 0));
    // Forced on it is the same, and no fault.
    rig.set_chains(EffectSwitch::On);
    assert_eq!(rig.picture(view).radiance, without.radiance);
}

#[test]
fn too_few_buffers_leave_out_chains_or_are_refused() {
    for buffers in [3, 4, 6] {
        let small = or_skip!(with_buffers(buffers));
        let words = format!("allows a shader {buffers} buffers, and");
        assert_refused(&small, &scene(3), &words, &ahead());
    }
    for buffers in [0, 1, 2] {
        let small = or_skip!(with_buffers(buffers));
        let refusal = Renderer::new(&small, &scene(1).0, FORMAT, 1).expect_err("it takes three");
        says(&refusal, "storage buffers");
        assert_eq!(small.take_error(), None);
    }
}

fn with_buffers(count: u32) -> Option<Gpu> {
    own_gpu(|limits| limits.max_storage_buffers_per_shader_stage = count)
}

#[test]
fn large_scenes_lose_chains_small_ones_do_not() {
    let limit = |limits: &mut wgpu::Limits| limits.max_storage_buffer_binding_size = 1 << 18;
    let small = or_skip!(own_gpu(limit));
    let (large, fitting) = (scene(5), scene(3));
    let words = "holds at most 256 KiB, and 20484 triangles take more";
    assert_refused(&small, &large, words, &ahead());
    let mut rig = Rig::on(&small, &large.0, &large.1);
    rig.picture(&ahead());
    assert!(rig.renderer.chain_refusal().is_some());
    rig.set_scene(&fitting.0);
    rig.set_maps(&fitting.1);
    let shown = rig.picture(&ahead());
    assert_eq!(rig.renderer.chain_refusal(), None, "this one fits");
    let mut whole = Rig::new(&fitting.0, &fitting.1).expect("there is a device");
    assert_eq!(shown.radiance, whole.picture(&ahead()).radiance);
}

/// 64 × 64 quads: 24576 corners of 32 bytes against 65536 bytes. Chains need all of a scene at a time.
#[test]
fn meshes_beyond_a_buffer_are_drawn_whole() {
    let limit = |limits: &mut wgpu::Limits| limits.max_buffer_size = 1 << 16;
    let small = or_skip!(own_gpu(limit));
    let sheet = |height: f64| {
        let mut mesh: Mesh = grid(64, 64, |s, t| dvec3(t, height, s));
        let uv = |place: &DVec3| dvec2(place.x, place.z);
        mesh.uv0 = Some(mesh.positions.iter().map(uv).collect());
        mesh
    };
    let pane = support::scenes::surface(SurfaceKind::ThinWall, 1.5);
    let mut scene = Scene::default();
    parts::add(&mut scene, "floor", sheet(0.0), diffuse(LinearSrgb::WHITE));
    parts::add(&mut scene, "pane", sheet(0.5), pane);
    let chart = parametrise(0, &sheet(0.0)).expect("it has area").chart(8, 8);
    let texels = (0..64).map(|index| [index as f32; 3]).collect();
    let lit = (scene, vec![map_of(Arc::new(chart), texels)]);
    let words = "holds at most 64 KiB, and 16384 triangles take more";
    assert_refused(&small, &lit, words, &from_above(48));
    let mut whole = Rig::new(&lit.0, &lit.1).expect("there is a device");
    let whole = whole.picture(&from_above(48));
    let is_lit = whole.radiance.iter().filter(|pixel| pixel[0] > 0.0);
    assert!(is_lit.count() > 48 * 48 * 9 / 10);
}

#[test]
fn windows_without_a_size_draw_nothing() {
    let gpu = or_skip!(gpu());
    let (scene, maps) = scene(2);
    let rig = || Rig::with_format(gpu, &scene, &maps, FORMAT, 4);
    let mut sized = rig();
    for [width, height] in [[0, 0], [0, 7], [7, 0], [1, 1], [0, 0], [5, 9]] {
        let view = with(ahead(), |it| (it.width, it.height) = (width, height));
        sized.drawn(&view);
        sized.refined(&view);
        gpu.wait().expect("no fault");
        if width == 0 || height == 0 {
            let refusal = sized.renderer.radiance(gpu, &view).expect_err("no texture");
            says(&refusal, "");
        }
    }
    assert!(bits(&sized.picture(&ahead())) == bits(&rig().picture(&ahead())));
}
