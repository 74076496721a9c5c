//! Primitives of meshes, as triangles.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3, DVec4};
use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{Formats, Reader};
use super::context::{LoadContext, damaged};
use super::pose::{Poses, PrimitiveInstance};
use super::{draco, pose};
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::scene::Mesh;

/// Limit of the coordinates of vertices [m]: beyond it, squares and volumes are too inexact to be of use.
const FARTHEST_M: f64 = 1e12;

/// Largest rounding of vertices relative to the extent of their mesh that needs no warning [1].
const LARGEST_ROUNDING: f64 = 1e-5;

/// Memory of a vertex, a triangle and a vertex colour while they are read [bytes].
const VERTEX_BYTES: u64 = 2 * 80;
const TRIANGLE_BYTES: u64 = 2 * 12;
const COLOUR_BYTES: u64 = 2 * 12;

/// Reserves the memory of one more copy of a mesh.
///
/// # Errors
/// Too little is left.
pub fn take_copy(mesh: &Mesh, owner: &str, load: &mut LoadContext) -> Result<()> {
    load.take(mesh.positions.len() as u64 * VERTEX_BYTES, owner)?;
    load.take(3 * mesh.triangles.len() as u64 * TRIANGLE_BYTES, owner)
}

/// Primitives read so far; nodes with the same mesh share them.
#[derive(Debug, Default)]
pub struct Primitives {
    /// By mesh, primitive and, if the node deforms the mesh by itself, node.
    known: HashMap<(usize, usize, Option<usize>), KnownPrimitive>,
    /// Number of triangles without area.
    pub degenerate: usize,
}

#[derive(Debug)]
struct KnownPrimitive {
    /// `None` if it has no triangles.
    source: Option<Local>,
    /// Meshes made of it for objects. Rounding in the transform decides which triangles have an area.
    made: Vec<(Variant, Arc<Mesh>)>,
}

/// A primitive as stored in the file.
#[derive(Debug)]
struct Local {
    mesh: Mesh,
    has_normals: bool,
    /// Whether its positions are stored in single precision.
    is_rounded: bool,
    factors: VertexFactors,
}

/// What the vertex colours of a whole primitive multiply.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexFactors {
    /// Uniform colour or area-weighted mean; white without colours, or if the mesh has them per vertex.
    pub colour: LinearSrgb,
    /// Area-weighted mean of the alpha, [0, 1].
    pub alpha: f64,
}

/// Source data of primitives.
#[derive(Clone, Copy, Debug)]
pub struct PrimitiveSource<'a> {
    pub reader: Reader<'a>,
    /// Morph targets and skins.
    pub poses: &'a Poses,
    /// World transforms of nodes, by glTF index.
    pub stands: &'a HashMap<usize, DAffine3>,
}

/// Properties in which two meshes of one primitive differ.
#[derive(Debug, PartialEq)]
struct Variant {
    has_area: Vec<bool>,
    /// Whether split corners are in the order of mirrored triangles, as in the scene.
    is_split_mirrored: bool,
    /// Whether the transform is the identity; the mesh then has unit normals and is also that of the scene.
    stands_at_origin: bool,
}

impl Variant {
    /// Mesh of a primitive, without triangles and vertices that would not be seen.
    fn of(&self, source: &Mesh, has_normals: bool, owner: &str, load: &mut LoadContext) -> Mesh {
        let mut mesh = source.clone();
        let mut has_area = self.has_area.iter();
        mesh.triangles.retain(|_| has_area.next() == Some(&true));
        if has_normals {
            drop_unused_vertices(&mut mesh);
            check_normals(&mut mesh, owner, load);
        } else {
            split_corners(&mut mesh, self.is_split_mirrored);
        }
        mesh
    }
}

