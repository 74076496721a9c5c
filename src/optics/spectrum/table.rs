//! A tabulated spectrum, linear between its rows.

use std::ops::RangeInclusive;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::luminous::{integrate, knots_within};
use super::{Xyz, refused, xyz_bar};
use crate::error::{Error, Result};
use crate::optics::Nanometres;
use crate::optics::wavelength::VISIBLE;
use crate::units::LUMENS_PER_WATT;

/// Light, or a factor on light, by wavelength: linear between rows, and zero outside of them.
///
/// The values of light are in W/nm (or per m², per sr) unless stated to be relative; a factor has no unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Rows", into = "Rows")]
pub struct Spectrum {
    name: Option<Arc<str>>,
    wavelengths_nm: Vec<f64>,
    values: Vec<f64>,
}

/// Serialised form of a spectrum.
#[derive(Serialize, Deserialize)]
struct Rows {
    name: Option<String>,
    rows: Vec<(Nanometres, f64)>,
}

impl TryFrom<Rows> for Spectrum {
    type Error = Error;

    fn try_from(rows: Rows) -> Result<Self> {
        let spectrum = Self::new(rows.rows)?;
        Ok(match rows.name {
            Some(name) => spectrum.named(&name),
            None => spectrum,
        })
    }
}

impl From<Spectrum> for Rows {
    fn from(spectrum: Spectrum) -> Self {
        let wavelengths = spectrum.wavelengths_nm.into_iter().map(Nanometres);
        Self {
            name: spectrum.name.map(|name| name.to_string()),
            rows: wavelengths.zip(spectrum.values).collect(),
        }
    }
}

impl Spectrum {
    /// From rows of wavelength and value.
    ///
    /// # Errors
    /// Fewer than two rows, wavelengths that do not increase, or a number that is not finite or negative. The line in
    /// the error is the row, counted from 1.
    pub fn new(rows: Vec<(Nanometres, f64)>) -> Result<Self> {
        Self::of_lines(rows, |row| row + 1)
    }

    /// [`Self::new`] for rows of a file, by the line of each for errors.
    pub(super) fn of_lines(rows: Vec<(Nanometres, f64)>, line: impl Fn(usize) -> usize) -> Result<Self> {
        // A table is linear between rows, which takes two of them.
        if rows.len() < 2 {
            let what = format!(
                "a spectrum of {} rows says nothing between wavelengths",
                rows.len()
            );
            return Err(refused(what, "give two rows or more"));
        }

        // Integrals and look-ups rely on rising wavelengths and on finite values that are not negative.
        let mut before = f64::NEG_INFINITY;
        for (row, &(Nanometres(nm), value)) in rows.iter().enumerate() {
            let wrong = |what: String, remedy| Err(refused(format!("line {}: {what}", line(row)), remedy));
            if let Some(number) = [nm, value].into_iter().find(|x| !(x.is_finite() && *x >= 0.0)) {
                let fault = if number.is_finite() {
                    "negative"
                } else {
                    "not a finite number"
                };
                return wrong(format!("{number} is {fault}"), "give a finite value of 0 or more");
            }
            if nm <= before {
                let remedy = "sort the rows by wavelength and name each once";
                return wrong(format!("{nm} nm does not come after {before} nm"), remedy);
            }
            before = nm;
        }

        // Look-ups search the wavelengths alone, so that values are stored apart from them.
        let (wavelengths_nm, values) = rows
            .into_iter()
            .map(|(Nanometres(nm), value)| (nm, value))
            .unzip();
        Ok(Self {
            name: None,
            wavelengths_nm,
            values,
        })
    }

