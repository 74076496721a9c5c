//! Linear light, its luminance and its display encoding.

use nephroid::optics::LinearSrgb;
use proptest::prelude::*;

#[test]
fn luminance_weights_sum_to_one() {
    assert!((LinearSrgb::WHITE.luminance() - 1.0).abs() < 1e-15);
    let [r, g, b] = [
        LinearSrgb::new(1.0, 0.0, 0.0),
        LinearSrgb::new(0.0, 1.0, 0.0),
        LinearSrgb::new(0.0, 0.0, 1.0),
    ]
    .map(LinearSrgb::luminance);
    // The rounded weights of IEC 61966-2-1.
    assert!((r - 0.2126).abs() < 5e-5 && (g - 0.7152).abs() < 5e-5 && (b - 0.0722).abs() < 5e-5);
}

/// Every 8-bit code survives the way to linear light and back.
#[test]
fn srgb_codes_round_trip() {
    let mut previous = -1.0;
    for code in 0..=255u8 {
        let linear = LinearSrgb::decode_channel(code);
        assert!(linear > previous, "code {code} is not above its predecessor");
        previous = linear;
        let encoded = LinearSrgb::encode_channel(linear) * 255.0;
        assert!(
            (encoded - f64::from(code)).abs() < 1e-3,
            "code {code} came back as {encoded}"
        );
    }
    assert_eq!(LinearSrgb::decode_channel(0), 0.0);
    assert_eq!(LinearSrgb::decode_channel(255), 1.0);
}

/// Middle grey: linear 0.214 041 is code 127.5, the textbook value of ((0.5 + 0.055)/1.055)^2.4.
#[test]
fn middle_grey() {
    assert!((LinearSrgb::encode_channel(0.214_041_140_482_232_55) - 0.5).abs() < 1e-15);
}

proptest! {
    #![proptest_config(support::law(4096))]

    /// The encoding rises, stays in [0, 1] and cuts what a display cannot show.
    #[test]
    fn encoding_rises(a in -1.0..3.0f64, b in -1.0..3.0f64) {
        let (low, high) = (a.min(b), a.max(b));
        let (x, y) = (LinearSrgb::encode_channel(low), LinearSrgb::encode_channel(high));
        prop_assert!(x <= y && (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y));
    }

    /// Luminance is linear: of sums, and of colours that light each other.
    #[test]
    fn luminance_is_linear(c in prop::array::uniform3(0.0..10.0f64), d in prop::array::uniform3(0.0..10.0f64), k in 0.0..10.0f64) {
        let (c, d) = (LinearSrgb::from(c), LinearSrgb::from(d));
        prop_assert!(((c + d * k).luminance() - (c.luminance() + k * d.luminance())).abs() < 1e-12);
        prop_assert!((LinearSrgb::grey(k).luminance() - k).abs() < 1e-13);
    }
}
