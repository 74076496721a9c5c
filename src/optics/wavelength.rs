//! The wavelength type, the visible range, and the spectral lines by which glasses are specified.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

/// A wavelength in vacuum [nm]. In air it differs by less than 0.03 %, which no table here resolves.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Nanometres(pub f64);

impl Nanometres {
    /// In [µm], the unit of dispersion formulas.
    pub fn micrometres(self) -> f64 {
        self.0 * 1e-3
    }
}

/// Range of the CIE 1931 observer: 360 to 830 nm (CIE 018:2019).
pub const VISIBLE: RangeInclusive<Nanometres> = Nanometres(360.0)..=Nanometres(830.0);

/// Helium d [nm]: the wavelength of `n_d`.
pub const D_LINE: Nanometres = Nanometres(587.56);
/// Hydrogen F [nm]: the blue end of the Abbe number.
pub const F_LINE: Nanometres = Nanometres(486.13);
/// Hydrogen C [nm]: the red end of the Abbe number.
pub const C_LINE: Nanometres = Nanometres(656.27);
