// Radiance of an equirectangular environment; twin of scene/environment.rs, smooth_radiance.

// Radiance, to be multiplied by frame.background.
@group(2) @binding(0) var sky: texture_2d<f32>;

const TAU: f32 = 6.2831855;

fn sky_pixel(column: i32, row: i32, size: vec2i) -> vec3f {
    // Wraps around horizontally, clamps at the poles.
    let place = vec2i((column + size.x) % size.x, clamp(row, 0, size.y - 1));
    return textureLoad(sky, place, 0).rgb;
}

fn background(direction: vec3f) -> vec3f {
    let size = vec2i(textureDimensions(sky));
    let turns = atan2(direction.x, -direction.z) / TAU;
    let polar = atan2(length(direction.xz), direction.y);
    let u = turns + select(0.0, 1.0, turns < 0.0);
    let place = vec2f(u, 2.0 * polar / TAU) * vec2f(size) - 0.5;
    let low = floor(place);
    let share = place - low;
    let at = vec2i(low);
    let upper = mix(sky_pixel(at.x, at.y, size), sky_pixel(at.x + 1, at.y, size), share.x);
    let lower = mix(sky_pixel(at.x, at.y + 1, size), sky_pixel(at.x + 1, at.y + 1, size), share.x);
    return frame.background * mix(upper, lower, share.y);
}
