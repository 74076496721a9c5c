//! Maps as flat pictures.

use nephroid::settings::LayerKind;
use nephroid::viewer::flat_map::{Part, read, show, thumbnail};

use super::panel_sections::map;

/// Brightness [0, 255] and opacity of a pixel.
fn pixel(shown: &nephroid::viewer::flat_map::Shown, x: usize, y: usize) -> (u8, u8) {
    let at = 4 * (y * shown.size[0] + x);
    (shown.rgba[at + 1], shown.rgba[at + 3])
}

#[test]
fn a_thumbnail_keeps_the_maps_shape_and_its_order_of_brightness() {
    let shown = thumbnail(&map());
    assert_eq!(shown.size, [64, 32], "four texels by two");
    // One pixel of each column: 0, 3, 6 and 9 W/m².
    let row: Vec<_> = (0..4).map(|column| pixel(&shown, 16 * column + 8, 20)).collect();
    assert!(row.iter().all(|(_, opacity)| *opacity == 255));
    assert_eq!(row[0].0, 0);
    assert!(row[1].0 > 40 && row[1] < row[2] && row[2] < row[3], "{row:?}");
    for x in 0..64 {
        assert_eq!(
            pixel(&shown, x, 0),
            pixel(&shown, x - x % 16, 31),
            "constant over a texel"
        );
    }
}

#[test]
fn there_is_nothing_beside_a_map() {
    let part = Part {
        left: -2.0,
        top: -1.0,
        texels_per_pixel: 1.0,
    };
    let shown = show(&map(), part, [8, 4], 0.0);
    let opaque: Vec<_> = (0..32)
        .filter(|index| pixel(&shown, index % 8, index / 8).1 == 255)
        .collect();
    let is_inside = |index: &usize| (2..6).contains(&(index % 8)) && (1..3).contains(&(index / 8));
    let inside: Vec<usize> = (0..32).filter(is_inside).collect();
    assert_eq!(opaque, inside);
    for (x, y) in [(-0.01, 0.0), (0.0, -0.01), (4.0, 0.0), (0.0, 2.0)] {
        assert_eq!(read(&map(), x, y), None, "{x}, {y}");
    }
}

#[test]
fn a_pixel_of_many_texels_is_their_mean() {
    let coarse = Part {
        left: 0.0,
        top: 0.0,
        texels_per_pixel: 2.0,
    };
    let stops = -3.0;
    let [of_pair, other] = [0, 1].map(|x| pixel(&show(&map(), coarse, [2, 1], stops), x, 0).0);
    // Texels of 0 and 3 W/m², and one map of their mean.
    let mut mean = map();
    for layer in &mut mean.layers {
        for pair in layer.irradiance.chunks_mut(2) {
            let half = [0.5 * (pair[0][0] + pair[1][0]); 3];
            pair.fill(half);
        }
    }
    let shown = show(
        &mean,
        Part {
            texels_per_pixel: 1.0,
            ..coarse
        },
        [4, 2],
        stops,
    );
    assert!(of_pair.abs_diff(pixel(&shown, 0, 0).0) <= 1, "{of_pair}");
    assert!(
        other.abs_diff(pixel(&shown, 2, 0).0) <= 1 && other > of_pair,
        "{other}"
    );
}

#[test]
fn a_reading_tells_each_layer_and_the_error_of_the_texel() {
    let reading = read(&map(), 3.5, 1.2).expect("it is on the map");
    assert_eq!(reading.texel, [3, 1]);
    let close = |value: f64, wanted: f64| (value - wanted).abs() < 1e-9;
    let [(LayerKind::Caustic, caustic), (LayerKind::Direct, direct)] = reading.layers_w_per_m2[..] else {
        panic!("{reading:?}")
    };
    assert!(
        close(caustic, 6.0) && close(direct, 3.0),
        "grey light is its own luminance"
    );
    assert_eq!(reading.error_w_per_m2, Some(0.25));
}
