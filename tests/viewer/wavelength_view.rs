//! The light's dominant wavelengths, as a view.

use std::sync::Arc;

use glam::DVec2;
use nephroid::illumination::{Chart, IlluminationMap, Layer, Receiver, UvSet};
use nephroid::optics::spectrum::{Hue, Xyz, dominant, xyz_bar};
use nephroid::optics::{LinearSrgb, Nanometres};
use nephroid::settings::LayerKind;
use nephroid::viewer::wavelength_view::{RANGE_NM, colour, maps};

/// Single wavelengths are their own, however much white is mixed in.
#[test]
fn light_of_one_wavelength_and_white_has_that_wavelength() {
    for nm in (400..=690).step_by(10).map(f64::from) {
        let pure = Xyz::from(xyz_bar(Nanometres(nm))).to_linear_srgb();
        for white in [0.0, 0.1, 1.0] {
            let mixed = pure * pure.luminance().recip() + LinearSrgb::WHITE * white;
            let Some(Hue::Spectral(found)) = dominant(mixed) else {
                panic!("{nm} nm with {white} of white: {:?}", dominant(mixed));
            };
            assert!(
                (found.0 - nm).abs() < 0.1,
                "{found:?} of {nm} nm with {white} of white"
            );
        }
    }
}

/// The primaries of sRGB against D65, as published (Lindbloom, "RGB Working Space Information": sRGB 611.4, 549.1 and
/// 464.2 nm).
#[test]
fn primaries_have_the_wavelengths_that_are_published_of_them() {
    for (rgb, nm) in [
        ([1.0, 0.0, 0.0], 611.4),
        ([0.0, 1.0, 0.0], 549.1),
        ([0.0, 0.0, 1.0], 464.2),
    ] {
        let Some(Hue::Spectral(found)) = dominant(LinearSrgb::from(rgb)) else {
            panic!("{rgb:?}");
        };
        assert!((found.0 - nm).abs() < 0.3, "{found:?} of {rgb:?}");
    }
    assert_eq!(dominant(LinearSrgb::from([1.0, 0.0, 1.0])), Some(Hue::Purple));
    assert_eq!(dominant(LinearSrgb::WHITE * 7.0), Some(Hue::White));
    assert_eq!(dominant(LinearSrgb::BLACK), None);
}

#[test]
fn texels_are_shown_in_the_colour_of_their_wavelength_and_dark_ones_black() {
    let [green, faint] = [1.0, 1e-5].map(|strength| {
        let pure = Xyz::from(xyz_bar(Nanometres(530.0))).to_linear_srgb();
        (pure * strength).to_array().map(|channel| channel as f32)
    });
    let map = IlluminationMap {
        chart: Arc::new(Chart {
            receiver: Receiver::front(0),
            uv_set: UvSet::Generated,
            corner_uvs: vec![[DVec2::ZERO, DVec2::X, DVec2::Y]],
            width: 4,
            height: 1,
            texel_areas_m2: vec![1.0],
            layout: None,
            beyond: Vec::new(),
            joints: Vec::new(),
        }),
        layers: vec![Layer {
            kind: LayerKind::Caustic,
            irradiance: vec![green, faint, [0.5; 3], [f32::NAN; 3]],
        }],
        error: None,
        estimated_relative_rmse: None,
    };
    let shown = maps(&[map])[0].total();
    let expected = colour(Nanometres(530.0)).to_array();
    for channel in 0..3 {
        assert!(
            (f64::from(shown[0][channel]) - expected[channel]).abs() < 1e-3,
            "{:?}",
            shown[0]
        );
    }
    assert_eq!(shown[1], [0.0; 3]);
    assert!(
        shown[2][0] > 0.0 && shown[2][0] == shown[2][1] && shown[2][1] == shown[2][2],
        "{:?}",
        shown[2]
    );
    assert!(shown[3][0].is_nan());
    // The legend's colours can be shown, and differ along it.
    let steps: Vec<LinearSrgb> = (0..=12)
        .map(|step| {
            colour(Nanometres(
                RANGE_NM.0 + (RANGE_NM.1 - RANGE_NM.0) * f64::from(step) / 12.0,
            ))
        })
        .collect();
    for pair in steps[1..11].windows(2) {
        assert_ne!(pair[0], pair[1]);
    }
    assert!(steps.iter().all(|step| {
        step.to_array()
            .iter()
            .all(|channel| (0.0..=1.0 + 1e-12).contains(channel))
    }));
}
