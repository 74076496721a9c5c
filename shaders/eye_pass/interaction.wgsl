// How a ray of a chain interacts with a surface; twin of transport/interaction.rs.

// Normals of a point, oriented towards the side that the ray comes from.
struct Facing {
    front: bool,
    geometric: vec3f,
    // The geometric normal where the shading normal faces away from the ray.
    shading: vec3f,
    // Of the microfacet that is met; the shading normal of smooth surfaces.
    facet: vec3f,
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
    // Spread due to roughness, more than 0 where it scatters at a microfacet.
    spread_added: f32,
    // As of Gaze.
    alpha: f32,
}

// Parts of a surface by how their microfacets reflect.
struct Facets {
    metal: f32,
    // An interface or a coat, of this ratio of indices; a wall without thickness.
    coat: f32,
    wall: f32,
    eta: f32,
    // GGX α; 0 of smooth surfaces.
    alpha: f32,
}

struct Interaction {
    // Share of the diffuse radiance that leaves along the ray.
    own: f32,
    reflection: Branch,
    transmission: Branch,
    facets: Facets,
}

fn reflectance_of(facets: Facets, cos_incident: f32, tint: vec3f) -> vec3f {
    let wall = facets.wall * thin_wall_reflectance(cos_incident, facets.eta);
    let coat = facets.coat * dielectric_reflectance(cos_incident, facets.eta);
    return facets.metal * metal_reflectance(cos_incident, tint) + wall + coat;
}

fn face(point: SurfacePoint, gaze: Gaze, alpha: f32) -> Facing {
    let incident = gaze.direction;
    let front = dot(incident, point.geometric_normal) < 0.0;
    let geometric = select(-point.geometric_normal, point.geometric_normal, front);
    let towards = dot(point.shading_normal, geometric) >= 0.0;
    let shading = select(-point.shading_normal, point.shading_normal, towards);
    let about = select(geometric, shading, dot(incident, shading) < 0.0);
    if alpha > 0.0 {
        return Facing(front, geometric, about, visible_facet(facet_point(gaze.lobes), alpha, incident, about));
    }
    return Facing(front, geometric, about, about);
}

fn no_branch() -> Branch {
    return Branch(vec3f(0.0), vec3f(0.0), vec4u(0u), 0.0, 1.0, 0.0, 0.0);
}

// Up to this roughness surfaces are smooth.
const SMOOTH_ROUGHNESS: f32 = 0.01;

// GGX α; 0 of smooth surfaces.
fn lobe_alpha(roughness: f32) -> f32 {
    return select(0.0, roughness * roughness, HAS_LOBES && roughness > SMOOTH_ROUGHNESS);
}