impl Primitives {
    /// Triangles of a primitive, in coordinates that `world_from_node` maps to the world, and the factors of their
    /// vertex colours. Colours that vary are kept in the mesh if it `has_colours`, and averaged otherwise. `None`, with
    /// a warning, if no triangle has an area there.
    ///
    /// # Errors
    /// Positions that are not finite or too far away, indices of missing vertices, broken accessors.
    pub fn read(
        &mut self,
        source: PrimitiveSource,
        (place, primitive, has_colours): (PrimitiveInstance, &Primitive, bool),
        world_from_node: &DAffine3,
        owner: &str,
        load: &mut LoadContext,
    ) -> Result<Option<(Arc<Mesh>, VertexFactors)>> {
        // Nodes share the source data of a mesh, but for those that bend it by a skin or weights of their own.
        let deformed_by = source.poses.is_own(place.node).then_some(place.node);
        let known = match self.known.entry((place.mesh, place.primitive, deformed_by)) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(entry) => {
                let local = read_local(source, (place, primitive, has_colours), owner, load)?;
                entry.insert(KnownPrimitive {
                    source: local,
                    made: Vec::new(),
                })
            }
        };

        // The transform decides how far rounding moves vertices, and which triangles have an area.
        let Some(local) = &known.source else {
            return Ok(None);
        };
        let (source, has_normals) = (&local.mesh, local.has_normals);
        if local.is_rounded {
            warn_of_rounding(source, world_from_node, owner, load);
        }
        let has_area = have_area(source, world_from_node, owner)?;
        self.degenerate += has_area.iter().filter(|has_area| !**has_area).count();
        if !has_area.contains(&true) {
            load.warn(
                owner,
                "has no triangle with an area and was skipped",
                "remove it from the scene",
            );
            return Ok(None);
        }

        // Nodes under which the same triangles are left share one mesh in memory.
        let variant = Variant {
            is_split_mirrored: !has_normals && world_from_node.matrix3.determinant() < 0.0,
            stands_at_origin: *world_from_node == DAffine3::IDENTITY,
            has_area,
        };
        if let Some((_, made)) = known.made.iter().find(|(made, _)| *made == variant) {
            return Ok(Some((Arc::clone(made), local.factors)));
        }

        // The memory of the first mesh was reserved on reading; each further one is a copy.
        if !known.made.is_empty() {
            take_copy(source, owner, load)?;
        }
        let mut mesh = variant.of(source, has_normals, owner, load);
        if variant.stands_at_origin {
            mesh = mesh.placed(world_from_node);
        }
        let mesh = Arc::new(mesh);
        known.made.push((variant, Arc::clone(&mesh)));
        Ok(Some((mesh, local.factors)))
    }

    /// Drops a mesh that no further node has.
    pub fn forget(&mut self, mesh: usize) {
        self.known.retain(|(known, ..), _| *known != mesh);
    }
}

/// Vertex attributes of a primitive.
struct Vertices<'a> {
    reader: Reader<'a>,
    primitive: &'a Primitive,
    unpacked: Option<draco::Unpacked>,
    owner: &'a str,
}

