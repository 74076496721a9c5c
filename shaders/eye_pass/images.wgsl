// Illumination maps and textures, in tiles through a page table.

// The table holds a record for each image, followed by its pages. A record consists of
//   finest resident level, number of levels, scale, wrap modes (2 bits each) and nearest filtering (1 bit),
// and for each level
//   texels across and down, texels that the unit square spans across and down, index of the first page, pages across.
// A texture reference consists of
//   index of the image's record, texture coordinate set, two rows of the transform (KHR_texture_transform).
@group(0) @binding(2) var<storage, read> image_table: array<u32>;
@group(0) @binding(3) var map_tiles: texture_2d_array<f32>;
@group(0) @binding(4) var texture_tiles: texture_2d_array<f32>;

// Stands for a missing image.
const NO_IMAGE: u32 = 0xffffffffu;
const EMPTY: u32 = 0xffffffffu;
// Page of a tile that is no finer than the next level.
const COARSER: u32 = 0xfffffffeu;
const TILE: i32 = 64;
const STORED: i32 = 65;
const POOL_ACROSS: u32 = 31u;

const RECORD_WORDS: u32 = 4u;
const LEVEL_WORDS: u32 = 6u;

const WRAP_CLAMP: u32 = 0u;
const WRAP_REPEAT: u32 = 1u;
const WRAP_MIRROR: u32 = 2u;
const IS_NEAREST: u32 = 16u;

// Position of a bilinear lookup in a tile pool: its first texel, and the weights of the next ones.
struct Spot {
    texel: vec2i,
    layer: i32,
    is_empty: bool,
    is_coarser: bool,
    weight: vec2f,
}

fn level_extent(record: u32, level: u32) -> vec2f {
    let at = record + RECORD_WORDS + level * LEVEL_WORDS;
    return vec2f(bitcast<f32>(image_table[at + 2u]), bitcast<f32>(image_table[at + 3u]));
}

// Wraps a position, in texels from the first texel centre.
fn wrapped(position: f32, size: f32, wrap: u32) -> f32 {
    if wrap == WRAP_REPEAT {
        return position - size * floor(position / size);
    }
    return clamp(position, 0.0, size - 1.0);
}

// Folds mirrored coordinates: at the fold, both neighbours are the same texel.
fn folded(uv: f32, wrap: u32) -> f32 {
    if wrap == WRAP_MIRROR {
        let turn = uv - 2.0 * floor(0.5 * uv);
        return min(turn, 2.0 - turn);
    }
    return uv;
}

fn locate(record: u32, level: u32, uv: vec2f) -> Spot {
    let at = record + RECORD_WORDS + level * LEVEL_WORDS;
    let size = vec2f(f32(image_table[at]), f32(image_table[at + 1u]));
    let wraps = image_table[record + 3u];
    let wrap = vec2u(wraps & 3u, (wraps >> 2u) & 3u);
    let place = vec2f(folded(uv.x, wrap.x), folded(uv.y, wrap.y)) * level_extent(record, level) - 0.5;
    let position = vec2f(wrapped(place.x, size.x, wrap.x), wrapped(place.y, size.y, wrap.y));
    let low = min(floor(position), size - 1.0);
    let cell = vec2i(low);
    let tile = cell / TILE;
    let page = image_table[image_table[at + 4u] + u32(tile.y) * image_table[at + 5u] + u32(tile.x)];
    let per_layer = POOL_ACROSS * POOL_ACROSS;
    let within = page % per_layer;
    let corner = vec2i(i32(within % POOL_ACROSS), i32(within / POOL_ACROSS)) * STORED;
    return Spot(corner + cell - tile * TILE, i32(page / per_layer), page == EMPTY, page == COARSER, position - low);
}

