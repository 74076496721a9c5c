//! How radiance becomes what a display shows: laws of every tone map, and the published values of each.

use nephroid::eye_pass::ToneMap;
use strum::VariantArray;

use crate::prelude::*;

fn grey(tone_map: ToneMap, value: f64) -> f64 {
    tone_map.apply(LinearSrgb::grey(value)).g
}

/// Greys from 2^-20 to 2^20 in steps of an eighth of a stop.
fn greys() -> impl Iterator<Item = f64> {
    (-160..=160).map(|step| (f64::from(step) / 8.0).exp2())
}

#[test]
fn greys_stay_grey_and_rise() {
    for &tone_map in ToneMap::VARIANTS {
        assert_eq!(
            tone_map.apply(LinearSrgb::BLACK),
            LinearSrgb::BLACK,
            "{tone_map:?}"
        );
        let [darkest, brightest] = [-20, 20].map(|stops| grey(tone_map, 2.0_f64.powi(stops)));
        assert!(
            brightest > 0.9999 && darkest < 1e-5,
            "{tone_map:?}: {darkest} {brightest}"
        );
        let mut last = 0.0;
        for value in greys() {
            let shown = tone_map.apply(LinearSrgb::grey(value));
            assert!(shown.g >= last, "{tone_map:?}: {value} falls to {}", shown.g);
            // Below and beyond what it can show a map is flat; in between every step has to be seen.
            let is_between = (1.0 / 64.0..0.9).contains(&value);
            assert!(!is_between || shown.g > last, "{tone_map:?} is flat at {value}");
            last = shown.g;
            // Hill's output matrix is rounded to five digits.
            near(shown, LinearSrgb::grey(shown.g), 2e-5, tone_map);
        }
    }
    // Soft is exact in the middle, and tells stops above white apart by a tenth.
    near(
        ToneMap::Soft.apply(rgb(0.4, 0.2, 0.1)),
        rgb(0.4, 0.2, 0.1),
        1e-12,
        "soft",
    );
    for [low, high] in [[1.0, 2.0], [2.0, 4.0], [4.0, 8.0], [8.0, 15.9]] {
        near(
            grey(ToneMap::Soft, high) - grey(ToneMap::Soft, low),
            0.095,
            0.015,
            low,
        );
    }
    // Below the shoulder of Neutral it only takes off 0.04, the reflection of the dielectrics that it was made for.
    for value in [0.1, 0.3, 0.7] {
        near(
            ToneMap::Neutral.apply(rgb(value, value, 0.1)).r,
            value - 0.04,
            1e-12,
            value,
        );
    }
}

/// Code of a grey in the table of AgX's own configuration: the display's exponent taken off.
fn agx_code(position: f64) -> f64 {
    let stops = position * 16.5 - 10.0 + 0.18_f64.log2();
    grey(ToneMap::AgX, stops.exp2()).powf(1.0 / 2.2)
}

/// Entries of `AgX_Default_Contrast.spi1d` (4096 entries over [0, 1]) of <https://github.com/sobotka/AgX>.
#[test]
fn agx_is_the_table_of_its_author() {
    for (index, published) in [
        (2176, 0.351_852_3),
        (2177, 0.352_325_0),
        (2482, 0.500_088_8),
        (2483, 0.500_577_2),
        (3630, 0.944_976_6),
    ] {
        near(agx_code(f64::from(index) / 4095.0), published, 1e-6, index);
    }
    // Middle grey is the display's code one half.
    near(grey(ToneMap::AgX, 0.18), 0.5_f64.powf(2.2), 1e-9, "middle grey");
    // Ten stops below middle grey and 6.5 above are the ends.
    assert!(grey(ToneMap::AgX, 0.18 * 2.0_f64.powi(-10)) < 1e-12);
    near(
        grey(ToneMap::AgX, 0.18 * 6.5_f64.exp2()),
        1.0,
        1e-6,
        "the bright end",
    );
}

/// Columns of the matrix from linear RGB of some primaries to XYZ, white (0.3127, 0.3290).
fn xyz_from_rgb(primaries: [(f64, f64); 3]) -> DMat3 {
    let xyz = |(x, y): (f64, f64)| dvec3(x / y, 1.0, (1.0 - x - y) / y);
    let columns = DMat3::from_cols(xyz(primaries[0]), xyz(primaries[1]), xyz(primaries[2]));
    let scale = columns.inverse() * xyz((0.3127, 0.3290));
    columns * DMat3::from_diagonal(scale)
}

