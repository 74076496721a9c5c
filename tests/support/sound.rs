//! Validity of loaded scenes.

use nephroid::scene::Object;

use crate::prelude::*;

/// Whether a condition holds, and what is wrong if not.
type Promise = (bool, &'static str);

/// The first condition that a scene violates: every number is finite, every index valid, every normal and direction
/// unit.
pub fn scene_fault(scene: &Scene) -> Option<String> {
    let fault = |name: &str, promises: &[Promise]| {
        let broken = promises.iter().find(|(is_kept, _)| !is_kept);
        broken.map(|(_, what)| format!("{name} has {what}"))
    };
    let mut objects = scene.objects.iter();
    let mut materials = scene.materials.iter();
    let mut textures = scene.textures.iter();
    let mut lights = scene.lights.iter();
    let mut cameras = scene.cameras.iter();
    objects
        .find_map(|object| fault(&object.name, &of_object(scene, object)))
        .or_else(|| materials.find_map(|material| fault(&material.name, &of_material(scene, material))))
        .or_else(|| textures.find_map(|texture| fault(&texture.name, &of_texture(texture))))
        .or_else(|| lights.find_map(|light| fault(&light.name, &of_light(scene, light))))
        .or_else(|| cameras.find_map(|camera| fault(&camera.name, &of_camera(camera))))
}

fn of_object(scene: &Scene, object: &Object) -> [Promise; 7] {
    let mesh = object.mesh_in_scene();
    let count = mesh.positions.len();
    let has_uvs = |uvs: &Vec<glam::DVec2>| uvs.len() == count && uvs.iter().all(|uv| uv.is_finite());
    let is_there = |vertex: &u32| (*vertex as usize) < count;
    [
        (object.material < scene.materials.len(), "no material"),
        (!mesh.triangles.is_empty(), "no triangle"),
        (mesh.normals.len() == count, "not one normal per vertex"),
        (mesh.positions.iter().all(|p| p.is_finite()), "no numbers as positions"),
        (mesh.normals.iter().all(|n| is_unit(*n)), "a normal that is not unit"),
        (mesh.triangles.as_flattened().iter().all(is_there), "a vertex that is not there"),
        ([&mesh.uv0, &mesh.uv1].into_iter().flatten().all(has_uvs), "no numbers as coordinates, or not one per vertex"),
    ]
}

fn of_material(scene: &Scene, material: &Material) -> [Promise; 6] {
    let is_share = |value: f64| (0.0..=1.0).contains(&value);
    let [metallic, roughness] = [material.metallic, material.roughness];
    let mut colour = material.base_colour.to_array().into_iter();
    let volume = material.volume.as_ref();
    let texture = material.base_colour_texture.as_ref();
    let shares = [metallic, roughness, material.transmission];
    [
        (material.ior >= 1.0 && material.ior.is_finite(), "an index below 1"),
        (material.emitted_radiance.is_finite(), "a radiance that is no number"),
        (colour.all(is_share), "a colour outside 0 to 1"),
        (shares.into_iter().all(is_share), "a share outside 0 to 1"),
        (volume.is_none_or(|volume| volume.attenuation_distance_m > 0.0), "no attenuation distance"),
        (texture.is_none_or(|texture| texture.texture < scene.textures.len()), "a texture that is not there"),
    ]
}

fn of_texture(texture: &Texture) -> [Promise; 1] {
    let is_whole = texture.rgba.len() == texture.width as usize * texture.height as usize;
    [(is_whole, "another size than it says")]
}

fn of_light(scene: &Scene, light: &Light) -> [Promise; 4] {
    let direction = match light.kind {
        LightKind::Spot { direction, .. } | LightKind::Sun { direction, .. } => Some(direction),
        _ => None,
    };
    let place = light.kind.position();
    let object = match light.kind {
        LightKind::Surface { object, .. } => Some(object),
        _ => None,
    };
    [
        (light.strength().is_finite(), "a strength that is no number"),
        (place.is_none_or(|place| place.is_finite()), "a place that is none"),
        (direction.is_none_or(is_unit), "a direction that is not unit"),
        (object.is_none_or(|object| object < scene.objects.len()), "an object that is not there"),
    ]
}

fn of_camera(camera: &Camera) -> [Promise; 3] {
    let is_turned = is_unit(camera.forward) && is_unit(camera.up);
    let has_near = camera.near_m > 0.0 && camera.near_m.is_finite();
    [
        (camera.position.is_finite(), "a place that is none"),
        (is_turned, "a direction that is not unit"),
        (has_near, "no nearest distance"),
    ]
}

fn is_unit(vector: glam::DVec3) -> bool {
    (vector.length() - 1.0).abs() < 1e-12
}
