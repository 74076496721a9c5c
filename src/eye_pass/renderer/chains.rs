//! What chains are traced through: the scene's triangles in their hierarchy, made when something specular first comes
//! into view.

use std::sync::Arc;

use glam::DVec3;

use super::bindings::Storage;
use super::bindings::bind_group;
use super::geometry::Geometry;
use super::objects::absorption_per_m;
use super::uniforms::{ChainStart, LightRecord, Node, SeenWavelengths, Triangle, rgb};
use crate::error::{Error, Result};
use crate::eye_pass::View;
use crate::eye_pass::reference::ChainLimits;
use crate::geometry::PackedBvh;
use crate::gpu::Gpu;
use crate::scene::Scene;
use crate::scene::emitter::{Emitter, EmitterKind};
use crate::transport::{MediumStack, Tracer, media_at};

/// Nodes that may wait while a ray is traced; `STACK` in the shader.
const STACK: usize = 64;
/// Largest number of a body that a chain can remember.
const MOST_OBJECTS: usize = u16::MAX as usize - 1;
/// Storage buffers that a fragment of a chain reads.
const BUFFERS: u32 = 8;
/// Surfaces at which both ways on can be followed; `MOST_BRANCHING` in the shader.
pub(super) const MOST_BRANCHING: u32 = 4;

/// The scene as chains see it.
#[derive(Debug)]
pub(super) struct ChainScene {
    /// In double precision: it tells which bodies the eye is in.
    tracer: Tracer,
    centre: DVec3,
    /// Local units per metre.
    scale: f64,
    nodes: Storage,
    triangles: Storage,
    lights: Storage,
    light_count: u32,
    bytes: u64,
}

impl ChainScene {
    /// Builds and uploads the hierarchy; what `before` has of it is not built again.
    ///
    /// # Errors
    /// A scene that is larger than what the device lets a shader read.
    pub(super) fn new(
        gpu: &Gpu,
        scene: &Arc<Scene>,
        geometry: &Geometry,
        before: Option<Self>,
    ) -> Result<Self> {
        let tracer = match before {
            Some(before) => before.tracer.edited(Arc::clone(scene)),
            None => Tracer::new(Arc::clone(scene)),
        };
        check(gpu, scene, geometry)?;
        let packed = tracer.packed();
        check_hierarchy(gpu, scene, &packed)?;
        let corners = places_of_corners(scene, geometry);
        let records = packed.triangles.iter().zip(&packed.corners);
        let records: Vec<Triangle> = records
            .map(|(&order, &[a, b, c])| {
                let (object, first_index) = corners[order as usize];
                Triangle {
                    a,
                    object,
                    b,
                    first_index,
                    c,
                    order,
                }
            })
            .collect();
        let nodes = packed.nodes.iter().map(|node| Node {
            low: node.low,
            first: node.first,
            high: node.high,
            count: node.count,
        });
        let nodes: Vec<Node> = nodes.collect();
        let mut made = Self {
            tracer,
            centre: packed.centre,
            scale: packed.scale,
            nodes: Storage::new(gpu, "nodes"),
            triangles: Storage::new(gpu, "triangles"),
            lights: Storage::new(gpu, "lights"),
            light_count: 0,
            bytes: 0,
        };
        made.bytes = (made.nodes.write(gpu, &nodes) + made.triangles.write(gpu, &records)) as u64;
        Ok(made)
    }

    /// What it takes on the device [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// A place [m] in local coordinates.
    pub(super) fn local(&self, place: DVec3) -> [f32; 3] {
        ((place - self.centre) * self.scale).as_vec3().to_array()
    }

    /// Length of a local unit [m].
    pub(super) fn unit_m(&self) -> f64 {
        1.0 / self.scale
    }

    /// Nodes and triangles.
    pub(super) fn bindings(&self) -> [wgpu::BindingResource<'_>; 2] {
        [self.nodes.binding(), self.triangles.binding()]
    }

