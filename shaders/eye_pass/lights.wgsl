// Direct light, with one shadow ray per light; twin of light_pass/direct/lighting.rs. Lengths are local unless noted.

// Fraction of the distance by which a shadow ray stops short of a facet, so as not to hit the emissive surface itself.
const BEFORE_FACET: f32 = 1e-4;

@group(1) @binding(6) var<storage, read> lights: array<LightRecord>;

// A point that receives direct light.
struct LitPoint {
    place: vec3f,
    // Offset of shadow rays off the surface.
    margin: f32,
    geometric_normal: vec3f,
    shading_normal: vec3f,
    response: DiffuseResponse,
}

// E [W/m²] that a surface receives on the side of the point's normals, without what its coat reflects.
fn direct_irradiance(point: LitPoint, object: ObjectRecord) -> vec3f {
    var sum = vec3f(0.0);
    for (var index = 0u; index < start.light_count; index += 1u) {
        // Suns are infinitely far: their light neither spreads nor is absorbed on its way.
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

        // Light from behind the triangle's plane does not count, however the normal is bent; a coat reflects a part.
        let cosine = dot(to_light, point.shading_normal);
        var taken = select(0.0, 1.0, dot(to_light, point.geometric_normal) >= 0.0);
        taken *= point.response.share;
        if point.response.coat > 0.0 {
            taken *= 1.0 - point.response.coat * dielectric_reflectance(cosine, object.ior / light.ior);
        }

        // Only light that would count is worth a shadow ray.
        let share = across_beam * cosine * taken;
        if share > 0.0 {
            let origin = point.place + point.geometric_normal * point.margin;
            // Every surface is an occluder, clear ones included: light through those is in the caustic layer.
            if closest_hit(origin, to_light, distance).triangle == NO_TRIANGLE {
                sum += light.strength * left * share;
            }
        }
    }
    return sum;
}
