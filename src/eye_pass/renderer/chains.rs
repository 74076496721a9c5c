//! Buffers that chains are traced through: the triangle hierarchy of each mesh, and the instances above them. Created
//! when a specular surface first comes into view.

use std::sync::Arc;

use glam::DVec3;

use super::bindings::Storage;
use super::bindings::bind_group;
use super::geometry::{Geometry, Segment};
use super::objects::absorption_per_m;
use super::uniforms::{ChainStart, LightRecord, Node, SeenWavelengths, Triangle};
use super::web::Content;
use crate::error::{Error, Result};
use crate::eye_pass::View;
use crate::eye_pass::highlights::{self, Outline};
use crate::eye_pass::reference::ChainLimits;
use crate::geometry::PackedNode;
use crate::geometry::bvh::Frame;
use crate::gpu::Gpu;
use crate::scene::emitter::Emitter;
use crate::scene::{Light, Object, Scene};
use crate::transport::{MediumStack, PackedInstance, PackedMesh, Tracer, media_at};

/// Capacity of the traversal stack; `STACK` in the shader.
const STACK: usize = 64;
/// Maximum number of objects, since the shader stores a medium in 16 bits.
const MAX_OBJECTS: usize = u16::MAX as usize - 1;
/// Storage buffers that a fragment shader of chains reads.
const BUFFERS: u32 = 8;
/// `count` of a node that is an instance; `INSTANCE` in the shader.
const INSTANCE: u32 = u32::MAX;
/// Stands for no object; `NO_OBJECT` in the shader.
const NO_OBJECT: u32 = u32::MAX;
/// Nodes that one instance occupies.
const INSTANCE_NODES: usize = 4;
/// Maximum number of surfaces at which both branches are followed; `MAX_BRANCHING` in the shader.
pub(super) const MAX_BRANCHING: u32 = 4;

/// The scene as chains are traced through it.
#[derive(Debug)]
pub(super) struct ChainScene {
    /// Finds the media around the eye and the lights, in double precision.
    tracer: Tracer,
    /// By object.
    firsts: Vec<First>,
    /// First node and triangle of each mesh.
    starts: Vec<(usize, usize)>,
    /// Root over everything that is not instanced, if there is any.
    root: Option<Node>,
    /// Largest depth of the hierarchy of any mesh.
    depth: usize,
    /// Nodes over instances and the instances come first; they are written again when something moves.
    nodes: Storage,
    triangles: Storage,
    lights: Storage,
    light_count: u32,
    lobe_lamp_count: u32,
    bytes: u64,
}

impl ChainScene {
    /// Builds and uploads the hierarchies. If `before` has the same meshes, only what has moved is uploaded.
    ///
    /// # Errors
    /// A scene that exceeds the device's limits.
    pub(super) fn new(
        gpu: &Gpu,
        scene: &Arc<Scene>,
        geometry: &Geometry,
        before: Option<Self>,
    ) -> Result<Self> {
        let tracer = match &before {
            Some(before) => before.tracer.edited(Arc::clone(scene)),
            None => Tracer::new(Arc::clone(scene)),
        };
        check(gpu, scene, geometry)?;
        let firsts = firsts(scene, geometry);
        let known = before.filter(|before| before.firsts == firsts && tracer.has_meshes_of(&before.tracer));
        let mut made = match known {
            Some(before) => Self { tracer, ..before },
            None => Self::with_meshes(gpu, tracer, firsts)?,
        };
        made.write_instances(gpu)?;
        Ok(made)
    }