    /// With a name: of an illuminant, or of the file that it was read from.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Self {
            name: Some(name.into()),
            ..self
        }
    }

    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Tabulates a finite, non-negative function of wavelength at every visible whole nanometre.
    ///
    /// # Errors
    /// A value that is negative or not finite.
    pub fn from_fn(f: impl Fn(Nanometres) -> f64) -> Result<Self> {
        let knots = knots_within(VISIBLE, &[]);
        Self::new(
            knots
                .into_iter()
                .map(|nm| (Nanometres(nm), f(Nanometres(nm))))
                .collect(),
        )
    }

    /// First and last wavelength of the table.
    pub fn range(&self) -> RangeInclusive<Nanometres> {
        let [first, last] = [0, self.wavelengths_nm.len() - 1].map(|i| Nanometres(self.wavelengths_nm[i]));
        first..=last
    }

    /// Wavelengths of the rows [nm], increasing.
    pub fn wavelengths_nm(&self) -> &[f64] {
        &self.wavelengths_nm
    }

    /// The value at a wavelength: linear between rows, 0 outside of the table.
    pub fn at(&self, wavelength: Nanometres) -> f64 {
        if !self.range().contains(&wavelength) {
            return 0.0;
        }
        let above = self.wavelengths_nm.partition_point(|nm| *nm <= wavelength.0);
        let above = above.clamp(1, self.values.len() - 1);
        let (from, to) = (self.wavelengths_nm[above - 1], self.wavelengths_nm[above]);
        let along = (wavelength.0 - from) / (to - from);
        self.values[above - 1] + along * (self.values[above] - self.values[above - 1])
    }

    /// ∫ Φ(λ) w(λ) dλ over the visible part of a range, at the quadrature [`points`](super::luminous::points): exact
    /// where `weight` is linear or quadratic between whole nanometres.
    pub fn integral_times<const N: usize>(
        &self,
        range: RangeInclusive<Nanometres>,
        weight: impl Fn(Nanometres) -> [f64; N],
    ) -> [f64; N] {
        let [first, last] = [
            range.start().0.max(self.range().start().0),
            range.end().0.min(self.range().end().0),
        ];
        let knots = knots_within(Nanometres(first)..=Nanometres(last), &self.wavelengths_nm);
        integrate(&knots, |wavelength| {
            let value = self.at(wavelength);
            weight(wavelength).map(|weight| weight * value)
        })
    }

    /// Radiant flux between 360 and 830 nm, ∫ Φ dλ [W, where values are W/nm].
    pub fn radiant(&self) -> f64 {
        self.integral_times(VISIBLE, |_| [1.0])[0]
    }

    /// Luminous flux 683 ∫ Φ ȳ dλ [lm, where values are W/nm].
    pub fn luminous_flux_lm(&self) -> f64 {
        LUMENS_PER_WATT * self.xyz().y
    }

    /// ∫ Φ (x̄, ȳ, z̄) dλ, without the 683: Y is in luminous-equivalent watts.
    pub fn xyz(&self) -> Xyz {
        self.xyz_within(VISIBLE)
    }

    /// Contribution of a range of wavelengths to [`xyz`](Self::xyz). Adjacent ranges add up to the whole.
    pub fn xyz_within(&self, range: RangeInclusive<Nanometres>) -> Xyz {
        Xyz::from(self.integral_times(range, xyz_bar))
    }

    /// Every value times a factor, finite and 0 or more; keeps the name.
    ///
    /// # Errors
    /// A product that is negative or not finite.
    pub fn scaled(&self, factor: f64) -> Result<Self> {
        let rows = self.wavelengths_nm.iter().zip(&self.values);
        let scaled = Self::new(
            rows.map(|(nm, value)| (Nanometres(*nm), value * factor))
                .collect(),
        )?;
        Ok(Self {
            name: self.name.clone(),
            ..scaled
        })
    }

    /// The same light, scaled to a flux in luminous-equivalent watts: ∫ Φ ȳ dλ = `watts`, 683 times that in lm.
    ///
    /// # Errors
    /// No visible light; a negative or non-finite `watts`.
    pub fn to_luminous_equivalent(&self, watts: f64) -> Result<Self> {
        self.check_visible()?;
        let luminous = self.xyz().y;
        if luminous.is_normal() {
            return self.scaled(watts / luminous);
        }
        // Values near the limits of floating point: normalised by the largest they can be summed.
        let largest = self.values.iter().copied().fold(0.0, f64::max);
        let rows = self.wavelengths_nm.iter().zip(&self.values);
        let shares = Self::new(
            rows.map(|(nm, value)| (Nanometres(*nm), value / largest))
                .collect(),
        )?;
        shares.scaled(watts / shares.xyz().y)
    }

    /// Checks that the spectrum has visible light.
    ///
    /// # Errors
    /// It has none, by its wavelengths or by its values.
    pub fn check_visible(&self) -> Result<()> {
        let (Nanometres(first), Nanometres(last)) = self.range().into_inner();
        if last <= VISIBLE.start().0 || first >= VISIBLE.end().0 {
            let what =
                format!("its wavelengths {first} to {last} nm lie outside of the visible 360 to 830 nm");
            return Err(refused(what, "give wavelengths in nanometres, 360 to 830"));
        }
        if self.xyz().y > 0.0 {
            return Ok(());
        }
        let remedy = "give at least one visible wavelength a value above 0";
        Err(refused("it has no light between 360 and 830 nm", remedy))
    }
}
