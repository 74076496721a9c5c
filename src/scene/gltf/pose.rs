//! Morph targets and skins at rest: meshes bent as their file's first look has them.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::json::{Index, Value};
use serde::Deserialize;
use serde_json::Map;

use super::accessor::{Formats, Reader};
use super::nodes::Placed;
use super::report::Budget;
use crate::error::{Error, Result};
use crate::scene::Mesh;

/// What bends meshes, as the file states it. Faults in it cost the pose and not the scene, so it is read by itself.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Poses {
    nodes: Vec<Maybe<Node>>,
    meshes: Vec<Maybe<Morphed>>,
    skins: Vec<Maybe<Skin>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
enum Maybe<T> {
    Read(T),
    Broken(serde::de::IgnoredAny),
}

impl<T> Maybe<T> {
    fn get(&self) -> Option<&T> {
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

/// For each vertex four joints of its skin, and their weights.
pub type Influences = (Vec<[f64; 4]>, Vec<[f64; 4]>);

/// A primitive of a mesh at a node.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub node: usize,
    pub mesh: usize,
    pub primitive: usize,
}

impl Poses {
    /// Those of a file.
    pub fn of(file: &Map<String, Value>) -> Self {
        Self::deserialize(file).unwrap_or_default()
    }

    /// Whether a node has a skin, which stands where its joints do.
    pub fn has_skin(&self, node: usize) -> bool {
        self.node(node).is_some_and(|node| node.skin.is_some())
    }

    /// Whether a node bends its mesh by itself, so that no other node can share it.
    pub fn is_own(&self, node: usize) -> bool {
        let node = self.node(node);
        node.is_some_and(|node| node.skin.is_some() || !node.weights.is_empty())
    }

    /// Whether a primitive is bent.
    pub fn bend(&self, place: Place) -> bool {
        let mesh = self.meshes.get(place.mesh).and_then(Maybe::get);
        let part = mesh.and_then(|mesh| mesh.primitives.get(place.primitive));
        self.has_skin(place.node) || part.is_some_and(|part| !part.targets.is_empty())
    }

    fn node(&self, node: usize) -> Option<&Node> {
        self.nodes.get(node)?.get()
    }

    /// Moves a mesh by its morph targets.
    ///
    /// # Errors
    /// Targets that do not fit the mesh.
    pub fn morph(
        &self,
        place: Place,
        mesh: &mut Mesh,
        reader: Reader,
        owner: &str,
        budget: &mut Budget,
    ) -> Result<()> {
        let Some(morphed) = self.meshes.get(place.mesh).and_then(Maybe::get) else {
            return Ok(());
        };
        let of_node = self.node(place.node).map(|node| &node.weights);
        let weights = of_node
            .filter(|weights| !weights.is_empty())
            .unwrap_or(&morphed.weights);
        let targets = morphed.primitives.get(place.primitive).map(|part| &part.targets);
        for (weight, target) in weights.iter().zip(targets.into_iter().flatten()) {
            if *weight == 0.0 || !weight.is_finite() {
                continue;
            }
            for (key, moved) in [("POSITION", &mut mesh.positions), ("NORMAL", &mut mesh.normals)] {
                let Some(index) = target.get(key) else {
                    continue;
                };
                let deltas = reader.vectors::<3>(Index::new(*index), Formats::Float, owner, budget)?;
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

    /// Puts the vertices of a mesh with a skin where its joints have them in the world.
    ///
    /// # Errors
    /// A skin that does not exist or does not fit the mesh.
    pub fn skin(
        &self,
        place: Place,
        mesh: &mut Mesh,
        influences: &[Influences],
        placed: &[Placed],
        reader: Reader,
        owner: &str,
        budget: &mut Budget,
    ) -> Result<()> {
        let skin = self
            .node(place.node)
            .and_then(|node| self.skins.get(node.skin?)?.get());
        let matrices = skin.map(|skin| skin.matrices(placed, reader, owner, budget));
        let matrices = matrices.transpose()?.ok_or_else(|| unlike(owner))?;
        let mut sums = vec![DMat4::ZERO; mesh.positions.len()];
        for (joints, weights) in influences {
            if joints.len() != sums.len() || weights.len() != sums.len() {
                return Err(unlike(owner));
            }
            for ((sum, joints), weights) in sums.iter_mut().zip(joints).zip(weights) {
                for (joint, weight) in joints.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
                    let matrix = matrices.get(*joint as usize).ok_or_else(|| unlike(owner))?;
                    *sum += *matrix * *weight;
                }
            }
        }
        for (vertex, sum) in sums.into_iter().enumerate() {
            // Weights need not add up to exactly 1, nor matrices be affine.
            let matrix = DAffine3::from_mat4(sum * sum.w_axis.w.recip());
            if !matrix.is_finite() {
                return Err(unlike(owner));
            }
            let [x, y, z] = [
                matrix.matrix3.x_axis,
                matrix.matrix3.y_axis,
                matrix.matrix3.z_axis,
            ];
            let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
            mesh.positions[vertex] = matrix.transform_point3(mesh.positions[vertex]);
            mesh.normals[vertex] = (cofactors * mesh.normals[vertex]).normalize_or_zero();
        }
        Ok(())
    }
}

impl Skin {
    /// What brings vertices into the world, by joint.
    fn matrices(
        &self,
        placed: &[Placed],
        reader: Reader,
        owner: &str,
        budget: &mut Budget,
    ) -> Result<Vec<DMat4>> {
        let stands: HashMap<usize, &DAffine3> = placed
            .iter()
            .map(|placed| (placed.node, &placed.world_from_node))
            .collect();
        let inverse = match self.inverse_bind_matrices {
            None => vec![DMat4::IDENTITY; self.joints.len()],
            Some(index) => {
                let read = reader.vectors::<16>(Index::new(index), Formats::Float, owner, budget)?;
                read.iter().map(DMat4::from_cols_array).collect()
            }
        };
        if inverse.len() < self.joints.len() {
            return Err(unlike(owner));
        }
        let pairs = self.joints.iter().zip(inverse);
        let matrix = |(joint, inverse)| Some(DMat4::from(**stands.get(joint)?) * inverse);
        pairs
            .map(matrix)
            .collect::<Option<_>>()
            .ok_or_else(|| unlike(owner))
    }
}

fn unlike(owner: &str) -> Error {
    Error::failure(
        owner,
        "its morph targets or its skin do not fit its vertices",
        "export the file again",
    )
}
