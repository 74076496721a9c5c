// How a ray of a chain interacts with a surface; twin of transport/interaction.rs.

// Normals of a point, oriented towards the side that the ray comes from.
struct Facing {
    front: bool,
    geometric: vec3f,
    // The geometric normal where the shading normal faces away from the ray.
    shading: vec3f,
}

// A continuation of the path. `share` is the fraction of radiance; 0 for no branch.
struct Branch {
    direction: vec3f,
    share: vec3f,
    media: vec4u,
    // The new spread is the old one times `spread_factor`, plus the width times `spread_per_width`, plus
    // `spread_added`.
    spread_per_width: f32,
    spread_factor: f32,
    // Spread due to roughness: an approximation that blurs maps and textures, but no edges.
    spread_added: f32,
}

struct Interaction {
    // Share of the diffuse radiance that leaves along the ray.
    own: f32,
    reflection: Branch,
    transmission: Branch,
}

fn face(point: SurfacePoint, incident: vec3f) -> Facing {
    let front = dot(incident, point.geometric_normal) < 0.0;
    let geometric = select(-point.geometric_normal, point.geometric_normal, front);
    let towards = dot(point.shading_normal, geometric) >= 0.0;
    let shading = select(-point.shading_normal, point.shading_normal, towards);
    return Facing(front, geometric, select(geometric, shading, dot(incident, shading) < 0.0));
}

fn no_branch() -> Branch {
    return Branch(vec3f(0.0), vec3f(0.0), vec4u(0u), 0.0, 1.0, 0.0);
}

// Angle between the reflections off microfacets that are tilted by atan α (GGX) one way and the other; half of all
// microfacets are tilted less.
fn lobe_rad(roughness: f32) -> f32 {
    return 4.0 * atan(roughness * roughness);
}

// Factors of transmission, roughness and metallic from an image, at the footprint of the ray.
fn factors_at(point: SurfacePoint, gaze: Gaze) -> vec3f {
    let look = objects[point.object].variation;
    if look == NO_IMAGE {
        return vec3f(1.0);
    }
    let cos_view = abs(dot(point.geometric_normal, gaze.direction));
    return looked_up(look, point.uvs, footprint_look_level(look, point.uv_densities, gaze.width, cos_view)).rgb;
}

fn mixture_at(point: SurfacePoint, gaze: Gaze, factors: vec3f) -> Mixture {
    let object = objects[point.object];
    let cos_view = abs(dot(point.geometric_normal, gaze.direction));
    let level = footprint_look_level(object.texture, point.uv_densities, gaze.width, cos_view);
    return mixture_of(object, factors, looked_up(object.texture, point.uvs, level).a);
}

fn reflection(point: SurfacePoint, facing: Facing, gaze: Gaze, share: vec3f, lobe: f32) -> Branch {
    let incident = gaze.direction;
    var direction = mirrored(incident, facing.shading);
    if dot(direction, facing.geometric) <= 0.0 {
        direction = mirrored(incident, facing.geometric);
    }
    let curvature = select(-point.curvature, point.curvature, facing.front);
    return Branch(direction, share, gaze.media, 2.0 * curvature, 1.0, lobe);
}

fn thin_wall(point: SurfacePoint, facing: Facing, gaze: Gaze, tint: vec3f, lobe: f32) -> Interaction {
    let eta = ior_of(point.object, gaze.wavelength) / medium_ior(gaze.media, gaze.wavelength);
    let reflectance = thin_wall_reflectance(-dot(gaze.direction, facing.shading), eta);
    return Interaction(
        0.0,
        reflection(point, facing, gaze, vec3f(reflectance), lobe),
        Branch(gaze.direction, tint * (1.0 - reflectance), gaze.media, 0.0, 1.0, lobe),
    );
}

