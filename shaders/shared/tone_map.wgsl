// From exposed radiance to display light in [0, 1]; twin of eye_pass/tone_mapping.rs.

const TONE_MAP_NONE: u32 = 0u;
const TONE_MAP_NEUTRAL: u32 = 1u;
const TONE_MAP_AGX: u32 = 2u;
const TONE_MAP_ACES: u32 = 3u;
const TONE_MAP_SOFT: u32 = 4u;

// Khronos PBR Neutral: exact below its shoulder, preserves hue above it.
fn tone_map_neutral(exposed: vec3f) -> vec3f {
    let shoulder = 0.8 - 0.04;
    let desaturation = 0.15;
    let darkest = min(exposed.r, min(exposed.g, exposed.b));
    let offset = select(0.04, darkest - 6.25 * darkest * darkest, darkest < 0.08);
    let colour = exposed - offset;
    let peak = max(colour.r, max(colour.g, colour.b));
    if peak < shoulder {
        return colour;
    }
    let span = 1.0 - shoulder;
    let new_peak = 1.0 - span * span / (peak + span - shoulder);
    let whiteness = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    return mix(colour * (new_peak / peak), vec3f(new_peak), whiteness);
}

// AgX's working space has the primaries of BT.709, moved a fifth of the way towards D65: every channel is four fifths of
// itself plus these shares of all three.
const AGX_SHARES = vec3f(0.042398929049531, 0.078430165104864, 0.079170905845605);

// AgX's sigmoid in closed form: middle grey maps to 1/2 with slope 2; the exponents below and above it differ.
fn agx_contrast(position: vec3f) -> vec3f {
    let rise = 2.0 * (position - 10.0 / 16.5);
    let is_toe = rise < vec3f(0.0);
    let power = select(vec3f(3.25), vec3f(3.0), is_toe);
    let scale = select(vec3f(0.5414641562781497), vec3f(0.5122773822930714), is_toe);
    return 0.5 + rise * pow(1.0 + pow(abs(rise) / scale, power), -1.0 / power);
}

// Troy Sobotka's AgX without a look: from ten stops below middle grey to 6.5 above it.
fn tone_map_agx(exposed: vec3f) -> vec3f {
    let least = -12.473931188332413;
    let most = 4.026068811667587;
    // Keeps black away from the logarithm's pole.
    let inset = 0.8 * exposed + dot(AGX_SHARES, exposed);
    let stops = clamp(log2(max(inset, vec3f(1e-5))), vec3f(least), vec3f(most));
    let codes = agx_contrast((stops - least) / (most - least));
    return pow(max(1.25 * (codes - dot(AGX_SHARES, codes)), vec3f(0.0)), vec3f(2.2));
}

// Matrices are written row by row, so a colour is multiplied from the left.
const ACES_INPUT = mat3x3f(
    0.59719, 0.35458, 0.04823,
    0.07600, 0.90834, 0.01566,
    0.02840, 0.13383, 0.83777,
);
const ACES_OUTPUT = mat3x3f(
    1.60475, -0.53108, -0.07367,
    -0.10208, 1.10813, -0.00605,
    -0.00327, -0.07276, 1.07602,
);

// Stephen Hill's fit of ACES.
fn tone_map_aces(exposed: vec3f) -> vec3f {
    let v = exposed * ACES_INPUT;
    let fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return fitted * ACES_OUTPUT;
}

// Exact up to its shoulder, logarithmic up to 16; preserves hue, except in the brightest colours.
fn tone_map_soft(exposed: vec3f) -> vec3f {
    let shoulder = 0.4;
    let step = 0.12387274177484112;
    let peak = max(exposed.r, max(exposed.g, exposed.b));
    if peak <= shoulder {
        return exposed;
    }
    let rise = step * log(1.0 + (peak - shoulder) / step);
    let new_peak = min(shoulder + rise, 1.0);
    let part = (new_peak - shoulder) / (1.0 - shoulder);
    return new_peak * mix(exposed / peak, vec3f(1.0), 0.4 * part * part * part);
}

fn tone_map(exposed: vec3f, kind: u32) -> vec3f {
    var display = max(exposed, vec3f(0.0));
    switch kind {
        case TONE_MAP_NEUTRAL: { display = tone_map_neutral(display); }
        case TONE_MAP_AGX: { display = tone_map_agx(display); }
        case TONE_MAP_ACES: { display = tone_map_aces(display); }
        case TONE_MAP_SOFT: { display = tone_map_soft(display); }
        default: {}
    }
    return clamp(display, vec3f(0.0), vec3f(1.0));
}
