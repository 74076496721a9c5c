//! Errors, differences and dominant wavelengths in false colours.

use nephroid::illumination::difference::SignedMap;
use nephroid::illumination::difference_colours;
use nephroid::optics::spectrum::{Hue, Xyz, dominant, xyz_bar};
use nephroid::viewer::false_colours::{
    ERROR_RANGE, RANGE_NM, difference_maps, error_colour, error_maps, has_errors, wavelength_colour,
    wavelength_maps,
};

use super::*;

/// A texel's display codes, to the rounding of one code.
fn assert_shows(map: &IlluminationMap, texel: usize, codes: [u8; 3]) {
    let found = map.total()[texel].map(f64::from);
    near(found, codes.map(LinearSrgb::decode_channel), 0.01, texel);
}

#[test]
fn errors_show_relative_to_the_mean() {
    // Texels of 4 and 2 W/m² over 1 and 3 m²: the mean is 2.5 W/m².
    let without = caustic(chart(0, 2, 1, vec![1.0, 3.0]), vec![[4.0; 3], [2.0; 3]]);
    let with = with(without.clone(), |it| it.error = Some(vec![0.25, 0.025]));
    assert!(!has_errors(std::slice::from_ref(&without)));
    let maps = [without, with];
    assert!(has_errors(&maps));
    let shown = error_maps(&maps);
    assert_eq!(shown.len(), 1, "a map without an error is left out");
    assert!(Arc::ptr_eq(&shown[0].chart, &maps[1].chart));
    for (texel, relative) in [(0, 0.1), (1, 0.01)] {
        assert_shows(&shown[0], texel, error_colour(relative));
    }
}

#[test]
fn error_colours_are_logarithmic_to_their_ends() {
    let (colour, (low, high)) = (error_colour, ERROR_RANGE);
    assert_eq!(colour(0.0), colour(low));
    assert_eq!(colour(1e9), colour(high));
    assert_eq!(colour(f64::NAN), colour(high), "no number is no accuracy");
    let step = |step| colour(low * (high / low).powf(f64::from(step) / 20.0));
    for index in 0..20 {
        assert_ne!(step(index), step(index + 1), "every step shows");
    }
}

#[test]
fn differences_show_relative_to_the_mean() {
    let chart = chart(0, 3, 1, vec![1.0]);
    let shown = |mean_w_m2| {
        let (chart, irradiance) = (Arc::clone(&chart), vec![1.0, -0.1, 0.0]);
        let maps = vec![SignedMap {
            chart,
            irradiance,
            mean_w_m2,
        }];
        let (with_w, without_w, relative_rmse) = (6.0, 5.1, Some(0.3));
        difference_maps(&Difference {
            maps,
            with_w,
            without_w,
            relative_rmse,
        })
    };
    assert!(Arc::ptr_eq(&shown(2.0)[0].chart, &chart));
    for (texel, relative) in [0.5, -0.05, 0.0].into_iter().enumerate() {
        assert_shows(&shown(2.0)[0], texel, difference_colours::colour(relative));
    }
    // Without light nothing has a relative size.
    let none = difference_colours::colour(0.0).map(|code| LinearSrgb::decode_channel(code) as f32);
    assert_eq!(shown(0.0)[0].total(), [none; 3]);
}

/// Single wavelengths are their own, however much white is mixed in. Of the primaries: Lindbloom, "RGB Working Space
/// Information".
#[test]
fn dominant_wavelengths_are_those_published() {
    let pure = |nm| Xyz::from(xyz_bar(Nanometres(nm))).to_linear_srgb();
    let mut rows = vec![
        (LinearSrgb::from([1.0, 0.0, 0.0]), 611.4, 0.3),
        (LinearSrgb::from([0.0, 1.0, 0.0]), 549.1, 0.3),
        (LinearSrgb::from([0.0, 0.0, 1.0]), 464.2, 0.3),
    ];
    for nm in (400..=690).step_by(10).map(f64::from) {
        let bright = pure(nm) * pure(nm).luminance().recip();
        rows.extend([0.0, 0.1, 1.0].map(|white| (bright + LinearSrgb::WHITE * white, nm, 0.1)));
    }
    for (colour, nm, tolerance) in rows {
        let Some(Hue::Spectral(found)) = dominant(colour) else {
            panic!("{colour:?}")
        };
        near(found.0, nm, tolerance, colour);
    }
    assert_eq!(dominant(LinearSrgb::from([1.0, 0.0, 1.0])), Some(Hue::Purple));
    assert_eq!(dominant(LinearSrgb::WHITE * 7.0), Some(Hue::White));
    assert_eq!(dominant(LinearSrgb::BLACK), None);
}

#[test]
fn texels_show_their_wavelength() {
    let pure = Xyz::from(xyz_bar(Nanometres(530.0))).to_linear_srgb();
    let [green, faint] = [1.0, 1e-5].map(|strength| (pure * strength).to_array().map(|c| c as f32));
    let texels = vec![green, faint, [0.5; 3], [f32::NAN; 3]];
    let shown = wavelength_maps(&[caustic(chart(0, 4, 1, vec![1.0]), texels)])[0].total();
    let expected = wavelength_colour(Nanometres(530.0)).to_array();
    near(shown[0].map(f64::from), expected, 1e-3, "530 nm");
    assert_eq!(shown[1], [0.0; 3], "dark texels are black");
    assert!(shown[2][0] > 0.0 && shown[2] == [shown[2][0]; 3], "{shown:?}");
    assert!(shown[3][0].is_nan());
    // The legend's colours can be shown, and differ along it.
    let (low, high) = RANGE_NM;
    let colour = |step| wavelength_colour(Nanometres(low + (high - low) * f64::from(step) / 12.0));
    for step in 0..=12 {
        let is_shown = |channel: f64| (0.0..=1.0 + 1e-12).contains(&channel);
        assert!(colour(step).to_array().into_iter().all(is_shown));
        assert!(!(1..10).contains(&step) || colour(step) != colour(step + 1));
    }
}
