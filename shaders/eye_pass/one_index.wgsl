// Chains of scenes without dispersion; stands in for eye_pass/wavelengths.wgsl.

// Paths that may wait: one for each surface at which both branches are followed.
const MAX_WAITING: u32 = MAX_BRANCHING;

fn ior_of(object: u32, wavelength: u32) -> f32 {
    return objects[object].ior;
}

fn shown(radiance: vec3f, wavelength: u32) -> vec3f {
    return radiance;
}

fn part(walk: ptr<function, Walk>, object: u32) {}

fn written(radiance: vec3f) -> vec3f {
    return scaled(radiance);
}
