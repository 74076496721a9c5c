//! Writes a built-in scene as glTF: one node per object, light and camera.

pub(super) mod lights;
pub(super) mod materials;

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use gltf::json::Value;
use serde_json::json;

use super::glb::Glb;
use super::waves;
use crate::error::{Error, Result, Warning};
use crate::files;
use crate::scene::{Camera, Mesh, Object, Scene, Texture, texture::Wrap};

/// Document of a scene. Node `i` is object `i`, and the only primitive of its mesh is that of the object. Warns of
/// content that glTF cannot represent.
///
/// # Errors
/// A scene without surfaces; an image that cannot be written.
pub fn document(scene: &Scene) -> Result<(Glb, Vec<Warning>)> {
    if scene.objects.is_empty() {
        return Err(Error::failure(
            &scene.source,
            "has no surfaces to write",
            "name another scene",
        ));
    }
    let mut glb = Glb::empty();
    let mut warnings = Vec::new();
    for texture in &scene.textures {
        add_texture(texture, &mut glb)?;
    }
    let shift = scene.origin_world;
    for material in &scene.materials {
        let written = materials::written(material, shift, &mut warnings);
        glb.push("/materials", written);
    }
    for (index, object) in scene.objects.iter().enumerate() {
        add_object(object, scene.swells.get(&index), shift, &mut glb);
    }
    lights::add_all(scene, &mut glb, &mut warnings);
    for camera in &scene.cameras {
        add_camera(camera, shift, &mut glb);
    }
    Ok((glb, warnings))
}

fn add_texture(texture: &Texture, glb: &mut Glb) -> Result<()> {
    let rgba = texture.rgba.as_flattened().to_vec();
    let png = png(texture.width, texture.height, rgba, &texture.name)?;
    let image = glb.push_png(&texture.name, &png);
    let [across, down] = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::MirroredRepeat => 33648,
        Wrap::ClampToEdge => 33071,
    });
    let filter = if texture.is_nearest { 9728 } else { 9729 };
    let sampler = json!({ "magFilter": filter, "wrapS": across, "wrapT": down });
    let sampler = glb.push("/samplers", sampler);
    glb.push("/textures", json!({ "source": image, "sampler": sampler }));
    Ok(())
}

fn png(width: u32, height: u32, rgba: Vec<u8>, name: &str) -> Result<Vec<u8>> {
    files::png::<image::Rgba<u8>>(width, height, rgba).map_err(|why| {
        let what = format!("cannot be written as PNG ({why})");
        Error::failure(format!("image `{name}`"), what, "replace that image")
    })
}

/// `still`: the mesh of a surface that its waves lift, in the scene as built-in ones have it.
fn add_object(object: &Object, still: Option<&Arc<Mesh>>, shift: DVec3, glb: &mut Glb) {
    let Mesh {
        positions,
        normals,
        uv0,
        uv1,
        // Built-in scenes have none.
        colours: _,
        triangles,
    } = &**still.unwrap_or(object.mesh_in_scene());

    // Positions are written in world coordinates; normals are the same there as in the scene.
    let vectors = |list: &[DVec3], shift: DVec3| -> Vec<[f32; 3]> {
        let shifted = list.iter().map(|vector| (*vector + shift).as_vec3().to_array());
        shifted.collect()
    };
    let mut attributes = json!({
        "POSITION": glb.push_vectors(&vectors(positions, shift)),
        "NORMAL": glb.push_vectors(&vectors(normals, DVec3::ZERO)),
    });
    for (name, uvs) in [("TEXCOORD_0", uv0), ("TEXCOORD_1", uv1)] {
        if let Some(uvs) = uvs {
            let uvs: Vec<[f32; 2]> = uvs.iter().map(|uv| uv.as_vec2().to_array()).collect();
            attributes[name] = json!(glb.push_vectors(&uvs));
        }
    }

    // Nothing is shared: the numbers of node, mesh and object agree.
    let indices = glb.push_indices(triangles.iter().flatten().copied());
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": object.material });
    let mesh = glb.push("/meshes", json!({ "primitives": [primitive] }));
    let mut node = json!({ "name": object.name, "mesh": mesh });
    if still.is_some() {
        node["extras"] = json!({ waves::SWELLS_KEY: true });
    }
    glb.push_root(node);
}

