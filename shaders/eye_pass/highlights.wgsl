// Lamps in mirrors and glass, and on glossy surfaces; twin of eye_pass/highlights.rs. Lengths are local unless noted.

// Lobes of a larger GGX α show the suns of a sky as highlights.
const SKY_SUN_ALPHA: f32 = 0.02;
// A glowing object counts as a ball where a lobe as wide has a smaller GGX α.
const LARGEST_BALL: f32 = 0.1;
// Most patches across and down a panel that are highlights of their own.
const PATCHES: u32 = 4u;
// Highlights that reflect a smaller radiance per irradiance [1/sr] are left out.
const DIMMEST_HIGHLIGHT: f32 = 3e-4;

// GGX α of a lobe as wide as a lamp, or a patch of a panel, is seen from a place.
fn alpha_from(light: LightRecord, place: vec3f) -> f32 {
    if light.kind == LIGHT_SUN {
        return 0.5 * light.radius;
    }
    var radius = light.radius;
    if light.outline != OUTLINE_ROUND {
        radius = max(length(light.across), length(light.down)) / f32(PATCHES);
    }
    return 0.5 * radius / max(distance(light.place, place), 1e-20);
}

// Whether a lamp, one of those of glowing objects and skies or another, is smaller than a lobe seen from a place, and far
// enough for what it stands for.
fn is_smaller(light: LightRecord, is_of_lobe: bool, alpha: f32, place: vec3f) -> bool {
    let is_ball = is_of_lobe && light.kind != LIGHT_SUN && light.outline == OUTLINE_ROUND;
    return alpha_from(light, place) < select(alpha, min(alpha, LARGEST_BALL), is_ball);
}

// Whether an object counts as a lamp in the lobe that a ray comes from, or its light as a caustic on a coat before it.
fn is_shown_otherwise(gaze: Gaze, object: ObjectRecord) -> bool {
    if gaze.coat == COAT_BEFORE {
        return true;
    }
    if gaze.alpha == 0.0 || object.lamp == 0u {
        return false;
    }
    return is_smaller(lights[start.light_count + object.lamp - 1u], true, abs(gaze.alpha), gaze.origin);
}

// Radiance of the lamps between a surface that a path has left and the next one at `reach`, averaged over the footprint.
fn lamps_on(gaze: Gaze, reach: f32) -> vec3f {
    var sum = vec3f(0.0);
    let cone = Cone(gaze.origin, gaze.width, gaze.direction, gaze.spread, start.unit_m);
    // Those of glowing objects and skies count behind rough surfaces only.
    let count = start.light_count + select(0u, start.lobe_lamp_count, gaze.alpha < 0.0);
    for (var index = 0u; index < count; index += 1u) {
        let light = lights[index];
        let is_of_lobe = index >= start.light_count;
        let is_small = is_smaller(light, is_of_lobe, abs(gaze.alpha), gaze.origin);
        if light.outline == OUTLINE_SURFACE || (gaze.alpha > 0.0 && is_small) || (is_of_lobe && !is_small) {
            continue;
        }
        // The surface of a glowing object itself ends the reach.
        let depth = sqrt(3.0) * light.radius + 2.0 * BEFORE_SURFACE * reach;
        let beyond = reach + select(0.0, depth, is_of_lobe);
        let seen = seen_lamp(light, cone);
        let distance = select(seen.distance, FAR_AWAY, light.kind == LIGHT_SUN);
        if largest(seen.radiance) > 0.0 && (distance < beyond * (1.0 - BEFORE_SURFACE) || reach >= FAR_AWAY) {
            sum += seen.radiance * left_after(gaze.media, distance);
        }
    }
    return sum;
}

// Share of light that is left after a distance in a medium; all of what comes from infinity.
fn left_after(media: vec4u, distance: f32) -> vec3f {
    if distance >= FAR_AWAY {
        return vec3f(1.0);
    }
    return medium_transmittance(media, distance * start.unit_m);
}

// Radiance that a rough mirror reflects per irradiance across a beam [1/sr], at a reflectance of 1; twin of
// transport/microfacets.rs.
fn ggx_reflection(normal: vec3f, to_eye: vec3f, to_light: vec3f, alpha_squared: f32) -> f32 {
    let cos_eye = dot(to_eye, normal);
    let cos_light = dot(to_light, normal);
    if cos_eye <= 0.0 || cos_light <= 0.0 {
        return 0.0;
    }
    let half_vector = normalize(to_eye + to_light);
    let cos_half = dot(half_vector, normal);
    let across = cross(half_vector, normal);
    let stretched = dot(across, across) + alpha_squared * cos_half * cos_half;
    let distribution = alpha_squared / (PI * stretched * stretched);
    let hidden_eye = sqrt(alpha_squared + (1.0 - alpha_squared) * cos_eye * cos_eye);
    let hidden_light = sqrt(alpha_squared + (1.0 - alpha_squared) * cos_light * cos_light);
    return distribution * cos_light * 0.5 / (cos_light * hidden_eye + cos_eye * hidden_light);
}

