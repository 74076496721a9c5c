// Shading of diffuse light by normal maps; twin of eye_pass/relief.rs. A record in the image table consists of
//   number of lamps, irradiance of the sky: its mean and its change with the three components of the normal [W/m²]
// and the lamps, with positions in scene coordinates [m].

const SKY_WORDS: u32 = 1u;
const LAMP_WORDS: u32 = 13u;
const WORDS_OF_LAMP: u32 = 24u;
const MAX_GAIN: f32 = 4.0;

fn table_vector(at: u32) -> vec3f {
    return vec3f(table_float(at), table_float(at + 1u), table_float(at + 2u));
}

fn lamp_at(at: u32) -> LightRecord {
    var lamp: LightRecord;
    lamp.place = table_vector(at);
    lamp.kind = image_table[at + 3u];
    lamp.strength = table_vector(at + 4u);
    lamp.cos_inner = table_float(at + 7u);
    lamp.axis = table_vector(at + 8u);
    lamp.cos_outer = table_float(at + 11u);
    return lamp;
}

// Unoccluded irradiance of a surface [W/m²].
fn sky_irradiance(record: u32, normal: vec3f) -> vec3f {
    let at = record + SKY_WORDS;
    let change = mat3x3f(table_vector(at + 3u), table_vector(at + 6u), table_vector(at + 9u));
    return max(table_vector(at) + change * normal, vec3f(0.0));
}

// The same from all lamps, for two normals.
fn lamp_irradiances(record: u32, place_m: vec3f, normals: array<vec3f, 2>) -> array<vec3f, 2> {
    var sums = array(vec3f(0.0), vec3f(0.0));
    for (var index = 0u; index < image_table[record]; index += 1u) {
        let lamp = lamp_at(record + LAMP_WORDS + index * WORDS_OF_LAMP);
        var to_lamp = -lamp.place;
        var across_beam = 1.0;
        if lamp.kind != LIGHT_SUN {
            let offset = lamp.place - place_m;
            let squared = max(dot(offset, offset), 1e-20);
            to_lamp = offset * inverseSqrt(squared);
            across_beam = falloff(lamp, -to_lamp) / squared;
        }
        sums[0] += lamp.strength * (across_beam * max(dot(to_lamp, normals[0]), 0.0));
        sums[1] += lamp.strength * (across_beam * max(dot(to_lamp, normals[1]), 0.0));
    }
    return sums;
}

fn share_of(part: f32, whole: f32) -> f32 {
    return select(0.0, clamp(part / max(whole, 1e-30), 0.0, 1.0), whole > 0.0);
}

// E [W/m²] of a surface with a record of bumps, given E of the smooth surface, its normal and the bent one.
fn in_relief(smooth_irradiance: vec3f, bumps: u32, place_m: vec3f, normals: array<vec3f, 2>) -> vec3f {
    let record = image_table[bumps + 1u];
    if record == NO_IMAGE {
        return smooth_irradiance;
    }
    let sky = sky_irradiance(record, normals[0]);
    let lamps = lamp_irradiances(record, place_m, normals);
    let luminance = dot(smooth_irradiance, LUMINANCE);
    let of_sky = dot(sky, LUMINANCE);
    let of_lamps = dot(lamps[0], LUMINANCE);
    let gain = share_of(MAX_GAIN * of_lamps, dot(lamps[1], LUMINANCE));
    let shaded = smooth_irradiance
        + (sky_irradiance(record, normals[1]) - sky) * share_of(luminance, of_sky)
        + (lamps[1] * gain - lamps[0]) * share_of(luminance - of_sky, of_lamps);
    return max(shaded, vec3f(0.0));
}