fn add_camera(camera: &Camera, shift: DVec3, glb: &mut Glb) {
    let lens = json!({ "type": "perspective",
        "perspective": { "yfov": camera.vertical_fov_rad, "znear": camera.near_m } });
    let lens = glb.push("/cameras", lens);
    let right = camera.forward.cross(camera.up);
    let axes = DMat3::from_cols(right, camera.up, -camera.forward);
    let mut node = placed(&camera.name, camera.position + shift, DQuat::from_mat3(&axes));
    node["camera"] = json!(lens);
    glb.push_root(node);
}

/// A node with name, position [m] and rotation.
fn placed(name: &str, position: DVec3, rotation: DQuat) -> Value {
    json!({ "name": name, "translation": position.to_array(), "rotation": rotation.normalize().to_array() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, builtin};
    use std::path::Path;

    /// A file stores 32-bit floats.
    const SAME: f64 = 1e-6;

    #[test]
    fn built_in_scenes_come_back_from_their_files() {
        for name in builtin::NAMES {
            let scene = builtin::build(name).expect("it is built in");
            let (glb, warnings) = document(&scene).expect("it has surfaces");
            assert!(warnings.is_empty(), "{name}: {warnings:?}");
            let bytes = glb.into_bytes().expect("it is small");
            let read = super::super::read_scene(&bytes, Path::new("scene.glb"), &LoadOptions::default());
            let read = read.unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_same(name, &scene, &read);
        }
    }

    fn assert_same(name: &str, scene: &Scene, read: &Scene) {
        assert_eq!(scene.objects.len(), read.objects.len(), "{name}");
        for (wanted, found) in scene.objects.iter().zip(&read.objects) {
            assert_eq!(wanted.name, found.name);
            assert_eq!((wanted.node, wanted.primitive), (found.node, found.primitive));
            let area_m2 = wanted.mesh_in_scene().area_m2();
            assert!(
                (found.mesh_in_scene().area_m2() - area_m2).abs() < 1e-4 * area_m2,
                "{name}: {}",
                wanted.name
            );
            let (wanted, found) = (scene.material_of(wanted.node), read.material_of(found.node));
            assert_eq!(wanted.surface, found.surface, "{name}: {}", wanted.name);
            assert_eq!(wanted.glass, found.glass, "{name}: {}", wanted.name);
            assert_eq!(wanted.metal, found.metal);
            assert_eq!(wanted.waves.is_some(), found.waves.is_some());
            assert!((wanted.ior - found.ior).abs() < SAME);
            for (a, b) in wanted
                .base_colour
                .to_array()
                .into_iter()
                .zip(found.base_colour.to_array())
            {
                assert!((a - b).abs() < SAME, "{name}: {}", wanted.name);
            }
        }
        assert!(scene.swells.keys().eq(read.swells.keys()), "{name}");
        assert_eq!(scene.lights.len(), read.lights.len(), "{name}");
        for (wanted, found) in scene.lights.iter().zip(&read.lights) {
            assert_eq!(wanted.name, found.name);
            assert_eq!(
                wanted.spectrum.is_some(),
                found.spectrum.is_some(),
                "{name}: {}",
                wanted.name
            );
            let (a, b) = (wanted.kind.strength(), found.kind.strength());
            assert!((a - b).abs() < SAME * a, "{name}: {a}, {b}");
            if let (Some(a), Some(b)) = (wanted.kind.position(), found.kind.position()) {
                assert!(a.distance(b) < SAME * (1.0 + a.length()), "{name}: {a}, {b}");
            }
            for (a, b) in wanted
                .strength()
                .to_array()
                .into_iter()
                .zip(found.strength().to_array())
            {
                assert!(
                    (a - b).abs() < 1e-5 * (a.abs() + b.abs()) + 1e-9,
                    "{name}: {a}, {b}"
                );
            }
        }
        assert_eq!(scene.cameras.len(), read.cameras.len());
        for (wanted, found) in scene.cameras.iter().zip(&read.cameras) {
            assert!(wanted.forward.distance(found.forward) < SAME && wanted.up.distance(found.up) < SAME);
        }
    }
}
