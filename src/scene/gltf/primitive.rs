//! The primitives of meshes, as triangles.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{Formats, Reader};
use super::report::{Budget, Report};
use super::triangles;
use crate::error::{Error, Result};
use crate::scene::Mesh;

/// Beyond this [m], squares and volumes leave the range in which they are exact enough to be of use.
const FARTHEST_M: f64 = 1e12;

/// Share of a mesh's extent by which its vertices may be rounded without a word [1].
const LARGEST_ROUNDING: f64 = 1e-5;

/// Bytes of a vertex and a triangle while they are read.
const VERTEX_BYTES: u64 = 2 * 80;
const TRIANGLE_BYTES: u64 = 2 * 12;

/// Takes the memory of one more copy of a mesh.
///
/// # Errors
/// Not so much is left.
pub fn take_copy(mesh: &Mesh, owner: &str, budget: &mut Budget) -> Result<()> {
    budget.take(mesh.positions.len() as u64 * VERTEX_BYTES, owner)?;
    budget.take(3 * mesh.triangles.len() as u64 * TRIANGLE_BYTES, owner)
}

/// The primitives that were read: nodes with the same mesh share them.
#[derive(Debug, Default)]
pub struct Primitives {
    /// By the indices of mesh and primitive.
    known: HashMap<(usize, usize), Known>,
    /// Triangles without an area.
    pub degenerate: usize,
}

/// A primitive of the file.
#[derive(Debug)]
struct Known {
    /// As the file has it, and whether it has normals; `None` where it has no triangles.
    source: Option<(Mesh, bool)>,
    /// What objects were made of it. Which triangles have an area depends on the transform by what it rounds.
    made: Vec<(Variant, Arc<Mesh>)>,
}

/// What two meshes of one primitive differ in.
#[derive(Debug, PartialEq)]
struct Variant {
    has_area: Vec<bool>,
    /// Corners are split in the order of the scene's triangles.
    is_split_mirrored: bool,
    /// Normals are unit already, so that mesh and mesh in the scene are one.
    stands_at_origin: bool,
}

impl Variant {
    /// The mesh of a primitive, without what would not be seen.
    fn of(&self, source: &Mesh, has_normals: bool, owner: &str, report: &mut Report) -> Mesh {
        let mut mesh = source.clone();
        let mut has_area = self.has_area.iter();
        mesh.triangles.retain(|_| has_area.next() == Some(&true));
        if has_normals {
            drop_unused_vertices(&mut mesh);
            check_normals(&mut mesh, owner, report);
        } else {
            split_corners(&mut mesh, self.is_split_mirrored);
        }
        mesh
    }
}

impl Primitives {
    /// The triangles of a primitive, in coordinates from which `world_from_node` brings them into the world; `None`, with a
    /// warning, where it has none there.
    ///
    /// # Errors
    /// Positions that are not finite or too far, indices of vertices that do not exist, broken accessors.
    pub fn read(
        &mut self,
        reader: Reader,
        (mesh, index, primitive): (usize, usize, &Primitive),
        world_from_node: &DAffine3,
        owner: &str,
        budget: &mut Budget,
        report: &mut Report,
    ) -> Result<Option<Arc<Mesh>>> {
        let known = match self.known.entry((mesh, index)) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(Known {
                source: read_local(reader, primitive, owner, budget, report)?,
                made: Vec::new(),
            }),
        };
        let Some((source, has_normals)) = &known.source else {
            return Ok(None);
        };
        warn_of_rounding(source, world_from_node, owner, report);
        let has_area = have_area(source, world_from_node, owner)?;
        self.degenerate += has_area.iter().filter(|has_area| !**has_area).count();
        if !has_area.contains(&true) {
            report.warn(
                owner,
                "has no triangle with an area and was skipped",
                "remove it from the scene",
            );
            return Ok(None);
        }
        let variant = Variant {
            is_split_mirrored: !has_normals && world_from_node.matrix3.determinant() < 0.0,
            stands_at_origin: *world_from_node == DAffine3::IDENTITY,
            has_area,
        };
        if let Some((_, made)) = known.made.iter().find(|(made, _)| *made == variant) {
            return Ok(Some(Arc::clone(made)));
        }
        if !known.made.is_empty() {
            take_copy(source, owner, budget)?;
        }
        let mut mesh = variant.of(source, *has_normals, owner, report);
        if variant.stands_at_origin {
            mesh = mesh.placed(world_from_node);
        }
        let mesh = Arc::new(mesh);
        known.made.push((variant, Arc::clone(&mesh)));
        Ok(Some(mesh))
    }

    /// Forgets a mesh that no other node has.
    pub fn forget(&mut self, mesh: usize) {
        self.known.retain(|(known, _), _| *known != mesh);
    }
}

