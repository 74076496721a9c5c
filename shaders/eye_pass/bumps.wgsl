// Normals perturbed by waves and by a normal map; twin of transport/bend.rs, transport/normal_texture.rs and
// scene/waves.rs. A record in the image table consists of
//   texture reference of the normal map, record of the lights that shade it, scale of its normals, number of waves,
// and for each wave
//   wave vector x, y, z [rad/m], phase [rad], amplitude [m].

// Whether any surface to be drawn has bumps.
override HAS_BUMPS: bool;

const BUMP_WORDS: u32 = 4u;
const WAVE_WORDS: u32 = 5u;
const STEEPEST_TEXEL: f32 = 8.0;
// A level below all others.
const FINEST: f32 = -1e3;

// A patch of a surface: two vectors along it, in any unit, and the changes of texture coordinates along them.
struct Piece {
    steps: array<vec3f, 2>,
    changes: array<vec4f, 2>,
    uvs: vec4f,
    // Level of the normal map.
    level: f32,
}

// Derivatives of a height field at a point of a surface.
struct Bump {
    // Gradient [1].
    gradient: vec3f,
    // Laplacian along the surface [1/m]; waves only.
    laplacian: f32,
}

fn table_float(at: u32) -> f32 {
    return bitcast<f32>(image_table[at]);
}

// Slope that a texel of the normal map encodes: -x/z and -y/z.
fn texel_slope(texel: vec2i, layer: i32, scale: f32) -> vec2f {
    // Texture loads decode sRGB, but normals are linear: recovers the stored code.
    let code = round(255.0 * srgb_from_linear(textureLoad(texture_tiles, texel, layer, 0).rgb));
    let normal = code / 127.5 - 1.0;
    let along = normal.xy * scale;
    let up = max(normal.z, length(along) / STEEPEST_TEXEL);
    return select(vec2f(0.0), -along / up, up > 0.0);
}

// Gradient of the height that a normal map encodes, on a patch with a unit normal.
fn image_gradient(look: u32, scale: f32, piece: Piece, normal: vec3f) -> vec3f {
    let first = placed(look, piece.changes[0], true);
    let second = placed(look, piece.changes[1], true);
    let turn = select(-1.0, 1.0, first.x * second.y - first.y * second.x >= 0.0);
    let by_u = (piece.steps[0] * second.y - piece.steps[1] * first.y) * turn;
    let by_v = (piece.steps[1] * first.x - piece.steps[0] * second.x) * turn;
    let along = by_u - normal * dot(normal, by_u);
    let size = dot(along, along);
    if size <= 0.0 {
        return vec3f(0.0);
    }
    let x = along * inverseSqrt(size);
    let across = cross(normal, x);
    let y = select(across, -across, dot(by_v, across) > 0.0);
    let record = image_table[look];
    let uv = placed(look, piece.uvs, false);
    let at = levels(record, piece.level);
    var slope = level_slope(record, at.fine, uv, scale);
    if at.share > 0.0 {
        slope = mix(slope, level_slope(record, at.coarse, uv, scale), at.share);
    }
    return x * slope.x + y * slope.y;
}

// Slope in one level of a normal map.
fn level_slope(record: u32, level: u32, uv: vec2f, scale: f32) -> vec2f {
    let spot = locate(record, level, uv);
    let top = mix(
        texel_slope(spot.texel, spot.layer, scale),
        texel_slope(spot.texel + vec2i(1, 0), spot.layer, scale),
        spot.weight.x,
    );
    let bottom = mix(
        texel_slope(spot.texel + vec2i(0, 1), spot.layer, scale),
        texel_slope(spot.texel + vec2i(1, 1), spot.layer, scale),
        spot.weight.x,
    );
    return mix(top, bottom, spot.weight.y);
}

// Sum of all bumps at a position in scene coordinates [m], on a patch with a unit normal.
fn bump_at(record: u32, place_m: vec3f, piece: Piece, normal: vec3f) -> Bump {
    var bump = Bump(vec3f(0.0), 0.0);
    let look = image_table[record];
    if look != NO_IMAGE {
        bump.gradient = image_gradient(look, table_float(record + 2u), piece, normal);
    }
    let count = image_table[record + 3u];
    for (var wave = 0u; wave < count; wave += 1u) {
        let at = record + BUMP_WORDS + wave * WAVE_WORDS;
        let vector = vec3f(table_float(at), table_float(at + 1u), table_float(at + 2u));
        let phase = dot(vector, place_m) + table_float(at + 3u);
        let amplitude = table_float(at + 4u);
        let along = vector - normal * dot(normal, vector);
        bump.gradient -= vector * (amplitude * sin(phase));
        bump.laplacian -= dot(along, along) * amplitude * cos(phase);
    }
    return bump;
}

fn bent(normal: vec3f, gradient: vec3f) -> vec3f {
    return normalize(normal - (gradient - normal * dot(normal, gradient)));
}
