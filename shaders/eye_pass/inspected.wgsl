// Surfaces that show a property instead of their radiance: display colours in linear light.

// What is shown, one of INSPECTED_*.
override INSPECTED: u32;
// Whether the scale of false colours is logarithmic.
override IS_LOGARITHMIC: bool;

const INSPECTED_IRRADIANCE: u32 = 0u;
const INSPECTED_TEXELS: u32 = 1u;
const INSPECTED_DENSITY: u32 = 2u;
const INSPECTED_NORMALS: u32 = 3u;
const INSPECTED_UV: u32 = 4u;
const INSPECTED_MAP_UV: u32 = 5u;

// Colour of surfaces without a map.
const NO_MAP: vec3f = vec3f(0.01);

// False colour of a quantity; frame.colour_scale holds the start of the scale and the factor of distances from it.
fn false_colour(quantity: f32) -> vec3f {
    var value = quantity;
    if IS_LOGARITHMIC {
        value = log2(max(quantity, 1e-30));
    }
    return linear_from_srgb(viridis((value - frame.colour_scale.x) * frame.colour_scale.y));
}

// Texels that the unit square spans at a position, at the resolution of its tile.
fn texels_at(record: u32, uv: vec2f) -> vec2f {
    var level = image_table[record];
    while level + 1u < image_table[record + 1u] && locate(record, level, uv).is_coarser {
        level++;
    }
    return level_extent(record, level);
}

@fragment
fn inspected(fragment: Fragment, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    // Derivatives of map coordinates and position over a pixel, taken before any discard.
    let across = dpdx(fragment.map_uv);
    let down = dpdy(fragment.map_uv);
    let pixel_m2 = length(cross(dpdx(fragment.from_camera), dpdy(fragment.from_camera)));
    let record = map_of(objects[fragment.object], is_front);
    let level = level_of(record, across, down);
    cut_out(fragment);

    // Normals and texture coordinates exist without a map.
    if INSPECTED == INSPECTED_NORMALS {
        return vec4f(linear_from_srgb(0.5 * normalize(fragment.normal) + 0.5), 1.0);
    }
    if INSPECTED == INSPECTED_UV {
        let look = objects[fragment.object].texture;
        var uv = fragment.uvs.xy;
        if look != NO_IMAGE {
            uv = placed(look, fragment.uvs, false);
        }
        return vec4f(linear_from_srgb(vec3f(fract(uv), 0.0)), 1.0);
    }

    // Everything else is a property of the map, whose values that are not finite show in every view.
    if record == NO_IMAGE {
        return vec4f(NO_MAP, 1.0);
    }
    let lit = irradiance(record, fragment.map_uv, level);
    if lit.a > 0.0 {
        return vec4f(fault_colour(), 1.0);
    }
    if INSPECTED == INSPECTED_IRRADIANCE {
        return vec4f(false_colour(dot(lit.rgb, LUMINANCE)), 1.0);
    }
    if INSPECTED == INSPECTED_MAP_UV {
        return vec4f(linear_from_srgb(vec3f(fragment.map_uv, 0.0)), 1.0);
    }

    // Steps of one pixel, in texels of the tile at this place: tiles of a map differ in resolution.
    let texels = texels_at(record, fragment.map_uv);
    let step_across = across * texels;
    let step_down = down * texels;
    if INSPECTED == INSPECTED_DENSITY {
        let pixel_texels = abs(step_across.x * step_down.y - step_across.y * step_down.x);
        return vec4f(false_colour(sqrt(pixel_texels / max(pixel_m2, 1e-30))), 1.0);
    }

    // A checkerboard that fades to grey where its squares are smaller than pixels.
    let cell = floor(fragment.map_uv * texels);
    let is_odd = fract(0.5 * (cell.x + cell.y)) > 0.25;
    let widest = max(max(abs(step_across.x), abs(step_across.y)), max(abs(step_down.x), abs(step_down.y)));
    let contrast = 1.0 - smoothstep(0.4, 0.8, widest);
    return vec4f(vec3f(0.3 + select(-0.22, 0.22, is_odd) * contrast), 1.0);
}
