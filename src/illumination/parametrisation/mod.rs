//! Parametrises surfaces: every point of a surface has a place in its map, at any map size.

pub mod coverage;
mod given;
mod plane;
mod unwrap;

use std::sync::{Arc, OnceLock};

use glam::DVec2;

pub use given::Refusal;

use super::Receiver;
use super::chart::{Chart, UvSet};
use super::seams::{self, Seam};
use super::tiles::TileLayout;
use crate::scene::Mesh;
use coverage::twice_signed_area;
use plane::{common_normal, smallest_rectangle};

/// Map coordinates of one object, independent of the map size.
#[derive(Clone, Debug)]
pub struct Parametrisation {
    /// Index in `Scene::objects`.
    pub object: usize,
    pub uv_set: UvSet,
    /// Map coordinates in [0, 1] of the three corners of every triangle; v runs downwards.
    pub corner_uvs: Vec<[DVec2; 3]>,
    /// Area of every triangle [m²].
    triangle_areas_m2: Vec<f64>,
    /// Aspect ratio (width over height) at which texels are square on the surface, on average.
    pub suggested_aspect: f64,
    /// Whether all texels have the same area at any map size.
    uniform: bool,
    /// Edges at which charts end although the surface continues.
    seams: Vec<Seam>,
}

/// Chooses map coordinates for an object's mesh; `None` if it has no area or cannot be unwrapped.
///
/// In this order: TEXCOORD_0 if the mesh is planar and the set is affine and covers the unit square; TEXCOORD_1, then
/// TEXCOORD_0, if it is an injective map into the unit square (finite, inside, no overlap beyond borders, every
/// triangle has its share of area, at least a twentieth of the map is covered); otherwise generated coordinates. A
/// planar mesh is then projected onto its smallest enclosing rectangle; any other is unwrapped into charts with gutters
/// for small maps, the same for maps of all sizes. Deterministic.
pub fn parametrise(object: usize, mesh: &Mesh) -> Option<Parametrisation> {
    let has_area = mesh.area_m2() > 0.0;
    let (uv_set, corner_uvs) = has_area.then(|| choose(mesh))??;
    Some(Parametrisation::new(object, mesh, uv_set, corner_uvs))
}

fn choose(mesh: &Mesh) -> Option<(UvSet, Vec<[DVec2; 3]>)> {
    let normal = common_normal(mesh);
    let usable = |uvs: Option<&Vec<DVec2>>| given::light_map_set(mesh, uvs?).ok();
    let first = usable(mesh.uv0.as_ref());
    match (first, normal) {
        (Some(set), Some(normal)) if given::is_affine_and_covering(mesh, &set, normal) => {
            return Some((UvSet::TexCoord0, set));
        }
        (first, _) => {
            if let Some(set) = usable(mesh.uv1.as_ref()) {
                return Some((UvSet::TexCoord1, set));
            }
            if let Some(set) = first {
                return Some((UvSet::TexCoord0, set));
            }
        }
    }
    let flat = normal.map(|normal| project_flat(mesh, normal));
    let generated = match flat {
        Some(set) if !given::overlaps(&set, 256) => set,
        _ => unwrap::unwrap(mesh)?,
    };
    Some((UvSet::Generated, generated))
}

/// Coordinate sets of a mesh that cannot be used for its map, and why.
pub fn refused_sets(mesh: &Mesh) -> Vec<(&'static str, Refusal)> {
    let sets = [
        ("TEXCOORD_0", mesh.uv0.as_ref()),
        ("TEXCOORD_1", mesh.uv1.as_ref()),
    ];
    let refusal = |(name, set): (&'static str, Option<&Vec<DVec2>>)| {
        given::light_map_set(mesh, set?)
            .err()
            .map(|refusal| (name, refusal))
    };
    sets.into_iter().filter_map(refusal).collect()
}

/// Projects a planar mesh onto its smallest enclosing rectangle.
fn project_flat(mesh: &Mesh, normal: glam::DVec3) -> Vec<[DVec2; 3]> {
    let points: Vec<_> = (0..mesh.triangles.len())
        .flat_map(|triangle| mesh.corners(triangle))
        .collect();
    let rectangle = smallest_rectangle(&points, normal).upright(&points, normal);
    let uv = |corner| {
        ((rectangle.frame.project(corner) - rectangle.low) / rectangle.size).clamp(DVec2::ZERO, DVec2::ONE)
    };
    (0..mesh.triangles.len())
        .map(|triangle| mesh.corners(triangle).map(uv))
        .collect()
}

/// Covered fraction of a mean texel below which coverage is rounding error, and below which it is negligible.
const ROUNDING: f64 = 1e-9;
const SLIVER: f64 = 1e-3;

impl Parametrisation {
    /// From known map coordinates: in [0, 1], three corners per triangle of the mesh.
    pub fn new(object: usize, mesh: &Mesh, uv_set: UvSet, corner_uvs: Vec<[DVec2; 3]>) -> Self {
        let triangle_areas_m2: Vec<f64> = (0..mesh.triangles.len())
            .map(|triangle| mesh.triangle_area_m2(triangle))
            .collect();
        let uniform = is_uniform(&corner_uvs, &triangle_areas_m2);
        Self {
            object,
            uv_set,
            suggested_aspect: aspect(mesh, &corner_uvs, &triangle_areas_m2),
            uniform,
            seams: seams::find(mesh, &corner_uvs),
            corner_uvs,
            triangle_areas_m2,
        }
    }

