//! Where light went: cells of a coarse grid over the scene that rays or beams passed. What changes elsewhere changes none
//! of them.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;

use crate::geometry::Ray;

/// Cells along each axis: one word of bits.
const CELLS: usize = 32;

/// Places count for cells within this distance as well, since hits are found with rounding [cells].
const MARGIN: f64 = 1e-3;

/// The cells that rays of one light passed.
#[derive(Debug)]
pub struct TraversedCells {
    /// Of the scene's box [m].
    bounds: (DVec3, DVec3),
    cells_per_m: DVec3,
    /// A row of cells along x each.
    rows: Vec<AtomicU32>,
}

impl TraversedCells {
    /// None yet, of a scene in a box [m].
    pub fn within((low, high): (DVec3, DVec3)) -> Self {
        // What is flat has one layer of cells.
        let cells_per_m = (high - low).map(|size| if size > 0.0 { CELLS as f64 / size } else { 0.0 });
        Self {
            bounds: (low, high),
            cells_per_m,
            rows: (0..CELLS * CELLS).map(|_| AtomicU32::new(0)).collect(),
        }
    }

    /// A ray that looked for surfaces up to a distance [m].
    pub fn add_ray(&self, ray: &Ray, distance_m: f64) {
        let origin = self.in_cells(ray.origin);
        let direction = ray.direction * self.cells_per_m;
        // Nothing lies outside.
        let (mut enter_m, mut leave_m) = (0.0_f64, distance_m);
        for axis in 0..3 {
            let ends = [-MARGIN, CELLS as f64 + MARGIN].map(|end| end - origin[axis]);
            if direction[axis] != 0.0 {
                let [a, b] = ends.map(|end| end / direction[axis]);
                (enter_m, leave_m) = (enter_m.max(a.min(b)), leave_m.min(a.max(b)));
            } else if ends[0] > 0.0 || ends[1] < 0.0 {
                return;
            }
        }
        if enter_m > leave_m {
            return;
        }
        // A ray across a flat scene stays in one cell for ever.
        let leave_m = if leave_m.is_finite() { leave_m } else { enter_m };
        let [from, to] = [enter_m, leave_m].map(|along_m| origin + direction * along_m);
        // One part for each cell along the longest axis.
        let parts = (to - from).abs().max_element().ceil().max(1.0);
        for part in 0..parts as usize {
            let [from, to] = [part, part + 1].map(|end| from.lerp(to, end as f64 / parts));
            self.add_cells(from.min(to), from.max(to));
        }
    }

    /// Whether any of it may have come into a box [m]; nothing is known of what lies outside.
    pub fn meets(&self, (low, high): (DVec3, DVec3)) -> bool {
        if low.cmplt(self.bounds.0).any() || high.cmpgt(self.bounds.1).any() {
            return true;
        }
        let mut rows = self.rows_between(self.in_cells(low), self.in_cells(high));
        rows.any(|(row, bits)| row.load(Ordering::Relaxed) & bits != 0)
    }

    fn add_cells(&self, low: DVec3, high: DVec3) {
        for (row, bits) in self.rows_between(low, high) {
            // Most cells are known, and reading is cheaper.
            if row.load(Ordering::Relaxed) & bits != bits {
                row.fetch_or(bits, Ordering::Relaxed);
            }
        }
    }

    fn in_cells(&self, point: DVec3) -> DVec3 {
        (point - self.bounds.0) * self.cells_per_m
    }

    /// Rows that cells between two corners lie in, with the bits of those.
    fn rows_between(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = (&AtomicU32, u32)> {
        let last = (CELLS - 1) as f64;
        let cell = move |place: f64| place.clamp(0.0, last) as usize;
        let range = move |axis: usize| cell(low[axis] - MARGIN)..=cell(high[axis] + MARGIN);
        let (first, end) = range(0).into_inner();
        let bits = (u32::MAX << first) & (u32::MAX >> (CELLS - 1 - end));
        range(2).flat_map(move |z| range(1).map(move |y| (&self.rows[z * CELLS + y], bits)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: DVec3, direction: DVec3) -> Ray {
        Ray {
            origin,
            direction: direction.normalize(),
        }
    }

    fn around(point: DVec3) -> (DVec3, DVec3) {
        (point - 1e-4, point + 1e-4)
    }

    #[test]
    fn a_ray_passes_the_cells_on_its_way_and_no_others() {
        let (low, high) = (DVec3::new(-2.0, 0.0, -3.0), DVec3::new(2.0, 1.0, 5.0));
        let aside = DVec3::new(0.3, 0.3, 0.4);
        // Two distances at which each ray is inside.
        for (origin, direction, [near_m, far_m]) in [
            (DVec3::new(-1.9, 0.1, -2.0), DVec3::new(1.0, 0.2, 1.7), [0.4, 0.8]),
            (
                DVec3::new(0.3, 0.9, 4.0),
                DVec3::new(0.01, -1.0, -0.02),
                [0.4, 0.8],
            ),
            (DVec3::new(-9.0, 0.5, 1.0), DVec3::X, [8.0, 9.0]),
        ] {
            let ray = ray(origin, direction);
            let cells = TraversedCells::within((low, high));
            cells.add_ray(&ray, near_m);
            assert!(cells.meets(around(ray.at(near_m))));
            assert!(!cells.meets(around(ray.at(far_m))), "beyond its end");
            cells.add_ray(&ray, 8.5);
            for step in 0..=850 {
                let point = ray.at(0.01 * f64::from(step));
                let is_inside = point.cmpge(low).all() && point.cmple(high).all();
                assert!(!is_inside || cells.meets(around(point)), "{point}");
            }
            assert!(!cells.meets(around(ray.at(near_m) + aside)), "beside it");
        }
    }

    #[test]
    fn rays_that_miss_the_box_or_never_end_are_no_trouble() {
        let flat = (DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0));
        let cells = TraversedCells::within(flat);
        cells.add_ray(&ray(DVec3::new(0.5, 3.0, 3.0), DVec3::X), f64::INFINITY);
        assert!(!cells.meets(flat));
        cells.add_ray(&ray(DVec3::new(0.5, 3.0, 0.5), DVec3::NEG_Y), f64::INFINITY);
        let [hit, other] = [0.5, 0.1].map(|x| DVec3::new(x, 0.0, 0.5));
        assert!(cells.meets((hit, hit)) && !cells.meets((other, other)));
    }
}
