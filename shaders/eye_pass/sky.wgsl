// Radiance of an equirectangular environment; twin of scene/environment.rs, smooth_radiance.

// Radiance, to be multiplied by frame.background.
@group(2) @binding(0) var sky: texture_2d<f32>;

const TAU: f32 = 6.2831855;

// A pixel, darkened to a luminance of at most `cut`.
fn sky_pixel(column: i32, row: i32, size: vec2i, cut: f32) -> vec3f {
    // Wraps around horizontally, clamps at the poles.
    let place = vec2i((column + size.x) % size.x, clamp(row, 0, size.y - 1));
    let pixel = textureLoad(sky, place, 0).rgb;
    return pixel * min(cut / max(dot(pixel, LUMINANCE), 1e-30), 1.0);
}

// Without its suns where these are highlights.
fn background(direction: vec3f, has_suns: bool) -> vec3f {
    let cut = select(frame.sky_cut, 3e38, has_suns);
    let size = vec2i(textureDimensions(sky));
    let turns = atan2(direction.x, -direction.z) / TAU;
    let polar = atan2(length(direction.xz), direction.y);
    let u = turns + select(0.0, 1.0, turns < 0.0);
    let place = vec2f(u, 2.0 * polar / TAU) * vec2f(size) - 0.5;
    let low = floor(place);
    let share = place - low;
    let at = vec2i(low);
    let upper = mix(sky_pixel(at.x, at.y, size, cut), sky_pixel(at.x + 1, at.y, size, cut), share.x);
    let lower = mix(sky_pixel(at.x, at.y + 1, size, cut), sky_pixel(at.x + 1, at.y + 1, size, cut), share.x);
    return frame.background * mix(upper, lower, share.y);
}
