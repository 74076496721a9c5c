// Opaque surfaces without what they reflect.
@fragment
fn own(fragment: Fragment, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    var radiance = objects[fragment.object].emitted_radiance;
    if SURFACE != SURFACE_MIRROR {
        let diffuse = own_base_colour(fragment) * own_irradiance(fragment, is_front) / PI;
        radiance += (1.0 - own_polish(fragment)) * diffuse;
    }
    return vec4f(scaled(radiance), 1.0);
}

// Maps as they are, neither lit nor reflected.
@fragment
fn map_value(fragment: Fragment, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    return vec4f(scaled(own_irradiance(fragment, is_front)), 1.0);
}
