//! What stands in a scene: a mesh and where it is.

use std::sync::Arc;

use glam::DAffine3;

use super::Mesh;

/// One mesh primitive of one node: the unit that has a material and, when light reaches it, an illumination map.
#[derive(Clone, Debug)]
pub struct Object {
    /// The node's name in the file; `nodeN` when it has none.
    pub name: String,
    /// glTF index of the node.
    pub node: usize,
    /// Index of the primitive within the node's mesh.
    pub primitive: usize,
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: usize,
    mesh: Arc<Mesh>,
    world_from_object: DAffine3,
    /// `None` where that is the mesh itself.
    in_scene: Option<Arc<Mesh>>,
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
            mesh: mesh.into(),
            world_from_object: DAffine3::IDENTITY,
            in_scene: None,
        }
    }

    /// The mesh in its own coordinates; instances share it, and so do a scene and its edited copies.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// From the coordinates of the mesh to those of the scene.
    pub fn world_from_object(&self) -> &DAffine3 {
        &self.world_from_object
    }

    /// The mesh in scene coordinates: [`mesh`](Self::mesh) itself where the transform is the identity.
    pub fn mesh_in_scene(&self) -> &Arc<Mesh> {
        self.in_scene.as_ref().unwrap_or(&self.mesh)
    }

    /// The mesh in scene coordinates, to be changed: from then on those are its own.
    pub fn mesh_in_scene_mut(&mut self) -> &mut Mesh {
        if let Some(mesh) = self.in_scene.take() {
            self.mesh = mesh;
            self.world_from_object = DAffine3::IDENTITY;
        }
        Arc::make_mut(&mut self.mesh)
    }

    /// Puts the mesh elsewhere.
    pub fn place(&mut self, world_from_object: DAffine3) {
        if self.world_from_object == world_from_object {
            return;
        }
        self.world_from_object = world_from_object;
        let is_moved = world_from_object != DAffine3::IDENTITY;
        self.in_scene = is_moved.then(|| Arc::new(self.mesh.placed(&world_from_object)));
    }

    /// Takes over mesh and place of an object that looks the same, so that who knows that one does nothing anew.
    pub fn share(&mut self, same: &Self) {
        self.mesh = Arc::clone(&same.mesh);
        self.world_from_object = same.world_from_object;
        self.in_scene.clone_from(&same.in_scene);
    }

    /// Whether both have one mesh at one place.
    pub fn stands_as(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh) && self.world_from_object == other.world_from_object
    }
}
