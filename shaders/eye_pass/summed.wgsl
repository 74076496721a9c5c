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

// Most lookups across and down: enough for all of a layer in 128 times as coarse a level.
const LOOKUPS: f32 = 64.0;

// E [W/m²] of a layer, whose size is its own, over a texel of a level of the map. Each lookup is the mean of 2 x 2 texels
// of a finer layer.
fn irradiance(layer: texture_2d<f32>, uv: vec2f, extent: vec2f) -> vec3f {
    let texels = vec2f(textureDimensions(layer)) / extent;
    let lookups = clamp(ceil(0.5 * texels), vec2f(1.0), vec2f(LOOKUPS));
    var sum = vec3f(0.0);
    for (var row = 0.5; row < lookups.y; row += 1.0) {
        for (var column = 0.5; column < lookups.x; column += 1.0) {
            let within = vec2f(column, row) / lookups - 0.5;
            sum += textureSampleLevel(layer, bilinear, uv + within / extent, 0.0).rgb;
        }
    }
    return sum / (lookups.x * lookups.y);
}

@compute @workgroup_size(8, 8)
fn summed(@builtin(global_invocation_id) id: vec3u) {
    let tile = tiles[id.z];
    // Coarse levels cost many lookups a texel, and few of their tile's texels are ever read: those of the level, and the next.
    if any(id.xy >= vec2u(STORED)) || any(vec2f(id.xy) > tile.extent - tile.first_texel) {
        return;
    }
    let uv = (tile.first_texel + vec2f(id.xy) + 0.5) / tile.extent;
    let sum = factors.x * irradiance(caustic, uv, tile.extent)
        + factors.y * irradiance(direct, uv, tile.extent)
        + factors.z * irradiance(indirect, uv, tile.extent);
    textureStore(pool, tile.corner.xy + id.xy, tile.corner.z, vec4f(sum / tile.irradiance_scale, 0.0));
}
