//! Normal textures on meshes: the gradient of their height field, in the texture coordinates of each triangle. On
//! planes the frame is MikkTSpace's, as glTF requires; elsewhere it agrees to first order in the triangle's size.

use glam::{DVec2, DVec3};

use crate::scene::{InScene, NormalMap, Scene, TextureRef};

/// Height gradient ∇h [1] at a point of a triangle with a unit normal; `None` where texture coordinates are missing or
/// degenerate.
pub fn gradient(
    (scene, mesh): (&Scene, InScene),
    map: &NormalMap,
    (triangle, barycentric): (usize, [f64; 3]),
    normal: DVec3,
) -> Option<DVec3> {
    let uvs = corner_uvs(mesh, &map.image, triangle)?;
    let [a, b, c] = mesh.corners(triangle);
    let (to_b, to_c) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);

    // Tangents along increasing u and decreasing v: ∂P/∂u in the triangle's plane, up to a positive factor, and across.
    let turn = to_b.perp_dot(to_c).signum();
    let by_u = ((b - a) * to_c.y - (c - a) * to_b.y) * turn;
    let x = (by_u - normal * normal.dot(by_u)).try_normalize()?;
    let y = normal.cross(x);
    let falls = v_gradient([b - a, c - a], [to_b.y, to_c.y])?.dot(y) < 0.0;
    let y = if falls { y } else { -y };

    let uv = uvs[0] * barycentric[0] + uvs[1] * barycentric[1] + uvs[2] * barycentric[2];
    let slope = map.slope(&scene.textures[map.image.texture], uv);
    Some(x * slope.x + y * slope.y)
}

/// Gradient of v within the plane of two edges along which it grows so much, up to a positive factor; `None` if the edges
/// are parallel.
fn v_gradient([to_b, to_c]: [DVec3; 2], [v_b, v_c]: [f64; 2]) -> Option<DVec3> {
    let normal = to_b.cross(to_c);
    let squared = normal.length_squared();
    let gradient = (to_c.cross(normal) * v_b + normal.cross(to_b) * v_c) / squared;
    (squared > 0.0 && squared.is_finite()).then_some(gradient)
}

/// Texture coordinates of a triangle's corners; `None` without the image's set.
fn corner_uvs(mesh: InScene, image: &TextureRef, triangle: usize) -> Option<[DVec2; 3]> {
    let uvs = mesh.uvs(image.uv_set)?;
    Some(
        mesh.triangle(triangle)
            .map(|vertex| image.transform(uvs[vertex as usize])),
    )
}
