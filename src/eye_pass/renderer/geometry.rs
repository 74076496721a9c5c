//! The scene's triangles on the device: few large vertex buffers, each below the device's limit.

use bytemuck::{Pod, Zeroable};
use glam::DVec2;
use wgpu::util::DeviceExt;

use crate::gpu::Gpu;
use crate::illumination::Chart;
use crate::scene::{Object, Scene};

/// A corner of a triangle, unindexed: maps may cut a surface between any two triangles.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Corner {
    /// Scene coordinates [m].
    position: [f32; 3],
    /// Unit.
    normal: [f32; 3],
    /// Of the base colour texture, KHR_texture_transform applied.
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

/// Largest vertex buffer [bytes]: one allocation that every driver serves.
const PAGE_BYTES: u64 = 128 << 20;

/// Part of an object within one page.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Which page.
    pub(super) page: usize,
    /// First corner within the page.
    pub(super) first_corner: u32,
    /// First triangle of the object's mesh.
    first_triangle: usize,
    /// Triangles.
    triangles: usize,
}

impl Segment {
    /// Corners within the page.
    pub(super) fn corners(&self) -> std::ops::Range<u32> {
        self.first_corner..self.first_corner + 3 * self.triangles as u32
    }
}

/// Two buffers of equally many corners.
#[derive(Debug)]
pub(super) struct Page {
    pub(super) corners: wgpu::Buffer,
    pub(super) map_uvs: wgpu::Buffer,
}

/// All triangles of a scene.
#[derive(Debug)]
pub(super) struct Geometry {
    pub(super) pages: Vec<Page>,
    /// One list per object of the scene.
    pub(super) segments: Vec<Vec<Segment>>,
}

impl Geometry {
    /// Uploads a scene's triangles; map coordinates are zero at first.
    pub(super) fn new(gpu: &Gpu, scene: &Scene) -> Self {
        let limit = gpu.limits().max_buffer_size.min(PAGE_BYTES);
        let page_triangles = (limit / (3 * size_of::<Corner>() as u64)).max(1) as usize;
        let mut geometry = Self {
            pages: Vec::new(),
            segments: Vec::with_capacity(scene.objects.len()),
        };
        let mut pending: Vec<Corner> = Vec::new();
        for object in &scene.objects {
            let texture = &scene.materials[object.material].base_colour_texture;
            let mut segments = Vec::new();
            let mut first_triangle = 0;
            while first_triangle < object.mesh.triangles.len() {
                if pending.len() == 3 * page_triangles {
                    geometry.push_page(gpu, &pending);
                    pending.clear();
                }
                let room = page_triangles - pending.len() / 3;
                let triangles = room.min(object.mesh.triangles.len() - first_triangle);
                segments.push(Segment {
                    page: geometry.pages.len(),
                    first_corner: pending.len() as u32,
                    first_triangle,
                    triangles,
                });
                for triangle in first_triangle..first_triangle + triangles {
                    pending.extend(corners(object, texture.as_ref(), triangle));
                }
                first_triangle += triangles;
            }
            geometry.segments.push(segments);
        }
        if !pending.is_empty() {
            geometry.push_page(gpu, &pending);
        }
        geometry
    }

    fn push_page(&mut self, gpu: &Gpu, corners: &[Corner]) {
        self.pages.push(Page {
            corners: gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("corners"),
                contents: bytemuck::cast_slice(corners),
                usage: wgpu::BufferUsages::VERTEX,
            }),
            map_uvs: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("map coordinates"),
                size: (corners.len() * size_of::<MapUv>()) as u64,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        });
    }

    /// Writes the map coordinates of one object.
    pub(super) fn set_chart(&self, gpu: &Gpu, chart: &Chart) {
        for segment in &self.segments[chart.object] {
            let triangles =
                &chart.corner_uvs[segment.first_triangle..segment.first_triangle + segment.triangles];
            let uvs: Vec<MapUv> = triangles.iter().flatten().map(|uv| single(*uv)).collect();
            let offset = u64::from(segment.first_corner) * size_of::<MapUv>() as u64;
            gpu.queue.write_buffer(
                &self.pages[segment.page].map_uvs,
                offset,
                bytemuck::cast_slice(&uvs),
            );
        }
    }
}

fn single(uv: DVec2) -> [f32; 2] {
    uv.as_vec2().to_array()
}

fn corners(object: &Object, texture: Option<&crate::scene::TextureRef>, triangle: usize) -> [Corner; 3] {
    let mesh = &object.mesh;
    mesh.triangles[triangle].map(|vertex| {
        let vertex = vertex as usize;
        let uv = texture.and_then(|texture| {
            let set = if texture.uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
            set.as_ref().map(|uvs| texture.transform(uvs[vertex]))
        });
        Corner {
            position: mesh.positions[vertex].as_vec3().to_array(),
            normal: mesh.normals[vertex].as_vec3().to_array(),
            uv: single(uv.unwrap_or_default()),
        }
    })
}
