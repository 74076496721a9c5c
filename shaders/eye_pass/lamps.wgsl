// What lamps show to a cone of directions; twin of eye_pass/highlights.rs.

// Angular radius of lamps without extent where a focus leaves no footprint [rad].
const POINT_RADIUS_RAD: f32 = 2e-4;
// A lamp lies on a ray if it is nearer than the next surface by this part of the distance.
const BEFORE_SURFACE: f32 = 1e-4;

// A ray with the cone that it stands for.
struct Cone {
    origin: vec3f,
    // Width at the origin.
    width: f32,
    direction: vec3f,
    // Growth of the width per length.
    spread: f32,
    // Length of a unit of the coordinates [m].
    unit_m: f32,
}

// What a lamp shows to a ray that sees it at `distance`.
struct SeenLamp {
    radiance: vec3f,
    distance: f32,
}

// Radius of the disc with the area of a square footprint.
fn disc_of(width: f32) -> f32 {
    return abs(width) / sqrt(PI);
}

// Share of a disc, the footprint, that lies within another at an offset.
fn share_of_disc(offset: f32, radius: f32, disc: f32) -> f32 {
    let footprint = max(disc, 1e-3 * radius);
    if offset >= radius + footprint {
        return 0.0;
    }
    let small = min(radius, footprint);
    let large = max(radius, footprint);
    if offset <= large - small {
        return small * small / (footprint * footprint);
    }
    // The lens between two circles.
    let squares = vec2f(small * small, large * large);
    let cosines = (offset * offset + squares - squares.yx) / (2.0 * offset * vec2f(small, large));
    let angles = acos(clamp(cosines, vec2f(-1.0), vec2f(1.0)));
    return dot(squares, angles - sin(angles) * cos(angles)) / (PI * footprint * footprint);
}

// Share of an interval of a half-width about a place that lies between -1 and 1.
fn share_of_side(place: f32, half_width: f32) -> f32 {
    let low = max(place - half_width, -1.0);
    let high = min(place + half_width, 1.0);
    return max(high - low, 0.0) / (2.0 * half_width);
}

// 0 of round lamps.
fn panel_area(light: LightRecord) -> f32 {
    return length(cross(light.across, light.down)) * select(4.0, PI, light.outline == OUTLINE_ELLIPSE);
}

// At a distance of 1.
fn seen_sun(light: LightRecord, cone: Cone) -> SeenLamp {
    let cosine = -dot(light.place, cone.direction);
    if cosine <= 0.0 {
        return SeenLamp(vec3f(0.0), 1.0);
    }
    let offset = length(cone.direction / cosine + light.place);
    let footprint = disc_of(cone.spread);
    let radius = max(max(light.radius, POINT_RADIUS_RAD), footprint);
    let share = share_of_disc(offset, radius, footprint);
    return SeenLamp(light.strength * (share * (1.0 + radius * radius) / (PI * radius * radius)), 1.0);
}

fn seen_bulb(light: LightRecord, cone: Cone) -> SeenLamp {
    let to_lamp = light.place - cone.origin;
    let along = dot(to_lamp, cone.direction);
    if along <= 0.0 {
        return SeenLamp(vec3f(0.0), 0.0);
    }
    let offset = length(to_lamp - cone.direction * along);
    let footprint = disc_of(cone.width + cone.spread * along);
    let radius = max(max(light.radius, POINT_RADIUS_RAD * along), footprint);
    let share = share_of_disc(offset, radius, footprint) * falloff(light, -cone.direction);
    let radius_m = radius * cone.unit_m;
    return SeenLamp(light.strength * (share / (PI * radius_m * radius_m)), along);
}

fn seen_panel(light: LightRecord, cone: Cone) -> SeenLamp {
    let normal = cross(light.across, light.down);
    let slope = dot(cone.direction, normal);
    let to_lamp = light.place - cone.origin;
    let distance = dot(to_lamp, normal) / min(slope, -1e-30);
    if slope >= 0.0 || distance <= 0.0 {
        return SeenLamp(vec3f(0.0), 0.0);
    }
    let from_centre = cone.direction * distance - to_lamp;
    let along = vec2f(dot(cross(from_centre, light.down), normal), dot(cross(light.across, from_centre), normal));
    let place = along / dot(normal, normal);
    let width = 0.5 * abs(cone.width + cone.spread * distance);
    let widths = max(width / vec2f(length(light.across), length(light.down)), vec2f(1e-3));
    var share = share_of_side(place.x, widths.x) * share_of_side(place.y, widths.y);
    if light.outline == OUTLINE_ELLIPSE {
        share = share_of_disc(length(place), 1.0, 2.0 * sqrt(widths.x * widths.y / PI));
    }
    let area_m2 = panel_area(light) * cone.unit_m * cone.unit_m;
    return SeenLamp(light.strength * (share / area_m2), distance);
}

// Radiance averaged over the cone.
fn seen_lamp(light: LightRecord, cone: Cone) -> SeenLamp {
    if light.kind == LIGHT_SUN {
        return seen_sun(light, cone);
    }
    if light.outline == OUTLINE_ROUND {
        return seen_bulb(light, cone);
    }
    return seen_panel(light, cone);
}
