// False colours; twin of illumination/false_colours.rs.

// sRGB-encoded colour of a position in [0, 1] on the scale.
fn viridis(place: f32) -> vec3f {
    let t = clamp(place, 0.0, 1.0);
    var colour = vec3f(-5.435455855934631, 4.645852612178535, 26.3124352495832);
    colour = colour * t + vec3f(4.776384997670288, -13.74514537774601, -65.35303263337234);
    colour = colour * t + vec3f(6.228269936347081, 14.17993336680509, 56.69055260068105);
    colour = colour * t + vec3f(-4.634230498983486, -5.799100973351585, -19.33244095627987);
    colour = colour * t + vec3f(-0.3308618287255563, 0.214847559468213, 0.09509516302823659);
    colour = colour * t + vec3f(0.1050930431085774, 1.404613529898575, 1.384590162594685);
    colour = colour * t + vec3f(0.2777273272234177, 0.005407344544966578, 0.3340998053353061);
    return clamp(colour, vec3f(0.0), vec3f(1.0));
}

// Decodes an sRGB colour to linear light (IEC 61966-2-1).
fn linear_from_srgb(display: vec3f) -> vec3f {
    let power = pow((display + 0.055) / 1.055, vec3f(2.4));
    return select(power, display / 12.92, display <= vec3f(0.04045));
}
