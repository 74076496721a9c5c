//! The sides of a triangle, and the areas beside them within a row.
//!
//! Numbers come in fours: the long side from the top to the bottom corner, the upper and the lower of the others, and
//! nothing. Each step is then the same for all of them, and the processor takes several at once.

use glam::DVec2;

use super::shape::{least, most};

/// Sides with a smaller height [texels] are level: they bound no area.
const LEVEL_TEXELS: f64 = 1e-30;

/// The sides of a triangle: x as functions of y.
#[derive(Clone, Copy, Debug)]
pub struct Sides {
    top: f64,
    middle: f64,
    bottom: f64,
    start_x: [f64; 4],
    start_y: [f64; 4],
    slope: [f64; 4],
    /// Weight of the area to the right of each side, as share of the triangle per area.
    sign: [f64; 4],
    /// Share of the triangle above y per squared distance from the top, and below y per squared distance from the
    /// bottom.
    upper_square: f64,
    lower_square: f64,
    /// Share below the middle corner.
    lower_share: f64,
}

/// The triangle cut at one height.
#[derive(Clone, Copy, Debug)]
pub struct SideCut {
    /// Height of the cut on each side, clamped to the side.
    y: [f64; 4],
    x: [f64; 4],
    /// Share of the triangle above, from 0 to 1 up to rounding.
    pub above: f64,
}

/// The sides between two cuts.
#[derive(Clone, Copy, Debug)]
pub struct Pieces {
    low: [f64; 4],
    high: [f64; 4],
    run: [f64; 4],
    height: [f64; 4],
    /// Share of the triangle per squared distance into a piece.
    per_square: [f64; 4],
}

/// One side between two cuts.
#[derive(Clone, Copy, Debug)]
pub struct CutPiece {
    low: f64,
    run: f64,
    height: f64,
    per_square: f64,
}

/// Smallest run [texels]: keeps the factor finite without losing a representable area.
const MIN_RUN: f64 = 1e-100;

fn four(f: impl Fn(usize) -> f64) -> [f64; 4] {
    [f(0), f(1), f(2), f(3)]
}

impl Sides {
    /// Expects the corners from top to bottom.
    #[inline(always)]
    pub fn new([a, b, c]: [DVec2; 3]) -> Self {
        let start_x = [a.x, a.x, b.x, 0.0];
        let start_y = [a.y, a.y, b.y, 0.0];
        let end_x = [c.x, b.x, c.x, 0.0];
        let end_y = [c.y, b.y, c.y, 0.0];
        let inverse = four(|side| {
            let height = end_y[side] - start_y[side];
            let inverse = 1.0 / height;
            if height > LEVEL_TEXELS { inverse } else { 0.0 }
        });
        let slope = four(|side| (end_x[side] - start_x[side]) * inverse[side]);
        let share_per_area = 2.0 / (b - a).perp_dot(c - a);
        let upper_square = inverse[1] * inverse[0];
        let lower_square = inverse[2] * inverse[0];
        Self {
            top: a.y,
            middle: b.y,
            bottom: c.y,
            start_x,
            start_y,
            slope,
            sign: [share_per_area, -share_per_area, -share_per_area, 0.0],
            upper_square,
            lower_square,
            lower_share: (c.y - b.y) * (c.y - b.y) * lower_square,
        }
    }

    /// Cuts at a height, clamped to the triangle.
    #[inline(always)]
    pub fn cut(&self, y: f64) -> SideCut {
        let y = most(self.top, least(self.bottom, y));
        let y = [y, least(y, self.middle), most(y, self.middle), y];
        let (down, up) = (y[1] - self.top, self.bottom - y[2]);
        SideCut {
            y,
            x: four(|side| self.start_x[side] + (y[side] - self.start_y[side]) * self.slope[side]),
            above: down * down * self.upper_square + (self.lower_share - up * up * self.lower_square),
        }
    }

    /// The sides between two cuts.
    #[inline(always)]
    pub fn between(&self, from: &SideCut, to: &SideCut) -> Pieces {
        let low = four(|side| least(from.x[side], to.x[side]));
        let high = four(|side| most(from.x[side], to.x[side]));
        let run = four(|side| high[side] - low[side]);
        let height = four(|side| (to.y[side] - from.y[side]) * self.sign[side]);
        Pieces {
            low,
            high,
            run,
            height,
            // Without a run there is no area along it, so any finite factor will do.
            per_square: four(|side| 0.5 * height[side] / most(run[side], MIN_RUN)),
        }
    }
}

impl Pieces {
    #[inline(always)]
    pub fn piece(&self, index: usize) -> CutPiece {
        CutPiece {
            low: self.low[index],
            run: self.run[index],
            height: self.height[index],
            per_square: self.per_square[index],
        }
    }

    /// Index of the short side, if there is only one.
    #[inline(always)]
    pub fn only_short(&self) -> Option<usize> {
        match (self.height[1] != 0.0, self.height[2] != 0.0) {
            (true, false) => Some(1),
            (false, true) => Some(2),
            _ => None,
        }
    }

    /// Smallest and largest x of the sides that have height.
    #[inline(always)]
    pub fn extent(&self) -> (f64, f64) {
        let [mut low, mut high] = [self.low[0], self.high[0]];
        for short in [1, 2] {
            let here = self.height[short] != 0.0;
            low = least(low, if here { self.low[short] } else { low });
            high = most(high, if here { self.high[short] } else { high });
        }
        (low, high)
    }

    /// Share of the triangle between the cuts and left of `x`, up to rounding.
    #[inline(always)]
    pub fn share_up_to(&self, x: f64) -> f64 {
        let shares = four(|piece| self.piece(piece).share_up_to(x));
        (shares[0] + shares[2]) + (shares[1] + shares[3])
    }
}

impl CutPiece {
    /// Contribution of the piece to the share left of `x`.
    #[inline(always)]
    pub fn share_up_to(&self, x: f64) -> f64 {
        let x = x - self.low;
        let within = most(0.0, least(self.run, x));
        self.per_square * (within * within) + self.height * most(0.0, x - self.run)
    }
}
