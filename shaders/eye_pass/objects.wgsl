// Material and transform of all objects, in one buffer.

struct ObjectRecord {
    base_colour: vec3f,
    ior: f32,
    emitted_radiance: vec3f,
    surface: u32,
    absorption_per_m: vec3f,
    double_sided: u32,
    map: u32,
    texture: u32,
    roughness: f32,
    bumps: u32,
    coat: f32,
    back_map: u32,
    // Number of its glass if that is dispersive; else 0.
    glass: u32,
    // Alpha of the texture below which the surface is cut out; 0 without a mask.
    alpha_cutoff: f32,
    // Texture reference of the image that multiplies transmission, roughness and metallic.
    variation: u32,
    metallic: f32,
    transmission: f32,
    // Coverage, to be multiplied by the texture's alpha; negative if all of the surface is there.
    coverage: f32,
    // Number of the body that it bounds: index + 1 of the object that stands for it; 0 for none.
    solid: u32,
    // Texture reference of its emission.
    glow: u32,
    // Number of the lamp that stands for it, from 1 on; 0 for none.
    lamp: u32,
    padding0: u32,
    // Rows of the transform from mesh to scene coordinates.
    row_x: vec4f,
    row_y: vec4f,
    row_z: vec4f,
}

const SURFACE_DIFFUSE: u32 = 0u;
const SURFACE_MIRROR: u32 = 1u;
const SURFACE_DIELECTRIC: u32 = 2u;
const SURFACE_THIN_WALL: u32 = 3u;
const SURFACE_COATED: u32 = 4u;
const SURFACE_VARIED: u32 = 5u;

@group(0) @binding(1) var<storage, read> objects: array<ObjectRecord>;

// Transforms a mesh normal to the scene and normalises it, given the rows of the transform. Outside stays outside under
// mirroring.
fn normal_in_scene(normal: vec3f, x: vec3f, y: vec3f, z: vec3f) -> vec3f {
    let across = cross(y, z);
    let turned = vec3f(dot(across, normal), dot(cross(z, x), normal), dot(cross(x, y), normal));
    let outwards = select(turned, -turned, dot(across, x) < 0.0);
    let squared = dot(outwards, outwards);
    return select(vec3f(0.0), outwards * inverseSqrt(squared), squared > 0.0);
}

// Record of the map of the visible side.
fn map_of(object: ObjectRecord, is_front: bool) -> u32 {
    return select(object.back_map, object.map, is_front);
}