/// The primitive in its node's coordinates, and whether the file has normals for it.
fn read_local(
    reader: Reader,
    primitive: &Primitive,
    owner: &str,
    budget: &mut Budget,
    report: &mut Report,
) -> Result<Option<(Mesh, bool)>> {
    let Checked::Valid(mode) = primitive.mode else {
        report.warn(
            owner,
            "is of an unknown kind and was skipped",
            "export the file again",
        );
        return Ok(None);
    };
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let Some(positions) = attribute(Semantic::Positions) else {
        report.warn(owner, "has no positions and was skipped", "export the file again");
        return Ok(None);
    };
    let positions: Vec<DVec3> = convert(reader.vectors(positions, Formats::Float, owner, budget)?);
    budget.take(positions.len() as u64 * VERTEX_BYTES, owner)?;
    let vertices = read_vertex_order(reader, primitive, positions.len(), owner, budget)?;
    budget.take(vertices.len() as u64 * TRIANGLE_BYTES, owner)?;
    let Some(triangles) = assemble(&vertices, mode, owner, report) else {
        return Ok(None);
    };
    let normals: Option<Vec<DVec3>> = match attribute(Semantic::Normals) {
        Some(index) => Some(convert(reader.vectors(index, Formats::Float, owner, budget)?)),
        None => None,
    };
    let normals =
        normals.filter(|normals| one_per_vertex(normals.len(), positions.len(), "normals", owner, report));
    let mut uv_sets = [None, None];
    for (set, uvs) in uv_sets.iter_mut().enumerate() {
        if let Some(index) = attribute(Semantic::TexCoords(set as u32)) {
            let read: Vec<DVec2> =
                convert(reader.vectors(index, Formats::FloatOrNormalised, owner, budget)?);
            let fits = one_per_vertex(read.len(), positions.len(), "texture coordinates", owner, report);
            *uvs = fits.then(|| finite_uvs(read, owner, report));
        }
    }
    if primitive
        .attributes
        .contains_key(&Checked::Valid(Semantic::Colors(0)))
    {
        report.warn(
            owner,
            "its vertex colours are ignored",
            "use a base colour texture",
        );
    }
    let [uv0, uv1] = uv_sets;
    let has_normals = normals.is_some();
    let normals = normals.unwrap_or_else(|| vec![DVec3::ZERO; positions.len()]);
    let mesh = Mesh {
        positions,
        normals,
        uv0,
        uv1,
        triangles,
    };
    Ok(Some((mesh, has_normals)))
}

fn convert<const N: usize, T: From<[f64; N]>>(vectors: Vec<[f64; N]>) -> Vec<T> {
    vectors.into_iter().map(T::from).collect()
}

fn read_vertex_order(
    reader: Reader,
    primitive: &Primitive,
    vertex_count: usize,
    owner: &str,
    budget: &mut Budget,
) -> Result<Vec<u32>> {
    let Some(indices) = primitive.indices else {
        let count = u32::try_from(vertex_count)
            .map_err(|_| Error::failure(owner, "has more vertices than glTF allows", "split the mesh"))?;
        return Ok((0..count).collect());
    };
    let vertices = reader.indices(indices, owner, budget)?;
    match vertices.iter().find(|vertex| **vertex as usize >= vertex_count) {
        Some(vertex) => Err(Error::failure(
            owner,
            format!("refers to vertex {vertex}, but has only {vertex_count}"),
            "repair the mesh or export the file again",
        )),
        None => Ok(vertices),
    }
}

fn assemble(vertices: &[u32], mode: Mode, owner: &str, report: &mut Report) -> Option<Vec<[u32; 3]>> {
    let triangles = triangles::assemble(vertices, mode);
    if triangles.is_none() {
        report.warn(
            owner,
            "consists of points or lines and was skipped",
            "only triangles can be lit",
        );
    }
    let left_over = triangles::left_over(vertices.len(), mode);
    if triangles.is_some() && left_over > 0 {
        report.warn(
            owner,
            format!("{left_over} vertices at its end make no triangle and were ignored"),
            "export the file again",
        );
    }
    triangles
}

fn one_per_vertex(count: usize, vertices: usize, what: &str, owner: &str, report: &mut Report) -> bool {
    if count != vertices {
        report.warn(
            owner,
            format!("has {count} {what} for {vertices} vertices; they were ignored"),
            "export the file again",
        );
    }
    count == vertices
}

fn finite_uvs(mut uvs: Vec<DVec2>, owner: &str, report: &mut Report) -> Vec<DVec2> {
    let mut repaired = 0;
    for uv in uvs.iter_mut().filter(|uv| !uv.is_finite()) {
        *uv = DVec2::ZERO;
        repaired += 1;
    }
    if repaired > 0 {
        report.warn(
            owner,
            format!("{repaired} texture coordinates are not finite and were set to 0"),
            "export the file again",
        );
    }
    uvs
}

