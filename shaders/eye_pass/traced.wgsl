// Traces the chain of each pixel whose nearest surface is specular.

// Number of distinct marks of objects; half floats represent them exactly.
const MARKS: u32 = 2000u;

fn mark(object: u32) -> f32 {
    return f32(object % MARKS + 1u);
}

@fragment
fn traced(fragment: Fragment, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    // One pipeline draws all objects: culling by state would compile this long shader twice.
    if !is_front && objects[fragment.object].double_sided == 0u {
        discard;
    }
    let size = vec2f(frame.traced_width, frame.traced_height);
    let within = fragment.clip.xy / size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0) + frame.jitter;
    let direction = normalize(frame.forward + within.x * frame.right + within.y * frame.up);
    let origin = start.eye + direction * (start.near / dot(direction, frame.forward));
    let width = start.near * frame.pixel_rad;
    let gaze = Gaze(origin, 0u, direction, width, vec3f(1.0), frame.pixel_rad, start.media, 0u, 0.0, 0u, COAT_NONE);
    pixel_seed = seed_of(fragment.clip.xy);
    return vec4f(written(chain_radiance(gaze)), mark(fragment.object));
}
