//! False colours against the published table.

use nephroid::illumination::false_colours::{ColourScale, viridis};

use crate::prelude::*;

/// Rows of the table of viridis (256 rows; Stéfan van der Walt and Nathaniel Smith, CC0), which Matplotlib publishes in
/// `_cm_listed.py`.
#[test]
fn viridis_keeps_to_its_table_and_rises() {
    for (row, expected) in [
        (0.0, [0.267004, 0.004874, 0.329415]),
        (64.0, [0.229739, 0.322361, 0.545706]),
        (128.0, [0.127568, 0.566949, 0.550556]),
        (192.0, [0.369214, 0.788888, 0.382914]),
        (255.0, [0.993248, 0.906157, 0.143936]),
    ] {
        near(viridis(row / 255.0), expected, 0.015, row);
    }
    let lightness = |step: u32| {
        let [r, g, b] = viridis(f64::from(step) / 50.0).map(|display| display.powf(2.2));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    for step in 0..50 {
        assert!(lightness(step) < lightness(step + 1), "step {step}");
    }
}

#[test]
fn scales_have_their_ends_where_they_say() {
    for (low, high, is_logarithmic, middle) in [(0.01, 100.0, true, 1.0), (0.0, 8.0, false, 4.0)] {
        let scale = ColourScale {
            low,
            high,
            is_logarithmic,
        };
        for (quantity, place) in [(high, 1.0), (middle, 0.5)] {
            near(scale.place(quantity), place, 1e-12, quantity);
            near(scale.at(place), quantity, 1e-12 * high, place);
        }
        near(scale.place(low), 0.0, 1e-12, low);
        assert_eq!(scale.colour(0.0), viridis(0.0));
        assert_eq!(scale.colour(10.0 * high), viridis(1.0), "beyond is the end");
    }
}
