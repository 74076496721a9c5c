//! The wavelengths at which chains are traced through dispersive glass, and the colour that each contributes.
//!
//! Radiance in linear sRGB stands for a spectrum: daylight (D65) times what the colour is of each wavelength
//! ([`ColourBasis`]). What the eye sees of that at one wavelength is again a colour, so that a wavelength is a matrix on
//! linear sRGB. Over all wavelengths, and over those of every set made here, the matrices add up to the identity: what
//! is not parted keeps its colour exactly.

use std::sync::LazyLock;

use glam::{DMat3, DVec3};

use crate::optics::spectrum::luminous::{integrate, visible_knots};
use crate::optics::spectrum::{WavelengthSampler, Xyz, illuminants, xyz_bar};
use crate::optics::wavelength::{D_LINE, VISIBLE};
use crate::optics::{ColourBasis, LinearSrgb, Nanometres};

/// Wavelengths of a picture that is seen for a moment only.
const WHILE_WALKING: u32 = 3;
/// Most wavelengths of one of many pictures of a view: three, and the one that carries what they lack.
pub const MAX_PER_PICTURE: usize = WHILE_WALKING as usize + 1;
/// Fraction of the golden ratio: multiples of it fill the unit interval evenly, however many there are.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A wavelength that light is followed at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenWavelength {
    /// Which.
    pub wavelength: Nanometres,
    /// From radiance in linear sRGB to what is seen of it at this wavelength.
    pub share: DMat3,
}

impl SeenWavelength {
    /// What is seen of a radiance, in its unit; channels may be negative, as no display shows one wavelength.
    pub fn of(&self, radiance: LinearSrgb) -> LinearSrgb {
        LinearSrgb::from((self.share * DVec3::from_array(radiance.to_array())).to_array())
    }
}

/// A set for one sample of a pixel: bands of equal importance to the eye that meet without gap, each followed at its
/// median. `shift` [0, 1) moves all of them by this part of a band; above 0 the first and last are cut, and there is
/// one more than `count` > 0.
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

/// The shift of [`bands`] of one of many samples; 0 for the first.
pub fn shift_of_sample(index: u32) -> f64 {
    (GOLDEN * f64::from(index)).fract()
}

/// The set of one of many pictures of a view: three bands for the first, as it may be the only one; for each later
/// one three other wavelengths with their own colours and, as three colours seldom add up to white, what is left at
/// 587.56 nm. That adds up to nothing over many pictures, whose mean approaches all wavelengths.
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

/// What is seen at all wavelengths below one.
pub fn share_below(wavelength: Nanometres) -> DMat3 {
    SPECTRUM.below(wavelength)
}

static SPECTRUM: LazyLock<SeenSpectrum> = LazyLock::new(SeenSpectrum::new);

/// The matrices of all wavelengths.
struct SeenSpectrum {
    /// Sums below each whole nanometre of the visible, between which they are linear.
    below: Vec<DMat3>,
    /// How much daylight of each wavelength matters to the eye.
    importance: WavelengthSampler,
}

impl SeenSpectrum {
    fn new() -> Self {
        let knots = visible_knots();
        let daylight = illuminants::d65();
        let colour = |wavelength| {
            let xyz = Xyz::from(xyz_bar(wavelength)) * daylight.at(wavelength);
            DVec3::from_array(xyz.to_linear_srgb().to_array())
        };
        let white = DVec3::from_array(integrate(&knots, |wavelength| colour(wavelength).to_array()));
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
        // The basis has the primaries' colours but for the rounding of its table; what is left is taken out here.
        let whole: DMat3 = pieces.iter().fold(DMat3::ZERO, |sum, piece| sum + *piece);
        let exact = whole.inverse();
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

    /// Below a wavelength.
    fn below(&self, wavelength: Nanometres) -> DMat3 {
        let (piece, along) = self.piece(wavelength);
        self.below[piece] * (1.0 - along) + self.below[piece + 1] * along
    }

    /// Below the wavelength under which a share [0, 1] of importance lies; nothing and all at the ends.
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

    /// The nanometre that a wavelength lies in, and how far along it [0, 1].
    fn piece(&self, wavelength: Nanometres) -> (usize, f64) {
        let place = (wavelength.0 - VISIBLE.start().0).clamp(0.0, (self.below.len() - 1) as f64);
        let piece = (place as usize).min(self.below.len() - 2);
        (piece, place - piece as f64)
    }
}
