//! The scene's triangles on the device, in a few large vertex buffers, each below the device's limit. Vertices are in
//! object space; each object's record holds its transform.

use std::collections::HashMap;
use std::mem::offset_of;
use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec2};

use super::paging::Uploaded;
use super::uniforms::ObjectRecord;
use crate::gpu::Gpu;
use crate::illumination::Chart;
use crate::scene::{Material, Mesh, Object, Scene};

/// A corner of a triangle. Triangles of surfaces with a map share no corners, since a map may have a seam along any
/// edge.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Corner {
    /// In mesh coordinates [m].
    position: [f32; 3],
    /// In mesh coordinates, of any length.
    normal: [f32; 3],
    /// TEXCOORD_0 and TEXCOORD_1; 0 if the mesh has none.
    uvs: [[f32; 2]; 2],
    /// Factor of the base colour, in steps of 1/65535; the last channel is unused.
    colour: [u16; 4],
}

/// Map coordinates of a corner, in a separate buffer because they change with the maps.
type MapUv = [f32; 2];

/// The vertex buffers of the surface pipelines.
pub(super) const CORNER_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<Corner>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &[
        attribute(0, offset_of!(Corner, position), wgpu::VertexFormat::Float32x3),
        attribute(1, offset_of!(Corner, normal), wgpu::VertexFormat::Float32x3),
        attribute(2, offset_of!(Corner, uvs), wgpu::VertexFormat::Float32x4),
        attribute(7, offset_of!(Corner, colour), wgpu::VertexFormat::Unorm16x4),
    ],
};
pub(super) const MAP_UV_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<MapUv>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &[attribute(3, 0, wgpu::VertexFormat::Float32x2)],
};

/// Per-instance attributes: the transforms in the objects' records.
pub(super) const OBJECT_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<ObjectRecord>() as u64,
    step_mode: wgpu::VertexStepMode::Instance,
    attributes: &[
        attribute(4, offset_of!(ObjectRecord, row_x), wgpu::VertexFormat::Float32x4),
        attribute(5, offset_of!(ObjectRecord, row_y), wgpu::VertexFormat::Float32x4),
        attribute(6, offset_of!(ObjectRecord, row_z), wgpu::VertexFormat::Float32x4),
    ],
};

pub(super) const fn attribute(
    shader_location: u32,
    offset: usize,
    format: wgpu::VertexFormat,
) -> wgpu::VertexAttribute {
    wgpu::VertexAttribute {
        format,
        offset: offset as u64,
        shader_location,
    }
}

/// Maximum size of a buffer that drivers allocate reliably [bytes]. Chains need the whole scene in one page.
const PAGE_BYTES: u64 = 1 << 30;

/// Part of an object within one page.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Segment {
    pub(super) page: usize,
    /// Range in the page's index buffer.
    pub(super) indices: Range<u32>,
    /// First corner within the page.
    first_corner: usize,
    /// Triangles of the object's mesh.
    pub(super) triangles: Range<usize>,
    /// Whether its corners are the vertices of the mesh, rather than three per triangle.
    shares_corners: bool,
}

/// Corners, their map coordinates, and the indices of triangles.
#[derive(Debug)]
pub(super) struct Page {
    pub(super) corners: wgpu::Buffer,
    pub(super) map_uvs: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
}

#[derive(Debug)]
pub(super) struct Geometry {
    pub(super) pages: Vec<Page>,
    /// By object.
    pub(super) segments: Vec<Vec<Segment>>,
    /// The scene's objects, and what is drawn for each.
    shown: Vec<Object>,
    drawn: Vec<Drawn>,
    /// Charts of the map coordinates, by object.
    pub(super) charts: Vec<Option<Arc<Chart>>>,
}

impl Geometry {
    /// Uploads a scene's triangles; map coordinates are zero at first.
    pub(super) fn new(gpu: &Gpu, scene: &Scene) -> Self {
        let limits = gpu.limits();
        let bindable = limits.max_storage_buffer_binding_size.max(1 << 20);
        let limit = limits.max_buffer_size.min(bindable).min(PAGE_BYTES) as usize;
        let mut packing = Packing {
            gpu,
            // Indices have the same limit in number; as they are smaller, they fit, too.
            page_corners: (limit / size_of::<Corner>()).max(3),
            pages: Vec::new(),
            corners: Vec::new(),
            indices: Vec::new(),
            shared: HashMap::new(),
        };
        let drawn: Vec<Drawn> = scene.objects.iter().map(Drawn::of).collect();
        let segments = (0..).zip(&drawn);
        let segments = segments.map(|(object, drawn)| packing.add(scene.material_of(object), drawn));
        let segments = segments.collect();
        packing.close_page();
        Self {
            pages: packing.pages,
            segments,
            shown: scene.objects.clone(),
            drawn,
            charts: vec![None; scene.objects.len()],
        }
    }

