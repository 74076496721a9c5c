//! Packs the hierarchies of a scene for devices: in single precision, one per mesh, below one over all instances. The
//! result depends on where objects stand, not on how they came there.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::Tracer;
use super::hierarchy::{Hierarchy, Instance};
use crate::geometry::PackedBvh;
use crate::geometry::bvh::{BOX_MARGIN, Frame};

/// Triangles on a device: a shared mesh in its own coordinates, or placed triangles in local ones.
#[derive(Debug)]
pub struct PackedMesh {
    pub bvh: PackedBvh,
    /// Object and triangle within it, by slot. No object where the mesh is instanced or the object was moved.
    pub owners: Vec<(Option<u32>, u32)>,
}

/// A placed mesh.
#[derive(Debug)]
pub struct PackedInstance {
    /// Index into the scene's objects; `None` where the mesh's triangles are in local coordinates already.
    pub object: Option<u32>,
    /// Index into [`Tracer::packed_meshes`].
    pub mesh: usize,
    /// From the mesh's coordinates to local ones.
    pub from_mesh: DAffine3,
    /// From local coordinates to those of the mesh's nodes.
    pub to_nodes: DAffine3,
    /// Margin added to boxes, in coordinates of the nodes: covers the rounding of the ray transform.
    pub margin: f32,
}

impl PackedMesh {
    fn new(bvh: PackedBvh, owner: impl Fn(u32) -> (Option<u32>, u32)) -> Self {
        let owners = bvh.triangles.iter().map(|&triangle| owner(triangle)).collect();
        Self { bvh, owners }
    }
}

impl Tracer {
    /// Frame of the local coordinates on devices.
    pub fn frame(&self) -> &Frame {
        &self.hierarchy().frame
    }

    /// Whether both have the same device meshes, except for the placement of [`moved_meshes`](Self::moved_meshes).
    pub fn has_meshes_of(&self, other: &Self) -> bool {
        let (a, b) = (self.hierarchy(), other.hierarchy());
        let meshes = |hierarchy: &'_ Hierarchy| hierarchy.meshes.iter().map(Arc::as_ptr).collect::<Vec<_>>();
        Arc::ptr_eq(&a.copied, &b.copied)
            && (&a.moved, &a.frame, meshes(a)) == (&b.moved, &b.frame, meshes(b))
    }

    /// Device meshes: the triangles of all copied objects that were not moved, the meshes of instances, and
    /// [`moved_meshes`](Self::moved_meshes).
    pub fn packed_meshes(&self) -> Vec<PackedMesh> {
        let hierarchy = self.hierarchy();
        let copied = PackedMesh::new(hierarchy.copied.bvh.packed(&hierarchy.frame), |triangle| {
            let (object, triangle) = hierarchy.copied.triangles[triangle as usize];
            let is_there = !hierarchy.is_moved(object as usize);
            (is_there.then_some(object), triangle)
        });
        let shared = hierarchy.meshes.iter();
        let shared = shared
            .map(|mesh| PackedMesh::new(mesh.bvh.packed(mesh.bvh.frame()), |triangle| (None, triangle)));
        std::iter::once(copied)
            .chain(shared)
            .chain(self.moved_meshes())
            .collect()
    }

    /// Meshes of the objects that were moved since they were copied: nodes in coordinates of the mesh, triangles in
    /// local ones.
    pub fn moved_meshes(&self) -> Vec<PackedMesh> {
        let Hierarchy { instances, frame, .. } = self.hierarchy();
        let packed = |instance: &Instance| {
            let mesh = &instance.shared.bvh;
            let mut bvh = mesh.packed(mesh.frame());
            for (slot, corners) in (0..).zip(&mut bvh.corners) {
                let local = |corner: DVec3| frame.local(corner).as_vec3().to_array();
                *corners = instance.placed(mesh.corners(slot)).map(local);
            }
            PackedMesh::new(bvh, |triangle| (Some(instance.object), triangle))
        };
        let is_moved = |instance: &&Instance| self.hierarchy().is_moved(instance.object as usize);
        instances.iter().filter(is_moved).map(packed).collect()
    }

    /// Instances, by slot of the hierarchy over them.
    pub fn packed_instances(&self) -> (PackedBvh, Vec<PackedInstance>) {
        let hierarchy = self.hierarchy();
        let frame = &hierarchy.frame;
        let above = hierarchy.above.packed(frame);
        let placed = above.triangles.iter().map(|&place| {
            let instance = &hierarchy.instances[place as usize];
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
            let moved = hierarchy.moved.binary_search(&(instance.object as usize));
            PackedInstance {
                object: moved.is_err().then_some(instance.object),
                mesh: 1 + moved.map_or(instance.mesh, |moved| hierarchy.meshes.len() + moved),
                from_mesh,
                to_nodes,
                margin: BOX_MARGIN * reach as f32,
            }
        });
        let placed = placed.collect();
        (above, placed)
    }
}
