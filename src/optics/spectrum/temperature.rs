//! Black-body spectra, and correlated colour temperature.

use super::luminous::{integrate, visible_knots};
use super::{Xyz, xyz_bar};
use crate::optics::Nanometres;

/// hc/k [nm K], exact in the SI of 2019.
const SECOND_RADIATION_CONSTANT_NM_K: f64 = 1.438_776_877e7;
/// Colours farther than this from every black body have no correlated temperature (CIE 15:2018).
const MAX_DISTANCE_UV: f64 = 0.05;
/// Search range of the correlated temperature, as reciprocals [1/K].
const RECIPROCALS: [f64; 2] = [1.0 / 100_000.0, 1.0 / 500.0];
/// Steps of the coarse search, uniform in the reciprocal of temperature, by which colours move evenly.
const PLACES: u32 = 64;

/// Range of colour temperatures [K]: from a black body at the lower end to daylight at the upper one.
pub const CAMERA_KELVIN: [f64; 2] = [1000.0, 25_000.0];
/// Daylight from here on [K]: CIE defines none that is redder.
const DAYLIGHT_KELVIN: f64 = 4000.0;

/// Colour of light of a temperature [K], Y = 1: a phase of daylight by its correlated temperature from 4000 K on (CIE
/// 15:2018), a black body below that. 6504 K is D65.
pub fn white_of_kelvin(kelvin: f64) -> Xyz {
    if kelvin < DAYLIGHT_KELVIN {
        let body = black_body(kelvin);
        return body * (1.0 / body.y);
    }
    let [x, y] = daylight_chromaticity(kelvin);
    Xyz {
        x: x / y,
        y: 1.0,
        z: (1.0 - x - y) / y,
    }
}

/// x, y of daylight of 4000 to 25,000 K (CIE 15:2018).
fn daylight_chromaticity(kelvin: f64) -> [f64; 2] {
    let [a, b, c, d] = if kelvin <= 7000.0 {
        [-4.6070e9, 2.9678e6, 0.099_11e3, 0.244_063]
    } else {
        [-2.0064e9, 1.9018e6, 0.247_48e3, 0.237_040]
    };
    let x = ((a / kelvin + b) / kelvin + c) / kelvin + d;
    [x, (-3.000 * x + 2.870) * x - 0.275]
}

/// Spectral radiance of a black body, relative to 560 nm (Planck's law).
pub fn planck(wavelength: Nanometres, kelvin: f64) -> f64 {
    let exponent = |nm: f64| (SECOND_RADIATION_CONSTANT_NM_K / (nm * kelvin)).exp_m1();
    (560.0 / wavelength.0).powi(5) * exponent(560.0) / exponent(wavelength.0)
}

/// The black body nearest to a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorrelatedTemperature {
    /// [K].
    pub kelvin: f64,
    /// Distance of the colour from it in (u, v) of CIE 1960 [1].
    pub distance_uv: f64,
}

/// Correlated colour temperature by definition: the black body of 500 to 100,000 K nearest in (u, v) of CIE 1960.
/// `None` for a colour without chromaticity, farther than 0.05 from all of them, or nearest to an end of the range.
pub fn correlated_temperature(colour: Xyz) -> Option<CorrelatedTemperature> {
    let wanted = uv(colour)?;
    let distance = |reciprocal: f64| {
        let [u, v] = black_body_uv(1.0 / reciprocal);
        (u - wanted[0]).hypot(v - wanted[1])
    };
    let step = (RECIPROCALS[1] - RECIPROCALS[0]) / f64::from(PLACES);
    let places = (0..=PLACES).map(|i| RECIPROCALS[0] + step * f64::from(i));
    let (nearest, _) = places
        .map(|place| (place, distance(place)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let reciprocal = least_between(
        (nearest - step).max(0.5 * RECIPROCALS[0]),
        nearest + step,
        distance,
    );
    let distance_uv = distance(reciprocal);
    let is_inside = (RECIPROCALS[0]..=RECIPROCALS[1]).contains(&reciprocal);
    (is_inside && distance_uv <= MAX_DISTANCE_UV).then_some(CorrelatedTemperature {
        kelvin: 1.0 / reciprocal,
        distance_uv,
    })
}

fn black_body(kelvin: f64) -> Xyz {
    let colour = integrate(&visible_knots(), |wavelength| {
        xyz_bar(wavelength).map(|weight| weight * planck(wavelength, kelvin))
    });
    colour.into()
}

fn black_body_uv(kelvin: f64) -> [f64; 2] {
    uv(black_body(kelvin)).expect("a black body shines")
}

/// (u, v) of CIE 1960.
fn uv(Xyz { x, y, z }: Xyz) -> Option<[f64; 2]> {
    let sum = x + 15.0 * y + 3.0 * z;
    (sum > 0.0).then(|| [4.0 * x / sum, 6.0 * y / sum])
}

/// Minimum of a unimodal function, to 1e-9 of the interval (golden-section search).
fn least_between(mut from: f64, mut to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut left, mut right) = (to - golden * (to - from), from + golden * (to - from));
    let (mut at_left, mut at_right) = (f(left), f(right));
    for _ in 0..43 {
        if at_left <= at_right {
            (to, right, at_right) = (right, left, at_left);
            left = to - golden * (to - from);
            at_left = f(left);
        } else {
            (from, left, at_left) = (left, right, at_right);
            right = from + golden * (to - from);
            at_right = f(right);
        }
    }
    0.5 * (from + to)
}
