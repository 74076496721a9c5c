// Opaque surfaces without their reflections, lit by their maps and by traced direct light.

@fragment
fn own_under_lights(fragment: Fragment, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    let object = objects[fragment.object];
    pixel_seed = seed_of(fragment.clip.xy);
    // Normal of the triangle's plane, which contains both derivatives.
    let across = cross(dpdx(fragment.from_camera), dpdy(fragment.from_camera));
    let towards_eye = select(1.0, -1.0, dot(across, fragment.from_camera) > 0.0);
    let normals = own_normals(fragment);
    let shading_normal = select(-1.0, 1.0, is_front) * normals[1];
    let offset = fragment.from_camera / start.unit_m;
    let place = start.eye + offset;
    // Rasterisers interpolate positions to a relative precision of about 2⁻²⁰.
    let margin = 4e-6 * (1.0 + length(offset));
    var mixture: Mixture;
    if SURFACE == SURFACE_VARIED {
        let factors = looked_up(object.variation, fragment.uvs, 0.0).rgb;
        mixture = mixture_of(object, factors, looked_up(object.texture, fragment.uvs, 0.0).a);
    }
    let response = diffuse_response_of(object, mixture);
    let point = LitPoint(place, margin, towards_eye * normalize(across), shading_normal, response);
    let baked = own_irradiance(fragment, is_front);
    let irradiance = own_relief(baked.rgb, fragment, is_front, normals) + direct_irradiance(point, object);
    let diffuse = own_base_colour(fragment) * irradiance / PI;
    let radiance = own_emission(fragment) + (1.0 - own_coat(fragment, normals[1])) * diffuse;
    cut_out(fragment);
    return vec4f(select(scaled(radiance), fault_colour(), baked.a > 0.0), 1.0);
}
