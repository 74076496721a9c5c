// Last pass: the picture's exposed radiance, resolved, to the target's colour.

// One of TONE_MAP_*.
override TONE_MAP: u32;
// False for formats that encode by themselves: they take linear light.
override ENCODE_SRGB: bool;

@group(0) @binding(0) var exposed_radiance: texture_2d<f32>;

// One triangle that covers the target.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4f(corner * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn to_display(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let radiance = textureLoad(exposed_radiance, vec2i(pixel.xy), 0).rgb;
    var display = tone_map(radiance, TONE_MAP);
    if ENCODE_SRGB {
        display = srgb_from_linear(display);
    }
    return vec4f(display, 1.0);
}
