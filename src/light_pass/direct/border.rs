//! Subdivides texels at shadow borders, so that they are as sharp on the map as on the surface.

use glam::DVec2;

use super::texel::{LightsOfTexel, Texel};
use crate::illumination::Chart;
use crate::illumination::gutter::neighbours;
use crate::illumination::lookup::blend;
use crate::optics::{LinearSrgb, luminance};

/// Relative change of irradiance between the neighbours of a texel above which it counts as a shadow border.
const STEEP: f32 = 0.5;

/// Values of the small texels into which some texels of a chart are subdivided.
#[derive(Clone, Debug)]
pub struct SubdividedTexels<T> {
    /// Small texels along one side of a texel.
    side: usize,
    /// Texels across and down the chart.
    size: (usize, usize),
    /// By texel: index of the first of its small texels, which are stored row by row; [`WHOLE`] if it is not
    /// subdivided.
    begins: Vec<u32>,
    values: Vec<T>,
}

const WHOLE: u32 = u32::MAX;

impl<T: Copy> SubdividedTexels<T> {
    /// Subdivides the marked texels of a chart and their neighbours.
    pub(super) fn new(chart: &Chart, side: usize, marked: &[bool], value: T) -> Self {
        let size = (chart.width, chart.height);
        let mut count = 0;
        let begin = |texel: usize| {
            let is_near = marked[texel] || neighbours(texel, size.0, size.1).any(|other| marked[other]);
            if !is_near {
                return WHOLE;
            }
            count += 1;
            ((count - 1) * side * side) as u32
        };
        let begins: Vec<u32> = (0..marked.len()).map(begin).collect();
        Self {
            side,
            size,
            values: vec![value; count * side * side],
            begins,
        }
    }

    /// Size of the whole chart in small texels.
    fn small_size(&self) -> (usize, usize) {
        (self.size.0 * self.side, self.size.1 * self.side)
    }

    /// Index of a small texel's value; `None` if its texel is not subdivided.
    fn place(&self, column: usize, row: usize) -> Option<usize> {
        let begin = self.begins[row / self.side * self.size.0 + column / self.side];
        let within = row % self.side * self.side + column % self.side;
        (begin != WHOLE).then(|| begin as usize + within)
    }

    /// `small` counts small texels row by row over the whole chart. `None` if the texel there is not subdivided.
    pub(super) fn get(&self, small: usize) -> Option<&T> {
        let (across, _) = self.small_size();
        Some(&self.values[self.place(small % across, small / across)?])
    }

    pub(super) fn set(&mut self, column: usize, row: usize, value: T) {
        if let Some(place) = self.place(column, row) {
            self.values[place] = value;
        }
    }

    /// The small texels of a texel; `None` if it is not subdivided.
    pub(super) fn within(&self, texel: usize) -> Option<&[T]> {
        let begin = self.begins[texel];
        (begin != WHOLE).then(|| &self.values[begin as usize..][..self.side * self.side])
    }

    pub(super) fn map<U>(self, f: impl Fn(T) -> U) -> SubdividedTexels<U> {
        SubdividedTexels {
            side: self.side,
            size: self.size,
            begins: self.begins,
            values: self.values.into_iter().map(f).collect(),
        }
    }
}

impl SubdividedTexels<Texel> {
    /// Whether a small texel needs more samples.
    pub(super) fn is_unclear(&self, small: usize) -> bool {
        let (width, height) = self.small_size();
        let texel = |small: usize| self.get(small).copied().unwrap_or(Texel::DARK);
        texel(small).is_unclear(|| neighbours(small, width, height).map(texel))
    }
}

impl SubdividedTexels<[f32; 3]> {
    /// E [W/m²] at a map coordinate in [0, 1]², interpolated between the centres of small texels; `None` where texels
    /// are not subdivided.
    pub fn at(&self, uv: DVec2) -> Option<LinearSrgb> {
        let (width, height) = self.small_size();
        let size = DVec2::new(width as f64, height as f64);
        let column = ((uv.x * size.x) as usize).min(width - 1);
        let row = ((uv.y * size.y) as usize).min(height - 1);
        let own = self.place(column, row)?;
        let value = |column: usize, row: usize| {
            // Irradiance hardly changes where the subdivision ends.
            let place = self.place(column, row).unwrap_or(own);
            LinearSrgb::from(self.values[place].map(f64::from))
        };
        Some(blend(size, uv, value))
    }

    /// Small texels along one side of a texel.
    pub fn side(&self) -> usize {
        self.side
    }
}

/// Whether irradiance changes by more than [`STEEP`] between the neighbours of a texel.
pub(super) fn is_steep(chart: &Chart, texels: &[Texel], texel: usize) -> bool {
    let around = neighbours(texel, chart.width, chart.height).chain([texel]);
    let covered = around.filter(|&other| texels[other].lit != LightsOfTexel::EMPTY);
    let brightness = covered.map(|other| luminance(&texels[other].irradiance) as f32);
    let (low, high) = brightness.fold((f32::INFINITY, 0.0_f32), |(low, high), e| {
        (low.min(e), high.max(e))
    });
    high - low > STEEP * high
}
