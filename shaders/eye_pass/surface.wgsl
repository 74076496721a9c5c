// Surfaces of the scene: radiance from the illumination maps, specular ones approximated.
//
// Radiance is written times frame.radiance_scale, so that it fits half floats.

struct ObjectUniform {
    base_colour: vec3f,
    irradiance_scale: f32,
    emitted_radiance: vec3f,
    ior: f32,
    body_transmittance: vec3f,
    padding: u32,
}

const SURFACE_DIFFUSE: u32 = 0u;
const SURFACE_MIRROR: u32 = 1u;
const SURFACE_DIELECTRIC: u32 = 2u;
const SURFACE_THIN_WALL: u32 = 3u;
const SURFACE_MIXED: u32 = 4u;

// Kind of the surface, one of SURFACE_*.
override SURFACE: u32;
// Whether base_colour_texture is an image and not just white.
override HAS_BASE_COLOUR_TEXTURE: bool;

const PI: f32 = 3.14159265358979;
// Largest value written [scaled radiance]: half floats end at 65504, and a pane may still multiply it.
const LARGEST: f32 = 8192.0;

@group(1) @binding(0) var<uniform> object: ObjectUniform;
@group(1) @binding(1) var illumination_map: texture_2d<f32>;
@group(1) @binding(2) var base_colour_texture: texture_2d<f32>;
@group(1) @binding(3) var base_colour_sampler: sampler;

struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) map_uv: vec2f,
}

struct Fragment {
    @builtin(position) clip: vec4f,
    @location(0) from_camera: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) map_uv: vec2f,
}

@vertex
fn place(corner: Corner) -> Fragment {
    // Relative to the camera first: differences of nearby numbers lose nothing.
    let from_camera = corner.position - frame.camera_position;
    return Fragment(
        frame.clip_from_camera * vec4f(from_camera, 1.0),
        from_camera,
        corner.normal,
        corner.uv,
        corner.map_uv,
    );
}

// What a surface point is, seen from its lit side.
struct SurfacePoint {
    base_colour: vec3f,
    // Unit, towards the eye's side.
    normal: vec3f,
    // Unit, from the eye to the point.
    view: vec3f,
    cos_view: f32,
}

fn surface_point(fragment: Fragment, front: bool) -> SurfacePoint {
    var base_colour = object.base_colour;
    if HAS_BASE_COLOUR_TEXTURE {
        base_colour *= textureSample(base_colour_texture, base_colour_sampler, fragment.uv).rgb;
    }
    let view = normalize(fragment.from_camera);
    let outward = normalize(fragment.normal);
    let normal = select(-outward, outward, front);
    return SurfacePoint(base_colour, normal, view, clamp(-dot(normal, view), 0.0, 1.0));
}

// E [W/m²]: bilinear between texel centres, held at the border. Weights in full precision, since the steps of the
// 8-bit weights that samplers use show at the edge of a caustic.
fn irradiance(uv: vec2f) -> vec3f {
    let size = vec2i(textureDimensions(illumination_map));
    let texel = uv * vec2f(size) - 0.5;
    let low = floor(texel);
    let weight = texel - low;
    let last = size - 1;
    let a = clamp(vec2i(low), vec2i(0), last);
    let b = clamp(vec2i(low) + 1, vec2i(0), last);
    let top = mix(
        textureLoad(illumination_map, a, 0).rgb,
        textureLoad(illumination_map, vec2i(b.x, a.y), 0).rgb,
        weight.x,
    );
    let bottom = mix(
        textureLoad(illumination_map, vec2i(a.x, b.y), 0).rgb,
        textureLoad(illumination_map, b, 0).rgb,
        weight.x,
    );
    return mix(top, bottom, weight.y) * object.irradiance_scale;
}

fn diffuse_radiance(fragment: Fragment, base_colour: vec3f) -> vec3f {
    return base_colour * irradiance(fragment.map_uv) / PI;
}

fn reflected_radiance(fragment: Fragment, point: SurfacePoint) -> vec3f {
    let place = frame.camera_position + fragment.from_camera;
    // Nothing nearer than this is another surface: single precision ends there.
    let nearest = 1e-4 * length(fragment.from_camera);
    return surrounding_radiance(place, reflect(point.view, point.normal), nearest);
}

fn scaled(radiance: vec3f) -> vec4f {
    return vec4f(clamp(radiance * frame.radiance_scale, vec3f(0.0), vec3f(LARGEST)), 1.0);
}

// Share of light that a polish sends back; 0 without one.
fn polish_reflectance(point: SurfacePoint) -> f32 {
    if SURFACE == SURFACE_MIXED {
        return dielectric_reflectance(point.cos_view, object.ior);
    }
    return 0.0;
}

// What a surface sends by itself: emission, and the share of its map that its polish lets out.
fn own_radiance(fragment: Fragment, point: SurfacePoint) -> vec3f {
    if SURFACE == SURFACE_MIRROR {
        return object.emitted_radiance;
    }
    let diffuse = diffuse_radiance(fragment, point.base_colour);
    return object.emitted_radiance + (1.0 - polish_reflectance(point)) * diffuse;
}

// Opaque surfaces that reflect nothing, or whose reflections are left out.
@fragment
fn own(fragment: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    return scaled(own_radiance(fragment, surface_point(fragment, front)));
}

// Opaque surfaces with their reflections.
@fragment
fn own_and_reflected(fragment: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let point = surface_point(fragment, front);
    var reflectance = vec3f(polish_reflectance(point));
    if SURFACE == SURFACE_MIRROR {
        reflectance = metal_reflectance(point.cos_view, point.base_colour);
    }
    return scaled(own_radiance(fragment, point) + reflectance * reflected_radiance(fragment, point));
}

// Maps as they are, neither lit nor reflected.
@fragment
fn map_value(fragment: Fragment) -> @location(0) vec4f {
    return scaled(irradiance(fragment.map_uv));
}

// Share of light sent back by a clear interface as seen from outside; both faces of a body are treated alike, since
// rays are not bent here.
fn clear_reflectance(point: SurfacePoint) -> f32 {
    if SURFACE == SURFACE_THIN_WALL {
        return thin_wall_reflectance(point.cos_view, object.ior);
    }
    return dielectric_reflectance(point.cos_view, object.ior);
}

// Factor on the radiance behind a clear surface. Radiance falls by n² into a body and grows by n² out of it.
fn clear_transmittance(point: SurfacePoint, reflectance: f32, front: bool) -> vec3f {
    let factor = (1.0 - reflectance) * point.base_colour;
    if SURFACE != SURFACE_DIELECTRIC {
        return factor;
    }
    let n2 = object.ior * object.ior;
    return factor * select(vec3f(n2), object.body_transmittance / n2, front);
}

@fragment
fn transmitted(fragment: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let point = surface_point(fragment, front);
    return vec4f(clear_transmittance(point, clear_reflectance(point), front), 1.0);
}

// What a clear surface adds: reflection and its own light.
@fragment
fn reflected(fragment: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let point = surface_point(fragment, front);
    return scaled(object.emitted_radiance + clear_reflectance(point) * reflected_radiance(fragment, point));
}

// Both at once where all channels are alike: what is added, and in alpha the factor on what is behind.
@fragment
fn grey(fragment: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let point = surface_point(fragment, front);
    let reflectance = clear_reflectance(point);
    let added = object.emitted_radiance + reflectance * reflected_radiance(fragment, point);
    return vec4f(scaled(added).rgb, clear_transmittance(point, reflectance, front).g);
}
