// A lamp.

struct LightRecord {
    // Position, local or [m]; for suns, the direction in which their light travels.
    place: vec3f,
    kind: u32,
    // W/sr per channel, W/m² for suns.
    strength: vec3f,
    cos_inner: f32,
    // Axis of a spot or normal of an emissive facet, away from the light.
    axis: vec3f,
    cos_outer: f32,
    // Absorption coefficient of the medium around the light [1/m]; unoccluded light stays in it.
    absorption_per_m: vec3f,
    ior: f32,
    // Half-axes of a panel, local or [m].
    across: vec3f,
    // Radius of a round lamp, local or [m]; of suns the tangent of its angle.
    radius: f32,
    down: vec3f,
    outline: u32,
}

const LIGHT_POINT: u32 = 0u;
const LIGHT_SPOT: u32 = 1u;
const LIGHT_SUN: u32 = 2u;
// A facet of an emissive surface: one-sided, with a cosine falloff.
const LIGHT_FACET: u32 = 3u;

const OUTLINE_ROUND: u32 = 0u;
const OUTLINE_RECTANGLE: u32 = 1u;
const OUTLINE_ELLIPSE: u32 = 2u;
// An emissive surface, which is seen itself.
const OUTLINE_SURFACE: u32 = 3u;

// Fraction of the intensity along a direction: the cone of a spot (KHR_lights_punctual), the cosine of a facet, else 1.
fn falloff(light: LightRecord, direction: vec3f) -> f32 {
    if light.kind == LIGHT_FACET {
        return max(dot(light.axis, direction), 0.0);
    }
    if light.kind != LIGHT_SPOT {
        return 1.0;
    }
    let cosine = dot(light.axis, direction);
    var ramp = select(0.0, 1.0, cosine >= light.cos_outer);
    if light.cos_inner > light.cos_outer {
        ramp = clamp((cosine - light.cos_outer) / (light.cos_inner - light.cos_outer), 0.0, 1.0);
    }
    return ramp * ramp;
}
