// Emission and diffuse radiance of surfaces.
//
// Radiance is written times frame.radiance_scale, to fit half floats.

// Kind of the surface, one of SURFACE_*.
override SURFACE: u32;
// Whether the object has a base colour texture.
override HAS_TEXTURE: bool;

fn own_base_colour(fragment: Fragment) -> vec3f {
    let object = objects[fragment.object];
    var colour = object.base_colour * fragment.colour;
    if HAS_TEXTURE {
        let level = look_level(object.texture, dpdx(fragment.uvs), dpdy(fragment.uvs));
        colour *= looked_up(object.texture, fragment.uvs, level).rgb;
    }
    return colour;
}

fn own_emission(fragment: Fragment) -> vec3f {
    let object = objects[fragment.object];
    let level = look_level(object.glow, dpdx(fragment.uvs), dpdy(fragment.uvs));
    return object.emitted_radiance * looked_up(object.glow, fragment.uvs, level).rgb;
}

fn own_irradiance(fragment: Fragment, is_front: bool) -> vec4f {
    let record = map_of(objects[fragment.object], is_front);
    let level = level_of(record, dpdx(fragment.map_uv), dpdy(fragment.map_uv));
    return irradiance(record, fragment.map_uv, level);
}

// Normal, and the same perturbed by bumps.
fn own_normals(fragment: Fragment) -> array<vec3f, 2> {
    let normal = normalize(fragment.normal);
    if !HAS_BUMPS {
        return array(normal, normal);
    }
    let record = objects[fragment.object].bumps;
    let across = dpdx(fragment.uvs);
    let down = dpdy(fragment.uvs);
    let steps = array(dpdx(fragment.from_camera), dpdy(fragment.from_camera));
    let level = look_level(image_table[record], across, down);
    let piece = Piece(steps, array(across, down), fragment.uvs, level);
    let place_m = frame.camera_position + fragment.from_camera;
    return array(normal, bent(normal, bump_at(record, place_m, piece, normal).gradient));
}

// Irradiance of a map, shaded by bumps; `normals` as of own_normals.
fn own_relief(baked: vec3f, fragment: Fragment, is_front: bool, normals: array<vec3f, 2>) -> vec3f {
    if !HAS_BUMPS {
        return baked;
    }
    let side = select(-1.0, 1.0, is_front);
    let place_m = frame.camera_position + fragment.from_camera;
    let bumps = objects[fragment.object].bumps;
    return in_relief(baked, bumps, place_m, array(side * normals[0], side * normals[1]));
}

// Share of light that the coat reflects towards the eye, seen from vacuum; 0 without one.
fn own_coat(fragment: Fragment, normal: vec3f) -> f32 {
    if SURFACE == SURFACE_COATED {
        let cos_view = abs(dot(normal, normalize(fragment.from_camera)));
        let object = objects[fragment.object];
        return object.coat * dielectric_reflectance(cos_view, object.ior);
    }
    return 0.0;
}
