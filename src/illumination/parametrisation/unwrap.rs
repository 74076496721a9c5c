//! Unwraps a curved surface: charts by uvunwrap, packed with gutters.

use glam::DVec2;
use uvunwrap::{Atlas, Density, MeshInput, Options, OutputVertex, Packing};

use super::given::covered_share;
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

/// Meshes with fewer triangles unwrap fast enough not to be cached, and to be flattened for each side again.
const MIN_KEPT: usize = 2000;

/// To be incremented whenever the coordinates of a mesh change: with a new version of uvunwrap or other options.
const LAYOUT_VERSION: u64 = 4;

/// Sides of the map that charts may be packed for [texels]: the smallest of which they fill enough.
const NOMINAL_SIDES: [usize; 4] = [64, 128, 256, 512];

/// Largest side, for surfaces whose gutters leave no room on smaller ones [texels].
const MAX_SIDE: usize = 8192;

/// Smallest filled share of a map with gutters, unless its side is the largest: wider gutters cost texels at all sizes.
const MIN_FILLED: f64 = 0.6;

/// More charts are packed by their rows: by their shapes, 1,600 charts take 2 s and fill 65 % of a map instead of 54 %.
const MANY_CHARTS: u32 = 1000;

/// Map coordinates in [0, 1] of all triangles. `None` if the mesh cannot be unwrapped.
pub fn unwrap(mesh: &Mesh) -> Option<Vec<[DVec2; 3]>> {
    if mesh.triangles.len() < MIN_KEPT {
        return lay_out(mesh);
    }
    let name = format!("{:016x}.uv", content_hash(mesh));
    let triangles = mesh.triangles.len();
    let known = cache::load(&name, uv_file::size_bytes(triangles));
    if let Some(known) = known.and_then(|bytes| uv_file::decode(&bytes, triangles, &name).ok()) {
        return Some(known);
    }
    let made = lay_out(mesh)?;
    cache::store(&name, &uv_file::encode(&made));
    Some(made)
}

/// Hashes everything that the coordinates depend on.
fn content_hash(mesh: &Mesh) -> u64 {
    let mut hash = ContentHash::default();
    hash.take(LAYOUT_VERSION);
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
fn lay_out(mesh: &Mesh) -> Option<Vec<[DVec2; 3]>> {
    let (low, high) = mesh.bounds()?;
    let size_m = (high - low).max_element();
    // Single precision is finest around zero.
    let local = |point: &glam::DVec3| ((*point - (low + high) * 0.5) / size_m).as_vec3().to_array();
    let (positions, indices) = welded(mesh, local);
    let whole = MeshInput::new(&positions, &indices);
    if mesh.triangles.len() < MIN_KEPT {
        return packed(whole, Packing::Shape);
    }
    let charts = FlatCharts::of(whole)?;
    packed(charts.input(), charts.packing)
}

/// A mesh in charts that are flat, but not packed yet. Flattening takes longest, and is the same for all sides.
struct FlatCharts {
    positions: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    indices: Vec<u32>,
    packing: Packing,
}

impl FlatCharts {
    fn of(whole: MeshInput) -> Option<Self> {
        let [.., side] = NOMINAL_SIDES;
        let atlas = generate(whole, side, Packing::Fast)?;
        let made = atlas.meshes.first()?;
        let vertices = made.vertices.iter();
        // Charts of several pages lie side by side: those that overlapped would be taken for one.
        let apart = |vertex: &OutputVertex| {
            let [u, v] = vertex.uv;
            [u + vertex.page.unwrap_or(0) as f32, v]
        };
        Some(Self {
            positions: vertices
                .clone()
                .map(|vertex| whole.positions[vertex.xref as usize])
                .collect(),
            uvs: vertices.map(apart).collect(),
            indices: made.indices.clone(),
            packing: if atlas.chart_count > MANY_CHARTS {
                Packing::Fast
            } else {
                Packing::Shape
            },
        })
    }

    fn input(&self) -> MeshInput<'_> {
        MeshInput {
            existing_uvs: Some(&self.uvs),
            ..MeshInput::new(&self.positions, &self.indices)
        }
    }
}

/// Packs charts with gutters for the smallest of the nominal sides that they fill well, or for a larger one if none can
/// hold them.
fn packed(input: MeshInput, packing: Packing) -> Option<Vec<[DVec2; 3]>> {
    let [.., last] = NOMINAL_SIDES;
    let larger = std::iter::successors(Some(2 * last), |side| Some(2 * side));
    let sides = NOMINAL_SIDES
        .into_iter()
        .chain(larger.take_while(|side| *side <= MAX_SIDE));
    for side in sides {
        let atlas = generate(input, side, packing)?;
        if atlas.page_count > 1 {
            continue;
        }
        let made = atlas.meshes.first()?;
        let uv = |vertex: u32| DVec2::from(made.vertices[vertex as usize].uv.map(f64::from));
        let (triangles, _) = made.indices.as_chunks::<3>();
        let uvs: Vec<_> = triangles.iter().map(|triangle| triangle.map(uv)).collect();
        if side >= last || covered_share(&uvs) >= MIN_FILLED {
            return Some(uvs);
        }
    }
    let triangles = input.indices.len() / 3;
    log::warn!("a mesh of {triangles} triangles has too many charts for one map");
    None
}

/// Charts of a mesh, packed for a map of `side` texels; `None` if uvunwrap refuses the mesh.
fn generate(input: MeshInput, side: usize, packing: Packing) -> Option<Atlas> {
    let options = Options {
        max_chart_angle: CHART_ANGLE_DEG,
        max_area_distortion: DISTORTION,
        density: Density::Auto {
            page_size: side as u32,
        },
        padding: PADDING_TEXELS,
        packing,
        ..Options::default()
    };
    let refused = |error| {
        let triangles = input.indices.len() / 3;
        log::warn!("a mesh of {triangles} triangles cannot be unwrapped: {error}");
    };
    uvunwrap::generate(&[input], &options).map_err(refused).ok()
}
