//! Error measures between two maps, over texels of equal area, for any quantity.

use serde::Serialize;

/// Fraction of the reference's mean above which a texel counts in the average relative difference.
const SIGNIFICANT_SHARE_OF_MEAN: f64 = 0.01;

/// Values of a rectangular grid of texels, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Texels across, > 0.
    pub width: usize,
    /// Texels down, > 0.
    pub height: usize,
    /// `width × height` values.
    pub values: Vec<f64>,
}

/// A texel of an image and of its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexelPair {
    /// Luminance of E in the image [W/m²].
    pub image: f64,
    /// Luminance of E in the reference [W/m²].
    pub reference: f64,
    /// Surface area under the texel [m²]; any unit if all texels are equal.
    pub area_m2: f64,
}

/// Area-weighted measures of an image against its reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// sqrt(mean((I − R)²)) / mean(R).
    pub relative_rmse: f64,
    /// mean(|I − R| / R) over texels with R > 1 % of mean(R).
    pub average_relative_difference: f64,
    /// max(I).
    pub peak: f64,
    /// max(R).
    pub reference_peak: f64,
    /// mean(I).
    pub mean: f64,
    /// mean(R).
    pub reference_mean: f64,
    /// mean(I) / mean(R).
    pub flux_ratio: f64,
}

impl Agreement {
    /// `None` if the reference is dark.
    pub fn of(texels: &[TexelPair]) -> Option<Self> {
        let sum = |value: &dyn Fn(&TexelPair) -> f64| -> f64 {
            texels.iter().map(|texel| value(texel) * texel.area_m2).sum()
        };
        let area = sum(&|_| 1.0);
        let mean = sum(&|texel| texel.reference) / area;
        if !(mean.is_finite() && mean > 0.0) {
            return None;
        }
        let mean_square = sum(&|texel| (texel.image - texel.reference).powi(2)) / area;
        let significant = |texel: &TexelPair| texel.reference > SIGNIFICANT_SHARE_OF_MEAN * mean;
        let share = |texel: &TexelPair, value: f64| if significant(texel) { value } else { 0.0 };
        let differences = sum(&|texel| share(texel, (texel.image - texel.reference).abs() / texel.reference));
        let peak = |value: fn(&TexelPair) -> f64| texels.iter().map(value).fold(0.0, f64::max);
        let flux = sum(&|texel| texel.image);
        Some(Self {
            relative_rmse: mean_square.sqrt() / mean,
            average_relative_difference: differences / sum(&|texel| share(texel, 1.0)),
            peak: peak(|texel| texel.image),
            reference_peak: peak(|texel| texel.reference),
            mean: flux / area,
            reference_mean: mean,
            flux_ratio: flux / (mean * area),
        })
    }
}

/// Measures over texels of equal area; `None` unless mean(R) > 0.
///
/// # Panics
/// The slices must have the same length.
pub fn agreement(image: &[f64], reference: &[f64]) -> Option<Agreement> {
    assert_eq!(image.len(), reference.len(), "maps of one size are compared");
    let pair = |(&image, &reference)| TexelPair {
        image,
        reference,
        area_m2: 1.0,
    };
    Agreement::of(&image.iter().zip(reference).map(pair).collect::<Vec<_>>())
}

/// sqrt(mean((I − R)²)) / mean(R), as in [`agreement`].
pub fn relative_rmse(image: &[f64], reference: &[f64]) -> Option<f64> {
    agreement(image, reference).map(|agreement| agreement.relative_rmse)
}

/// mean(|I − R| / R) over the texels with R > 1 % of mean(R), as in [`agreement`].
pub fn average_relative_difference(image: &[f64], reference: &[f64]) -> Option<f64> {
    agreement(image, reference).map(|agreement| agreement.average_relative_difference)
}

impl Grid {
    /// Replaces each block of `columns × rows` texels by its mean; `None` if the blocks do not divide the grid.
    pub fn box_averaged(&self, columns: usize, rows: usize) -> Option<Self> {
        if columns == 0
            || rows == 0
            || !self.width.is_multiple_of(columns)
            || !self.height.is_multiple_of(rows)
        {
            return None;
        }
        let (width, height) = (self.width / columns, self.height / rows);
        let mut values = vec![0.0; width * height];
        for (index, value) in self.values.iter().enumerate() {
            let (column, row) = (index % self.width, index / self.width);
            values[row / rows * width + column / columns] += value;
        }
        let texels = (columns * rows) as f64;
        for value in &mut values {
            *value /= texels;
        }
        Some(Self {
            width,
            height,
            values,
        })
    }
}