    /// Switches to an edited scene with the same number of objects. If only the shape of a mesh changed, its corners
    /// are written again; if an object needs other corners than it has, everything is uploaded again.
    pub(super) fn set_scene(&mut self, gpu: &Gpu, scene: &Scene) -> Uploaded {
        let (mut can_stay, mut reshaped) = (true, Vec::new());
        for (index, object) in scene.objects.iter().enumerate() {
            let is_receiver = scene.material_of(index).surface.is_receiver();
            let is_shared = self.segments[index].iter().any(|segment| segment.shares_corners);
            can_stay &= !(is_shared && is_receiver);
            if !self.shown[index].stands_as(object) {
                let drawn = Drawn::of(object);
                if !drawn.has_corners_of(&self.drawn[index]) {
                    can_stay &= drawn.fits_corners_of(&self.drawn[index]) && self.is_alone(index);
                    reshaped.push(index);
                }
                self.drawn[index] = drawn;
            }
        }
        if can_stay {
            self.shown.clone_from(&scene.objects);
            let bytes = reshaped.iter().map(|&index| self.write_corners(gpu, index));
            return Uploaded::other(bytes.sum());
        }
        let charts = std::mem::take(&mut self.charts);
        *self = Self::new(gpu, scene);
        let mut uploaded = Uploaded::other(self.bytes());
        for chart in charts.iter().flatten() {
            if chart.corner_uvs.len() == self.shown[chart.object()].mesh().triangles.len() {
                uploaded += self.set_chart(gpu, chart);
            }
        }
        uploaded
    }

    /// Rows of the transform from an object's corners to the scene.
    pub(super) fn rows(&self, object: usize) -> [[f32; 4]; 3] {
        let transform = &self.drawn[object].world_from_mesh;
        [0, 1, 2].map(|row| {
            let row = transform.matrix3.row(row).extend(transform.translation[row]);
            row.as_vec4().to_array()
        })
    }

    /// Whether no other object shares its corners.
    fn is_alone(&self, index: usize) -> bool {
        let own = &self.segments[index];
        self.segments.iter().filter(|segments| *segments == own).count() == 1
    }

    fn write_corners(&self, gpu: &Gpu, index: usize) -> usize {
        let mut bytes = 0;
        for segment in &self.segments[index] {
            let corners = segment.corners(&self.drawn[index]);
            let offset = (segment.first_corner * size_of::<Corner>()) as u64;
            let page = &self.pages[segment.page];
            gpu.queue
                .write_buffer(&page.corners, offset, bytemuck::cast_slice(&corners));
            bytes += size_of_val(corners.as_slice());
        }
        bytes
    }

    fn bytes(&self) -> usize {
        let page_bytes = |page: &Page| page.corners.size() + page.indices.size();
        self.pages.iter().map(page_bytes).sum::<u64>() as usize
    }

    /// Writes the map coordinates of a receiver unless they are there already.
    pub(super) fn set_chart(&mut self, gpu: &Gpu, chart: &Arc<Chart>) -> Uploaded {
        let is_there = |shown: &Arc<Chart>| Arc::ptr_eq(shown, chart) || shown.corner_uvs == chart.corner_uvs;
        if self.charts[chart.object()].as_ref().is_some_and(is_there) {
            return Uploaded::default();
        }
        self.charts[chart.object()] = Some(Arc::clone(chart));
        let mut bytes = 0;
        for segment in &self.segments[chart.object()] {
            let triangles = &chart.corner_uvs[segment.triangles.clone()];
            let uvs: Vec<MapUv> = triangles.iter().flatten().map(|uv| single(*uv)).collect();
            let offset = (segment.first_corner * size_of::<MapUv>()) as u64;
            let page = &self.pages[segment.page];
            gpu.queue
                .write_buffer(&page.map_uvs, offset, bytemuck::cast_slice(&uvs));
            bytes += size_of_val(uvs.as_slice());
        }
        Uploaded::other(bytes)
    }
}

impl Segment {
    fn corners(&self, drawn: &Drawn) -> Vec<Corner> {
        let mesh = &drawn.mesh;
        if self.shares_corners {
            return (0..mesh.positions.len())
                .map(|vertex| corner(mesh, vertex))
                .collect();
        }
        let vertices = self
            .triangles
            .clone()
            .flat_map(|triangle| drawn.triangle(triangle));
        vertices.map(|vertex| corner(mesh, vertex as usize)).collect()
    }
}

/// What is drawn for an object: its mesh, or a copy in scene coordinates if mesh coordinates are not accurate enough in
/// single precision.
#[derive(Clone, Debug)]
struct Drawn {
    mesh: Arc<Mesh>,
    world_from_mesh: DAffine3,
}

impl Drawn {
    fn of(object: &Object) -> Self {
        if object.placement().is_none() || object.can_share() {
            return Self {
                mesh: Arc::clone(object.mesh()),
                world_from_mesh: *object.world_from_object(),
            };
        }
        Self {
            mesh: object.copy_in_scene(),
            world_from_mesh: DAffine3::IDENTITY,
        }
    }

