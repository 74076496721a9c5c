//! Estimates the error of texels that are larger than requested: the variation within a texel, extrapolated from that
//! between texels.

use std::ops::Range;

use super::Chart;

/// Least and most of the ratio of the variance within a texel to that between it and the three others of its 2 × 2
/// block: a quarter on a slope, a half at a border between light and shadow, and all of it at a fold or a focus, where
/// the irradiance has a pole.
const PER_LEVEL: (f64, f64) = (0.25, 1.0);

/// The ratio of a map too small to tell.
const USUAL_PER_LEVEL: f64 = 0.5;

/// Variance within each texel [square of the values' unit] that a map of finer texels would resolve. `halved` is how
/// many times texels should be halved in length to be fine enough; tiled charts know this for each tile. Zero if texels
/// are fine enough.
pub fn variance_within(chart: &Chart, values: &[f64], halved: u32) -> Vec<f64> {
    // A dense map is equally too coarse throughout; each tile of a tiled one knows how much it lost.
    let parts: Vec<Part> = match &chart.layout {
        None => vec![Part {
            texels: 0..values.len(),
            size: (chart.width, chart.height),
            lost: halved,
        }],
        Some(layout) => layout
            .tiles()
            .map(|tile| Part {
                texels: tile.texels,
                size: tile.size,
                lost: u32::from(tile.lost),
            })
            .collect(),
    };
    let covers = |texel: usize| chart.layout.is_some() || chart.texel_area_m2(texel) > 0.0;

    // The ratio is that between blocks of four texels and blocks of four such blocks, over all of the map that is too
    // coarse.
    let mut coarse = Vec::new();
    let (mut between, mut between_blocks) = (0.0, 0.0);
    for part in parts.into_iter().filter(|part| part.lost > 0) {
        let texels = part.texels.clone();
        let covered = texels
            .map(|texel| covers(texel).then_some(values[texel]))
            .collect();
        let blocks = Grid {
            values: covered,
            size: part.size,
        }
        .blocks();
        between += blocks.variances.iter().sum::<f64>();
        between_blocks += 4.0 * blocks.means.blocks().variances.iter().sum::<f64>();
        coarse.push((part, blocks));
    }
    let per_level = if between_blocks > 0.0 {
        (between / between_blocks).clamp(PER_LEVEL.0, PER_LEVEL.1)
    } else {
        USUAL_PER_LEVEL
    };

    // Each missing halving would resolve a fixed part of the variance of the one before: a geometric series.
    let mut variances = vec![0.0; values.len()];
    for (part, blocks) in coarse {
        let missing: f64 = (1..=part.lost.min(64) as i32)
            .map(|level| per_level.powi(level))
            .sum();
        let (columns, first) = (part.size.0, part.texels.start);
        for texel in part.texels.filter(|&texel| covers(texel)) {
            let (column, row) = ((texel - first) % columns, (texel - first) / columns);
            let block = row / 2 * blocks.means.size.0 + column / 2;
            variances[texel] = blocks.variances[block] * missing;
        }
    }
    variances
}

/// A map, or a tile of one.
struct Part {
    texels: Range<usize>,
    /// Columns and rows.
    size: (usize, usize),
    /// How many times its texels should be halved.
    lost: u32,
}

/// Values row by row; `None` where nothing is covered.
struct Grid {
    values: Vec<Option<f64>>,
    size: (usize, usize),
}

/// Blocks of 2 × 2 values.
struct Blocks {
    means: Grid,
    variances: Vec<f64>,
}

impl Grid {
    fn blocks(&self) -> Blocks {
        let (columns, rows) = self.size;
        let size = (columns.div_ceil(2), rows.div_ceil(2));
        let mut blocks = Blocks {
            means: Grid {
                values: Vec::with_capacity(size.0 * size.1),
                size,
            },
            variances: Vec::with_capacity(size.0 * size.1),
        };
        for (top, left) in (0..size.1).flat_map(|row| (0..size.0).map(move |column| (2 * row, 2 * column))) {
            let mut values = Vec::with_capacity(4);
            for row in top..(top + 2).min(rows) {
                let line = &self.values[row * columns..][left..(left + 2).min(columns)];
                values.extend(line.iter().flatten());
            }
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
            blocks.means.values.push((count > 0.0).then_some(mean));
            blocks
                .variances
                .push(if count > 0.0 { squares / count } else { 0.0 });
        }
        blocks
    }
}