    /// Area of the surface [m²].
    pub fn area_m2(&self) -> f64 {
        self.triangle_areas_m2.iter().sum()
    }

    /// Area of one triangle of the surface [m²].
    pub fn triangle_area_m2(&self, triangle: usize) -> f64 {
        self.triangle_areas_m2[triangle]
    }

    /// The chart for the front of the object, in a map of `width` × `height` texels, both > 0. Texel areas are exact:
    /// the area of each triangle clipped to each texel, times the triangle's m² per texel².
    pub fn chart(&self, width: usize, height: usize) -> Chart {
        let texel_areas_m2 = if self.uniform {
            vec![self.area_m2() / (width * height) as f64]
        } else {
            self.texel_areas_m2(width, height)
        };
        let mean_m2 = self.area_m2() / (width * height) as f64;
        let covers =
            |texel: usize, share: f64| texel_areas_m2.get(texel).is_none_or(|m2| *m2 > share * mean_m2);
        Chart {
            beyond: seams::texels(&self.seams, (width, height), |texel| covers(texel, ROUNDING)),
            joints: seams::joints(&self.seams, (width, height), |texel| covers(texel, SLIVER)),
            receiver: Receiver::front(self.object),
            uv_set: self.uv_set,
            corner_uvs: self.corner_uvs.clone(),
            width,
            height,
            texel_areas_m2,
            layout: None,
            islands: OnceLock::new(),
        }
    }

    /// The chart of a tiled map; `None` unless the surface fills its map evenly.
    pub fn tiled_chart(&self, layout: &Arc<TileLayout>) -> Option<Chart> {
        if !self.uniform {
            return None;
        }
        let (width, height) = layout.size();
        let finest_m2 = self.area_m2() / (width * height) as f64;
        let areas = layout.tiles().flat_map(|tile| {
            let area_m2 = finest_m2 * f64::from(1_u32 << (2 * tile.level));
            std::iter::repeat_n(area_m2, tile.texels.len())
        });
        Some(Chart {
            texel_areas_m2: areas.collect(),
            layout: Some(Arc::clone(layout)),
            // Full maps have no gutters.
            beyond: Vec::new(),
            joints: Vec::new(),
            ..self.chart(width, height)
        })
    }

    /// Whether the surface fills its map evenly, so that the map can be tiled.
    pub fn is_uniform(&self) -> bool {
        self.uniform
    }

    fn texel_areas_m2(&self, width: usize, height: usize) -> Vec<f64> {
        let mut areas = vec![0.0; width * height];
        let size = DVec2::new(width as f64, height as f64);
        for (uvs, area_m2) in self.corner_uvs.iter().zip(&self.triangle_areas_m2) {
            let corners = uvs.map(|uv| uv * size);
            let texels = 0.5 * twice_signed_area(corners).abs();
            if texels == 0.0 {
                continue;
            }
            let m2_per_texel2 = area_m2 / texels;
            for row in coverage::rows(corners, height) {
                coverage::for_each_texel_in_row(corners, row, width, |column, part| {
                    areas[row * width + column] += part.area() * m2_per_texel2;
                });
            }
        }
        areas
    }
}

/// Whether the whole unit square is covered at constant density, to the precision of single-precision files.
fn is_uniform(corner_uvs: &[[DVec2; 3]], areas_m2: &[f64]) -> bool {
    let total_m2: f64 = areas_m2.iter().sum();
    (given::covered_share(corner_uvs) - 1.0).abs() < 1e-6
        && corner_uvs.iter().zip(areas_m2).all(|(uvs, area_m2)| {
            let share = 0.5 * twice_signed_area(*uvs).abs();
            (area_m2 / total_m2 - share).abs() <= 1e-6 * share
        })
}

/// Root mean square of |∂P/∂u| over that of |∂P/∂v|, area-weighted.
fn aspect(mesh: &Mesh, corner_uvs: &[[DVec2; 3]], areas_m2: &[f64]) -> f64 {
    let (mut across, mut down) = (0.0, 0.0);
    for (triangle, (uvs, area_m2)) in corner_uvs.iter().zip(areas_m2).enumerate() {
        let [a, b, c] = mesh.corners(triangle);
        let (e1, e2) = (b - a, c - a);
        let (t1, t2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
        let determinant = t1.perp_dot(t2);
        if determinant == 0.0 {
            continue;
        }
        let by_u = (e1 * t2.y - e2 * t1.y) / determinant;
        let by_v = (e2 * t1.x - e1 * t2.x) / determinant;
        across += area_m2 * by_u.length_squared();
        down += area_m2 * by_v.length_squared();
    }
    if across > 0.0 && down > 0.0 {
        (across / down).sqrt()
    } else {
        1.0
    }
}
