//! A triangle in the scene and in the map.

use glam::{DVec2, DVec3};

use crate::geometry::{Ray, ray};
use crate::illumination::Chart;
use crate::illumination::parametrisation::coverage::twice_signed_area;
use crate::scene::Mesh;

/// A triangle of a mesh and its image in the map.
pub struct Facet {
    /// Index within the mesh.
    pub triangle: u32,
    corners: [DVec3; 3],
    corner_normals: [DVec3; 3],
    geometric_normal: DVec3,
    /// 1 if the front of the triangle is lit, −1 if its back is.
    sign: f64,
    pub corners_texels: [DVec2; 3],
    pub m2_per_texel2: f64,
}

pub struct SurfacePoint {
    /// Index within the mesh.
    pub triangle: usize,
    pub barycentric: [f64; 3],
    /// In the scene [m].
    pub position: DVec3,
    /// Bound on the rounding error of the position, per axis [m].
    error: DVec3,
    /// Unit normal of the triangle, on the lit side.
    pub geometric_normal: DVec3,
    /// Unit normal interpolated from the vertices, on the lit side.
    pub shading_normal: DVec3,
}

impl SurfacePoint {
    /// A ray in a unit direction, offset so that it does not hit this surface again at its origin.
    pub fn spawn(&self, direction: DVec3) -> Ray {
        Ray {
            origin: ray::offset_origin(self.position, self.error, self.geometric_normal, direction),
            direction,
        }
    }
}

impl Facet {
    /// A triangle of a chart's mesh; `None` if it is degenerate on the surface or in the map.
    pub fn new(mesh: &Mesh, chart: &Chart, triangle: u32) -> Option<Self> {
        let index = triangle as usize;
        let size = DVec2::new(chart.width as f64, chart.height as f64);
        let corners_texels = chart.corner_uvs[index].map(|uv| uv * size);
        let corners = mesh.corners(index);
        let twice_m2 = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
        let twice_texel2 = twice_signed_area(corners_texels);
        (twice_m2 > 0.0 && twice_texel2 != 0.0).then(|| Self {
            triangle,
            corners,
            corner_normals: mesh.corner_normals(index),
            geometric_normal: mesh.face_normal(index),
            sign: chart.receiver.side().sign(),
            corners_texels,
            m2_per_texel2: twice_m2 / twice_texel2.abs(),
        })
    }

    /// The surface point at a map position [texels].
    pub fn at(&self, place: DVec2) -> SurfacePoint {
        let [a, b, c] = self.corners_texels;
        let twice = twice_signed_area(self.corners_texels);
        let second = (place - a).perp_dot(c - a) / twice;
        let third = (b - a).perp_dot(place - a) / twice;
        let barycentric = [1.0 - second - third, second, third];
        let (position, error) = ray::point_with_error(&self.corners, barycentric);
        let [na, nb, nc] = self.corner_normals;
        let normal = na * barycentric[0] + nb * barycentric[1] + nc * barycentric[2];
        SurfacePoint {
            triangle: self.triangle as usize,
            barycentric,
            position,
            // Barycentric coordinates computed from the map sum to 1 only up to their own rounding error.
            error: error * 2.0,
            geometric_normal: self.geometric_normal * self.sign,
            shading_normal: normal.try_normalize().unwrap_or(self.geometric_normal) * self.sign,
        }
    }
}
