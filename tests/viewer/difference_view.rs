//! False colours of differences.

use std::sync::Arc;

use glam::DVec2;
use nephroid::illumination::difference::{Difference, SignedMap};
use nephroid::illumination::{Chart, UvSet};
use nephroid::optics::LinearSrgb;
use nephroid::viewer::difference_view::{RANGE, at, colour, maps};

#[test]
fn warm_is_more_cool_is_less_and_dark_is_none() {
    let warmth = |[r, _, b]: [u8; 3]| i32::from(r) - i32::from(b);
    let (low, high) = RANGE;
    for step in 1..=20 {
        let size = low * (high / low).powf(f64::from(step) / 20.0);
        assert!(warmth(colour(size)) > 0, "{size}: {:?}", colour(size));
        assert!(warmth(colour(-size)) < 0, "{size}: {:?}", colour(-size));
    }
    let brightness = |colour: [u8; 3]| colour.iter().map(|code| u32::from(*code)).sum::<u32>();
    for sign in [-1.0, 1.0] {
        let steps: Vec<_> = (0..=20)
            .map(|step| brightness(colour(at(sign * f64::from(step) / 20.0))))
            .collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
        assert_eq!(colour(sign * 1e9), colour(sign * high), "the scale's end goes on");
        assert_eq!(
            colour(sign * 0.99 * low),
            colour(0.0),
            "below the scale is nothing"
        );
    }
    assert_eq!(colour(f64::NAN), colour(0.0));
}

#[test]
fn places_of_the_scale_run_from_end_to_end() {
    let (low, high) = RANGE;
    for (place, expected) in [(-1.0, -high), (1.0, high), (0.0, low)] {
        assert!(
            (at(place) / expected - 1.0).abs() < 1e-12,
            "{place}: {}",
            at(place)
        );
    }
    assert!((at(0.5) / (low * high).sqrt() - 1.0).abs() < 1e-12);
}

#[test]
fn each_texel_shows_its_difference_relative_to_the_maps_mean() {
    let chart = Arc::new(Chart {
        object: 0,
        uv_set: UvSet::Generated,
        corner_uvs: vec![[DVec2::ZERO, DVec2::X, DVec2::Y]],
        width: 3,
        height: 1,
        texel_areas_m2: vec![1.0],
    });
    let difference = |mean_w_m2| Difference {
        maps: vec![SignedMap {
            chart: Arc::clone(&chart),
            irradiance: vec![1.0, -0.1, 0.0],
            mean_w_m2,
        }],
        with_w: 6.0,
        without_w: 5.1,
        relative_rmse: Some(0.3),
    };
    let shown = maps(&difference(2.0));
    assert!(Arc::ptr_eq(&shown[0].chart, &chart));
    for (texel, relative) in [(0, 0.5), (1, -0.05), (2, 0.0)] {
        let expected = colour(relative).map(|code| LinearSrgb::decode_channel(code) as f32);
        let found = shown[0].total()[texel];
        for channel in 0..3 {
            // One display code may lie between the two roundings.
            assert!(
                (found[channel] - expected[channel]).abs() < 0.01,
                "{found:?} {expected:?}"
            );
        }
    }
    let dark = maps(&difference(0.0));
    let none = colour(0.0).map(|code| LinearSrgb::decode_channel(code) as f32);
    assert!(dark[0].total().iter().all(|texel| *texel == none));
}