impl Vertices<'_> {
    fn index(&self, semantic: Semantic) -> Option<Index<Accessor>> {
        self.primitive.attributes.get(&Checked::Valid(semantic)).copied()
    }

    /// An attribute; `None` if the primitive does not have it.
    fn read<const N: usize>(
        &self,
        semantic: Semantic,
        formats: Formats,
        load: &mut LoadContext,
    ) -> Result<Option<Vec<[f64; N]>>> {
        let Some(index) = self.index(semantic.clone()) else {
            return Ok(None);
        };
        let unpacked = self.unpacked.as_ref().filter(|unpacked| unpacked.has(&semantic));
        let Some(unpacked) = unpacked else {
            return self.reader.vectors(index, formats, self.owner, load).map(Some);
        };
        let accessor = self.reader.root.accessors.get(index.value());
        let is_normalised = accessor.is_some_and(|accessor| accessor.normalized);
        let read = unpacked.vectors(&semantic, is_normalised);
        let what = || format!("its Draco data has no {} of {N} numbers", semantic.to_string());
        read.map(Some).ok_or_else(|| damaged(self.owner, what()))
    }

    /// An attribute of every vertex; `None` if it is missing or, with a warning, has another number of values.
    fn one_each<const N: usize, T: From<[f64; N]>>(
        &self,
        (semantic, what): (Semantic, &str),
        formats: Formats,
        count: usize,
        load: &mut LoadContext,
    ) -> Result<Option<Vec<T>>> {
        let read = self.read(semantic, formats, load)?;
        let fits = read.filter(|read| one_per_vertex(read.len(), count, what, self.owner, load));
        Ok(fits.map(convert))
    }

    /// The mesh with morph targets and skin applied, in the file's rest pose.
    fn deformed(
        &self,
        source: PrimitiveSource,
        place: PrimitiveInstance,
        mesh: &Mesh,
        load: &mut LoadContext,
    ) -> Result<Mesh> {
        let PrimitiveSource {
            reader,
            poses,
            stands,
        } = source;
        let mut deformed = mesh.clone();
        poses.morph(place, &mut deformed, reader, self.owner, load)?;
        if poses.has_skin(place.node) {
            let mut influences = Vec::new();
            for set in 0.. {
                let joints = self.read(Semantic::Joints(set), Formats::Index, load)?;
                let weights = self.read(Semantic::Weights(set), Formats::FloatOrShare, load)?;
                let Some(both) = joints.zip(weights) else {
                    break;
                };
                influences.push(both);
            }
            let joints = poses.joints(place.node, stands, reader, self.owner, load)?;
            pose::apply_skin(&mut deformed, &joints, &influences, self.owner)?;
        }
        Ok(deformed)
    }

    fn order(&self, vertex_count: usize, load: &mut LoadContext) -> Result<Vec<u32>> {
        let owner = self.owner;
        let vertices = match (&self.unpacked, self.primitive.indices) {
            (Some(unpacked), _) => unpacked.indices(),
            (None, Some(indices)) => self.reader.indices(indices, owner, load)?,
            (None, None) => {
                let count = u32::try_from(vertex_count).map_err(|_| {
                    Error::failure(owner, "has more vertices than glTF allows", "split the mesh")
                })?;
                return Ok((0..count).collect());
            }
        };
        match vertices.iter().find(|vertex| **vertex as usize >= vertex_count) {
            Some(vertex) => Err(damaged(
                owner,
                format!("refers to vertex {vertex}, but has only {vertex_count}"),
            )),
            None => Ok(vertices),
        }
    }

    /// Area-weighted mean of the colours and, if they vary, the colours themselves.
    fn colours(&self, mesh: &Mesh, load: &mut LoadContext) -> Result<Option<Colours>> {
        let Some(index) = self.index(Semantic::Colors(0)) else {
            return Ok(None);
        };
        load.take(mesh.positions.len() as u64 * COLOUR_BYTES, self.owner)?;

        // Colours without alpha are opaque.
        let has_alpha = self.reader.root.accessors.get(index.value()).is_some_and(
            |accessor| matches!(accessor.type_, Checked::Valid(shape) if shape.multiplicity() == 4),
        );
        let (which, formats) = ((Semantic::Colors(0), "colours"), Formats::FloatOrShare);
        let count = mesh.positions.len();
        let colours: Option<Vec<DVec4>> = if has_alpha {
            self.one_each::<4, DVec4>(which, formats, count, load)?
        } else {
            let colours = self.one_each::<3, DVec3>(which, formats, count, load)?;
            colours.map(|colours| colours.into_iter().map(|colour| colour.extend(1.0)).collect())
        };
        let Some(colours) = colours else {
            return Ok(None);
        };

        // Weights by area give the mean albedo of the surface, however finely its parts are tessellated.
        let (mut sum, mut area) = (DVec4::ZERO, 0.0);
        for (triangle, corners) in mesh.triangles.iter().enumerate() {
            let weight = mesh.triangle_area_m2(triangle);
            let of_triangle = corners
                .iter()
                .map(|vertex| colours[*vertex as usize])
                .sum::<DVec4>();
            sum += of_triangle / 3.0 * weight;
            area += weight;
        }
        let mean = sum / area;
        if !mean.is_finite() {
            return Ok(None);
        }
        let mean = mean.clamp(DVec4::ZERO, DVec4::ONE);
        // Rounded, so that a uniform colour is independent of the averaging and white stays white.
        let mean = (mean / COLOUR_STEP).round() * COLOUR_STEP;

        // Colours that vary stay with the vertices, as albedos in [0, 1]; of the alpha, only the mean is used.
        let differs = |colour: &DVec4| colour.truncate().distance(mean.truncate()) > SAME_COLOUR;
        let varies = colours.iter().any(differs);
        let linear = |colour: &DVec4| {
            let colour = colour.truncate().clamp(DVec3::ZERO, DVec3::ONE);
            colour.as_vec3().to_array()
        };
        Ok(Some(Colours {
            mean: VertexFactors {
                colour: mean.truncate().to_array().into(),
                alpha: mean.w,
            },
            has_alphas: colours
                .iter()
                .any(|colour| (colour.w - mean.w).abs() > SAME_COLOUR),
            of_vertices: varies.then(|| colours.iter().map(linear).collect()),
        }))
    }
}