    fn with_meshes(gpu: &Gpu, tracer: Tracer, firsts: Vec<First>) -> Result<Self> {
        // Instances and the nodes over them come first: when objects move, these nodes are written again and no others.
        let (above, _) = tracer.packed_instances();
        let mut nodes = vec![Node::default(); 3 + above.nodes.len() + INSTANCE_NODES * above.triangles.len()];
        let mut triangles: Vec<Triangle> = Vec::new();
        let (mut starts, mut depth) = (Vec::new(), 0);

        // Each mesh is stored once, however many instances it has, with its indices offset to its place in the buffers.
        let meshes = tracer.packed_meshes();
        for mesh in &meshes {
            let start = (nodes.len(), triangles.len());
            starts.push(start);
            depth = depth.max(mesh.bvh.depth);
            nodes.extend(mesh.bvh.nodes.iter().map(|node| placed(node, start)));
            triangles.extend(records(mesh, &firsts));
        }

        // Shaders see a buffer through one binding, whose size is limited.
        let largest = size_of_val(nodes.as_slice()).max(size_of_val(triangles.as_slice()));
        if largest as u64 > readable(gpu) {
            return Err(too_many_triangles(gpu, tracer.scene()));
        }

        // The front of the nodes is filled by `write_instances`, which is called after each move, too.
        let mut made = Self {
            firsts,
            root: meshes[0].bvh.nodes.first().map(|root| placed(root, starts[0])),
            starts,
            depth,
            nodes: Storage::new(gpu, "nodes"),
            triangles: Storage::new(gpu, "triangles"),
            lights: Storage::new(gpu, "lights"),
            light_count: 0,
            lobe_lamp_count: 0,
            bytes: 0,
            tracer,
        };
        made.bytes = (made.nodes.write(gpu, &nodes) + made.triangles.write(gpu, &triangles)) as u64;
        Ok(made)
    }

    /// Uploads instances and moved triangles, with the hierarchy above them.
    ///
    /// # Errors
    /// A hierarchy that is too deep.
    fn write_instances(&mut self, gpu: &Gpu) -> Result<()> {
        // The shader drops branches that its stack cannot hold: surfaces of a deeper hierarchy would be missing.
        let (above, instances) = self.tracer.packed_instances();
        let depth = 2 + above.depth + self.depth;
        if depth >= STACK {
            let what = format!(
                "the hierarchy of its triangles is {depth} levels deep, and at most {STACK} can be traversed"
            );
            return Err(refused(self.tracer.scene(), what));
        }

        // Each leaf of the hierarchy over instances holds one of them, whose record follows that hierarchy.
        let first = 3 + above.nodes.len();
        let over_instances = |node: &PackedNode| match node.count {
            0 => placed(node, (3, 0)),
            _ => Node {
                first: (first + INSTANCE_NODES * node.first as usize) as u32,
                count: INSTANCE,
                ..placed(node, (0, 0))
            },
        };

        // The root joins what is not instanced with the instances. Where one of them is missing, the other is the root.
        // The box of the root is never tested, so that it may be empty.
        let both = Node {
            first: 1,
            ..Node::default()
        };
        let mut nodes = match (self.root, above.nodes.first().map(over_instances)) {
            (Some(root), Some(above)) => vec![both, root, above],
            (root, above) => vec![root.or(above).unwrap_or_default(); 3],
        };

        // The indices above assume this order: the root with two children, the hierarchy over instances, the instances.
        nodes.extend(above.nodes.iter().map(over_instances));
        nodes.extend(instances.iter().flat_map(|instance| self.instance(instance)));
        self.nodes.write_at(gpu, 0, &nodes);

        // Objects that were moved have their triangles in local coordinates, which change with each move.
        let moved = self.tracer.moved_meshes();
        let starts = &self.starts[self.starts.len() - moved.len()..];
        for (mesh, &(_, start)) in moved.iter().zip(starts) {
            let records: Vec<Triangle> = records(mesh, &self.firsts).collect();
            self.triangles.write_at(gpu, start, &records);
        }
        Ok(())
    }

    /// An instance in the layout that `instance_at` in the shader reads.
    fn instance(&self, instance: &PackedInstance) -> [Node; INSTANCE_NODES] {
        let object = instance.object.map(|object| object as usize);
        let First { index, order } = object.map_or(First::default(), |object| self.firsts[object]);
        let root = self.starts[instance.mesh].0 as u32;
        let is_mirrored = instance.from_mesh.matrix3.determinant() < 0.0;
        let places = [instance.to_nodes, instance.from_mesh].map(|place| place.to_cols_array_2d());
        let [a, b] = places.map(|columns| columns.map(|column| column.map(|entry| entry as f32)));
        let columns = [[a[0], a[1]], [a[2], a[3]], [b[0], b[1]], [b[2], b[3]]];
        let words = [
            [root, instance.object.unwrap_or(NO_OBJECT)],
            [index, order],
            [instance.margin.to_bits(), u32::from(is_mirrored)],
            [0, 0],
        ];
        std::array::from_fn(|node| Node {
            low: columns[node][0],
            first: words[node][0],
            high: columns[node][1],
            count: words[node][1],
        })
    }

