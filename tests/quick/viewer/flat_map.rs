//! Maps as flat pictures.

use nephroid::viewer::flat_map::{Part, Shown, read, show, thumbnail};

use super::fixtures::map;
use super::*;

/// Brightness [0, 255] and opacity of a pixel.
fn pixel(shown: &Shown, x: usize, y: usize) -> (u8, u8) {
    let at = 4 * (y * shown.size[0] + x);
    (shown.rgba[at + 1], shown.rgba[at + 3])
}

#[test]
fn thumbnail_keeps_shape_and_brightness() {
    let shown = thumbnail(&map());
    assert_eq!(shown.size, [64, 32], "four texels by two");
    // One pixel of each column: 0, 3, 6 and 9 W/m².
    let row: Vec<_> = (0..4).map(|column| pixel(&shown, 16 * column + 8, 20)).collect();
    assert!(row.iter().all(|(_, opacity)| *opacity == 255));
    assert!(
        row[0].0 == 0 && row[1].0 > 40 && row.is_sorted_by(|a, b| a < b),
        "{row:?}"
    );
    for x in 0..64 {
        let same_texel = pixel(&shown, x - x % 16, 31);
        assert_eq!(pixel(&shown, x, 0), same_texel);
    }
}

#[test]
fn nothing_is_beside_a_map() {
    let part = Part {
        left: -2.0,
        top: -1.0,
        texels_per_pixel: 1.0,
    };
    let shown = show(&map(), part, [8, 4], 0.0);
    for (x, y) in (0..32).map(|index| (index % 8, index / 8)) {
        let is_inside = (2..6).contains(&x) && (1..3).contains(&y);
        assert_eq!(pixel(&shown, x, y).1 == 255, is_inside, "{x}, {y}");
    }
    for (x, y) in [(-0.01, 0.0), (0.0, -0.01), (4.0, 0.0), (0.0, 2.0)] {
        assert_eq!(read(&map(), x, y), None, "{x}, {y}");
    }
}

#[test]
fn a_pixel_of_many_texels_is_their_mean() {
    let part = |texels_per_pixel| Part {
        left: 0.0,
        top: 0.0,
        texels_per_pixel,
    };
    // Texels of 0 and 3 W/m², and a map of their mean.
    let mut mean = map();
    for layer in &mut mean.layers {
        for pair in layer.irradiance.chunks_mut(2) {
            pair.fill([0.5 * (pair[0][0] + pair[1][0]); 3]);
        }
    }
    let stops = -3.0;
    let coarse = show(&map(), part(2.0), [2, 1], stops);
    let fine = show(&mean, part(1.0), [4, 2], stops);
    for x in 0..2 {
        let [found, expected] = [pixel(&coarse, x, 0).0, pixel(&fine, 2 * x, 0).0];
        assert!(found.abs_diff(expected) <= 1, "{found} instead of {expected}");
    }
    assert!(pixel(&coarse, 1, 0).0 > pixel(&coarse, 0, 0).0);
}

#[test]
fn reading_tells_layers_and_error() {
    let reading = read(&map(), 3.5, 1.2).expect("it is on the map");
    assert_eq!((reading.texel, reading.error_w_per_m2), ([3, 1], Some(0.25)));
    let [(LayerKind::Caustic, caustic), (LayerKind::Direct, direct)] = reading.layers_w_per_m2[..] else {
        panic!("{reading:?}")
    };
    // Grey light is its own luminance.
    near([caustic, direct], [6.0, 3.0], 1e-9, "layers");
}
