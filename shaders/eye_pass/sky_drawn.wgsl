// Draws the environment behind all surfaces.

struct Behind {
    @builtin(position) clip: vec4f,
    // Position in the image, −1 to 1, right and up.
    @location(0) within: vec2f,
}

// A single triangle that covers the image.
@vertex
fn behind(@builtin(vertex_index) index: u32) -> Behind {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    return Behind(vec4f(corner, 0.0, 1.0), corner);
}

@fragment
fn sky_drawn(fragment: Behind) -> @location(0) vec4f {
    let within = fragment.within + frame.jitter;
    let direction = frame.forward + within.x * frame.right + within.y * frame.up;
    return vec4f(scaled(background(normalize(direction), true)), 1.0);
}
