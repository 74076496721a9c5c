//! Objects: a mesh with a transform and a material.

use std::fmt;
use std::sync::{Arc, OnceLock};

use glam::{DAffine3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::mesh::{InScene, Placement};
use super::{Mesh, Scene, instances, watertight};

/// One mesh primitive of one node: the unit that has a material and, if light reaches it, an illumination map.
#[derive(Clone, Debug)]
pub struct Object {
    /// Name of the node in the file; `nodeN` without one.
    pub name: String,
    /// glTF index of the node.
    pub node: usize,
    /// Index of the primitive within the node's mesh.
    pub primitive: usize,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Index of the object that stands for the body of glass that several objects bound together.
    pub body: Option<usize>,
    shape: Shape,
}

/// A mesh and its place in the scene.
#[derive(Clone, Debug)]
struct Shape {
    /// Shared between instances, and between a scene and its edited copies.
    mesh: Arc<Mesh>,
    /// From mesh to scene coordinates, as loaded.
    at_rest: DAffine3,
    motion: Motion,
    /// Centre of the motion's rotation [m].
    pivot: DVec3,
    world_from_object: DAffine3,
    /// `None` if the transform is the identity.
    placement: Option<Placement>,
    found: Arc<Found>,
}

/// Derived data, computed on first use.
#[derive(Default)]
struct Found {
    /// The mesh in scene coordinates.
    mesh: OnceLock<Arc<Mesh>>,
    bounds: OnceLock<Option<(DVec3, DVec3)>>,
    can_share: OnceLock<bool>,
    is_closed: OnceLock<bool>,
}

impl fmt::Debug for Found {
    /// Omits the values, so that equal objects print the same whether or not these have been computed.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Found").finish_non_exhaustive()
    }
}

impl Shape {
    fn settle(&mut self) {
        let is_moved = self.world_from_object != DAffine3::IDENTITY;
        self.placement = is_moved.then(|| Placement::new(self.world_from_object));
        self.found = Arc::default();
    }
}

/// Motion of a node since loading: a rotation about the centre of its bounding box, then a translation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// [m]
    pub translation: DVec3,
}

/// Largest x and z part of a quaternion that still counts as a rotation about the vertical.
const TILT: f64 = 1e-5;
/// Steps to which angles are rounded [1/rad], so that an angle reads back as it was typed.
const STEPS: f64 = 1e9;

impl Motion {
    /// Rotation about the vertical, from z towards x [rad], and translation [m].
    pub fn turned(yaw_rad: f64, translation: DVec3) -> Self {
        let rotation = match yaw_rad {
            0.0 => DQuat::IDENTITY,
            _ => DQuat::from_rotation_y(yaw_rad),
        };
        Self {
            rotation,
            translation,
        }
    }

    /// Rotation about the vertical, from z towards x [rad], (−π, π]; `None` if the axis is tilted.
    pub fn yaw_rad(&self) -> Option<f64> {
        let turn = self.rotation;
        let half_turns = (2.0 * turn.y.atan2(turn.w)) / std::f64::consts::TAU;
        let yaw_rad = (half_turns - half_turns.round()) * std::f64::consts::TAU;
        (turn.x.hypot(turn.z) <= TILT).then_some((yaw_rad * STEPS).round() / STEPS)
    }

    /// Transform that rotates about `pivot` [m], then translates.
    pub fn about(&self, pivot: DVec3) -> DAffine3 {
        if self.rotation == DQuat::IDENTITY {
            return DAffine3::from_translation(self.translation);
        }
        let turn = DAffine3::from_quat(self.rotation) * DAffine3::from_translation(-pivot);
        DAffine3::from_translation(pivot + self.translation) * turn
    }
}

impl Object {
    /// Object at the place that the mesh coordinates say.
    pub fn new(
        name: impl Into<String>,
        (node, primitive): (usize, usize),
        material: usize,
        mesh: impl Into<Arc<Mesh>>,
    ) -> Self {
        Self {
            name: name.into(),
            node,
            primitive,
            material,
            body: None,
            shape: Shape {
                mesh: mesh.into(),
                at_rest: DAffine3::IDENTITY,
                motion: Motion::default(),
                pivot: DVec3::ZERO,
                world_from_object: DAffine3::IDENTITY,
                placement: None,
                found: Arc::default(),
            },
        }
    }

