// Transfer function of sRGB (IEC 61966-2-1), from linear light in [0, 1] to code values in [0, 1].
fn srgb_from_linear(linear: vec3f) -> vec3f {
    let toe = linear * 12.92;
    let power = 1.055 * pow(max(linear, vec3f(0.0)), vec3f(1.0 / 2.4)) - 0.055;
    return select(power, toe, linear <= vec3f(0.0031308));
}
