//! What is seen in mirrors and through glass: as on the CPU, as FLIP sees it, and only where a view calls for it.

use nephroid::effect::EffectSwitch;
use nephroid::eye_pass::ToneMap;
use nephroid::eye_pass::reference::{EyeRays, first_hits};
use nephroid::eye_pass::renderer::EyeQuality;
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::plan;

use crate::gpu::rig::{AS_CPU, Rig, or_skip};
use support::effect_scenes::{all, by_image};
use support::flip::mean_flip;
use support::prelude::*;
use support::scenes::{bits, limited, seen, tinted, view_of, wave};
use support::tools::{bake, builtin_scene, photons, set, settings};

/// Largest mean FLIP between the device's picture and the CPU's of every chain.
const LARGEST_FLIP: f64 = 0.02;
/// Largest mean FLIP where both follow the same chains: what single precision and half floats leave. The rest is what
/// the device approximates: after four surfaces it follows only the stronger way on.
const LARGEST_SAME: f64 = 0.002;
/// Largest mean FLIP of a walk's picture: maps as coarse as they are seen, and both ways on at two surfaces only, while
/// most of a glass ball in a tank lies behind more of them.
const LARGEST_WALKING: f64 = 0.03;
/// Largest mean difference on diffuse surfaces, relative to the mean.
const LARGEST_DIFFUSE: f64 = 1.0 / 255.0;
const SIZE: [u32; 2] = [320, 213];

fn both_layers() -> Vec<LayerKind> {
    vec![LayerKind::Caustic, LayerKind::Direct]
}

/// The picture one pixel to the left.
fn slipped(picture: &Picture) -> Picture {
    let mut slipped = picture.clone();
    slipped.radiance.rotate_left(1);
    slipped
}

/// Mean difference of two pictures on some pixels, relative to the mean.
fn relative(a: &Picture, b: &Picture, pixels: &[usize]) -> f64 {
    let (mut off, mut sum) = (0.0, 0.0);
    for pixel in pixels {
        for (a, b) in a.radiance[*pixel].iter().zip(b.radiance[*pixel]) {
            off += f64::from((a - b).abs());
            sum += f64::from(b);
        }
    }
    off / sum
}

fn compare(scene: Scene) {
    if crate::gpu::rig::gpu().is_none() {
        return;
    }
    let baking = set(settings(8000.0, 256), |s| s.layers = both_layers());
    let maps = bake(scene.clone(), &baking).maps;
    let tracer = Tracer::new(Arc::new(scene.clone()));
    let view = view_of(scene.cameras[0].clone(), SIZE);
    let on_cpu = |depth: u32| {
        let settings = limited(|limits| limits.branching_depth = depth);
        seen(&tracer, &maps, &view, &settings).0
    };
    let (all_chains, same_chains) = (on_cpu(u32::MAX), on_cpu(AS_CPU.branching_depth));
    let mut rig = or_skip!(Rig::at(AS_CPU, &scene, &maps));
    let device = rig.picture(&view);
    assert_eq!(rig.renderer.chain_refusal(), None);
    rig.set_chains(EffectSwitch::Off);
    let bare = rig.picture(&view);
    rig.set_chains(EffectSwitch::Auto);
    rig.renderer.set_quality(EyeQuality::WALKING);
    let walking = rig.picture(&view);

    let stops = all_chains.auto_exposure_stops();
    let show = |picture: &Picture| display_rgba8(picture, stops, ToneMap::None);
    let flip = |a: &Picture, b: &Picture| mean_flip(&show(a), &show(b), SIZE[0] as usize);
    let (found, same) = (flip(&all_chains, &device), flip(&same_chains, &device));
    let name = &scene.name;
    assert!(
        found <= LARGEST_FLIP && same <= LARGEST_SAME,
        "{name}: {found} {same}"
    );
    let walked = flip(&all_chains, &walking);
    assert!(walked <= LARGEST_WALKING, "{name}: {walked}");
    // The comparison sees chains that are missing and a slip by one pixel.
    for wrong in [&bare, &slipped(&device)] {
        assert!(flip(&all_chains, wrong) > 4.0 * LARGEST_SAME);
    }
    // Where chains have no part, every digit of it.
    let is_diffuse = |object: usize| scene.material_of(object).surface == SurfaceKind::Diffuse;
    let hits = first_hits(&tracer, &view);
    let seen_directly = |pixel: &usize| hits[*pixel].is_some_and(is_diffuse);
    let diffuse: Vec<usize> = (0..hits.len()).filter(seen_directly).collect();
    assert!(diffuse.len() > 2000 || !["ring", "mirror"].contains(&scene.name.as_str()));
    if diffuse.len() > 2000 {
        let off = relative(&device, &same_chains, &diffuse);
        assert!(off < LARGEST_DIFFUSE, "{name}: {off}");
        assert!(relative(&slipped(&device), &same_chains, &diffuse) > LARGEST_DIFFUSE);
    }
}

