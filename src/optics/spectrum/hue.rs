//! The dominant wavelength of a colour.

use std::sync::LazyLock;

use super::{Xyz, xyz_bar};
use crate::optics::{LinearSrgb, Nanometres};

/// Range in which the chromaticities of single wavelengths move around white in one direction; outside it they hardly
/// move [nm].
const ENDS_NM: (u32, u32) = (390, 700);
/// Colours with a chromaticity closer to white than this look white [1].
const WHITISH: f64 = 0.01;

/// Hue of a colour as seen next to white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hue {
    /// White or grey.
    White,
    /// White mixed with light of one wavelength.
    Spectral(Nanometres),
    /// A mixture of both ends of the spectrum, which no single wavelength looks like.
    Purple,
}

/// Chromaticity of each wavelength, relative to that of D65.
static LOCUS: LazyLock<Vec<(f64, [f64; 2])>> = LazyLock::new(|| {
    let of = |nm: u32| {
        let nm = f64::from(nm);
        let place = from_white(Xyz::from(xyz_bar(Nanometres(nm))))?;
        Some((nm, place))
    };
    (ENDS_NM.0..=ENDS_NM.1).filter_map(of).collect()
});

/// Dominant wavelength of a colour against D65: where the line from white through its chromaticity meets the spectral
/// locus (CIE 15:2018, 10). `None` for black.
pub fn dominant(colour: LinearSrgb) -> Option<Hue> {
    let wanted = from_white(Xyz::from(colour)).filter(|_| colour.luminance() > 0.0)?;
    if wanted[0].hypot(wanted[1]) < WHITISH {
        return Some(Hue::White);
    }
    let crossed = LOCUS.windows(2).find_map(|pair| {
        let [(nm, a), (next_nm, b)] = [pair[0], pair[1]];
        let (side_a, side_b) = (cross(a, wanted), cross(b, wanted));
        let is_crossed = side_a * side_b <= 0.0 && side_a != side_b;
        let is_ahead = a[0] * wanted[0] + a[1] * wanted[1] > 0.0;
        (is_crossed && is_ahead).then(|| nm + (next_nm - nm) * side_a / (side_a - side_b))
    });
    Some(crossed.map_or(Hue::Purple, |nm| Hue::Spectral(Nanometres(nm))))
}

/// Chromaticity relative to white; `None` for black.
fn from_white(colour: Xyz) -> Option<[f64; 2]> {
    let [x, y] = colour.chromaticity()?;
    let [white_x, white_y] = Xyz::from(LinearSrgb::WHITE).chromaticity()?;
    Some([x - white_x, y - white_y])
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
