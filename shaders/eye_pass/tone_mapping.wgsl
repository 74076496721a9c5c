// Last pass: the picture's radiance, resolved, to the target's colour.

struct ToneMapping {
    exposure: f32,
    tone_map: u32,
    encode_srgb: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> tone_mapping: ToneMapping;
@group(0) @binding(1) var scene_radiance: texture_2d<f32>;

// One triangle that covers the target.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4f(corner * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn to_display(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let radiance = textureLoad(scene_radiance, vec2i(pixel.xy), 0).rgb;
    var display = tone_map(radiance * tone_mapping.exposure, tone_mapping.tone_map);
    // Formats that encode by themselves take linear light.
    if tone_mapping.encode_srgb != 0u {
        display = srgb_from_linear(display);
    }
    return vec4f(display, 1.0);
}
