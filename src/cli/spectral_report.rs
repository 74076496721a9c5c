//! What a scene says by wavelength, as `inspect` tells it: glasses, and spectra of lamps.

use nephroid::optics::Glass;
use nephroid::optics::spectrum::Spectrum;
use nephroid::optics::spectrum::temperature::correlated_temperature;
use nephroid::optics::wavelength::VISIBLE;
use serde::Serialize;

/// A glass, as `--json` prints it.
#[derive(Debug, Serialize)]
pub struct GlassReport {
    name: String,
    n_d: f64,
    /// `None` where there is no dispersion.
    abbe_number: Option<f64>,
    /// What its formula was fitted to; `None` where nobody said.
    range_nm: Option<[f64; 2]>,
    /// Whether that is all that the eye sees.
    covers_the_visible: bool,
}

/// The spectrum of a lamp, as `--json` prints it.
#[derive(Debug, Serialize)]
pub struct SpectrumReport {
    /// Of an illuminant or a file; `None` where it has none.
    name: Option<String>,
    /// Of the nearest black body; `None` where none is near.
    correlated_temperature_k: Option<f64>,
    /// Luminous flux by radiant flux between 360 and 830 nm.
    lumens_per_watt: f64,
    /// First and last wavelength of its table.
    range_nm: [f64; 2],
}

impl GlassReport {
    /// Of a material's glass.
    pub fn new(glass: &Glass) -> Self {
        let range = glass.range.as_ref();
        let abbe_number = glass.dispersion.abbe_number();
        Self {
            name: glass.name.clone(),
            n_d: glass.dispersion.n_d(),
            abbe_number: abbe_number.is_finite().then_some(abbe_number),
            range_nm: range.map(|range| [range.start().0, range.end().0]),
            covers_the_visible: glass.is_within(*VISIBLE.start()) && glass.is_within(*VISIBLE.end()),
        }
    }

    /// "N-SF11 (V_d 25.8, measured from 370 to 2500 nm)".
    pub fn line(&self) -> String {
        let mut notes = vec![match self.abbe_number {
            Some(abbe_number) => format!("V_d {abbe_number:.1}"),
            None => "no dispersion".into(),
        }];
        if let Some([first, last]) = self.range_nm.filter(|_| !self.covers_the_visible) {
            notes.push(format!("measured from {first:.0} to {last:.0} nm"));
        }
        format!("{} ({})", self.name, notes.join(", "))
    }
}

impl SpectrumReport {
    /// Of a lamp's spectrum.
    pub fn new(spectrum: &Spectrum) -> Self {
        let range = spectrum.range();
        Self {
            name: spectrum.name().map(str::to_owned),
            correlated_temperature_k: correlated_temperature(spectrum.xyz()).map(|nearest| nearest.kelvin),
            lumens_per_watt: spectrum.luminous_flux_lm() / spectrum.radiant(),
            range_nm: [range.start().0, range.end().0],
        }
    }

    /// "spectrum `D65` of 6504 K, 360 to 830 nm, 204 lm/W".
    pub fn line(&self) -> String {
        let name = (self.name.as_ref()).map_or_else(String::new, |name| format!(" `{name}`"));
        let colour = match self.correlated_temperature_k {
            Some(kelvin) => format!("of {kelvin:.0} K"),
            None => "far from any black body".into(),
        };
        let [first, last] = self.range_nm;
        format!(
            "spectrum{name} {colour}, {first:.0} to {last:.0} nm, {:.0} lm/W",
            self.lumens_per_watt
        )
    }
}
