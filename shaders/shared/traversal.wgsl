// The nearest triangle on a ray, in local coordinates: the scene's radius is at most one. Twin, in single precision, of
// transport/hierarchy.rs, geometry/bvh.rs and geometry/triangle.rs.

struct Node {
    low: vec3f,
    first: u32,
    high: vec3f,
    count: u32,
}

struct Triangle {
    a: vec3f,
    object: u32,
    b: vec3f,
    first_index: u32,
    c: vec3f,
    order: u32,
}

@group(1) @binding(1) var<storage, read> nodes: array<Node>;
@group(1) @binding(2) var<storage, read> triangles: array<Triangle>;

// `count` of a node that is an instance.
const INSTANCE: u32 = 0xffffffffu;
// Stands for no object: on triangles that were moved away, and on those of instanced meshes.
const NO_OBJECT: u32 = 0xffffffffu;
// Stands for no instance: nodes and triangles are in local coordinates.
const LOCAL: u32 = 0xffffffffu;

// A mesh and its placement in the scene.
struct Instance {
    // From local coordinates to those of its nodes, and from mesh to local coordinates.
    to_nodes: mat4x3f,
    from_mesh: mat4x3f,
    root: u32,
    // NO_OBJECT if its triangles are local and have their own numbers.
    object: u32,
    // Offsets added to the numbers of its triangles.
    first_index: u32,
    first_order: u32,
    // Margin of boxes in node coordinates: bounds the rounding error of the ray's transform.
    margin: f32,
    is_mirrored: bool,
}

// Reads an instance from the four nodes that it occupies.
fn instance_at(index: u32) -> Instance {
    let a = nodes[index];
    let b = nodes[index + 1u];
    let c = nodes[index + 2u];
    let d = nodes[index + 3u];
    return Instance(
        mat4x3f(a.low, a.high, b.low, b.high),
        mat4x3f(c.low, c.high, d.low, d.high),
        a.first,
        a.count,
        b.first,
        b.count,
        bitcast<f32>(c.first),
        c.count != 0u,
    );
}

// Stands for no triangle: the ray missed.
const NO_TRIANGLE: u32 = 0xffffffffu;
// Beyond every distance [local].
const FAR_AWAY: f32 = 3e38;
// Margin of boxes [local], which covers the rounding of distances to them.
const BOX_MARGIN: f32 = 1.9073486e-6;
// Capacity of the traversal stack; hierarchies are less deep.
const STACK: u32 = 64u;

struct Hit {
    triangle: u32,
    distance: f32,
    barycentric: vec3f,
    instance: u32,
}

// A ray, prepared for intersection with triangles.
struct Sheared {
    origin: vec3f,
    shear: vec3f,
    // Largest axis of the direction, and whether the direction is negative along it.
    axis: u32,
    is_down: bool,
}

// Permutes axes so that the ray's largest one becomes z, preserving handedness.
fn turned(v: vec3f, ray: Sheared) -> vec3f {
    let along = select(select(v.xyz, v.zxy, ray.axis == 1u), v.yzx, ray.axis == 0u);
    return select(along, along.yxz, ray.is_down);
}

fn sheared(origin: vec3f, direction: vec3f) -> Sheared {
    let size = abs(direction);
    var axis = 2u;
    if size.x > size.y && size.x > size.z {
        axis = 0u;
    } else if size.x <= size.y && size.y > size.z {
        axis = 1u;
    }
    let is_down = direction[axis] < 0.0;
    var ray = Sheared(origin, vec3f(0.0), axis, is_down);
    let d = turned(direction, ray);
    ray.shear = vec3f(d.x / d.z, d.y / d.z, 1.0 / d.z);
    return ray;
}

// p.x q.y - p.y q.x, evaluated identically for both triangles at an edge, whatever the compiler does.
fn edge_function(p: vec2f, q: vec2f) -> f32 {
    let is_ordered = p.x < q.x || (p.x == q.x && p.y < q.y);
    let low = select(q, p, is_ordered);
    let high = select(p, q, is_ordered);
    let value = low.x * high.y - low.y * high.x;
    return select(-value, value, is_ordered);
}

// Bound of the relative error of n rounded operations.
fn gamma(n: f32) -> f32 {
    return n * 5.9604645e-8 / (1.0 - n * 5.9604645e-8);
}

// A ray, prepared for intersection with boxes.
struct Slabs {
    // Origins for the lower and upper planes; their difference widens the boxes.
    low_origin: vec3f,
    high_origin: vec3f,
    inverse: vec3f,
}

