// A layer of light in the tiles of all maps, added to what is there.

@group(0) @binding(0) var light: texture_2d<f32>;

@fragment
fn summed(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    return vec4f(textureLoad(light, vec2i(pixel.xy), 0).rgb, 0.0);
}
