//! The objects of a scene: every primitive of every node that has a mesh.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DAffine3;
use gltf::json::material::AlphaMode;
use gltf::json::mesh;
use gltf::json::validation::Checked;

use super::context::{LoadContext, damaged};
use super::nodes::PlacedNode;
use super::pose::PrimitiveInstance;
use super::primitive::{self, Primitives, VertexFactors};
use super::{bodies, extras, material};
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::{Material, Mesh, Object, Scene, Volume, instances};

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
    // Source data of a mesh are dropped after its last use: scenes of many meshes would hold all of them twice.
    let root = source.reader.root;
    let mut primitives = Primitives::default();
    let mut factors = Vec::new();
    let mut uses = vec![0; root.meshes.len()];
    let meshes = placed.iter().filter_map(|placed| root.nodes[placed.node].mesh);
    for mesh in meshes {
        if let Some(uses) = uses.get_mut(mesh.value()) {
            *uses += 1;
        }
    }

    // Every primitive of every placed node becomes an object.
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
            let Some((mesh, of_vertices)) = read else {
                continue;
            };
            let mut object = Object::new(placed.name.as_str(), (placed.node, index), material, mesh);
            object.place(world_from_node);
            scene.objects.push(object);
            factors.push(of_vertices);
        }
        uses[mesh_index.value()] -= 1;
        if uses[mesh_index.value()] == 0 {
            primitives.forget(mesh_index.value());
        }
    }

    // Whether glass is solid is known only with all objects, since several may bound one body.
    let bounds_body = bodies::find(&mut scene.objects, &materials.all, load);
    for (object, (bounds_body, mut factors)) in
        scene.objects.iter_mut().zip(bounds_body.into_iter().zip(factors))
    {
        let source = root.materials.get(object.material);
        let blends = source.is_some_and(|source| source.alpha_mode == Checked::Valid(AlphaMode::Blend));
        let material = materials.thin_or_solid(object.material, bounds_body, solid_glass);

        // A pane has no interior to trace through, so that the absorption of its stated thickness tints it. The cube
        // root of the determinant is the geometric mean of the scales along the axes.
        let volume = source.and_then(|source| source.extensions.as_ref()?.volume.as_ref());
        if let Some(volume) = volume.filter(|_| !materials.all[material].is_solid()) {
            let scale = object.world_from_object().matrix3.determinant().abs().cbrt();
            let thickness_m = extras::widen(volume.thickness_factor.0) * scale;
            factors.colour = factors.colour * materials.through_pane(material, thickness_m);
        }

        // Vertex colours and panes make variants of materials, shared by all objects with the same factors.
        object.material = materials.tinted(material, factors, blends);
        materials.check_coordinates(object.material, object.mesh(), &object.name, load);
    }

    // Meshes of few uses or triangles are copied for each object, which the budget must hold.
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

/// Interior of a body, as the file states it.
#[derive(Clone, Copy, Debug)]
struct Interior {
    volume: Volume,
    /// Whether it has a thickness; the mesh decides otherwise.
    has_thickness: bool,
}

/// Materials of the file, followed by those that it only implies.
#[derive(Debug)]
pub struct Materials {
    all: Vec<Material>,
    in_file: usize,
    default: Option<usize>,
    /// Interior that the file states for each material.
    stated: Vec<Option<Interior>>,
    /// For each transmissive material of the file in use: whether it became solid, and its variant of the other kind.
    transmissive: HashMap<usize, (bool, Option<usize>)>,
    /// Tinted variants: original material, factors, variant.
    tinted: Vec<(usize, VertexFactors, usize)>,
}

fn interior(material: &Material) -> Option<Interior> {
    material.volume.map(|volume| Interior {
        volume,
        has_thickness: !material.is_solid_by_shape,
    })
}

