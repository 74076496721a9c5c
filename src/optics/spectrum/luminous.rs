//! Importance sampling of wavelengths by their luminance.

use std::ops::RangeInclusive;
use std::sync::LazyLock;

use super::{Spectrum, xyz_bar};
use crate::error::Result;
use crate::optics::Nanometres;
use crate::optics::wavelength::VISIBLE;

/// Limits of the colours of the rainbow [nm]: violet, indigo, blue, green, yellow, orange, red. Those between the six
/// spectral colours are in common use (T. J. Bruno and P. D. N. Svoronos, CRC Handbook of Fundamental Spectroscopic
/// Correlation Charts, 2005); indigo is the half of their violet that adjoins blue.
const RAINBOW_NM: [f64; 8] = [360.0, 415.0, 450.0, 495.0, 570.0, 590.0, 620.0, 830.0];

/// Importance sampling of wavelengths: the pdf is proportional to Φ(λ) (x̄ + 2ȳ + z̄)/4, half luminous efficiency and
/// half the matching functions of red and blue, so that no colour is undersampled. Linear between the knots of both
/// tables.
#[derive(Clone, Debug, PartialEq)]
pub struct WavelengthSampler {
    knots_nm: Vec<f64>,
    density_per_nm: Vec<f64>,
    cumulative: Vec<f64>,
}

/// One of several wavelengths that together represent a spectrum.
#[derive(Clone, Debug, PartialEq)]
pub struct WavelengthBand {
    /// The wavelengths that it represents; bands of one set meet without gaps.
    pub range: RangeInclusive<Nanometres>,
    /// The wavelength traced: the median of the band's importance.
    pub place: Nanometres,
}

impl WavelengthSampler {
    /// By importance for the light of one lamp.
    ///
    /// # Errors
    /// A lamp without visible light.
    pub fn for_lamp(lamp: &Spectrum) -> Result<Self> {
        lamp.check_visible()?;
        let knots_nm = knots_within(lamp.range(), lamp.wavelengths_nm());
        let importance = |nm: &f64| {
            let [x, y, z] = xyz_bar(Nanometres(*nm));
            lamp.at(Nanometres(*nm)) * (x + 2.0 * y + z) / 4.0
        };
        let mut density_per_nm: Vec<f64> = knots_nm.iter().map(importance).collect();
        let mut cumulative = vec![0.0];
        let mut sum = 0.0;
        for i in 1..knots_nm.len() {
            sum += 0.5 * (density_per_nm[i - 1] + density_per_nm[i]) * (knots_nm[i] - knots_nm[i - 1]);
            cumulative.push(sum);
        }
        for value in density_per_nm.iter_mut().chain(&mut cumulative) {
            *value /= sum;
        }
        Ok(Self {
            knots_nm,
            density_per_nm,
            cumulative,
        })
    }

