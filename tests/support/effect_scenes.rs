//! Small scenes that need different effects; and the pool as one quad with a normal map.

use nephroid::effect::Effect;
use nephroid::scene::builtin::pool;
use nephroid::scene::NormalMap;

use crate::prelude::*;
use crate::floors::{image, texture_reference};
use crate::scenes::{tinted, wave};

/// A scene and the effects that its light pass needs.
pub struct EffectScene {
    pub name: &'static str,
    pub scene: Scene,
    pub layers: Vec<LayerKind>,
    /// Exactly the effects that the scene needs.
    pub calls_for: Vec<Effect>,
    /// Whether something specular is in the view of the scene's first camera, occluded or not.
    pub shows_specular: bool,
}

pub fn all() -> Vec<EffectScene> {
    let mirrored = |material: Material| {
        let mut scene = room();
        add_mirror(&mut scene, material);
        scene
    };
    let with_ball = |material: Material| {
        let mut scene = room();
        add_ball(&mut scene, material);
        scene
    };
    let rough = |roughness: f64| Material {
        roughness,
        ..parts::mirror()
    };
    let mut matte = rough(0.9);
    matte.surface = matte.classified();
    let mut dark = mirrored(parts::mirror());
    dark.lights.clear();
    let mut unlit = with_ball(parts::dielectric("glass", 1.5));
    add_box(&mut unlit, "safe", BALL, 0.35);
    let mut wide = mirrored(parts::mirror());
    wide.lights[0].size = LightSize::Radius { radius_m: 0.2 };
    let mut turned_away = mirrored(parts::mirror());
    turned_away.cameras = vec![camera(dvec3(0.0, 1.0, 3.0), dvec3(0.0, 1.0, 9.0))];
    let mut everything = mirrored(textured_mirror());
    everything.textures = vec![Arc::new(stripes())];
    add_ball(&mut everything, coloured_glass());

    let mirrors = [Effect::LightPass, Effect::Reflection];
    let glass = [Effect::LightPass, Effect::Refraction, Effect::Reflection];
    let of = |name, scene, base: &[Effect], more: &[Effect], shows_specular| EffectScene {
        name,
        scene,
        layers: vec![LayerKind::Caustic],
        calls_for: [base, more].concat(),
        shows_specular,
    };
    let (absorption, textures, direct) = (Effect::Absorption, Effect::Textures, Effect::Direct);
    vec![
        of("no light", dark, &[], &[], true),
        of("nothing specular", room(), &[], &[], false),
        of("mirror", mirrored(parts::mirror()), &mirrors, &[], true),
        of(
            "glass",
            with_ball(parts::dielectric("glass", 1.5)),
            &glass,
            &[],
            true,
        ),
        of(
            "dispersive glass",
            with_ball(parts::glass("N-SF11")),
            &glass,
            &[Effect::Dispersion],
            true,
        ),
        of("glass unlit", unlit, &[], &[], true),
        of(
            "absorption",
            with_ball(coloured_glass()),
            &glass,
            &[absorption],
            true,
        ),
        of("rough metal", mirrored(matte), &[], &[], false),
        of(
            "rough mirror",
            mirrored(rough(0.25)),
            &mirrors,
            &[Effect::Roughness],
            true,
        ),
        of(
            "wavy mirror",
            mirrored(wavy_mirror()),
            &mirrors,
            &[Effect::Bumps],
            true,
        ),
        of("lamp with a size", wide, &mirrors, &[Effect::AreaLights], true),
        of("camera turned away", turned_away, &mirrors, &[], false),
        EffectScene {
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..of(
                "everything",
                everything,
                &glass,
                &[absorption, textures, direct],
                true,
            )
        },
    ]
}

const BALL: DVec3 = dvec3(0.35, 0.6, 0.0);

/// A floor under a lamp, seen from the side.
fn room() -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let lamp = parts::point_light("lamp", dvec3(0.2, 2.0, 0.1), Flux(10.0));
    scene.lights.push(lamp);
    scene.cameras = vec![camera(dvec3(0.0, 1.5, 3.0), dvec3(0.0, 0.5, 0.0))];
    scene
}

fn camera(from: DVec3, to: DVec3) -> Camera {
    Camera::look_at("camera", from, to, 0.9)
}

