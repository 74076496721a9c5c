//! Tone mapping and exposure on the CPU.

use nephroid::eye_pass::tone_mapping::{auto_exposure_stops, display_rgba8};
use nephroid::eye_pass::{Picture, ToneMap};

fn picture(radiance: Vec<[f32; 3]>) -> Picture {
    Picture {
        width: radiance.len() as u32,
        height: 1,
        radiance,
    }
}

/// 0.5 of linear light is code 188, a quarter 137, one 255.
#[test]
fn bytes_keep_the_order_of_channels() {
    let shown = display_rgba8(&picture(vec![[0.5, 0.25, 1.0]]), 0.0, ToneMap::None);
    assert_eq!(shown, [188, 137, 255, 255]);
}

#[test]
fn auto_exposure_finds_middle_grey() {
    let stops = |parts: &[(f32, usize)]| {
        let radiance = parts.iter().flat_map(|&(value, count)| vec![[value; 3]; count]);
        auto_exposure_stops(&picture(radiance.collect()))
    };
    for (parts, expected, tolerance) in [
        // 0.18 / 0.045 = 4: two stops, and black does not count.
        (vec![(0.045, 10)], 2.0, 1e-6),
        (vec![(0.045, 10), (0.0, 90)], 2.0, 1e-6),
        (vec![(0.0, 4)], 0.0, 0.0),
        (vec![], 0.0, 0.0),
        // A quarter of the picture is 64 times as bright as the rest: it stays below white. A lone lamp does not count.
        (vec![(1.0, 75), (64.0, 25)], -6.0, 1e-6),
        (vec![(0.18, 999), (10.0, 1)], 0.0, 0.01),
    ] {
        let found = stops(&parts);
        assert!((found - expected).abs() <= tolerance, "{parts:?}: {found}");
    }
}
