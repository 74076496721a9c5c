// Microfacets that rays from the eye scatter at; twin of eye_pass/facets.rs and transport/microfacets.rs.

// Steps of the sequence R2, times 2^32.
const STEPS = vec2u(3242174889u, 2447445414u);

// Random number of the pixel.
var<private> pixel_seed: u32;

// A random permutation of all numbers (PCG).
fn scrambled(number: u32) -> u32 {
    let state = number * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

fn seed_of(pixel: vec2f) -> u32 {
    return scrambled(u32(pixel.x) + scrambled(u32(pixel.y)));
}

// The point of the unit square that selects a microfacet, for a surface that follows after `lobes` rough ones.
fn facet_point(lobes: u32) -> vec2f {
    let first = pixel_seed + 2u * lobes;
    let offset = vec2u(scrambled(first), scrambled(first + 1u));
    var place = offset + frame.picture * STEPS;
    if lobes > 0u {
        place = vec2u(scrambled(offset.x + frame.picture), scrambled(offset.y + frame.picture));
    }
    return vec2f(place >> vec2u(8u)) / 16777216.0;
}

// Part of a lobe's width that the footprint of a ray keeps: the more frames there are, the less.
fn kept_width() -> f32 {
    return pow(f32(max(frame.picture, 1u)), -1.0 / 6.0);
}

// Singularity of the tangents below, and two unit vectors perpendicular to it and to each other.
const POLE = vec3f(-0.36235718, -0.81530366, 0.45163837);
const POLE_TANGENT = vec3f(-0.91381155, 0.40613847, 0.0);
const POLE_BITANGENT = vec3f(-0.18342771, -0.41271236, -0.8922011);

// Unit tangents of a unit normal.
fn tangents(normal: vec3f) -> array<vec3f, 2> {
    let divisor = 1.0 - dot(POLE, normal);
    if divisor <= 1e-6 {
        return array(POLE_TANGENT, -POLE_BITANGENT);
    }
    let step = (POLE - normal) / divisor;
    return array(
        POLE_TANGENT + step * dot(POLE_TANGENT, normal),
        POLE_BITANGENT + step * dot(POLE_BITANGENT, normal),
    );
}

// Unit normal of a microfacet among those that a ray along `incident` sees (Dupuy and Benyoub, "Sampling Visible GGX
// Normals with Spherical Caps", 2023).
fn visible_facet(point: vec2f, alpha: f32, incident: vec3f, normal: vec3f) -> vec3f {
    let axes = tangents(normal);
    let local = -vec3f(dot(incident, axes[0]), dot(incident, axes[1]), dot(incident, normal));
    let stretched = normalize(vec3f(alpha * local.xy, local.z));
    let z = (1.0 - point.y) * (1.0 + stretched.z) - stretched.z;
    let sine = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    let turn = 2.0 * PI * point.x;
    let half = vec3f(sine * cos(turn), sine * sin(turn), z) + stretched;
    let micro = vec3f(alpha * half.xy, max(half.z, 0.0));
    return normalize(axes[0] * micro.x + axes[1] * micro.y + normal * micro.z);
}

// The direction, mirrored if necessary to lie on one side of the plane perpendicular to `normal`: 1 in front, -1 behind.
fn out_of(direction: vec3f, normal: vec3f, side: f32) -> vec3f {
    if dot(direction, normal) * side >= 0.0 {
        return direction;
    }
    return mirrored(direction, normal);
}
