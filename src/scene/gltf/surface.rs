//! The objects of a scene: every primitive of every placed node.

use std::collections::HashSet;
use std::sync::Arc;

use gltf::json::{Root, mesh};

use super::accessor::Reader;
use super::buffers::Buffers;
use super::nodes::Placed;
use super::primitive::{self, Primitives};
use super::report::{Budget, Report};
use super::{material, names};
use crate::error::{Error, Result};
use crate::scene::closed::is_closed;
use crate::scene::{Material, Mesh, Object, Scene, SurfaceKind, instances};

/// What objects are read from.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// The typed JSON.
    pub root: &'a Root,
    /// Its binary data.
    pub buffers: &'a Buffers<'a>,
    /// The scene's nodes.
    pub placed: &'a [Placed],
    /// Reads thin walls as solid glass where their mesh is closed.
    pub solid_glass: bool,
}

/// Adds all objects, and to `materials` (in file order so far) those that the file only implies.
///
/// # Errors
/// A mesh that does not exist, or as [`Primitives::read`].
pub fn add_objects(
    scene: &mut Scene,
    source: Source,
    materials: &mut Materials,
    budget: &mut Budget,
    report: &mut Report,
) -> Result<()> {
    let reader = Reader {
        root: source.root,
        buffers: source.buffers,
    };
    let mut primitives = Primitives::default();
    let mut uses = vec![0; source.root.meshes.len()];
    let meshes = source
        .placed
        .iter()
        .filter_map(|placed| source.root.nodes[placed.node].mesh);
    for mesh in meshes {
        if let Some(uses) = uses.get_mut(mesh.value()) {
            *uses += 1;
        }
    }
    for placed in source.placed {
        let Some(mesh_index) = source.root.nodes[placed.node].mesh else {
            continue;
        };
        let Some(mesh) = source.root.meshes.get(mesh_index.value()) else {
            return Err(Error::failure(
                format!("node `{}`", placed.name),
                format!("has mesh {}, which does not exist", mesh_index.value()),
                "export the file again",
            ));
        };
        for (index, part) in mesh.primitives.iter().enumerate() {
            let owner = owner(mesh, mesh_index.value(), index);
            let read = primitives.read(
                reader,
                (mesh_index.value(), index, part),
                &placed.world_from_node,
                &owner,
                budget,
                report,
            )?;
            let Some(mesh) = read else {
                continue;
            };
            let mut object = Object::new(placed.name.as_str(), (placed.node, index), 0, mesh);
            object.place(placed.world_from_node);
            let material = materials.of_primitive(part, &owner, report);
            let material = if source.solid_glass {
                materials.as_solid(material, &object, report)
            } else {
                material
            };
            materials.check_coordinates(material, object.mesh(), &placed.name, report);
            object.material = material;
            scene.objects.push(object);
        }
        uses[mesh_index.value()] -= 1;
        if uses[mesh_index.value()] == 0 {
            primitives.forget(mesh_index.value());
        }
    }
    take_copies(&scene.objects, budget)?;
    let degenerate = primitives.degenerate;
    if degenerate > 0 {
        report.warn(
            "meshes",
            format!("{degenerate} triangles without area were dropped"),
            "nothing needs to be done: they can neither be seen nor lit",
        );
    }
    Ok(())
}

/// Takes the memory of the copies that will be made of meshes that several objects have.
///
/// # Errors
/// Not so much is left.
fn take_copies(objects: &[Object], budget: &mut Budget) -> Result<()> {
    let mut known = HashSet::new();
    for (object, is_instance) in objects
        .iter()
        .zip(instances::find(objects, instances::MOST_COPIED))
    {
        if !known.insert(Arc::as_ptr(object.mesh())) && !is_instance {
            let owner = format!("node `{}`", object.name);
            primitive::take_copy(object.mesh(), &owner, budget)?;
        }
    }
    Ok(())
}

fn owner(mesh: &mesh::Mesh, mesh_index: usize, primitive: usize) -> String {
    format!(
        "mesh `{}`, primitive {primitive}",
        names::name(mesh.name.as_ref(), "mesh", mesh_index)
    )
}

/// The file's materials, and those that it only implies after them.
#[derive(Debug)]
pub struct Materials {
    all: Vec<Material>,
    in_file: usize,
    default: Option<usize>,
    /// The solid twin of each of the file's materials.
    solid: Vec<Option<usize>>,
}

impl Materials {
    /// Starts with the file's own.
    pub fn new(in_file: Vec<Material>) -> Self {
        Self {
            in_file: in_file.len(),
            default: None,
            solid: vec![None; in_file.len()],
            all: in_file,
        }
    }

    /// All materials that objects refer to.
    pub fn into_all(self) -> Vec<Material> {
        self.all
    }

    fn of_primitive(&mut self, part: &mesh::Primitive, owner: &str, report: &mut Report) -> usize {
        let named = part.material.map(|material| material.value());
        if let Some(material) = named {
            if material < self.in_file {
                return material;
            }
            report.warn(
                owner,
                format!("has material {material}, which does not exist; it was made matte white"),
                "give it a material",
            );
        }
        *self.default.get_or_insert_with(|| {
            self.all.push(material::default());
            self.all.len() - 1
        })
    }

    /// The material that a thin wall has as a solid, where its mesh is closed; any other stays.
    fn as_solid(&mut self, material: usize, object: &Object, report: &mut Report) -> usize {
        if self.all[material].surface != SurfaceKind::ThinWall {
            return material;
        }
        if !is_closed(&object.copy_in_scene()) {
            report.warn(
                format!("node `{}`", object.name),
                "is not closed, so that it stays a pane without thickness",
                "close its mesh to make it solid glass",
            );
            return material;
        }
        if let Some(solid) = self.solid[material] {
            return solid;
        }
        self.all.push(material::solid_twin(&self.all[material]));
        let solid = self.all.len() - 1;
        self.solid[material] = Some(solid);
        solid
    }

    fn check_coordinates(&self, material: usize, mesh: &Mesh, name: &str, report: &mut Report) {
        let Some(texture) = &self.all[material].base_colour_texture else {
            return;
        };
        let uvs = if texture.uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
        if uvs.is_none() {
            report.warn(
                format!("node `{name}`"),
                format!("has a texture but no TEXCOORD_{} to place it by", texture.uv_set),
                "give it texture coordinates",
            );
        }
    }
}
