//! The CIE 1931 2° standard observer.

use std::sync::LazyLock;

use super::csv::columns;
use crate::optics::Nanometres;
use crate::optics::wavelength::VISIBLE;

/// x̄, ȳ, z̄ at each whole nanometre (CIE 018:2019; see assets/SOURCES.md).
static TABLE: LazyLock<Vec<[f64; 3]>> = LazyLock::new(|| {
    columns(include_str!("../../../assets/spectra/cie_1931_2deg.csv"))
        .map(|row| [row[1], row[2], row[3]])
        .collect()
});

/// Colour-matching functions x̄, ȳ, z̄ [1] of CIE 1931, linear between whole nanometres; 0 outside 360 to 830 nm.
/// ȳ is V(λ), the luminous efficiency that 683 lm/W goes with.
pub fn xyz_bar(wavelength: Nanometres) -> [f64; 3] {
    if !VISIBLE.contains(&wavelength) {
        return [0.0; 3];
    }
    let place = wavelength.0 - VISIBLE.start().0;
    let index = (place as usize).min(TABLE.len() - 2);
    let along = place - index as f64;
    let (below, above) = (TABLE[index], TABLE[index + 1]);
    std::array::from_fn(|i| below[i] + along * (above[i] - below[i]))
}
