//! The pool as one quad whose normals come from an image.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use nephroid::scene::builtin::pool;
use nephroid::scene::texture::Wrap;
use nephroid::scene::{NormalMap, Scene, Texture, TextureRef, Wave, Waves};

/// Texels across and down.
const SIDE: u32 = 256;
/// Normals are stored so many times steeper, for more of their digits.
const STEEPER: f64 = 4.0;
/// Width of the water [m].
const WIDTH_M: f64 = 3.0;

/// Waves that fit the water, so that an image of them tiles.
pub fn fitting_waves() -> Waves {
    let wave = |direction: DVec3, wavelength_m, phase_rad| Wave {
        amplitude_m: 0.015,
        wavelength_m,
        direction,
        phase_rad,
    };
    Waves::new(vec![
        wave(DVec3::X, WIDTH_M / 4.0, 1.0),
        wave(DVec3::Z, WIDTH_M / 3.0, 2.0),
    ])
    .expect("gentle waves")
}

/// The pool with those waves as waves.
pub fn by_waves() -> Scene {
    let mut scene = pool::bumped(0.0);
    scene.materials[1].waves = Some(fitting_waves());
    scene.name = "by waves".into();
    scene
}

/// The same waves as an image of normals; `mirrored` has it, and its coordinates, the other way around.
pub fn by_image(mirrored: bool) -> Scene {
    let mut scene = by_waves();
    let waves = scene.materials[1].waves.take().expect("they are there");
    let flip = if mirrored { -1.0 } else { 1.0 };
    let mesh = scene.objects[1].mesh_in_scene_mut();
    let uv = |place: &DVec3| DVec2::new(flip * place.x, place.z) / WIDTH_M + 0.5;
    mesh.uv0 = Some(mesh.positions.iter().map(uv).collect());
    let texel = |index: u32| {
        let (u, v) = (f64::from(index % SIDE) + 0.5, f64::from(index / SIDE) + 0.5);
        let place = (DVec2::new(u, v) / f64::from(SIDE) - 0.5) * WIDTH_M;
        let slope = waves.gradient(DVec3::new(flip * place.x, 1.0, place.y)) * STEEPER;
        // +X along u, +Y against v.
        let normal = DVec3::new(-flip * slope.x, slope.z, 1.0).normalize();
        let [red, green, blue] = (normal * 127.5 + 127.5).to_array().map(|x| x.round() as u8);
        [red, green, blue, 255]
    };
    let texture = Texture {
        name: "normals".into(),
        width: SIDE,
        height: SIDE,
        rgba: (0..SIDE * SIDE).map(texel).collect(),
        wrap: [Wrap::Repeat; 2],
    };
    let image = TextureRef {
        texture: 0,
        uv_set: 0,
        uv_transform: DMat3::IDENTITY,
    };
    scene.materials[1].normal_map = Some(NormalMap::new(image, 1.0 / STEEPER, &texture));
    scene.textures = vec![Arc::new(texture)];
    scene.name = if mirrored { "by mirrored image" } else { "by image" }.into();
    scene
}