struct Colours {
    mean: VertexFactors,
    /// Whether the alpha varies.
    has_alphas: bool,
    /// `None` if they are uniform.
    of_vertices: Option<Vec<[f32; 3]>>,
}

/// Largest distance from the mean at which vertex colours count as uniform.
const SAME_COLOUR: f64 = 1e-3;

/// Step to which mean colours are rounded, a power of 2.
const COLOUR_STEP: f64 = 1.0 / 1_048_576.0;

/// Reads a primitive in its node's coordinates.
fn read_local(
    source: PrimitiveSource,
    (place, primitive, has_colours): (PrimitiveInstance, &Primitive, bool),
    owner: &str,
    load: &mut LoadContext,
) -> Result<Option<Local>> {
    let Checked::Valid(mode) = primitive.mode else {
        load.warn_damaged(owner, "is of an unknown kind and was skipped");
        return Ok(None);
    };

    // Without positions there is nothing to trace.
    let reader = source.reader;
    let vertices = Vertices {
        reader,
        primitive,
        unpacked: draco::unpack(reader, primitive, owner, load)?,
        owner,
    };
    let Some(positions) = vertices.read(Semantic::Positions, Formats::Float, load)? else {
        load.warn_damaged(owner, "has no positions and was skipped");
        return Ok(None);
    };
    let positions: Vec<DVec3> = convert(positions);
    let count = positions.len();

    // The budget is asked as soon as the numbers of vertices and corners are known.
    load.take(count as u64 * VERTEX_BYTES, owner)?;
    let order = vertices.order(count, load)?;
    load.take(order.len() as u64 * TRIANGLE_BYTES, owner)?;

    // Draco data hold triangles, whatever mode the primitive states.
    let mode = if vertices.unpacked.is_some() {
        Mode::Triangles
    } else {
        mode
    };
    let Some(triangles) = assemble(&order, mode, owner, load) else {
        return Ok(None);
    };

    // Attributes that differ in number from the positions are left out; the mesh stays.
    let normals: Option<Vec<DVec3>> =
        vertices.one_each((Semantic::Normals, "normals"), Formats::Float, count, load)?;
    let mut uv_sets = [None, None];
    for (set, uvs) in uv_sets.iter_mut().enumerate() {
        let which = (Semantic::TexCoords(set as u32), "texture coordinates");
        let read = vertices.one_each(which, Formats::FloatOrShare, count, load)?;
        *uvs = read.map(|read| finite_uvs(read, owner, load));
    }
    let [uv0, uv1] = uv_sets;

    // A normal of 0 stands for one to be computed from the triangles.
    let has_normals = normals.is_some();
    let mut mesh = Mesh {
        normals: normals.unwrap_or_else(|| vec![DVec3::ZERO; count]),
        positions,
        uv0,
        uv1,
        colours: None,
        triangles,
    };

    // Vertex colours that cannot be read leave the base colour as it is.
    let colours = vertices.colours(&mesh, load).unwrap_or_else(|error| {
        load.warn(
            error.location,
            format!("{}; its colours were left out", error.what),
            error.remedy,
        );
        None
    });
    let none = VertexFactors {
        colour: LinearSrgb::WHITE,
        alpha: 1.0,
    };
    let mut factors = colours.as_ref().map_or(none, |colours| colours.mean);
    if colours.as_ref().is_some_and(|colours| colours.has_alphas) {
        load.warn(
            owner,
            "the alpha of its vertex colours was read as its mean",
            "use the alpha of a base colour texture",
        );
    }

    // Only diffuse surfaces are tinted per vertex, all others by the mean. Colours that stay in the mesh leave a white
    // factor to the material, which would apply them twice otherwise.
    if let Some(of_vertices) = colours.and_then(|colours| colours.of_vertices) {
        if has_colours {
            (factors.colour, mesh.colours) = (LinearSrgb::WHITE, Some(of_vertices));
        } else {
            load.warn(
                owner,
                "its vertex colours were read as their mean, as it is not diffuse",
                "use a base colour texture",
            );
        }
    }

    // A morph target or skin that does not fit leaves the mesh undeformed.
    if source.poses.is_deformed(place) {
        match vertices.deformed(source, place, &mesh, load) {
            Ok(deformed) => mesh = deformed,
            Err(error) => load.warn(
                error.location,
                format!("{}; it was left as it is", error.what),
                error.remedy,
            ),
        }
    }

    // Writers round floats; quantised positions are integers and exact.
    let positions = vertices.index(Semantic::Positions);
    Ok(Some(Local {
        mesh,
        has_normals,
        is_rounded: positions.is_some_and(|index| reader.has_floats(index)),
        factors,
    }))
}

