//! Flights over built-in scenes and over files made by others: from anywhere, no fault and no pixel that is no radiance.

use nephroid::eye_pass::ToneMap;
use nephroid::eye_pass::renderer::EyeQuality;

use crate::gpu::rig::{FORMAT, Rig, gpu, or_skip};
use support::laws::scenes::random;
use support::prelude::*;
use support::scenes::view_of;
use support::shared_or_skip;
use support::tools::{bake, builtin_scene, photons, set};

const PLACES: usize = 12;

/// Files of the collection, those with mirrors, coats, panes or glass.
const FILES: [&str; 5] = [
    "AttenuationTest",
    "DispersionTest",
    "LowPolyGlassTable",
    "SpecularTest",
    "SunglassesKhronos",
];

/// Around the scene, among its objects, and within what is specular.
fn cameras(scene: &Scene) -> Vec<Camera> {
    let (low, high) = scene.bounds().expect("it has objects");
    let mut next = random(17);
    let mut within = |margin: f64| {
        let share = dvec3(next(), next(), next());
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low) * (1.0 + margin));
        centre + half * (share * 2.0 - 1.0)
    };
    let is_specular = |object: &usize| scene.material_of(*object).surface != SurfaceKind::Diffuse;
    let specular = (0..scene.objects.len()).filter(is_specular);
    let bounds = specular.filter_map(|object| scene.objects[object].mesh_in_scene().bounds());
    let middles: Vec<DVec3> = bounds.map(|(low, high)| 0.5 * (low + high)).collect();
    let camera = |place: usize| {
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
    };
    (0..PLACES).map(camera).collect()
}

/// Share of the pixels that are lit, from a scene's own camera, and from others.
fn fly(scene: &Scene) -> Option<[f64; 2]> {
    let gpu = gpu()?;
    // Maps of few photons: a moment whatever the glass.
    let baking = set(photons(2e3, 32), |s| {
        s.layers = vec![LayerKind::Caustic, LayerKind::Direct]
    });
    let maps = bake(scene.clone(), &baking).maps;
    let mut rig = Rig::with_format(gpu, scene, &maps, FORMAT, 4);
    // Light of few wavelengths is no colour of a display: a channel of it may be negative.
    let least = if scene.parts_wavelengths() { f32::MIN } else { 0.0 };
    let is_radiance = |channel: &f32| channel.is_finite() && *channel >= least;
    let lit_share = |rig: &mut Rig, camera: &Camera, background, side: u32| {
        let view = View {
            tone_map: ToneMap::Neutral,
            background,
            ..view_of(camera.clone(), [48, 32])
        };
        rig.drawn(&view);
        let picture = rig.sampled(&view, side);
        assert!(
            picture.radiance.iter().flatten().all(is_radiance),
            "{}",
            scene.name
        );
        let lit = picture.radiance.iter().filter(|pixel| pixel[1] > 0.0).count();
        lit as f64 / picture.radiance.len() as f64
    };
    let own = match scene.cameras.first() {
        Some(camera) => {
            let sides = [1, 2].map(|side| lit_share(&mut rig, camera, LinearSrgb::BLACK, side));
            sides[0].min(sides[1])
        }
        None => 1.0,
    };
    rig.renderer.set_quality(EyeQuality::WALKING);
    let (mut sum, mut specular) = (0.0, 0);
    for camera in cameras(scene) {
        sum += lit_share(&mut rig, &camera, rgb(0.02, 0.03, 0.05), 1);
        specular += usize::from(rig.renderer.counts().drawn_specular > 0);
    }
    assert_eq!(rig.renderer.chain_refusal(), None, "{}", scene.name);
    let anywhere = sum / PLACES as f64;
    assert!(
        anywhere > 0.2 && specular > 0,
        "{}: {anywhere}, {specular}",
        scene.name
    );
    Some([own, anywhere])
}

#[test]
fn flights_over_built_in_scenes_show_radiance() {
    for name in builtin::NAMES {
        let [own, _] = or_skip!(fly(&builtin_scene(name)));
        // So few rays find no slit of a millimetre.
        assert!(own > 0.01 || name == "prism", "{name} {own}");
    }
}

#[test]
fn flights_over_files_of_others_show_radiance() {
    let folder = or_skip!(shared_or_skip("scenes"));
    let options = LoadOptions {
        default_light: true,
        ..Default::default()
    };
    for name in FILES {
        let file = folder.join(format!("{name}.glb"));
        let scene = Scene::load(file.to_str().expect("a readable path"), &options);
        fly(&scene.expect("a valid file"));
    }
}
