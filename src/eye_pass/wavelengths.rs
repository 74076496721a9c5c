//! The wavelengths at which chains are traced through dispersive glass, and the colour that each contributes.
//!
//! Radiance in linear sRGB stands for a spectrum: daylight (D65) times the reflectance that [`ColourBasis`] assigns to
//! the colour. The part of it at one wavelength is again a colour, so that each wavelength is a matrix on linear sRGB.
//! Over the whole spectrum, and over every set made here, these matrices add up to the identity: light that does not
//! disperse keeps its colour exactly.

use std::sync::LazyLock;

use glam::{DMat3, DVec3};

use crate::optics::spectrum::luminous::{integrate, visible_knots};
use crate::optics::spectrum::{WavelengthSampler, Xyz, illuminants, xyz_bar};
use crate::optics::wavelength::{D_LINE, VISIBLE};
use crate::optics::{ColourBasis, LinearSrgb, Nanometres};

/// Wavelengths per frame of an interactive view.
const WHILE_WALKING: u32 = 3;
/// Maximum number of wavelengths per frame of a view: three samples, and one that carries the remainder to white.
pub const MAX_PER_PICTURE: usize = WHILE_WALKING as usize + 1;
/// The golden ratio less one: the fractional parts of its multiples fill the unit interval evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A wavelength at which chains are traced, with the colour that it contributes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenWavelength {
    pub wavelength: Nanometres,
    /// Maps radiance in linear sRGB to the part of it at this wavelength.
    pub share: DMat3,
}

impl SeenWavelength {
    /// The part of a radiance at this wavelength, in the same unit. Channels may be negative: no display shows
    /// monochromatic light.
    pub fn of(&self, radiance: LinearSrgb) -> LinearSrgb {
        LinearSrgb::from((self.share * DVec3::from_array(radiance.to_array())).to_array())
    }
}

/// Wavelengths of one sample of a pixel: the medians of adjacent bands of equal importance to the eye, which cover the
/// visible range. `shift` [0, 1) moves all bands by this fraction of a band. Above 0, the first and last are cut, and
/// there is one more than `count` > 0.
pub fn bands(count: u32, shift: f64) -> Vec<SeenWavelength> {
    let inner = (0..=count).map(|index| (f64::from(index) + shift) / f64::from(count));
    let inner = inner.filter(|edge| (0.0..=1.0).contains(edge));
    let ends = (shift > 0.0).then_some([0.0, 1.0]).into_iter().flatten();
    let mut edges: Vec<f64> = inner.chain(ends).collect();
    edges.sort_by(f64::total_cmp);
    let spectrum = &*SPECTRUM;
    let band = |edges: &[f64]| SeenWavelength {
        wavelength: spectrum.importance.sample(0.5 * (edges[0] + edges[1])).0,
        share: spectrum.below_share(edges[1]) - spectrum.below_share(edges[0]),
    };
    edges.windows(2).map(band).collect()
}

/// The `shift` of [`bands`] for a sample of a pixel; 0 for the first.
pub fn shift_of_sample(index: u32) -> f64 {
    (GOLDEN * f64::from(index)).fract()
}

/// Wavelengths of one of the frames that are averaged for a view. The first frame has three bands, as it may be the
/// only one. Each later one has three samples with their own colours and, as these seldom add up to white, the
/// remainder at 587.56 nm. The remainders average to zero, so that the mean converges to the full spectrum.
pub fn of_picture(index: u32) -> Vec<SeenWavelength> {
    if index == 0 {
        return bands(WHILE_WALKING, 0.0);
    }
    let (spectrum, shift) = (&*SPECTRUM, shift_of_sample(index));
    let mut set: Vec<SeenWavelength> = (0..WHILE_WALKING)
        .map(|third| {
            let place = (f64::from(third) + shift) / f64::from(WHILE_WALKING);
            let (wavelength, density_per_nm) = spectrum.importance.sample(place);
            SeenWavelength {
                wavelength,
                share: spectrum.share_per_nm(wavelength) / (density_per_nm * f64::from(WHILE_WALKING)),
            }
        })
        .collect();
    set.push(SeenWavelength {
        wavelength: D_LINE,
        share: set.iter().fold(DMat3::IDENTITY, |left, seen| left - seen.share),
    });
    set
}

/// Sum of the matrices of all wavelengths below this one.
pub fn share_below(wavelength: Nanometres) -> DMat3 {
    SPECTRUM.below(wavelength)
}

static SPECTRUM: LazyLock<SeenSpectrum> = LazyLock::new(SeenSpectrum::new);

struct SeenSpectrum {
    /// Cumulative sums at each whole nanometre of the visible range, linear in between.
    below: Vec<DMat3>,
    /// Importance to the eye of each wavelength of daylight.
    importance: WavelengthSampler,
}

impl SeenSpectrum {
    fn new() -> Self {
        // What the eye sees of daylight, in linear sRGB: at each wavelength, and as the white of the whole spectrum.
        let knots = visible_knots();
        let daylight = illuminants::d65();
        let colour = |wavelength| {
            let xyz = Xyz::from(xyz_bar(wavelength)) * daylight.at(wavelength);
            DVec3::from_array(xyz.to_linear_srgb().to_array())
        };
        let white = DVec3::from_array(integrate(&knots, |wavelength| colour(wavelength).to_array()));

        // For each nanometre a matrix, whose columns are what the eye sees of each primary's spectrum there.
        let pieces: Vec<DMat3> = knots
            .windows(2)
            .map(|piece| {
                let columns = integrate(piece, |wavelength| {
                    let seen = colour(wavelength) / white;
                    let [r, g, b] = ColourBasis::at(wavelength).row().map(|part| seen * part);
                    DMat3::from_cols(r, g, b).to_cols_array()
                });
                DMat3::from_cols_array(&columns)
            })
            .collect();

        // The basis has the primaries' colours up to the rounding of its table, which this removes.
        let whole: DMat3 = pieces.iter().fold(DMat3::ZERO, |sum, piece| sum + *piece);
        let exact = whole.inverse();

        // The share of a band is a difference of these sums, so that adjacent bands neither overlap nor leave a gap.
        let mut below = vec![DMat3::ZERO];
        let mut sum = DMat3::ZERO;
        for piece in pieces {
            sum += piece * exact;
            below.push(sum);
        }
        Self {
            below,
            importance: WavelengthSampler::for_lamp(daylight).expect("daylight is seen"),
        }
    }

    fn below(&self, wavelength: Nanometres) -> DMat3 {
        let (piece, along) = self.piece(wavelength);
        self.below[piece] * (1.0 - along) + self.below[piece + 1] * along
    }

    /// Cumulative sum at the quantile `share` [0, 1] of importance; exactly zero and identity at the ends.
    fn below_share(&self, share: f64) -> DMat3 {
        if share <= 0.0 {
            DMat3::ZERO
        } else if share >= 1.0 {
            DMat3::IDENTITY
        } else {
            self.below(self.importance.sample(share).0)
        }
    }

    fn share_per_nm(&self, wavelength: Nanometres) -> DMat3 {
        let (piece, _) = self.piece(wavelength);
        self.below[piece + 1] - self.below[piece]
    }

    /// Index of the 1 nm interval that contains a wavelength, and the position within it [0, 1].
    fn piece(&self, wavelength: Nanometres) -> (usize, f64) {
        let place = (wavelength.0 - VISIBLE.start().0).clamp(0.0, (self.below.len() - 1) as f64);
        let piece = (place as usize).min(self.below.len() - 2);
        (piece, place - piece as f64)
    }
}
