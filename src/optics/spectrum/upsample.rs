//! Upsamples a colour to a smooth spectrum of that colour.
//!
//! W. Jakob and J. Hanika, A Low-Dimensional Function Space for Efficient Spectral Upsampling (2019): a sigmoid of a
//! parabola in wavelength. Its three coefficients are solved for here, to rounding, by damped Gauss–Newton.

use std::sync::LazyLock;

use glam::{DMat3, DVec3};

use super::luminous::{points, visible_knots};
use super::{Spectrum, Xyz, illuminants, refused, xyz_bar};
use crate::error::Result;
use crate::optics::wavelength::VISIBLE;
use crate::optics::{LinearSrgb, Nanometres};

/// Residual of a channel at which the solver stops, relative to the brightest.
const TOLERANCE: f64 = 1e-12;
/// More than twice what any colour of the sRGB cube was seen to need.
const MAX_STEPS: usize = 600;
/// Above this, more damping does not help.
const MAX_DAMPING: f64 = 1e12;

/// A smooth factor on light: `scale` times a sigmoid of a parabola, 0 to `scale` at every wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothSpectrum {
    /// Coefficients of t², t and 1, where t runs from −1 at 360 nm to 1 at 830 nm. The last is ±∞ where the factor is
    /// `scale` or 0 throughout.
    pub coefficients: [f64; 3],
    /// Factor on the sigmoid, which is between 0 and 1 [1].
    pub scale: f64,
}

impl SmoothSpectrum {
    /// The factor with the given colour under D65, relative to a perfect white. Grey is flat. If no channel is above 1,
    /// neither is the factor at any wavelength.
    ///
    /// # Errors
    /// A channel that is negative or not finite.
    pub fn from_colour(colour: LinearSrgb) -> Result<Self> {
        check(colour)?;
        let most = colour.max_channel();
        // Dark colours are scaled up: near the foot of the sigmoid the equations are ill-conditioned.
        let scale = if most > 1.0 || most == 0.0 {
            most
        } else {
            (2.0 * most).min(1.0)
        };
        let relative = if most > 0.0 { colour / scale } else { colour };
        let [r, g, b] = relative.to_array();
        let coefficients = if r == g && g == b {
            [0.0, 0.0, sigmoid_inverse(r)]
        } else {
            let weights = Weights::get();
            solve(
                &weights.of_curves,
                DVec3::from_array(relative.to_array()) * weights.white,
            )
        };
        Ok(Self { coefficients, scale })
    }

    /// The factor at a wavelength, 0 to [`scale`](Self::scale).
    pub fn at(&self, wavelength: Nanometres) -> f64 {
        let t = normalised(wavelength);
        let [a, b, c] = self.coefficients;
        self.scale * sigmoid(a * t * t + b * t + c)
    }
}

/// Light of a lamp that is given by colour instead of a spectrum: a [`SmoothSpectrum`] times D65, tabulated at every
/// visible nanometre.
#[derive(Clone, Debug, PartialEq)]
pub struct Emission {
    /// Factor on D65 of one luminous-equivalent watt at whole nanometres.
    pub factor: SmoothSpectrum,
    /// The light [unit of the colour's luminance, per nm].
    pub light: Spectrum,
}

impl Emission {
    /// Light with the XYZ of the colour, in the unit of its luminance, such as [W] or [W/m²].
    ///
    /// # Errors
    /// A channel that is negative or not finite.
    pub fn from_colour(colour: LinearSrgb) -> Result<Self> {
        check(colour)?;
        let scale = 2.0 * colour.max_channel();
        let coefficients = if scale > 0.0 {
            solve(
                &Weights::get().of_tables,
                DVec3::from_array((colour / scale).to_array()),
            )
        } else {
            [0.0, 0.0, f64::NEG_INFINITY]
        };
        let factor = SmoothSpectrum { coefficients, scale };
        let light =
            Spectrum::from_fn(|wavelength| factor.at(wavelength) * illuminants::d65().at(wavelength))?;
        Ok(Self { factor, light })
    }
}

fn check(colour: LinearSrgb) -> Result<()> {
    let LinearSrgb { r, g, b } = colour;
    let fault = if !colour.is_finite() {
        "is not finite"
    } else if r < 0.0 || g < 0.0 || b < 0.0 {
        "has a negative channel"
    } else {
        return Ok(());
    };
    let what = format!("the colour {r}, {g}, {b} {fault}");
    Err(refused(
        what,
        "give finite channels that no light could contradict",
    ))
}

/// −1 at the blue end of the visible range, 1 at the red end.
fn normalised(Nanometres(nm): Nanometres) -> f64 {
    let (first, last) = (VISIBLE.start().0, VISIBLE.end().0);
    (2.0 * nm - first - last) / (last - first)
}

