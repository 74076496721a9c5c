//! Smoothing of flux on a map.

use nephroid::illumination::accumulator::FluxAccumulator;
use nephroid::illumination::smoothing::smooth;
use nephroid::illumination::tiles::TileLayout;

use crate::bake::common::with_threads;

fn sums(flux: &FluxAccumulator) -> [i64; 3] {
    flux.texels().iter().fold([0; 3], |sum, texel| {
        std::array::from_fn(|channel| sum[channel] + texel[channel])
    })
}

fn speckled(width: usize, height: usize) -> FluxAccumulator {
    let mut flux = FluxAccumulator::new(width, height);
    for (index, texel) in flux.texels_mut().iter_mut().enumerate() {
        let speckle = (index as i64).wrapping_mul(0x9e37_79b9_7f4a_7c15_u64 as i64);
        *texel = [
            (speckle >> 20) & 0xff_ffff,
            speckle & 7,
            i64::from(index % 97 == 5) << 50,
        ];
    }
    flux
}

#[test]
fn no_count_is_lost() {
    for (width, height) in [(1, 1), (1, 9), (7, 1), (64, 48), (5, 200)] {
        for spread in [0.01, 0.3, 1.0, 2.5, 17.0, 400.0, 1e12, f64::INFINITY] {
            let mut flux = speckled(width, height);
            let before = sums(&flux);
            smooth(&mut flux, None, spread);
            assert_eq!(sums(&flux), before, "{width} × {height}, {spread}");
            assert!(flux.texels().iter().flatten().all(|&count| count >= 0));
        }
    }
}

/// Tiles of any level are smoothed as the map of one size that they stand for, texel by texel.
#[test]
fn tiles_are_smoothed_as_one_map() {
    let (width, height) = (256, 128);
    let levels = [0, 2, 6, 0, 3, 0, 1, 5];
    let layout = TileLayout::new((width, height), &levels, &levels);
    // Even within the coarsest tile, as tiles say that they are.
    let density = |column: usize, row: usize| 1_i64 << (20 + 4 * (layout.tile_at(column, row) % 3));
    let mut even = FluxAccumulator::new(width, height);
    let mut tiled = FluxAccumulator::new(layout.texel_count(), 1);
    for index in 0..width * height {
        let (column, row) = (index % width, index / width);
        let counts = [density(column, row); 3];
        even.texels_mut()[index] = counts;
        let sum = &mut tiled.texels_mut()[layout.texel(column, row)];
        *sum = std::array::from_fn(|channel| sum[channel] + counts[channel]);
    }
    let total = sums(&even);
    for spread in [0.4, 3.0, 5.0, 20.0] {
        let (mut even, mut tiled) = (even.clone(), tiled.clone());
        smooth(&mut even, None, spread);
        smooth(&mut tiled, Some(&layout), spread);
        assert_eq!(sums(&tiled), total);
        let mut under = FluxAccumulator::new(layout.texel_count(), 1);
        for (index, counts) in even.texels().iter().enumerate() {
            let sum = &mut under.texels_mut()[layout.texel(index % width, index / width)];
            *sum = std::array::from_fn(|channel| sum[channel] + counts[channel]);
        }
        for (a, b) in tiled.texels().iter().zip(under.texels()) {
            assert!(
                (a[0] - b[0]).abs() <= b[0] / 1000 + 1_000_000,
                "{a:?} {b:?} at {spread}"
            );
        }
    }
}

#[test]
fn no_spread_changes_nothing() {
    for spread in [0.0, -1.0, f64::NAN] {
        let mut flux = speckled(20, 30);
        smooth(&mut flux, None, spread);
        assert_eq!(flux, speckled(20, 30));
    }
}

#[test]
fn points_spread_by_the_variance() {
    let (width, height) = (128, 112);
    // The last two go by way of a coarser map, in which places are rounded: the mean of points at all of them.
    for (spread, places) in [(0.2, 1), (0.5, 1), (1.0, 1), (3.0, 1), (4.5, 4), (9.0, 4)] {
        let [mut x, mut y, mut xx, mut yy, mut peak] = [0.0; 5];
        for place in 0..places {
            let (across, down) = (64 + place, 56 + place);
            let mut flux = FluxAccumulator::new(width, height);
            flux.texels_mut()[down * width + across] = [1 << 50; 3];
            smooth(&mut flux, None, spread);
            for (index, texel) in flux.texels().iter().enumerate() {
                let column = (index % width) as f64 - across as f64;
                let row = (index / width) as f64 - down as f64;
                let share = texel[1] as f64 / (1_i64 << 50) as f64 / places as f64;
                x += share * column;
                y += share * row;
                xx += share * column * column;
                yy += share * row * row;
                peak += if column == 0.0 && row == 0.0 { share } else { 0.0 };
            }
        }
        assert!(x.abs() < 1e-9 && y.abs() < 1e-9, "{x} {y}");
        // Of a gaussian, 0.11 % of the variance lies beyond four spreads.
        for variance in [xx, yy] {
            assert!(
                (variance / (spread * spread) - 1.0).abs() < 2e-3,
                "{variance} at {spread}"
            );
        }
        let gaussian = 1.0 / (std::f64::consts::TAU * spread * spread);
        assert!(
            spread < 3.0 || (peak / gaussian - 1.0).abs() < if places == 1 { 0.04 } else { 0.06 },
            "{peak} {gaussian}"
        );
    }
}

#[test]
fn even_flux_stays_even_and_all_evens_out() {
    let mut flux = FluxAccumulator::new(40, 25);
    flux.texels_mut().fill([1_000_000; 3]);
    smooth(&mut flux, None, 3.0);
    assert!(
        flux.texels()
            .iter()
            .flatten()
            .all(|count| (count - 1_000_000).abs() <= 1)
    );
    let mut flux = speckled(40, 25);
    let mean = sums(&flux)[0] / 1000;
    smooth(&mut flux, None, 1000.0);
    for texel in flux.texels() {
        assert!(
            (texel[0] - mean).abs() <= 2 + mean / 1_000_000,
            "{texel:?} {mean}"
        );
    }
}

#[test]
fn borders_mirror() {
    // A wide map that mirrors a narrow one at its right border smooths to the narrow one's result there.
    let (width, height, reach) = (12, 10, 12);
    let narrow = speckled(width, height);
    let mut wide = FluxAccumulator::new(3 * width, height);
    for (index, texel) in wide.texels_mut().iter_mut().enumerate() {
        let (column, row) = (index % (3 * width), index / (3 * width));
        let place = (column + width) % (2 * width);
        *texel = narrow.texels()[row * width + place.min(2 * width - 1 - place)];
    }
    let (mut narrow, mut wide) = (narrow, wide);
    smooth(&mut narrow, None, 2.0);
    smooth(&mut wide, None, 2.0);
    for (index, a) in narrow.texels().iter().enumerate() {
        let b = wide.texels()[index / width * 3 * width + reach + index % width];
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= 4 + (b >> 40), "{a} {b}");
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let smoothed = |threads: usize| {
        with_threads(threads, || {
            let mut flux = speckled(64, 50);
            smooth(&mut flux, None, 1.7);
            flux
        })
    };
    let one = smoothed(1);
    for threads in [2, 4, 7] {
        assert!(smoothed(threads) == one, "{threads} threads");
    }
}
