//! Gives every point of a surface its place in a map, at any map size.

pub mod coverage;
mod given;
mod overlap;
mod packing;
mod plane;
mod regions;

use glam::DVec2;

use super::chart::{Chart, UvSet};
use crate::scene::Mesh;
use coverage::twice_signed_area;
use plane::{common_normal, smallest_rectangle};

/// Nominal map side [texels] that generated coordinates keep gutters for, where nothing else is asked.
pub const DEFAULT_NOMINAL_SIDE: usize = 512;

/// Map coordinates of one object, before the map has a size.
#[derive(Clone, Debug)]
pub struct Parametrisation {
    /// Index into `Scene::objects`.
    pub object: usize,
    /// Where the coordinates come from.
    pub uv_set: UvSet,
    /// Map coordinates in [0, 1] of the three corners of every triangle; v runs downwards.
    pub corner_uvs: Vec<[DVec2; 3]>,
    /// Area of every triangle [m²].
    triangle_areas_m2: Vec<f64>,
    /// Width over height of a map whose texels are square on the surface, on average.
    pub suggested_aspect: f64,
    /// Whether all texels have the same area at any map size.
    uniform: bool,
}

/// Map coordinates for the mesh of an object; `None` where the mesh has no area.
///
/// In this order: TEXCOORD_0 where the mesh is planar and the set is affine and covers the unit square; TEXCOORD_1,
/// then TEXCOORD_0, where every point has its own place in the unit square (finite, inside, no overlap beyond
/// borders, every triangle with its share of area, a twentieth of the map covered at least); else generated: a planar
/// mesh by the smallest rectangle around it, any other cut into nearly flat pieces, laid side by side at one scale
/// with gutters of two texels at a map of `nominal_side` texels. Deterministic.
pub fn parametrise(object: usize, mesh: &Mesh, nominal_side: usize) -> Option<Parametrisation> {
    let has_area = mesh.area_m2() > 0.0;
    has_area.then(|| {
        let (uv_set, corner_uvs) = choose(mesh, nominal_side);
        Parametrisation::new(object, mesh, uv_set, corner_uvs)
    })
}

fn choose(mesh: &Mesh, nominal_side: usize) -> (UvSet, Vec<[DVec2; 3]>) {
    let normal = common_normal(mesh);
    let first = given::light_map_set(mesh, mesh.uv0.as_ref());
    match (first, normal) {
        (Some(set), Some(normal)) if given::is_affine_and_covering(mesh, &set, normal) => {
            return (UvSet::TexCoord0, set);
        }
        (first, _) => {
            if let Some(set) = given::light_map_set(mesh, mesh.uv1.as_ref()) {
                return (UvSet::TexCoord1, set);
            }
            if let Some(set) = first {
                return (UvSet::TexCoord0, set);
            }
        }
    }
    let flat = normal.map(|normal| project_flat(mesh, normal));
    let generated = match flat {
        Some(set) if !overlap::overlaps(&set, 256) => set,
        _ => unwrap_regions(mesh, nominal_side),
    };
    (UvSet::Generated, generated)
}

/// A planar mesh, by the smallest rectangle around it.
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

/// Any mesh, in nearly flat pieces.
fn unwrap_regions(mesh: &Mesh, nominal_side: usize) -> Vec<[DVec2; 3]> {
    let regions = regions::grow(mesh);
    let sizes: Vec<DVec2> = regions.iter().map(|region| region.rectangle.size).collect();
    let packing = packing::pack(&sizes, nominal_side);
    let mut corner_uvs = vec![[DVec2::ZERO; 3]; mesh.triangles.len()];
    for (region, corner) in regions.iter().zip(&packing.low) {
        let rectangle = &region.rectangle;
        for &triangle in &region.triangles {
            corner_uvs[triangle as usize] = mesh.corners(triangle as usize).map(|point| {
                let local = rectangle.frame.project(point) - rectangle.low;
                (*corner + local * packing.scale_per_m).clamp(DVec2::ZERO, DVec2::ONE)
            });
        }
    }
    corner_uvs
}

impl Parametrisation {
    /// Map coordinates that are known already: [0, 1], three corners per triangle of the mesh.
    pub fn new(object: usize, mesh: &Mesh, uv_set: UvSet, corner_uvs: Vec<[DVec2; 3]>) -> Self {
        let triangle_areas_m2: Vec<f64> = (0..mesh.triangles.len())
            .map(|triangle| {
                let [a, b, c] = mesh.corners(triangle);
                0.5 * (b - a).cross(c - a).length()
            })
            .collect();
        let uniform = is_uniform(&corner_uvs, &triangle_areas_m2);
        Self {
            object,
            uv_set,
            suggested_aspect: aspect(mesh, &corner_uvs, &triangle_areas_m2),
            uniform,
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

    /// The chart of a map of `width` × `height` texels, both > 0, with the exact area of the surface under every
    /// texel: triangles cut by texels, times the triangle's m² per texel².
    pub fn chart(&self, width: usize, height: usize) -> Chart {
        let texel_areas_m2 = if self.uniform {
            vec![self.area_m2() / (width * height) as f64]
        } else {
            self.texel_areas_m2(width, height)
        };
        Chart {
            object: self.object,
            uv_set: self.uv_set,
            corner_uvs: self.corner_uvs.clone(),
            width,
            height,
            texel_areas_m2,
        }
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

/// Whether the whole unit square is covered at one density, to the precision of files in single precision.
fn is_uniform(corner_uvs: &[[DVec2; 3]], areas_m2: &[f64]) -> bool {
    let total_m2: f64 = areas_m2.iter().sum();
    (given::covered_share(corner_uvs) - 1.0).abs() < 1e-6
        && corner_uvs.iter().zip(areas_m2).all(|(uvs, area_m2)| {
            let share = 0.5 * twice_signed_area(*uvs).abs();
            (area_m2 / total_m2 - share).abs() <= 1e-6 * share
        })
}

/// Root mean square of |∂P/∂u| over that of |∂P/∂v|, over the area.
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