fn convert<const N: usize, T: From<[f64; N]>>(vectors: Vec<[f64; N]>) -> Vec<T> {
    vectors.into_iter().map(T::from).collect()
}

/// Triangles of `vertices` under a mode, with the winding of the specification; `None`, with a warning, for points and
/// lines. Left-over vertices are dropped.
fn assemble(vertices: &[u32], mode: Mode, owner: &str, load: &mut LoadContext) -> Option<Vec<[u32; 3]>> {
    let windows = vertices.windows(3).enumerate();
    let short = if vertices.len() < 3 { vertices.len() } else { 0 };
    let (triangles, left_over): (Vec<_>, _) = match mode {
        Mode::Triangles => (vertices.as_chunks().0.to_vec(), vertices.len() % 3),
        // Every second triangle of a strip has reversed winding.
        Mode::TriangleStrip => (
            windows
                .map(|(index, w)| [w[0], w[1 + index % 2], w[2 - index % 2]])
                .collect(),
            short,
        ),
        Mode::TriangleFan => (
            windows
                .map(|(index, _)| [vertices[index + 1], vertices[index + 2], vertices[0]])
                .collect(),
            short,
        ),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
            let what = "consists of points or lines and was skipped";
            load.warn(owner, what, "only triangles can be lit");
            return None;
        }
    };
    if left_over > 0 {
        let what = format!("{left_over} vertices at its end make no triangle and were ignored");
        load.warn_damaged(owner, what);
    }
    Some(triangles)
}

fn one_per_vertex(count: usize, vertices: usize, what: &str, owner: &str, load: &mut LoadContext) -> bool {
    if count != vertices {
        load.warn_damaged(
            owner,
            format!("has {count} {what} for {vertices} vertices; they were ignored"),
        );
    }
    count == vertices
}

fn finite_uvs(mut uvs: Vec<DVec2>, owner: &str, load: &mut LoadContext) -> Vec<DVec2> {
    let mut repaired = 0;
    for uv in uvs.iter_mut().filter(|uv| !uv.is_finite()) {
        *uv = DVec2::ZERO;
        repaired += 1;
    }
    if repaired > 0 {
        load.warn_damaged(
            owner,
            format!("{repaired} texture coordinates are not finite and were set to 0"),
        );
    }
    uvs
}

