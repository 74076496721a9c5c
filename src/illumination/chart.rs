//! Maps a surface into its illumination map: the contract between the light pass (deposits), the eye pass (looks up)
//! and the exporters.
//!
//! The two sides of a surface. Light on one side of a thin sheet is not seen on the other, so each side is a receiver
//! with a map of its own. Both use the same coordinates.

use super::islands::Islands;
use super::seams::{SeamTexel, SeamTexels};
use super::tiles::TileLayout;
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

/// Source of a map's coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum UvSet {
    /// The file's first texture coordinate set.
    #[serde(rename = "TEXCOORD_0")]
    TexCoord0,
    /// The file's second texture coordinate set.
    #[serde(rename = "TEXCOORD_1")]
    TexCoord1,
    /// Generated, and written with the map.
    #[serde(rename = "generated")]
    Generated,
}

/// Parametrisation of one object at one map size.
///
/// Texel (i, j) covers u in [i/W, (i+1)/W] and v in [j/H, (j+1)/H]; v runs downwards as in glTF. Values per texel are
/// stored row by row, or in the order of [`TileLayout`] in a tiled chart. Texel coordinates always refer to the finest
/// size.
#[derive(Clone, Debug)]
pub struct Chart {
    /// The receiver of the map's light.
    pub receiver: Receiver,
    pub uv_set: UvSet,
    /// Map coordinates in [0, 1] of the three corners of every triangle of the object's mesh.
    pub corner_uvs: Vec<[DVec2; 3]>,
    /// Texels across, > 0; of the finest size if tiled.
    pub width: usize,
    /// Texels down, > 0; of the finest size if tiled.
    pub height: usize,
    /// Surface area under each texel [m²]: a single value if all are equal, else one per texel (0 = uncovered).
    pub texel_areas_m2: Vec<f64>,
    /// Resolution of each tile; `None` without tiles. Only surfaces that fill their map evenly are tiled.
    pub layout: Option<Arc<TileLayout>>,
    /// Uncovered texels beside seams, with the points where the surface continues.
    pub beyond: Vec<SeamTexel>,
    /// Texels that touch at seams without a gutter.
    pub joints: Vec<SeamTexels>,
    /// Found when they are first asked for.
    pub islands: OnceLock<Option<Islands>>,
}

impl Chart {
    /// Its islands; `None` where it is one.
    pub fn islands(&self) -> Option<&Islands> {
        self.islands.get_or_init(|| Islands::find(self)).as_ref()
    }

    pub fn texel_count(&self) -> usize {
        match &self.layout {
            Some(layout) => layout.texel_count(),
            None => self.width * self.height,
        }
    }

    /// A value of a texel per surface area [1/m²]; zero where the texel holds no surface.
    pub fn per_area<T: Default + std::ops::Div<f64, Output = T>>(&self, texel: usize, value: T) -> T {
        let area_m2 = self.texel_area_m2(texel);
        if area_m2 > 0.0 {
            value / area_m2
        } else {
            T::default()
        }
    }

    /// Index of the texel at a column and row of the finest size.
    pub fn texel_at(&self, column: usize, row: usize) -> usize {
        match &self.layout {
            Some(layout) => layout.texel(column, row),
            None => row * self.width + column,
        }
    }

    /// Whether the surface fills the whole map evenly.
    pub fn is_full(&self) -> bool {
        self.layout.is_some() || self.texel_areas_m2.len() == 1
    }

    /// The same chart without tiles, in which all texels have the finest size.
    #[must_use]
    pub fn without_tiles(&self) -> Self {
        let texel_areas_m2 = match &self.layout {
            Some(layout) => {
                let finest = layout.tiles().map(|tile| tile.level).min().unwrap_or(0);
                let least_m2 = self.texel_areas_m2.iter().copied().fold(f64::INFINITY, f64::min);
                vec![least_m2 / f64::from(1_u32 << (2 * finest))]
            }
            None => self.texel_areas_m2.clone(),
        };
        Self {
            texel_areas_m2,
            layout: None,
            islands: OnceLock::new(),
            ..self.clone()
        }
    }

    /// Index in `Scene::objects`.
    pub fn object(&self) -> usize {
        self.receiver.object()
    }

