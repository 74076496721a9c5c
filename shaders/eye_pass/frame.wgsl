// One picture: the camera and how radiance is written.

struct Frame {
    clip_from_camera: mat4x4f,
    camera_position: vec3f,
    radiance_scale: f32,
    background: vec3f,
    level_bias: f32,
    forward: vec3f,
    traced_width: f32,
    right: vec3f,
    traced_height: f32,
    up: vec3f,
    pixel_rad: f32,
    jitter: vec2f,
    traced_per_pixel: vec2f,
    traced_offset: vec2f,
    padding: vec2f,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Largest value written [scaled radiance]: half floats end at 65504.
const LARGEST: f32 = 32768.0;

fn scaled(radiance: vec3f) -> vec3f {
    return clamp(radiance * frame.radiance_scale, vec3f(0.0), vec3f(LARGEST));
}