// A point of a rough surface that reflects lamps.
struct Gloss {
    point: SurfacePoint,
    facing: Facing,
    alpha: f32,
    facets: Facets,
    tint: vec3f,
    // Share of the radiance that the chain's own reflection carries to the eye.
    reflected: f32,
}

// A lamp, or a patch of it.
struct Patch {
    place: vec3f,
    area_m2: f32,
    // Below the surface of the lamp.
    depth: f32,
    // GGX α of a lobe as wide as it is seen; 0 in tails.
    alpha: f32,
    // Tilt of the microfacets that count, at least.
    least_tilt: f32,
}

// Tangent of the angle between the unit normal of a microfacet and that of its surface.
fn tilt(facet: vec3f, normal: vec3f) -> f32 {
    return length(cross(facet, normal)) / max(dot(facet, normal), 1e-30);
}

// Reflected radiance of a patch.
fn highlight_from(light: LightRecord, piece: Patch, gloss: Gloss, gaze: Gaze) -> vec3f {
    var to_light = -light.place;
    var reach = FAR_AWAY;
    var across_beam = 1.0;
    if light.kind != LIGHT_SUN {
        let offset = piece.place - gloss.point.place;
        let far = length(offset);
        to_light = offset / max(far, 1e-20);
        reach = (far - piece.depth) * (1.0 - BEFORE_SURFACE);
        let far_m = far * start.unit_m;
        across_beam = falloff(light, -to_light) / max(far_m * far_m + piece.area_m2 / PI, 1e-20);
    }
    let to_eye = -gaze.direction;
    // The cone of a pixel is the same for all of a picture's surfaces.
    let cone = select(0.0, 0.25 * gaze.spread, gaze.lobes > 0u);
    let alpha_squared = gloss.alpha * gloss.alpha + piece.alpha * piece.alpha + cone * cone;
    let response = ggx_reflection(gloss.facing.shading, to_eye, to_light, alpha_squared);
    let is_bright = response * gloss.reflected >= DIMMEST_HIGHLIGHT && across_beam > 0.0;
    let half = normalize(to_eye + to_light);
    let is_tilted = tilt(half, gloss.facing.shading) >= piece.least_tilt;
    if !is_bright || !is_tilted || dot(to_light, gloss.facing.geometric) <= 0.0 {
        return vec3f(0.0);
    }
    if closest_hit(leave(gloss.point, to_light), to_light, reach).triangle != NO_TRIANGLE {
        return vec3f(0.0);
    }
    let cos_facet = dot(half, to_light);
    let reflectance = reflectance_of(gloss.facets, cos_facet, gloss.tint);
    return light.strength * left_after(gaze.media, reach) * reflectance * (across_beam * response);
}

// Reflected radiance of the lamps that are smaller than the lobe of a rough surface, and of others in its tails.
fn highlights(gloss: Gloss, gaze: Gaze) -> vec3f {
    var sum = vec3f(0.0);
    for (var index = 0u; index < start.light_count + start.lobe_lamp_count; index += 1u) {
        let light = lights[index];
        let is_of_lobe = index >= start.light_count;
        if light.outline == OUTLINE_SURFACE || !is_smaller(light, is_of_lobe, 1e30, gloss.point.place) {
            continue;
        }
        // Of a lamp that is wider than the lobe, rays see what microfacets reflect that are tilted less.
        let size = alpha_from(light, gloss.point.place);
        let is_small = size < gloss.alpha;
        let least_tilt = select(2.0 * size, 0.0, is_small);
        // Panels have as few patches as are half as wide as the lobe.
        let is_panel = light.outline != OUTLINE_ROUND;
        let is_ellipse = light.outline == OUTLINE_ELLIPSE;
        let whole = size * select(1.0, f32(PATCHES), is_panel);
        var sides = 1u;
        while is_panel && sides < PATCHES && whole > 0.5 * gloss.alpha * f32(sides) {
            sides *= 2u;
        }
        let count = sides * sides;
        // The corners of a grid of four by four lie outside of an ellipse.
        let share = 1.0 / f32(count - select(0u, 4u, is_ellipse && sides == PATCHES));
        // To a corner of the cube around a glowing object.
        let depth = select(0.0, sqrt(3.0) * light.radius, is_of_lobe);
        let patch_m2 = panel_area(light) * start.unit_m * start.unit_m * share;
        for (var number = 0u; number < count; number += 1u) {
            let cell = vec2f(f32(number % sides), f32(number / sides));
            let at = (cell + 0.5) * (2.0 / f32(sides)) - 1.0;
            if !is_ellipse || length(at) < 1.0 {
                // A round lamp has no axes.
                let place = light.place + light.across * at.x + light.down * at.y;
                let piece = Patch(place, patch_m2, depth, select(0.0, whole / f32(sides), is_small), least_tilt);
                sum += share * highlight_from(light, piece, gloss, gaze);
            }
        }
    }
    return sum;
}