#[test]
fn built_in_scenes_look_as_on_the_cpu() {
    for name in ["ring", "ball", "pool", "pool-bump", "mirror", "slab"] {
        let mut scene = builtin_scene(name);
        if name == "ball" {
            // From so high up that the floor, and the caustic on it, are seen through the ball.
            let (eye, target) = (dvec3(0.35, 2.2, 1.0), dvec3(0.0, 0.45, 0.0));
            scene.cameras = vec![Camera::look_at("above", eye, target, 0.7)];
        }
        compare(scene);
    }
}

/// A lamp, a red pillar and a mirror behind it.
fn hall(mirror: Material, pillar: [DVec3; 2]) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let plane = shapes::rectangle(dvec3(0.0, 0.5, -0.7), DVec3::X * 0.9, DVec3::Y * 0.48);
    parts::add(&mut scene, "mirror", plane, mirror);
    let red = parts::matte("red", rgb(0.7, 0.2, 0.1));
    parts::add(&mut scene, "pillar", shapes::cuboid(pillar[0], pillar[1]), red);
    let lamp = dvec3(-0.3, 1.8, 0.7);
    scene.lights.push(parts::point_light("light", lamp, Flux(100.0)));
    scene
}

/// A glass ball in a tank of greenish water, before a mirror: chains of ten surfaces and more.
#[test]
fn nested_glass_looks_as_on_the_cpu() {
    let pillar = [dvec3(0.6, 0.0, -0.1), dvec3(0.75, 0.7, 0.05)];
    let mut scene = hall(parts::mirror(), pillar);
    let water = parts::dielectric("water", 1.333);
    let water = tinted(water, 1.0, rgb(0.7, 0.95, 0.85));
    let tank = shapes::cuboid(dvec3(-0.55, 0.05, -0.3), dvec3(0.45, 0.6, 0.35));
    parts::add(&mut scene, "water", tank, water);
    let ball = shapes::sphere(dvec3(-0.1, 0.32, 0.0), 0.2, 5);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let (eye, target) = (dvec3(0.35, 0.95, 2.0), dvec3(0.0, 0.3, -0.1));
    scene.cameras = vec![Camera::look_at("camera", eye, target, 0.75)];
    compare(scene);
}

/// A wavy mirror and a matte pillar on a coated wavy floor.
#[test]
fn wavy_mirror_and_coat_look_as_on_the_cpu() {
    let waves = |direction: DVec3| {
        let of = |wavelength_m, direction| wave(0.03 * wavelength_m, wavelength_m, direction, 0.4);
        let across = direction.cross(DVec3::ONE);
        Waves::new(vec![of(0.3, direction), of(0.23, across)]).ok()
    };
    let wavy = Material {
        waves: waves(dvec3(1.0, 1.0, 0.0)),
        ..parts::mirror()
    };
    let mut scene = hall(wavy, [dvec3(0.2, 0.0, -0.1), dvec3(0.4, 0.7, 0.1)]);
    let floor = &mut scene.materials[0];
    (floor.surface, floor.roughness, floor.coat) = (SurfaceKind::Coated, 0.0, 0.6);
    floor.waves = waves(DVec3::X);
    compare(scene);
}

