// Uniform background radiance.

fn background(direction: vec3f) -> vec3f {
    return frame.background;
}