    /// The mesh in its own coordinates; shared by instances.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.shape.mesh
    }

    /// Transform from mesh to scene coordinates.
    pub fn world_from_object(&self) -> &DAffine3 {
        &self.shape.world_from_object
    }

    /// Placement of the mesh in the scene; `None` if the transform is the identity.
    pub fn placement(&self) -> Option<&Placement> {
        self.shape.placement.as_ref()
    }

    /// The mesh in scene coordinates, unless that takes a copy that is not cached yet.
    #[inline]
    fn kept(&self) -> Option<&Arc<Mesh>> {
        match self.shape.placement {
            None => Some(&self.shape.mesh),
            Some(_) => self.shape.found.mesh.get(),
        }
    }

    /// The mesh in scene coordinates: [`mesh`](Self::mesh) itself if the transform is the identity, else a cached copy.
    /// Loops over many objects use [`in_scene`](Self::in_scene), which copies nothing.
    pub fn mesh_in_scene(&self) -> &Arc<Mesh> {
        let copy = || self.shape.found.mesh.get_or_init(|| self.copy_in_scene());
        self.kept().unwrap_or_else(copy)
    }

    /// Like [`mesh_in_scene`](Self::mesh_in_scene), but does not cache the copy.
    pub fn copy_in_scene(&self) -> Arc<Mesh> {
        let copy = || Arc::new(self.shape.mesh.placed(&self.shape.world_from_object));
        self.kept().map_or_else(copy, Arc::clone)
    }

    /// Access to the mesh in scene coordinates, through the cached copy if there is one.
    #[inline]
    pub fn in_scene(&self) -> InScene<'_> {
        match self.kept() {
            Some(mesh) => InScene::from(&**mesh),
            None => InScene::new(&self.shape.mesh, self.placement()),
        }
    }

    /// Bounding box in scene coordinates, as minimum and maximum corner [m]; `None` without vertices.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        *self.shape.found.bounds.get_or_init(|| self.in_scene().bounds())
    }

    /// Whether its mesh is [closed](watertight::is_closed).
    pub fn is_closed(&self) -> bool {
        *self
            .shape
            .found
            .is_closed
            .get_or_init(|| watertight::is_closed(self.mesh()))
    }

    /// Whether the mesh can be traced and drawn in its own coordinates, shared with other objects.
    pub fn can_share(&self) -> bool {
        let is_sound = || instances::is_sound(&self.shape.mesh, &self.shape.world_from_object);
        *self.shape.found.can_share.get_or_init(is_sound)
    }

    /// The mesh in scene coordinates, for modification. The object stops sharing it, and its transform becomes the
    /// identity.
    pub fn mesh_in_scene_mut(&mut self) -> &mut Mesh {
        let mesh = Arc::clone(self.mesh_in_scene());
        self.shape = Self::new("", (0, 0), 0, mesh).shape;
        Arc::make_mut(&mut self.shape.mesh)
    }

    /// Motion since loading.
    pub fn motion(&self) -> &Motion {
        &self.shape.motion
    }

    /// Sets the transform as loaded and resets the motion.
    pub fn place(&mut self, world_from_object: DAffine3) {
        self.shape.at_rest = world_from_object;
        self.set_motion(Motion::default(), DVec3::ZERO);
    }

    /// Sets the motion since loading.
    pub(super) fn set_motion(&mut self, motion: Motion, pivot: DVec3) {
        let shape = &mut self.shape;
        let is_at_rest = motion == Motion::default();
        shape.motion = motion;
        shape.pivot = if is_at_rest { DVec3::ZERO } else { pivot };
        let world_from_object = match is_at_rest {
            true => shape.at_rest,
            false => motion.about(pivot) * shape.at_rest,
        };
        if shape.world_from_object == world_from_object {
            return;
        }
        shape.world_from_object = world_from_object;
        shape.settle();
    }

    /// Applies a further transform on top of the current one.
    pub(super) fn carry(&mut self, carrying: &DAffine3) {
        self.shape.world_from_object = *carrying * self.shape.world_from_object;
        self.shape.settle();
    }

    /// Replaces the mesh, at the same place.
    pub(super) fn reshape(&mut self, mesh: Arc<Mesh>) {
        self.shape.mesh = mesh;
        self.shape.settle();
    }

    /// Takes over mesh and transform of an equal object, so that data derived from that one stay valid.
    pub fn share(&mut self, same: &Self) {
        self.shape = same.shape.clone();
    }

    /// Whether both share one mesh and have the same transform.
    pub fn stands_as(&self, other: &Self) -> bool {
        let (a, b) = (&self.shape, &other.shape);
        Arc::ptr_eq(&a.mesh, &b.mesh) && a.world_from_object == b.world_from_object
    }
}

impl Scene {
    /// Pivot of an object's node: centre of the bounding box of all its parts, as loaded [m].
    pub fn pivot(&self, object: usize) -> DVec3 {
        let found = &self.objects[object];
        if *found.motion() != Motion::default() {
            return found.shape.pivot;
        }
        let parts = self.objects.iter().filter(|part| part.node == found.node);
        let bounds = parts
            .filter_map(Object::bounds)
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        bounds.map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high))
    }
}
