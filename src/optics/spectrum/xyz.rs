//! CIE 1931 XYZ, to and from linear sRGB.

use std::sync::LazyLock;

use super::csv::columns;
use super::illuminants;
use super::luminous::{integrate, visible_knots};
use crate::optics::wavelength::VISIBLE;
use crate::optics::{LinearSrgb, Nanometres};

/// Row-major.
pub type Matrix3 = [[f64; 3]; 3];

/// Leaves every colour unchanged.
pub const IDENTITY: Matrix3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Linear sRGB to XYZ, Y = 1 for white (IEC 61966-2-1, to double precision from its primaries and D65 at (0.3127,
/// 0.3290)). The second row is [`LinearSrgb::luminance`].
const XYZ_FROM_SRGB: Matrix3 = [
    [
        0.412_390_799_265_959_5,
        0.357_584_339_383_878,
        0.180_480_788_401_834_3,
    ],
    [
        0.212_639_005_871_510_36,
        0.715_168_678_767_755_9,
        0.072_192_315_360_733_71,
    ],
    [
        0.019_330_818_715_591_85,
        0.119_194_779_794_625_99,
        0.950_532_152_249_660_6,
    ],
];

/// The inverse of [`XYZ_FROM_SRGB`].
const SRGB_FROM_XYZ: Matrix3 = [
    [
        3.240_969_941_904_521,
        -1.537_383_177_570_093,
        -0.498_610_760_293_003_3,
    ],
    [
        -0.969_243_636_280_879_8,
        1.875_967_501_507_720_6,
        0.041_555_057_407_175_61,
    ],
    [
        0.055_630_079_696_993_61,
        -0.203_976_958_888_976_57,
        1.056_971_514_242_878_6,
    ],
];

/// XYZ to the cone-like responses of the Bradford adaptation (linear, as in ICC.1:2010, annex E).
const BRADFORD_FROM_XYZ: Matrix3 = [
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
];

/// A colour of light as CIE 1931 tristimulus values without the factor 683: Y is the luminous-equivalent value of the
/// quantity [W, W/m², …] of the spectrum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Xyz {
    /// ∫ Φ x̄ dλ.
    pub x: f64,
    /// ∫ Φ ȳ dλ.
    pub y: f64,
    /// ∫ Φ z̄ dλ.
    pub z: f64,
}

impl Xyz {
    /// Linear sRGB of the same luminance; out-of-gamut colours keep their negative channels.
    pub fn to_linear_srgb(self) -> LinearSrgb {
        LinearSrgb::from(times(&SRGB_FROM_XYZ, self.into()))
    }

    /// Chromaticity x, y; `None` where X + Y + Z is not positive, as for black.
    pub fn chromaticity(self) -> Option<[f64; 2]> {
        let sum = self.x + self.y + self.z;
        (sum > 0.0).then(|| [self.x / sum, self.y / sum])
    }
}

impl From<LinearSrgb> for Xyz {
    fn from(colour: LinearSrgb) -> Self {
        times(&XYZ_FROM_SRGB, colour.to_array()).into()
    }
}

impl From<[f64; 3]> for Xyz {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

impl From<Xyz> for [f64; 3] {
    fn from(Xyz { x, y, z }: Xyz) -> Self {
        [x, y, z]
    }
}

impl std::ops::Add for Xyz {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        [self.x + other.x, self.y + other.y, self.z + other.z].into()
    }
}

impl std::ops::Mul<f64> for Xyz {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        [self.x * factor, self.y * factor, self.z * factor].into()
    }
}

/// Colour of a reflectance or transmittance [1] by wavelength under D65, relative to the factor 1, which is exactly
/// white.
pub fn colour_under_d65(factor: impl Fn(Nanometres) -> f64) -> LinearSrgb {
    let lamp = illuminants::d65();
    let [x, y, z, white_x, white_y, white_z] = integrate(&visible_knots(), |wavelength| {
        let [x, y, z] = xyz_bar(wavelength).map(|weight| weight * lamp.at(wavelength));
        let factor = factor(wavelength);
        [x * factor, y * factor, z * factor, x, y, z]
    });
    let colour = Xyz { x, y, z }.to_linear_srgb();
    let white = Xyz {
        x: white_x,
        y: white_y,
        z: white_z,
    }
    .to_linear_srgb();
    LinearSrgb::new(colour.r / white.r, colour.g / white.g, colour.b / white.b)
}

/// Matrix on linear sRGB that makes light of the colour `white` white at the same luminance (Bradford); the identity
/// for D65. `None` where a cone response of `white` is not positive.
pub fn white_balance(white: Xyz) -> Option<Matrix3> {
    let target = Xyz::from(LinearSrgb::WHITE);
    let from = times(&BRADFORD_FROM_XYZ, (white * (1.0 / white.y)).into());
    let to = times(&BRADFORD_FROM_XYZ, target.into());
    if !from
        .iter()
        .all(|response| response.is_finite() && *response > 0.0)
    {
        return None;
    }
    let gains: Matrix3 =
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { to[i] / from[i] } else { 0.0 }));
    let chain = [
        &SRGB_FROM_XYZ,
        &inverse(&BRADFORD_FROM_XYZ),
        &gains,
        &BRADFORD_FROM_XYZ,
        &XYZ_FROM_SRGB,
    ];
    chain.into_iter().copied().reduce(|a, b| product(&a, &b))
}

pub fn transformed(matrix: &Matrix3, colour: LinearSrgb) -> LinearSrgb {
    times(matrix, colour.to_array()).into()
}

/// The nearest displayable colour: one outside the gamut is mixed with the grey of its luminance until no channel is
/// negative, one inside is unchanged. Light without luminance becomes black. For display only.
pub fn to_display_gamut(colour: LinearSrgb) -> LinearSrgb {
    let least = colour.r.min(colour.g).min(colour.b);
    if least >= 0.0 {
        return colour;
    }
    let luminance = colour.luminance();
    if luminance <= 0.0 {
        return LinearSrgb::BLACK;
    }
    let kept = luminance / (luminance - least);
    // The least channel is 0 except for rounding, which must not make it negative.
    colour.map(|channel| (luminance + kept * (channel - luminance)).max(0.0))
}

fn times(matrix: &Matrix3, vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2])
}

fn product(a: &Matrix3, b: &Matrix3) -> Matrix3 {
    a.map(|row| std::array::from_fn(|j| row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]))
}

fn inverse(matrix: &Matrix3) -> Matrix3 {
    // glam stores columns: a matrix from rows is the transpose, and so is its inverse.
    glam::DMat3::from_cols_array_2d(matrix)
        .inverse()
        .to_cols_array_2d()
}

/// x̄, ȳ, z̄ at each whole nanometre (CIE 018:2019; see assets/SOURCES.md).
static TABLE: LazyLock<Vec<[f64; 3]>> = LazyLock::new(|| {
    columns(include_str!("../../../assets/spectra/cie_1931_2deg.csv"))
        .map(|row| [row[1], row[2], row[3]])
        .collect()
});

/// Colour-matching functions x̄, ȳ, z̄ [1] of CIE 1931, linear between whole nanometres; 0 outside 360 to 830 nm. ȳ is
/// V(λ), the luminous efficiency to which 683 lm/W applies.
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
