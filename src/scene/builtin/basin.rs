//! A basin of water on a floor, shared by several scenes.

use glam::DVec3;

use super::pool::{self, Ripple};
use super::{parts, shapes};
use crate::scene::Scene;

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
        let half = self.half_m.map(|half| half + 0.5 * wall_m);
        let depth_m = self.water_m - self.bottom_m;
        let place = centre + DVec3::Y * self.water_m;
        pool::add_rippled(scene, place, half, self.waves, depth_m);
    }
}
