//! Parts that built-in scenes share.

use std::sync::Arc;

use glam::DVec3;

use crate::optics::spectrum::illuminants;
use crate::optics::{Glass, LinearSrgb};
use crate::scene::{Camera, Light, LightKind, Material, Mesh, Object, Scene, SurfaceKind, Volume};
use crate::units::{Flux, Irradiance, RadiantIntensity, SolidAngle};

/// Lambertian material of the given albedo.
pub fn matte(name: &str, albedo: LinearSrgb) -> Material {
    Material {
        name: name.into(),
        base_colour: albedo,
        ..Material::default()
    }
}

/// Perfect mirror.
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

/// Clear solid of a glass that [`Glass::parse`] knows.
///
/// # Panics
/// An unknown glass.
pub fn glass(text: &str) -> Material {
    let glass = Glass::parse(text).expect("a built-in scene names a glass");
    let mut material = dielectric(text, glass.dispersion.n_d());
    material.set_glass(Arc::new(glass));
    material
}

/// Gives a light the spectrum of D65.
pub fn daylight(mut light: Light) -> Light {
    light.set_spectrum(Arc::new(illuminants::d65().clone()));
    light
}

/// White point light that emits `power` uniformly.
pub fn point_light(name: &str, position: DVec3, power: Flux) -> Light {
    let sphere = SolidAngle(4.0 * std::f64::consts::PI);
    let intensity: RadiantIntensity = power / sphere;
    Light::new(name, LightKind::Point { position, intensity })
}

/// White parallel light along `direction`, of any length.
pub fn sun(name: &str, direction: DVec3, normal_irradiance: Irradiance) -> Light {
    Light::new(
        name,
        LightKind::Sun {
            direction: direction.normalize(),
            normal_irradiance,
        },
    )
}

/// White spot that emits `power` in total into a narrow cone, uniformly within three quarters of its half-angle [rad].
pub fn beam(name: &str, position: DVec3, direction: DVec3, half_angle_rad: f64, power: Flux) -> Light {
    let inner_cone_rad = 0.75 * half_angle_rad;
    let (cos_inner, cos_outer) = (inner_cone_rad.cos(), half_angle_rad.cos());
    // Solid-angle mean of the squared ramp at the edge: 1/3.
    let cone = SolidAngle(std::f64::consts::TAU * (1.0 - cos_inner + (cos_inner - cos_outer) / 3.0));
    Light::new(
        name,
        LightKind::Spot {
            position,
            direction: direction.normalize(),
            intensity: power / cone,
            inner_cone_rad,
            outer_cone_rad: half_angle_rad,
        },
    )
}

/// Adds a material to the scene and returns its index.
pub fn material(scene: &mut Scene, material: Material) -> usize {
    scene.materials.push(material);
    scene.materials.len() - 1
}

/// A camera at one point that looks at another [m], with its vertical field of view [rad].
pub fn look(name: &str, from: impl Into<DVec3>, to: impl Into<DVec3>, vertical_fov_rad: f64) -> Camera {
    Camera::look_at(name, from.into(), to.into(), vertical_fov_rad)
}

/// Adds four plates in one plane around a slit: half sides of the slit along two axes, and half side of the whole [m].
pub fn add_slit(
    scene: &mut Scene,
    (name, material): (&str, usize),
    centre: DVec3,
    [across, along]: [DVec3; 2],
    ([near, long], far): ([f64; 2], f64),
    plate: impl Fn(DVec3, DVec3, DVec3) -> Mesh,
) {
    let plates = [
        ([near, far], [-far, far]),
        ([-far, -near], [-far, far]),
        ([-near, near], [long, far]),
        ([-near, near], [-far, -long]),
    ];
    for (index, (u, v)) in plates.into_iter().enumerate() {
        let middle = centre + across * (0.5 * (u[0] + u[1])) + along * (0.5 * (v[0] + v[1]));
        let mesh = plate(
            middle,
            across * (0.5 * (u[1] - u[0])),
            along * (0.5 * (v[1] - v[0])),
        );
        add_with(scene, &format!("{name} {}", index + 1), mesh, material);
    }
}

/// Adds an object with a material of its own.
pub fn add(scene: &mut Scene, name: &str, mesh: Mesh, material: Material) {
    let material = self::material(scene, material);
    add_with(scene, name, mesh, material);
}

/// Adds an object with the material of an index.
pub fn add_with(scene: &mut Scene, name: &str, mesh: Mesh, material: usize) {
    let node = (scene.objects.len(), 0);
    scene.objects.push(Object::new(name, node, material, mesh));
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
