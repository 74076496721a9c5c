//! Pipelines, and what chains are traced through, exist only once a view has called for them.

use std::sync::Arc;

use glam::DVec3;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::eye_pass::reference::{self, ChainLimits, ReferenceSettings};
use nephroid::eye_pass::renderer::{MapStyle, Renderer, render_counted};
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::gpu::Gpu;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::plan;
use nephroid::scene::builtin::{self, parts, shapes};
use nephroid::scene::{Camera, Material, Scene, SurfaceKind};
use nephroid::transport::Tracer;

use crate::device::{self, gpu};
use crate::scenes::{diffuse, floor_map, floor_scene};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A lit floor; what is specular lies far out along +x, a matte box along −x.
fn hall() -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(LinearSrgb::new(0.8, 0.5, 0.2)));
    let mut add = |name: &str, centre: DVec3, material: Material| {
        parts::add(&mut scene, name, shapes::sphere(centre, 0.2, 3), material);
    };
    let polish = Material {
        surface: SurfaceKind::Mixed,
        base_colour: LinearSrgb::grey(0.5),
        emitted_radiance: LinearSrgb::new(0.1, 0.2, 0.3),
        ..Default::default()
    };
    let tinted = Material {
        base_colour: LinearSrgb::new(0.9, 0.5, 0.2),
        ..parts::dielectric("tinted", 1.5)
    };
    add(
        "box",
        DVec3::new(-4.0, 0.3, 0.5),
        parts::matte("box", LinearSrgb::WHITE),
    );
    add("mirror", DVec3::new(4.0, 0.3, 0.0), parts::mirror());
    add(
        "glass",
        DVec3::new(4.0, 0.3, 0.5),
        parts::dielectric("glass", 1.5),
    );
    add("tinted", DVec3::new(4.0, 0.3, 1.0), tinted);
    add("polish", DVec3::new(4.0, 0.8, 0.5), polish);
    (scene, vec![floor_map(0, 2, 2, vec![[1.0, 2.0, 3.0]; 4])])
}

/// From the floor's middle towards a point.
fn towards(target: DVec3) -> View {
    View {
        camera: Camera::look_at("eye", DVec3::new(0.5, 0.4, 0.5), target, 1.6),
        width: 48,
        height: 32,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::new(0.5, 0.6, 0.7),
    }
}

fn to_specular() -> View {
    towards(DVec3::new(4.0, 0.3, 0.5))
}

fn to_matte() -> View {
    towards(DVec3::new(-4.0, 0.3, 0.5))
}

fn renderer(gpu: &Gpu, scene: &Scene, maps: &[IlluminationMap]) -> Renderer {
    let mut renderer = Renderer::new(gpu, scene, FORMAT, 1).expect("the scene is uploaded");
    renderer.set_maps(gpu, scene, maps).expect("the maps fit");
    renderer
}

fn bits(picture: &Picture) -> Vec<u32> {
    let channels = picture.radiance.iter().flatten();
    channels.map(|channel| channel.to_bits()).collect()
}

#[test]
fn nothing_is_made_for_specular_surfaces_before_one_is_in_view() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = hall();
    let mut renderer = renderer(&gpu, &scene, &maps);
    assert_eq!(renderer.counts().pipelines, 0, "nothing was looked at yet");
    renderer.radiance(&gpu, &to_matte()).expect("it renders");
    let before = renderer.counts();
    assert_eq!(
        (before.pipelines, before.specular_pipelines, before.chain_bytes),
        (1, 0, 0)
    );
    assert_eq!((before.drawn_objects, before.drawn_specular), (2, 0));
    assert_eq!(before.map_bytes, 65 * 65 * 8, "a tile");

    renderer.radiance(&gpu, &to_specular()).expect("it renders");
    let turned = renderer.counts();
    // Depth, chains, and the picture of them: all kinds of surfaces share these.
    assert_eq!((turned.pipelines, turned.specular_pipelines), (4, 3));
    let triangles = scene.triangle_count() as u64;
    assert!(turned.chain_bytes >= 48 * triangles);
    assert_eq!(turned.traced_pixels, 48 * 32);
    assert_eq!((turned.drawn_objects, turned.drawn_specular), (5, 4));

    renderer.radiance(&gpu, &to_matte()).expect("it renders");
    let back = renderer.counts();
    assert_eq!(
        (back.pipelines, back.specular_pipelines),
        (4, 3),
        "what was made is kept"
    );
    assert_eq!((back.drawn_objects, back.drawn_specular), (2, 0));
}

