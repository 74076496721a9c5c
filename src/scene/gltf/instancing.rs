//! EXT_mesh_gpu_instancing, expanded into one node per instance.

use glam::DVec4;
use gltf::json::{Index, Node, Root, Value};
use serde::Deserialize;
use serde_json::json;

use super::accessor::{Formats, Reader};
use super::buffers::Buffers;
use super::context::{LoadContext, damaged};
use super::document::{Document, NodeTransform};
use super::extras;
use super::glb::Glb;
use crate::error::Result;

pub const NAME: &str = "EXT_mesh_gpu_instancing";

/// Memory of a node [bytes].
const NODE_BYTES: u64 = 1000;

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "UPPERCASE")]
struct Attributes {
    translation: Option<u32>,
    rotation: Option<u32>,
    scale: Option<u32>,
}

/// A node to be expanded into one node per instance.
#[derive(Debug)]
pub struct Instanced {
    node: usize,
    /// Names of its instances.
    names: Vec<String>,
    /// Transforms of its instances, relative to the node.
    transforms: Vec<NodeTransform>,
}

/// Whether a file has instanced nodes.
pub fn is_used(root: &Root) -> bool {
    root.nodes.iter().any(|node| stated(node).is_some())
}

fn stated(node: &Node) -> Option<&Value> {
    node.mesh?;
    node.extensions.as_ref()?.others.get(NAME)?.get("attributes")
}

/// All instanced nodes of a file.
///
/// # Errors
/// Instance transforms that cannot be read or differ in number; more memory than the budget has left.
pub fn read(root: &Root, buffers: &Buffers, load: &mut LoadContext) -> Result<Vec<Instanced>> {
    let reader = Reader { root, buffers };
    let mut all = Vec::new();
    for (index, node) in root.nodes.iter().enumerate() {
        let Some(stated) = stated(node) else {
            continue;
        };
        let name = extras::name(node.name.as_deref(), "node", index);
        let owner = format!("node `{name}`");
        let broken = |what: String| damaged(&owner, what);
        let attributes = Attributes::deserialize(stated)
            .map_err(|error| broken(format!("its instances cannot be read ({error})")))?;

        // Each part of the transforms may be missing, and then is that of the identity.
        let mut read = |index: Option<u32>| {
            let index = index.map(Index::new);
            index
                .map(|index| reader.vectors::<3>(index, Formats::Float, &owner, load))
                .transpose()
        };
        let (translations, scales) = (read(attributes.translation)?, read(attributes.scale)?);
        let rotations = attributes.rotation.map(Index::new);
        let rotations = rotations
            .map(|index| reader.vectors::<4>(index, Formats::FloatOrSigned, &owner, load))
            .transpose()?;

        // All parts that are there have one entry for each instance.
        let counts = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let count = counts.into_iter().flatten().max().unwrap_or(0);
        if counts.into_iter().flatten().any(|other| other != count) {
            return Err(broken(
                "its instances have different numbers of translations, rotations and scales".into(),
            ));
        }

        // A few bytes of transform become a whole node with a name.
        load.take(count as u64 * NODE_BYTES, &owner)?;
        let transform = |instance: usize| NodeTransform {
            matrix: None,
            translation: translations.as_ref().map(|all| all[instance]),
            rotation: rotations.as_ref().map(|all| unit(all[instance])),
            scale: scales.as_ref().map(|all| all[instance]),
        };
        all.push(Instanced {
            node: index,
            names: (1..=count).map(|number| format!("{name}_{number:04}")).collect(),
            transforms: (0..count).map(transform).collect(),
        });
    }
    Ok(all)
}

/// Normalises a rotation, which integers represent only approximately.
fn unit(rotation: [f64; 4]) -> [f64; 4] {
    DVec4::from(rotation)
        .try_normalize()
        .map_or(rotation, DVec4::into)
}

/// Adds a child node for each instance.
pub fn expand_instances(document: &mut Document, instanced: &[Instanced]) {
    for whole in instanced {
        let first = document.root.nodes.len();
        let mesh = document.root.nodes[whole.node].mesh.take();
        for (name, transform) in whole.names.iter().zip(&whole.transforms) {
            document.root.nodes.push(Node {
                name: Some(name.clone()),
                mesh,
                ..Node::default()
            });
            document.transforms.push(transform.clone());
            document.extras.nodes.push(Value::Null);
        }
        let children = (first..document.root.nodes.len()).map(|child| Index::new(child as u32));
        let node = &mut document.root.nodes[whole.node];
        node.children.get_or_insert_default().extend(children);
    }
}

impl Glb {
    /// The same in a document to be written.
    pub(super) fn expand_instances(&mut self, instanced: &[Instanced]) {
        for whole in instanced {
            let node = format!("/nodes/{}", whole.node);
            let mesh = self.json.pointer(&format!("{node}/mesh")).cloned();
            for (name, transform) in whole.names.iter().zip(&whole.transforms) {
                let mut part = json!({ "name": name, "mesh": mesh });
                let numbers = [
                    ("translation", transform.translation.map(|all| json!(all))),
                    ("rotation", transform.rotation.map(|all| json!(all))),
                    ("scale", transform.scale.map(|all| json!(all))),
                ];
                for (key, numbers) in numbers {
                    if let Some(numbers) = numbers {
                        part[key] = numbers;
                    }
                }
                let part = self.push("/nodes", part);
                self.push(&format!("{node}/children"), json!(part));
            }
            self.remove(&format!("{node}/mesh"));
            self.remove(&format!("{node}/extensions/{NAME}"));
        }
    }
}
