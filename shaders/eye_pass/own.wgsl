// Opaque surfaces without their reflections.
@fragment
fn own(fragment: Fragment, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    var radiance = own_emission(fragment);
    var is_fault = false;
    if SURFACE != SURFACE_MIRROR {
        let lit = own_irradiance(fragment, is_front);
        is_fault = lit.a > 0.0;
        let normals = own_normals(fragment);
        let shaded = own_relief(lit.rgb, fragment, is_front, normals);
        let diffuse = own_base_colour(fragment) * shaded / PI;
        radiance += (1.0 - own_coat(fragment, normals[1])) * diffuse;
    } else {
        // Brighter towards the top, so that the shape of curved mirrors is visible.
        let up = reflect(normalize(fragment.from_camera), normalize(fragment.normal)).y;
        radiance += objects[fragment.object].base_colour * (frame.stand_in * (1.0 + 0.5 * up));
    }
    cut_out(fragment);
    return vec4f(select(scaled(radiance), fault_colour(), is_fault), 1.0);
}

// Values of maps, neither lit nor reflected.
@fragment
fn map_value(fragment: Fragment, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    let value = own_irradiance(fragment, is_front);
    cut_out(fragment);
    return vec4f(select(scaled(value.rgb), fault_colour(), value.a > 0.0), 1.0);
}

// Depth prepass of surfaces with an alpha mask.
@fragment
fn masked_depth(fragment: Fragment) {
    cut_out(fragment);
}
