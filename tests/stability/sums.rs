//! Exact sums of flux.

use nephroid::illumination::accumulator::{FluxAccumulator, FluxUnit};
use nephroid::optics::LinearSrgb;

#[test]
fn a_hundred_million_small_deposits_in_one_texel_add_up() {
    let unit = FluxUnit::for_power(100.0);
    let deposit_w = 1e-6;
    let count = unit.count(LinearSrgb::grey(deposit_w));
    let mut accumulator = FluxAccumulator::new(1, 1);
    for _ in 0..100_000_000_u32 {
        for (sum, deposit) in accumulator.texels_mut()[0].iter_mut().zip(count) {
            *sum += deposit;
        }
    }
    let sum = unit.flux_w(accumulator.texels()[0]);
    assert!((sum.g / 100.0 - 1.0).abs() < 1e-9, "{sum:?}");
}

#[test]
fn units_keep_their_precision_at_any_power() {
    for power_w in [1e-30, 1e-9, 1.0, 683.0, 1e12, 1e30] {
        let unit = FluxUnit::for_power(power_w);
        let half = LinearSrgb::new(power_w, 0.5 * power_w, 1e-9 * power_w);
        let back = unit.flux_w(unit.count(half));
        assert!((back.r / half.r - 1.0).abs() < 1e-15, "{power_w} W");
        assert!((back.b / half.b - 1.0).abs() < 1e-8, "{power_w} W");
    }
}

#[test]
fn spreading_a_coarse_map_keeps_every_count_and_is_smooth() {
    let mut coarse = FluxAccumulator::new(4, 4);
    for (index, texel) in coarse.texels_mut().iter_mut().enumerate() {
        *texel = [640_000, 1 << 58, 7 * index as i64 + 1];
    }
    let mut fine = FluxAccumulator::new(8, 8);
    coarse.spread_into(&mut fine);
    for channel in 0..3 {
        let sum = |map: &FluxAccumulator| {
            map.texels()
                .iter()
                .map(|texel| i128::from(texel[channel]))
                .sum::<i128>()
        };
        assert_eq!(sum(&coarse), sum(&fine));
    }
    // An even field stays even, borders included.
    assert!(
        fine.texels().iter().all(|texel| texel[0] == 160_000),
        "{:?}",
        fine.texels()
    );
}
