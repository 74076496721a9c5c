//! From radiance to what a display shows: exposure, tone mapping, sRGB encoding. The twin of
//! `shaders/shared/tone_map.wgsl`.

use super::{Picture, ToneMap};
use crate::optics::LinearSrgb;

/// Where auto exposure brings the log-average luminance: the 18 % grey card.
const MIDDLE_GREY: f64 = 0.18;

/// Khronos PBR Neutral, exact below its shoulder, hue kept above it.
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

impl ToneMap {
    /// Display light [0, 1] from exposed radiance, where 1 is the display's white. Negative channels count as 0.
    pub fn apply(self, exposed: LinearSrgb) -> LinearSrgb {
        let exposed = exposed.map(|channel| channel.max(0.0));
        let display = match self {
            Self::None => exposed,
            Self::Neutral => neutral(exposed),
        };
        display.map(|channel| channel.clamp(0.0, 1.0))
    }
}

/// A picture as sRGB-encoded bytes, RGBA with full alpha, row by row: radiance × 2^`exposure_stops`, tone-mapped.
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

/// Exposure [stops] that brings the log-average luminance of the lit pixels to middle grey, or less where their
/// brightest tenth would go beyond white; 0 for a black picture.
///
/// Pixels more than 8 stops below the mean count as unlit, so that neither black surroundings nor the last traces of
/// light decide.
pub fn auto_exposure_stops(picture: &Picture) -> f64 {
    let luminance = |rgb: &[f32; 3]| LinearSrgb::from(rgb.map(f64::from)).luminance();
    let mut lit: Vec<f64> = picture.radiance.iter().map(luminance).collect();
    lit.retain(|luminance| luminance.is_finite() && *luminance > 0.0);
    let mean = lit.iter().sum::<f64>() / picture.radiance.len().max(1) as f64;
    lit.retain(|luminance| *luminance > mean / 256.0);
    if lit.is_empty() {
        return 0.0;
    }
    let log_average = lit.iter().map(|luminance| luminance.log2()).sum::<f64>() / lit.len() as f64;
    let tenth = lit.len() * 9 / 10;
    let (_, bright, _) = lit.select_nth_unstable_by(tenth, f64::total_cmp);
    (MIDDLE_GREY.log2() - log_average).min(-bright.log2())
}
