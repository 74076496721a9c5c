//! Smoothing of flux on a map.

use nephroid::illumination::accumulator::FluxAccumulator;
use nephroid::illumination::smoothing::smooth;

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
            smooth(&mut flux, spread);
            assert_eq!(sums(&flux), before, "{width} × {height}, {spread}");
            assert!(flux.texels().iter().flatten().all(|&count| count >= 0));
        }
    }
}

#[test]
fn no_spread_changes_nothing() {
    for spread in [0.0, -1.0, f64::NAN] {
        let mut flux = speckled(20, 30);
        smooth(&mut flux, spread);
        assert_eq!(flux, speckled(20, 30));
    }
}

#[test]
fn a_point_spreads_by_the_variance() {
    let (width, height) = (81, 61);
    for spread in [0.2, 0.5, 1.0, 3.0] {
        let mut flux = FluxAccumulator::new(width, height);
        flux.texels_mut()[30 * width + 40] = [1 << 50; 3];
        smooth(&mut flux, spread);
        let [mut x, mut y, mut xx, mut yy] = [0.0; 4];
        for (index, texel) in flux.texels().iter().enumerate() {
            let (column, row) = ((index % width) as f64 - 40.0, (index / width) as f64 - 30.0);
            let share = texel[1] as f64 / (1_i64 << 50) as f64;
            x += share * column;
            y += share * row;
            xx += share * column * column;
            yy += share * row * row;
        }
        assert!(x.abs() < 1e-9 && y.abs() < 1e-9, "{x} {y}");
        // Of a gaussian, 0.11 % of the variance lies beyond four spreads.
        for variance in [xx, yy] {
            assert!(
                (variance / (spread * spread) - 1.0).abs() < 2e-3,
                "{variance} at {spread}"
            );
        }
        let peak = flux.texels()[30 * width + 40][1] as f64 / (1_i64 << 50) as f64;
        let gaussian = 1.0 / (std::f64::consts::TAU * spread * spread);
        assert!(
            spread < 3.0 || (peak / gaussian - 1.0).abs() < 0.04,
            "{peak} {gaussian}"
        );
    }
}

#[test]
fn even_flux_stays_even_and_all_evens_out() {
    let mut flux = FluxAccumulator::new(40, 25);
    flux.texels_mut().fill([1_000_000; 3]);
    smooth(&mut flux, 3.0);
    assert!(
        flux.texels()
            .iter()
            .flatten()
            .all(|count| (count - 1_000_000).abs() <= 1)
    );
    let mut flux = speckled(40, 25);
    let mean = sums(&flux)[0] / 1000;
    smooth(&mut flux, 1000.0);
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
    smooth(&mut narrow, 2.0);
    smooth(&mut wide, 2.0);
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
            smooth(&mut flux, 1.7);
            flux
        })
    };
    let one = smoothed(1);
    for threads in [2, 4, 7] {
        assert!(smoothed(threads) == one, "{threads} threads");
    }
}
