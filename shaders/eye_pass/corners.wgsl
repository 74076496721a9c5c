// Attributes of a surface point, interpolated from the corners of its triangle.

// Six word pairs per corner: position, normal and two texture coordinate sets in floats, and a colour of 16 bits per
// channel.
@group(1) @binding(3) var<storage, read> corners: array<vec2u>;
@group(1) @binding(4) var<storage, read> corner_map_uvs: array<vec2f>;
// Three per triangle.
@group(1) @binding(5) var<storage, read> corner_indices: array<u32>;

// All lengths are local.
struct SurfacePoint {
    place: vec3f,
    // Bound of the rounding error.
    error: vec3f,
    object: u32,
    // Unit, by the triangle's winding.
    geometric_normal: vec3f,
    // Unit, interpolated: the normal by which a diffuse surface receives light.
    interpolated_normal: vec3f,
    // The same, perturbed by bumps.
    shading_normal: vec3f,
    // Divergence of the normals per length, > 0 where the surface is convex.
    curvature: f32,
    uvs: vec4f,
    map_uv: vec2f,
    // Vertex colour, a factor of the base colour.
    colour: vec3f,
    // Square root of coordinate area per surface area: change of coordinates per unit length.
    uv_densities: vec2f,
    map_density: f32,
}

// A local position in scene coordinates [m].
fn in_scene_m(place: vec3f) -> vec3f {
    return frame.camera_position + (place - start.eye) * start.unit_m;
}

fn corner_normal(corner: u32, object: ObjectRecord) -> vec3f {
    let normal = bitcast<vec3f>(vec3u(corners[6u * corner + 1u].y, corners[6u * corner + 2u]));
    return normal_in_scene(normal, object.row_x.xyz, object.row_y.xyz, object.row_z.xyz);
}

fn corner_uvs(corner: u32) -> vec4f {
    return bitcast<vec4f>(vec4u(corners[6u * corner + 3u], corners[6u * corner + 4u]));
}

fn corner_colour(corner: u32) -> vec3f {
    let channels = corners[6u * corner + 5u];
    return vec3f(unpack2x16unorm(channels.x), unpack2x16unorm(channels.y).x);
}

fn area_ratio(a: vec2f, b: vec2f, c: vec2f, twice_area: f32) -> f32 {
    let ab = b - a;
    let ac = c - a;
    return sqrt(abs(ab.x * ac.y - ab.y * ac.x) / max(twice_area, 1e-30));
}

// Change of the normal along an edge, per length.
fn bend(from_place: vec3f, to_place: vec3f, from_normal: vec3f, to_normal: vec3f) -> f32 {
    let edge = to_place - from_place;
    return dot(to_normal - from_normal, edge) / max(dot(edge, edge), 1e-30);
}

fn surface_point(hit: Hit) -> SurfacePoint {
    // Positions come from the hierarchy's triangles, attributes from the vertex buffers of the surface pass.
    let triangle = met(hit);
    let weight = hit.barycentric;
    let first = corner_indices[triangle.first_index];
    let second = corner_indices[triangle.first_index + 1u];
    let third = corner_indices[triangle.first_index + 2u];
    let terms_a = triangle.a * weight.x;
    let terms_b = triangle.b * weight.y;
    let terms_c = triangle.c * weight.z;
    let across = cross(triangle.b - triangle.a, triangle.c - triangle.a);
    let twice_area = length(across);
    let object = objects[triangle.object];
    let normal_a = corner_normal(first, object);
    let normal_b = corner_normal(second, object);
    let normal_c = corner_normal(third, object);
    let mixed = normal_a * weight.x + normal_b * weight.y + normal_c * weight.z;

    // The position is a sum of three rounded products, with the bound of its error from Pharr, Jakob and Humphreys,
    // Physically Based Rendering, 6.8.
    var point: SurfacePoint;
    point.place = terms_a + terms_b + terms_c;
    point.error = (abs(terms_a) + abs(terms_b) + abs(terms_c)) * gamma(7.0);
    point.object = triangle.object;
    point.geometric_normal = across / twice_area;
    point.shading_normal = select(point.geometric_normal, normalize(mixed), dot(mixed, mixed) > 0.0);
    point.interpolated_normal = point.shading_normal;

    // The curvature is the mean of the bends along the three edges. It spreads the footprints of rays.
    point.curvature = (bend(triangle.a, triangle.b, normal_a, normal_b)
        + bend(triangle.b, triangle.c, normal_b, normal_c)
        + bend(triangle.c, triangle.a, normal_c, normal_a)) / 3.0;

    // Texture coordinates and colours are linear over the triangle.
    let uv_a = corner_uvs(first);
    let uv_b = corner_uvs(second);
    let uv_c = corner_uvs(third);
    point.colour = corner_colour(first) * weight.x
        + corner_colour(second) * weight.y
        + corner_colour(third) * weight.z;
    point.uvs = uv_a * weight.x + uv_b * weight.y + uv_c * weight.z;

    // Waves bend the normal and change the curvature, too; normal maps only bend the normal.
    if HAS_BUMPS {
        let record = object.bumps;
        if record != NO_IMAGE {
            let steps = array(triangle.b - triangle.a, triangle.c - triangle.a);
            let piece = Piece(steps, array(uv_b - uv_a, uv_c - uv_a), point.uvs, FINEST);
            let bump = bump_at(record, in_scene_m(point.place), piece, point.shading_normal);
            point.shading_normal = bent(point.shading_normal, bump.gradient);
            point.curvature -= 0.5 * bump.laplacian * start.unit_m;
        }
    }

    // Rays have no screen derivatives: densities of texture coordinates relate their footprint to texels.
    point.uv_densities = vec2f(
        area_ratio(uv_a.xy, uv_b.xy, uv_c.xy, twice_area),
        area_ratio(uv_a.zw, uv_b.zw, uv_c.zw, twice_area),
    );
    let map_a = corner_map_uvs[first];
    let map_b = corner_map_uvs[second];
    let map_c = corner_map_uvs[third];
    point.map_uv = map_a * weight.x + map_b * weight.y + map_c * weight.z;
    point.map_density = area_ratio(map_a, map_b, map_c, twice_area);
    return point;
}

// Origin of a ray that leaves a point: offset beyond the rounding error, to the side of its direction.
fn leave(point: SurfacePoint, direction: vec3f) -> vec3f {
    let step = dot(abs(point.geometric_normal), point.error);
    // Twice the step also covers the rounding of the sum itself.
    let side = select(2.0 * step, -2.0 * step, dot(direction, point.geometric_normal) < 0.0);
    return point.place + point.geometric_normal * side;
}
