//! Scenes simple enough that every pixel is known.

use nephroid::illumination::{Chart, Receiver, UvSet};
use nephroid::scene::{Object, TextureRef};

use crate::prelude::*;
use crate::scenes::{chart_of, map_of, view_of};

/// Corners of the unit floor, both as (x, z) and as (u, v).
const CORNERS: [DVec2; 4] = [
    dvec2(0.0, 0.0),
    dvec2(1.0, 0.0),
    dvec2(1.0, 1.0),
    dvec2(0.0, 1.0),
];
const TRIANGLES: [[u32; 3]; 2] = [[0, 2, 1], [0, 3, 2]];

/// A floor over x, z in [0, 1] at the given height, facing up, with uv = (x, z).
pub fn floor(name: &str, material: usize, height_m: f64) -> Object {
    let mesh = Mesh {
        positions: CORNERS
            .map(|corner| dvec3(corner.x, height_m, corner.y))
            .to_vec(),
        normals: vec![DVec3::Y; 4],
        uv0: Some(CORNERS.to_vec()),
        uv1: None,
        colours: None,
        triangles: TRIANGLES.to_vec(),
    };
    Object::new(name, (0, 0), material, mesh)
}

/// One floor of the given material.
pub fn floor_scene(material: Material) -> Scene {
    Scene {
        name: "floor".into(),
        objects: vec![floor("floor", 0, 0.0)],
        materials: vec![material],
        ..Default::default()
    }
}

/// A map of a floor, with uv = (x, z).
pub fn floor_map(object: usize, width: usize, height: usize, irradiance: Vec<[f32; 3]>) -> IlluminationMap {
    let corner_uvs = TRIANGLES.map(|triangle| triangle.map(|corner| CORNERS[corner as usize]));
    let areas_m2 = vec![1.0 / (width * height) as f64];
    let chart = Chart {
        receiver: Receiver::front(object),
        uv_set: UvSet::TexCoord0,
        ..chart_of(corner_uvs.to_vec(), (width, height), areas_m2)
    };
    map_of(chart, irradiance)
}

/// The unit floor seen from above, filling a square picture exactly: pixel (i, j) sees x = (i + ½)/size and z = (j +
/// ½)/size.
pub fn from_above(size: u32) -> View {
    let camera = Camera {
        name: "above".into(),
        position: dvec3(0.5, 1.0, 0.5),
        forward: DVec3::NEG_Y,
        up: DVec3::NEG_Z,
        vertical_fov_rad: 2.0 * 0.5_f64.atan(),
        near_m: 0.01,
    };
    view_of(camera, [size; 2])
}

/// A Lambertian surface with an albedo.
pub fn diffuse(albedo: LinearSrgb) -> Material {
    Material {
        base_colour: albedo,
        ..Default::default()
    }
}

/// A texture of rows of `width` texels.
pub fn image(width: u32, rgba: Vec<[u8; 4]>, wrap: Wrap) -> Texture {
    Texture {
        name: "image".into(),
        width,
        height: rgba.len() as u32 / width,
        rgba,
        wrap: [wrap; 2],
        is_nearest: false,
    }
}

/// A texture of 2×2 texels of different colours, u to the right and v down.
pub fn four_colours() -> Texture {
    let colours = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 255]];
    image(2, colours.to_vec(), Wrap::ClampToEdge)
}

/// Texture 0 with TEXCOORD_0.
pub fn texture_reference() -> TextureRef {
    TextureRef {
        texture: 0,
        uv_set: 0,
        uv_transform: DMat3::IDENTITY,
    }
}

/// Radiance of a Lambertian surface [W/(m² sr)].
pub fn lambert(albedo: f64, irradiance_w_m2: f64) -> f64 {
    albedo * irradiance_w_m2 / PI
}
