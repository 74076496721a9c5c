//! The perceptual difference that pictures are compared by.

use crate::prelude::*;
use support::flip::mean_flip;

/// Stripes, a disc and a gradient, changed by `change`.
fn sample(change: impl Fn(usize, usize, [f64; 3]) -> [f64; 3]) -> Vec<u8> {
    let pixel = |pixel: usize| {
        let (x, y) = (pixel % 48, pixel / 48);
        let stripe = if x / 6 % 2 == 0 { 200.0 } else { 60.0 };
        let is_disc = x.abs_diff(30).pow(2) + y.abs_diff(20).pow(2) < 64;
        let red = if is_disc { 250.0 } else { stripe };
        let [r, g, b] = change(x, y, [red, stripe, 5.0 * y as f64]).map(|channel| channel as u8);
        [r, g, b, u8::MAX]
    };
    (0..48 * 48).flat_map(pixel).collect()
}

/// The figures are what the authors' own code gives, in single precision.
#[test]
fn flip_figures_of_its_authors() {
    let same = sample(|_, _, colour| colour);
    assert_eq!(mean_flip(&same, &same, 48), 0.0);
    let tinted = sample(|_, _, [r, g, b]| [r, g * 0.9, b]);
    let brightened = sample(|x, y, colour| if [x, y] == [11, 31] { [255.0; 3] } else { colour });
    let inverted = sample(|_, _, colour| colour.map(|channel| 255.0 - channel));
    for (test, expected) in [
        (tinted, 0.348_323_2),
        (brightened, 0.003_162_9),
        (inverted, 0.939_610_7),
    ] {
        assert_close(mean_flip(&same, &test, 48), expected, 2e-4, "mean FLIP");
    }
}
