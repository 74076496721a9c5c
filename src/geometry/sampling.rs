//! Low-discrepancy points in the unit square, for positions on lamps and micro-normals.
//!
//! Sobol's (0, 2)-sequence with nested uniform scrambling by hashes, its order shuffled the same way, so that any number
//! of pairs may be drawn at one index (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020). The first 2ᵏ
//! points, and the next 2ᵏ, are each evenly spread.

use glam::DVec2;

/// Finaliser of SplitMix64, a hash of 64 bits without collisions (Steele, Lea and Flood, "Fast Splittable Pseudorandom
/// Number Generators", OOPSLA 2014).
pub fn mix64(mut bits: u64) -> u64 {
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}

/// Increment of SplitMix64: 2⁶⁴ divided by the golden ratio.
pub const GOLDEN_64: u64 = 0x9e37_79b9_7f4a_7c15;

/// Point of a sequence at an index, in [0, 1)². The points of different `pair`s of dimensions are independent for one
/// `seed`.
pub fn even_point(index: u32, pair: u32, seed: u64) -> DVec2 {
    let seed = hash(seed as u32 ^ hash((seed >> 32) as u32 ^ hash(pair)));
    let index = scrambled(index.reverse_bits(), seed).reverse_bits();
    let x = index.reverse_bits();
    let y = second(index);
    let unit = |code: u32, dimension: u32| {
        let code = scrambled(code.reverse_bits(), hash(seed ^ dimension)).reverse_bits();
        f64::from(code) * (-32_f64).exp2()
    };
    // Centre of the interval that 32 bits resolve: never 0.
    DVec2::new(unit(x, 0x9e37_79b9), unit(y, 0x7f4a_7c15)) + DVec2::splat((-33_f64).exp2())
}

/// A one-dimensional sequence at an index, as a whole number below 2⁶⁴: the first 2ᵏ indices have one point in each of
/// 2ᵏ equal strata, at a random place within it. Other seeds are independent.
pub fn even_code(index: u32, seed: u64) -> u64 {
    let folded = hash(seed as u32 ^ hash((seed >> 32) as u32 ^ 0x51ed_270b));
    let high = scrambled(index, folded).reverse_bits();
    let low = hash(index ^ hash(folded ^ 0x2c1b_3c6d));
    u64::from(high) << 32 | u64::from(low)
}

/// A number in [0, 1) that goes with the code of an index. Codes and numbers of 2ᵏ indices form a net, so that numbers
/// are stratified among neighbours in the code: every 2ʲ consecutive codes have one number in each 2ʲth of the
/// interval.
pub fn even_number(index: u32, seed: u64) -> f64 {
    let folded = hash(seed as u32 ^ hash((seed >> 32) as u32 ^ 0x6d2b_79f5));
    let high = scrambled(second(index).reverse_bits(), folded).reverse_bits();
    let low = hash(index ^ hash(folded ^ 0x1b87_3593));
    (u64::from(high) << 21 | u64::from(low >> 11)) as f64 * (-53_f64).exp2()
}

/// Sobol's second dimension: with the index's bits as coefficients of a polynomial p(x), highest power last, those of
/// p(x + 1) modulo 2. As (x + 1)ⁿ = xⁿ + 1 for powers of two n, each half adds its upper part to its lower one.
fn second(index: u32) -> u32 {
    let mut code = index.reverse_bits();
    code ^= code << 16;
    code ^= (code & 0x00ff_00ff) << 8;
    code ^= (code & 0x0f0f_0f0f) << 4;
    code ^= (code & 0x3333_3333) << 2;
    code ^ (code & 0x5555_5555) << 1
}

/// Owen scrambling of reversed bits: each bit is flipped by a hash of the lower ones (Laine and Karras 2011, with
/// Vegdahl's constants).
fn scrambled(mut code: u32, seed: u32) -> u32 {
    code ^= code.wrapping_mul(0x3d20_adea);
    code = code.wrapping_add(seed);
    code = code.wrapping_mul((seed >> 16) | 1);
    code ^= code.wrapping_mul(0x0552_6c56);
    code ^= code.wrapping_mul(0x53a2_2864);
    code
}

/// Mixes all bits (Wellons' lowbias32).
fn hash(mut code: u32) -> u32 {
    code ^= code >> 16;
    code = code.wrapping_mul(0x7feb_352d);
    code ^= code >> 15;
    code = code.wrapping_mul(0x846c_a68b);
    code ^ (code >> 16)
}

/// Column and row of a position along the Morton curve: its even and its odd bits.
pub fn unfolded(place: u64) -> [u32; 2] {
    let every_second = |code: u64| {
        let mut code = code & 0x5555_5555_5555_5555;
        for (shift, mask) in [
            (1, 0x3333_3333_3333_3333),
            (2, 0x0f0f_0f0f_0f0f_0f0f),
            (4, 0x00ff_00ff_00ff_00ff),
            (8, 0x0000_ffff_0000_ffff),
            (16, 0x0000_0000_ffff_ffff),
        ] {
            code = (code | code >> shift) & mask;
        }
        code as u32
    };
    [every_second(place), every_second(place >> 1)]
}

/// A position along the Morton curve as a point of the unit square.
pub fn in_square(place: u64) -> DVec2 {
    DVec2::from(unfolded(place).map(|code| (f64::from(code) + 0.5) * (-32_f64).exp2()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every elementary interval of area 2⁻ᵏ holds one of 2ᵏ consecutive points that begin at a multiple of 2ᵏ.
    #[test]
    fn points_are_nets() {
        for (pair, first) in [(0, 0), (1, 64), (7, 192)] {
            let points: Vec<DVec2> = (first..first + 64)
                .map(|index| even_point(index, pair, 5))
                .collect();
            for across in 0..=6_u32 {
                let (columns, rows) = (1 << across, 64 >> across);
                let mut seen = vec![0; 64];
                for point in &points {
                    let column = (point.x * f64::from(columns)) as usize;
                    let row = (point.y * f64::from(rows)) as usize;
                    seen[row * columns as usize + column] += 1;
                }
                assert!(
                    seen.iter().all(|&count| count == 1),
                    "pair {pair}, {columns} columns"
                );
            }
        }
    }

    /// The first 2ᵏ photons have a stratum each.
    #[test]
    fn codes_fill_strata_one_by_one() {
        for bits in [0, 5, 10] {
            let mut strata: Vec<u64> = (0..1_u32 << bits)
                .map(|index| even_code(index, 7) >> (63 - bits) >> 1)
                .collect();
            strata.sort_unstable();
            assert!(strata.into_iter().eq(0..1_u64 << bits), "{bits} bits");
        }
    }

    /// Numbers are stratified among neighbours in the code.
    #[test]
    fn codes_and_numbers_are_nets() {
        for across in 0..=8_u32 {
            let (columns, rows) = (1_u64 << across, 256 >> across);
            let mut seen = vec![0; 256];
            for index in 256..512 {
                let column = ((u128::from(even_code(index, 3)) * u128::from(columns)) >> 64) as usize;
                let row = (even_number(index, 3) * f64::from(rows)) as usize;
                seen[row * columns as usize + column] += 1;
            }
            assert!(seen.iter().all(|&count| count == 1), "{columns} columns");
        }
    }

    #[test]
    fn pairs_do_not_follow_each_other() {
        let count = 1024;
        let mean_product = (0..count)
            .map(|index| (even_point(index, 0, 1).x - 0.5) * (even_point(index, 1, 1).x - 0.5))
            .sum::<f64>()
            / f64::from(count);
        assert!(mean_product.abs() < 0.01, "{mean_product}");
    }
}
