//! The hierarchies of a scene as devices traverse them: in single precision, each mesh by itself, below one over all that
//! stands in the scene. What devices see in them does not tell how objects came to where they are.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::Tracer;
use super::hierarchy::{Hierarchy, Instance, SharedMesh};
use crate::geometry::bvh::{BOX_MARGIN, Frame};
use crate::geometry::{BoxBvh, PackedBvh, PackedNode};

/// Triangles on a device: a mesh in its own coordinates, or what stands somewhere in local ones.
#[derive(Debug)]
pub struct PackedMesh {
    /// Their hierarchy.
    pub bvh: PackedBvh,
    /// Object and triangle within it, slot by slot. Without an object where the mesh has instances, or where that was moved
    /// away.
    pub owners: Vec<(Option<u32>, u32)>,
}

/// A mesh where it stands.
#[derive(Debug)]
pub struct PackedInstance {
    /// Index into the scene's objects; `None` where the mesh is local already.
    pub object: Option<u32>,
    /// Index into the meshes.
    pub mesh: usize,
    /// From coordinates of the mesh to local ones.
    pub from_mesh: DAffine3,
    /// From local ones to those of the mesh's nodes.
    pub to_nodes: DAffine3,
    /// By which boxes have to be widened, in coordinates of the nodes: what rounding on the way there moves rays.
    pub margin: f32,
}

impl Tracer {
    /// Local coordinates of devices.
    pub fn frame(&self) -> &Frame {
        &self.hierarchy().frame
    }

    /// Whether both have the same meshes for devices, but for where [`moved_meshes`](Self::moved_meshes) are.
    pub fn has_meshes_of(&self, other: &Self) -> bool {
        let (a, b) = (self.hierarchy(), other.hierarchy());
        let meshes = |hierarchy| shared(hierarchy).into_iter().map(Arc::as_ptr);
        let is_same = || Arc::ptr_eq(&a.copied, &b.copied) && (&a.moved, &a.frame) == (&b.moved, &b.frame);
        is_same() && meshes(a).eq(meshes(b))
    }

    /// The meshes of the scene: all objects that stand where they were found and are no instances, the meshes of
    /// instances, and [`moved_meshes`](Self::moved_meshes).
    pub fn packed_meshes(&self) -> Vec<PackedMesh> {
        let Hierarchy { copied, frame, .. } = self.hierarchy();
        let bvh = copied.bvh.packed(frame);
        let owner = |&triangle: &u32| {
            let (object, triangle) = copied.triangles[triangle as usize];
            let is_there = !self.hierarchy().is_moved(object);
            (is_there.then_some(object), triangle)
        };
        let copied = PackedMesh {
            owners: bvh.triangles.iter().map(owner).collect(),
            bvh,
        };
        let shared = shared(self.hierarchy()).into_iter().map(|mesh| {
            let bvh = mesh.bvh.packed(mesh.bvh.frame());
            PackedMesh {
                owners: bvh.triangles.iter().map(|&triangle| (None, triangle)).collect(),
                bvh,
            }
        });
        let moved = self.moved_meshes();
        std::iter::once(copied).chain(shared).chain(moved).collect()
    }

    /// What was moved away from where it was found: nodes in coordinates of its mesh, triangles in local ones.
    pub fn moved_meshes(&self) -> Vec<PackedMesh> {
        let Hierarchy { instances, frame, .. } = self.hierarchy();
        let moved = instances
            .iter()
            .filter(|instance| self.hierarchy().is_moved(instance.object));
        let packed = |instance: &Instance| {
            let mesh = &instance.shared.bvh;
            let mut bvh = mesh.packed(mesh.frame());
            for (slot, corners) in (0..).zip(&mut bvh.corners) {
                let local = |corner: DVec3| frame.local(corner).as_vec3().to_array();
                *corners = instance.placed(mesh.corners(slot)).map(local);
            }
            let owner = |&triangle: &u32| (Some(instance.object), triangle);
            PackedMesh {
                owners: bvh.triangles.iter().map(owner).collect(),
                bvh,
            }
        };
        moved.map(packed).collect()
    }

    /// Where the meshes stand, the first one first, and nodes over them.
    pub fn packed_instances(&self) -> (Vec<PackedNode>, Vec<PackedInstance>) {
        let Hierarchy {
            copied,
            instances,
            frame,
            ..
        } = self.hierarchy();
        let all = PackedInstance {
            object: None,
            mesh: 0,
            from_mesh: DAffine3::IDENTITY,
            to_nodes: DAffine3::IDENTITY,
            margin: 0.0,
        };
        let meshes = shared(self.hierarchy()).into_iter().map(Arc::as_ptr);
        let meshes: HashMap<_, usize> = meshes.zip(1..).collect();
        let mut moved = 1 + meshes.len()..;
        let placed = instances.iter().map(|instance| {
            let own = instance.shared.bvh.frame();
            let placement = instance.placement.as_ref();
            let world = placement.map_or(DAffine3::IDENTITY, |placement| *placement.world_from_object());
            let from_mesh = DAffine3 {
                matrix3: world.matrix3 * (frame.scale / own.scale),
                translation: frame.local(world.transform_point3(own.centre)),
            };
            let to_nodes = from_mesh.inverse();
            let entries = to_nodes.matrix3.to_cols_array();
            let stretch = entries.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
            let reach = 2.0 * stretch + to_nodes.translation.length();
            let own_mesh = self.hierarchy().is_moved(instance.object).then(|| moved.next());
            PackedInstance {
                object: own_mesh.is_none().then_some(instance.object),
                mesh: own_mesh
                    .flatten()
                    .unwrap_or_else(|| meshes[&Arc::as_ptr(&instance.shared)]),
                from_mesh,
                to_nodes,
                margin: BOX_MARGIN * reach as f32,
            }
        });
        let placed: Vec<PackedInstance> = std::iter::once(all).chain(placed).collect();
        let copied = copied.bvh.root().map(|node| node.bounds());
        let first = u32::from(copied.is_none());
        let bounds = instances.iter().map(|instance| instance.bounds);
        let boxes = copied.into_iter().chain(bounds).map(<[DVec3; 2]>::from);
        let mut nodes = BoxBvh::within(&boxes.collect::<Vec<_>>(), *frame).packed();
        for leaf in nodes.iter_mut().filter(|node| node.count > 0) {
            leaf.first += first;
        }
        (nodes, placed)
    }
}

/// Each mesh of instances once, but for what was moved.
fn shared(hierarchy: &Hierarchy) -> Vec<&Arc<SharedMesh>> {
    let mut known = HashSet::new();
    let instances = hierarchy.instances.iter();
    instances
        .filter(|instance| !hierarchy.is_moved(instance.object))
        .map(|instance| &instance.shared)
        .filter(|shared| known.insert(Arc::as_ptr(shared)))
        .collect()
}
