//! Devices that are too small: what they cannot do is refused in a sentence, and the rest is drawn.

use glam::DVec3;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::eye_pass::renderer::{Renderer, render_counted};
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::gpu::Gpu;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Camera, Scene};

use crate::device::{self, gpu};
use crate::scenes::{diffuse, floor_map, floor_scene};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A lit floor with a mirror and a glass ball on it: 1282 triangles at 3 levels.
fn scene(levels: u32) -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mirror = shapes::rectangle(DVec3::new(0.5, 0.3, 0.0), DVec3::X * 0.4, DVec3::Y * 0.2);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    let ball = shapes::sphere(DVec3::new(0.5, 0.3, 0.5), 0.2, levels);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let texels = (0..16).map(|texel| [0.1 + 0.2 * texel as f32; 3]).collect();
    (scene, vec![floor_map(0, 4, 4, texels)])
}

fn view() -> View {
    View {
        camera: Camera::look_at("eye", DVec3::new(0.5, 0.8, 2.0), DVec3::new(0.5, 0.2, 0.3), 0.7),
        width: 48,
        height: 32,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::new(0.1, 0.2, 0.3),
    }
}

fn switched(chains: EffectSwitch) -> EffectSwitches {
    EffectSwitches::default().with(Effect::Chains, chains)
}

fn picture(gpu: &Gpu, (scene, maps): &(Scene, Vec<IlluminationMap>), chains: EffectSwitch) -> Picture {
    let (picture, _) = render_counted(gpu, scene, maps, &view(), 1, &switched(chains)).expect("it renders");
    assert_eq!(gpu.take_error(), None);
    picture
}

/// Fails unless a device refuses chains by a sentence with these words and draws what it draws without them.
fn assert_refused(small: &Gpu, lit: &(Scene, Vec<IlluminationMap>), words: &str) {
    let whole = gpu().expect("there is one");
    let mut renderer = Renderer::new(small, &lit.0, FORMAT, 1).expect("it is uploaded");
    renderer.set_maps(small, &lit.0, &lit.1).expect("the maps fit");
    assert_eq!(renderer.chain_refusal(), None, "nothing was asked of it yet");
    let shown = renderer.radiance(small, &view()).expect("it renders");
    assert_eq!(small.take_error(), None);
    let refusal = renderer.chain_refusal().expect("it is too small").to_string();
    assert!(refusal.contains(words) && !refusal.contains('\n'), "{refusal}");
    assert!(
        refusal.contains("they are drawn without what is seen in them"),
        "{refusal}"
    );
    assert_eq!(renderer.counts().chain_bytes, 0);
    let without = picture(&whole, lit, EffectSwitch::Off);
    assert_eq!(shown.radiance, without.radiance);
    let with = picture(&whole, lit, EffectSwitch::Auto);
    assert_ne!(shown.radiance, with.radiance, "chains would be seen");
    // Forced on it is the same, and no fault.
    renderer
        .set_chains(small, EffectSwitch::On)
        .expect("it is said by a refusal");
    let forced = renderer.radiance(small, &view()).expect("it renders");
    assert_eq!(forced.radiance, without.radiance);
    assert_eq!(small.take_error(), None);
}

#[test]
fn too_few_buffers_for_chains_leave_the_picture_without_them() {
    if gpu().is_none() {
        return;
    }
    for buffers in [2, 4, 6] {
        let small = Gpu::headless_within(|limits| wgpu::Limits {
            max_storage_buffers_per_shader_stage: buffers,
            ..limits
        });
        let words = format!("lets a shader read {buffers} buffers, and chains take");
        assert_refused(&small.expect("less is always granted"), &scene(3), &words);
    }
}

#[test]
fn a_scene_beyond_what_a_shader_reads_is_drawn_without_chains_and_a_smaller_one_with_them() {
    let Some(whole) = gpu() else { return };
    let small = Gpu::headless_within(|limits| wgpu::Limits {
        max_storage_buffer_binding_size: 1 << 18,
        ..limits
    })
    .expect("less is always granted");
    let large = scene(5);
    assert_refused(
        &small,
        &large,
        "reads 256 KiB at a time, and 20484 triangles take more",
    );
    let fitting = scene(3);
    let mut renderer = Renderer::new(&small, &large.0, FORMAT, 1).expect("it is uploaded");
    renderer.radiance(&small, &view()).expect("it renders");
    assert!(renderer.chain_refusal().is_some());
    renderer.set_scene(&small, &fitting.0).expect("it is uploaded");
    renderer
        .set_maps(&small, &fitting.0, &fitting.1)
        .expect("the maps fit");
    let shown = renderer.radiance(&small, &view()).expect("it renders");
    assert_eq!(renderer.chain_refusal(), None, "this one fits");
    let fresh = Renderer::new(&whole, &fitting.0, FORMAT, 1).and_then(|mut renderer| {
        renderer.set_maps(&whole, &fitting.0, &fitting.1)?;
        renderer.radiance(&whole, &view())
    });
    assert_eq!(shown.radiance, fresh.expect("it renders").radiance);
    assert_eq!(small.take_error(), None);
}

#[test]
fn a_device_whose_fragments_read_no_buffers_is_refused_in_one_sentence() {
    if gpu().is_none() {
        return;
    }
    for buffers in [0, 1] {
        let small = Gpu::headless_within(|limits| wgpu::Limits {
            max_storage_buffers_per_shader_stage: buffers,
            ..limits
        })
        .expect("less is always granted");
        let refusal = Renderer::new(&small, &scene(1).0, FORMAT, 1).expect_err("it takes two");
        let sentence = refusal.to_string();
        assert!(
            sentence.contains("storage buffers") && !sentence.contains('\n'),
            "{sentence}"
        );
        assert_eq!(small.take_error(), None);
    }
}

#[test]
fn windows_without_a_size_draw_nothing_and_what_comes_after_is_whole() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = scene(2);
    let mut renderer = Renderer::new(&gpu, &scene, FORMAT, 4).expect("it is uploaded");
    renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
    let texture = device::target(&gpu, [1, 1], FORMAT);
    let target = texture.create_view(&Default::default());
    for [width, height] in [[0, 0], [0, 7], [7, 0], [1, 1], [0, 0]] {
        let sized = View {
            width,
            height,
            ..view()
        };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer
            .draw(&gpu, &mut encoder, &target, &sized)
            .expect("it draws");
        renderer
            .refine(&gpu, &mut encoder, &target, &sized)
            .expect("it draws");
        gpu.queue.submit([encoder.finish()]);
        gpu.wait().expect("no fault");
        if width == 0 || height == 0 {
            let refusal = renderer
                .radiance(&gpu, &sized)
                .expect_err("no texture is like that");
            assert!(!refusal.to_string().contains('\n'), "{refusal}");
        }
    }
    let shown = renderer.radiance(&gpu, &view()).expect("it renders");
    let mut fresh = Renderer::new(&gpu, &scene, FORMAT, 4).expect("it is uploaded");
    fresh.set_maps(&gpu, &scene, &maps).expect("the maps fit");
    assert_eq!(
        shown.radiance,
        fresh.radiance(&gpu, &view()).expect("it renders").radiance
    );
    assert_eq!(gpu.take_error(), None);
}
