//! `pool`: the sun through a wavy water surface, as a mesh of its height and (`pool-bump`) as one quad whose normals
//! alone have the waves.

use glam::DVec3;

use super::{parts, shapes};
use crate::scene::{self, Material, Mesh, Scene, Waves};
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

impl Wave {
    /// A·cos(k·x + φ).
    pub const fn new(amplitude_m: f64, wave_vector: [f64; 2], phase_rad: f64) -> Self {
        Self {
            amplitude_m,
            wave_vector,
            phase_rad,
        }
    }
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

/// Amplitude of each wave [m].
pub const AMPLITUDE_M: f64 = 0.02;

/// Half width of the water [m].
const HALF_M: f64 = 1.5;

/// The waves of the pool, each of the given amplitude [m].
pub fn waves(amplitude_m: f64) -> [Wave; 3] {
    [([9.0, 0.0], 1.0), ([0.0, 7.0], 2.0), ([6.0, 5.0], 0.0)]
        .map(|(vector, phase_rad)| Wave::new(amplitude_m, vector, phase_rad))
}

/// A sheet of 3 m × 3 m, n = 1.333, 1 m above a floor of 2 m × 2 m; the sun shines with 1 W/m².
pub fn build() -> Scene {
    displaced(AMPLITUDE_M)
}

/// The pool with waves of the given amplitude [m] as a mesh of 512² quads.
pub fn displaced(amplitude_m: f64) -> Scene {
    let surface = water(DVec3::Y, [HALF_M; 2], [512, 512], &waves(amplitude_m));
    with_water(surface, parts::dielectric("water", 1.333))
}

/// The same waves on one flat quad, by its normals alone.
pub fn bumped(amplitude_m: f64) -> Scene {
    let surface = water(DVec3::Y, [HALF_M; 2], [1, 1], &[]);
    let material = Material {
        waves: as_bumps(&waves(amplitude_m)),
        ..parts::dielectric("water", 1.333)
    };
    with_water(surface, material)
}

/// Waves of a sheet as a material has them.
fn as_bumps(waves: &[Wave]) -> Option<Waves> {
    let bump = |wave: &Wave| {
        let [x, z] = wave.wave_vector;
        let vector = DVec3::new(x, 0.0, z);
        scene::Wave {
            amplitude_m: wave.amplitude_m,
            wavelength_m: std::f64::consts::TAU / vector.length(),
            direction: vector.normalize(),
            phase_rad: wave.phase_rad,
        }
    };
    Waves::new(waves.iter().map(bump).collect()).ok()
}

fn with_water(surface: Mesh, material: Material) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    parts::add(&mut scene, "water", surface, material);
    scene
        .lights
        .push(parts::sun("light", DVec3::new(0.3, -1.0, 0.2), Irradiance(1.0)));
    scene
}
