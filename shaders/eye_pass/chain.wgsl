// Radiance along a path that continues over mirrors and through glass until it ends on a diffuse surface; twin of
// eye_pass/reference/radiance.rs. All lengths are local unless noted.

// Whether any mirror or clear surface has a base colour texture.
override HAS_TINTED_GLASS: bool;
// Whether direct light is traced, and not in the maps.
override TRACES_LIGHTS: bool;
// Whether any specular surface is rough.
override HAS_LOBES: bool;

// Maximum number of surfaces at which both branches are followed.
const MAX_BRANCHING: u32 = 4u;
// Maximum number of holes and backs of single-sided surfaces that a ray passes; beyond, it counts as leaving the scene.
const MAX_BACKS: u32 = 64u;

struct Gaze {
    origin: vec3f,
    // Specular surfaces met so far.
    depth: u32,
    direction: vec3f,
    // Footprint: its width here, and its growth per length. Isotropic, to first order in the angles; it only selects
    // the mip level of images.
    width: f32,
    weight: vec3f,
    spread: f32,
    media: vec4u,
    // Number of the wavelength that is traced; 0 for all of them.
    wavelength: u32,
    // Above 0, it comes from a rough surface whose highlights are those of lamps smaller than a reflection of this GGX α;
    // below 0, it passed through a rough surface and sees them as lamps.
    alpha: f32,
    // Rough surfaces met so far.
    lobes: u32,
    // One of COAT_*.
    coat: u32,
}

// Whether a path has been reflected off a rough coat. Light that comes to one by way of mirrors and glass is a caustic,
// which its map has: the few rays of its lobe would turn it into bright dots.
const COAT_NONE: u32 = 0u;
// The coat was the last surface: lamps and glowing objects are seen.
const COAT_LAST: u32 = 1u;
// A mirror or glass came after it: they are not.
const COAT_BEFORE: u32 = 2u;

struct Seen {
    hit: Hit,
    // From the ray's origin; FAR_AWAY for a miss.
    distance: f32,
}

fn is_clear(surface: u32) -> bool {
    return surface == SURFACE_DIELECTRIC || surface == SURFACE_THIN_WALL;
}

// Whether a hit lies in a hole of an alpha-masked surface.
fn is_hole(hit: Hit, object: ObjectRecord) -> bool {
    return HAS_MASK && object.alpha_cutoff > 0.0 && !is_there(object, surface_point(hit).uvs);
}

// The nearest visible surface: skips holes and backs of single-sided opaque surfaces.
fn nearest(gaze: Gaze) -> Seen {
    var origin = gaze.origin;
    var passed = 0.0;
    for (var backs = 0u; backs < MAX_BACKS; backs += 1u) {
        let hit = closest_hit(origin, gaze.direction, FAR_AWAY);
        if hit.triangle == NO_TRIANGLE {
            return Seen(hit, FAR_AWAY);
        }
        let triangle = met(hit);
        let object = objects[triangle.object];
        passed += hit.distance;
        let normal = cross(triangle.b - triangle.a, triangle.c - triangle.a);
        let has_back = is_clear(object.surface) || object.double_sided != 0u;
        if (has_back || dot(normal, gaze.direction) <= 0.0) && !is_hole(hit, object) {
            return Seen(hit, passed);
        }
        origin = leave(surface_point(hit), gaze.direction);
    }
    return Seen(Hit(NO_TRIANGLE, 0.0, vec3f(0.0), 0u), FAR_AWAY);
}

// Level at which a texel is as large as the footprint at an oblique angle.
fn footprint_level(record: u32, density: f32, width: f32, cos_view: f32) -> f32 {
    if record == NO_IMAGE {
        return 0.0;
    }
    let extent = level_extent(record, 0u);
    let texels = abs(width) * density * sqrt(extent.x * extent.y / max(cos_view, 1e-3));
    return log2(max(texels, 1e-10));
}

// The same for a texture reference, given the densities of both coordinate sets.
fn footprint_look_level(look: u32, densities: vec2f, width: f32, cos_view: f32) -> f32 {
    if look == NO_IMAGE {
        return 0.0;
    }
    let x = placed(look, vec4f(1.0, 0.0, 1.0, 0.0), true);
    let y = placed(look, vec4f(0.0, 1.0, 0.0, 1.0), true);
    let density = select(densities.x, densities.y, image_table[look + 1u] != 0u);
    let scaled_density = density * sqrt(abs(x.x * y.y - x.y * y.x));
    return footprint_level(image_table[look], scaled_density, width, cos_view);
}

