//! `pool`: the sun through a wavy water surface.

use glam::DVec3;

use super::{parts, shapes};
use crate::scene::{Mesh, Scene};
use crate::units::Irradiance;

/// One wave: height A·cos(kx·x + kz·z + phase).
#[derive(Clone, Copy, Debug)]
pub struct Wave {
    /// A [m].
    pub amplitude_m: f64,
    /// kx, kz [rad/m].
    pub wave_vector: [f64; 2],
    /// [rad].
    pub phase_rad: f64,
}

/// Open water sheet, normals up: `quads` across and down over `half` [m] in x and z around `centre`.
pub fn water(centre: DVec3, half: [f64; 2], quads: [u32; 2], waves: &[Wave]) -> Mesh {
    shapes::sheet(quads[0], quads[1], |u, v| {
        let x = centre.x + half[0] * (2.0 * u - 1.0);
        let z = centre.z + half[1] * (2.0 * v - 1.0);
        let (mut height, mut slope_x, mut slope_z) = (centre.y, 0.0, 0.0);
        for wave in waves {
            let [kx, kz] = wave.wave_vector;
            let (sine, cosine) = (kx * x + kz * z + wave.phase_rad).sin_cos();
            height += wave.amplitude_m * cosine;
            slope_x -= wave.amplitude_m * kx * sine;
            slope_z -= wave.amplitude_m * kz * sine;
        }
        let normal = DVec3::new(-slope_x, 1.0, -slope_z).normalize();
        (DVec3::new(x, height, z), normal)
    })
}

/// A sheet of 3 m × 3 m, n = 1.333, 1 m above a floor of 2 m × 2 m; the sun shines with 1 W/m².
pub fn build() -> Scene {
    let wave = |kx, kz, phase_rad| Wave {
        amplitude_m: 0.02,
        wave_vector: [kx, kz],
        phase_rad,
    };
    let waves = [wave(9.0, 0.0, 1.0), wave(0.0, 7.0, 2.0), wave(6.0, 5.0, 0.0)];
    let mut scene = parts::reference_scene(1.0);
    let surface = water(DVec3::Y, [1.5, 1.5], [512, 512], &waves);
    parts::add(&mut scene, "water", surface, parts::dielectric("water", 1.333));
    scene
        .lights
        .push(parts::sun("light", DVec3::new(0.3, -1.0, 0.2), Irradiance(1.0)));
    scene
}
