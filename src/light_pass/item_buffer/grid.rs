//! The borders of the cells on a face.

use std::sync::LazyLock;

use glam::DVec2;

use super::CELLS_PER_SIDE;
use crate::geometry::cube_face::FaceMapping;

/// Enlargement of cells in tests, in half sides of the face: above rounding, far below the size of a cell.
pub(super) const MARGIN: f64 = 1e-9;

/// Borders between cells on the plane z = 1 of a face.
pub(super) struct Grid {
    mapping: FaceMapping,
    /// x of each column's border, ascending.
    x: Vec<f64>,
    /// On each column's border: y of each row's border, ascending.
    y: Vec<Vec<f64>>,
}

/// A rectangle of cells: first and last column, first and last row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CellRange {
    pub(super) columns: (usize, usize),
    pub(super) rows: (usize, usize),
}

impl CellRange {
    /// Every cell of a face.
    pub(super) const ALL: Self = Self {
        columns: (0, CELLS_PER_SIDE - 1),
        rows: (0, CELLS_PER_SIDE - 1),
    };

    pub(super) fn is_single(&self) -> bool {
        self.columns.0 == self.columns.1 && self.rows.0 == self.rows.1
    }
}

static EQUAL: LazyLock<Grid> = LazyLock::new(|| Grid::new(FaceMapping::EqualSolidAngle));
static PLAIN: LazyLock<Grid> = LazyLock::new(|| Grid::new(FaceMapping::Plain));

impl Grid {
    /// The grid of a mapping, made once.
    pub(super) fn of(mapping: FaceMapping) -> &'static Self {
        match mapping {
            FaceMapping::EqualSolidAngle => &EQUAL,
            FaceMapping::Plain => &PLAIN,
        }
    }

    fn new(mapping: FaceMapping) -> Self {
        let share = |border: usize| border as f64 / CELLS_PER_SIDE as f64;
        let place =
            |column: usize, row: usize| mapping.plane_from_square(DVec2::new(share(column), share(row)));
        let borders = 0..=CELLS_PER_SIDE;
        Self {
            mapping,
            x: borders.clone().map(|column| place(column, 0).x).collect(),
            y: borders
                .clone()
                .map(|column| borders.clone().map(|row| place(column, row).y).collect())
                .collect(),
        }
    }

    /// Bounding rectangle of a cell, slightly enlarged. There is a border at the centre of the face, so that no column
    /// crosses it and y is extreme at the corners.
    pub(super) fn cell(&self, column: usize, row: usize) -> (DVec2, DVec2) {
        let (left, right) = (&self.y[column], &self.y[column + 1]);
        let low = DVec2::new(self.x[column], left[row].min(right[row]));
        let high = DVec2::new(self.x[column + 1], left[row + 1].max(right[row + 1]));
        (low - MARGIN, high + MARGIN)
    }

    /// Cells that may overlap a rectangle of the face.
    pub(super) fn cells(&self, low: DVec2, high: DVec2) -> CellRange {
        // At a given y, |v| decreases with |x|: rows are extreme at the nearest and the farthest x.
        let nearest_x = if low.x <= 0.0 && high.x >= 0.0 {
            0.0
        } else {
            low.x.abs().min(high.x.abs())
        };
        let farthest_x = low.x.abs().max(high.x.abs());
        let share = |x: f64, y: f64| self.mapping.row_share(DVec2::new(x, y));
        let lowest = share(if low.y < 0.0 { nearest_x } else { farthest_x }, low.y);
        let highest = share(if high.y > 0.0 { nearest_x } else { farthest_x }, high.y);
        CellRange {
            columns: (self.column(low.x - MARGIN), self.column(high.x + MARGIN)),
            rows: (index(lowest - MARGIN), index(highest + MARGIN)),
        }
    }

    fn column(&self, x: f64) -> usize {
        match self.mapping {
            FaceMapping::Plain => index(0.5 * (x + 1.0)),
            FaceMapping::EqualSolidAngle => self.x[1..CELLS_PER_SIDE].partition_point(|&border| border <= x),
        }
    }
}

/// Index of the interval in which a share of the side lies.
fn index(share: f64) -> usize {
    ((share * CELLS_PER_SIDE as f64).max(0.0) as usize).min(CELLS_PER_SIDE - 1)
}
