//! Normal textures on meshes: the gradient of their height field, in the texture coordinates of each triangle. On
//! planes the frame is MikkTSpace's, as glTF requires; elsewhere it agrees to first order in the triangle's size.

use glam::{DVec2, DVec3};

use super::curvature::dual_edges;
use crate::scene::{InScene, NormalMap, Scene, TextureRef, normal_map::Slope};

/// Texture mapping at a point of a triangle.
struct TexturedTriangle {
    /// Gradients of u and v along the triangle [1/m].
    gradients: [DVec3; 2],
    /// Tangents along increasing u and decreasing v [1].
    axes: [DVec3; 2],
    uv: DVec2,
}

/// Height gradient of a normal texture with its derivatives.
pub struct TextureBump {
    place: TexturedTriangle,
    slope: Slope,
}

impl TextureBump {
    /// At a point of a triangle with a unit normal; `None` where texture coordinates are missing or degenerate.
    pub fn at(
        (scene, mesh): (&Scene, InScene),
        map: &NormalMap,
        (triangle, barycentric): (usize, [f64; 3]),
        normal: DVec3,
    ) -> Option<Self> {
        let place = TexturedTriangle::of(mesh, &map.image, triangle, barycentric, normal)?;
        let slope = map.slope(&scene.textures[map.image.texture], place.uv);
        Some(Self { place, slope })
    }

    /// ∇h [1].
    pub fn gradient(&self) -> DVec3 {
        self.along_axes(self.slope.value)
    }

    /// Change of ∇h [1] for a step [m] along the triangle.
    pub fn gradient_change(&self, step: DVec3) -> DVec3 {
        let [u, v] = self.place.gradients.map(|gradient| gradient.dot(step));
        self.along_axes(self.slope.by_u * u + self.slope.by_v * v)
    }

    fn along_axes(&self, slope: DVec2) -> DVec3 {
        self.place.axes[0] * slope.x + self.place.axes[1] * slope.y
    }
}

impl TexturedTriangle {
    fn of(
        mesh: InScene,
        image: &TextureRef,
        triangle: usize,
        barycentric: [f64; 3],
        normal: DVec3,
    ) -> Option<Self> {
        let uvs = corner_uvs(mesh, image, triangle)?;
        let [a, b, c] = mesh.corners(triangle);
        let (dual_b, dual_c) = dual_edges(b - a, c - a)?;
        let (to_b, to_c) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
        let gradients = [
            dual_b * to_b.x + dual_c * to_c.x,
            dual_b * to_b.y + dual_c * to_c.y,
        ];
        // ∂P/∂u in the triangle's plane, up to a positive factor.
        let turn = to_b.perp_dot(to_c).signum();
        let by_u = ((b - a) * to_c.y - (c - a) * to_b.y) * turn;
        let x = (by_u - normal * normal.dot(by_u)).try_normalize()?;
        let y = normal.cross(x);
        let falls = gradients[1].dot(y) < 0.0;
        Some(Self {
            gradients,
            axes: [x, if falls { y } else { -y }],
            uv: uvs[0] * barycentric[0] + uvs[1] * barycentric[1] + uvs[2] * barycentric[2],
        })
    }
}

/// Texture coordinates of a triangle's corners; `None` without the image's set.
fn corner_uvs(mesh: InScene, image: &TextureRef, triangle: usize) -> Option<[DVec2; 3]> {
    let uvs = mesh.uvs(image.uv_set)?;
    Some(
        mesh.triangle(triangle)
            .map(|vertex| image.transform(uvs[vertex as usize])),
    )
}

/// Mean texel size of an image on a mesh [m]; `None` without texture coordinates or area.
pub fn texel_m(scene: &Scene, mesh: InScene, image: &TextureRef) -> Option<f64> {
    let texture = &scene.textures[image.texture];
    let mut texels = 0.0;
    for triangle in 0..mesh.triangle_count() {
        let [a, b, c] = corner_uvs(mesh, image, triangle)?;
        texels += 0.5 * (b - a).perp_dot(c - a).abs();
    }
    texels *= f64::from(texture.width) * f64::from(texture.height);
    let side_m = (mesh.area_m2() / texels).sqrt();
    (side_m > 0.0 && side_m.is_finite()).then_some(side_m)
}