    /// By importance for light of equal energy at every wavelength.
    pub fn equal_energy() -> &'static Self {
        static EQUAL: LazyLock<WavelengthSampler> = LazyLock::new(|| {
            Spectrum::from_fn(|_| 1.0)
                .and_then(|lamp| WavelengthSampler::for_lamp(&lamp))
                .expect("equal energy is light")
        });
        &EQUAL
    }

    /// Wavelength at which the cdf of the importance is `u` [0, 1], and the pdf there [1/nm].
    pub fn sample(&self, u: f64) -> (Nanometres, f64) {
        let above = self.cumulative.partition_point(|share| *share <= u);
        let above = above.clamp(1, self.knots_nm.len() - 1);
        let width = self.knots_nm[above] - self.knots_nm[above - 1];
        let (from, to) = (self.density_per_nm[above - 1], self.density_per_nm[above]);
        // The root of from·s + (to − from) s²/(2 width) = rest, in the form without cancellation.
        let rest = u - self.cumulative[above - 1];
        let root = (from * from + 2.0 * (to - from) * rest / width).max(0.0).sqrt();
        let step = if rest > 0.0 {
            (2.0 * rest / (from + root)).min(width)
        } else {
            0.0
        };
        let density = from + (to - from) * step / width;
        (Nanometres(self.knots_nm[above - 1] + step), density)
    }

    /// Pdf of [`sample`](Self::sample) at a wavelength [1/nm]; 0 where the lamp has no light.
    pub fn density_per_nm(&self, wavelength: Nanometres) -> f64 {
        self.piece(wavelength).map_or(0.0, |(index, along)| {
            let (from, to) = (self.density_per_nm[index], self.density_per_nm[index + 1]);
            from + along * (to - from)
        })
    }

    /// Cdf of the importance at a wavelength [0, 1], the inverse of [`sample`](Self::sample).
    pub fn cumulative(&self, wavelength: Nanometres) -> f64 {
        match self.piece(wavelength) {
            Some((index, along)) => {
                let (from, to) = (self.density_per_nm[index], self.density_per_nm[index + 1]);
                let width = self.knots_nm[index + 1] - self.knots_nm[index];
                self.cumulative[index] + along * width * (from + 0.5 * along * (to - from))
            }
            None if wavelength.0 < self.knots_nm[0] => 0.0,
            None => 1.0,
        }
    }

    /// `count` bands of equal importance, in order of wavelength, that together cover all light of the lamp.
    pub fn bands(&self, count: usize) -> Vec<WavelengthBand> {
        let edge = |i: usize| i as f64 / count as f64;
        (0..count).map(|i| self.band([edge(i), edge(i + 1)])).collect()
    }

    /// Seven bands, one per colour of the rainbow, violet first. Colours in which the lamp has no light are left out.
    pub fn rainbow_seven(&self) -> Vec<WavelengthBand> {
        let shares = RAINBOW_NM.map(|nm| self.cumulative(Nanometres(nm)));
        let lit = shares.windows(2).filter(|edge| edge[0] < edge[1]);
        lit.map(|edge| self.band([edge[0], edge[1]])).collect()
    }

    fn band(&self, [from, to]: [f64; 2]) -> WavelengthBand {
        let [first, place, last] = [from, 0.5 * (from + to), to].map(|share| self.sample(share).0);
        WavelengthBand {
            range: first..=last,
            place,
        }
    }

    /// Index of the segment that contains a wavelength, and the position along it [0, 1].
    fn piece(&self, Nanometres(nm): Nanometres) -> Option<(usize, f64)> {
        let last = self.knots_nm.len() - 1;
        if !(self.knots_nm[0]..=self.knots_nm[last]).contains(&nm) {
            return None;
        }
        let index = self.knots_nm.partition_point(|knot| *knot <= nm).clamp(1, last) - 1;
        let (from, to) = (self.knots_nm[index], self.knots_nm[index + 1]);
        Some((index, (nm - from) / (to - from)))
    }
}

/// ∫ f dλ over segments between increasing knots [nm]; in the unit of `f` times nm.
pub fn integrate<const N: usize>(knots_nm: &[f64], f: impl Fn(Nanometres) -> [f64; N]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (wavelength, weight_nm) in points(knots_nm) {
        for (sum, value) in sum.iter_mut().zip(f(wavelength)) {
            *sum += weight_nm * value;
        }
    }
    sum
}

/// Quadrature points with their weights [nm]: two Gauss points per segment.
pub fn points(knots_nm: &[f64]) -> impl Iterator<Item = (Nanometres, f64)> + '_ {
    knots_nm.windows(2).flat_map(|piece| {
        let half = 0.5 * (piece[1] - piece[0]);
        let middle = 0.5 * (piece[1] + piece[0]);
        let offset = half / 3f64.sqrt();
        [middle - offset, middle + offset].map(|place| (Nanometres(place), half))
    })
}

/// Increasing knots within a range, without duplicates: its ends, the whole nanometres of the colour-matching
/// functions, and the knots of a table. Empty where the range is outside the visible one.
pub fn knots_within(range: RangeInclusive<Nanometres>, own_nm: &[f64]) -> Vec<f64> {
    let first = range.start().0.max(VISIBLE.start().0);
    let last = range.end().0.min(VISIBLE.end().0);
    if first >= last {
        return Vec::new();
    }
    let whole = (first.ceil() as u32..=last.floor() as u32).map(f64::from);
    let own = own_nm.iter().copied().filter(|nm| (first..=last).contains(nm));
    let mut knots: Vec<f64> = [first, last].into_iter().chain(whole).chain(own).collect();
    knots.sort_by(f64::total_cmp);
    knots.dedup();
    knots
}

/// Every visible whole nanometre.
pub fn visible_knots() -> Vec<f64> {
    knots_within(VISIBLE, &[])
}
