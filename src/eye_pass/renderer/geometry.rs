//! The scene's triangles on the device: few large vertex buffers, each below the device's limit.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::DVec2;

use super::paging::Uploaded;
use crate::gpu::Gpu;
use crate::illumination::Chart;
use crate::scene::{Mesh, Object, Scene, TextureRef};

/// A corner of a triangle. Surfaces with a map share none between triangles, since maps may cut them anywhere.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Corner {
    /// Scene coordinates [m].
    position: [f32; 3],
    /// Unit.
    normal: [f32; 3],
    /// Of the material's images, KHR_texture_transform applied.
    uv: [f32; 2],
}

/// Map coordinates of a corner: they change with the maps.
type MapUv = [f32; 2];

/// The two vertex buffers of the surface pipelines.
pub(super) const CORNER_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<Corner>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &[
        attribute(
            0,
            std::mem::offset_of!(Corner, position),
            wgpu::VertexFormat::Float32x3,
        ),
        attribute(
            1,
            std::mem::offset_of!(Corner, normal),
            wgpu::VertexFormat::Float32x3,
        ),
        attribute(2, std::mem::offset_of!(Corner, uv), wgpu::VertexFormat::Float32x2),
    ],
};
pub(super) const MAP_UV_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<MapUv>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &[attribute(3, 0, wgpu::VertexFormat::Float32x2)],
};

const fn attribute(shader_location: u32, offset: usize, format: wgpu::VertexFormat) -> wgpu::VertexAttribute {
    wgpu::VertexAttribute {
        format,
        offset: offset as u64,
        shader_location,
    }
}

/// Largest buffer [bytes]: one allocation that drivers serve. Chains need all of a scene in one page.
const PAGE_BYTES: u64 = 1 << 30;

/// Part of an object within one page.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    /// Which page.
    pub(super) page: usize,
    /// Where the page's indices draw it.
    pub(super) indices: Range<u32>,
    /// First corner within the page.
    first_corner: usize,
    /// Triangles of the object's mesh.
    pub(super) triangles: Range<usize>,
    /// Whether its corners are the mesh's vertices; else three for each triangle.
    shares_corners: bool,
}

/// Corners with as many map coordinates, and which three of them make a triangle.
#[derive(Debug)]
pub(super) struct Page {
    pub(super) corners: wgpu::Buffer,
    pub(super) map_uvs: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
}

