//! How a surface lies in its map: the contract between the light pass (which deposits), the eye pass (which looks up)
//! and the exporters.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// Which texture coordinates a map follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum UvSet {
    /// The file's first set.
    #[serde(rename = "TEXCOORD_0")]
    TexCoord0,
    /// The file's second set.
    #[serde(rename = "TEXCOORD_1")]
    TexCoord1,
    /// Made here; written beside the map.
    #[serde(rename = "generated")]
    Generated,
}

/// Parametrisation of one object at one map size.
///
/// Texel (i, j) covers u in [i/W, (i+1)/W] and v in [j/H, (j+1)/H]; v runs downwards as in glTF.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Index into `Scene::objects`.
    pub object: usize,
    /// Where the coordinates come from.
    pub uv_set: UvSet,
    /// Map coordinates in [0, 1] of the three corners of every triangle of the object's mesh.
    pub corner_uvs: Vec<[DVec2; 3]>,
    /// Texels across, > 0.
    pub width: usize,
    /// Texels down, > 0.
    pub height: usize,
    /// Surface area under each texel [m²]: a single value where all are alike, else one per texel (0 = uncovered).
    pub texel_areas_m2: Vec<f64>,
}

impl Chart {
    /// Surface area under a texel [m²], 0 where the surface does not reach it; `texel` = row·width + column.
    pub fn texel_area_m2(&self, texel: usize) -> f64 {
        if self.texel_areas_m2.len() == 1 {
            self.texel_areas_m2[0]
        } else {
            self.texel_areas_m2[texel]
        }
    }

    /// Map coordinates of a point of a triangle from its barycentric coordinates.
    pub fn uv(&self, triangle: usize, barycentric: [f64; 3]) -> DVec2 {
        let [a, b, c] = self.corner_uvs[triangle];
        a * barycentric[0] + b * barycentric[1] + c * barycentric[2]
    }

    /// Rows of the linear map from a world displacement in a triangle's plane [m] to a displacement in texels:
    /// texel = (rows[0]·d, rows[1]·d). `None` where the triangle has no area.
    pub fn texel_from_world(&self, triangle: usize, corners: [DVec3; 3]) -> Option<[DVec3; 2]> {
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        // Dual basis of (e1, e2) within the plane.
        let (g11, g12, g22) = (e1.dot(e1), e1.dot(e2), e2.dot(e2));
        let determinant = g11 * g22 - g12 * g12;
        if determinant.is_nan() || determinant <= 0.0 {
            return None;
        }
        let dual1 = (e1 * g22 - e2 * g12) / determinant;
        let dual2 = (e2 * g11 - e1 * g12) / determinant;
        let [a, b, c] = self.corner_uvs[triangle];
        let size = DVec2::new(self.width as f64, self.height as f64);
        let (t1, t2) = ((b - a) * size, (c - a) * size);
        Some([dual1 * t1.x + dual2 * t2.x, dual1 * t1.y + dual2 * t2.y])
    }
}