    /// Group 1 of what traces; `None` without triangles.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        geometry: &Geometry,
        start: &ChainStart,
        wavelengths: &SeenWavelengths,
    ) -> Option<wgpu::BindGroup> {
        let uniform = |label, contents| gpu.filled_buffer(label, contents, wgpu::BufferUsages::UNIFORM);
        let start = uniform("start of chains", bytemuck::bytes_of(start));
        let wavelengths = uniform("wavelengths", bytemuck::bytes_of(wavelengths));
        let page = geometry.pages.first()?;
        let resources = [
            start.as_entire_binding(),
            self.nodes.binding(),
            self.triangles.binding(),
            page.corners.as_entire_binding(),
            page.map_uvs.as_entire_binding(),
            page.indices.as_entire_binding(),
            self.lights.binding(),
            wavelengths.as_entire_binding(),
        ];
        Some(bind_group(gpu, "chains", layout, resources))
    }

    /// Takes over the lamps of a scene, each as its middle; an environment has none.
    pub(super) fn set_lights(&mut self, gpu: &Gpu, scene: &Scene) {
        let middles = scene
            .lights
            .iter()
            .filter_map(|light| Emitter::middle(light, scene));
        let records: Vec<LightRecord> = middles.map(|middle| self.record(&middle, scene)).collect();
        self.light_count = records.len() as u32;
        self.lights.write(gpu, &records);
    }

    fn record(&self, emitter: &Emitter, scene: &Scene) -> LightRecord {
        let single = |direction: DVec3| direction.as_vec3().to_array();
        let within = match emitter.kind.position() {
            Some(place) => media_at(&self.tracer, place),
            None => MediumStack::default(),
        };
        let record = LightRecord {
            strength: rgb(emitter.strength),
            absorption_per_m: within
                .top()
                .map_or([0.0; 3], |body| absorption_per_m(scene.material_of(body))),
            ior: within.ior(scene) as f32,
            ..Default::default()
        };
        match emitter.kind {
            EmitterKind::Point { position } => LightRecord {
                place: self.local(position),
                kind: 0,
                ..record
            },
            EmitterKind::Spot {
                position,
                direction,
                inner_cone_rad,
                outer_cone_rad,
            } => LightRecord {
                place: self.local(position),
                kind: 1,
                cos_inner: inner_cone_rad.cos() as f32,
                axis: single(direction),
                cos_outer: outer_cone_rad.cos() as f32,
                ..record
            },
            EmitterKind::Parallel { direction } => LightRecord {
                place: single(direction),
                kind: 2,
                ..record
            },
            EmitterKind::Facet { position, normal } => LightRecord {
                place: self.local(position),
                kind: 3,
                axis: single(normal),
                ..record
            },
        }
    }

    /// Where the chains of a view begin; `traces_lights`: whether light straight from the lamps is traced.
    pub(super) fn start(&self, view: &View, limits: &ChainLimits, traces_lights: bool) -> ChainStart {
        let eye = view.camera.position;
        ChainStart {
            eye: self.local(eye),
            unit_m: self.unit_m() as f32,
            media: numbers(&media_at(&self.tracer, eye)),
            near: (view.camera.near_m * self.scale) as f32,
            branch_threshold: limits.branch_threshold as f32,
            max_depth: limits.max_depth,
            branching_depth: limits.branching_depth.min(MOST_BRANCHING),
            light_count: if traces_lights { self.light_count } else { 0 },
            ..Default::default()
        }
    }
}

/// Object and place of the three corner indices of each triangle, object by object.
fn places_of_corners(scene: &Scene, geometry: &Geometry) -> Vec<(u32, u32)> {
    let mut places = Vec::with_capacity(scene.triangle_count());
    for (object, segments) in (0..).zip(&geometry.segments) {
        for segment in segments {
            let firsts = segment.indices.clone().step_by(3);
            places.extend(firsts.map(|first| (object, first)));
        }
    }
    places
}

/// Bodies as `medium.wgsl` has them: innermost first, 16 bits each, object index + 1.
fn numbers(media: &MediumStack) -> [u32; 4] {
    let mut words = [0; 4];
    for (place, object) in media.objects().iter().rev().enumerate() {
        words[place / 2] |= (object + 1) << (16 * (place % 2));
    }
    words
}

/// # Errors
/// A scene that chains cannot be traced through on this device, by what is known before its instances are copied.
fn check(gpu: &Gpu, scene: &Scene, geometry: &Geometry) -> Result<()> {
    let limits = gpu.limits();
    if limits.max_storage_buffers_per_shader_stage < BUFFERS {
        return Err(refused(
            scene,
            format!(
                "the device lets a shader read {} buffers, and chains take {BUFFERS}",
                limits.max_storage_buffers_per_shader_stage
            ),
        ));
    }
    if geometry.pages.len() > 1 {
        return Err(too_many_triangles(gpu, scene));
    }
    check_bytes(gpu, scene, scene.triangle_count() * size_of::<Triangle>())?;
    if scene.objects.len() > MOST_OBJECTS {
        return Err(refused(
            scene,
            format!(
                "{} objects are more than the {MOST_OBJECTS} that chains tell apart",
                scene.objects.len()
            ),
        ));
    }
    Ok(())
}

/// # Errors
/// A hierarchy that chains cannot be traced through on this device.
fn check_hierarchy(gpu: &Gpu, scene: &Scene, packed: &PackedBvh) -> Result<()> {
    check_bytes(gpu, scene, packed.nodes.len() * size_of::<Node>())?;
    if packed.depth >= STACK {
        return Err(refused(
            scene,
            format!(
                "the hierarchy of its triangles is {} levels deep, and chains go through {STACK}",
                packed.depth
            ),
        ));
    }
    Ok(())
}

fn check_bytes(gpu: &Gpu, scene: &Scene, bytes: usize) -> Result<()> {
    if bytes as u64 > readable(gpu) {
        return Err(too_many_triangles(gpu, scene));
    }
    Ok(())
}

/// Bytes that a shader can read of one buffer.
fn readable(gpu: &Gpu) -> u64 {
    let limits = gpu.limits();
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

fn too_many_triangles(gpu: &Gpu, scene: &Scene) -> Error {
    refused(
        scene,
        format!(
            "a shader of the device reads {} KiB at a time, and {} triangles take more",
            readable(gpu) >> 10,
            scene.triangle_count()
        ),
    )
}

fn refused(scene: &Scene, what: String) -> Error {
    Error::failure(
        format!("mirrors and glass of {}", scene.name),
        format!("{what}: they are drawn without what is seen in them"),
        "use a larger graphics device, or `render --backend cpu`",
    )
}
