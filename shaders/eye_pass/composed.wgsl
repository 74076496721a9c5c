// Specular surfaces in the picture, from what was traced for their pixels: coarser or finer than the picture.

@group(1) @binding(0) var traced_picture: texture_2d<f32>;

const MARKS: u32 = 2000u;

// Adds what was traced at a pixel where it shows the wanted object; the sum of weights in w.
fn add_traced(sum: vec4f, pixel: vec2i, weight: f32, wanted: f32) -> vec4f {
    let last = vec2i(textureDimensions(traced_picture)) - 1;
    let found = textureLoad(traced_picture, clamp(pixel, vec2i(0), last), 0);
    let counts = select(0.0, weight, found.a == wanted);
    return sum + counts * vec4f(found.rgb, 1.0);
}

@fragment
fn composed(fragment: Fragment) -> @location(0) vec4f {
    let wanted = f32(fragment.object % MARKS + 1u);
    let position = fragment.clip.xy * frame.traced_per_pixel - 0.5;
    let low = floor(position);
    let share = position - low;
    let corner = vec2i(low);
    var sum = add_traced(vec4f(0.0), corner, (1.0 - share.x) * (1.0 - share.y), wanted);
    sum = add_traced(sum, corner + vec2i(1, 0), share.x * (1.0 - share.y), wanted);
    sum = add_traced(sum, corner + vec2i(0, 1), (1.0 - share.x) * share.y, wanted);
    sum = add_traced(sum, corner + vec2i(1, 1), share.x * share.y, wanted);
    if sum.w > 1e-4 {
        return vec4f(sum.rgb / sum.w, 1.0);
    }
    // At the border of an object the nearest pixel of it stands in.
    for (var y = -1; y <= 2; y += 1) {
        for (var x = -1; x <= 2; x += 1) {
            let offset = vec2f(f32(x), f32(y)) - share;
            sum = add_traced(sum, corner + vec2i(x, y), 1.0 / (0.1 + dot(offset, offset)), wanted);
        }
    }
    if sum.w > 0.0 {
        return vec4f(sum.rgb / sum.w, 1.0);
    }
    return vec4f(textureLoad(traced_picture, clamp(vec2i(round(position)), vec2i(0),
        vec2i(textureDimensions(traced_picture)) - 1), 0).rgb, 1.0);
}
