//! How differently two pictures look, pixel by pixel: FLIP for display light (Andersson et al., "FLIP: A Difference
//! Evaluator for Alternating Images", HPG 2020), filters split into rows and columns as in
//! <https://github.com/NVlabs/flip>.

use std::f64::consts::PI;

/// Pixels per degree of a 0.7 m wide display of 3840 pixels, seen from 0.7 m: the authors' usual one.
const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * PI / 180.0;

/// Colour differences are raised to this power …
const COLOUR_POWER: f64 = 0.7;
/// … and from this share of the largest one on they are squeezed into what is left above the next.
const KNEE: f64 = 0.4;
const KNEE_AT: f64 = 0.95;
/// Edges and points are looked for at this scale [degrees].
const FEATURE_WIDTH: f64 = 0.082;
const FEATURE_POWER: f64 = 0.5;

/// CIE XYZ of D65.
const WHITE: [f64; 3] = [0.950_428_545, 1.0, 1.088_900_371];

const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [
        10_135_552.0 / 24_577_794.0,
        8_788_810.0 / 24_577_794.0,
        4_435_075.0 / 24_577_794.0,
    ],
    [
        2_613_072.0 / 12_288_897.0,
        8_788_810.0 / 12_288_897.0,
        887_015.0 / 12_288_897.0,
    ],
    [
        1_425_312.0 / 73_733_382.0,
        8_788_810.0 / 73_733_382.0,
        70_074_185.0 / 73_733_382.0,
    ],
];
const RGB_FROM_XYZ: [[f64; 3]; 3] = [
    [3.241_003_275, -1.537_398_934, -0.498_615_861],
    [-0.969_224_334, 1.875_930_071, 0.041_554_224],
    [0.055_639_423, -0.204_011_202, 1.057_148_933],
];

/// Mean FLIP of two pictures as they are shown, RGBA with sRGB encoding: 0 where they look alike, at most 1.
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

/// A picture as an eye has it.
struct Seen {
    /// Blurred, L*a*b* with colours weighed by lightness.
    colours: Vec<[f64; 3]>,
    /// How strong edges are.
    edges: Vec<f64>,
    /// How strong points are.
    points: Vec<f64>,
}

