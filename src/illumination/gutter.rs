//! Texels beside a surface take the value of their nearest neighbours on it, so that a bilinear look-up at a border
//! does not mix in nothing.

use super::Chart;

/// Texels that a gutter reaches beyond the surface.
pub const GUTTER_REACH_TEXELS: usize = 2;

/// Fills the texels without area within [`GUTTER_REACH_TEXELS`] of covered ones: each takes the mean of those of its
/// eight neighbours that are covered or were filled a step before. Covered texels keep their value, and as a gutter
/// has no area, no flux is added.
pub fn fill_gutter(chart: &Chart, irradiance: &mut [[f32; 3]]) {
    if chart.texel_areas_m2.len() == 1 {
        return;
    }
    let (width, height) = (chart.width, chart.height);
    let mut known: Vec<bool> = (0..width * height)
        .map(|texel| chart.texel_area_m2(texel) > 0.0)
        .collect();
    for _ in 0..GUTTER_REACH_TEXELS {
        let filled: Vec<(usize, [f32; 3])> = (0..width * height)
            .filter(|&texel| !known[texel])
            .filter_map(|texel| {
                let around = neighbours(texel, width, height).filter(|&neighbour| known[neighbour]);
                mean(around.map(|neighbour| irradiance[neighbour])).map(|value| (texel, value))
            })
            .collect();
        for (texel, value) in filled {
            irradiance[texel] = value;
            known[texel] = true;
        }
    }
}

fn mean(values: impl Iterator<Item = [f32; 3]>) -> Option<[f32; 3]> {
    let (mut sum, mut count) = ([0.0f64; 3], 0.0);
    for value in values {
        for channel in 0..3 {
            sum[channel] += f64::from(value[channel]);
        }
        count += 1.0;
    }
    (count > 0.0).then(|| sum.map(|channel| (channel / count) as f32))
}

/// The up to eight texels around one.
pub fn neighbours(texel: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (column, row) = (texel % width, texel / width);
    let rows = row.saturating_sub(1)..(row + 2).min(height);
    let columns = column.saturating_sub(1)..(column + 2).min(width);
    rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
        .filter(move |&neighbour| neighbour != texel)
}