/// Brings both grids to the size of the smaller one. The larger is box-averaged, which conserves its flux. `None`
/// unless one size is a multiple of the other.
pub fn at_common_size(image: &Grid, reference: &Grid) -> Option<(Grid, Grid)> {
    if image.width >= reference.width && image.height >= reference.height {
        let reduced = reduced_to(image, reference)?;
        Some((reduced, reference.clone()))
    } else {
        let reduced = reduced_to(reference, image)?;
        Some((image.clone(), reduced))
    }
}

fn reduced_to(large: &Grid, small: &Grid) -> Option<Grid> {
    let divides = large.width.is_multiple_of(small.width) && large.height.is_multiple_of(small.height);
    divides.then(|| large.box_averaged(large.width / small.width, large.height / small.height))?
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texels(values: &[(f64, f64, f64)]) -> Vec<TexelPair> {
        let texel = |&(image, reference, area_m2)| TexelPair {
            image,
            reference,
            area_m2,
        };
        values.iter().map(texel).collect()
    }

    #[test]
    fn large_texels_weigh_more() {
        let agreement = Agreement::of(&texels(&[(2.0, 1.0, 3.0), (1.0, 1.0, 1.0)])).expect("lit");
        assert!((agreement.relative_rmse - 0.75_f64.sqrt()).abs() < 1e-15);
        assert!((agreement.average_relative_difference - 0.75).abs() < 1e-15);
        assert!((agreement.flux_ratio - 1.75).abs() < 1e-15);
        assert_eq!((agreement.peak, agreement.reference_peak), (2.0, 1.0));
    }

    #[test]
    fn dark_texels_have_no_relative_difference() {
        let agreement = Agreement::of(&texels(&[(1.0, 1.0, 1.0), (0.1, 0.0, 1.0)])).expect("lit");
        assert!(agreement.average_relative_difference.abs() < 1e-15);
        assert!(agreement.relative_rmse > 0.1);
        assert_eq!(Agreement::of(&texels(&[(1.0, 0.0, 1.0)])), None);
        assert_eq!(Agreement::of(&[]), None);
    }

    #[test]
    fn measures_of_a_worked_example() {
        // R = 1, 3, 0, 4 has mean 2; differences 1, 0, 5, 0 have mean square 6.5. The third texel (R = 0) is left out
        // of the ARD: (1/1 + 0/3 + 0/4) / 3.
        let (image, reference) = ([2.0, 3.0, 5.0, 4.0], [1.0, 3.0, 0.0, 4.0]);
        let rmse = relative_rmse(&image, &reference).expect("lit");
        assert!((rmse - 6.5_f64.sqrt() / 2.0).abs() < 1e-15, "{rmse}");
        let ard = average_relative_difference(&image, &reference).expect("lit");
        assert!((ard - 1.0 / 3.0).abs() < 1e-15, "{ard}");
        // Nothing is relative to a dark reference.
        assert_eq!(relative_rmse(&[1.0], &[0.0]), None);
        assert_eq!(average_relative_difference(&[1.0], &[0.0]), None);
    }

    #[test]
    fn box_average_keeps_the_mean_and_the_place() {
        let grid = Grid {
            width: 6,
            height: 4,
            values: (0..24).map(f64::from).collect(),
        };
        let small = grid.box_averaged(3, 2).expect("divides");
        assert_eq!((small.width, small.height), (2, 2));
        // Rows 0..2, columns 0..3: 0, 1, 2, 6, 7, 8.
        assert_eq!(small.values, [4.0, 7.0, 16.0, 19.0]);
        assert!((6.0 * small.values.iter().sum::<f64>() - grid.values.iter().sum::<f64>()).abs() < 1e-9);
        assert_eq!(grid.box_averaged(4, 2), None);
    }

    #[test]
    fn sizes_meet_at_the_smaller_or_not_at_all() {
        let grid = |width: usize, height: usize| Grid {
            width,
            height,
            values: vec![1.0; width * height],
        };
        let (a, b) = at_common_size(&grid(8, 4), &grid(4, 4)).expect("multiple");
        assert_eq!((a.width, b.width), (4, 4));
        let (a, b) = at_common_size(&grid(2, 2), &grid(6, 4)).expect("multiple");
        assert_eq!((a.width, b.height), (2, 2));
        assert!(at_common_size(&grid(8, 2), &grid(4, 4)).is_none());
        assert!(at_common_size(&grid(9, 4), &grid(4, 4)).is_none());
    }
}
