//! Unwraps a curved surface: charts by uvunwrap, packed with gutters.

use glam::DVec2;
use uvunwrap::{Density, MeshInput, Options};

use crate::files::cache::{self, ContentHash};
use crate::geometry::numbered;
use crate::illumination::uv_file;
use crate::scene::Mesh;

/// Uncovered texels around every chart: a bilinear lookup at a border reads one of them.
const PADDING_TEXELS: u32 = 1;

/// Maximum angle between a facet's normal and the mean of its chart [degrees].
const CHART_ANGLE_DEG: f32 = 50.0;

/// Maximum ratio, either way, between a facet's share of the map and its share of the surface.
const DISTORTION: f32 = 1.5;

/// Meshes with fewer triangles unwrap fast enough not to be cached.
const MIN_KEPT: usize = 2000;

/// To be incremented whenever the coordinates of a mesh change: with a new version of uvunwrap or other options.
const LAYOUT_VERSION: u64 = 3;

/// Range of the map side that charts are packed for [texels].
const SIDES: (usize, usize) = (16, 8192);

/// Map coordinates in [0, 1] of all triangles, packed for a map of `side` texels, or more if that cannot hold all
/// charts with their gutters. `None` if the mesh cannot be unwrapped.
pub fn unwrap(mesh: &Mesh, side: usize) -> Option<Vec<[DVec2; 3]>> {
    if mesh.triangles.len() < MIN_KEPT {
        return lay_out(mesh, side);
    }
    let name = format!("{:016x}.uv", content_hash(mesh, side));
    let triangles = mesh.triangles.len();
    let known = cache::load(&name, uv_file::size_bytes(triangles));
    if let Some(known) = known.and_then(|bytes| uv_file::decode(&bytes, triangles, &name).ok()) {
        return Some(known);
    }
    let made = lay_out(mesh, side)?;
    cache::store(&name, &uv_file::encode(&made));
    Some(made)
}

/// Hashes everything that the coordinates depend on.
fn content_hash(mesh: &Mesh, side: usize) -> u64 {
    let mut hash = ContentHash::default();
    hash.take(LAYOUT_VERSION);
    hash.take(side as u64);
    for position in &mesh.positions {
        position
            .to_array()
            .iter()
            .for_each(|value| hash.take(value.to_bits()));
    }
    let corners = mesh.triangles.iter().flatten();
    corners.for_each(|vertex| hash.take(u64::from(*vertex)));
    hash.value()
}

/// Vertices per position above which splits are no seams: the file splits vertices everywhere for normals or
/// coordinates.
const MAX_SPLIT: f64 = 1.5;

/// Positions and indices of a mesh. If most vertices differ only in normals or coordinates, those at the same position
/// are welded: otherwise there would be as many charts as facets.
fn welded(mesh: &Mesh, local: impl Fn(&glam::DVec3) -> [f32; 3]) -> (Vec<[f32; 3]>, Vec<u32>) {
    let split: Vec<[f32; 3]> = mesh.positions.iter().map(local).collect();
    let indices: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    // Adding zero turns −0 into +0.
    let vertices = numbered(
        split
            .iter()
            .map(|position| position.map(|value| (value + 0.0).to_bits())),
    );
    let mut positions = Vec::new();
    for (position, vertex) in split.iter().zip(&vertices) {
        if *vertex as usize == positions.len() {
            positions.push(*position);
        }
    }
    if (split.len() as f64) < MAX_SPLIT * positions.len() as f64 {
        return (split, indices);
    }
    (
        positions,
        indices.iter().map(|&index| vertices[index as usize]).collect(),
    )
}

/// Unwraps without the cache.
fn lay_out(mesh: &Mesh, side: usize) -> Option<Vec<[DVec2; 3]>> {
    let (low, high) = mesh.bounds()?;
    let size_m = (high - low).max_element();
    // Single precision is finest around zero.
    let local = |point: &glam::DVec3| ((*point - (low + high) * 0.5) / size_m).as_vec3().to_array();
    let (positions, indices) = welded(mesh, local);
    let input = MeshInput::new(&positions, &indices);
    let mut side = side.clamp(SIDES.0, SIDES.1);
    loop {
        let options = Options {
            max_chart_angle: CHART_ANGLE_DEG,
            max_area_distortion: DISTORTION,
            density: Density::Auto {
                page_size: side as u32,
            },
            padding: PADDING_TEXELS,
            ..Options::default()
        };
        match uvunwrap::generate(&[input], &options) {
            Ok(atlas) if atlas.page_count <= 1 => {
                let made = atlas.meshes.first()?;
                let uv = |vertex: u32| DVec2::from(made.vertices[vertex as usize].uv.map(f64::from));
                let (triangles, _) = made.indices.as_chunks::<3>();
                return Some(triangles.iter().map(|triangle| triangle.map(uv)).collect());
            }
            Ok(_) if side < SIDES.1 => side *= 2,
            Ok(_) => {
                log::warn!(
                    "a mesh of {} triangles has too many charts for one map",
                    mesh.triangles.len()
                );
                return None;
            }
            Err(error) => {
                log::warn!(
                    "a mesh of {} triangles cannot be unwrapped: {error}",
                    mesh.triangles.len()
                );
                return None;
            }
        }
    }
}
