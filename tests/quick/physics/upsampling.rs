//! Smooth spectra that have a colour.

use nephroid::optics::spectrum::illuminants::d65;
use nephroid::optics::spectrum::xyz::colour_under_d65;
use nephroid::optics::spectrum::{Emission, SmoothSpectrum, Xyz};
use nephroid::optics::{LinearSrgb, Nanometres};
use proptest::prelude::*;

/// A channel may be off by so much; the work's own demand is 1e-3.
const TOLERANCE: f64 = 1e-8;

fn round_trip(colour: LinearSrgb) -> (SmoothSpectrum, f64) {
    let smooth = SmoothSpectrum::from_colour(colour).expect("a colour");
    let back = colour_under_d65(|wavelength| smooth.at(wavelength));
    (smooth, (back - colour).map(f64::abs).max_channel())
}

fn visible() -> impl Iterator<Item = Nanometres> {
    (360..=830).map(|nm| Nanometres(f64::from(nm)))
}

#[test]
fn every_colour_comes_back_under_d65() {
    let step = |i: u32| f64::from(i) / 8.0;
    for i in 0..9 * 9 * 9 {
        let colour = LinearSrgb::new(step(i / 81), step(i / 9 % 9), step(i % 9));
        let (_, error) = round_trip(colour);
        assert!(error < TOLERANCE, "{colour:?}: {error}");
    }
}

#[test]
fn colours_near_the_limits_come_back_too() {
    let near = prop_oneof![
        3 => (-8.0..0.0f64).prop_map(|x| 10f64.powf(x)),
        3 => (-8.0..0.0f64).prop_map(|x| 1.0 - 10f64.powf(x)),
        1 => Just(0.0),
        1 => Just(1.0),
    ];
    let cases = proptest::test_runner::Config {
        cases: 512,
        ..support::law(4096)
    };
    proptest!(cases, |(r in near.clone(), g in near.clone(), b in near)| {
        let colour = LinearSrgb::new(r, g, b);
        let (smooth, error) = round_trip(colour);
        prop_assert!(error < TOLERANCE, "{:?}: {}", colour, error);
        for wavelength in visible() {
            prop_assert!((0.0..=1.0).contains(&smooth.at(wavelength)));
        }
    });
}

#[test]
fn white_black_and_grey_are_flat() {
    for grey in [0.0, 1e-9, 0.2, 0.5, 0.999, 1.0] {
        let smooth = SmoothSpectrum::from_colour(LinearSrgb::grey(grey)).expect("a colour");
        for wavelength in visible() {
            let found = smooth.at(wavelength);
            assert!((found - grey).abs() < 1e-15, "{grey} at {wavelength:?}: {found}");
        }
    }
    let [black, white] = [LinearSrgb::BLACK, LinearSrgb::WHITE].map(SmoothSpectrum::from_colour);
    assert_eq!(black.expect("a colour").at(Nanometres(555.0)), 0.0);
    assert_eq!(white.expect("a colour").at(Nanometres(555.0)), 1.0);
}

#[test]
fn smooth_means_smooth() {
    // At most one rise and one fall, and no step: from a tenth to nine tenths takes tens of nanometres.
    let step = |i: u32| f64::from(i) / 4.0;
    for i in 0..5 * 5 * 5 {
        let colour = LinearSrgb::new(step(i / 25), step(i / 5 % 5), step(i % 5));
        let (smooth, _) = round_trip(colour);
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
    let colour = LinearSrgb::new(3.0, 1.5, 0.3);
    let (smooth, error) = round_trip(colour);
    assert!(error < 3.0 * TOLERANCE, "{error}");
    assert_eq!(smooth.scale, 3.0);
    // Half as bright is the same shape, where both are dark enough for any shape.
    let [full, half] = [0.4, 0.2].map(|most| {
        let colour = LinearSrgb::new(most, 0.5 * most, 0.1 * most);
        SmoothSpectrum::from_colour(colour).expect("a colour")
    });
    for wavelength in visible() {
        assert!((full.at(wavelength) - 2.0 * half.at(wavelength)).abs() < 1e-9);
    }
}

#[test]
fn lamps_keep_their_xyz() {
    for colour in [
        LinearSrgb::WHITE,
        LinearSrgb::grey(1e6),
        LinearSrgb::new(1.0, 0.0, 0.0),
        LinearSrgb::new(0.0, 1e-6, 0.0),
        LinearSrgb::new(0.0, 0.0, 40.0),
        LinearSrgb::new(1.0, 0.7, 0.4),
        LinearSrgb::new(0.2, 0.0, 1.0),
        LinearSrgb::new(0.0, 1.0, 1.0),
    ] {
        let light = Emission::from_colour(colour).expect("a colour").light;
        let wanted = Xyz::from(colour);
        let most = wanted.x.max(wanted.y).max(wanted.z);
        for (found, wanted) in <[f64; 3]>::from(light.xyz())
            .into_iter()
            .zip(<[f64; 3]>::from(wanted))
        {
            assert!(
                (found - wanted).abs() < 1e-9 * most,
                "{colour:?}: {found} for {wanted}"
            );
        }
    }
    let dark = Emission::from_colour(LinearSrgb::BLACK).expect("a colour");
    assert_eq!(dark.light.xyz(), Xyz::default());
    // White light is D65, but for a smooth factor near to 1.
    let white = Emission::from_colour(LinearSrgb::WHITE).expect("a colour");
    for nm in (400..=700).map(|nm| Nanometres(f64::from(nm))) {
        assert!((white.light.at(nm) / d65().at(nm) - 1.0).abs() < 2e-3, "{nm:?}");
    }
}

#[test]
fn impossible_colours_are_refused() {
    for (wrong, fault) in [
        (LinearSrgb::new(-1e-9, 0.5, 0.5), "negative"),
        (LinearSrgb::new(0.5, f64::NAN, 0.5), "finite"),
        (LinearSrgb::new(0.5, 0.5, f64::INFINITY), "finite"),
    ] {
        for error in [
            SmoothSpectrum::from_colour(wrong).err(),
            Emission::from_colour(wrong).err(),
        ] {
            let error = error.expect("refused").to_string();
            assert!(error.contains(fault), "{error}");
        }
    }
}
