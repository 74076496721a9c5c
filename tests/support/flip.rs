//! FLIP, the perceived difference of two pictures, for low dynamic range (Andersson et al., "FLIP: A Difference
//! Evaluator for Alternating Images", HPG 2020), with separable filters as in <https://github.com/NVlabs/flip>.

use crate::prelude::*;

/// Pixels per degree of a display 0.7 m wide with 3840 pixels, seen from 0.7 m: the authors' default.
const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * PI / 180.0;

/// Exponent of colour differences.
const COLOUR_POWER: f64 = 0.7;
/// Colour differences above this fraction of the largest one are compressed into the range from `KNEE_AT` to 1.
const KNEE: f64 = 0.4;
const KNEE_AT: f64 = 0.95;
/// Width of the feature detector [degrees].
const FEATURE_WIDTH: f64 = 0.082;
const FEATURE_POWER: f64 = 0.5;

/// XYZ of D65.
const WHITE: [f64; 3] = [0.950_428_545, 1.0, 1.088_900_371];

const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [0.412_386_563, 0.357_591_491, 0.180_450_491],
    [0.212_636_822, 0.715_182_982, 0.072_180_196],
    [0.019_330_620, 0.119_197_164, 0.950_372_587],
];
const RGB_FROM_XYZ: [[f64; 3]; 3] = [
    [3.241_003_275, -1.537_398_934, -0.498_615_861],
    [-0.969_224_334, 1.875_930_071, 0.041_554_224],
    [0.055_639_423, -0.204_011_202, 1.057_148_933],
];

/// Mean FLIP of two RGBA pictures in sRGB encoding: 0 if they look alike, at most 1.
pub fn mean_flip(reference: &[u8], test: &[u8], width: usize) -> f64 {
    let errors = flip(reference, test, width);
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// FLIP of each pixel.
pub fn flip(reference: &[u8], test: &[u8], width: usize) -> Vec<f64> {
    assert_eq!(reference.len(), test.len());
    let [reference, test] = [reference, test].map(|bytes| Seen::new(bytes, width));
    let largest = hyab(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0])).powf(COLOUR_POWER);
    (0..reference.colours.len())
        .map(|pixel| {
            let distance = hyab(reference.colours[pixel], test.colours[pixel]).powf(COLOUR_POWER);
            let knee = KNEE * largest;
            let colour = if distance < knee {
                distance * KNEE_AT / knee
            } else {
                KNEE_AT + (distance - knee) / (largest - knee) * (1.0 - KNEE_AT)
            };
            let apart =
                |values: fn(&Seen) -> &Vec<f64>| (values(&reference)[pixel] - values(&test)[pixel]).abs();
            let feature = apart(|seen| &seen.edges).max(apart(|seen| &seen.points)) * 0.5_f64.sqrt();
            colour.powf(1.0 - feature.powf(FEATURE_POWER))
        })
        .collect()
}

/// A picture after the filters of the visual system.
struct Seen {
    /// Filtered L*a*b* with Hunt-adjusted colours.
    colours: Vec<[f64; 3]>,
    /// Strength of edges.
    edges: Vec<f64>,
    /// Strength of points.
    points: Vec<f64>,
}

