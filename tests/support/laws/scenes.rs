//! Scenes in one expression. Metres, watts, y up; the receiver whose E is known is the object `floor`.

use std::f64::consts::PI;
use glam::DVec3;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, LightKind, LightSize, Material, Mesh, Scene};
use nephroid::settings::BakeSettings;
use nephroid::units::{Flux, Irradiance};

/// Parts of a scene, one after the other.
pub trait Build: Sized {
    /// With an object of a material of its own.
    #[must_use]
    fn with(self, name: &str, mesh: Mesh, material: Material) -> Self;
    /// With one light more.
    #[must_use]
    fn lit(self, light: Light) -> Self;
    /// With another mesh for an object.
    #[must_use]
    fn reshaped(self, object: usize, change: impl FnOnce(&mut Mesh)) -> Self;

    /// With a lamp of 1 W/sr.
    #[must_use]
    fn lamp(self, place: DVec3) -> Self {
        self.lit(parts::point_light("lamp", place, Flux(4.0 * PI)))
    }

    /// With a sun of 1 W/m² across its beam.
    #[must_use]
    fn sun(self, direction: DVec3) -> Self {
        self.lit(parts::sun("sun", direction, Irradiance(1.0)))
    }

    #[must_use]
    fn mirror(self, mesh: Mesh) -> Self {
        self.with("mirror", mesh, parts::mirror())
    }

    /// With clear glass of a refractive index.
    #[must_use]
    fn glass(self, ior: f64, mesh: Mesh) -> Self {
        self.with("glass", mesh, parts::dielectric("glass", ior))
    }

    /// With a diffuse surface of that name.
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

/// A white light of that kind, without a size.
pub fn light(kind: LightKind) -> Light {
    Light {
        name: "lamp".into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind,
        size: LightSize::None,
    }
}

/// A diffuse floor of |x|, |z| ≤ half.
pub fn floor(half_m: f64) -> Scene {
    parts::reference_scene(half_m)
}

/// A box of diffuse walls around the origin, called the floor.
pub fn room(half_m: f64) -> Scene {
    floor(half_m).reshaped(0, |mesh| *mesh = shapes::cuboid(DVec3::splat(-half_m), DVec3::splat(half_m)))
}

/// A horizontal slab that reaches 3 m to all sides.
pub fn slab(low_m: f64, high_m: f64) -> Mesh {
    shapes::cuboid(DVec3::new(-3.0, low_m, -3.0), DVec3::new(3.0, high_m, 3.0))
}

/// A floor of 1 × 1 m below a slab of glass that covers it.
pub fn under_slab(ior: f64) -> Scene {
    floor(0.5).glass(ior, slab(0.5, 0.7))
}

/// An upright mirror beside the floor.
pub fn upright() -> Mesh {
    shapes::rectangle(DVec3::new(0.6, 0.75, 0.0), DVec3::Z, DVec3::Y * 0.75)
}

/// A floor of 1 × 1 m before an upright mirror, or what stands for it, with a lamp between.
pub fn before(mirror: Mesh) -> Scene {
    floor(0.5).mirror(mirror).lamp(DVec3::new(-0.1, 1.0, 0.05))
}

/// Where that lamp is seen in the mirror.
pub const MIRRORED_LAMP: DVec3 = DVec3::new(1.3, 1.0, 0.05);

/// A glass ball over a floor, under a lamp.
pub fn glass_ball(levels: u32) -> Scene {
    let ball = shapes::sphere(DVec3::new(0.0, 0.5, 0.0), 0.3, levels);
    floor(0.4).glass(1.5, ball).lamp(DVec3::new(0.1, 2.0, 0.05))
}

/// Settings that follow every branch which carries a 1e-9th.
pub fn thoroughly(settings: BakeSettings) -> BakeSettings {
    BakeSettings {
        branch_threshold: Some(1e-9),
        max_depth: Some(1000),
        ..settings
    }
}

/// Numbers in [0, 1), the same at every run.
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    use rand_pcg::rand_core::{Rng, SeedableRng};
    let mut generator = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    move || (generator.next_u64() >> 11) as f64 * (-53_f64).exp2()
}
