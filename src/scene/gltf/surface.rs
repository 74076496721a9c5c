//! The objects of a scene: every primitive of every node that has a mesh.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DAffine3;
use gltf::json::mesh;

use super::context::{LoadContext, damaged};
use super::nodes::PlacedNode;
use super::pose::PrimitiveInstance;
use super::primitive::{self, Primitives};
use super::{extras, material};
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::watertight::{has_volume, is_closed};
use crate::scene::{Material, Mesh, Object, Scene, instances};

/// Adds all objects, and to `materials`, which has those of the file, any that the file only implies. `solid_glass`
/// reads thin walls as solid glass if their mesh encloses space.
///
/// # Errors
/// A mesh that does not exist; those of [`Primitives::read`].
pub fn add_objects(
    scene: &mut Scene,
    source: primitive::PrimitiveSource,
    placed: &[PlacedNode],
    solid_glass: bool,
    materials: &mut Materials,
    load: &mut LoadContext,
) -> Result<()> {
    let root = source.reader.root;
    let mut primitives = Primitives::default();
    let mut closed = HashMap::new();
    let mut uses = vec![0; root.meshes.len()];
    let meshes = placed.iter().filter_map(|placed| root.nodes[placed.node].mesh);
    for mesh in meshes {
        if let Some(uses) = uses.get_mut(mesh.value()) {
            *uses += 1;
        }
    }
    for placed in placed {
        let Some(mesh_index) = root.nodes[placed.node].mesh else {
            continue;
        };
        let Some(mesh) = root.meshes.get(mesh_index.value()) else {
            return Err(damaged(
                format!("node `{}`", placed.name),
                format!("has mesh {}, which does not exist", mesh_index.value()),
            ));
        };
        // A skinned mesh is placed by its joints, whatever the transform of its node.
        let world_from_node = match source.poses.has_skin(placed.node) {
            true => DAffine3::IDENTITY,
            false => placed.world_from_node,
        };
        for (index, part) in mesh.primitives.iter().enumerate() {
            let owner = owner(mesh, mesh_index.value(), index);
            let place = PrimitiveInstance {
                node: placed.node,
                mesh: mesh_index.value(),
                primitive: index,
            };
            let material = materials.of_primitive(part, &owner, load);
            let part = (place, part, materials.is_opaque_body(material));
            let read = primitives.read(source, part, &world_from_node, &owner, load)?;
            let Some((mesh, colour)) = read else {
                continue;
            };
            let mut object = Object::new(placed.name.as_str(), (placed.node, index), 0, mesh);
            object.place(world_from_node);
            let is_solid = || {
                let mesh = object.mesh();
                let mut is_closed = || *closed.entry(Arc::as_ptr(mesh)).or_insert_with(|| is_closed(mesh));
                solid_glass && has_volume(object.in_scene()) && is_closed()
            };
            let material = materials.thin_or_solid(material, is_solid);
            let material = materials.tinted(material, colour);
            materials.check_coordinates(material, object.mesh(), &placed.name, load);
            object.material = material;
            scene.objects.push(object);
        }
        uses[mesh_index.value()] -= 1;
        if uses[mesh_index.value()] == 0 {
            primitives.forget(mesh_index.value());
        }
    }
    take_copies(&scene.objects, load)?;
    let degenerate = primitives.degenerate;
    if degenerate > 0 {
        load.warn(
            "meshes",
            format!("{degenerate} triangles without area were dropped"),
            "nothing needs to be done: they can neither be seen nor lit",
        );
    }
    Ok(())
}

/// Reserves the memory of copies of meshes that several objects share but that are not instanced.
///
/// # Errors
/// Too little is left.
fn take_copies(objects: &[Object], load: &mut LoadContext) -> Result<()> {
    let mut known = HashSet::new();
    for (object, is_instance) in objects
        .iter()
        .zip(instances::find(objects, instances::MAX_COPIED))
    {
        if !known.insert(Arc::as_ptr(object.mesh())) && !is_instance {
            let owner = format!("node `{}`", object.name);
            primitive::take_copy(object.mesh(), &owner, load)?;
        }
    }
    Ok(())
}

fn owner(mesh: &mesh::Mesh, mesh_index: usize, primitive: usize) -> String {
    format!(
        "mesh `{}`, primitive {primitive}",
        extras::name(mesh.name.as_deref(), "mesh", mesh_index)
    )
}