/// AgX from its definition: primaries drawn in by a fifth, a logarithm, the tunable sigmoid, and back.
fn agx_by_definition(colour: DVec3) -> DVec3 {
    const BT709: [(f64, f64); 3] = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)];
    let towards = |end: f64, white: f64| white + 0.8 * (end - white);
    let inset = BT709.map(|(x, y)| (towards(x, 0.3127), towards(y, 0.3290)));
    let working_from_srgb = xyz_from_rgb(BT709).inverse() * xyz_from_rgb(inset);
    let sigmoid = |channel: f64| {
        let position = (((channel / 0.18).log2() + 10.0) / 16.5).clamp(0.0, 1.0);
        let pivot = 10.0 / 16.5;
        let (side, sign, power) = if position >= pivot {
            (1.0 - pivot, 1.0, 3.25_f64)
        } else {
            (pivot, -1.0, 3.0)
        };
        // Slope 2 at the pivot, which is shown as one half; so scaled that the ends are reached.
        let reach = (2.0 * side).powf(-power) * ((2.0 * side / 0.5).powf(power) - 1.0);
        let scale = reach.powf(-1.0 / power);
        let term = 2.0 * (position - pivot).abs() / scale;
        0.5 + sign * scale * term / (1.0 + term.powf(power)).powf(1.0 / power)
    };
    let codes = (working_from_srgb * colour).to_array().map(sigmoid);
    let back = working_from_srgb.inverse() * DVec3::from_array(codes);
    DVec3::from_array(back.to_array().map(|code| code.clamp(0.0, 1.0).powf(2.2)))
}

/// The curve of Hill's fit on greys, as his matrices take white to white; red keeps its share of the other channels:
/// 0.59719 of it reaches the curve's first channel, and so on.
#[test]
fn aces_has_the_values_of_the_fit() {
    // (0.18·(0.18 + 0.0245786) − 0.000090537) / (0.18·(0.983729·0.18 + 0.4329510) + 0.238081) = 0.105 591, and so on.
    for (value, published) in [(0.18, 0.105_591_2), (1.0, 0.619_115_4), (16.0, 0.989_935_3)] {
        near(grey(ToneMap::Aces, value), published, 1e-5, value);
    }
    // Its toe crosses zero at 0.003 253, its shoulder one at 25.67.
    assert_eq!(grey(ToneMap::Aces, 0.003_25), 0.0);
    assert!(grey(ToneMap::Aces, 0.003_26) > 0.0);
    assert!(grey(ToneMap::Aces, 25.6) < 1.0 && grey(ToneMap::Aces, 25.8) == 1.0);
    let shown = ToneMap::Aces.apply(rgb(1.0, 0.0, 0.0));
    let curve = |v: f64| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081);
    let [a, b, c] = [0.59719, 0.07600, 0.02840].map(curve);
    near(shown.r, 1.60475 * a - 0.53108 * b - 0.07367 * c, 1e-12, "red");
    assert_eq!(shown.g, (-0.10208 * a + 1.10813 * b - 0.00605 * c).max(0.0));
}

proptest! {
    #![proptest_config(support::law(4096))]

    #[test]
    fn display_light_is_within_its_range(c in prop::array::uniform3(-1e3..1e6f64), stops in -30.0..30.0f64) {
        for &tone_map in ToneMap::VARIANTS {
            let shown = tone_map.apply(LinearSrgb::from(c) * f64::exp2(stops));
            for channel in shown.to_array() {
                prop_assert!((0.0..=1.0).contains(&channel), "{tone_map:?}: {shown:?}");
            }
        }
    }

    #[test]
    fn agx_is_as_it_is_defined(stops in prop::array::uniform3(-12.0..10.0f64)) {
        let colour = stops.map(f64::exp2);
        let defined = agx_by_definition(DVec3::from_array(colour)).to_array();
        near(ToneMap::AgX.apply(colour.into()).to_array(), defined, 1e-9, stops);
    }
}
