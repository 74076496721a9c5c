// Camera and output of one frame.

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
    colour_scale: vec2f,
    fault: f32,
    // Radiance of mirrors while chains are switched off.
    stand_in: f32,
    // Number among the frames of the same view.
    picture: u32,
    // Luminance above which a pixel of the sky belongs to a sun, at the environment's own scale.
    sky_cut: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

const PI: f32 = 3.14159265358979;

// Luminance of linear sRGB.
const LUMINANCE = vec3f(0.2126390, 0.7151687, 0.0721923);

// Largest value written [scaled radiance]: half floats end at 65504, and up to three lamps are added to it.
const LARGEST: f32 = 16384.0 - 16.0;

// Magenta at any exposure, in place of values that are not finite.
fn fault_colour() -> vec3f {
    return vec3f(frame.fault, 0.0, frame.fault);
}

fn scaled(radiance: vec3f) -> vec3f {
    return clamp(radiance * frame.radiance_scale, vec3f(0.0), vec3f(LARGEST));
}
