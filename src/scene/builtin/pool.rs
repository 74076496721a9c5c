//! `pool`: the sun through a wavy water surface, displaced by its waves; `pool-bump` is one quad whose normals alone
//! have the waves.

use std::sync::Arc;

use glam::DVec3;

use super::{parts, shapes};
use crate::scene::{Material, Mesh, Scene, Wave, Waves};
use crate::units::Irradiance;

/// Open sheet of still water, normals up: `quads` across and down over `half` [m] in x and z around `centre`.
fn still(centre: DVec3, half: [f64; 2], quads: [u32; 2]) -> Mesh {
    shapes::sheet(quads[0], quads[1], |u, v| {
        let x = centre.x + half[0] * (2.0 * u - 1.0);
        let z = centre.z + half[1] * (2.0 * v - 1.0);
        (DVec3::new(x, centre.y, z), DVec3::Y)
    })
}

/// Amplitude [m], wave vector along x and z [rad/m] and phase [rad] of a wave.
pub type Ripple = (f64, [f64; 2], f64);

/// Waves of these ripples on water of a depth [m]; `None` if they are invalid.
fn running(ripples: &[Ripple], depth_m: f64) -> Option<Waves> {
    let waves = ripples.iter();
    let waves =
        waves.map(|&(amplitude_m, vector, phase)| Wave::on_water(amplitude_m, vector, phase, depth_m));
    Waves::new(waves.collect()).ok()
}

fn rippled(waves: Option<Waves>) -> Material {
    Material {
        waves,
        ..parts::dielectric("water", 1.333)
    }
}

/// Adds a flat sheet of water whose waves perturb the normals but do not displace the surface.
pub fn add_rippled(scene: &mut Scene, centre: DVec3, half: [f64; 2], ripples: &[Ripple], depth_m: f64) {
    let material = rippled(running(ripples, depth_m));
    parts::add(scene, "water", still(centre, half, [1, 1]), material);
}

/// A sheet with the waves in its mesh: displaced vertices with the normals of the wavy surface.
pub fn meshed(centre: DVec3, half: [f64; 2], quads: [u32; 2], waves: &Waves) -> Mesh {
    let mut mesh = still(centre, half, quads);
    for (position, normal) in mesh.positions.iter_mut().zip(&mut mesh.normals) {
        *normal = (DVec3::Y - waves.gradient(*position)).normalize();
        *position += DVec3::Y * waves.height_m(*position);
    }
    mesh
}

/// Amplitude of each wave [m].
pub const AMPLITUDE_M: f64 = 0.02;

/// Half width of the water [m].
const HALF_M: f64 = 1.5;

/// Depth of the water [m].
const DEPTH_M: f64 = 1.0;

/// Quads across and down the sheet: flat ones deviate from the water surface by 0.2 mm at most.
const QUADS: u32 = 149;

fn waves(amplitude_m: f64) -> Option<Waves> {
    let ripples = [([9.0, 0.0], 1.0), ([0.0, 7.0], 2.0), ([6.0, 5.0], 0.0)];
    running(
        &ripples.map(|(vector, phase_rad)| (amplitude_m, vector, phase_rad)),
        DEPTH_M,
    )
}

/// A sheet of 3 m × 3 m, n = 1.333, 1 m above a floor of 2 m × 2 m; the sun shines with 1 W/m².
pub fn build() -> Scene {
    displaced(AMPLITUDE_M)
}

/// The pool with waves of the given amplitude [m] that displace its surface.
pub fn displaced(amplitude_m: f64) -> Scene {
    let flat = still(DVec3::Y * DEPTH_M, [HALF_M; 2], [QUADS; 2]);
    let mut scene = with_water(flat.clone(), rippled(waves(amplitude_m)));
    scene.swells.insert(scene.objects.len() - 1, Arc::new(flat));
    scene.lift();
    scene
}

/// The same waves on one flat quad, in its normals only.
pub fn bumped(amplitude_m: f64) -> Scene {
    let flat = still(DVec3::Y * DEPTH_M, [HALF_M; 2], [1, 1]);
    with_water(flat, rippled(waves(amplitude_m)))
}

/// The pool with the given water surface.
fn with_water(surface: Mesh, material: Material) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    parts::add(&mut scene, "water", surface, material);
    let sun = parts::sun("light", DVec3::new(0.3, -1.0, 0.2), Irradiance(1.0));
    scene.lights.push(sun);
    scene
}
