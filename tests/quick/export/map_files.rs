//! Files of maps against the maps: every texel of every channel.

use std::sync::Arc;

use glam::DVec3;
use nephroid::export::exr::{MapValue, decode, encode_map, rgb_values};
use nephroid::illumination::parametrisation::DEFAULT_NOMINAL_SIDE;
use nephroid::illumination::tiles::TileLayout;
use nephroid::illumination::{Chart, IlluminationMap, Layer, Parametrisation, parametrise};
use nephroid::scene::builtin::shapes;
use nephroid::settings::LayerKind;

fn plane() -> Parametrisation {
    let mesh = shapes::rectangle(DVec3::ZERO, DVec3::X * 2.0, DVec3::Z);
    parametrise(0, &mesh, DEFAULT_NOMINAL_SIDE).expect("a chart")
}

/// A value of its own for each texel of each channel of a part; its sums are exact.
fn value(part: usize, texel: usize, channel: usize) -> f32 {
    (1 + part + 4 * (channel + 3 * texel)) as f32
}

fn irradiance(part: usize, texels: usize) -> Vec<[f32; 3]> {
    let texel = |texel| [0, 1, 2].map(|channel| value(part, texel, channel));
    (0..texels).map(texel).collect()
}

/// A map with a caustic layer (part 0), a direct one (part 1) and an error (part 3).
fn map(chart: Chart) -> IlluminationMap {
    let texels = chart.texel_count();
    let layer = |(part, kind)| Layer {
        kind,
        irradiance: irradiance(part, texels),
    };
    IlluminationMap {
        chart: Arc::new(chart),
        layers: [(0, LayerKind::Caustic), (1, LayerKind::Direct)]
            .map(layer)
            .into(),
        error: Some((0..texels).map(|texel| value(3, texel, 0)).collect()),
        estimated_relative_rmse: None,
        estimated_visible: None,
    }
}

/// Reads the map's file and fails unless each of its channels is what `texel_at` (column, row) says of it.
fn assert_file(map: &IlluminationMap, texel_at: impl Fn(usize, usize) -> usize) {
    let texels = map.chart.texel_count();
    let of_lamp = irradiance(2, texels);
    let band: Vec<f32> = (0..texels).map(|texel| value(2, texel, 1)).collect();
    let size = (map.width(), map.height());
    let band_value: MapValue = Box::new(|texel| band[texel]);
    let others = rgb_values("caustic.lamp", &of_lamp).chain([("caustic.550nm".into(), band_value)]);
    let bytes = encode_map(map, size, others.collect(), "", "a file").expect("it fits");
    let image = decode(&bytes, "a file").expect("an image");
    assert_eq!((image.width, image.height), size);
    let one = |name: &str, expected: &dyn Fn(usize) -> f32| {
        let values = image.channel(name).unwrap_or_else(|| panic!("no {name}"));
        for (place, value) in values.iter().enumerate() {
            let texel = texel_at(place % size.0, place / size.0);
            assert_eq!(*value, expected(texel), "{name} at {place}");
        }
    };
    for (channel, letter) in ["R", "G", "B"].into_iter().enumerate() {
        one(&format!("caustic.{letter}"), &|texel| value(0, texel, channel));
        one(&format!("direct.{letter}"), &|texel| value(1, texel, channel));
        one(&format!("caustic.lamp.{letter}"), &|texel| {
            value(2, texel, channel)
        });
        one(letter, &|texel| {
            value(0, texel, channel) + value(1, texel, channel)
        });
    }
    one("error.Y", &|texel| value(3, texel, 0));
    one("caustic.550nm", &|texel| value(2, texel, 1));
}

#[test]
fn channels_hold_their_values_row_by_row() {
    let map = map(plane().chart(7, 5));
    assert_file(&map, |column, row| row * 7 + column);
}

#[test]
fn tiles_hold_each_texel_where_it_reaches() {
    // 3 × 2 tiles, the last column and row of which are cut, of every level that fits them.
    let levels = [0, 1, 2, 3, 1, 1];
    let layout = Arc::new(TileLayout::new((152, 104), &levels, &levels));
    let map = map(plane().tiled_chart(&layout).expect("an even chart"));
    let tiles: Vec<_> = layout.tiles().collect();
    assert!(tiles.iter().any(|tile| tile.level > 1), "{tiles:?}");
    assert_file(&map, |column, row| {
        let tile = &tiles[row / 64 * 3 + column / 64];
        let [x, y] = [column - tile.origin.0, row - tile.origin.1].map(|finest| finest >> tile.level);
        tile.texels.start + y * tile.size.0 + x
    });
}

#[test]
fn a_larger_file_holds_the_same_light() {
    let map = map(plane().chart(4, 3));
    let (width, height) = (10, 7);
    let bytes = encode_map(&map, (width, height), Vec::new(), "", "a file").expect("it fits");
    let image = decode(&bytes, "a file").expect("an image");
    let values = image.channel("caustic.G").expect("there");
    let texels = || map.layers[0].irradiance.iter().map(|e| f64::from(e[1]));
    // Means over the same surface.
    let mean = values.iter().map(|value| f64::from(*value)).sum::<f64>() / (width * height) as f64;
    assert!((mean / (texels().sum::<f64>() / 12.0) - 1.0).abs() < 1e-6);
    // The first texel of the file lies within the first of the map.
    assert_eq!(values[0], map.layers[0].irradiance[0][1]);
    assert_eq!(values[width * height - 1], map.layers[0].irradiance[11][1]);
}