fn dielectric(point: SurfacePoint, facing: Facing, gaze: Gaze, tint: vec3f, lobe: f32) -> Interaction {
    let incident = gaze.direction;
    let media = gaze.media;
    let ior = ior_of(point.object, gaze.wavelength);
    let body = objects[point.object].solid - 1u;
    var beyond = left(media, body);
    // Where bodies overlap, the one entered last is the medium until the ray leaves it. An open sheet was never
    // entered.
    var ior_near = select(medium_ior(media, gaze.wavelength), ior, all(beyond == media));
    var ior_far = medium_ior(beyond, gaze.wavelength);
    if facing.front {
        beyond = entered(media, body);
        ior_near = medium_ior(media, gaze.wavelength);
        ior_far = ior;
    }
    let eta = ior_far / ior_near;
    let cos_incident = -dot(incident, facing.shading);
    let cos_clamped = clamp(cos_incident, 0.0, 1.0);
    let cos_geometric = clamp(-dot(incident, facing.geometric), 0.0, 1.0);
    let whole = Interaction(0.0, reflection(point, facing, gaze, vec3f(1.0), lobe), no_branch());
    if eta != 1.0 && scaled_cos2_transmitted(cos_clamped, eta) <= 0.0 {
        return whole;
    }
    var direction = refracted(incident, facing.shading, eta);
    if dot(direction, facing.geometric) >= 0.0 {
        if eta != 1.0 && scaled_cos2_transmitted(cos_geometric, eta) <= 0.0 {
            return whole;
        }
        direction = refracted(incident, facing.geometric, eta);
    }
    let reflectance = dielectric_reflectance(cos_incident, eta);
    // Radiance scales by the square of n on the ray's side over n on the far side.
    let share = tint * ((1.0 - reflectance) / (eta * eta));
    let curvature = select(-point.curvature, point.curvature, facing.front);
    return Interaction(
        0.0,
        reflection(point, facing, gaze, vec3f(reflectance), lobe),
        // A facet's tilt turns a refracted ray by |1/eta - 1| times the tilt, and a reflected one by twice the tilt.
        Branch(
            direction,
            share,
            beyond,
            curvature * (1.0 / eta - 1.0),
            1.0 / eta,
            0.5 * abs(1.0 / eta - 1.0) * lobe,
        ),
    );
}

// Sum of the interactions of a mixture's shares. No surface is both clear and perforated.
fn varied(point: SurfacePoint, facing: Facing, gaze: Gaze, tint: vec3f, factors: vec3f) -> Interaction {
    let object = objects[point.object];
    let lobe = lobe_rad(object.roughness * factors.y);
    let mixture = mixture_at(point, gaze, factors);
    var met = Interaction(0.0, no_branch(), no_branch());
    if mixture.clear > 0.0 {
        if object.solid != 0u {
            met = dielectric(point, facing, gaze, tint, lobe);
        } else {
            met = thin_wall(point, facing, gaze, tint, lobe);
        }
        met.reflection.share *= mixture.clear;
        met.transmission.share *= mixture.clear;
    } else if mixture.hole > 0.0 {
        met.transmission = Branch(gaze.direction, vec3f(mixture.hole), gaze.media, 0.0, 1.0, 0.0);
    }
    let cos_incident = -dot(gaze.direction, facing.shading);
    let eta = ior_of(point.object, gaze.wavelength) / medium_ior(gaze.media, gaze.wavelength);
    let coat = mixture.coat * dielectric_reflectance(cos_incident, eta);
    let back = mixture.metal * metal_reflectance(cos_incident, tint) + vec3f(mixture.body * coat);
    met.reflection = reflection(point, facing, gaze, met.reflection.share + back, lobe);
    // The map already accounts for the body's share.
    met.own = 1.0 - coat;
    return met;
}

fn interact(point: SurfacePoint, gaze: Gaze, tint: vec3f) -> Interaction {
    let object = objects[point.object];
    let facing = face(point, gaze.direction);
    let cos_incident = -dot(gaze.direction, facing.shading);
    let factors = factors_at(point, gaze);
    let lobe = lobe_rad(object.roughness * factors.y);
    switch object.surface {
        case SURFACE_MIRROR: {
            let share = metal_reflectance(cos_incident, tint);
            return Interaction(0.0, reflection(point, facing, gaze, share, lobe), no_branch());
        }
        case SURFACE_COATED: {
            let eta = ior_of(point.object, gaze.wavelength) / medium_ior(gaze.media, gaze.wavelength);
            let reflectance = object.coat * dielectric_reflectance(cos_incident, eta);
            let back = reflection(point, facing, gaze, vec3f(reflectance), lobe);
            return Interaction(1.0 - reflectance, back, no_branch());
        }
        case SURFACE_THIN_WALL: {
            return thin_wall(point, facing, gaze, tint, lobe);
        }
        case SURFACE_DIELECTRIC: {
            return dielectric(point, facing, gaze, tint, lobe);
        }
        case SURFACE_VARIED: {
            return varied(point, facing, gaze, tint, factors);
        }
        default: {
            return Interaction(1.0, no_branch(), no_branch());
        }
    }
}
