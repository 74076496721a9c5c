//! Linear light, its luminance and display encoding, what RGB factors are at a wavelength, and false colours.

use nephroid::illumination::false_colours::{ColourScale, viridis};
use nephroid::optics::ColourBasis;
use nephroid::optics::spectrum::xyz::colour_under_d65;

use super::primaries;
use crate::prelude::*;

/// Every 8-bit code survives the way to linear light and back.
#[test]
fn srgb_codes_round_trip() {
    let mut previous = -1.0;
    for code in 0..=255u8 {
        let linear = LinearSrgb::decode_channel(code);
        assert!(linear > previous, "code {code} is not above its predecessor");
        previous = linear;
        near(
            LinearSrgb::encode_channel(linear) * 255.0,
            f64::from(code),
            1e-3,
            code,
        );
    }
    assert_eq!([0, 255].map(LinearSrgb::decode_channel), [0.0, 1.0]);
    // Middle grey: the textbook value of ((0.5 + 0.055)/1.055)^2.4.
    near(
        LinearSrgb::encode_channel(0.214_041_140_482_232_55),
        0.5,
        1e-15,
        "middle grey",
    );
    // The rounded weights of IEC 61966-2-1.
    near(
        primaries().map(LinearSrgb::luminance),
        [0.2126, 0.7152, 0.0722],
        5e-5,
        "weights",
    );
    near(LinearSrgb::WHITE.luminance(), 1.0, 1e-15, "white");
}

/// A channel may be off by so much: what the table's digits leave, with room.
const TOLERANCE: f64 = 1e-9;

fn at(nm: f64) -> ColourBasis {
    ColourBasis::at(Nanometres(nm))
}

fn tenths() -> impl Iterator<Item = f64> {
    (3600..=8300).map(|tenth| f64::from(tenth) / 10.0)
}

#[test]
fn basis_adds_up_to_one() {
    // Beyond the visible, too.
    for nm in tenths().chain([0.0, 300.0, 359.9, 830.1, 1000.0]) {
        let row = at(nm).row();
        assert!(row.iter().all(|part| (0.0..=1.0).contains(part)), "{nm}: {row:?}");
        near(row.iter().sum(), 1.0, 1e-12, nm);
        // Each primary's tone is its part.
        assert_eq!(primaries().map(|primary| at(nm).tone(primary).r), row, "{nm}");
    }
    // Dominant wavelengths of the primaries (IEC 61966-2-1 with CIE 1931).
    for (channel, nm) in [(0, 611.0), (1, 549.0), (2, 464.0)] {
        assert!(at(nm).row()[channel] > 0.9, "{nm}: {:?}", at(nm).row());
    }
    // No jump: from nothing to all takes tens of nanometres.
    let parts: Vec<[f64; 3]> = tenths().map(|nm| at(nm).row()).collect();
    for pair in parts.windows(2) {
        near(pair[0], pair[1], 0.1 / 30.0, "within 0.1 nm");
    }
}

#[test]
fn factors_come_back_under_d65() {
    let check = |factor: LinearSrgb| {
        let back = colour_under_d65(|wavelength| ColourBasis::at(wavelength).tone(factor).r);
        near(back, factor, TOLERANCE, "round trip");
    };
    primaries().into_iter().for_each(check);
    proptest!(support::law(512), |(factor in prop::array::uniform3(0.0..=1.0))| check(factor.into()));
}

#[test]
fn tones_are_linear_means() {
    let colour = || prop::array::uniform3(0.0..=1.0).prop_map(LinearSrgb::from);
    proptest!(support::law(4096), |(nm in 360.0..830.0, a in colour(), b in colour(), share in 0.0..=1.0)| {
        let basis = at(nm);
        let apart = basis.tone(a) * share + basis.tone(b) * (1.0 - share);
        near(basis.tone(a * share + b * (1.0 - share)), apart, 1e-14, nm);
        // Between its channels; grey stays grey.
        let LinearSrgb { r: toned, g: same, b: again } = basis.tone(a);
        let [least, most] = [a.r.min(a.g).min(a.b), a.max_channel()];
        prop_assert!((least - 1e-12..=most + 1e-12).contains(&toned));
        prop_assert!(toned == same && same == again);
        prop_assert_eq!(basis.tone(LinearSrgb::grey(a.r)), LinearSrgb::grey(a.r));
    });
}

/// Rows of the table of viridis (256 rows; Stéfan van der Walt and Nathaniel Smith, CC0), which Matplotlib publishes in
/// `_cm_listed.py`.
#[test]
fn viridis_keeps_to_its_table_and_rises() {
    for (row, expected) in [
        (0.0, [0.267004, 0.004874, 0.329415]),
        (64.0, [0.229739, 0.322361, 0.545706]),
        (128.0, [0.127568, 0.566949, 0.550556]),
        (192.0, [0.369214, 0.788888, 0.382914]),
        (255.0, [0.993248, 0.906157, 0.143936]),
    ] {
        near(viridis(row / 255.0), expected, 0.015, row);
    }
    let lightness = |step: u32| {
        let [r, g, b] = viridis(f64::from(step) / 50.0).map(|display| display.powf(2.2));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    for step in 0..50 {
        assert!(lightness(step) < lightness(step + 1), "step {step}");
    }
}

#[test]
fn scales_have_their_ends_where_they_say() {
    for (low, high, is_logarithmic, middle) in [(0.01, 100.0, true, 1.0), (0.0, 8.0, false, 4.0)] {
        let scale = ColourScale {
            low,
            high,
            is_logarithmic,
        };
        for (quantity, place) in [(high, 1.0), (middle, 0.5)] {
            near(scale.place(quantity), place, 1e-12, quantity);
            near(scale.at(place), quantity, 1e-12 * high, place);
        }
        near(scale.place(low), 0.0, 1e-12, low);
        assert_eq!(scale.colour(0.0), viridis(0.0));
        assert_eq!(scale.colour(10.0 * high), viridis(1.0), "beyond is the end");
    }
}
