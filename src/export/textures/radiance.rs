//! Radiance pictures (Ward, "Real pixels", Graphics Gems II, 1991): three mantissas of eight bits and one exponent.

use super::encoding::{Encoded, Notes};
use super::texels::Texels;

/// The largest value: 255/256 · 2^127.
pub const MOST: f32 = 255.0 / 256.0 * 1.701_411_8e38;

/// Widths that rows may be run-length encoded at.
const RUN_WIDTHS: std::ops::RangeInclusive<usize> = 8..=32767;
/// Shortest run that is worth its two bytes.
const LEAST_RUN: usize = 3;
/// Most bytes of a run, and of what lies between two.
const MOST_RUN: usize = 127;
const MOST_DUMP: usize = 128;

/// The file. Values below 0 become 0, and so do channels of less than 1/512 of their texel's largest; each is rounded to
/// the nearest step. Multiplied by 2^stops, it says so by EXPOSURE, by which readers divide.
pub fn encode(texels: &Texels, notes: &Notes<'_>) -> Encoded {
    let (width, height) = texels.size();
    let mut bytes = format!(
        "#?RADIANCE\nSOFTWARE=nephroid {}\nFORMAT=32-bit_rle_rgbe\n",
        env!("CARGO_PKG_VERSION")
    )
    .into_bytes();
    if notes.exposure_stops != 0.0 {
        bytes.extend(format!("EXPOSURE={}\n", notes.exposure_stops.exp2()).bytes());
    }
    let comment: String = notes.comment().chars().filter(|c| !c.is_control()).collect();
    bytes.extend(format!("# {comment}\n\n-Y {height} +X {width}\n").bytes());
    let codes: Vec<[u8; 4]> = texels.values().iter().map(|texel| code(*texel)).collect();
    for row in codes.chunks(width) {
        write_row(row, &mut bytes);
    }
    Encoded {
        bytes,
        stored: codes.iter().map(|code| value(*code)).collect(),
        levels: 1,
    }
}

/// Mantissas and exponent of a texel.
fn code(texel: [f32; 3]) -> [u8; 4] {
    let [r, g, b] = texel.map(|value| f64::from(value).max(0.0));
    let largest = r.max(g).max(b);
    if largest <= 0.0 {
        return [0; 4];
    }
    // largest = m · 2^exponent with m in [0.5, 1), unless it would be rounded up to 256/256.
    let mut exponent = largest.log2().floor() as i32 + 1;
    if (largest * f64::from(8 - exponent).exp2()).round() >= 256.0 {
        exponent += 1;
    }
    if exponent <= -128 {
        return [0; 4];
    }
    let scale = f64::from(8 - exponent).exp2();
    let [r, g, b] = [r, g, b].map(|value| (value * scale).round() as u8);
    [r, g, b, (exponent + 128).min(255) as u8]
}

/// What readers make of it, before they divide by the exposure.
fn value([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    if exponent == 0 {
        return [0.0; 3];
    }
    let scale = f64::from(i32::from(exponent) - 136).exp2();
    [r, g, b].map(|mantissa| (f64::from(mantissa) * scale) as f32)
}

/// A row: component by component in runs, where its width allows that.
fn write_row(row: &[[u8; 4]], bytes: &mut Vec<u8>) {
    if !RUN_WIDTHS.contains(&row.len()) {
        bytes.extend(row.as_flattened());
        return;
    }
    bytes.extend([2, 2]);
    bytes.extend((row.len() as u16).to_be_bytes());
    for component in 0..4 {
        let values: Vec<u8> = row.iter().map(|texel| texel[component]).collect();
        write_runs(&values, bytes);
    }
}

/// Runs of at most 127 alike (128 + length, value), and what lies between them (length, values).
fn write_runs(values: &[u8], bytes: &mut Vec<u8>) {
    let run_at = |start: usize| {
        let same = values[start..]
            .iter()
            .take_while(|value| **value == values[start]);
        same.count().min(MOST_RUN)
    };
    let mut start = 0;
    while start < values.len() {
        let run = run_at(start);
        if run >= LEAST_RUN {
            bytes.extend([128 + run as u8, values[start]]);
            start += run;
            continue;
        }
        let mut end = start + run;
        while end < values.len() && end - start < MOST_DUMP && run_at(end) < LEAST_RUN {
            end += 1;
        }
        let end = end.min(start + MOST_DUMP);
        bytes.push((end - start) as u8);
        bytes.extend(&values[start..end]);
        start = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_within_half_a_step_of_the_largest() {
        for exponent in -40..40 {
            for share in [1.0, 0.999, 0.75, 0.5001, 0.5] {
                let largest = (f64::from(exponent).exp2() * share) as f32;
                let texel = [largest, largest * 0.3, largest * 0.01];
                let got = value(code(texel));
                for (wanted, got) in texel.iter().zip(got) {
                    assert!(
                        (wanted - got).abs() <= largest / 256.0 * 1.0001,
                        "{texel:?}: {got}"
                    );
                }
            }
        }
        assert_eq!(code([0.0, -1.0, 0.0]), [0; 4]);
        assert_eq!(code([1e-39, 0.0, 0.0]), [0; 4]);
        assert_eq!(value(code([MOST; 3])), [MOST; 3]);
    }
}
