// Chains that split into wavelengths at dispersive surfaces; twin of eye_pass/wavelengths.rs.

// Wavelengths per frame.
const MAX_WAVELENGTHS: u32 = 4u;
// Paths that may wait: one for each surface at which both branches are followed, and those of the other wavelengths.
const MAX_WAITING: u32 = MAX_BRANCHING + MAX_WAVELENGTHS - 1u;

struct SeenWavelengths {
    // Matrices from radiance in linear sRGB to its part at each wavelength.
    shares: array<mat3x3f, 4>,
    count: u32,
    padding0: u32,
    padding1: u32,
    padding2: u32,
    // Refractive index of each glass at each wavelength.
    indices: array<vec4f, 128>,
}

@group(1) @binding(7) var<uniform> wavelengths: SeenWavelengths;

// Wavelengths are numbered from 1; 0 stands for all of them, with the index at 587.56 nm.
fn ior_of(object: u32, wavelength: u32) -> f32 {
    let glass = objects[object].glass;
    if wavelength == 0u || glass == 0u {
        return objects[object].ior;
    }
    return wavelengths.indices[glass - 1u][wavelength - 1u];
}

// The part of a radiance at a wavelength.
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

// Splits a path into wavelengths where its continuation depends on them. It continues at the first one; those at the
// others wait, and will hit the same surface again.
fn part(walk: ptr<function, Walk>, object: u32) {
    let surface = objects[object].surface;
    let goes_by_index = is_clear(surface) || surface == SURFACE_COATED || surface == SURFACE_VARIED;
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

// A single wavelength is outside the display's gamut: channels may be negative until all wavelengths are added.
fn written(radiance: vec3f) -> vec3f {
    return clamp(radiance * frame.radiance_scale, vec3f(-LARGEST), vec3f(LARGEST));
}
