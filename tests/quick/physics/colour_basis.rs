//! What RGB factors are at a wavelength.

use nephroid::optics::spectrum::xyz::colour_under_d65;
use nephroid::optics::{ColourBasis, LinearSrgb, Nanometres};
use proptest::prelude::*;

/// A channel may be off by so much: what the table's digits leave, with room.
const TOLERANCE: f64 = 1e-9;

const PRIMARIES: [LinearSrgb; 3] = [
    LinearSrgb::new(1.0, 0.0, 0.0),
    LinearSrgb::new(0.0, 1.0, 0.0),
    LinearSrgb::new(0.0, 0.0, 1.0),
];

fn at(nm: f64) -> ColourBasis {
    ColourBasis::at(Nanometres(nm))
}

/// The visible by tenths of a nanometre.
fn visible() -> impl Iterator<Item = f64> {
    (3600..=8300).map(|tenth| f64::from(tenth) / 10.0)
}

fn round_trip(factor: LinearSrgb) -> f64 {
    let back = colour_under_d65(|wavelength| ColourBasis::at(wavelength).tone(factor).r);
    (back - factor).map(f64::abs).max_channel()
}

#[test]
fn parts_are_none_below_nothing_and_add_up_to_one() {
    // Beyond the visible, too.
    for nm in visible().chain([0.0, 300.0, 359.9, 830.1, 1000.0]) {
        let row = at(nm).row();
        assert!(row.iter().all(|part| (0.0..=1.0).contains(part)), "{nm}: {row:?}");
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{nm}: {row:?}");
    }
}

#[test]
fn primaries_come_back_under_d65() {
    for primary in PRIMARIES {
        let error = round_trip(primary);
        println!("{primary:?}: {error:.1e}");
        assert!(error < TOLERANCE, "{primary:?}: {error}");
    }
}

#[test]
fn every_factor_comes_back_under_d65() {
    let cases = proptest::test_runner::Config {
        cases: 512,
        ..support::law(4096)
    };
    proptest!(cases, |(r in 0.0..=1.0, g in 0.0..=1.0, b in 0.0..=1.0)| {
        let error = round_trip(LinearSrgb::new(r, g, b));
        prop_assert!(error < TOLERANCE, "{}, {}, {}: {}", r, g, b, error);
    });
}

#[test]
fn factors_stay_between_their_channels_and_grey_stays_grey() {
    proptest!(support::law(4096), |(nm in 360.0..830.0, r in 0.0..=1.0, g in 0.0..=1.0, b in 0.0..=1.0)| {
        let LinearSrgb { r: toned, g: same, b: again } = at(nm).tone(LinearSrgb::new(r, g, b));
        let [least, most] = [f64::min(r, g).min(b), f64::max(r, g).max(b)];
        prop_assert!((least - 1e-12..=most + 1e-12).contains(&toned));
        prop_assert!(toned == same && same == again);
        prop_assert_eq!(at(nm).tone(LinearSrgb::grey(r)), LinearSrgb::grey(r));
    });
}

#[test]
fn tones_are_linear() {
    let colour = || [0.0..=1.0, 0.0..=1.0, 0.0..=1.0].prop_map(LinearSrgb::from);
    proptest!(support::law(4096), |(nm in 360.0..830.0, a in colour(), b in colour(), share in 0.0..=1.0)| {
        let basis = at(nm);
        let mixed = basis.tone(a * share + b * (1.0 - share));
        let apart = basis.tone(a) * share + basis.tone(b) * (1.0 - share);
        prop_assert!((mixed - apart).map(f64::abs).max_channel() < 1e-14);
    });
    // Each primary's tone is its part.
    for nm in visible() {
        let toned = PRIMARIES.map(|primary| at(nm).tone(primary).r);
        assert_eq!(toned, at(nm).row(), "{nm}");
    }
}

#[test]
fn each_part_is_its_own_colour_and_smooth() {
    // Dominant wavelengths of the primaries (IEC 61966-2-1 with CIE 1931): 611 nm, 549 nm, 464 nm.
    for (channel, nm) in [(0, 611.0), (1, 549.0), (2, 464.0)] {
        assert!(at(nm).row()[channel] > 0.9, "{nm}: {:?}", at(nm).row());
    }
    // No jump: from nothing to all takes tens of nanometres.
    let parts: Vec<[f64; 3]> = visible().map(|nm| at(nm).row()).collect();
    for pair in parts.windows(2) {
        for (from, to) in pair[0].iter().zip(&pair[1]) {
            assert!((to - from).abs() < 0.1 / 30.0, "{from} to {to} within 0.1 nm");
        }
    }
}
