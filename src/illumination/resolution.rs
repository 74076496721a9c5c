//! Estimates the error of texels that are larger than requested: the variation within a texel, extrapolated from that
//! between texels.

use super::Chart;

/// Ratio of the variance within a texel to that between it and the three others of the same 2 × 2 block: a half at a
/// border between light and shadow, a quarter on a slope.
const PER_LEVEL: f64 = 0.5;

/// Variance within each texel [square of the values' unit] that a map of finer texels would resolve. `halved` is how
/// many times texels should be halved in length to be fine enough; tiled charts know this for each tile. Zero if texels
/// are fine enough.
pub fn variance_within(chart: &Chart, values: &[f64], halved: u32) -> Vec<f64> {
    let mut variances = vec![0.0; values.len()];
    match &chart.layout {
        None => {
            let covers = |texel: usize| chart.texel_area_m2(texel) > 0.0;
            let size = (chart.width, chart.height);
            add(values, size, below(halved), covers, &mut variances);
        }
        Some(layout) => {
            for tile in layout.tiles().filter(|tile| tile.lost > 0) {
                let range = tile.texels.clone();
                let share = below(u32::from(tile.lost));
                add(
                    &values[range.clone()],
                    tile.size,
                    share,
                    |_| true,
                    &mut variances[range],
                );
            }
        }
    }
    variances
}

/// Sum over the missing levels, relative to the variance among four texels.
fn below(levels: u32) -> f64 {
    (1..=levels.min(64))
        .map(|level| PER_LEVEL.powi(level as i32))
        .sum()
}

/// Sets each covered texel to the variance among the covered texels of its 2 × 2 block, times `share`.
fn add(
    values: &[f64],
    (width, height): (usize, usize),
    share: f64,
    covers: impl Fn(usize) -> bool,
    variances: &mut [f64],
) {
    if share == 0.0 {
        return;
    }
    for top in (0..height).step_by(2) {
        for left in (0..width).step_by(2) {
            let rows = top..(top + 2).min(height);
            let texels =
                rows.flat_map(|row| (left..(left + 2).min(width)).map(move |column| row * width + column));
            let texels: Vec<usize> = texels.filter(|&texel| covers(texel)).collect();
            let count = texels.len() as f64;
            let mean = texels.iter().map(|&texel| values[texel]).sum::<f64>() / count;
            let square = |&texel: &usize| (values[texel] - mean) * (values[texel] - mean);
            let variance = texels.iter().map(square).sum::<f64>() / count;
            for texel in texels {
                variances[texel] = variance * share;
            }
        }
    }
}