fn slabs(origin: vec3f, direction: vec3f, margin: f32) -> Slabs {
    // Avoids division by zero; the sign does not matter, as both planes of the slab are then far away.
    let safe = select(direction, vec3f(1e-20), abs(direction) < vec3f(1e-20));
    return Slabs(origin + margin, origin - margin, 1.0 / safe);
}

// The ray's slabs in an instance's node coordinates, where distances along the ray stay the same.
fn slabs_in(at: Instance, origin: vec3f, direction: vec3f) -> Slabs {
    let far = max(abs(origin.x), max(abs(origin.y), abs(origin.z)));
    let begin = at.to_nodes * vec4f(origin, 1.0);
    return slabs(begin, at.to_nodes * vec4f(direction, 0.0), at.margin * max(far, 1.0));
}

// A triangle, placed by an instance.
fn in_instance(triangle: Triangle, instance: u32) -> Triangle {
    if instance == LOCAL {
        return triangle;
    }
    let at = instance_at(instance);
    if at.object == NO_OBJECT {
        return triangle;
    }
    let b = at.from_mesh * vec4f(triangle.b, 1.0);
    let c = at.from_mesh * vec4f(triangle.c, 1.0);
    return Triangle(
        at.from_mesh * vec4f(triangle.a, 1.0),
        at.object,
        select(b, c, at.is_mirrored),
        at.first_index + triangle.first_index,
        select(c, b, at.is_mirrored),
        at.first_order + triangle.order,
    );
}

// The triangle that was hit.
fn met(hit: Hit) -> Triangle {
    return in_instance(triangles[hit.triangle], hit.instance);
}

// Watertight intersection after Woop, Benthin and Wald 2013. The distance is negative for a miss.
fn meet_triangle(ray: Sheared, index: u32, triangle: Triangle, instance: u32) -> Hit {
    // In sheared coordinates the ray runs along z from the origin, so that the test is one of signs in the plane.
    let a = turned(triangle.a - ray.origin, ray);
    let b = turned(triangle.b - ray.origin, ray);
    let c = turned(triangle.c - ray.origin, ray);
    let pa = a.xy - ray.shear.xy * a.z;
    let pb = b.xy - ray.shear.xy * b.z;
    let pc = c.xy - ray.shear.xy * c.z;

    // Triangles at a common edge evaluate the same function there, so that no ray passes between them.
    let u = edge_function(pc, pb);
    let v = edge_function(pa, pc);
    let w = edge_function(pb, pa);
    let missed = Hit(NO_TRIANGLE, -1.0, vec3f(0.0), 0u);
    if min(u, min(v, w)) < 0.0 && max(u, max(v, w)) > 0.0 {
        return missed;
    }
    let determinant = u + v + w;
    if determinant == 0.0 {
        return missed;
    }
    let distance = ray.shear.z * (u * a.z + v * b.z + w * c.z) / determinant;

    // Rounding error of the distance: Pharr, Jakob and Humphreys, Physically Based Rendering, 6.8.7.
    let x = max(abs(pa.x), max(abs(pb.x), abs(pc.x)));
    let y = max(abs(pa.y), max(abs(pb.y), abs(pc.y)));
    let z = max(abs(a.z), max(abs(b.z), abs(c.z))) * abs(ray.shear.z);
    let edge = max(abs(u), max(abs(v), abs(w)));
    let error_x = gamma(5.0) * (x + z);
    let error_y = gamma(5.0) * (y + z);
    let error_edge = 2.0 * (gamma(2.0) * x * y + error_y * x + error_x * y);
    let bound = 3.0 * (gamma(3.0) * edge * z + error_edge * z + gamma(3.0) * z * edge) / abs(determinant);

    // If all corners lie ahead, so does the hit, which is a mean of them, however narrow the triangle looks.
    let ahead = min(a.z * ray.shear.z, min(b.z * ray.shear.z, c.z * ray.shear.z));
    if (distance > bound || ahead > gamma(8.0) * z) && distance < FAR_AWAY {
        return Hit(index, distance, vec3f(u, v, w) / determinant, instance);
    }
    return missed;
}

// Distance at which a ray enters a box before `limit`; FAR_AWAY for a miss.
fn enter(ray: Slabs, index: u32, limit: f32) -> f32 {
    let node = nodes[index];
    let low = (node.low - ray.low_origin) * ray.inverse;
    let high = (node.high - ray.high_origin) * ray.inverse;
    let near = min(low, high);
    let far = max(low, high);
    let begin = max(max(near.x, near.y), max(near.z, 0.0));
    let end = min(min(far.x, far.y), min(far.z, limit + BOX_MARGIN));
    return select(FAR_AWAY, begin, begin <= end);
}