/// All triangles of a scene.
#[derive(Debug)]
pub(super) struct Geometry {
    pub(super) pages: Vec<Page>,
    /// One list per object of the scene.
    pub(super) segments: Vec<Vec<Segment>>,
    /// What the corners show, object by object.
    shown: Vec<Object>,
    /// Where the map coordinates come from, object by object.
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
            // Indices are smaller than corners, and never more of them are allowed.
            page_corners: (limit / size_of::<Corner>()).max(3),
            pages: Vec::new(),
            corners: Vec::new(),
            indices: Vec::new(),
        };
        let segments = scene
            .objects
            .iter()
            .map(|object| packing.add(scene, object))
            .collect();
        packing.close_page();
        Self {
            pages: packing.pages,
            segments,
            shown: scene.objects.clone(),
            charts: vec![None; scene.objects.len()],
        }
    }

    /// Takes over an edited scene with as many objects. Corners of moved objects are written again; where an object
    /// needs others than it has, everything is uploaded anew.
    pub(super) fn set_scene(&mut self, gpu: &Gpu, scene: &Scene) -> Uploaded {
        let changed = (0..scene.objects.len()).filter(|index| self.is_changed(scene, *index));
        let changed: Vec<usize> = changed.collect();
        if changed.iter().all(|index| self.can_hold(scene, *index)) {
            let bytes = changed.iter().map(|index| self.write_corners(gpu, scene, *index));
            let bytes = bytes.sum();
            self.shown.clone_from(&scene.objects);
            return Uploaded::other(bytes);
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

    fn is_changed(&self, scene: &Scene, index: usize) -> bool {
        !self.shown[index].stands_as(&scene.objects[index]) || !self.can_hold(scene, index)
    }

    /// Whether an object's corners have the places that it needs: maps may cut a receiver anywhere.
    fn can_hold(&self, scene: &Scene, index: usize) -> bool {
        let (old, new) = (&self.shown[index], &scene.objects[index]);
        let has_same_shape = old.stands_as(new)
            || (old.mesh().positions.len() == new.mesh().positions.len()
                && old.in_scene().triangles().eq(new.in_scene().triangles()));
        let is_shared = self.segments[index].iter().any(|segment| segment.shares_corners);
        has_same_shape && !(is_shared && scene.material_of(index).surface.is_receiver())
    }

    fn write_corners(&self, gpu: &Gpu, scene: &Scene, index: usize) -> usize {
        let object = &scene.objects[index];
        let image = scene.material_of(index).coordinates();
        let mut bytes = 0;
        for segment in &self.segments[index] {
            let corners = segment.corners(&object.copy_in_scene(), image);
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

    /// Writes the map coordinates of one object, which takes light, unless they are there already.
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
    fn corners(&self, mesh: &Mesh, image: Option<&TextureRef>) -> Vec<Corner> {
        if self.shares_corners {
            return (0..mesh.positions.len())
                .map(|vertex| corner(mesh, image, vertex))
                .collect();
        }
        let vertices = mesh.triangles[self.triangles.clone()].iter().flatten();
        vertices
            .map(|vertex| corner(mesh, image, *vertex as usize))
            .collect()
    }
}

/// Fills page after page.
struct Packing<'a> {
    gpu: &'a Gpu,
    page_corners: usize,
    pages: Vec<Page>,
    corners: Vec<Corner>,
    indices: Vec<u32>,
}

impl Packing<'_> {
    /// Where an object ended up. Surfaces without maps share the corners of neighbouring triangles.
    fn add(&mut self, scene: &Scene, object: &Object) -> Vec<Segment> {
        let material = &scene.materials[object.material];
        let image = material.coordinates();
        let mesh = &*object.copy_in_scene();
        let largest = mesh.positions.len().max(3 * mesh.triangles.len());
        if !material.surface.is_receiver() && largest <= self.page_corners {
            let segment = self.segment(largest, 0..mesh.triangles.len(), true);
            let first = self.corners.len() as u32;
            self.corners.extend(segment.corners(mesh, image));
            self.indices
                .extend(mesh.triangles.iter().flatten().map(|vertex| first + vertex));
            return vec![segment];
        }
        let mut segments = Vec::new();
        let mut triangle = 0;
        while triangle < mesh.triangles.len() {
            let room = (self.page_corners - self.corners.len().max(self.indices.len())) / 3;
            let room = if room == 0 { self.page_corners / 3 } else { room };
            let triangles = triangle..mesh.triangles.len().min(triangle + room);
            triangle = triangles.end;
            let segment = self.segment(3 * triangles.len(), triangles, false);
            let first = self.corners.len() as u32;
            self.corners.extend(segment.corners(mesh, image));
            self.indices.extend(first..self.corners.len() as u32);
            segments.push(segment);
        }
        segments
    }

    /// The segment that comes next, on a new page where this one has no room for so many corners or indices.
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
        let filled = |label, contents, usage| self.gpu.filled_buffer(label, contents, usage);
        self.pages.push(Page {
            corners: filled(
                "corners",
                bytemuck::cast_slice(&self.corners),
                wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            ),
            indices: filled(
                "indices",
                bytemuck::cast_slice(&self.indices),
                wgpu::BufferUsages::INDEX | wgpu::BufferUsages::STORAGE,
            ),
            map_uvs: self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("map coordinates"),
                size: (self.corners.len() * size_of::<MapUv>()) as u64,
                usage: wgpu::BufferUsages::VERTEX
                    | wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::COPY_DST,
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

fn corner(mesh: &Mesh, image: Option<&TextureRef>, vertex: usize) -> Corner {
    // Without an image they are looked at, but nothing is looked up by them.
    let uv = match image {
        Some(image) => {
            let set = if image.uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
            set.as_ref().map(|uvs| image.transform(uvs[vertex]))
        }
        None => mesh.uv0.as_ref().map(|uvs| uvs[vertex]),
    };
    Corner {
        position: mesh.positions[vertex].as_vec3().to_array(),
        normal: mesh.normals[vertex].as_vec3().to_array(),
        uv: single(uv.unwrap_or_default()),
    }
}
