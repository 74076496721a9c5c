//! A triangle in the scene and in the map.

use glam::{DVec2, DVec3};

use crate::geometry::{Ray, ray};
use crate::illumination::Chart;
use crate::illumination::parametrisation::coverage::twice_signed_area;
use crate::scene::Mesh;

/// One triangle on the surface and in the map.
pub struct Facet {
    /// Index within the mesh.
    pub triangle: u32,
    corners: [DVec3; 3],
    corner_normals: [DVec3; 3],
    geometric_normal: DVec3,
    /// Of the side that is lit.
    sign: f64,
    /// Corners in texels.
    pub corners_texels: [DVec2; 3],
    /// Surface area per map area.
    pub m2_per_texel2: f64,
}

/// A point of a surface.
pub struct SurfacePoint {
    /// Index within the mesh.
    pub triangle: usize,
    /// Of the triangle's corners.
    pub barycentric: [f64; 3],
    /// Where [m].
    pub position: DVec3,
    /// Bound of its rounding error per axis [m].
    error: DVec3,
    /// Unit, across the triangle, on the side that is lit.
    pub geometric_normal: DVec3,
    /// Unit, interpolated from the vertices, for that side.
    pub shading_normal: DVec3,
}

impl SurfacePoint {
    /// A ray that leaves in a unit direction, without meeting the surface again there.
    pub fn spawn(&self, direction: DVec3) -> Ray {
        Ray {
            origin: ray::offset_origin(self.position, self.error, self.geometric_normal, direction),
            direction,
        }
    }
}

impl Facet {
    /// A triangle of a chart's mesh; `None` where it has no area on the surface or in the map.
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

    /// The point of the surface at a place of the map.
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
            // Barycentric coordinates from the map add up to 1 only within their own rounding.
            error: error * 2.0,
            geometric_normal: self.geometric_normal * self.sign,
            shading_normal: normal.try_normalize().unwrap_or(self.geometric_normal) * self.sign,
        }
    }
}
