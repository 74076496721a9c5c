//! Writes edited world transforms back as local transforms of nodes.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::Root;
use serde_json::json;

use crate::error::{Error, Result};
use crate::scene::gltf::document::Document;
use crate::scene::gltf::glb::Glb;
use crate::scene::gltf::nodes::PlacedNode;

/// Tolerance for equal transforms, relative to their size [1].
const SAME: f64 = 1e-12;

/// World transforms of nodes, in the file and as edited.
pub struct NodePlacement<'a> {
    placed: &'a [PlacedNode],
    /// By node index.
    wanted: BTreeMap<usize, DAffine3>,
}

impl<'a> NodePlacement<'a> {
    pub fn new(placed: &'a [PlacedNode]) -> Self {
        Self {
            placed,
            wanted: BTreeMap::new(),
        }
    }

    /// World transform of a node in the file.
    pub fn of(&self, node: usize) -> Option<DAffine3> {
        let placed = self.placed.iter().find(|placed| placed.node == node)?;
        Some(placed.world_from_node)
    }

    /// Sets the new world transform of a node.
    ///
    /// # Errors
    /// The node has another new transform already: things attached to it were moved apart.
    pub fn put(&mut self, node: usize, world_from_node: DAffine3, name: &str) -> Result<()> {
        match self.wanted.insert(node, world_from_node) {
            Some(other) if !is_same(&other, &world_from_node) => Err(Error::failure(
                format!("`{name}`"),
                "shares its node with an object that was moved elsewhere, which a file cannot state",
                "move both alike, or give them nodes of their own",
            )),
            _ => Ok(()),
        }
    }

    /// Writes the transforms of all moved nodes, and of their children, which keep their place.
    pub fn write(&self, document: &Document, glb: &mut Glb) {
        for placed in self.placed {
            let node = placed.node;
            let parent = parent_of(&document.root, node, self.placed);
            let is_touched = |node: &usize| self.wanted.contains_key(node);
            if !is_touched(&node) && !parent.as_ref().is_some_and(is_touched) {
                continue;
            }
            let world_from_parent = parent.map_or(DAffine3::IDENTITY, |parent| self.stands(parent));
            let parent_from_node = world_from_parent.inverse() * self.stands(node);
            write_transform(document, node, &parent_from_node, glb);
        }
    }

    /// Final world transform of a node.
    fn stands(&self, node: usize) -> DAffine3 {
        let wanted = self.wanted.get(&node).copied();
        wanted.or_else(|| self.of(node)).unwrap_or(DAffine3::IDENTITY)
    }
}

fn is_same(a: &DAffine3, b: &DAffine3) -> bool {
    let size = a
        .to_cols_array()
        .iter()
        .fold(1.0_f64, |size, value| size.max(value.abs()));
    a.abs_diff_eq(*b, SAME * size)
}

/// Parent of a placed node.
fn parent_of(root: &Root, node: usize, placed: &[PlacedNode]) -> Option<usize> {
    let is_parent = |candidate: &&PlacedNode| {
        let children = root.nodes[candidate.node].children.as_deref();
        children
            .unwrap_or_default()
            .iter()
            .any(|child| child.value() == node)
    };
    placed.iter().find(is_parent).map(|parent| parent.node)
}

/// Writes the translation, rotation and scale that changed, if the file uses these and they can represent the
/// transform; otherwise a matrix.
fn write_transform(document: &Document, node: usize, transform: &DAffine3, glb: &mut Glb) {
    let stated = &document.transforms[node];
    let path = |name: &str| format!("/nodes/{node}/{name}");
    let (scale, rotation, translation) = transform.to_scale_rotation_translation();
    let again = DAffine3::from_scale_rotation_translation(scale, rotation, translation);
    if stated.matrix.is_some() || !is_same(&again, transform) {
        for name in ["translation", "rotation", "scale"] {
            glb.remove(&path(name));
        }
        glb.set(&path("matrix"), json!(DMat4::from(*transform).to_cols_array()));
        return;
    }
    let was_scale = DVec3::from(stated.scale.unwrap_or([1.0; 3]));
    let was_rotation = DQuat::from_array(stated.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0])).normalize();
    let keeps_turn = DAffine3::from_scale_rotation_translation(was_scale, was_rotation, translation);
    glb.set(&path("translation"), json!(translation.to_array()));
    if !is_same(&keeps_turn, transform) {
        glb.set(&path("rotation"), json!(rotation.to_array()));
        glb.set(&path("scale"), json!(scale.to_array()));
    }
}
