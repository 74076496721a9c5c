//! Objects: a mesh with a transform and a material.

use std::fmt;
use std::sync::{Arc, OnceLock};

use glam::{DAffine3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::mesh::{InScene, Placement};
use super::{Mesh, Scene, instances};

/// One mesh primitive of one node: the unit that has a material and, when light reaches it, an illumination map.
#[derive(Clone, Debug)]
pub struct Object {
    /// The node's name in the file; `nodeN` when it has none.
    pub name: String,
    /// glTF index of the node.
    pub node: usize,
    /// Index of the primitive within the node's mesh.
    pub primitive: usize,
    /// Index into [`Scene::materials`].
    pub material: usize,
    shape: Shape,
}

/// A mesh where it stands.
#[derive(Clone, Debug)]
struct Shape {
    /// Shared between instances, and between a scene and its edited copies.
    mesh: Arc<Mesh>,
    /// From the mesh to the scene, as it was loaded.
    at_rest: DAffine3,
    motion: Motion,
    /// What the motion turns about [m].
    pivot: DVec3,
    world_from_object: DAffine3,
    /// `None` where that changes nothing.
    placement: Option<Placement>,
    found: Arc<Found>,
}

/// What was found out about a mesh where it stands, when it was first asked for.
#[derive(Default)]
struct Found {
    /// A copy in scene coordinates.
    mesh: OnceLock<Arc<Mesh>>,
    bounds: OnceLock<Option<(DVec3, DVec3)>>,
    can_share: OnceLock<bool>,
}

impl fmt::Debug for Found {
    /// Objects are the same whether anybody has asked or not.
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

/// How a node was moved since it was loaded: turned about the middle of its box, and then moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Unit.
    pub rotation: DQuat,
    /// [m]
    pub translation: DVec3,
}

/// A turn is about the vertical where its quaternion's other parts are smaller.
const TILT: f64 = 1e-5;
/// Angles are read off rotations in so many steps [1/rad]: what was typed, and not what rounding made of it.
const STEPS: f64 = 1e9;

impl Motion {
    /// A turn about the vertical, from z towards x [rad], and a way [m].
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

    /// The turn about the vertical, from z towards x [rad], (−π, π]; `None` where it tilts.
    pub fn yaw_rad(&self) -> Option<f64> {
        let turn = self.rotation;
        let half_turns = (2.0 * turn.y.atan2(turn.w)) / std::f64::consts::TAU;
        let yaw_rad = (half_turns - half_turns.round()) * std::f64::consts::TAU;
        (turn.x.hypot(turn.z) <= TILT).then_some((yaw_rad * STEPS).round() / STEPS)
    }

    /// As a transform that turns about `pivot` [m].
    pub fn about(&self, pivot: DVec3) -> DAffine3 {
        if self.rotation == DQuat::IDENTITY {
            return DAffine3::from_translation(self.translation);
        }
        let turn = DAffine3::from_quat(self.rotation) * DAffine3::from_translation(-pivot);
        DAffine3::from_translation(pivot + self.translation) * turn
    }
}

impl Object {
    /// A mesh that stands where its coordinates say, as a primitive of a node.
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

    /// The mesh in its own coordinates; instances share it.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.shape.mesh
    }

    /// From the coordinates of the mesh to those of the scene.
    pub fn world_from_object(&self) -> &DAffine3 {
        &self.shape.world_from_object
    }

    /// What places the mesh in the scene; `None` where it stands where its coordinates say.
    pub fn placement(&self) -> Option<&Placement> {
        self.shape.placement.as_ref()
    }

    /// The mesh itself where nothing places it, or a copy that is kept.
    #[inline]
    fn kept(&self) -> Option<&Arc<Mesh>> {
        match self.shape.placement {
            None => Some(&self.shape.mesh),
            Some(_) => self.shape.found.mesh.get(),
        }
    }

    /// The mesh in scene coordinates: [`mesh`](Self::mesh) itself where the transform is the identity, else a copy that is
    /// kept. What goes over many objects asks [`in_scene`](Self::in_scene), which copies nothing.
    pub fn mesh_in_scene(&self) -> &Arc<Mesh> {
        let copy = || self.shape.found.mesh.get_or_init(|| self.copy_in_scene());
        self.kept().unwrap_or_else(copy)
    }

    /// The same, but a copy is not kept.
    pub fn copy_in_scene(&self) -> Arc<Mesh> {
        let copy = || Arc::new(self.shape.mesh.placed(&self.shape.world_from_object));
        self.kept().map_or_else(copy, Arc::clone)
    }

    /// The same, triangle by triangle: by the copy where there is one.
    #[inline]
    pub fn in_scene(&self) -> InScene<'_> {
        match self.kept() {
            Some(mesh) => InScene::from(&**mesh),
            None => InScene::new(&self.shape.mesh, self.placement()),
        }
    }

    /// Smallest box around the mesh in the scene, as minimum and maximum corner [m]; `None` without vertices.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        *self.shape.found.bounds.get_or_init(|| self.in_scene().bounds())
    }

    /// Whether its mesh can be met and drawn in its own coordinates, together with other objects that have it.
    pub fn can_share(&self) -> bool {
        let is_sound = || instances::is_sound(&self.shape.mesh, &self.shape.world_from_object);
        *self.shape.found.can_share.get_or_init(is_sound)
    }

    /// The mesh in scene coordinates, to be changed: from then on those are its own.
    pub fn mesh_in_scene_mut(&mut self) -> &mut Mesh {
        let mesh = Arc::clone(self.mesh_in_scene());
        self.shape = Self::new("", (0, 0), 0, mesh).shape;
        Arc::make_mut(&mut self.shape.mesh)
    }

    /// How it was moved since it was loaded.
    pub fn motion(&self) -> &Motion {
        &self.shape.motion
    }

    /// Puts it where it is loaded.
    pub fn place(&mut self, world_from_object: DAffine3) {
        self.shape.at_rest = world_from_object;
        self.set_motion(Motion::default(), DVec3::ZERO);
    }

    /// Moves it from where it was loaded.
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

    /// Moves it on from where it is now.
    pub(super) fn carry(&mut self, carrying: &DAffine3) {
        self.shape.world_from_object = *carrying * self.shape.world_from_object;
        self.shape.settle();
    }

    /// Gives it another mesh at the same place.
    pub(super) fn reshape(&mut self, mesh: Arc<Mesh>) {
        self.shape.mesh = mesh;
        self.shape.settle();
    }

    /// Takes over mesh and place of an object that looks the same, so that who knows that one does nothing anew.
    pub fn share(&mut self, same: &Self) {
        self.shape = same.shape.clone();
    }

    /// Whether both have one mesh at one place.
    pub fn stands_as(&self, other: &Self) -> bool {
        let (a, b) = (&self.shape, &other.shape);
        Arc::ptr_eq(&a.mesh, &b.mesh) && a.world_from_object == b.world_from_object
    }
}

impl Scene {
    /// What an object's node turns about: the middle of the box around all of its parts, as it was loaded [m].
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
