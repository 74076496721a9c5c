// Radiance along a gaze that goes on over mirrors and through glass until it ends on something diffuse; twin of
// eye_pass/reference/radiance.rs. All lengths are local but where they say so.

struct ChainStart {
    eye: vec3f,
    unit_m: f32,
    media: vec4u,
    near: f32,
    branch_threshold: f32,
    max_depth: u32,
    branching_depth: u32,
}

@group(1) @binding(0) var<uniform> start: ChainStart;

// Gazes that may wait: one for each surface at which both ways on are followed.
const MOST_BRANCHING: u32 = 4u;
// Backs of single-sided surfaces that a gaze passes before it is taken to have left the scene.
const MOST_BACKS: u32 = 64u;

struct Gaze {
    origin: vec3f,
    // Specular surfaces met so far.
    depth: u32,
    direction: vec3f,
    // Footprint: its width here, and how much it widens per length. Isotropic, to first order in the angles: it chooses
    // the level of images and nothing else.
    width: f32,
    weight: vec3f,
    spread: f32,
    media: vec4u,
}

struct Seen {
    hit: Hit,
    // From the gaze's origin.
    distance: f32,
}

fn is_clear(surface: u32) -> bool {
    return surface == SURFACE_DIELECTRIC || surface == SURFACE_THIN_WALL;
}

// The nearest surface that is drawn: backs of single-sided opaque ones are not.
fn nearest(gaze: Gaze) -> Seen {
    var origin = gaze.origin;
    var passed = 0.0;
    for (var backs = 0u; backs < MOST_BACKS; backs += 1u) {
        let hit = closest_hit(origin, gaze.direction, FAR_AWAY);
        if hit.triangle == NO_TRIANGLE {
            return Seen(hit, 0.0);
        }
        let triangle = triangles[hit.triangle];
        let object = objects[triangle.object];
        passed += hit.distance;
        if is_clear(object.surface) || object.double_sided != 0u {
            return Seen(hit, passed);
        }
        let normal = cross(triangle.b - triangle.a, triangle.c - triangle.a);
        if dot(normal, gaze.direction) <= 0.0 {
            return Seen(hit, passed);
        }
        origin = leave(surface_point(hit), gaze.direction);
    }
    return Seen(Hit(NO_TRIANGLE, 0.0, vec3f(0.0)), 0.0);
}

// The level of an image at which a texel is as large as the footprint, seen at an angle.
fn footprint_level(record: u32, density: f32, width: f32, cos_view: f32) -> f32 {
    if record == NO_IMAGE {
        return 0.0;
    }
    let extent = level_extent(record, 0u);
    let texels = abs(width) * density * sqrt(extent.x * extent.y / max(cos_view, 1e-3));
    return log2(max(texels, 1e-10));
}

fn largest(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn onward(gaze: Gaze, point: SurfacePoint, branch: Branch) -> Gaze {
    let bent = branch.spread_per_width * gaze.width;
    return Gaze(
        leave(point, branch.direction),
        gaze.depth + 1u,
        branch.direction,
        gaze.width,
        gaze.weight * branch.share,
        gaze.spread * branch.spread_factor + bent,
        branch.media,
    );
}

fn is_followed(gaze: Gaze) -> bool {
    let carried = largest(gaze.weight);
    return gaze.depth <= start.max_depth && carried > 0.0 && carried >= start.branch_threshold;
}

fn chain_radiance(first: Gaze) -> vec3f {
    var waiting: array<Gaze, MOST_BRANCHING>;
    var count = 0u;
    var gaze = first;
    var radiance = vec3f(0.0);
    loop {
        var follows = false;
        let seen = nearest(gaze);
        if seen.hit.triangle == NO_TRIANGLE {
            radiance += gaze.weight * frame.background;
        } else {
            let point = surface_point(seen.hit);
            let object = objects[point.object];
            gaze.weight *= medium_transmittance(gaze.media, seen.distance * start.unit_m);
            gaze.width += gaze.spread * seen.distance;
            let cos_view = abs(dot(point.geometric_normal, gaze.direction));
            let tint = object.base_colour * texture_colour(
                object.texture,
                point.uv,
                footprint_level(object.texture, point.uv_density, gaze.width, cos_view),
            );
            let next = interact(point, gaze.direction, gaze.media, tint);
            var own = object.emitted_radiance;
            if next.own > 0.0 {
                let level = footprint_level(object.map, point.map_density, gaze.width, cos_view);
                own += next.own / PI * tint * irradiance(object.map, point.map_uv, level);
            }
            radiance += gaze.weight * own;
            let reflected = onward(gaze, point, next.reflection);
            let transmitted = onward(gaze, point, next.transmission);
            let is_back = is_followed(reflected);
            let is_through = is_followed(transmitted);
            let is_stronger = largest(transmitted.weight) >= largest(reflected.weight);
            // The first surfaces send it both ways, later ones the stronger.
            if is_back && is_through && gaze.depth < start.branching_depth && count < MOST_BRANCHING {
                waiting[count] = reflected;
                count += 1u;
                gaze = transmitted;
            } else if is_through && (is_stronger || !is_back) {
                gaze = transmitted;
            } else {
                gaze = reflected;
            }
            follows = is_back || is_through;
        }
        if !follows {
            if count == 0u {
                break;
            }
            count -= 1u;
            gaze = waiting[count];
        }
    }
    return radiance;
}
