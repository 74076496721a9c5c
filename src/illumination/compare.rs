//! How far two maps are apart: measures over texels of equal area, on any quantity (irradiance luminance [W/m²] here).

/// Share of the reference's mean from which on a texel counts in [`average_relative_difference`].
pub const SIGNIFICANT_SHARE_OF_MEAN: f64 = 0.01;

/// Values on a rectangle of texels, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Texels across, > 0.
    pub width: usize,
    /// Texels down, > 0.
    pub height: usize,
    /// `width × height` values.
    pub values: Vec<f64>,
}

/// Measures of an image against its reference. Those that divide by the reference are `None` where it is dark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// See [`relative_rmse`].
    pub relative_rmse: Option<f64>,
    /// See [`average_relative_difference`].
    pub average_relative_difference: Option<f64>,
    /// Largest value of the image.
    pub peak: f64,
    /// Largest value of the reference.
    pub reference_peak: f64,
    /// Mean of the image.
    pub mean: f64,
    /// Mean of the reference.
    pub reference_mean: f64,
    /// Flux of the image over that of the reference: the ratio of the means, since both cover the same area.
    pub flux_ratio: Option<f64>,
}

/// sqrt(mean((I − R)²)) / mean(R); `None` where mean(R) is not above zero.
///
/// # Panics
/// Slices of different lengths.
pub fn relative_rmse(image: &[f64], reference: &[f64]) -> Option<f64> {
    assert_eq!(image.len(), reference.len(), "maps of one size are compared");
    let reference_mean = mean(reference);
    let mean_square = mean_of(
        image.iter().zip(reference).map(|(i, r)| (i - r) * (i - r)),
        image.len(),
    );
    (reference_mean > 0.0).then(|| mean_square.sqrt() / reference_mean)
}

/// mean(|I − R| / R) over the texels with R > 1 % of mean(R); `None` where mean(R) is not above zero.
///
/// # Panics
/// Slices of different lengths.
pub fn average_relative_difference(image: &[f64], reference: &[f64]) -> Option<f64> {
    assert_eq!(image.len(), reference.len(), "maps of one size are compared");
    let reference_mean = mean(reference);
    if reference_mean.is_nan() || reference_mean <= 0.0 {
        return None;
    }
    let threshold = SIGNIFICANT_SHARE_OF_MEAN * reference_mean;
    let significant: Vec<f64> = image
        .iter()
        .zip(reference)
        .filter(|(_, r)| **r > threshold)
        .map(|(i, r)| (i - r).abs() / r)
        .collect();
    Some(mean(&significant))
}

/// Arithmetic mean; 0 of nothing.
pub fn mean(values: &[f64]) -> f64 {
    mean_of(values.iter().copied(), values.len())
}

fn mean_of(values: impl Iterator<Item = f64>, count: usize) -> f64 {
    if count == 0 {
        0.0
    } else {
        values.sum::<f64>() / count as f64
    }
}

impl Grid {
    /// Largest value; 0 of nothing.
    pub fn peak(&self) -> f64 {
        self.values.iter().copied().reduce(f64::max).unwrap_or(0.0)
    }

    /// Each block of `columns × rows` texels replaced by its mean; `None` where the blocks do not divide the grid.
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

/// Both grids at the size of the smaller: the larger is box-averaged, which keeps its flux. `None` where neither size
/// is a whole multiple of the other.
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

/// All measures at once.
///
/// # Panics
/// Grids of different sizes; see [`at_common_size`].
pub fn compare(image: &Grid, reference: &Grid) -> Comparison {
    assert_eq!(
        (image.width, image.height),
        (reference.width, reference.height),
        "maps of one size are compared"
    );
    let (image_mean, reference_mean) = (mean(&image.values), mean(&reference.values));
    Comparison {
        relative_rmse: relative_rmse(&image.values, &reference.values),
        average_relative_difference: average_relative_difference(&image.values, &reference.values),
        peak: image.peak(),
        reference_peak: reference.peak(),
        mean: image_mean,
        reference_mean,
        flux_ratio: (reference_mean > 0.0).then(|| image_mean / reference_mean),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_of_a_worked_example() {
        // R = 1, 3, 0, 4 has mean 2; differences 1, 0, 5, 0 have mean square 6.5. The third texel (R = 0) is left out
        // of the ARD: (1/1 + 0/3 + 0/4) / 3.
        let (image, reference) = ([2.0, 3.0, 5.0, 4.0], [1.0, 3.0, 0.0, 4.0]);
        let rmse = relative_rmse(&image, &reference).expect("lit");
        assert!((rmse - 6.5_f64.sqrt() / 2.0).abs() < 1e-15, "{rmse}");
        let ard = average_relative_difference(&image, &reference).expect("lit");
        assert!((ard - 1.0 / 3.0).abs() < 1e-15, "{ard}");
    }

    #[test]
    fn dark_references_have_no_relative_measure() {
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
        assert!((mean(&small.values) - mean(&grid.values)).abs() < 1e-12);
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