impl Materials {
    /// Starts with the materials of the file.
    pub fn new(in_file: Vec<Material>) -> Self {
        Self {
            in_file: in_file.len(),
            default: None,
            stated: in_file.iter().map(interior).collect(),
            transmissive: HashMap::new(),
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
        if let Some(known) = self.default {
            return known;
        }
        let added = self.add(material::default(), None);
        self.default = Some(added);
        added
    }

    fn add(&mut self, material: Material, stated: Option<Interior>) -> usize {
        self.all.push(material);
        self.stated.push(stated);
        self.all.len() - 1
    }

    /// Whether a material is diffuse, with or without a coat.
    fn is_opaque_body(&self, material: usize) -> bool {
        let surface = self.all[material].surface;
        surface.is_receiver() && surface.is_opaque()
    }

    /// Variant of a transmissive material for an object that bounds a body or does not; other materials stay the same.
    /// The first object decides what the material itself becomes; objects of the other kind get a variant.
    fn thin_or_solid(&mut self, material: usize, bounds_body: bool, solid_glass: bool) -> usize {
        let own = &self.all[material];
        if !own.transmits() {
            return material;
        }
        let stated = self.stated[material];
        let has_thickness = stated.is_some_and(|interior| interior.has_thickness);
        let is_solid = bounds_body && (solid_glass || has_thickness);
        let set = |material: &mut Material| {
            let volume = stated.map_or(material::CLEAR, |interior| interior.volume);
            material::set_interior(material, is_solid.then_some(volume), !has_thickness);
        };
        match self.transmissive.get(&material).copied() {
            None => {
                set(&mut self.all[material]);
                self.transmissive.insert(material, (is_solid, None));
                material
            }
            Some((first, _)) if first == is_solid => material,
            Some((_, Some(twin))) => twin,
            Some((first, None)) => {
                let mut twin = self.all[material].clone();
                twin.name += if is_solid { " (solid)" } else { " (thin)" };
                set(&mut twin);
                let twin = self.add(twin, stated);
                self.transmissive.insert(material, (first, Some(twin)));
                twin
            }
        }
    }

    /// What a thin pane of that thickness [m, ≥ 0] transmits of light at normal incidence [1].
    fn through_pane(&self, material: usize, thickness_m: f64) -> LinearSrgb {
        let is_thin = self.all[material].transmits() && thickness_m.is_finite();
        let stated = self.stated[material].filter(|_| is_thin);
        stated.map_or(LinearSrgb::WHITE, |interior| {
            interior.volume.transmittance(thickness_m)
        })
    }

    /// Warns of the thin walls of which the file states no interior.
    pub fn warn_of_thin_walls(&self, solid_glass: bool, load: &mut LoadContext) {
        let all = self.all.iter().zip(&self.stated);
        let is_thin = |material: &Material| material.transmits() && material.volume.is_none();
        let thin = all.filter(|(material, _)| is_thin(material));
        let bare = thin.filter(|(_, stated)| stated.is_none_or(|interior| !interior.has_thickness));
        for (material, _) in bare {
            load.warn(
                format!("material `{}`", material.name),
                "transmits light but has no thickness, so it is a thin pane and does not refract",
                if solid_glass {
                    "give it a volume and close its mesh to make it solid glass"
                } else {
                    "give it a volume, or leave --solid-glass on"
                },
            );
        }
    }

    /// Variant of a material with its base colour multiplied by the factors of vertices and, if it is cut out or
    /// `blends`, its alpha.
    fn tinted(&mut self, material: usize, mut factors: VertexFactors, blends: bool) -> usize {
        let own = &self.all[material];
        let has_alpha = own.alpha_mask.is_some() || (blends && !own.transmits());
        if !has_alpha {
            factors.alpha = 1.0;
        }
        if factors.colour == LinearSrgb::WHITE && factors.alpha == 1.0 {
            return material;
        }
        let same = |known: &&(usize, VertexFactors, usize)| (known.0, known.1) == (material, factors);
        if let Some((.., twin)) = self.tinted.iter().find(same) {
            return *twin;
        }
        let mut tinted = Material {
            name: format!("{} (tinted)", own.name),
            base_colour: own.base_colour * factors.colour,
            ..own.clone()
        };
        if let Some(mask) = &mut tinted.alpha_mask {
            mask.factor *= factors.alpha;
        } else if factors.alpha < 1.0 {
            tinted.coverage = Some(own.coverage.unwrap_or(1.0) * factors.alpha);
            tinted.surface = tinted.classified();
        }
        let twin = self.add(tinted, self.stated[material]);
        self.tinted.push((material, factors, twin));
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
