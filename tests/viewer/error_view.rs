//! False colours of errors.

use std::sync::Arc;

use glam::DVec2;
use nephroid::illumination::{Chart, IlluminationMap, Layer, Receiver, UvSet};
use nephroid::optics::LinearSrgb;
use nephroid::settings::LayerKind;
use nephroid::viewer::error_view::{RANGE, colour, is_available, maps};

/// Two texels of 4 and 2 W/m² over 1 and 3 m²: the mean is 2.5 W/m².
fn map(error: Option<Vec<f32>>) -> IlluminationMap {
    IlluminationMap {
        chart: Arc::new(Chart {
            receiver: Receiver::front(0),
            uv_set: UvSet::Generated,
            corner_uvs: vec![[DVec2::ZERO, DVec2::X, DVec2::Y]],
            width: 2,
            height: 1,
            texel_areas_m2: vec![1.0, 3.0],
            layout: None,
            beyond: Vec::new(),
            joints: Vec::new(),
        }),
        layers: vec![Layer {
            kind: LayerKind::Direct,
            irradiance: vec![[4.0; 3], [2.0; 3]],
        }],
        error,
        estimated_relative_rmse: None,
    }
}

#[test]
fn colours_follow_the_logarithm_and_end_at_the_scales_ends() {
    let (low, high) = RANGE;
    assert_eq!(colour(0.0), colour(low), "nothing is below the scale");
    assert_eq!(colour(high), colour(1e9));
    assert_eq!(colour(f64::NAN), colour(high), "no number is no accuracy");
    let steps: Vec<_> = (0..=20)
        .map(|step| colour(low * (high / low).powf(f64::from(step) / 20.0)))
        .collect();
    for pair in steps.windows(2) {
        assert_ne!(pair[0], pair[1], "every step shows");
    }
}

#[test]
fn each_texel_shows_its_error_relative_to_the_maps_mean() {
    assert!(!is_available(&[map(None)]));
    let with_error = map(Some(vec![0.25, 0.025]));
    assert!(is_available(&[map(None), with_error.clone()]));
    let shown = maps(&[map(None), with_error.clone()]);
    assert_eq!(shown.len(), 1, "a map without an error is left out");
    assert!(Arc::ptr_eq(&shown[0].chart, &with_error.chart));
    for (texel, relative) in [(0, 0.1), (1, 0.01)] {
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
}