/// Upright, so that it reflects light to the floor.
fn add_mirror(scene: &mut Scene, material: Material) {
    let mut mesh: Mesh = shapes::rectangle(dvec3(-0.6, 0.4, 0.0), DVec3::Y * 0.3, DVec3::Z * 0.3);
    mesh.uv0.get_or_insert_with(|| {
        let corner = |place: &DVec3| dvec2(place.z, place.y) * 2.0;
        mesh.positions.iter().map(corner).collect()
    });
    parts::add(scene, "mirror", mesh, material);
}

fn add_ball(scene: &mut Scene, glass: Material) {
    parts::add(scene, "ball", shapes::sphere(BALL, 0.25, 3), glass);
}

fn add_box(scene: &mut Scene, name: &str, centre: DVec3, half: f64) {
    let mesh = shapes::cuboid(centre - half, centre + half);
    parts::add(scene, name, mesh, parts::matte(name, LinearSrgb::grey(0.5)));
}

fn coloured_glass() -> Material {
    let glass = parts::dielectric("coloured glass", 1.5);
    tinted(glass, 0.3, rgb(0.9, 0.4, 0.2))
}

fn wavy_mirror() -> Material {
    Material {
        waves: Waves::new(vec![wave(0.002, 0.2, DVec3::Y, 0.5)]).ok(),
        ..parts::mirror()
    }
}

fn textured_mirror() -> Material {
    Material {
        base_colour_texture: Some(texture_reference()),
        ..parts::mirror()
    }
}

/// Dark and bright columns.
fn stripes() -> Texture {
    let rgba = (0..64).map(|texel| [if texel % 2 == 0 { 40 } else { 220 }, 128, 128, 255]);
    image(8, rgba.collect(), Wrap::Repeat)
}

/// Width and height of the normal map [texels].
const SIDE: u32 = 256;
/// Factor by which stored normals are steeper, for better use of 8 bits.
const STEEPER: f64 = 4.0;
/// Width of the water [m].
const WIDTH_M: f64 = 3.0;

/// Waves that fit the width of the water, so that a normal map of them tiles.
pub fn fitting_waves() -> Waves {
    let of = |direction, wavelength_m, phase_rad| wave(0.015, wavelength_m, direction, phase_rad);
    let waves = vec![of(DVec3::X, WIDTH_M / 4.0, 1.0), of(DVec3::Z, WIDTH_M / 3.0, 2.0)];
    Waves::new(waves).expect("gentle waves")
}

/// The pool with these waves as analytic waves.
pub fn by_waves() -> Scene {
    let mut scene = pool::bumped(0.0);
    scene.materials[1].waves = Some(fitting_waves());
    scene.name = "by waves".into();
    scene
}

/// The pool with these waves as a normal map; `mirrored` flips the map and its texture coordinates.
pub fn by_image(mirrored: bool) -> Scene {
    let mut scene = by_waves();
    let waves = scene.materials[1].waves.take().expect("they are there");
    let flip = if mirrored { -1.0 } else { 1.0 };
    let mesh = scene.objects[1].mesh_in_scene_mut();
    let uv = |place: &DVec3| dvec2(flip * place.x, place.z) / WIDTH_M + 0.5;
    mesh.uv0 = Some(mesh.positions.iter().map(uv).collect());
    let texel = |index: u32| {
        let (u, v) = (f64::from(index % SIDE) + 0.5, f64::from(index / SIDE) + 0.5);
        let place = (dvec2(u, v) / f64::from(SIDE) - 0.5) * WIDTH_M;
        let slope = waves.gradient(dvec3(flip * place.x, 1.0, place.y)) * STEEPER;
        // +X along u, +Y against v.
        let normal = dvec3(-flip * slope.x, slope.z, 1.0).normalize();
        let [red, green, blue] = (normal * 127.5 + 127.5).to_array().map(|x| x.round() as u8);
        [red, green, blue, 255]
    };
    let texture = image(SIDE, (0..SIDE * SIDE).map(texel).collect(), Wrap::Repeat);
    scene.materials[1].normal_map = NormalMap::new(texture_reference(), 1.0 / STEEPER, &texture);
    scene.textures = vec![Arc::new(texture)];
    scene.name = if mirrored { "by mirrored image" } else { "by image" }.into();
    scene
}
