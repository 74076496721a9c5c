//! Flights over built-in scenes and over files made by others: from anywhere, no fault and no pixel that is no radiance.

use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use nephroid::eye_pass::renderer::{EyeQuality, Renderer};
use nephroid::eye_pass::{ToneMap, View};
use nephroid::gpu::Gpu;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{Camera, LoadOptions, Scene, SurfaceKind, builtin, load};
use nephroid::session::BakeSession;
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};

use crate::device::{self, gpu};
use crate::numbers::Numbers;
use crate::support::shared_or_skip;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const SIZE: [u32; 2] = [96, 64];
const PLACES: usize = 12;

/// Files of the collection, those with mirrors, polish, panes or glass.
const FILES: [&str; 5] = [
    "AttenuationTest",
    "DispersionTest",
    "LowPolyGlassTable",
    "SpecularTest",
    "SunglassesKhronos",
];

/// Maps of few splats: a moment whatever the glass.
fn quick_maps(scene: &Arc<Scene>) -> Vec<IlluminationMap> {
    let settings = BakeSettings {
        density_per_sr: 200.0,
        map_resolution: MapResolution::Fixed {
            width: 32,
            height: 32,
        },
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..BakeSettings::splat()
    };
    let mut session = BakeSession::new(scene.clone()).expect("these scenes are sound");
    session
        .bake(&settings, &(), &Default::default())
        .expect("it bakes")
        .maps
}

/// Around the scene, among its objects, and within what is specular.
fn cameras(scene: &Scene) -> Vec<Camera> {
    let (low, high) = scene.bounds().expect("it has objects");
    let mut numbers = Numbers::new(17);
    let mut within = |margin: f64| {
        let share = DVec3::new(numbers.next(), numbers.next(), numbers.next());
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low) * (1.0 + margin));
        centre + half * (share * 2.0 - 1.0)
    };
    let middles: Vec<DVec3> = scene
        .objects
        .iter()
        .filter(|object| scene.materials[object.material].surface != SurfaceKind::Diffuse)
        .filter_map(|object| object.mesh.bounds())
        .map(|(low, high)| 0.5 * (low + high))
        .collect();
    (0..PLACES)
        .map(|place| {
            let eye = match place {
                0 | 1 if !middles.is_empty() => middles[place * (middles.len() - 1)],
                0..6 => within(0.1),
                _ => within(1.0),
            };
            let target = match place {
                2 => eye + DVec3::Y,
                3 => eye - DVec3::Y,
                _ => within(0.0),
            };
            Camera::look_at("eye", eye, target, 0.3 + 0.15 * place as f64)
        })
        .collect()
}

/// A texture to draw into, as a window has.
fn target(gpu: &Gpu) -> wgpu::TextureView {
    let texture = device::target(gpu, SIZE, FORMAT);
    texture.create_view(&Default::default())
}

fn fly(gpu: &Gpu, scene: Scene) {
    let scene = Arc::new(scene);
    let maps = quick_maps(&scene);
    let mut renderer = Renderer::new(gpu, &scene, FORMAT, 4).expect("it is uploaded");
    renderer.set_quality(EyeQuality::WALKING);
    renderer.set_maps(gpu, &scene, &maps).expect("the maps fit");
    let target = target(gpu);
    let (mut lit, mut specular) = (0, 0);
    for (place, camera) in cameras(&scene).into_iter().enumerate() {
        let view = View {
            camera,
            width: SIZE[0],
            height: SIZE[1],
            exposure_stops: 0.0,
            tone_map: ToneMap::Neutral,
            background: LinearSrgb::new(0.02, 0.03, 0.05),
        };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer
            .draw(gpu, &mut encoder, &target, &view)
            .expect("it draws");
        gpu.queue.submit([encoder.finish()]);
        let picture = renderer.radiance(gpu, &view).expect("it renders");
        assert_eq!(gpu.take_error(), None, "{} from place {place}", scene.name);
        for (pixel, radiance) in picture.radiance.iter().enumerate() {
            // Light of few wavelengths is no colour of a display: a channel of it may be negative.
            let least = if scene.parts_wavelengths() { f32::MIN } else { 0.0 };
            let is_radiance = radiance
                .iter()
                .all(|channel| channel.is_finite() && *channel >= least);
            assert!(
                is_radiance,
                "{} from place {place}: {radiance:?} at {pixel}",
                scene.name
            );
            lit += usize::from(radiance[1] > 0.0);
        }
        specular += usize::from(renderer.counts().drawn_specular > 0);
    }
    assert_eq!(renderer.chain_refusal(), None, "{}", scene.name);
    let share = lit as f64 / (PLACES * (SIZE[0] * SIZE[1]) as usize) as f64;
    let _ = writeln!(
        std::io::stdout(),
        "{}: {specular} of {PLACES} places see something specular, {:.0} % of the pixels light",
        scene.name,
        100.0 * share
    );
    assert!(share > 0.2 && specular > 0, "{}: {share}, {specular}", scene.name);
}

#[test]
fn flights_over_built_in_scenes_show_radiance_everywhere() {
    let Some(gpu) = gpu() else { return };
    for name in builtin::NAMES {
        fly(&gpu, builtin::build(name).expect("listed"));
    }
}

#[test]
fn flights_over_files_made_by_others_show_radiance_everywhere() {
    let Some(gpu) = gpu() else { return };
    let Some(folder) = shared_or_skip("scenes") else {
        return;
    };
    let options = LoadOptions {
        default_light: true,
        ..Default::default()
    };
    for name in FILES {
        let file = Path::new(&folder).join(format!("{name}.glb"));
        let scene = load(file.to_str().expect("a readable path"), &options).expect("a valid file");
        fly(&gpu, scene);
    }
}
