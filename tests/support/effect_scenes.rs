//! A dozen small scenes, each calling for other effects.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use nephroid::effect::Effect;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::texture::Wrap;
use nephroid::scene::{Camera, LightSize, Material, Mesh, Scene, Texture, TextureRef, Volume, Wave, Waves};
use nephroid::settings::LayerKind;
use nephroid::units::Flux;
use serde_json::{Value, json};

use super::glb::Glb;

/// A scene and the effects of its light pass.
pub struct EffectScene {
    pub name: &'static str,
    pub scene: Scene,
    pub layers: Vec<LayerKind>,
    /// What the scene calls for; nothing else.
    #[allow(dead_code, reason = "the tests of bakes ask for it")]
    pub calls_for: &'static [Effect],
    /// Whether something specular is in view of the scene's first camera, hidden or not.
    #[allow(dead_code, reason = "the tests of the eye pass ask for it")]
    pub shows_specular: bool,
}

const MIRRORS: &[Effect] = &[Effect::LightPass, Effect::Reflection];
const ROUGH_MIRRORS: &[Effect] = &[Effect::LightPass, Effect::Reflection, Effect::Roughness];
const WAVY_MIRRORS: &[Effect] = &[Effect::LightPass, Effect::Reflection, Effect::Bumps];
const LARGE_LAMPS: &[Effect] = &[Effect::LightPass, Effect::Reflection, Effect::AreaLights];
const GLASS: &[Effect] = &[Effect::LightPass, Effect::Refraction, Effect::Reflection];
const DISPERSIVE_GLASS: &[Effect] = &[
    Effect::LightPass,
    Effect::Refraction,
    Effect::Reflection,
    Effect::Dispersion,
];
const COLOURED_GLASS: &[Effect] = &[
    Effect::LightPass,
    Effect::Refraction,
    Effect::Reflection,
    Effect::Absorption,
];
const EVERYTHING: &[Effect] = &[
    Effect::LightPass,
    Effect::Refraction,
    Effect::Reflection,
    Effect::Absorption,
    Effect::Textures,
    Effect::Direct,
];

/// All of them.
pub fn all() -> Vec<EffectScene> {
    let caustic = || vec![LayerKind::Caustic];
    let scene = |name, scene, calls_for, shows_specular| EffectScene {
        name,
        scene,
        layers: caustic(),
        calls_for,
        shows_specular,
    };
    let mut dark = room();
    add_mirror(&mut dark, parts::mirror());
    dark.lights.clear();
    let mut mirror = room();
    add_mirror(&mut mirror, parts::mirror());
    let mut glass = room();
    add_ball(&mut glass, parts::dielectric("glass", 1.5));
    let mut parting = room();
    add_ball(&mut parting, parts::glass("N-SF11"));
    let mut unlit = glass.clone();
    add_box(&mut unlit, "safe", BALL, 0.35);
    let mut coloured = room();
    add_ball(&mut coloured, coloured_glass());
    let mut rough = room();
    add_mirror(&mut rough, rough_metal());
    let mut glossy = room();
    add_mirror(
        &mut glossy,
        Material {
            roughness: 0.25,
            ..parts::mirror()
        },
    );
    let mut wavy = room();
    add_mirror(&mut wavy, wavy_mirror());
    let mut wide = mirror.clone();
    wide.lights[0].size = LightSize::Radius { radius_m: 0.2 };
    let mut turned_away = mirror.clone();
    turned_away.cameras = vec![camera(DVec3::new(0.0, 1.0, 3.0), DVec3::new(0.0, 1.0, 9.0))];
    let mut everything = room();
    add_mirror(&mut everything, textured_mirror());
    everything.textures = vec![Arc::new(stripes())];
    add_ball(&mut everything, coloured_glass());
    vec![
        scene("no light", dark, &[], true),
        scene("nothing specular", room(), &[], false),
        scene("mirror", mirror, MIRRORS, true),
        scene("glass", glass, GLASS, true),
        scene("dispersive glass", parting, DISPERSIVE_GLASS, true),
        scene("glass unlit", unlit, &[], true),
        scene("absorption", coloured, COLOURED_GLASS, true),
        scene(
            "normal map",
            from_file(json!({ "normalTexture": { "index": 0 } }), json!({})),
            GLASS,
            true,
        ),
        scene(
            "alpha mask",
            from_file(json!({}), json!({ "alphaMode": "MASK", "alphaCutoff": 0.5 })),
            GLASS,
            true,
        ),
        scene("rough metal", rough, &[], false),
        scene("rough mirror", glossy, ROUGH_MIRRORS, true),
        scene("wavy mirror", wavy, WAVY_MIRRORS, true),
        scene("lamp with a size", wide, LARGE_LAMPS, true),
        scene("camera turned away", turned_away, MIRRORS, false),
        EffectScene {
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..scene("everything", everything, EVERYTHING, true)
        },
    ]
}

