//! The one rule by which every integral over wavelength is taken.
//!
//! Two Gauss–Legendre points on each piece between knots. That is exact for cubics, so for a lamp's table times a
//! reflectance's table times a colour-matching function, each linear on the piece; and as it never looks at a knot
//! itself, a table that ends abruptly is no special case.

use std::ops::RangeInclusive;

use crate::optics::Nanometres;
use crate::optics::wavelength::VISIBLE;

/// ∫ f dλ over pieces between increasing knots [nm]; in the unit of `f` times nm.
pub fn integrate<const N: usize>(knots_nm: &[f64], f: impl Fn(Nanometres) -> [f64; N]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (wavelength, weight_nm) in points(knots_nm) {
        for (sum, value) in sum.iter_mut().zip(f(wavelength)) {
            *sum += weight_nm * value;
        }
    }
    sum
}

/// Where the rule looks, with the weight of each place [nm].
pub fn points(knots_nm: &[f64]) -> impl Iterator<Item = (Nanometres, f64)> + '_ {
    knots_nm.windows(2).flat_map(|piece| {
        let half = 0.5 * (piece[1] - piece[0]);
        let middle = 0.5 * (piece[1] + piece[0]);
        let offset = half / 3f64.sqrt();
        [middle - offset, middle + offset].map(|place| (Nanometres(place), half))
    })
}

/// The knots of the colour-matching functions, every whole nanometre, within a range and with its ends, and those of
/// a table as well; increasing, each once. Empty where the range lies outside of the visible.
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

/// Every whole nanometre that is visible.
pub fn visible_knots() -> Vec<f64> {
    knots_within(VISIBLE, &[])
}