/// Single precision places vertices to a share of their distance from their node's origin: says so, with the figure,
/// where that is much of the mesh itself.
fn warn_of_rounding(mesh: &Mesh, world_from_node: &DAffine3, owner: &str, report: &mut Report) {
    let Some((low, high)) = mesh.bounds() else {
        return;
    };
    let far = low.abs().max(high.abs()).max_element();
    let rounding = 0.5 * f64::from(f32::EPSILON) * far.log2().floor().exp2();
    let extent = (high - low).max_element();
    // Not finite: refused when it is placed.
    if !(rounding.is_finite() && extent.is_finite() && rounding > LARGEST_ROUNDING * extent) {
        return;
    }
    let linear = world_from_node.matrix3;
    let scale = linear
        .x_axis
        .length()
        .max(linear.y_axis.length())
        .max(linear.z_axis.length());
    report.warn(
        owner,
        format!(
            "its vertices lie {:.1e} m from their node's origin, where single precision rounds them by up to {:.1e} m",
            far * scale,
            rounding * scale
        ),
        "put that distance into the node's translation, which is read in double precision",
    );
}

/// Which triangles have an area in the world.
///
/// # Errors
/// A vertex that is not finite, or too far away.
fn have_area(mesh: &Mesh, world_from_node: &DAffine3, owner: &str) -> Result<Vec<bool>> {
    let mut placed = Vec::with_capacity(mesh.positions.len());
    for (vertex, position) in mesh.positions.iter().enumerate() {
        if !position.is_finite() {
            return Err(Error::failure(
                owner,
                format!("the position of vertex {vertex} is infinite or not a number"),
                "repair the mesh or export the file again",
            ));
        }
        let position = world_from_node.transform_point3(*position);
        if !position.is_finite() || position.abs().max_element() > FARTHEST_M {
            return Err(Error::failure(
                owner,
                format!("vertex {vertex} lies farther than {FARTHEST_M:e} m away"),
                "use metres, or move the scene closer to the origin",
            ));
        }
        placed.push(position);
    }
    let has_area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| placed[vertex as usize]);
        (b - a).cross(c - a).normalize_or_zero() != DVec3::ZERO
    };
    Ok(mesh.triangles.iter().map(has_area).collect())
}

/// Leaves only the vertices of triangles, since others would widen the bounds.
fn drop_unused_vertices(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.positions.len()];
    for vertex in mesh.triangles.iter().flatten() {
        used[*vertex as usize] = true;
    }
    let kept: Vec<usize> = (0..used.len()).filter(|vertex| used[*vertex]).collect();
    if kept.len() == used.len() {
        return;
    }
    let mut renamed = vec![0_u32; used.len()];
    for (new, old) in kept.iter().enumerate() {
        renamed[*old] = new as u32;
    }
    mesh.positions = kept.iter().map(|vertex| mesh.positions[*vertex]).collect();
    mesh.normals = kept.iter().map(|vertex| mesh.normals[*vertex]).collect();
    for uvs in [&mut mesh.uv0, &mut mesh.uv1].into_iter().flatten() {
        *uvs = kept.iter().map(|vertex| uvs[*vertex]).collect();
    }
    for vertex in mesh.triangles.iter_mut().flatten() {
        *vertex = renamed[*vertex as usize];
    }
}

/// How far from 1 [relative] the length of a normal may be before it is worth a word; 8-bit normals stay within it.
const UNIT_TOLERANCE: f64 = 0.02;

/// Splits all corners, so that each triangle has its own normal, as glTF wants where normals are missing.
fn split_corners(mesh: &mut Mesh, is_mirrored: bool) {
    let [second, third] = if is_mirrored { [2, 1] } else { [1, 2] };
    let order: Vec<u32> = mesh
        .triangles
        .iter()
        .flat_map(|corners| [corners[0], corners[second], corners[third]])
        .collect();
    let split = |values: &Option<Vec<_>>| {
        let values = values.as_ref()?;
        Some(order.iter().map(|vertex| values[*vertex as usize]).collect())
    };
    *mesh = Mesh {
        positions: order
            .iter()
            .map(|vertex| mesh.positions[*vertex as usize])
            .collect(),
        normals: vec![DVec3::ZERO; order.len()],
        uv0: split(&mesh.uv0),
        uv1: split(&mesh.uv1),
        triangles: (0..mesh.triangles.len() as u32)
            .map(|t| [3 * t, 3 * t + second as u32, 3 * t + third as u32])
            .collect(),
    };
}

/// Tells of normals that are not unit, and makes those 0 that are nothing.
fn check_normals(mesh: &mut Mesh, owner: &str, report: &mut Report) {
    let (mut replaced, mut rescaled) = (0, 0);
    for normal in &mut mesh.normals {
        let length = normal.length();
        if length > 0.0 && length.is_finite() {
            rescaled += usize::from((length - 1.0).abs() > UNIT_TOLERANCE);
        } else {
            replaced += 1;
            *normal = DVec3::ZERO;
        }
    }
    if replaced > 0 {
        report.warn(
            owner,
            format!("{replaced} normals are zero or not finite and were taken from the triangles"),
            "export the normals again",
        );
    }
    if rescaled > 0 {
        report.warn(
            owner,
            format!("{rescaled} normals are not of length 1 and were brought to it"),
            "export the normals again",
        );
    }
}