impl Seen {
    fn new(bytes: &[u8], width: usize) -> Self {
        let opponent: Vec<[f64; 3]> = bytes
            .chunks_exact(4)
            .map(|pixel| {
                let linear = [0, 1, 2].map(|channel| decode(f64::from(pixel[channel]) / 255.0));
                let [x, y, z] = relative_xyz(linear);
                [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
            })
            .collect();
        let plane = |channel: usize| -> Vec<f64> { opponent.iter().map(|pixel| pixel[channel]).collect() };
        // Blue and yellow are blurred by the sum of two bells.
        let [y, cx, cz] = [0, 1, 2].map(plane);
        let [for_y, for_cx] = [(1.0, 0.0047), (1.0, 0.0053)].map(|(a, b)| normalised(&bell(a, b)));
        let [near, far] = [(34.1, 0.04), (13.5, 0.025)].map(|(a, b)| bell(a, b));
        let total = near.iter().sum::<f64>().hypot(far.iter().sum());
        let [near, far] =
            [near, far].map(|bell| bell.iter().map(|value| value / total).collect::<Vec<f64>>());
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

fn decode(code: f64) -> f64 {
    if code <= 0.040_45 {
        code / 12.92
    } else {
        ((code + 0.055) / 1.055).powf(2.4)
    }
}

fn transform(rows: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ over that of white.
fn relative_xyz(linear: [f64; 3]) -> [f64; 3] {
    let xyz = transform(&XYZ_FROM_RGB, linear);
    [0, 1, 2].map(|axis| xyz[axis] / WHITE[axis])
}

/// L*a*b* of linear sRGB, colours weighed by lightness after Hunt.
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

/// Distance in lightness plus that in colour.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Square root of a bell of the contrast sensitivity: applied along rows and columns it is the whole.
fn bell(a: f64, b: f64) -> Vec<f64> {
    // Three deviations of the widest bell.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    (-radius..=radius)
        .map(|offset| {
            let degrees = f64::from(offset) / PIXELS_PER_DEGREE;
            (a * (PI / b).sqrt()).sqrt() * (-PI * PI * degrees * degrees / b).exp()
        })
        .collect()
}

fn normalised(filter: &[f64]) -> Vec<f64> {
    let sum: f64 = filter.iter().sum();
    filter.iter().map(|value| value / sum).collect()
}

/// A gaussian and its derivatives: their positive and negative weights each add up to one.
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
    (
        normalised(&offsets().map(gauss).collect::<Vec<f64>>()),
        balanced(offsets().map(|x| -x * gauss(x)).collect()),
        balanced(
            offsets()
                .map(|x| (x * x / (deviation * deviation) - 1.0) * gauss(x))
                .collect(),
        ),
    )
}

/// One filter along rows, then one along columns; the outermost pixels go on beyond the picture.
fn filtered(values: &[f64], width: usize, across: &[f64], down: &[f64]) -> Vec<f64> {
    let height = values.len() / width;
    let along = |values: &[f64], filter: &[f64], at: &dyn Fn(usize, usize, isize) -> usize| -> Vec<f64> {
        let radius = (filter.len() / 2) as isize;
        (0..values.len())
            .map(|pixel| {
                let (column, row) = (pixel % width, pixel / width);
                let taps = (-radius..).zip(filter);
                taps.map(|(offset, weight)| weight * values[at(column, row, offset)])
                    .sum()
            })
            .collect()
    };
    let shifted =
        |place: usize, offset: isize, size: usize| place.saturating_add_signed(offset).min(size - 1);
    let rows = along(values, across, &|column, row, offset| {
        row * width + shifted(column, offset, width)
    });
    along(&rows, down, &|column, row, offset| {
        shifted(row, offset, height) * width + column
    })
}

/// Two pictures of stripes, a disc and a gradient, the second one changed by `change`.
fn sample(change: impl Fn(usize, usize, [f64; 3]) -> [f64; 3]) -> [Vec<u8>; 2] {
    let size = 48usize;
    let picture = |changed: bool| -> Vec<u8> {
        (0..size * size)
            .flat_map(|pixel| {
                let (x, y) = (pixel % size, pixel / size);
                let stripe = if x / 6 % 2 == 0 { 200.0 } else { 60.0 };
                let is_disc = x.abs_diff(30).pow(2) + y.abs_diff(20).pow(2) < 64;
                let red = if is_disc { 250.0 } else { stripe };
                let colour = [red, stripe, 5.0 * y as f64];
                let shown = if changed { change(x, y, colour) } else { colour };
                let [r, g, b] = shown.map(|channel| channel as u8);
                [r, g, b, u8::MAX]
            })
            .collect()
    };
    [picture(false), picture(true)]
}

/// The figures are what the authors' own code gives, in single precision.
#[test]
fn flip_gives_the_figures_of_its_authors_program() {
    let same = sample(|_, _, colour| colour);
    assert_eq!(mean_flip(&same[0], &same[1], 48), 0.0);
    let tinted = sample(|_, _, [r, g, b]| [r, g * 0.9, b]);
    let brightened = sample(|x, y, colour| if x == 11 && y == 31 { [255.0; 3] } else { colour });
    let inverted = sample(|_, _, colour| colour.map(|channel| 255.0 - channel));
    for ([reference, test], expected) in [
        (tinted, 0.348_323_2),
        (brightened, 0.003_162_9),
        (inverted, 0.939_610_7),
    ] {
        crate::support::assert_close(mean_flip(&reference, &test, 48), expected, 2e-4, "mean FLIP");
    }
}