// Spread of a reflection at a microfacet: what it keeps of the angle between the reflections off microfacets that are
// tilted by atan α one way and the other. All of it at later rough surfaces, of which each path sees one microfacet.
fn lobe_rad(alpha: f32, lobes: u32) -> f32 {
    return select(1.0, kept_width(), lobes == 0u) * 4.0 * atan(alpha);
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

fn reflection(point: SurfacePoint, facing: Facing, gaze: Gaze, share: vec3f, alpha: f32) -> Branch {
    let incident = gaze.direction;
    var direction = mirrored(incident, facing.facet);
    if alpha > 0.0 {
        direction = out_of(out_of(direction, facing.shading, 1.0), facing.geometric, 1.0);
    } else if dot(direction, facing.geometric) <= 0.0 {
        direction = mirrored(incident, facing.geometric);
    }
    let curvature = select(-point.curvature, point.curvature, facing.front);
    let widest = select(0.0, max(alpha, 0.5 * tilt(normalize(direction - incident), facing.shading)), alpha > 0.0);
    return Branch(direction, share, gaze.media, 2.0 * curvature, 1.0, lobe_rad(alpha, gaze.lobes), widest);
}

fn thin_wall(point: SurfacePoint, facing: Facing, gaze: Gaze, tint: vec3f, alpha: f32) -> Interaction {
    let eta = ior_of(point.object, gaze.wavelength) / medium_ior(gaze.media, gaze.wavelength);
    let reflectance = thin_wall_reflectance(-dot(gaze.direction, facing.facet), eta);
    // A rough wall sends on the mirror image of what it reflects.
    var direction = gaze.direction;
    if alpha > 0.0 {
        let back = out_of(mirrored(direction, facing.facet), facing.shading, 1.0);
        direction = out_of(mirrored(back, facing.shading), facing.geometric, -1.0);
    }
    return Interaction(
        0.0,
        reflection(point, facing, gaze, vec3f(reflectance), alpha),
        Branch(direction, tint * (1.0 - reflectance), gaze.media, 0.0, 1.0, lobe_rad(alpha, gaze.lobes), -alpha),
        Facets(0.0, 0.0, 1.0, eta, alpha),
    );
}

fn dielectric(point: SurfacePoint, facing: Facing, gaze: Gaze, tint: vec3f, alpha: f32) -> Interaction {
    // The bodies that the path is inside of tell the media on both sides of the surface.
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

    // Beyond the critical angle, which the facet's normal decides first, all light is reflected.
    let eta = ior_far / ior_near;
    let cos_incident = -dot(incident, facing.facet);
    let cos_clamped = clamp(cos_incident, 0.0, 1.0);
    let cos_geometric = clamp(-dot(incident, facing.geometric), 0.0, 1.0);
    let facets = Facets(0.0, 1.0, 0.0, eta, alpha);
    let whole = Interaction(0.0, reflection(point, facing, gaze, vec3f(1.0), alpha), no_branch(), facets);
    if eta != 1.0 && scaled_cos2_transmitted(cos_clamped, eta) <= 0.0 {
        return whole;
    }

    // A shading normal may refract the ray back to the side that it came from; the triangle's normal then refracts it,
    // or reflects all light.
    var direction = refracted(incident, facing.facet, eta);
    if alpha > 0.0 {
        direction = out_of(out_of(direction, facing.shading, -1.0), facing.geometric, -1.0);
    } else if dot(direction, facing.geometric) >= 0.0 {
        if eta != 1.0 && scaled_cos2_transmitted(cos_geometric, eta) <= 0.0 {
            return whole;
        }
        direction = refracted(incident, facing.geometric, eta);
    }

    let reflectance = dielectric_reflectance(cos_incident, eta);
    // Radiance scales by the square of n on the ray's side over n on the far side.
    let share = tint * ((1.0 - reflectance) / (eta * eta));
    let curvature = select(-point.curvature, point.curvature, facing.front);
    // A facet's tilt turns a refracted ray by |1/eta - 1| times the tilt, and a reflected one by twice the tilt.
    let narrower = 0.5 * abs(1.0 / eta - 1.0);
    return Interaction(
        0.0,
        reflection(point, facing, gaze, vec3f(reflectance), alpha),
        Branch(
            direction,
            share,
            beyond,
            curvature * (1.0 / eta - 1.0),
            1.0 / eta,
            narrower * lobe_rad(alpha, gaze.lobes),
            -narrower * alpha,
        ),
        facets,
    );
}

// Sum of the interactions of a mixture's shares. No surface is both clear and perforated.
fn varied(point: SurfacePoint, facing: Facing, gaze: Gaze, tint: vec3f, factors: vec3f) -> Interaction {
    let object = objects[point.object];
    let alpha = lobe_alpha(object.roughness * factors.y);
    let mixture = mixture_at(point, gaze, factors);
    let eta = ior_of(point.object, gaze.wavelength) / medium_ior(gaze.media, gaze.wavelength);
    var met = Interaction(0.0, no_branch(), no_branch(), Facets(0.0, 0.0, 0.0, eta, alpha));
    if mixture.clear > 0.0 {
        if object.solid != 0u {
            met = dielectric(point, facing, gaze, tint, alpha);
        } else {
            met = thin_wall(point, facing, gaze, tint, alpha);
        }
        met.reflection.share *= mixture.clear;
        met.transmission.share *= mixture.clear;
    } else if mixture.hole > 0.0 {
        met.transmission = Branch(gaze.direction, vec3f(mixture.hole), gaze.media, 0.0, 1.0, 0.0, gaze.alpha);
    }
    let cos_incident = -dot(gaze.direction, facing.facet);
    let coat = mixture.coat * dielectric_reflectance(cos_incident, eta);
    let back = mixture.metal * metal_reflectance(cos_incident, tint) + vec3f(mixture.body * coat);
    met.reflection = reflection(point, facing, gaze, met.reflection.share + back, alpha);
    // The map already accounts for the body's share.
    met.own = 1.0 - coat;
    met.facets.metal = mixture.metal;
    met.facets.coat = mixture.clear * met.facets.coat + mixture.body * mixture.coat;
    met.facets.wall *= mixture.clear;
    return met;
}

fn interact(point: SurfacePoint, gaze: Gaze, tint: vec3f) -> Interaction {
    // Fresnel shares follow the facet, about a shading normal that bumps perturb.
    let object = objects[point.object];
    let factors = factors_at(point, gaze);
    let alpha = lobe_alpha(object.roughness * factors.y);
    let facing = face(point, gaze, alpha);
    let cos_incident = -dot(gaze.direction, facing.facet);

    // `own` is what a coat lets out of the diffuse body; surfaces without such a body have none.
    switch object.surface {
        case SURFACE_MIRROR: {
            let share = metal_reflectance(cos_incident, tint);
            let facets = Facets(1.0, 0.0, 0.0, 1.0, alpha);
            return Interaction(0.0, reflection(point, facing, gaze, share, alpha), no_branch(), facets);
        }
        case SURFACE_COATED: {
            let eta = ior_of(point.object, gaze.wavelength) / medium_ior(gaze.media, gaze.wavelength);
            let reflectance = object.coat * dielectric_reflectance(cos_incident, eta);
            let back = reflection(point, facing, gaze, vec3f(reflectance), alpha);
            return Interaction(1.0 - reflectance, back, no_branch(), Facets(0.0, object.coat, 0.0, eta, alpha));
        }
        case SURFACE_THIN_WALL: {
            return thin_wall(point, facing, gaze, tint, alpha);
        }
        case SURFACE_DIELECTRIC: {
            return dielectric(point, facing, gaze, tint, alpha);
        }
        case SURFACE_VARIED: {
            return varied(point, facing, gaze, tint, factors);
        }
        default: {
            return Interaction(1.0, no_branch(), no_branch(), Facets(0.0, 0.0, 0.0, 1.0, 0.0));
        }
    }
}
