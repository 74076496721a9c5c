//! A builder for scenes. Metres, watts, y up; the receiver whose irradiance E is known is the object `floor`.

use crate::prelude::*;

pub use crate::scenes::{light, panel, spot, tinted};

/// Adds parts to a scene.
pub trait Build: Sized {
    /// Adds an object with a material of its own.
    #[must_use]
    fn with(self, name: &str, mesh: Mesh, material: Material) -> Self;
    /// Adds a light.
    #[must_use]
    fn lit(self, light: Light) -> Self;
    /// Replaces or changes the mesh of an object.
    #[must_use]
    fn reshaped(self, object: usize, change: impl FnOnce(&mut Mesh)) -> Self;

    /// Adds a point light of 1 W/sr.
    #[must_use]
    fn lamp(self, place: DVec3) -> Self {
        self.lit(parts::point_light("lamp", place, Flux(4.0 * PI)))
    }

    /// Adds a sun of 1 W/m² on a surface perpendicular to it.
    #[must_use]
    fn sun(self, direction: DVec3) -> Self {
        self.lit(parts::sun("sun", direction, Irradiance(1.0)))
    }

    #[must_use]
    fn mirror(self, mesh: Mesh) -> Self {
        self.with("mirror", mesh, parts::mirror())
    }

    /// Adds clear glass.
    #[must_use]
    fn glass(self, ior: f64, mesh: Mesh) -> Self {
        self.with("glass", mesh, parts::dielectric("glass", ior))
    }

    /// Adds a diffuse object.
    #[must_use]
    fn diffuse(self, name: &str, mesh: Mesh) -> Self {
        self.with(name, mesh, parts::matte(name, LinearSrgb::grey(0.5)))
    }
}

impl Build for Scene {
    fn with(mut self, name: &str, mesh: Mesh, material: Material) -> Self {
        parts::add(&mut self, name, mesh, material);
        self
    }

    fn lit(mut self, light: Light) -> Self {
        self.lights.push(light);
        self
    }

    fn reshaped(mut self, object: usize, change: impl FnOnce(&mut Mesh)) -> Self {
        change(self.objects[object].mesh_in_scene_mut());
        self
    }
}

/// A horizontal diffuse floor of |x|, |z| ≤ half.
pub fn floor(half_m: f64) -> Scene {
    parts::reference_scene(half_m)
}

/// A box of diffuse walls around the origin; the box is the object `floor`.
pub fn room(half_m: f64) -> Scene {
    floor(half_m).reshaped(0, |mesh| *mesh = shapes::cuboid(DVec3::splat(-half_m), DVec3::splat(half_m)))
}

/// A horizontal slab of |x|, |z| ≤ 3 m.
pub fn slab(low_m: f64, high_m: f64) -> Mesh {
    shapes::cuboid(dvec3(-3.0, low_m, -3.0), dvec3(3.0, high_m, 3.0))
}

/// A floor of 1 × 1 m below a glass slab that covers it.
pub fn under_slab(ior: f64) -> Scene {
    floor(0.5).glass(ior, slab(0.5, 0.7))
}

/// Slabs above each other, the first of glass and the others of an index, under a slanting sun.
pub fn slabs(borders: &[[f64; 2]], ior: f64) -> Scene {
    let scene = floor(0.5).sun(dvec3(0.1, -1.0, 0.05));
    let all = borders.iter().enumerate();
    all.fold(scene, |scene, (index, [low, high])| {
        scene.glass(if index == 0 { 1.5 } else { ior }, slab(*low, *high))
    })
}

/// An upright mirror beside the floor.
pub fn upright() -> Mesh {
    shapes::rectangle(dvec3(0.6, 0.75, 0.0), DVec3::Z, DVec3::Y * 0.75)
}

/// A floor of 1 × 1 m in front of an upright mirror, or a substitute for it, with a lamp between them.
pub fn before(mirror: Mesh) -> Scene {
    floor(0.5).mirror(mirror).lamp(dvec3(-0.1, 1.0, 0.05))
}

/// Mirror image of that lamp.
pub const MIRRORED_LAMP: DVec3 = dvec3(1.3, 1.0, 0.05);

/// A glass ball above a floor, below a lamp.
pub fn glass_ball(levels: u32) -> Scene {
    let ball = shapes::sphere(dvec3(0.0, 0.5, 0.0), 0.3, levels);
    floor(0.4).glass(1.5, ball).lamp(dvec3(0.1, 2.0, 0.05))
}

/// Settings that follow every branch down to a share of 1e-9.
pub fn thoroughly(settings: BakeSettings) -> BakeSettings {
    BakeSettings {
        branch_threshold: Some(1e-9),
        max_depth: Some(1000),
        ..settings
    }
}

/// Reproducible random numbers in [0, 1).
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    use rand_pcg::rand_core::{Rng, SeedableRng};
    let mut generator = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    move || (generator.next_u64() >> 11) as f64 * (-53_f64).exp2()
}