    /// The same chart for the given side of its object.
    #[must_use]
    pub fn of_side(self, side: Side) -> Self {
        Self {
            receiver: Receiver::new(self.object(), side),
            ..self
        }
    }

    /// Surface area under a texel [m²], 0 if uncovered. `texel` is row·width + column, or an index in tile order.
    pub fn texel_area_m2(&self, texel: usize) -> f64 {
        if self.texel_areas_m2.len() == 1 {
            self.texel_areas_m2[0]
        } else {
            self.texel_areas_m2[texel]
        }
    }

    /// Surface area in the map [m²].
    pub fn area_m2(&self) -> f64 {
        match self.texel_areas_m2[..] {
            [texel_m2] => texel_m2 * (self.width * self.height) as f64,
            ref texels => texels.iter().sum(),
        }
    }

    /// Map coordinates of a point of a triangle, given its barycentric coordinates.
    pub fn uv(&self, triangle: usize, barycentric: [f64; 3]) -> DVec2 {
        let [a, b, c] = self.corner_uvs[triangle];
        a * barycentric[0] + b * barycentric[1] + c * barycentric[2]
    }

    /// Jacobian of texel coordinates: rows of the linear map from a world displacement in a triangle's plane [m] to one
    /// in texels, (rows[0]·d, rows[1]·d). `None` if the triangle has no area.
    pub fn texel_from_world(&self, triangle: usize, corners: [DVec3; 3]) -> Option<[DVec3; 2]> {
        let [across, down] = uv_from_world(self.corner_uvs[triangle], corners)?;
        Some([across * self.width as f64, down * self.height as f64])
    }
}

/// Jacobian of map coordinates in [0, 1]: rows [1/m] of the map from a displacement in a triangle's plane.
pub fn uv_from_world([a, b, c]: [DVec2; 3], corners: [DVec3; 3]) -> Option<[DVec3; 2]> {
    let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
    // Dual basis of (e1, e2) in the plane.
    let (g11, g12, g22) = (e1.dot(e1), e1.dot(e2), e2.dot(e2));
    let determinant = g11 * g22 - g12 * g12;
    if determinant.is_nan() || determinant <= 0.0 {
        return None;
    }
    let dual1 = (e1 * g22 - e2 * g12) / determinant;
    let dual2 = (e2 * g11 - e1 * g12) / determinant;
    let (t1, t2) = (b - a, c - a);
    Some([dual1 * t1.x + dual2 * t2.x, dual1 * t1.y + dual2 * t2.y])
}

/// A side of a surface, by the winding of its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Side that the geometric normal points to.
    Front,
    Back,
}

impl Side {
    /// The side that a ray of this direction hits.
    pub fn met(direction: DVec3, geometric_normal: DVec3) -> Self {
        if direction.dot(geometric_normal) <= 0.0 {
            Self::Front
        } else {
            Self::Back
        }
    }

    /// Factor of the geometric normal that makes it point away from the surface on this side.
    pub fn sign(self) -> f64 {
        match self {
            Self::Front => 1.0,
            Self::Back => -1.0,
        }
    }
}

/// One side of one object, which can receive light in a map. Ordered by object, front first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Receiver(u32);

impl Receiver {
    /// A side of an object, given its index in `Scene::objects`, below 2³¹.
    pub fn new(object: usize, side: Side) -> Self {
        Self((object as u32) << 1 | u32::from(side == Side::Back))
    }

    pub fn front(object: usize) -> Self {
        Self::new(object, Side::Front)
    }

    pub fn back(object: usize) -> Self {
        Self::new(object, Side::Back)
    }

    /// The receivers of this many objects, in order.
    pub fn all(objects: usize) -> impl Iterator<Item = Self> {
        (0..2 * objects as u32).map(Self)
    }

    /// Index into `Scene::objects`.
    pub fn object(self) -> usize {
        (self.0 >> 1) as usize
    }

    pub fn side(self) -> Side {
        if self.0 & 1 == 0 { Side::Front } else { Side::Back }
    }

    /// Position in [`Receiver::all`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl std::fmt::Debug for Receiver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} of object {}", self.side(), self.object())
    }
}
