// Running mean of frames of the same view, each with its own subpixel offset.

struct Accumulation {
    // Weight of the new frame.
    share: f32,
    padding0: f32,
    padding1: f32,
    padding2: f32,
}

@group(0) @binding(0) var<uniform> accumulation: Accumulation;
@group(0) @binding(1) var new_picture: texture_2d<f32>;
@group(0) @binding(2) var mean_before: texture_2d<f32>;

@fragment
fn accumulated(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let at = vec2i(pixel.xy);
    let added = textureLoad(new_picture, at, 0);
    if accumulation.share >= 1.0 {
        return added;
    }
    return mix(textureLoad(mean_before, at, 0), added, accumulation.share);
}
