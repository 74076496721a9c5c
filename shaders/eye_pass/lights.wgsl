// Light straight from the lamps, by a shadow ray each; twin of light_pass/direct/lighting.rs. Lengths are local but
// where they say so.

struct LightRecord {
    // Where it is; the way its light travels for suns.
    place: vec3f,
    kind: u32,
    // W/sr per channel, or W/m² for suns.
    strength: vec3f,
    cos_inner: f32,
    // Of a spot or of what glows, away from the lamp.
    axis: vec3f,
    cos_outer: f32,
    // Of what is around the lamp: the light stays within that [1/m].
    absorption_per_m: vec3f,
    ior: f32,
}

const LIGHT_POINT: u32 = 0u;
const LIGHT_SPOT: u32 = 1u;
const LIGHT_SUN: u32 = 2u;
// A piece of a surface that glows: by the cosine, on one side.
const LIGHT_FACET: u32 = 3u;
// Share of its way that a shadow ray stops before such a piece, so as not to meet the surface itself.
const BEFORE_FACET: f32 = 1e-4;

@group(1) @binding(6) var<storage, read> lights: array<LightRecord>;

// Where light may arrive.
struct LitPoint {
    place: vec3f,
    // How far off the surface a shadow ray starts.
    margin: f32,
    geometric_normal: vec3f,
    shading_normal: vec3f,
    taking: Taking,
}

// Share of its strength that a spot sends along a direction (KHR_lights_punctual), or a surface; 1 for the others.
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

// E [W/m²] that a surface of an object takes there, on the side that its normals point to. What polish reflects is not
// taken.
fn direct_irradiance(point: LitPoint, object: ObjectRecord) -> vec3f {
    var sum = vec3f(0.0);
    for (var index = 0u; index < start.light_count; index += 1u) {
        let light = lights[index];
        var to_light = -light.place;
        var distance = FAR_AWAY;
        var across_beam = 1.0;
        var left = vec3f(1.0);
        if light.kind != LIGHT_SUN {
            let offset = light.place - point.place;
            distance = length(offset);
            to_light = offset / max(distance, 1e-20);
            let distance_m = distance * start.unit_m;
            across_beam = falloff(light, -to_light) / max(distance_m * distance_m, 1e-20);
            left = exp(-light.absorption_per_m * distance_m);
            if light.kind == LIGHT_FACET {
                distance *= 1.0 - BEFORE_FACET;
            }
        }
        let cosine = dot(to_light, point.shading_normal);
        var taken = select(0.0, 1.0, dot(to_light, point.geometric_normal) >= 0.0);
        taken *= point.taking.share;
        if point.taking.polish > 0.0 {
            taken *= 1.0 - point.taking.polish * dielectric_reflectance(cosine, object.ior / light.ior);
        }
        let share = across_beam * cosine * taken;
        if share > 0.0 {
            let origin = point.place + point.geometric_normal * point.margin;
            // Every surface stops it, clear ones included: what comes through those is in the caustic layer.
            if closest_hit(origin, to_light, distance).triangle == NO_TRIANGLE {
                sum += light.strength * left * share;
            }
        }
    }
    return sum;
}
