//! From radiance to display colours: exposure, tone mapping, sRGB encoding. The twin of `shaders/shared/tone_map.wgsl`.

use super::{Picture, ToneMap};
use crate::illumination::visible::MIDDLE_GREY;
use crate::optics::{LinearSrgb, luminance};

/// Khronos PBR Neutral: exact below its shoulder, preserves hue above it.
/// Source: <https://github.com/KhronosGroup/ToneMapping/tree/main/PBR_Neutral>.
fn neutral(exposed: LinearSrgb) -> LinearSrgb {
    const SHOULDER: f64 = 0.8 - 0.04;
    const DESATURATION: f64 = 0.15;
    let darkest = exposed.r.min(exposed.g).min(exposed.b);
    let offset = if darkest < 0.08 {
        darkest - 6.25 * darkest * darkest
    } else {
        0.04
    };
    let colour = exposed.map(|channel| channel - offset);
    let peak = colour.max_channel();
    if peak < SHOULDER {
        return colour;
    }
    let span = 1.0 - SHOULDER;
    let new_peak = 1.0 - span * span / (peak + span - SHOULDER);
    let whiteness = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    colour * (new_peak / peak) * (1.0 - whiteness) + LinearSrgb::grey(new_peak * whiteness)
}

/// Rows of a 3 × 3 matrix.
type Rows = [[f64; 3]; 3];

fn transform(rows: &Rows, colour: LinearSrgb) -> LinearSrgb {
    let [r, g, b] = rows.map(|[r, g, b]| r * colour.r + g * colour.g + b * colour.b);
    LinearSrgb::new(r, g, b)
}

/// AgX's working space has the primaries of BT.709, moved a fifth of the way towards D65: every channel is four fifths of
/// itself plus these shares of all three. Computed from that rule, so that greys stay grey; the rounded matrix of the
/// sources differs by 1e-4.
const AGX_SHARES: [f64; 3] = [
    0.042_398_929_049_531,
    0.078_430_165_104_864,
    0.079_170_905_845_605,
];

/// The part of a colour that every channel of the working space shares.
fn agx_fifth(colour: LinearSrgb) -> LinearSrgb {
    let [r, g, b] = AGX_SHARES;
    LinearSrgb::grey(r * colour.r + g * colour.g + b * colour.b)
}

/// log2(0.18) − 10 and log2(0.18) + 6.5: ten stops below and 6.5 above middle grey.
const AGX_STOPS: [f64; 2] = [-12.473_931_188_332_413, 4.026_068_811_667_587];

/// AgX's sigmoid from [0, 1] to display codes [0, 1]. Middle grey maps to 1/2 with slope 2; the exponents are 3 below
/// it and 3.25 above. The scales bring the ends to 0 and 1.
///
/// This is the closed form behind the reference's table, not one of its polynomial approximations.
/// Source: `AgX.py` of <https://github.com/sobotka/SB2383-Configuration-Generation>, after Jed Smith; matches every
/// entry that was compared of `AgX_Default_Contrast.spi1d` in <https://github.com/sobotka/AgX>.
fn agx_contrast(position: f64) -> f64 {
    const PIVOT: f64 = 10.0 / 16.5;
    let rise = 2.0 * (position - PIVOT);
    let (power, scale) = if rise < 0.0 {
        (3.0, 0.512_277_382_293_071_4)
    } else {
        (3.25, 0.541_464_156_278_149_7)
    };
    0.5 + rise * (1.0 + (rise.abs() / scale).powf(power)).powf(-1.0 / power)
}

/// Troy Sobotka's AgX without a look. Everything darker than ten stops below middle grey is 0.
/// Sources: <https://github.com/sobotka/AgX>; the order of its steps and the final display exponent of 2.2 follow
/// <https://iolite-engine.com/blog_posts/minimal_agx_implementation>.
fn agx(exposed: LinearSrgb) -> LinearSrgb {
    let [least, most] = AGX_STOPS;
    let codes = (exposed * 0.8 + agx_fifth(exposed))
        .map(|channel| agx_contrast((channel.log2().clamp(least, most) - least) / (most - least)));
    ((codes - agx_fifth(codes)) * 1.25).map(|code| code.max(0.0).powf(2.2))
}