    /// Device memory [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// A position [m] in local coordinates.
    pub(super) fn local(&self, place: DVec3) -> [f32; 3] {
        self.tracer.frame().local(place).as_vec3().to_array()
    }

    /// Length of a local unit [m].
    pub(super) fn unit_m(&self) -> f64 {
        1.0 / self.tracer.frame().scale
    }

    /// What nodes, triangles and lamps hold, by name. Triangles of the scene come without their corners, which their
    /// indices tell, and nodes of meshes without boxes, which their triangles tell.
    pub(super) fn contents_without_corners(&self) -> [(&'static str, Content); 3] {
        let mut triangles: Vec<Triangle> = bytemuck::pod_collect_to_vec(self.triangles.bytes());
        for triangle in triangles
            .iter_mut()
            .filter(|triangle| triangle.object != NO_OBJECT)
        {
            let none = [0.0; 3];
            (triangle.a, triangle.b, triangle.c) = (none, none, none);
            // Numbers that mostly follow from each other.
            triangle.order = triangle.order.wrapping_mul(3).wrapping_sub(triangle.first_index);
        }
        let mut nodes: Vec<Node> = bytemuck::pod_collect_to_vec(self.nodes.bytes());
        for node in &mut nodes[self.first_mesh_node()..] {
            (node.low, node.high) = ([0.0; 3], [0.0; 3]);
        }
        let lights: Vec<LightRecord> = bytemuck::pod_collect_to_vec(self.lights.bytes());
        [
            ("nodes", Content::records(&nodes)),
            ("triangles", Content::records(&triangles)),
            ("lights", Content::records(&lights)),
        ]
    }

    /// The first node of a mesh: all from there on are of meshes.
    pub(super) fn first_mesh_node(&self) -> usize {
        self.starts[0].0
    }

    /// Local coordinates.
    pub(super) fn frame(&self) -> &Frame {
        self.tracer.frame()
    }

    pub(super) fn bindings(&self) -> [wgpu::BindingResource<'_>; 2] {
        [self.nodes.binding(), self.triangles.binding()]
    }

    /// Group 1 of pipelines that trace; `None` without triangles.
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

    /// Uploads the lamps of a scene, whose direct light comes from their centres, and those that are highlights alone. Of an
    /// environment, only its suns are among these.
    pub(super) fn set_lights(&mut self, gpu: &Gpu, scene: &Scene) {
        let record = |light: &Light| {
            let record = self.record(&Emitter::middle(light, scene)?, scene);
            Some(record.outlined(Outline::of(light), self.unit_m()))
        };
        let mut records: Vec<LightRecord> = scene.lights.iter().filter_map(record).collect();
        let lights = records.len();
        let in_lobes = highlights::lamps_in_lobes(scene);
        records.extend(in_lobes.iter().filter_map(|(_, lamp)| record(lamp)));
        self.light_count = lights as u32;
        self.lobe_lamp_count = (records.len() - lights) as u32;
        self.lights.write(gpu, &records);
    }

    fn record(&self, emitter: &Emitter, scene: &Scene) -> LightRecord {
        let within = match emitter.kind.position() {
            Some(place) => media_at(&self.tracer, place),
            None => MediumStack::default(),
        };
        LightRecord {
            absorption_per_m: within
                .top()
                .map_or([0.0; 3], |body| absorption_per_m(scene.material_of(body))),
            ior: within.ior(scene) as f32,
            ..LightRecord::of(emitter, |place| self.local(place))
        }
    }

    /// Start of the chains of a view.
    pub(super) fn start(&self, view: &View, limits: &ChainLimits) -> ChainStart {
        let eye = view.camera.position;
        ChainStart {
            eye: self.local(eye),
            unit_m: self.unit_m() as f32,
            media: numbers(&media_at(&self.tracer, eye)),
            near: (view.camera.near_m / self.unit_m()) as f32,
            branch_threshold: limits.branch_threshold as f32,
            max_depth: limits.max_depth,
            branching_depth: limits.branching_depth.min(MAX_BRANCHING),
            light_count: self.light_count,
            lobe_lamp_count: self.lobe_lamp_count,
            ..Default::default()
        }
    }
}

/// Offsets of the triangle numbers of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct First {
    /// Position of the indices of its corners.
    index: u32,
    /// Order of its first triangle among all triangles of the scene.
    order: u32,
}

