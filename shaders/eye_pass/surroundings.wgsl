// Approximation of what a specular surface sees: the plane receivers with their light, coarsely and unoccluded by
// anything but each other, and the background around them.

const MAX_RECEIVERS: u32 = 16u;

// False where nothing plane is to be looked at: `surroundings.count` is 0.
override HAS_RECEIVERS: bool;

struct Receiver {
    plane: vec4f,
    u: vec4f,
    v: vec4f,
    image_size: vec2f,
    padding: vec2f,
}

struct Surroundings {
    receivers: array<Receiver, MAX_RECEIVERS>,
    mean_radiance: vec3f,
    count: u32,
    radiance_scale: f32,
    padding0: f32,
    padding1: f32,
    padding2: f32,
}

@group(2) @binding(0) var<uniform> surroundings: Surroundings;
@group(2) @binding(1) var receiver_images: texture_2d_array<f32>;
@group(2) @binding(2) var receiver_sampler: sampler;

fn along(row: vec4f, place: vec3f) -> f32 {
    return dot(row.xyz, place) + row.w;
}

// Radiance from `direction` (unit) at `place`, from receivers farther than `nearest` [m].
fn surrounding_radiance(place: vec3f, direction: vec3f, nearest: f32) -> vec3f {
    if !HAS_RECEIVERS {
        // The mean of what is lit stands in for the ground.
        return mix(surroundings.mean_radiance, frame.background, smoothstep(-0.2, 0.2, direction.y));
    }
    var distance = -1.0;
    var hit = 0u;
    var hit_uv = vec2f(0.0);
    for (var index = 0u; index < surroundings.count; index += 1u) {
        let receiver = surroundings.receivers[index];
        let t = -along(receiver.plane, place) / dot(receiver.plane.xyz, direction);
        let spot = place + t * direction;
        let uv = vec2f(along(receiver.u, spot), along(receiver.v, spot));
        let inside = all(uv >= vec2f(0.0)) && all(uv <= vec2f(1.0));
        // A ray within the plane has no finite t and fails these.
        if inside && t > nearest && (distance < 0.0 || t < distance) {
            distance = t;
            hit = index;
            hit_uv = uv;
        }
    }
    if distance > 0.0 {
        let size = surroundings.receivers[hit].image_size;
        let texel = clamp(hit_uv * size, vec2f(0.5), max(size - 0.5, vec2f(0.5)));
        let image_uv = texel / vec2f(textureDimensions(receiver_images));
        return textureSampleLevel(receiver_images, receiver_sampler, image_uv, hit, 0.0).rgb * surroundings.radiance_scale;
    }
    return frame.background;
}
