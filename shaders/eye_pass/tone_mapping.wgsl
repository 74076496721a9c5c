// Last pass: tone-maps the resolved, exposed radiance to the target's colour.

// One of TONE_MAP_*.
override TONE_MAP: u32;
// False for sRGB formats, which take linear light.
override ENCODE_SRGB: bool;

struct DisplayWhite {
    // Multiplies radiance, so that the chosen white becomes the display's.
    balance: mat3x3f,
}

@group(0) @binding(0) var exposed_radiance: texture_2d<f32>;
@group(0) @binding(1) var<uniform> display_white: DisplayWhite;

@fragment
fn to_display(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let radiance = textureLoad(exposed_radiance, vec2i(pixel.xy), 0).rgb;
    var display = tone_map(display_white.balance * radiance, TONE_MAP);
    if ENCODE_SRGB {
        display = srgb_from_linear(display);
    }
    return vec4f(display, 1.0);
}