/// By object. The triangles of each object must lie in a single page.
fn firsts(scene: &Scene, geometry: &Geometry) -> Vec<First> {
    let mut order = 0;
    let objects = scene.objects.iter().zip(&geometry.segments);
    let first = |(object, segments): (&Object, &Vec<Segment>)| {
        let first = First {
            index: segments.first().map_or(0, |segment| segment.indices.start),
            order,
        };
        order += object.mesh().triangles.len() as u32;
        first
    };
    objects.map(first).collect()
}

/// A node of a mesh, offset by the mesh's first node and triangle.
fn placed(node: &PackedNode, (first_node, first_triangle): (usize, usize)) -> Node {
    let first = if node.count > 0 {
        first_triangle
    } else {
        first_node
    };
    Node {
        low: node.low,
        first: first as u32 + node.first,
        high: node.high,
        count: node.count,
    }
}

/// Triangles of a mesh, in the order of the leaves.
fn records(mesh: &PackedMesh, firsts: &[First]) -> impl Iterator<Item = Triangle> {
    let slots = mesh.owners.iter().zip(&mesh.bvh.corners);
    slots.map(move |(&(object, triangle), &[a, b, c])| {
        let first = object.map_or(First::default(), |object| firsts[object as usize]);
        Triangle {
            a,
            object: object.unwrap_or(NO_OBJECT),
            b,
            first_index: first.index + 3 * triangle,
            c,
            order: first.order + triangle,
        }
    })
}

/// Media in the layout of `medium.wgsl`: innermost first, 16 bits each, object index + 1.
fn numbers(media: &MediumStack) -> [u32; 4] {
    let mut words = [0; 4];
    for (place, object) in media.objects().iter().rev().enumerate() {
        words[place / 2] |= (object + 1) << (16 * (place % 2));
    }
    words
}

/// Checks the limits that are known before anything is built.
///
/// # Errors
/// A scene that exceeds the device's limits.
fn check(gpu: &Gpu, scene: &Scene, geometry: &Geometry) -> Result<()> {
    let (buffers, objects) = (
        gpu.limits().max_storage_buffers_per_shader_stage,
        scene.objects.len(),
    );
    if buffers < BUFFERS {
        let what = format!("the device allows a shader {buffers} buffers, and {BUFFERS} are needed");
        return Err(refused(scene, what));
    }
    if geometry.pages.len() > 1 || u32::try_from(scene.triangle_count()).is_err() {
        return Err(too_many_triangles(gpu, scene));
    }
    if objects > MAX_OBJECTS {
        let what = format!("{objects} objects are more than the {MAX_OBJECTS} that it can tell apart");
        return Err(refused(scene, what));
    }
    Ok(())
}

/// Bytes of one buffer that a shader can read.
fn readable(gpu: &Gpu) -> u64 {
    let limits = gpu.limits();
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

fn too_many_triangles(gpu: &Gpu, scene: &Scene) -> Error {
    let (kib, count) = (readable(gpu) >> 10, scene.triangle_count());
    let what = format!("a buffer of the device holds at most {kib} KiB, and {count} triangles take more");
    refused(scene, what)
}

fn refused(scene: &Scene, what: String) -> Error {
    Error::failure(
        format!("mirrors and glass of {}", scene.name),
        format!("{what}: they are drawn without reflections and refractions"),
        "use a larger graphics device, or `render --backend cpu`",
    )
}
