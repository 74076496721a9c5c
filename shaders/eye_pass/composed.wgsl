// Composes the traced image, which may be coarser or finer, into the frame.

@group(1) @binding(0) var traced_picture: texture_2d<f32>;

const MARKS: u32 = 2000u;

// Whether the resolution of the traced image differs from that of the frame.
override IS_SCALED: bool;

// Adds a pixel of the traced image if it shows the wanted object; w sums the weights.
fn add_traced(sum: vec4f, pixel: vec2i, weight: f32, wanted: f32) -> vec4f {
    let last = vec2i(textureDimensions(traced_picture)) - 1;
    let found = textureLoad(traced_picture, clamp(pixel, vec2i(0), last), 0);
    let counts = select(0.0, weight, found.a == wanted);
    return sum + counts * vec4f(found.rgb, 1.0);
}

// The mean of what was found. At the border of an object nothing may have been: a nearby pixel of it stands in.
fn beside(found: vec4f, corner: vec2i, wanted: f32) -> vec4f {
    var sum = found;
    for (var place = 0; place < 16 && sum.w <= 1e-4; place += 1) {
        sum = add_traced(sum, corner + vec2i(place % 4, place / 4), 1.0, wanted);
    }
    return vec4f(sum.rgb / max(sum.w, 1e-4), 1.0);
}

@fragment
fn composed(fragment: Fragment) -> @location(0) vec4f {
    cut_out(fragment);
    let wanted = f32(fragment.object % MARKS + 1u);
    if !IS_SCALED {
        let sum = add_traced(vec4f(0.0), vec2i(fragment.clip.xy), 1.0, wanted);
        return beside(sum, vec2i(fragment.clip.xy) - 1, wanted);
    }
    let position = fragment.clip.xy * frame.traced_per_pixel + frame.traced_offset - 0.5;
    let low = floor(position);
    let share = position - low;
    let corner = vec2i(low);
    var sum = add_traced(vec4f(0.0), corner, (1.0 - share.x) * (1.0 - share.y), wanted);
    sum = add_traced(sum, corner + vec2i(1, 0), share.x * (1.0 - share.y), wanted);
    sum = add_traced(sum, corner + vec2i(0, 1), (1.0 - share.x) * share.y, wanted);
    sum = add_traced(sum, corner + vec2i(1, 1), share.x * share.y, wanted);
    return beside(sum, corner - 1, wanted);
}
