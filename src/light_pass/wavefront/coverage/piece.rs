//! Parts of a triangle's sides within one row, and the areas to their right.

use super::shape::{least, most};

/// Part of a side within a row.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Smallest x.
    pub low: f64,
    /// Largest x.
    pub high: f64,
    /// Height; negative where the area to its right counts as taken away.
    pub height: f64,
}

impl Piece {
    /// From x = `a` to x = `b` or back.
    pub fn new(a: f64, b: f64, height: f64) -> Self {
        Self {
            low: least(a, b),
            high: most(a, b),
            height,
        }
    }

    /// Adds the areas to its right up to `first`, `first` + 1, `first` + 2 and so on.
    #[inline(always)]
    pub fn add_areas<const N: usize>(&self, first: f64, areas: &mut [f64; N]) {
        let run = self.high - self.low;
        // Without a run there is no area along it: anything finite will do as a factor.
        let per_square = 0.5 * self.height / most(run, f64::MIN_POSITIVE);
        let first = first - self.low;
        for (column, area) in areas.iter_mut().enumerate() {
            let x = first + column as f64;
            let within = most(0.0, least(run, x));
            *area += per_square * (within * within) + self.height * most(0.0, x - run);
        }
    }

    /// Adds, for each column from x = 0 on, by how much more of it lies to the right of the piece than of the column
    /// before. There must be one more column than there are texels: what changes on the last border changes there.
    pub fn add_changes(&self, changes: &mut [f64]) {
        if let Some(inside) = self.clipped((changes.len() - 2) as f64, changes) {
            inside.add_changes_inside(changes);
        }
    }

    /// The part with x from 0 to `width`; what lies further left moves to 0.
    fn clipped(&self, width: f64, changes: &mut [f64]) -> Option<Self> {
        let Self { low, high, height } = *self;
        if low >= 0.0 && high <= width {
            return Some(*self);
        }
        if high <= 0.0 {
            changes[0] += height;
            return None;
        }
        if low >= width {
            return None;
        }
        let per_x = height / (high - low);
        if low < 0.0 {
            changes[0] -= low * per_x;
        }
        let (low, high) = (most(low, 0.0), least(high, width));
        Some(Self {
            low,
            high,
            height: (high - low) * per_x,
        })
    }

    fn add_changes_inside(&self, changes: &mut [f64]) {
        let Self { low, high, height } = *self;
        let (first, last) = (low as i32 as usize, high as i32 as usize);
        if first == last {
            let covered = height * ((first + 1) as f64 - 0.5 * (low + high));
            changes[first] += covered;
            changes[first + 1] += height - covered;
            return;
        }
        let per_square = 0.5 * height / (high - low);
        let (mut area, mut covered) = (0.0, 0.0);
        for (column, change) in changes[first..last].iter_mut().enumerate() {
            let reach = (first + column + 1) as f64 - low;
            let area_here = per_square * reach * reach;
            let covered_here = area_here - area;
            *change += covered_here - covered;
            (area, covered) = (area_here, covered_here);
        }
        let covered_last = height * ((last + 1) as f64 - 0.5 * (low + high)) - area;
        changes[last] += covered_last - covered;
        changes[last + 1] += height - covered_last;
    }
}
