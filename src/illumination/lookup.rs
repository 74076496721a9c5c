//! Reads a map between its texels.

use glam::DVec2;

use crate::optics::LinearSrgb;

/// Bilinear look-up between texel centres of `width × height` values; beyond the outermost centres the border goes
/// on. Texel (i, j) has its centre at u = (i + ½)/width, v = (j + ½)/height.
pub fn bilinear(values: &[[f32; 3]], width: usize, height: usize, uv: DVec2) -> LinearSrgb {
    let (left, right, across) = between_centres(uv.x, width);
    let (top, bottom, down) = between_centres(uv.y, height);
    let texel = |column: usize, row: usize| LinearSrgb::from(values[row * width + column].map(f64::from));
    let row = |row: usize| texel(left, row) * (1.0 - across) + texel(right, row) * across;
    row(top) * (1.0 - down) + row(bottom) * down
}

/// The two texels of a line of `size` whose centres enclose a coordinate in [0, 1], and how far between them it lies.
fn between_centres(coordinate: f64, size: usize) -> (usize, usize, f64) {
    let last = (size - 1) as f64;
    let position = (coordinate * size as f64 - 0.5).clamp(0.0, last);
    let low = position.floor();
    (low as usize, (low as usize + 1).min(size - 1), position - low)
}