const BALL: DVec3 = DVec3::new(0.35, 0.6, 0.0);

/// A floor under a lamp, seen from the side.
fn room() -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let lamp = parts::point_light("lamp", DVec3::new(0.2, 2.0, 0.1), Flux(10.0));
    scene.lights.push(lamp);
    scene.cameras = vec![camera(DVec3::new(0.0, 1.5, 3.0), DVec3::new(0.0, 0.5, 0.0))];
    scene
}

fn camera(from: DVec3, to: DVec3) -> Camera {
    Camera::look_at("camera", from, to, 0.9)
}

/// Upright, so that it lights the floor.
fn add_mirror(scene: &mut Scene, material: Material) {
    let mut mesh: Mesh = shapes::rectangle(DVec3::new(-0.6, 0.4, 0.0), DVec3::Y * 0.3, DVec3::Z * 0.3);
    mesh.uv0.get_or_insert_with(|| {
        let corner = |place: &DVec3| DVec2::new(place.z, place.y) * 2.0;
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
    Material {
        volume: Some(Volume {
            attenuation_distance_m: 0.3,
            attenuation_colour: LinearSrgb::new(0.9, 0.4, 0.2),
        }),
        ..parts::dielectric("coloured glass", 1.5)
    }
}

fn rough_metal() -> Material {
    let mut material = Material {
        roughness: 0.9,
        ..parts::mirror()
    };
    material.surface = material.classified();
    material
}

fn wavy_mirror() -> Material {
    let wave = Wave {
        amplitude_m: 0.002,
        wavelength_m: 0.2,
        direction: DVec3::Y,
        phase_rad: 0.5,
    };
    Material {
        waves: Waves::new(vec![wave]).ok(),
        ..parts::mirror()
    }
}

fn textured_mirror() -> Material {
    Material {
        base_colour_texture: Some(TextureRef {
            texture: 0,
            uv_set: 0,
            uv_transform: DMat3::IDENTITY,
        }),
        ..parts::mirror()
    }
}

/// Dark and bright columns.
fn stripes() -> Texture {
    let rgba = (0..64).map(|texel| [if texel % 2 == 0 { 40 } else { 220 }, 128, 128, 255]);
    Texture {
        name: "stripes".into(),
        width: 8,
        height: 8,
        rgba: rgba.collect(),
        wrap: [Wrap::Repeat; 2],
    }
}

/// A white pixel.
const PIXEL: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8/5+hHgAHggJ/PchI7wAA\
                     AABJRU5ErkJggg==";

/// A glass tetrahedron over a floor, with more fields for their materials, by way of a file.
fn from_file(of_glass: Value, of_floor: Value) -> Scene {
    let with = |mut material: Value, more: Value| {
        let fields = more.as_object().expect("an object").clone();
        material.as_object_mut().expect("an object").extend(fields);
        material
    };
    let glass = json!({
        "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1.0 },
            "KHR_materials_volume": { "thicknessFactor": 1.0 },
        },
    });
    let lamp = json!({ "type": "point", "intensity": 683.0 });
    let mut file = Glb::tetrahedron().with_material(with(glass, of_glass));
    file.push("images", json!({ "uri": PIXEL }));
    file.push("textures", json!({ "source": 0 }));
    let corners = [-4.0, -2.0, -4.0, -4.0, -2.0, 4.0, 4.0, -2.0, 4.0, 4.0, -2.0, -4.0];
    let positions = file.push_floats(&corners, 3);
    let indices = file.push_indices(&[0, 1, 2, 0, 2, 3]);
    let white = json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 } });
    let material = file.push("materials", with(white, of_floor));
    let attributes = json!({ "POSITION": positions });
    let mesh = file.push_mesh(json!({ "attributes": attributes, "indices": indices, "material": material }));
    file.push_root(json!({ "name": "floor", "mesh": mesh }));
    let mut file = file.with_light("lamp", lamp);
    let node = file.json["nodes"].as_array().expect("a list").len() - 1;
    file.json["nodes"][node]["translation"] = json!([0.3, 5.0, 0.2]);
    let mut scene = file.scene();
    scene.cameras = vec![camera(DVec3::new(0.0, 3.0, 9.0), DVec3::ZERO)];
    scene
}
