//! The values of a texture, before they are encoded.

use super::index::Rectangle;
use crate::export::exr::shares;
use crate::illumination::Chart;
use crate::illumination::gutter::{GUTTER_REACH_TEXELS, neighbours};

/// A rectangle of linear sRGB values, row 0 at v = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Texels {
    width: usize,
    height: usize,
    values: Vec<[f32; 3]>,
}

impl Texels {
    /// Irradiance of a map [W/m²] times a factor. Texels without a surface are filled with light from beside them, so
    /// that neither filtering, nor block compression, nor mip levels mix in black.
    pub fn new(chart: &Chart, irradiance: &[[f32; 3]], factor: f64) -> Self {
        let scaled = |texel: &[f32; 3]| texel.map(|value| (f64::from(value) * factor) as f32);
        let mut texels = Self {
            width: chart.width,
            height: chart.height,
            values: irradiance.iter().map(scaled).collect(),
        };
        if !chart.is_full() {
            spread(&mut texels.values, &known(chart), texels.width);
        }
        texels
    }

    /// Values as they are, row by row, of a size that has as many.
    pub fn of((width, height): (usize, usize), values: Vec<[f32; 3]>) -> Self {
        Self {
            width,
            height,
            values,
        }
    }

    /// Black texels of a size.
    pub fn black((width, height): (usize, usize)) -> Self {
        Self {
            width,
            height,
            values: vec![[0.0; 3]; width * height],
        }
    }

    /// Copies others to a rectangle of their size, and repeats those at their border `gutter` texels outwards.
    pub fn place(&mut self, others: &Self, at: Rectangle, gutter: usize) {
        let rows = at.y.saturating_sub(gutter)..(at.y + at.height + gutter).min(self.height);
        let columns = at.x.saturating_sub(gutter)..(at.x + at.width + gutter).min(self.width);
        for row in rows {
            let from = row.saturating_sub(at.y).min(at.height - 1) * others.width;
            for column in columns.clone() {
                let nearest = column.saturating_sub(at.x).min(at.width - 1);
                self.values[row * self.width + column] = others.values[from + nearest];
            }
        }
    }

    /// Width and height.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Values, row by row.
    pub fn values(&self) -> &[[f32; 3]] {
        &self.values
    }

    /// The next mip level: half the size, at least one texel per side, each the mean over what it covers.
    #[must_use]
    pub fn halved(&self) -> Self {
        let [width, height] = [self.width, self.height].map(|side| (side / 2).max(1));
        let columns: Vec<_> = (0..width)
            .map(|column| shares(column, width, self.width))
            .collect();
        let mut values = Vec::with_capacity(width * height);
        for row in 0..height {
            let rows = shares(row, height, self.height);
            values.extend(columns.iter().map(|columns| self.mean(&rows, columns)));
        }
        Self {
            width,
            height,
            values,
        }
    }

    /// Mean over shares of some rows and columns.
    fn mean(&self, rows: &[(usize, f64)], columns: &[(usize, f64)]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for &(row, height) in rows {
            for &(column, width) in columns {
                let texel = self.values[row * self.width + column];
                for (sum, value) in sum.iter_mut().zip(texel) {
                    *sum += height * width * f64::from(value);
                }
            }
        }
        sum.map(|sum| sum as f32)
    }

    /// Largest value of any channel, at least 0.
    pub fn peak(&self) -> f32 {
        self.values
            .as_flattened()
            .iter()
            .fold(0.0, |peak, value| peak.max(*value))
    }
}

/// Texels that hold light of a surface: those that it covers, and the gutter that the bake filled.
fn known(chart: &Chart) -> Vec<bool> {
    let texels = chart.width * chart.height;
    let mut known: Vec<bool> = (0..texels)
        .map(|texel| chart.texel_area_m2(texel) > 0.0)
        .collect();
    for _ in 0..GUTTER_REACH_TEXELS {
        let is_near = |texel| neighbours(texel, chart.width, chart.height).any(|beside| known[beside]);
        known = (0..texels).map(|texel| known[texel] || is_near(texel)).collect();
    }
    known
}

