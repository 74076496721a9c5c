// Chains that go on by wavelength from where they meet glass that parts light; twin of eye_pass/wavelengths.rs.

// Wavelengths of a picture.
const MAX_WAVELENGTHS: u32 = 4u;
// Gazes that may wait: one for each surface at which both ways on are followed, and those of the other wavelengths.
const MAX_WAITING: u32 = MAX_BRANCHING + MAX_WAVELENGTHS - 1u;

struct SeenWavelengths {
    // From radiance in linear sRGB to what is seen of it at each wavelength.
    shares: array<mat3x3f, 4>,
    count: u32,
    padding0: u32,
    padding1: u32,
    padding2: u32,
    // Refractive index of each glass at each wavelength.
    indices: array<vec4f, 128>,
}

@group(1) @binding(7) var<uniform> wavelengths: SeenWavelengths;

// A wavelength is its number from 1; 0 is all of them, by the index at 587.56 nm.
fn ior_of(object: u32, wavelength: u32) -> f32 {
    let glass = objects[object].glass;
    if wavelength == 0u || glass == 0u {
        return objects[object].ior;
    }
    return wavelengths.indices[glass - 1u][wavelength - 1u];
}

// What is seen of a radiance.
fn shown(radiance: vec3f, wavelength: u32) -> vec3f {
    if wavelength == 0u {
        return radiance;
    }
    return wavelengths.shares[wavelength - 1u] * radiance;
}

fn is_within_parting_glass(media: vec4u) -> bool {
    for (var place = 0u; place < MEDIA; place += 1u) {
        let number = medium_at(media, place);
        if number == 0u {
            return false;
        }
        if objects[number - 1u].glass != 0u {
            return true;
        }
    }
    return false;
}

// Where light goes on from a surface another way at another wavelength, the gaze goes on at the first one; those at the
// others wait, and will meet the surface again.
fn part(walk: ptr<function, Walk>, object: u32) {
    let surface = objects[object].surface;
    let goes_by_index = is_clear(surface) || surface == SURFACE_MIXED || surface == SURFACE_VARIED;
    if (*walk).gaze.wavelength != 0u || !goes_by_index {
        return;
    }
    if objects[object].glass == 0u && !is_within_parting_glass((*walk).gaze.media) {
        return;
    }
    for (var wavelength = wavelengths.count; wavelength > 0u; wavelength -= 1u) {
        (*walk).gaze.wavelength = wavelength;
        if wavelength > 1u {
            waiting[(*walk).count] = (*walk).gaze;
            (*walk).count += 1u;
        }
    }
}

// One wavelength of many is no colour of a display: channels may be negative until all are together.
fn written(radiance: vec3f) -> vec3f {
    return clamp(radiance * frame.radiance_scale, vec3f(-LARGEST), vec3f(LARGEST));
}