// Whether the first of two triangles faces a ray where they lie back to back; `otherwise` where they do not.
fn faces_first(first: Triangle, second: Triangle, direction: vec3f, otherwise: bool) -> bool {
    let normal = cross(first.b - first.a, first.c - first.a);
    let other = cross(second.b - second.a, second.c - second.a);
    let is_back_to_back = dot(normal, other) < -0.9999 * length(normal) * length(other);
    return select(otherwise, dot(normal, direction) < 0.0, is_back_to_back);
}

// State of a search for the nearest triangle.
struct Search {
    best: Hit,
    best_order: u32,
    best_object: u32,
    // The node to visit next, if there is one.
    index: u32,
    is_over: bool,
    count: u32,
    // The instance being searched.
    instance: u32,
    // Height of the stack when the instance was entered: entries above belong to it.
    outside: u32,
}

// The nearest triangle before `limit`, from either side. Descends to a leaf first and then intersects its triangles, so
// that neighbouring rays do the same at the same time.
fn closest_hit(origin: vec3f, direction: vec3f, limit: f32) -> Hit {
    // Triangles are met in local coordinates, boxes in the node coordinates of the instance that is searched.
    let ray = sheared(origin, direction);
    let outside = slabs(origin, direction, 0.0);
    var boxes = outside;
    var waiting: array<vec2f, STACK>;
    var search = Search(Hit(NO_TRIANGLE, limit, vec3f(0.0), LOCAL), 0u, NO_OBJECT, 0u, false, 0u, LOCAL, 0u);
    loop {
        var first = 0u;
        var end = 0u;
        loop {
            // An instance has nodes of its own; entries of the stack above `search.outside` belong to it.
            let node = nodes[search.index];
            if node.count == INSTANCE {
                search.instance = node.first;
                search.outside = search.count;
                let at = instance_at(node.first);
                search.index = at.root;
                boxes = slabs_in(at, origin, direction);
                continue;
            }
            if node.count > 0u {
                first = node.first;
                end = node.first + node.count;
                break;
            }

            // The nearer child is visited first; the farther one waits with its distance, by which a hit may cull it.
            let left = enter(boxes, node.first, search.best.distance);
            let right = enter(boxes, node.first + 1u, search.best.distance);
            let is_left = left <= right;
            if max(left, right) < FAR_AWAY && search.count < STACK {
                let later = select(node.first, node.first + 1u, is_left);
                waiting[search.count] = vec2f(bitcast<f32>(later), max(left, right));
                search.count += 1u;
            }
            if min(left, right) < FAR_AWAY {
                search.index = select(node.first + 1u, node.first, is_left);
            } else if search.count > 0u {
                // It may be farther than the best hit by now; its children are then culled.
                if search.count == search.outside {
                    search.instance = LOCAL;
                    boxes = outside;
                }
                search.count -= 1u;
                search.index = bitcast<u32>(waiting[search.count].x);
            } else {
                search.is_over = true;
                break;
            }
        }
        for (var slot = first; slot < end; slot += 1u) {
            let triangle = in_instance(triangles[slot], search.instance);
            let found = meet_triangle(ray, slot, triangle, search.instance);
            // Of triangles at the same distance, the one of lowest order wins.
            var is_nearer = found.distance < search.best.distance
                || (found.distance == search.best.distance && triangle.order < search.best_order);

            // Where triangles of an object touch back to back, rounding orders them: the one that faces the ray is met.
            let is_near = abs(found.distance - search.best.distance) <= BOX_MARGIN;
            if found.triangle != NO_TRIANGLE && triangle.object == search.best_object && is_near {
                is_nearer = faces_first(triangle, met(search.best), direction, is_nearer);
            }
            if found.triangle != NO_TRIANGLE && is_nearer && triangle.object != NO_OBJECT {
                search.best = found;
                search.best_order = triangle.order;
                search.best_object = triangle.object;
            }
        }
        if search.is_over {
            break;
        }

        // Goes on with the last subtree that begins before the best hit. Leaving an instance restores the local slabs.
        var has_next = false;
        while search.count > 0u && !has_next {
            if search.count == search.outside {
                search.instance = LOCAL;
                boxes = outside;
            }
            search.count -= 1u;
            search.index = bitcast<u32>(waiting[search.count].x);
            has_next = waiting[search.count].y <= search.best.distance + BOX_MARGIN;
        }
        if !has_next {
            break;
        }
    }
    return search.best;
}
