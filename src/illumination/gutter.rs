//! Fills the texels beside a surface from their neighbours on it, so that a bilinear look-up at a border does not
//! darken.

use super::Chart;
use super::lookup::bilinear;

/// Width of a gutter [texels].
pub const GUTTER_REACH_TEXELS: usize = 2;

/// Rounds of exchange between texels that are joined at a seam.
const EXCHANGES: usize = 8;

/// Rounds in which gutters of both sides of a seam read from each other.
const SEAM_ROUNDS: usize = 2;

/// Fills uncovered texels within [`GUTTER_REACH_TEXELS`] of covered ones with the mean of those of their eight
/// neighbours that are covered or already filled. Next to a seam they then take the value at the point where the
/// surface continues. Gutters have no area, so this adds no flux. Covered texels keep their values, except that those
/// joined at a seam without a gutter are made to agree.
pub fn fill_gutter(chart: &Chart, irradiance: &mut [[f32; 3]]) {
    even_out(chart, irradiance);
    if chart.is_full() {
        return;
    }

    // Ring by ring outwards. A ring is read as a whole before it is written, so that no value depends on the texels'
    // order.
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

    // Beside a seam, a texel shows where the surface continues. That look-up may itself read such texels, hence the
    // rounds.
    for _ in 0..SEAM_ROUNDS {
        let look = |uv| {
            bilinear(irradiance, width, height, uv)
                .to_array()
                .map(|channel| channel as f32)
        };
        let values: Vec<[f32; 3]> = chart.beyond.iter().map(|beyond| look(beyond.uv)).collect();
        for (beyond, value) in chart.beyond.iter().zip(values) {
            irradiance[beyond.texel] = value;
        }
    }
}

/// Exchanges flux between texels joined at a seam without a gutter until they agree, as a lookup at the border of
/// either reads only its own side. Conserves flux.
fn even_out(chart: &Chart, irradiance: &mut [[f32; 3]]) {
    for _ in 0..EXCHANGES {
        for joint in &chart.joints {
            let [a, b] = joint.texels;
            let [area_a, area_b] = joint.texels.map(|texel| chart.texel_area_m2(texel));
            let [here, there] = joint.texels.map(|texel| irradiance[texel].map(f64::from));
            let passed_w: [f64; 3] = std::array::from_fn(|channel| {
                0.5 * joint.share * (here[channel] - there[channel]) * area_a.min(area_b)
            });
            irradiance[a] =
                std::array::from_fn(|channel| (here[channel] - passed_w[channel] / area_a) as f32);
            irradiance[b] =
                std::array::from_fn(|channel| (there[channel] + passed_w[channel] / area_b) as f32);
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

/// The up to eight neighbours of a texel.
pub fn neighbours(texel: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (column, row) = (texel % width, texel / width);
    let rows = row.saturating_sub(1)..(row + 2).min(height);
    let columns = column.saturating_sub(1)..(column + 2).min(width);
    rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
        .filter(move |&neighbour| neighbour != texel)
}
