// The layers of a map's light that are switched on, summed in the tiles of the map.

struct MapTile {
    corner: vec3u,
    irradiance_scale: f32,
    first_texel: vec2f,
    extent: vec2f,
}

// Factors of the caustic, the direct and the indirect layer.
@group(0) @binding(0) var<uniform> factors: vec3f;
@group(0) @binding(1) var<storage, read> tiles: array<MapTile>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var caustic: texture_2d<f32>;
@group(0) @binding(4) var direct: texture_2d<f32>;
@group(0) @binding(5) var indirect: texture_2d<f32>;
@group(0) @binding(6) var pool: texture_storage_2d_array<rgba16float, write>;

const STORED: u32 = 65u;

// E [W/m²] of a layer, whose size is its own, where a level of the map has a texel.
fn irradiance(layer: texture_2d<f32>, uv: vec2f, extent: vec2f) -> vec3f {
    let level = log2(f32(textureDimensions(layer).x) / extent.x);
    return textureSampleLevel(layer, bilinear, uv, max(level, 0.0)).rgb;
}

@compute @workgroup_size(8, 8)
fn summed(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(STORED)) {
        return;
    }
    let tile = tiles[id.z];
    let uv = (tile.first_texel + vec2f(id.xy) + 0.5) / tile.extent;
    let sum = factors.x * irradiance(caustic, uv, tile.extent)
        + factors.y * irradiance(direct, uv, tile.extent)
        + factors.z * irradiance(indirect, uv, tile.extent);
    textureStore(pool, tile.corner.xy + id.xy, tile.corner.z, vec4f(sum / tile.irradiance_scale, 0.0));
}