/// Fills every unknown texel with the mean of the known ones in the smallest square, of doubling sizes, that has some.
fn spread(values: &mut [[f32; 3]], known: &[bool], width: usize) {
    let height = known.len() / width;
    if known.iter().all(|known| *known) || (width, height) == (1, 1) {
        return;
    }
    let (across, down) = (width.div_ceil(2), height.div_ceil(2));
    let mut sums = vec![([0.0_f64; 3], 0.0); across * down];
    for (texel, value) in values.iter().enumerate().filter(|(texel, _)| known[*texel]) {
        let (sum, count) = &mut sums[texel / width / 2 * across + texel % width / 2];
        for channel in 0..3 {
            sum[channel] += f64::from(value[channel]);
        }
        *count += 1.0;
    }
    let mean = |(sum, count): &([f64; 3], f64)| sum.map(|sum| (sum / count.max(1.0)) as f32);
    let mut coarse: Vec<[f32; 3]> = sums.iter().map(mean).collect();
    let coarse_known: Vec<bool> = sums.iter().map(|(_, count)| *count > 0.0).collect();
    spread(&mut coarse, &coarse_known, across);
    for (texel, value) in values.iter_mut().enumerate().filter(|(texel, _)| !known[*texel]) {
        *value = coarse[texel / width / 2 * across + texel % width / 2];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_stays_and_the_rest_takes_from_what_is_near() {
        for (width, height) in [(7, 5), (8, 8), (1, 9), (16, 3)] {
            let mut values = vec![[0.0; 3]; width * height];
            let mut known = vec![false; width * height];
            (values[0], known[0]) = ([4.0, 2.0, 1.0], true);
            let last = width * height - 1;
            (values[last], known[last]) = ([8.0, 2.0, 1.0], true);
            spread(&mut values, &known, width);
            assert_eq!((values[0], values[last]), ([4.0, 2.0, 1.0], [8.0, 2.0, 1.0]));
            assert!(
                values
                    .iter()
                    .all(|value| (4.0..=8.0).contains(&value[0]) && value[2] == 1.0)
            );
        }
    }

    #[test]
    fn half_the_size_holds_the_same_mean() {
        for (width, height) in [(8, 4), (7, 5), (1, 6), (3, 1), (1, 1)] {
            let values = (0..width * height).map(|texel| [texel as f32, 1.0, (texel % 3) as f32]);
            let texels = Texels {
                width,
                height,
                values: values.collect(),
            };
            let half = texels.halved();
            assert_eq!(half.size(), ((width / 2).max(1), (height / 2).max(1)));
            for channel in 0..3 {
                let mean = |texels: &Texels| {
                    let values = texels.values.iter().map(|texel| f64::from(texel[channel]));
                    values.sum::<f64>() / texels.values.len() as f64
                };
                assert!((mean(&half) - mean(&texels)).abs() < 1e-5, "{width}x{height}");
            }
        }
    }

    #[test]
    fn a_placed_map_goes_on_around_itself() {
        let mut texels = Texels::black((8, 8));
        let map = Texels {
            width: 2,
            height: 2,
            values: vec![[1.0; 3], [2.0; 3], [3.0; 3], [4.0; 3]],
        };
        let place = Rectangle {
            x: 3,
            y: 1,
            width: 2,
            height: 2,
        };
        texels.place(&map, place, 2);
        let rows: Vec<String> = texels
            .values
            .chunks(8)
            .map(|row| row.iter().map(|value| value[0].to_string()).collect())
            .collect();
        let top = "01112220";
        let bottom = "03334440";
        assert_eq!(
            rows,
            [
                top, top, bottom, bottom, bottom, "00000000", "00000000", "00000000"
            ]
        );
    }
}
