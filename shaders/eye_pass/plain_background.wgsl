// Uniform background radiance.

fn background(direction: vec3f, has_suns: bool) -> vec3f {
    return frame.background;
}