/// From 0 at −∞ over ½ at 0 to 1 at ∞.
fn sigmoid(x: f64) -> f64 {
    if x.is_infinite() {
        return if x > 0.0 { 1.0 } else { 0.0 };
    }
    0.5 + 0.5 * x / (1.0 + x * x).sqrt()
}

fn sigmoid_inverse(value: f64) -> f64 {
    (value - 0.5) / (value * (1.0 - value)).sqrt()
}

/// Wavelengths, and what a factor of 1 at each contributes to linear sRGB under D65 of one luminous-equivalent watt.
type UpsamplingBasis = Vec<(Nanometres, DVec3)>;

struct Weights {
    /// For smooth factors: the quadrature points.
    of_curves: UpsamplingBasis,
    /// For light that is linear between whole nanometres: the whole nanometres.
    of_tables: UpsamplingBasis,
    /// Channels of D65 itself: white up to the last digits of the table.
    white: DVec3,
}

impl Weights {
    fn get() -> &'static Self {
        static WEIGHTS: LazyLock<Weights> = LazyLock::new(|| {
            let knots = visible_knots();
            let d65 = |wavelength| illuminants::d65().at(wavelength);
            let mut of_curves = UpsamplingBasis::new();
            let mut of_tables: UpsamplingBasis =
                knots.iter().map(|nm| (Nanometres(*nm), DVec3::ZERO)).collect();
            for (index, (wavelength, weight_nm)) in points(&knots).enumerate() {
                let colour = Xyz::from(xyz_bar(wavelength)).to_linear_srgb();
                let channels = DVec3::from_array(colour.to_array()) * weight_nm;
                of_curves.push((wavelength, channels * d65(wavelength)));
                // Two points per segment, each shared by the knots at its ends.
                let piece = index / 2;
                let along = wavelength.0 - knots[piece];
                of_tables[piece].1 += channels * (1.0 - along) * d65(Nanometres(knots[piece]));
                of_tables[piece + 1].1 += channels * along * d65(Nanometres(knots[piece + 1]));
            }
            let white = of_curves.iter().map(|(_, channels)| *channels).sum();
            Weights {
                of_curves,
                of_tables,
                white,
            }
        });
        &WEIGHTS
    }
}

/// Residual of the sigmoid's channels against those wanted, and its Jacobian with respect to the coefficients.
fn residual(places: &UpsamplingBasis, coefficients: DVec3, wanted: DVec3) -> (DVec3, DMat3) {
    let mut residual = -wanted;
    let mut jacobian = DMat3::ZERO;
    for (place, channels) in places {
        let t = normalised(*place);
        let x = coefficients.dot(DVec3::new(t * t, t, 1.0));
        residual += *channels * sigmoid(x);
        let slope = *channels * (0.5 * (1.0 + x * x).powf(-1.5));
        jacobian += DMat3::from_cols(slope * (t * t), slope * t, slope);
    }
    (residual, jacobian)
}

/// Coefficients of the sigmoid with the wanted channels under D65, by Levenberg–Marquardt from a flat grey of their
/// mean.
fn solve(places: &UpsamplingBasis, wanted: DVec3) -> [f64; 3] {
    let mean = wanted.element_sum() / 3.0;
    let mut coefficients = DVec3::new(0.0, 0.0, sigmoid_inverse(mean.clamp(TOLERANCE, 1.0 - TOLERANCE)));
    let (mut error, mut jacobian) = residual(places, coefficients, wanted);
    let mut damping = 1e-4;
    for _ in 0..MAX_STEPS {
        if error.abs().max_element() < TOLERANCE || damping > MAX_DAMPING {
            break;
        }
        let next = coefficients - damped_step(error, jacobian, damping);
        let (next_error, next_jacobian) = residual(places, next, wanted);
        if next_error.length_squared() < error.length_squared() {
            (coefficients, error, jacobian) = (next, next_error, next_jacobian);
            damping = (damping / 8.0).max(1e-15);
        } else {
            damping *= 4.0;
        }
    }
    coefficients.to_array()
}

/// Solves (JᵀJ + damping · its diagonal) δ = Jᵀ e, with the unknowns scaled so that the diagonal is 1.
fn damped_step(error: DVec3, jacobian: DMat3, damping: f64) -> DVec3 {
    let scales = DVec3::new(
        jacobian.x_axis.length(),
        jacobian.y_axis.length(),
        jacobian.z_axis.length(),
    )
    .recip();
    let scaled = DMat3::from_cols(
        jacobian.x_axis * scales.x,
        jacobian.y_axis * scales.y,
        jacobian.z_axis * scales.z,
    );
    let normal = scaled.transpose() * scaled + DMat3::from_diagonal(DVec3::splat(damping));
    normal.inverse() * (scaled.transpose() * error) * scales
}
