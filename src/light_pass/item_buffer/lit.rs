//! Cells into which a light emits.

use glam::{DVec2, DVec3};

use super::CELLS_PER_SIDE;
use super::bits::CellBits;
use crate::light_pass::launch::Launch;

/// Cells of a face that the light's cone touches.
pub(super) fn lit_cells(launch: &Launch, face: usize) -> CellBits {
    let Some((axis, half_angle_rad)) = launch.emitter().kind.cone() else {
        return CellBits::filled(true);
    };
    let cone = Cone {
        launch,
        face,
        axis,
        half_angle_rad,
    };
    let mut lit = CellBits::filled(false);
    cone.fill(0, 0, CELLS_PER_SIDE, &mut lit);
    lit
}

struct Cone<'a> {
    launch: &'a Launch,
    face: usize,
    axis: DVec3,
    half_angle_rad: f64,
}

impl Cone<'_> {
    /// Sets the lit cells of a square block, subdivided until each part is fully lit, dark or a single cell.
    fn fill(&self, column: usize, row: usize, side: usize, lit: &mut CellBits) {
        let scale = 1.0 / CELLS_PER_SIDE as f64;
        let low = DVec2::new(column as f64, row as f64) * scale;
        let high = low + side as f64 * scale;
        if !self.launch.may_light_cell(self.face, low, high) {
            return;
        }
        if side == 1 || self.holds(low, high) {
            for row in row..row + side {
                (column..column + side).for_each(|column| lit.set(column, row));
            }
            return;
        }
        let half = side / 2;
        for (right, down) in [(0, 0), (half, 0), (0, half), (half, half)] {
            self.fill(column + right, row + down, half, lit);
        }
    }

    /// Whether all corners of a block lie in the cone, which is convex. Edges that bulge beyond it count as lit.
    fn holds(&self, low: DVec2, high: DVec2) -> bool {
        [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)]
            .into_iter()
            .all(|corner| {
                let direction = self.launch.ray(self.face, corner).direction;
                self.axis.angle_between(direction) <= self.half_angle_rad
            })
    }
}
