// From exposed radiance to display light in [0, 1]; twin of eye_pass/tone_mapping.rs.

const TONE_MAP_NONE: u32 = 0u;
const TONE_MAP_NEUTRAL: u32 = 1u;

// Khronos PBR Neutral: exact below its shoulder, hue kept above it.
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

fn tone_map(exposed: vec3f, kind: u32) -> vec3f {
    var display = max(exposed, vec3f(0.0));
    if kind == TONE_MAP_NEUTRAL {
        display = tone_map_neutral(display);
    }
    return clamp(display, vec3f(0.0), vec3f(1.0));
}