#[test]
fn normal_images_bend_chains_as_on_the_cpu() {
    let mut scene = by_image(false);
    // Polish as well, seen by itself.
    let normal_map = scene.materials[1].normal_map.clone();
    let floor = &mut scene.materials[0];
    (floor.surface, floor.roughness, floor.normal_map) = (SurfaceKind::Coated, 0.0, normal_map);
    let mesh = scene.objects[0].mesh_in_scene_mut();
    let uv = |place: &DVec3| dvec2(place.x, place.z);
    mesh.uv0 = Some(mesh.positions.iter().map(uv).collect());
    compare(scene);
}

const SWITCHES: [EffectSwitch; 3] = [EffectSwitch::Auto, EffectSwitch::On, EffectSwitch::Off];

#[test]
fn chains_only_where_something_specular_is_in_view() {
    let (mut hidden, mut dark) = (Vec::new(), Vec::new());
    for case in all() {
        let (name, scene) = (case.name, &case.scene);
        let baking = set(photons(3e4, 32), |s| s.layers = case.layers.clone());
        let maps = bake(scene.clone(), &baking).maps;
        let tracer = Tracer::new(Arc::new(scene.clone()));
        let view = View {
            background: rgb(0.5, 0.6, 0.7),
            ..view_of(scene.cameras[0].clone(), [96, 64])
        };
        // Nothing opaque hides it.
        let is_specular = |object: usize| scene.material_of(object).surface.is_specular();
        let mut hits = first_hits(&tracer, &view).into_iter().flatten();
        let (in_view, is_visible) = (case.shows_specular, hits.any(is_specular));
        assert!(in_view || !is_visible, "{name}");
        for (switch, expected) in SWITCHES.into_iter().zip([in_view, true, false]) {
            let line = plan::chains(scene, Some((&view.camera, 1.5)), switch);
            assert_eq!(line.on, expected, "{name}: {line:?}");
        }
        // On is auto to the bit; off is another picture where a chain is seen.
        let assert_right = |[auto, on, off]: [&Picture; 3]| {
            assert!(bits(auto) == bits(on), "{name}");
            assert_eq!(bits(auto) != bits(off), is_visible, "{name}");
        };
        let by_cpu = |switch| -> (Picture, EyeRays) {
            let settings = limited(|limits| (limits.switch, limits.branching_depth) = (switch, u32::MAX));
            seen(&tracer, &maps, &view, &settings)
        };
        let [(auto, took), (on, forced), (off, left)] = SWITCHES.map(by_cpu);
        assert_right([&auto, &on, &off]);
        assert_eq!((took.chain_rays > 0, took), (is_visible, forced), "{name}");
        assert_eq!((left.chain_rays, took.camera_rays), (0, 96 * 64), "{name}");
        let by_gpu = |switch| {
            let mut rig = Rig::new(scene, &maps)?;
            rig.set_chains(switch);
            let picture = rig.picture(&view);
            let made = rig.renderer.counts();
            Some((
                picture,
                [made.specular_pipelines, made.chain_bytes, made.drawn_specular],
            ))
        };
        let [Some((auto, took)), Some((on, _)), Some((off, left))] = SWITCHES.map(by_gpu) else {
            return;
        };
        assert_right([&auto, &on, &off]);
        assert!(
            took.iter().all(|count| (*count > 0) == in_view),
            "{name}: {took:?}"
        );
        assert_eq!(left, [0; 3], "{name}");
        hidden.extend((in_view && !is_visible).then_some(name));
        dark.extend((is_visible && maps.is_empty()).then_some(name));
    }
    assert_eq!((hidden, dark), (vec!["glass unlit"], vec!["no light"]));
}