#[test]
fn objects_of_one_kind_share_their_pipelines() {
    let Some(gpu) = gpu() else { return };
    let (mut scene, maps) = hall();
    for place in 0..5 {
        let centre = DVec3::new(4.0, 0.3, -2.0 + f64::from(place));
        let ball = shapes::sphere(centre, 0.1, 2);
        parts::add(&mut scene, "another", ball, parts::dielectric("glass", 1.3));
    }
    let mut renderer = renderer(&gpu, &scene, &maps);
    renderer.radiance(&gpu, &to_specular()).expect("it renders");
    assert_eq!(renderer.counts().specular_pipelines, 3);
}

#[test]
fn forced_on_all_is_made_at_once_and_the_picture_is_the_same() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = hall();
    let mut forced = renderer(&gpu, &scene, &maps);
    forced.set_chains(&gpu, EffectSwitch::On).expect("it is made");
    let at_once = forced.counts();
    let mut auto = renderer(&gpu, &scene, &maps);
    for view in [to_matte(), to_specular(), to_matte()] {
        let pictures = [&mut forced, &mut auto].map(|renderer| renderer.radiance(&gpu, &view));
        let [on, auto] = pictures.map(|picture| bits(&picture.expect("it renders")));
        assert!(on == auto);
    }
    let counts = auto.counts();
    assert_eq!(at_once.pipelines, counts.pipelines);
    assert_eq!(at_once.specular_pipelines, counts.specular_pipelines);
    assert_eq!(at_once.chain_bytes, counts.chain_bytes);
}

/// Pipelines, those of specular surfaces, and bytes that chains are traced through.
fn made(renderer: &Renderer) -> (u64, u64, u64) {
    let counts = renderer.counts();
    (counts.pipelines, counts.specular_pipelines, counts.chain_bytes)
}

#[test]
fn forced_on_in_a_matte_scene_makes_nothing_specular() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mut renderer = renderer(&gpu, &scene, &[]);
    renderer.set_chains(&gpu, EffectSwitch::On).expect("it is made");
    assert_eq!(made(&renderer), (1, 0, 0));
}

#[test]
fn switched_off_everything_is_given_up_and_what_is_left_is_the_surfaces_own_light() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = hall();
    let mut renderer = renderer(&gpu, &scene, &maps);
    let view = to_specular();
    let before = renderer.radiance(&gpu, &view).expect("it renders");
    renderer
        .set_chains(&gpu, EffectSwitch::Off)
        .expect("it is dropped");
    let dropped = renderer.counts();
    assert_eq!((dropped.specular_pipelines, dropped.chain_bytes), (0, 0));
    let off = renderer.radiance(&gpu, &view).expect("it renders");
    let counts = renderer.counts();
    assert_eq!(
        (
            counts.specular_pipelines,
            counts.chain_bytes,
            counts.drawn_specular
        ),
        (0, 0, 0)
    );
    assert_ne!(bits(&off), bits(&before));

    // The CPU's eye pass without chains is exact here, edges aside.
    let settings = ReferenceSettings {
        limits: ChainLimits {
            switch: EffectSwitch::Off,
            ..Default::default()
        },
        ..Default::default()
    };
    let tracer = Tracer::new(Arc::new(scene.clone()));
    let expected = reference::render(&tracer, &maps, &view, &settings, &(), &Default::default());
    let expected = expected.expect("nobody cancels");
    let differs = |(a, b): &(&[f32; 3], &[f32; 3])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 2e-3);
    let pixels = off.radiance.iter().zip(&expected.radiance);
    let wrong = pixels.filter(differs).count();
    assert!(wrong <= 5, "{wrong} pixels differ");
    let distinct: std::collections::BTreeSet<_> = bits(&off).chunks(3).map(<[u32]>::to_vec).collect();
    assert!(
        distinct.len() > 3,
        "floor, background, black mirror and polish are in view"
    );

    renderer
        .set_chains(&gpu, EffectSwitch::Auto)
        .expect("it is allowed");
    assert_eq!(
        renderer.counts().specular_pipelines,
        0,
        "nothing was looked at since"
    );
    let again = renderer.radiance(&gpu, &view).expect("it renders");
    assert!(bits(&again) == bits(&before));
}

