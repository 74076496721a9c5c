// Normals bent by waves; twin of transport/bend.rs and scene/waves.rs. A record in the table of images is
//   number of waves,
// and for each wave
//   wave vector x, y, z [rad/m], phase [rad], amplitude [m].

// Whether any surface that is drawn has bumps.
override HAS_BUMPS: bool;

const WAVE_WORDS: u32 = 5u;

// What a height over a surface does at a place.
struct Bump {
    // Its gradient [1].
    gradient: vec3f,
    // Sum of its second derivatives along the surface [1/m].
    laplacian: f32,
}

fn table_float(at: u32) -> f32 {
    return bitcast<f32>(image_table[at]);
}

// Of all waves at a place in scene coordinates [m], over a surface with a unit normal.
fn bump_at(record: u32, place_m: vec3f, normal: vec3f) -> Bump {
    var bump = Bump(vec3f(0.0), 0.0);
    let count = image_table[record];
    for (var wave = 0u; wave < count; wave += 1u) {
        let at = record + 1u + wave * WAVE_WORDS;
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