/// Warns if single precision rounds vertices, in proportion to their distance from the node's origin, by much relative
/// to the size of the mesh; states the rounding error.
fn warn_of_rounding(mesh: &Mesh, world_from_node: &DAffine3, owner: &str, load: &mut LoadContext) {
    let Some((low, high)) = mesh.bounds() else {
        return;
    };
    let far = low.abs().max(high.abs()).max_element();
    let rounding = 0.5 * f64::from(f32::EPSILON) * far.log2().floor().exp2();
    let extent = (high - low).max_element();
    // If not finite, the mesh is refused on placement.
    if !(rounding.is_finite() && extent.is_finite() && rounding > LARGEST_ROUNDING * extent) {
        return;
    }
    let linear = world_from_node.matrix3;
    let scale = linear
        .x_axis
        .length()
        .max(linear.y_axis.length())
        .max(linear.z_axis.length());
    load.warn(
        owner,
        format!(
            "its vertices lie {:.1e} m from their node's origin, where single precision rounds them by up to {:.1e} m",
            far * scale,
            rounding * scale
        ),
        "put that distance into the node's translation, which is read in double precision",
    );
}

/// Which triangles have an area in world coordinates.
///
/// # Errors
/// A vertex that is not finite, or too far away.
fn have_area(mesh: &Mesh, world_from_node: &DAffine3, owner: &str) -> Result<Vec<bool>> {
    let mut placed = Vec::with_capacity(mesh.positions.len());
    for (vertex, position) in mesh.positions.iter().enumerate() {
        if !position.is_finite() {
            return Err(damaged(
                owner,
                format!("the position of vertex {vertex} is infinite or not a number"),
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

/// A mesh of other triangles over the given vertices of a mesh.
fn gathered(mesh: &Mesh, vertices: &[u32], triangles: Vec<[u32; 3]>) -> Mesh {
    fn pick<T: Copy>(values: &[T], vertices: &[u32]) -> Vec<T> {
        vertices.iter().map(|vertex| values[*vertex as usize]).collect()
    }
    let uvs = |uvs: &Option<Vec<DVec2>>| uvs.as_ref().map(|uvs| pick(uvs, vertices));
    Mesh {
        positions: pick(&mesh.positions, vertices),
        normals: pick(&mesh.normals, vertices),
        uv0: uvs(&mesh.uv0),
        uv1: uvs(&mesh.uv1),
        colours: mesh.colours.as_ref().map(|colours| pick(colours, vertices)),
        triangles,
    }
}

/// Drops vertices without triangles, since these would widen the bounds.
fn drop_unused_vertices(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.positions.len()];
    for vertex in mesh.triangles.iter().flatten() {
        used[*vertex as usize] = true;
    }
    let kept: Vec<u32> = (0..)
        .zip(&used)
        .filter_map(|(vertex, used)| used.then_some(vertex))
        .collect();
    if kept.len() == used.len() {
        return;
    }
    let mut renamed = vec![0; used.len()];
    for (new, old) in (0..).zip(&kept) {
        renamed[*old as usize] = new;
    }
    let triangles = mesh.triangles.iter();
    let triangles = triangles.map(|corners| corners.map(|vertex| renamed[vertex as usize]));
    *mesh = gathered(mesh, &kept, triangles.collect());
}

/// Largest deviation of a normal's length from 1 that needs no warning [1]; 8-bit normals stay within it.
const UNIT_TOLERANCE: f64 = 0.02;

/// Splits all corners for flat shading, which glTF requires where normals are missing.
fn split_corners(mesh: &mut Mesh, is_mirrored: bool) {
    let [second, third] = if is_mirrored { [2, 1] } else { [1, 2] };
    let order: Vec<u32> = mesh
        .triangles
        .iter()
        .flat_map(|corners| [corners[0], corners[second], corners[third]])
        .collect();
    let (second, third) = (second as u32, third as u32);
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + second, 3 * t + third]);
    *mesh = gathered(mesh, &order, triangles.collect());
    mesh.normals.fill(DVec3::ZERO);
}

/// Warns of normals that are not unit length, and sets invalid ones to 0.
fn check_normals(mesh: &mut Mesh, owner: &str, load: &mut LoadContext) {
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
        load.warn(
            owner,
            format!("{replaced} normals are zero or not finite and were taken from the triangles"),
            "export the normals again",
        );
    }
    if rescaled > 0 {
        load.warn(
            owner,
            format!("{rescaled} normals are not of length 1 and were brought to it"),
            "export the normals again",
        );
    }
}
