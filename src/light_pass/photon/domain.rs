//! The launch domain as a quadtree: its points, its squares, and the squares that light starts in.

use std::collections::HashSet;
use std::hash::{BuildHasherDefault, Hasher};

use glam::DVec2;

use super::launch::PhotonLaunch;
use crate::geometry::sampling::{GOLDEN_64, mix64};
use crate::light_pass::item_buffer::CELLS_PER_SIDE;

/// Coordinates of points are multiples of 2⁻²⁴ of a root's side.
pub(in crate::light_pass) const POINT_BITS: u32 = 24;
const WHOLE: u32 = 1 << POINT_BITS;

/// Inset of [`DomainPoint::off_border`].
const MARGIN: f64 = 1e-9;

/// Level of the item buffer's cells.
const CELL_LEVEL: u32 = CELLS_PER_SIDE.ilog2();

/// The first squares are of the coarsest level from this one on ...
pub const FIRST_LEVEL: u32 = 4;

/// ... that has so many of them. A quarter of them leaves light on small casters unseen.
const FIRST_SQUARES: usize = 160;

/// The finest level.
pub(super) const LAST_LEVEL: u32 = 14;

/// Hashes points: they are few bits, evenly mixed.
#[derive(Default)]
pub(in crate::light_pass) struct PointHasher(u64);

impl Hasher for PointHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_u64(u64::from(*byte));
        }
    }

    fn write_u32(&mut self, word: u32) {
        self.write_u64(u64::from(word));
    }

    fn write_u64(&mut self, word: u64) {
        self.0 = mix64(self.0.wrapping_add(GOLDEN_64) ^ word);
    }
}

pub(in crate::light_pass) type PointHash = BuildHasherDefault<PointHasher>;

/// A point of a root's square.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(in crate::light_pass) struct DomainPoint {
    pub(in crate::light_pass) root: u32,
    pub(super) x: u32,
    pub(super) y: u32,
}

impl DomainPoint {
    /// In the root's unit square.
    pub(super) fn square(self) -> DVec2 {
        DVec2::new(f64::from(self.x), f64::from(self.y)) / f64::from(WHOLE)
    }

    /// The same, off the border of the root, which may coincide with that of a surface.
    pub(in crate::light_pass) fn off_border(self) -> DVec2 {
        self.square()
            .clamp(DVec2::splat(MARGIN), DVec2::splat(1.0 - MARGIN))
    }
}

/// Position of a square in the tree: in the root's square, its first corner and level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(in crate::light_pass) struct SquarePlace {
    pub(in crate::light_pass) corner: DomainPoint,
    pub(in crate::light_pass) level: u32,
}

impl SquarePlace {
    fn side(self) -> u32 {
        WHOLE >> self.level
    }

    /// Unit squares.
    pub(in crate::light_pass) fn area(self) -> f64 {
        0.25_f64.powi(self.level as i32)
    }

    /// Point of a grid of `parts` per side.
    pub(super) fn point(self, column: u32, row: u32, parts: u32) -> DomainPoint {
        let step = self.side() / parts;
        DomainPoint {
            root: self.corner.root,
            x: self.corner.x + column * step,
            y: self.corner.y + row * step,
        }
    }

    /// One of its nine points, row by row.
    pub(in crate::light_pass) fn node(self, node: usize) -> DomainPoint {
        self.point(node as u32 % 3, node as u32 / 3, 2)
    }

    /// In order around the square.
    pub(in crate::light_pass) fn corners(self) -> [DomainPoint; 4] {
        [0, 2, 8, 6].map(|node| self.node(node))
    }

    /// A point of the root's square within this one.
    pub(super) fn at(self, within: DVec2) -> DVec2 {
        self.corner.square() + within * (f64::from(self.side()) / f64::from(WHOLE))
    }

    /// Where a point of the root's square lies in this one.
    pub(super) fn within(self, point: DVec2) -> DVec2 {
        (point - self.corner.square()) * (f64::from(WHOLE) / f64::from(self.side()))
    }

    pub(in crate::light_pass) fn quarters(self) -> [Self; 4] {
        [0, 1, 2, 3].map(|quarter| Self {
            corner: self.point(quarter % 2, quarter / 2, 2),
            level: self.level + 1,
        })
    }
}

/// Which squares light may start in.
pub(in crate::light_pass) enum LitCells {
    /// Squares that hold a marked cell of the item buffer, at its level and coarser ones.
    Marked(HashSet<SquarePlace, PointHash>),
    /// All: light from an extended lamp.
    All { roots: usize },
}

impl LitCells {
    pub(in crate::light_pass) fn of(launch: &PhotonLaunch) -> Self {
        let Some(cells) = launch.marked_cells() else {
            return Self::All {
                roots: launch.root_count(),
            };
        };
        let mut marked = HashSet::default();
        for (root, column, row) in cells {
            for level in 0..=CELL_LEVEL {
                let up = CELL_LEVEL - level;
                marked.insert(SquarePlace {
                    corner: DomainPoint {
                        root,
                        x: column >> up << (POINT_BITS - level),
                        y: row >> up << (POINT_BITS - level),
                    },
                    level,
                });
            }
        }
        Self::Marked(marked)
    }

    pub(super) fn has(&self, place: SquarePlace) -> bool {
        let Self::Marked(marked) = self else {
            return true;
        };
        let level = place.level.min(CELL_LEVEL);
        let shift = POINT_BITS - level;
        let corner = DomainPoint {
            x: place.corner.x >> shift << shift,
            y: place.corner.y >> shift << shift,
            ..place.corner
        };
        marked.contains(&SquarePlace { corner, level })
    }

    /// The first squares of a light whose bundles are to be found.
    pub(super) fn first(&self) -> Vec<SquarePlace> {
        self.divided(|level, places, _| level < FIRST_LEVEL || places < FIRST_SQUARES)
    }

    /// The smallest squares of one level of which there are no more than `most`.
    pub(in crate::light_pass) fn fine(&self, most: usize) -> Vec<SquarePlace> {
        self.divided(|_, _, quarters| quarters <= most)
    }

    /// Squares of one level: the whole domain, divided as long as `is_wanted`, by the level, the number of squares, and
    /// that after the division.
    fn divided(&self, is_wanted: impl Fn(u32, usize, usize) -> bool) -> Vec<SquarePlace> {
        let whole = |root: usize| SquarePlace {
            corner: DomainPoint {
                root: root as u32,
                x: 0,
                y: 0,
            },
            level: 0,
        };
        let mut places: Vec<SquarePlace> = match self {
            Self::All { roots } => (0..*roots).map(whole).collect(),
            Self::Marked(marked) => {
                let mut roots: Vec<SquarePlace> =
                    marked.iter().filter(|place| place.level == 0).copied().collect();
                roots.sort_unstable();
                roots
            }
        };
        for level in 0..LAST_LEVEL {
            let quarters = places.iter().flat_map(|place| place.quarters());
            let quarters: Vec<SquarePlace> = quarters.filter(|place| self.has(*place)).collect();
            if !is_wanted(level, places.len(), quarters.len()) {
                break;
            }
            places = quarters;
        }
        places
    }
}
