//! `pool`: the sun through a wavy water surface, displaced by its waves; `pool-bump` is one quad whose normals alone
//! have the waves. A basin of water for other scenes.

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
    scene.displace_by_waves();
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

/// Four walls around a bottom a little above the floor, and the water. Every face is an object of its own, since each
/// is plane and has its own map. The sheet of water ends inside the walls, so that no light leaks past it.
pub struct Basin<'a> {
    /// Centre on the floor [m].
    pub centre: DVec3,
    /// Inner half sides along x and z [m].
    pub half_m: [f64; 2],
    /// Wall thickness [m].
    pub wall_m: f64,
    /// Heights of the rim, of the bottom and of the water [m].
    pub rim_m: f64,
    pub bottom_m: f64,
    pub water_m: f64,
    pub waves: &'a [Ripple],
}

impl Basin<'_> {
    /// Adds the basin with the given material indices.
    pub fn add(&self, scene: &mut Scene, bottom: usize, walls: usize) {
        let Self { centre, wall_m, .. } = *self;
        let [half_x, half_z] = self.half_m;
        let floor = shapes::floor(
            [centre.x - half_x, centre.x + half_x],
            [centre.z - half_z, centre.z + half_z],
            self.bottom_m,
        );
        parts::add_with(scene, "basin bottom", floor, bottom);

        // Inner faces meet at the corners; outer faces and rims reach around them by the thickness of the walls.
        for (side, outward, half_inner, half_along) in [
            ("left", DVec3::NEG_X, half_x, half_z),
            ("right", DVec3::X, half_x, half_z),
            ("back", DVec3::NEG_Z, half_z, half_x),
            ("front", DVec3::Z, half_z, half_x),
        ] {
            let up = DVec3::Y * (0.5 * self.rim_m);
            let along = DVec3::Y.cross(outward);
            let outer = half_inner + wall_m;
            let at = |distance: f64| centre + outward * distance;
            let inside = shapes::rectangle(at(half_inner) + up, -along * half_along, up);
            let outside = shapes::rectangle(at(outer) + up, along * (half_along + wall_m), up);
            let rim = shapes::rectangle(
                at(0.5 * (half_inner + outer)) + 2.0 * up,
                along * (half_along + wall_m),
                -outward * (0.5 * wall_m),
            );
            for (part, mesh) in [("inside", inside), ("outside", outside), ("rim", rim)] {
                parts::add_with(scene, &format!("basin {side} {part}"), mesh, walls);
            }
        }

        // The water ends within the walls, where no light passes beside it.
        let half = self.half_m.map(|half| half + 0.5 * wall_m);
        let depth_m = self.water_m - self.bottom_m;
        let place = centre + DVec3::Y * self.water_m;
        add_rippled(scene, place, half, self.waves, depth_m);
    }
}
