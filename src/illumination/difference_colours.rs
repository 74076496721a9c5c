//! False colours of what an effect adds or takes away: warm is more, cool is less.

use super::difference::SignedMap;
use super::false_colours::mixed;

/// Magnitudes at the middle of the scale and at its ends, relative to the map's mean: 1 % and 1000 %, in both
/// directions and logarithmic in between.
pub const RANGE: (f64, f64) = (1e-2, 10.0);

/// Display colours (sRGB) from no difference to the end of the scale, where light is added: warm.
const ADDED: [[u8; 3]; 4] = [[38, 38, 42], [128, 52, 24], [232, 122, 32], [255, 226, 150]];
/// The same where light is removed: cool.
const TAKEN: [[u8; 3]; 4] = [[38, 38, 42], [24, 62, 128], [52, 140, 226], [190, 230, 255]];

/// Display colour (sRGB) of a difference relative to the map's mean, clamped to the ends of the scale.
pub fn colour(relative: f64) -> [u8; 3] {
    let stops = if relative < 0.0 { TAKEN } else { ADDED };
    mixed(&stops, place(relative.abs()))
}

/// Position of a magnitude between the middle of the scale (0) and its ends (1).
fn place(size: f64) -> f64 {
    let (low, high) = RANGE;
    let place = ((size / low).log10() / (high / low).log10()).clamp(0.0, 1.0);
    if place.is_nan() { 0.0 } else { place }
}

/// The difference at a position on the scale, from one end (−1) to the other (1).
pub fn at(place: f64) -> f64 {
    let (low, high) = RANGE;
    (low * (high / low).powf(place.abs())).copysign(place)
}

/// Display colours (sRGB) of a map's texels, by their differences relative to its mean.
pub fn of_map(map: &SignedMap) -> impl Iterator<Item = [u8; 3]> {
    let mean = map.mean_w_m2;
    map.irradiance.iter().map(move |difference| {
        colour(if mean > 0.0 {
            f64::from(*difference) / mean
        } else {
            0.0
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warm_is_more_cool_is_less_and_dark_is_none() {
        let warmth = |[r, _, b]: [u8; 3]| i32::from(r) - i32::from(b);
        let (low, high) = RANGE;
        for step in 1..=20 {
            let size = low * (high / low).powf(f64::from(step) / 20.0);
            assert!(warmth(colour(size)) > 0, "{size}: {:?}", colour(size));
            assert!(warmth(colour(-size)) < 0, "{size}: {:?}", colour(-size));
        }
        let brightness = |colour: [u8; 3]| colour.iter().map(|code| u32::from(*code)).sum::<u32>();
        for sign in [-1.0, 1.0] {
            let steps: Vec<_> = (0..=20)
                .map(|step| brightness(colour(at(sign * f64::from(step) / 20.0))))
                .collect();
            assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
            assert_eq!(colour(sign * 1e9), colour(sign * high), "the scale's end goes on");
            assert_eq!(
                colour(sign * 0.99 * low),
                colour(0.0),
                "below the scale is nothing"
            );
        }
        assert_eq!(colour(f64::NAN), colour(0.0));
    }

    #[test]
    fn places_of_the_scale_run_from_end_to_end() {
        let (low, high) = RANGE;
        for (place, expected) in [(-1.0, -high), (1.0, high), (0.0, low)] {
            assert!(
                (at(place) / expected - 1.0).abs() < 1e-12,
                "{place}: {}",
                at(place)
            );
        }
        assert!((at(0.5) / (low * high).sqrt() - 1.0).abs() < 1e-12);
    }
}