/// Stephen Hill's fit of the ACES reference rendering and output transforms, with its matrices from and to linear sRGB.
/// Greys below 0.0033 become 0, those above 25.7 white. It is a fit, not the Academy's own transform.
/// Source: `ACES.hlsl` of <https://github.com/TheRealMJP/BakingLab>.
fn aces(exposed: LinearSrgb) -> LinearSrgb {
    const INPUT: Rows = [
        [0.597_19, 0.354_58, 0.048_23],
        [0.076_00, 0.908_34, 0.015_66],
        [0.028_40, 0.133_83, 0.837_77],
    ];
    const OUTPUT: Rows = [
        [1.604_75, -0.531_08, -0.073_67],
        [-0.102_08, 1.108_13, -0.006_05],
        [-0.003_27, -0.072_76, 1.076_02],
    ];
    let curve =
        |v: f64| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951_0) + 0.238_081);
    transform(&OUTPUT, transform(&INPUT, exposed).map(curve))
}

/// Exact up to 0.4, logarithmic above: 1 maps to 0.62, each stop above adds a tenth, and four stops above reach white.
/// Preserves hue, except that the brightest colours desaturate by up to two fifths.
fn soft(exposed: LinearSrgb) -> LinearSrgb {
    const SHOULDER: f64 = 0.4;
    /// Maps 16 to 1, with slope 1 at the shoulder.
    const STEP: f64 = 0.123_872_741_774_841_12;
    const MAX_WHITENESS: f64 = 0.4;
    let peak = exposed.max_channel();
    if peak <= SHOULDER {
        return exposed;
    }
    let rise = STEP * ((peak - SHOULDER) / STEP).ln_1p();
    let new_peak = (SHOULDER + rise).min(1.0);
    let whiteness = MAX_WHITENESS * ((new_peak - SHOULDER) / (1.0 - SHOULDER)).powi(3);
    // This order of operations keeps greys bit-identical.
    ((exposed / peak) * (1.0 - whiteness) + LinearSrgb::grey(whiteness)) * new_peak
}

impl ToneMap {
    /// Display light [0, 1] of exposed radiance, where 1 is display white. Negative channels are clamped to 0.
    pub fn apply(self, exposed: LinearSrgb) -> LinearSrgb {
        let exposed = exposed.map(|channel| channel.max(0.0));
        let display = match self {
            Self::None => exposed,
            Self::Neutral => neutral(exposed),
            Self::AgX => agx(exposed),
            Self::Aces => aces(exposed),
            Self::Soft => soft(exposed),
        };
        display.map(|channel| channel.clamp(0.0, 1.0))
    }
}

/// Encodes a picture as opaque sRGB RGBA8, row by row, after exposure by 2^`exposure_stops` and tone mapping.
pub fn display_rgba8(picture: &Picture, exposure_stops: f64, tone_map: ToneMap) -> Vec<u8> {
    let exposure = exposure_stops.exp2();
    let pixel = |radiance: &[f32; 3]| {
        let exposed = LinearSrgb::from(radiance.map(f64::from)) * exposure;
        let code = |channel| (LinearSrgb::encode_channel(channel) * 255.0).round() as u8;
        let display = tone_map.apply(exposed);
        [code(display.r), code(display.g), code(display.b), u8::MAX]
    };
    picture.radiance.iter().flat_map(pixel).collect()
}

/// Exposed luminance of pale surfaces in full light [1]: plaster, linen and paper, of albedo 0.6 to 0.8, beside a grey card.
const PALE: f64 = 0.6;

impl Picture {
    /// Exposure [stops] that brings the log-average luminance of the lit pixels to middle grey; 0 for a black picture.
    /// The average leaves out the darkest and the brightest tenth. The exposure is lower where the brightest tenth
    /// would exceed white, and up to a stop higher where it would stay below 0.6 of white.
    ///
    /// Pixels more than 8 stops below the mean count as unlit, so that neither black surroundings nor faint residual
    /// light affect the result.
    pub fn auto_exposure_stops(&self) -> f64 {
        let mut lit: Vec<f64> = self.radiance.iter().map(luminance).collect();
        lit.retain(|luminance| luminance.is_finite() && *luminance > 0.0);
        let mean = lit.iter().sum::<f64>() / self.radiance.len().max(1) as f64;
        lit.retain(|luminance| *luminance > mean / 256.0);
        if lit.is_empty() {
            return 0.0;
        }
        lit.sort_unstable_by(f64::total_cmp);
        let tenth = lit.len() / 10;
        let (most, bright) = (&lit[tenth..lit.len() - tenth], lit[lit.len() * 9 / 10]);
        let log_average = most.iter().map(|luminance| luminance.log2()).sum::<f64>() / most.len() as f64;
        let stops = MIDDLE_GREY.log2() - log_average;
        let lifted = (PALE.log2() - bright.log2()).min(stops + 1.0);
        stops.min(-bright.log2()).max(lifted)
    }
}