/// Materials of the file, followed by those that it only implies.
#[derive(Debug)]
pub struct Materials {
    all: Vec<Material>,
    in_file: usize,
    default: Option<usize>,
    /// For each thin wall of the file: whether it became solid, and its variant of the other kind.
    thin: HashMap<usize, (bool, Option<usize>)>,
    /// Tinted variants: original material, tint, variant.
    tinted: Vec<(usize, LinearSrgb, usize)>,
}

impl Materials {
    /// Starts with the materials of the file.
    pub fn new(in_file: Vec<Material>) -> Self {
        Self {
            in_file: in_file.len(),
            default: None,
            thin: HashMap::new(),
            tinted: Vec::new(),
            all: in_file,
        }
    }

    pub fn into_all(self) -> Vec<Material> {
        self.all
    }

    fn of_primitive(&mut self, part: &mesh::Primitive, owner: &str, load: &mut LoadContext) -> usize {
        let named = part.material.map(|material| material.value());
        if let Some(material) = named {
            if material < self.in_file {
                return material;
            }
            load.warn(
                owner,
                format!("has material {material}, which does not exist; it was made diffuse white"),
                "give it a material",
            );
        }
        *self.default.get_or_insert_with(|| {
            self.all.push(material::default());
            self.all.len() - 1
        })
    }

    /// Whether a material is diffuse, with or without a coat.
    fn is_opaque_body(&self, material: usize) -> bool {
        let surface = self.all[material].surface;
        surface.is_receiver() && surface.is_opaque()
    }

    /// Variant of a thin-walled material for a solid or an open mesh; other materials stay the same. The first mesh
    /// decides what the material itself becomes; meshes of the other kind get a variant.
    fn thin_or_solid(&mut self, material: usize, is_solid: impl FnOnce() -> bool) -> usize {
        let is_known = self.thin.contains_key(&material);
        if !is_known && !material::is_thin(&self.all[material]) {
            return material;
        }
        let is_solid = is_solid();
        let (own, twin) = self.thin.entry(material).or_insert((is_solid, None));
        if *own == is_solid {
            if !is_known && is_solid {
                material::make_solid(&mut self.all[material]);
            }
            return material;
        }
        *twin.get_or_insert_with(|| {
            self.all.push(material::twin(&self.all[material], is_solid));
            self.all.len() - 1
        })
    }

    /// Warns of the remaining thin walls.
    pub fn warn_of_thin_walls(&self, solid_glass: bool, load: &mut LoadContext) {
        for material in self.all.iter().filter(|material| material::is_thin(material)) {
            load.warn(
                format!("material `{}`", material.name),
                "transmits light but has no thickness, so it is a thin pane and does not refract",
                if solid_glass {
                    "give it a volume, or close its mesh, to make it solid glass"
                } else {
                    "give it a volume, or leave --solid-glass on"
                },
            );
        }
    }

    /// Variant of a material with its base colour multiplied by `colour`.
    fn tinted(&mut self, material: usize, colour: Option<LinearSrgb>) -> usize {
        let Some(colour) = colour.filter(|colour| *colour != LinearSrgb::WHITE) else {
            return material;
        };
        let same = |known: &&(usize, LinearSrgb, usize)| (known.0, known.1) == (material, colour);
        if let Some((.., twin)) = self.tinted.iter().find(same) {
            return *twin;
        }
        let twin = self.all.len();
        let own = &self.all[material];
        self.all.push(Material {
            name: format!("{} (tinted)", own.name),
            base_colour: own.base_colour * colour,
            ..own.clone()
        });
        self.tinted.push((material, colour, twin));
        twin
    }

    fn check_coordinates(&self, material: usize, mesh: &Mesh, name: &str, load: &mut LoadContext) {
        for (set, uvs) in [&mesh.uv0, &mesh.uv1].into_iter().enumerate() {
            let mut images = self.all[material].images().into_iter().flatten();
            if uvs.is_none() && images.any(|image| image.uv_set == set) {
                load.warn(
                    format!("node `{name}`"),
                    format!("has a texture but no TEXCOORD_{set} to place it by"),
                    "give it texture coordinates",
                );
            }
        }
    }
}