// Bilinear lookup in one level.
fn level_value(tiles: texture_2d_array<f32>, record: u32, level: u32, uv: vec2f) -> vec4f {
    var spot = locate(record, level, uv);
    for (var next = level + 1u; spot.is_coarser && next < image_table[record + 1u]; next++) {
        spot = locate(record, next, uv);
    }
    if spot.is_empty || spot.is_coarser {
        return vec4f(0.0);
    }
    let is_nearest = (image_table[record + 3u] & IS_NEAREST) != 0u;
    // Blended in full precision: the 8-bit weights of samplers show as steps at the edge of a caustic.
    let weight = select(spot.weight, step(vec2f(0.5), spot.weight), is_nearest);
    let top = mix(
        textureLoad(tiles, spot.texel, spot.layer, 0),
        textureLoad(tiles, spot.texel + vec2i(1, 0), spot.layer, 0),
        weight.x,
    );
    let bottom = mix(
        textureLoad(tiles, spot.texel + vec2i(0, 1), spot.layer, 0),
        textureLoad(tiles, spot.texel + vec2i(1, 1), spot.layer, 0),
        weight.x,
    );
    return mix(top, bottom, weight.y);
}

// The two levels to blend, and the weight of the coarser one.
struct Levels {
    fine: u32,
    coarse: u32,
    share: f32,
}

fn levels(record: u32, level: f32) -> Levels {
    let finest = f32(image_table[record]);
    let coarsest = f32(image_table[record + 1u]) - 1.0;
    let wanted = clamp(level + frame.level_bias, finest, coarsest);
    let fine = floor(wanted);
    return Levels(u32(fine), u32(min(fine + 1.0, coarsest)), wanted - fine);
}

// Trilinear lookup.
fn value_at(tiles: texture_2d_array<f32>, record: u32, uv: vec2f, level: f32) -> vec4f {
    let at = levels(record, level);
    var value = level_value(tiles, record, at.fine, uv);
    if at.share > 0.0 {
        value = mix(value, level_value(tiles, record, at.coarse, uv), at.share);
    }
    return value;
}

// E [W/m²] of a map at a level, and the weight of texels that are not finite; black without a map.
fn irradiance(record: u32, uv: vec2f, level: f32) -> vec4f {
    if record == NO_IMAGE {
        return vec4f(0.0);
    }
    let value = value_at(map_tiles, record, uv, level);
    return vec4f(value.rgb * bitcast<f32>(image_table[record + 2u]), value.a);
}

fn look_number(at: u32) -> f32 {
    return bitcast<f32>(image_table[at]);
}

// Transforms the coordinates that a texture reference selects, or a difference of them.
fn placed(look: u32, uvs: vec4f, is_change: bool) -> vec2f {
    let uv = select(uvs.xy, uvs.zw, image_table[look + 1u] != 0u);
    let shift = vec2f(look_number(look + 4u), look_number(look + 7u));
    let turned = vec2f(
        look_number(look + 2u) * uv.x + look_number(look + 3u) * uv.y,
        look_number(look + 5u) * uv.x + look_number(look + 6u) * uv.y,
    );
    return turned + select(shift, vec2f(0.0), is_change);
}

// Linear colour and alpha of a texture reference at a level; white without one.
fn looked_up(look: u32, uvs: vec4f, level: f32) -> vec4f {
    if look == NO_IMAGE {
        return vec4f(1.0);
    }
    return value_at(texture_tiles, image_table[look], placed(look, uvs, false), level);
}

// Level at which a texel of a texture reference is as large as a parallelogram of coordinates.
fn look_level(look: u32, across: vec4f, down: vec4f) -> f32 {
    if look == NO_IMAGE {
        return 0.0;
    }
    return level_of(image_table[look], placed(look, across, true), placed(look, down, true));
}

// Level at which a texel is as large as a parallelogram of coordinates.
fn level_of(record: u32, across: vec2f, down: vec2f) -> f32 {
    if record == NO_IMAGE {
        return 0.0;
    }
    let extent = level_extent(record, 0u);
    let x = across * extent;
    let y = down * extent;
    return 0.5 * log2(max(abs(x.x * y.y - x.y * y.x), 1e-20));
}