#[test]
fn built_in_scenes_look_the_same_on_auto_and_on() {
    let Some(gpu) = gpu() else { return };
    for name in builtin::NAMES {
        let scene = builtin::build(name).expect("listed");
        let camera = scene.cameras[0].clone();
        for forward in [camera.forward, -camera.forward] {
            let view = View {
                camera: Camera {
                    forward,
                    ..camera.clone()
                },
                ..to_matte()
            };
            let switched = |switch| EffectSwitches::default().with(Effect::Chains, switch);
            let shown =
                |switch| render_counted(&gpu, &scene, &[], &view, 1, &switched(switch)).expect("it renders");
            let ((auto, counts), (on, _)) = (shown(EffectSwitch::Auto), shown(EffectSwitch::On));
            assert!(bits(&auto) == bits(&on), "{name}");
            let line = plan::chains(&scene, Some((&view.camera, 1.5)), EffectSwitch::Auto);
            assert_eq!(counts.drawn_specular > 0, line.on, "{name}: {}", line.reason);
            assert_eq!(counts.specular_pipelines > 0, line.on, "{name}: {}", line.reason);
        }
    }
}

#[test]
fn maps_as_they_are_call_for_nothing_specular() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = hall();
    let mut renderer = renderer(&gpu, &scene, &maps);
    renderer.set_map_style(MapStyle::AsItIs);
    renderer.radiance(&gpu, &to_specular()).expect("it renders");
    assert_eq!(made(&renderer), (1, 0, 0));
}

#[test]
fn new_maps_reach_what_mirrors_show_after_they_were_out_of_view() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = hall();
    let mut kept = renderer(&gpu, &scene, &maps);
    kept.radiance(&gpu, &to_specular()).expect("it renders");
    let brighter = vec![floor_map(0, 2, 2, vec![[9.0, 2.0, 3.0]; 4])];
    kept.set_maps(&gpu, &scene, &brighter).expect("the maps fit");
    kept.radiance(&gpu, &to_matte()).expect("it renders");
    let shown = kept.radiance(&gpu, &to_specular()).expect("it renders");
    let fresh = renderer(&gpu, &scene, &brighter).radiance(&gpu, &to_specular());
    assert!(bits(&shown) == bits(&fresh.expect("it renders")));
}

#[test]
fn maps_that_come_and_go_take_no_further_pipelines() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = hall();
    let mut renderer = renderer(&gpu, &scene, &[]);
    for maps in [&[][..], &maps, &[], &maps] {
        renderer.set_maps(&gpu, &scene, maps).expect("the maps fit");
        renderer.radiance(&gpu, &to_specular()).expect("it renders");
        assert_eq!(renderer.counts().specular_pipelines, 3, "{} maps", maps.len());
    }
}

#[test]
fn each_tone_map_in_use_has_a_pipeline_of_its_own() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = hall();
    let mut renderer = renderer(&gpu, &scene, &maps);
    let texture = device::target(&gpu, [48, 32], FORMAT);
    let target = texture.create_view(&Default::default());
    for (tone_map, pipelines) in [(ToneMap::None, 2), (ToneMap::Neutral, 3), (ToneMap::None, 3)] {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let view = View {
            tone_map,
            ..to_matte()
        };
        renderer
            .draw(&gpu, &mut encoder, &target, &view)
            .expect("it draws");
        gpu.queue.submit([encoder.finish()]);
        assert_eq!(renderer.counts().pipelines, pipelines, "{tone_map:?}");
    }
    gpu.wait().expect("no fault");
    renderer.collect_times(&gpu);
    let times = renderer.counts().gpu_ms;
    assert_eq!(times.is_some(), tells_time(&gpu));
    if let Some(times) = times {
        assert!(
            times.tone_mapping > 0.0 && times.tone_mapping.is_finite(),
            "{times:?}"
        );
    }
}

fn tells_time(gpu: &Gpu) -> bool {
    gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
}

#[test]
fn the_device_tells_how_long_it_took_where_it_can() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = hall();
    let mut renderer = renderer(&gpu, &scene, &maps);
    assert_eq!(renderer.counts().gpu_ms, None, "nothing was drawn");
    for (view, has_specular) in [(to_matte(), false), (to_specular(), true)] {
        renderer.radiance(&gpu, &view).expect("it renders");
        let times = renderer.counts().gpu_ms;
        assert_eq!(times.is_some(), tells_time(&gpu));
        let Some(times) = times else { continue };
        assert!(
            times.opaque >= 0.0 && times.opaque + times.specular > 0.0,
            "{times:?}"
        );
        assert!((times.opaque + times.specular).is_finite(), "{times:?}");
        assert!(has_specular || times.specular == 0.0, "{times:?}");
        assert_eq!(times.tone_mapping, 0.0, "radiance is read back as it is");
    }
}
