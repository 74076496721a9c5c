//! What a loaded scene promises.

use nephroid::scene::{Camera, Light, LightKind, Material, Object, Scene};

/// The first promise of [`Scene`] that one breaks, if there is one: every number finite, every index valid, normals and
/// directions unit.
pub fn scene_fault(scene: &Scene) -> Option<String> {
    let objects = scene
        .objects
        .iter()
        .find_map(|object| object_fault(scene, object));
    let materials = || {
        scene
            .materials
            .iter()
            .find_map(|material| material_fault(scene, material))
    };
    let textures = || {
        let is_whole = |width: u32, height: u32, len: usize| len == width as usize * height as usize;
        let mut textures = scene.textures.iter();
        let bad = textures.find(|texture| !is_whole(texture.width, texture.height, texture.rgba.len()))?;
        Some(format!("texture {} has another size than it says", bad.name))
    };
    let lights = || scene.lights.iter().find_map(|light| light_fault(scene, light));
    let cameras = || scene.cameras.iter().find_map(camera_fault);
    objects
        .or_else(materials)
        .or_else(textures)
        .or_else(lights)
        .or_else(cameras)
}

fn object_fault(scene: &Scene, object: &Object) -> Option<String> {
    let mesh = &object.mesh;
    let count = mesh.positions.len();
    let has_uvs = |uvs: &Vec<glam::DVec2>| uvs.len() == count && uvs.iter().all(|uv| uv.is_finite());
    let promises = [
        (
            object.material < scene.materials.len(),
            "a material that is not there",
        ),
        (!mesh.triangles.is_empty(), "no triangle"),
        (mesh.normals.len() == count, "not one normal per vertex"),
        (
            mesh.positions.iter().all(|p| p.is_finite()),
            "a position that is no number",
        ),
        (
            mesh.normals.iter().all(|n| is_unit(*n)),
            "a normal that is not unit",
        ),
        (
            mesh.triangles.iter().flatten().all(|v| (*v as usize) < count),
            "a vertex that is not there",
        ),
        (
            [&mesh.uv0, &mesh.uv1].into_iter().flatten().all(has_uvs),
            "texture coordinates that are no numbers, or not one per vertex",
        ),
    ];
    broken(promises).map(|what| format!("{} has {what}", object.name))
}

fn material_fault(scene: &Scene, material: &Material) -> Option<String> {
    let is_share = |value: f64| (0.0..=1.0).contains(&value);
    let colour = material.base_colour.to_array();
    let volume = material.volume.as_ref();
    let texture = material.base_colour_texture.as_ref();
    let promises = [
        (
            material.ior >= 1.0 && material.ior.is_finite(),
            "an index below 1",
        ),
        (
            material.emitted_radiance.is_finite(),
            "a radiance that is no number",
        ),
        (colour.into_iter().all(is_share), "a colour outside 0 to 1"),
        (
            is_share(material.metallic) && is_share(material.roughness) && is_share(material.transmission),
            "a share outside 0 to 1",
        ),
        (
            volume.is_none_or(|volume| volume.attenuation_distance_m > 0.0),
            "an attenuation distance that is none",
        ),
        (
            texture.is_none_or(|texture| texture.texture < scene.textures.len()),
            "a texture that is not there",
        ),
    ];
    broken(promises).map(|what| format!("{} has {what}", material.name))
}

fn light_fault(scene: &Scene, light: &Light) -> Option<String> {
    let direction = match light.kind {
        LightKind::Spot { direction, .. } | LightKind::Sun { direction, .. } => Some(direction),
        _ => None,
    };
    let promises = [
        (light.strength().is_finite(), "a strength that is no number"),
        (
            light.kind.position().is_none_or(|place| place.is_finite()),
            "a place that is none",
        ),
        (direction.is_none_or(is_unit), "a direction that is not unit"),
        (
            !matches!(light.kind, LightKind::Surface { object, .. } if object >= scene.objects.len()),
            "an object that is not there",
        ),
    ];
    broken(promises).map(|what| format!("{} has {what}", light.name))
}

fn camera_fault(camera: &Camera) -> Option<String> {
    let promises = [
        (camera.position.is_finite(), "a place that is none"),
        (
            is_unit(camera.forward) && is_unit(camera.up),
            "a direction that is not unit",
        ),
        (
            camera.near_m > 0.0 && camera.near_m.is_finite(),
            "no nearest distance",
        ),
    ];
    broken(promises).map(|what| format!("{} has {what}", camera.name))
}

fn is_unit(vector: glam::DVec3) -> bool {
    (vector.length() - 1.0).abs() < 1e-12
}

fn broken<const N: usize>(promises: [(bool, &'static str); N]) -> Option<&'static str> {
    promises
        .into_iter()
        .find(|(is_kept, _)| !is_kept)
        .map(|(_, what)| what)
}