impl Seen {
    fn new(bytes: &[u8], width: usize) -> Self {
        let opponent = |pixel: &[u8]| {
            let linear = [0, 1, 2].map(|channel| LinearSrgb::decode_channel(pixel[channel]));
            let [x, y, z] = relative_xyz(linear);
            [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
        };
        let opponent: Vec<[f64; 3]> = bytes.chunks_exact(4).map(opponent).collect();
        let plane = |channel: usize| -> Vec<f64> { opponent.iter().map(|pixel| pixel[channel]).collect() };
        // The blue-yellow channel is filtered by the sum of two Gaussians.
        let [y, cx, cz] = [0, 1, 2].map(plane);
        let [for_y, for_cx] = [(1.0, 0.0047), (1.0, 0.0053)].map(|(a, b)| normalised(&bell(a, b)));
        let [near, far] = [(34.1, 0.04), (13.5, 0.025)].map(|(a, b)| bell(a, b));
        let total = near.iter().sum::<f64>().hypot(far.iter().sum());
        let [near, far] = [near, far].map(|bell| scaled(&bell, total));
        let y_seen = filtered(&y, width, &for_y, &for_y);
        let cx_seen = filtered(&cx, width, &for_cx, &for_cx);
        let [cz_near, cz_far] = [near, far].map(|filter| filtered(&cz, width, &filter, &filter));
        let colours = (0..y.len())
            .map(|pixel| {
                let grey = (y_seen[pixel] + 16.0) / 116.0;
                let x = grey + cx_seen[pixel] / 500.0;
                let z = grey - (cz_near[pixel] + cz_far[pixel]) / 200.0;
                let xyz = [x * WHITE[0], grey * WHITE[1], z * WHITE[2]];
                hunt(transform(&RGB_FROM_XYZ, xyz).map(|channel| channel.clamp(0.0, 1.0)))
            })
            .collect();
        let grey: Vec<f64> = y.iter().map(|y| (y + 16.0) / 116.0).collect();
        let (smooth, first, second) = derivatives();
        let strength = |derivative: &[f64]| {
            let across = filtered(&grey, width, derivative, &smooth);
            let down = filtered(&grey, width, &smooth, derivative);
            across.iter().zip(down).map(|(x, y)| x.hypot(y)).collect()
        };
        Self {
            colours,
            edges: strength(&first),
            points: strength(&second),
        }
    }
}

fn transform(rows: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ relative to white.
fn relative_xyz(linear: [f64; 3]) -> [f64; 3] {
    let xyz = transform(&XYZ_FROM_RGB, linear);
    [0, 1, 2].map(|axis| xyz[axis] / WHITE[axis])
}

/// Hunt-adjusted L*a*b* of linear sRGB.
fn hunt(linear: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz(linear).map(|value| {
        if value > DELTA.powi(3) {
            value.cbrt()
        } else {
            value / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    let lightness = 116.0 * y - 16.0;
    [
        lightness,
        0.01 * lightness * 500.0 * (x - y),
        0.01 * lightness * 200.0 * (y - z),
    ]
}

/// HyAB distance: absolute difference of lightness plus Euclidean distance of the colours.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Square root of a Gaussian of the contrast sensitivity function: applied along rows and columns it gives the
/// Gaussian.
fn bell(a: f64, b: f64) -> Vec<f64> {
    // Three standard deviations of the widest Gaussian.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    (-radius..=radius)
        .map(|offset| {
            let degrees = f64::from(offset) / PIXELS_PER_DEGREE;
            (a * (PI / b).sqrt()).sqrt() * (-PI * PI * degrees * degrees / b).exp()
        })
        .collect()
}

fn scaled(filter: &[f64], by: f64) -> Vec<f64> {
    filter.iter().map(|value| value / by).collect()
}

fn normalised(filter: &[f64]) -> Vec<f64> {
    scaled(filter, filter.iter().sum())
}

/// A Gaussian and its first two derivatives. The positive and the negative weights of each are normalised to a sum of
/// one.
fn derivatives() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let offsets = || (-radius..=radius).map(f64::from);
    let gauss = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
    let balanced = |filter: Vec<f64>| -> Vec<f64> {
        let positive: f64 = filter.iter().filter(|value| **value > 0.0).sum();
        let negative: f64 = -filter.iter().filter(|value| **value < 0.0).sum::<f64>();
        let share = |value: &f64| value / if *value > 0.0 { positive } else { negative };
        filter.iter().map(share).collect()
    };
    let second = |x: f64| (x * x / (deviation * deviation) - 1.0) * gauss(x);
    let smooth: Vec<f64> = offsets().map(gauss).collect();
    let first = offsets().map(|x| -x * gauss(x)).collect();
    (normalised(&smooth), balanced(first), balanced(offsets().map(second).collect()))
}

/// Filters along rows, then along columns; pixels at the border are repeated outside.
fn filtered(values: &[f64], width: usize, across: &[f64], down: &[f64]) -> Vec<f64> {
    let height = values.len() / width;
    let along = |values: &[f64], filter: &[f64], steps: (usize, usize)| -> Vec<f64> {
        let radius = (filter.len() / 2) as isize;
        let shifted =
            |place: usize, offset: isize, size: usize| place.saturating_add_signed(offset).min(size - 1);
        let at = |pixel: usize, offset: isize| {
            let column = shifted(pixel % width, offset * steps.0 as isize, width);
            let row = shifted(pixel / width, offset * steps.1 as isize, height);
            values[row * width + column]
        };
        let sum = |pixel: usize| (-radius..).zip(filter).map(|(offset, weight)| weight * at(pixel, offset)).sum();
        (0..values.len()).map(sum).collect()
    };
    along(&along(values, across, (1, 0)), down, (0, 1))
}