fn largest(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn coat_after(gaze: Gaze, point: SurfacePoint, branch: Branch) -> u32 {
    // What passes through a hole keeps the lobe, too.
    let is_in_lobe = branch.alpha > 0.0;
    let is_reflected = is_in_lobe && branch.spread_added > 0.0;
    if gaze.coat == COAT_NONE && is_reflected && has_map(objects[point.object].surface) {
        return COAT_LAST;
    }
    return select(gaze.coat, COAT_BEFORE, gaze.coat == COAT_LAST && !is_in_lobe);
}

fn onward(gaze: Gaze, point: SurfacePoint, branch: Branch) -> Gaze {
    // What a lobe has widened comes to no focus, as if the cone grew from here on.
    let bent = gaze.spread * branch.spread_factor + branch.spread_per_width * gaze.width;
    let is_widened = branch.spread_added > 0.0;
    return Gaze(
        leave(point, branch.direction),
        gaze.depth + 1u,
        branch.direction,
        select(gaze.width, abs(gaze.width), is_widened),
        gaze.weight * branch.share,
        select(bent, abs(bent) + branch.spread_added, is_widened),
        branch.media,
        gaze.wavelength,
        branch.alpha,
        gaze.lobes + u32(is_widened),
        coat_after(gaze, point, branch),
    );
}

fn is_followed(gaze: Gaze) -> bool {
    let carried = largest(gaze.weight);
    return gaze.depth <= start.max_depth && carried > 0.0 && carried >= start.branch_threshold;
}

// The current path, the radiance gathered so far, and the number of waiting paths.
struct Walk {
    gaze: Gaze,
    radiance: vec3f,
    count: u32,
}

var<private> waiting: array<Gaze, MAX_WAITING>;

// Continues from a surface: along both branches at the first ones, then along the stronger. False if the path ends
// here.
fn go_on(walk: ptr<function, Walk>, point: SurfacePoint, next: Interaction) -> bool {
    let gaze = (*walk).gaze;
    let reflected = onward(gaze, point, next.reflection);
    let transmitted = onward(gaze, point, next.transmission);
    let is_back = is_followed(reflected);
    let is_through = is_followed(transmitted);
    let is_stronger = largest(transmitted.weight) >= largest(reflected.weight);
    if is_back && is_through && gaze.depth < start.branching_depth && (*walk).count < MAX_WAITING {
        waiting[(*walk).count] = reflected;
        (*walk).count += 1u;
        (*walk).gaze = transmitted;
    } else if is_through && (is_stronger || !is_back) {
        (*walk).gaze = transmitted;
    } else {
        (*walk).gaze = reflected;
    }
    return is_back || is_through;
}

fn has_map(surface: u32) -> bool {
    return surface == SURFACE_DIFFUSE || surface == SURFACE_COATED || surface == SURFACE_VARIED;
}

fn is_rough(object: ObjectRecord) -> bool {
    return HAS_LOBES && object.surface != SURFACE_DIFFUSE && object.roughness > SMOOTH_ROUGHNESS;
}

fn tint(gaze: Gaze, point: SurfacePoint, cos_view: f32) -> vec3f {
    let object = objects[point.object];
    let level = footprint_look_level(object.texture, point.uv_densities, gaze.width, cos_view);
    return object.base_colour * point.colour * looked_up(object.texture, point.uvs, level).rgb;
}

// The visible side of a point, for direct light.
fn lit_point(point: SurfacePoint, is_front: bool, gaze: Gaze) -> LitPoint {
    let object = objects[point.object];
    var mixture: Mixture;
    if object.surface == SURFACE_VARIED {
        mixture = mixture_at(point, gaze, factors_at(point, gaze));
    }
    let side = select(-1.0, 1.0, is_front);
    let margin = 2.0 * dot(abs(point.geometric_normal), point.error);
    return LitPoint(
        point.place,
        margin,
        side * point.geometric_normal,
        side * point.shading_normal,
        diffuse_response_of(object, mixture),
    );
}

// Diffuse radiance of a surface with a map, beneath its coat.
fn own_radiance(point: SurfacePoint, gaze: Gaze, colour: vec3f) -> vec3f {
    let object = objects[point.object];
    let cos_signed = dot(point.geometric_normal, gaze.direction);
    let is_front = cos_signed <= 0.0;
    let record = map_of(object, is_front);
    let level = footprint_level(record, point.map_density, gaze.width, abs(cos_signed));
    let baked = irradiance(record, point.map_uv, level);
    if baked.a > 0.0 {
        return fault_colour() / frame.radiance_scale;
    }
    var lit = baked.rgb;
    if HAS_BUMPS && object.bumps != NO_IMAGE {
        let side = select(-1.0, 1.0, is_front);
        let normals = array(side * point.interpolated_normal, side * point.shading_normal);
        lit = in_relief(lit, object.bumps, in_scene_m(point.place), normals);
    }
    if TRACES_LIGHTS {
        lit += direct_irradiance(lit_point(point, is_front, gaze), object);
    }
    return colour * lit / PI;
}

fn chain_radiance(first: Gaze) -> vec3f {
    var walk = Walk(first, vec3f(0.0), 0u);
    loop {
        // Passes smooth specular surfaces until another one is hit, so that neighbouring paths look up maps and trace
        // shadow rays at the same time.
        var point: SurfacePoint;
        var arrives = false;
        loop {
            // Wavelengths part before anything is added: the waiting ones trace this ray again.
            let seen = nearest(walk.gaze);
            let meets = seen.hit.triangle != NO_TRIANGLE;
            if meets {
                point = surface_point(seen.hit);
                part(&walk, point.object);
            }

            // Lamps are no surfaces: they are seen on the way, but not by the eye directly.
            if walk.gaze.depth > 0u && walk.gaze.coat != COAT_BEFORE {
                let lamps = walk.gaze.weight * lamps_on(walk.gaze, seen.distance);
                walk.radiance += shown(lamps, walk.gaze.wavelength);
            }
            if !meets {
                let has_suns = abs(walk.gaze.alpha) <= SKY_SUN_ALPHA && walk.gaze.coat != COAT_BEFORE;
                let beyond = walk.gaze.weight * background(walk.gaze.direction, has_suns);
                walk.radiance += shown(beyond, walk.gaze.wavelength);
                break;
            }
            let object = objects[point.object];
            walk.gaze.weight *= medium_transmittance(walk.gaze.media, seen.distance * start.unit_m);
            walk.gaze.width += walk.gaze.spread * seen.distance;

            // Emission is seen at any surface, whether the path ends on it or goes on, unless it is a highlight.
            var emitted = object.emitted_radiance;
            if HAS_LOBES && is_shown_otherwise(walk.gaze, object) {
                emitted = vec3f(0.0);
            }
            if object.glow != NO_IMAGE {
                // The wide footprints of lobes would mix what lies beside in the image alone, of any brightness.
                let cos_view = abs(dot(point.geometric_normal, walk.gaze.direction));
                let width = select(walk.gaze.width, 0.0, walk.gaze.lobes > 0u);
                let level = footprint_look_level(object.glow, point.uv_densities, width, cos_view);
                emitted *= looked_up(object.glow, point.uvs, level).rgb;
            }
            walk.radiance += shown(walk.gaze.weight * emitted, walk.gaze.wavelength);
            if has_map(object.surface) || is_rough(object) {
                arrives = true;
                break;
            }

            // Only smooth mirrors and clear surfaces are left, which pass the path on.
            var colour = object.base_colour;
            if HAS_TINTED_GLASS {
                let cos_view = abs(dot(point.geometric_normal, walk.gaze.direction));
                colour = tint(walk.gaze, point, cos_view);
            }
            if !go_on(&walk, point, interact(point, walk.gaze, colour)) {
                break;
            }
        }

        // Where the path arrives, it gathers diffuse light and highlights and goes on along the surface's branches.
        var goes_on = false;
        if arrives {
            let gaze = walk.gaze;
            let object = objects[point.object];
            let colour = tint(gaze, point, abs(dot(point.geometric_normal, gaze.direction)));
            let next = interact(point, gaze, colour);
            if has_map(object.surface) {
                let own = next.own * own_radiance(point, gaze, colour);
                walk.radiance += shown(gaze.weight * own, gaze.wavelength);
            }
            if HAS_LOBES && next.reflection.alpha > 0.0 {
                let facing = face(point, gaze, 0.0);
                let cos_view = -dot(gaze.direction, facing.shading);
                let reflected = largest(gaze.weight * reflectance_of(next.facets, cos_view, colour));
                let gloss = Gloss(point, facing, next.facets.alpha, next.facets, colour, reflected);
                walk.radiance += shown(gaze.weight * highlights(gloss, gaze), gaze.wavelength);
            }
            goes_on = go_on(&walk, point, next);
        }

        // The path has ended: the last one that waits goes on, until none is left.
        if !goes_on {
            if walk.count == 0u {
                break;
            }
            walk.count -= 1u;
            walk.gaze = waiting[walk.count];
        }
    }
    return walk.radiance;
}
