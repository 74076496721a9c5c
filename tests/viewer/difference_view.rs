//! Maps of differences, in false colours.

use std::sync::Arc;

use glam::DVec2;
use nephroid::illumination::difference::{Difference, SignedMap};
use nephroid::illumination::difference_colours::colour;
use nephroid::illumination::{Chart, Receiver, UvSet};
use nephroid::optics::LinearSrgb;
use nephroid::viewer::difference_view::maps;

#[test]
fn each_texel_shows_its_difference_relative_to_the_maps_mean() {
    let chart = Arc::new(Chart {
        receiver: Receiver::front(0),
        uv_set: UvSet::Generated,
        corner_uvs: vec![[DVec2::ZERO, DVec2::X, DVec2::Y]],
        width: 3,
        height: 1,
        texel_areas_m2: vec![1.0],
        layout: None,
        beyond: Vec::new(),
        joints: Vec::new(),
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
