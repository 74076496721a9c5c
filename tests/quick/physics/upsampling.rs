//! Smooth spectra that have a colour.

use nephroid::optics::spectrum::illuminants::d65;
use nephroid::optics::spectrum::xyz::colour_under_d65;
use nephroid::optics::spectrum::{Emission, SmoothSpectrum, Xyz};

use super::visible;
use crate::prelude::*;

/// A channel may be off by so much; the work's own demand is 1e-3.
const TOLERANCE: f64 = 1e-8;

fn smooth(colour: LinearSrgb) -> SmoothSpectrum {
    SmoothSpectrum::from_colour(colour).expect("a colour")
}

/// The spectrum, which has that colour under D65.
fn round_trip(colour: LinearSrgb, tolerance: f64) -> SmoothSpectrum {
    let smooth = smooth(colour);
    near(
        colour_under_d65(|wavelength| smooth.at(wavelength)),
        colour,
        tolerance,
        "round trip",
    );
    smooth
}

#[test]
fn every_colour_comes_back_under_d65() {
    let step = |i: u32| f64::from(i) / 8.0;
    for i in 0..9 * 9 * 9 {
        round_trip(rgb(step(i / 81), step(i / 9 % 9), step(i % 9)), TOLERANCE);
    }
    let limit = prop_oneof![
        3 => (-8.0..0.0f64).prop_map(|x| 10f64.powf(x)),
        3 => (-8.0..0.0f64).prop_map(|x| 1.0 - 10f64.powf(x)),
        1 => Just(0.0),
        1 => Just(1.0),
    ];
    proptest!(support::law(512), |(colour in prop::array::uniform3(limit))| {
        let smooth = round_trip(colour.into(), TOLERANCE);
        for wavelength in visible() {
            prop_assert!((0.0..=1.0).contains(&smooth.at(wavelength)));
        }
    });
}

#[test]
fn white_black_and_grey_are_flat() {
    for grey in [0.0, 1e-9, 0.2, 0.5, 0.999, 1.0] {
        let smooth = smooth(LinearSrgb::grey(grey));
        for wavelength in visible() {
            near(smooth.at(wavelength), grey, 1e-15, wavelength);
        }
    }
    let ends = [LinearSrgb::BLACK, LinearSrgb::WHITE].map(|end| smooth(end).at(Nanometres(555.0)));
    assert_eq!(ends, [0.0, 1.0]);
}

#[test]
fn smooth_means_smooth() {
    // At most one rise and one fall, and no step: from a tenth to nine tenths takes tens of nanometres.
    let step = |i: u32| f64::from(i) / 4.0;
    for i in 0..5 * 5 * 5 {
        let colour = rgb(step(i / 25), step(i / 5 % 5), step(i % 5));
        let smooth = smooth(colour);
        let values: Vec<f64> = visible().map(|wavelength| smooth.at(wavelength)).collect();
        let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let turns = steps.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
        let steepest = steps.iter().fold(0.0f64, |most, step| most.max(step.abs()));
        assert!(turns <= 1, "{colour:?}: {turns} turns");
        assert!(steepest < 0.1, "{colour:?}: {steepest} in a nanometre");
    }
}

#[test]
fn factors_above_one_are_scaled() {
    assert_eq!(round_trip(rgb(3.0, 1.5, 0.3), 3.0 * TOLERANCE).scale, 3.0);
    // Half as bright is the same shape, where both are dark enough for any shape.
    let [full, half] = [0.4, 0.2].map(|most| smooth(rgb(most, 0.5 * most, 0.1 * most)));
    for wavelength in visible() {
        near(full.at(wavelength), 2.0 * half.at(wavelength), 1e-9, wavelength);
    }
}

#[test]
fn lamps_keep_their_xyz() {
    let emission = |colour| Emission::from_colour(colour).expect("a colour").light;
    for colour in [
        LinearSrgb::WHITE,
        LinearSrgb::grey(1e6),
        rgb(1.0, 0.0, 0.0),
        rgb(0.0, 1e-6, 0.0),
        rgb(0.0, 0.0, 40.0),
        rgb(1.0, 0.7, 0.4),
        rgb(0.2, 0.0, 1.0),
        rgb(0.0, 1.0, 1.0),
    ] {
        let [found, wanted] = [emission(colour).xyz(), Xyz::from(colour)].map(<[f64; 3]>::from);
        near(
            found,
            wanted,
            1e-9 * LinearSrgb::from(wanted).max_channel(),
            colour,
        );
    }
    assert_eq!(emission(LinearSrgb::BLACK).xyz(), Xyz::default());
    // White light is D65, but for a smooth factor near to 1.
    let white = emission(LinearSrgb::WHITE);
    for nm in (400..=700).map(|nm| Nanometres(f64::from(nm))) {
        near(white.at(nm) / d65().at(nm), 1.0, 2e-3, nm);
    }
}

#[test]
fn impossible_colours_are_refused() {
    for (wrong, fault) in [
        (rgb(-1e-9, 0.5, 0.5), "negative"),
        (rgb(0.5, f64::NAN, 0.5), "finite"),
        (rgb(0.5, 0.5, f64::INFINITY), "finite"),
    ] {
        says(SmoothSpectrum::from_colour(wrong).expect_err("impossible"), fault);
        says(Emission::from_colour(wrong).expect_err("impossible"), fault);
    }
}