    fn is_mirrored(&self) -> bool {
        self.world_from_mesh.matrix3.determinant() < 0.0
    }

    /// Vertices of a triangle, counter-clockwise in the scene.
    fn triangle(&self, triangle: usize) -> [u32; 3] {
        let [a, b, c] = self.mesh.triangles[triangle];
        if self.is_mirrored() { [a, c, b] } else { [a, b, c] }
    }

    fn has_corners_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh) && self.is_mirrored() == other.is_mirrored()
    }

    /// Whether its corners fit in place of the other's.
    fn fits_corners_of(&self, other: &Self) -> bool {
        self.mesh.positions.len() == other.mesh.positions.len()
            && self.mesh.triangles == other.mesh.triangles
            && self.is_mirrored() == other.is_mirrored()
    }
}

/// Packs corners and indices into pages.
struct Packing<'a> {
    gpu: &'a Gpu,
    page_corners: usize,
    pages: Vec<Page>,
    corners: Vec<Corner>,
    indices: Vec<u32>,
    /// Segments of meshes whose corners all instances share, by mesh and whether it is mirrored.
    shared: HashMap<(*const Mesh, bool), Segment>,
}

impl Packing<'_> {
    /// Adds an object. Surfaces without maps share corners between neighbouring triangles and all instances of their
    /// mesh.
    fn add(&mut self, material: &Material, drawn: &Drawn) -> Vec<Segment> {
        // Without a map there are no seams. A mesh that is larger than a page cannot share its corners.
        let mesh = &*drawn.mesh;
        let largest = mesh.positions.len().max(3 * mesh.triangles.len());
        if !material.surface.is_receiver() && largest <= self.page_corners {
            let key = (Arc::as_ptr(&drawn.mesh), drawn.is_mirrored());
            if let Some(segment) = self.shared.get(&key) {
                return vec![segment.clone()];
            }
            let segment = self.segment(largest, 0..mesh.triangles.len(), true);
            let first = self.corners.len() as u32;
            self.corners.extend(segment.corners(drawn));
            let vertices = (0..mesh.triangles.len()).flat_map(|triangle| drawn.triangle(triangle));
            self.indices.extend(vertices.map(|vertex| first + vertex));
            self.shared.insert(key, segment.clone());
            return vec![segment];
        }

        // All others have three corners per triangle, and continue on the next page where one is full.
        let mut segments = Vec::new();
        let mut triangle = 0;
        while triangle < mesh.triangles.len() {
            let room = (self.page_corners - self.corners.len().max(self.indices.len())) / 3;
            let room = if room == 0 { self.page_corners / 3 } else { room };
            let triangles = triangle..mesh.triangles.len().min(triangle + room);
            triangle = triangles.end;
            let segment = self.segment(3 * triangles.len(), triangles, false);
            let first = self.corners.len() as u32;
            self.corners.extend(segment.corners(drawn));
            self.indices.extend(first..self.corners.len() as u32);
            segments.push(segment);
        }
        segments
    }

    /// The next segment, on a new page if this one has no room for `needed` corners or indices.
    fn segment(&mut self, needed: usize, triangles: Range<usize>, shares_corners: bool) -> Segment {
        if self.corners.len().max(self.indices.len()) + needed > self.page_corners {
            self.close_page();
        }
        let first_index = self.indices.len() as u32;
        Segment {
            page: self.pages.len(),
            indices: first_index..first_index + 3 * triangles.len() as u32,
            first_corner: self.corners.len(),
            triangles,
            shares_corners,
        }
    }

    fn close_page(&mut self) {
        if self.indices.is_empty() {
            return;
        }
        let shared = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let filled = |label, contents, usage| self.gpu.filled_buffer(label, contents, usage | shared);
        self.pages.push(Page {
            corners: filled(
                "corners",
                bytemuck::cast_slice(&self.corners),
                wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            ),
            indices: filled(
                "indices",
                bytemuck::cast_slice(&self.indices),
                wgpu::BufferUsages::INDEX,
            ),
            map_uvs: self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("map coordinates"),
                size: (self.corners.len() * size_of::<MapUv>()) as u64,
                usage: shared | wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        });
        self.corners.clear();
        self.indices.clear();
    }
}

fn single(uv: DVec2) -> [f32; 2] {
    uv.as_vec2().to_array()
}

fn corner(mesh: &Mesh, vertex: usize) -> Corner {
    let uv = |set: &Option<Vec<DVec2>>| single(set.as_ref().map_or(DVec2::ZERO, |uvs| uvs[vertex]));
    let colour = mesh.colours.as_ref().map_or([1.0; 3], |colours| colours[vertex]);
    let [red, green, blue] = colour.map(|channel| (channel * f32::from(u16::MAX)).round() as u16);
    Corner {
        position: mesh.positions[vertex].as_vec3().to_array(),
        normal: mesh.normals[vertex].as_vec3().to_array(),
        uvs: [uv(&mesh.uv0), uv(&mesh.uv1)],
        colour: [red, green, blue, u16::MAX],
    }
}
