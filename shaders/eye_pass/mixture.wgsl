// Composition of a surface at a point; twin of scene/mixture.rs.

// Above these roughnesses, coats reflect no light, none that the eye sees, and metals are diffuse.
const SPECULAR_ROUGHNESS_LIMIT: f32 = 0.3;
const GLOSSY_ROUGHNESS_LIMIT: f32 = 0.6;
const METAL_ROUGHNESS_LIMIT: f32 = 0.6;

// Shares of a surface that add up to one.
struct Mixture {
    metal: f32,
    clear: f32,
    body: f32,
    hole: f32,
    // Coverage of the body by the coat that the eye sees, and by one that light sees.
    coat: f32,
    light_coat: f32,
}

// Composition with factors of transmission, roughness and metallic from an image, and the alpha of the base colour.
fn mixture_of(object: ObjectRecord, factors: vec3f, alpha: f32) -> Mixture {
    let there = select(object.coverage * alpha, 1.0, object.coverage < 0.0);
    let roughness = object.roughness * factors.y;
    let metallic = object.metallic * factors.z;
    let metal = select(0.0, there * metallic, roughness <= METAL_ROUGHNESS_LIMIT);
    let clear = there * (1.0 - metallic) * object.transmission * factors.x;
    let coat = select(0.0, object.coat, roughness <= GLOSSY_ROUGHNESS_LIMIT);
    let light_coat = select(0.0, object.coat, roughness <= SPECULAR_ROUGHNESS_LIMIT);
    return Mixture(metal, clear, max(there - metal - clear, 0.0), 1.0 - there, coat, light_coat);
}

// What the body receives of incident light: its share of the surface, and its coverage by the coat.
struct DiffuseResponse {
    share: f32,
    coat: f32,
}

fn diffuse_response_of(object: ObjectRecord, mixture: Mixture) -> DiffuseResponse {
    switch object.surface {
        case SURFACE_COATED: {
            // What light finds matte has no image of its roughness.
            let is_matte = object.variation == NO_IMAGE && object.roughness > SPECULAR_ROUGHNESS_LIMIT;
            return DiffuseResponse(1.0, select(object.coat, 0.0, is_matte));
        }
        case SURFACE_VARIED: {
            return DiffuseResponse(mixture.body, mixture.light_coat);
        }
        default: {
            return DiffuseResponse(1.0, 0.0);
        }
    }
}
