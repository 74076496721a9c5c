//! Morph targets and skins in the file's rest pose.

use std::collections::HashMap;

use glam::{DAffine3, DMat4, DVec3};
use gltf::json::{Index, Value};
use serde::Deserialize;
use serde_json::Map;

use super::accessor::{Formats, Reader};
use super::context::{LoadContext, damaged};
use crate::error::{Error, Result};
use crate::scene::Mesh;
use crate::scene::mesh::cofactors;

/// Morph targets and skins as stated in the file. They are read separately, since faults in them must not stop the
/// scene.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Poses {
    nodes: Vec<Maybe<Node>>,
    meshes: Vec<Maybe<Morphed>>,
    skins: Vec<Maybe<Skin>>,
}

/// A part of a file whose faults affect only itself.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum Maybe<T> {
    Read(T),
    Broken(serde::de::IgnoredAny),
}

impl<T> Maybe<T> {
    pub fn get(&self) -> Option<&T> {
        match self {
            Self::Read(read) => Some(read),
            Self::Broken(_) => None,
        }
    }
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
struct Node {
    skin: Option<usize>,
    weights: Vec<f64>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
struct Morphed {
    weights: Vec<f64>,
    primitives: Vec<Targets>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
struct Targets {
    targets: Vec<HashMap<String, u32>>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Skin {
    joints: Vec<usize>,
    inverse_bind_matrices: Option<u32>,
}

/// Per vertex, four joints of its skin, and their weights.
pub type SkinWeights = (Vec<[f64; 4]>, Vec<[f64; 4]>);

/// A primitive of a mesh, at a node.
#[derive(Clone, Copy, Debug)]
pub struct PrimitiveInstance {
    pub node: usize,
    pub mesh: usize,
    pub primitive: usize,
}

impl Poses {
    pub fn of(file: &Map<String, Value>) -> Self {
        Self::deserialize(file).unwrap_or_default()
    }

    /// Whether a node has a skin, which then places its mesh instead of the node's transform.
    pub fn has_skin(&self, node: usize) -> bool {
        self.node(node).is_some_and(|node| node.skin.is_some())
    }

    /// Whether a node deforms its mesh individually, so that no other node can share it.
    pub fn is_own(&self, node: usize) -> bool {
        let node = self.node(node);
        node.is_some_and(|node| node.skin.is_some() || !node.weights.is_empty())
    }

    /// Whether a primitive is deformed.
    pub fn is_deformed(&self, place: PrimitiveInstance) -> bool {
        let mesh = self.meshes.get(place.mesh).and_then(Maybe::get);
        let part = mesh.and_then(|mesh| mesh.primitives.get(place.primitive));
        self.has_skin(place.node) || part.is_some_and(|part| !part.targets.is_empty())
    }

    fn node(&self, node: usize) -> Option<&Node> {
        self.nodes.get(node)?.get()
    }

    /// Applies the morph targets of a primitive to its mesh.
    ///
    /// # Errors
    /// Targets that do not fit the mesh.
    pub fn morph(
        &self,
        place: PrimitiveInstance,
        mesh: &mut Mesh,
        reader: Reader,
        owner: &str,
        load: &mut LoadContext,
    ) -> Result<()> {
        // Weights of the node replace those of its mesh.
        let Some(morphed) = self.meshes.get(place.mesh).and_then(Maybe::get) else {
            return Ok(());
        };
        let of_node = self.node(place.node).map(|node| &node.weights);
        let weights = of_node
            .filter(|weights| !weights.is_empty())
            .unwrap_or(&morphed.weights);
        let targets = morphed.primitives.get(place.primitive).map(|part| &part.targets);

        // Targets of weight 0 are never read, so that faults in them do no harm.
        for (weight, target) in weights.iter().zip(targets.into_iter().flatten()) {
            if *weight == 0.0 || !weight.is_finite() {
                continue;
            }
            for (key, moved) in [("POSITION", &mut mesh.positions), ("NORMAL", &mut mesh.normals)] {
                let Some(index) = target.get(key) else {
                    continue;
                };
                let deltas = reader.vectors::<3>(Index::new(*index), Formats::Float, owner, load)?;
                if deltas.len() != moved.len() {
                    return Err(unlike(owner));
                }
                for (moved, delta) in moved.iter_mut().zip(deltas) {
                    *moved += *weight * DVec3::from(delta);
                }
            }
        }
        Ok(())
    }

    /// World transforms of the joints of a node's skin, to apply to its vertices.
    ///
    /// # Errors
    /// A skin that does not exist, or whose joints are not in the scene.
    pub fn joints(
        &self,
        node: usize,
        stands: &HashMap<usize, DAffine3>,
        reader: Reader,
        owner: &str,
        load: &mut LoadContext,
    ) -> Result<Vec<DMat4>> {
        let skin = self.node(node).and_then(|node| self.skins.get(node.skin?)?.get());
        let skin = skin.ok_or_else(|| unlike(owner))?;
        load.take((skin.joints.len() * size_of::<DMat4>()) as u64, owner)?;
        let inverse = match skin.inverse_bind_matrices {
            None => vec![DMat4::IDENTITY; skin.joints.len()],
            Some(index) => {
                let read = reader.vectors::<16>(Index::new(index), Formats::Float, owner, load)?;
                read.iter().map(DMat4::from_cols_array).collect()
            }
        };
        if inverse.len() < skin.joints.len() {
            return Err(unlike(owner));
        }
        let pairs = skin.joints.iter().zip(inverse);
        let matrix = |(joint, inverse)| Some(DMat4::from(*stands.get(joint)?) * inverse);
        pairs
            .map(matrix)
            .collect::<Option<_>>()
            .ok_or_else(|| unlike(owner))
    }
}

/// Skinning: moves the vertices of a mesh to the world by a weighted mean of joint transforms.
///
/// # Errors
/// Vertices without weights, or with joints that do not exist.
pub fn apply_skin(mesh: &mut Mesh, joints: &[DMat4], influences: &[SkinWeights], owner: &str) -> Result<()> {
    let mut sums = vec![DMat4::ZERO; mesh.positions.len()];
    for (indices, weights) in influences {
        if indices.len() != sums.len() || weights.len() != sums.len() {
            return Err(unlike(owner));
        }
        for ((sum, indices), weights) in sums.iter_mut().zip(indices).zip(weights) {
            for (index, weight) in indices.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
                let joint = joints.get(*index as usize).ok_or_else(|| unlike(owner))?;
                *sum += *joint * *weight;
            }
        }
    }
    for (vertex, sum) in sums.into_iter().enumerate() {
        // Normalises weights that do not add up to exactly 1.
        let matrix = DAffine3::from_mat4(sum * sum.w_axis.w.recip());
        if !matrix.is_finite() {
            return Err(unlike(owner));
        }
        mesh.positions[vertex] = matrix.transform_point3(mesh.positions[vertex]);
        mesh.normals[vertex] = (cofactors(matrix.matrix3) * mesh.normals[vertex]).normalize_or_zero();
    }
    Ok(())
}

fn unlike(owner: &str) -> Error {
    damaged(owner, "its morph targets or its skin do not fit its vertices")
}
