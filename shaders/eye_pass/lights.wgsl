// Direct light, with one shadow ray per light; twin of light_pass/direct/lighting.rs. Lengths are local unless noted.
// Lamps shine from their middles; shadow rays aim at points of them.

// Numbers of the points that select microfacets end before those that select points of lamps.
const FIRST_OF_LIGHTS: u32 = 64u;
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

// From the middle of a lamp seen in a direction to the point that its shadow ray aims at: another one in each pixel and
// picture. For suns, at a distance of 1; emissive surfaces are their middles.
fn aimed(light: LightRecord, index: u32, to_light: vec3f) -> vec3f {
    let at = facet_point(FIRST_OF_LIGHTS + index);
    let turn = 2.0 * PI * at.y;
    let round = sqrt(at.x) * vec2f(cos(turn), sin(turn));
    if light.outline == OUTLINE_ROUND {
        let axes = tangents(to_light);
        return light.radius * (axes[0] * round.x + axes[1] * round.y);
    }
    let place = select(2.0 * at - 1.0, round, light.outline == OUTLINE_ELLIPSE);
    return light.across * place.x + light.down * place.y;
}

// E [W/m²] that a surface receives on the side of the point's normals, without what its coat reflects.
fn direct_irradiance(point: LitPoint, object: ObjectRecord) -> vec3f {
    var sum = vec3f(0.0);
    for (var index = 0u; index < start.light_count; index += 1u) {
        // Suns are infinitely far: their light neither spreads nor is absorbed on its way.
        let light = lights[index];
        var to_light = -light.place;
        var distance = 1.0;
        var across_beam = 1.0;
        var left = vec3f(1.0);
        if light.kind != LIGHT_SUN {
            let offset = light.place - point.place;
            distance = length(offset);
            to_light = offset / max(distance, 1e-20);
            let distance_m = distance * start.unit_m;
            across_beam = falloff(light, -to_light) / max(distance_m * distance_m, 1e-20);
            left = exp(-light.absorption_per_m * distance_m);
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
            let offset_to_lamp = to_light * distance + aimed(light, index, to_light);
            let direction = normalize(offset_to_lamp);
            var reach = length(offset_to_lamp) * select(1.0, 1.0 - BEFORE_FACET, light.kind == LIGHT_FACET);
            reach = select(reach, FAR_AWAY, light.kind == LIGHT_SUN);
            // Every surface is an occluder, clear ones included: light through those is in the caustic layer. So is the
            // surface itself, to what lies below its horizon.
            let is_above = dot(direction, point.geometric_normal) >= 0.0;
            if is_above && closest_hit(origin, direction, reach).triangle == NO_TRIANGLE {
                sum += light.strength * left * share;
            }
        }
    }
    return sum;
}
