//! What the built-in scenes have in common.

use glam::DVec3;

use crate::optics::LinearSrgb;
use crate::scene::{Camera, Light, LightKind, Material, Mesh, Object, Scene, SurfaceKind, Volume};
use crate::units::{Flux, Irradiance, RadiantIntensity, SolidAngle};

/// Lambert of the given albedo.
pub fn matte(name: &str, albedo: LinearSrgb) -> Material {
    Material {
        name: name.into(),
        base_colour: albedo,
        ..Material::default()
    }
}

/// Mirror that reflects everything.
pub fn mirror() -> Material {
    Material {
        name: "mirror".into(),
        surface: SurfaceKind::Mirror,
        base_colour: LinearSrgb::WHITE,
        metallic: 1.0,
        roughness: 0.0,
        ..Material::default()
    }
}

/// Clear dielectric solid of the given refractive index.
pub fn dielectric(name: &str, ior: f64) -> Material {
    Material {
        name: name.into(),
        surface: SurfaceKind::Dielectric,
        base_colour: LinearSrgb::WHITE,
        roughness: 0.0,
        transmission: 1.0,
        ior,
        volume: Some(Volume {
            attenuation_distance_m: f64::INFINITY,
            attenuation_colour: LinearSrgb::WHITE,
        }),
        double_sided: false,
        ..Material::default()
    }
}

/// White light that sends `power` evenly into all directions.
pub fn point_light(name: &str, position: DVec3, power: Flux) -> Light {
    let sphere = SolidAngle(4.0 * std::f64::consts::PI);
    let intensity: RadiantIntensity = power / sphere;
    Light {
        name: name.into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind: LightKind::Point { position, intensity },
        size: crate::scene::LightSize::None,
    }
}

/// White parallel light along `direction` (of any length).
pub fn sun(name: &str, direction: DVec3, normal_irradiance: Irradiance) -> Light {
    Light {
        name: name.into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind: LightKind::Sun {
            direction: direction.normalize(),
            normal_irradiance,
        },
        size: crate::scene::LightSize::None,
    }
}

/// Adds an object with a material of its own.
pub fn add(scene: &mut Scene, name: &str, mesh: Mesh, material: Material) {
    scene.materials.push(material);
    let material = scene.materials.len() - 1;
    add_with(scene, name, mesh, material);
}

/// Adds an object that shares the material of that index.
pub fn add_with(scene: &mut Scene, name: &str, mesh: Mesh, material: usize) {
    scene.objects.push(Object {
        name: name.into(),
        node: scene.objects.len(),
        primitive: 0,
        material,
        mesh: mesh.into(),
    });
}

/// A scene of the reference set: a square grey `floor` of the given half width [m] around the origin at y = 0, and a
/// camera that sees all of it.
pub fn reference_scene(half_m: f64) -> Scene {
    let mut scene = Scene::default();
    let extent = [-half_m, half_m];
    let floor = super::shapes::floor(extent, extent, 0.0);
    add(&mut scene, "floor", floor, matte("floor", LinearSrgb::grey(0.5)));
    scene.cameras.push(Camera::look_at(
        "camera",
        DVec3::new(0.5, 2.0, 2.3) * half_m,
        DVec3::new(0.0, 0.2, 0.0) * half_m,
        0.9,
    ));
    scene
}
