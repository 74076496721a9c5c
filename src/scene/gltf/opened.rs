//! A scene's file as something that may be changed: that which it was loaded from, or one made for it.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DAffine3;
use gltf::json::Value;

use super::glb::Glb;
use super::report::Report;
use super::save::Parts;
use super::{container, document, nodes, write};
use crate::error::{Error, Result, Warning};
use crate::files;
use crate::scene::Scene;

/// A document with everything that it needs.
#[derive(Debug)]
pub struct Opened {
    /// Document and data.
    pub glb: Glb,
    /// From each node to the world, by glTF index; nodes outside the scene are missing.
    pub world_from_node: BTreeMap<usize, DAffine3>,
    /// What the document cannot hold of the scene.
    pub warnings: Vec<Warning>,
}

/// The document of a scene: its file as it is, or for a built-in one a new one.
///
/// # Errors
/// A file that cannot be read any more or whose first buffer lies where nothing can be added.
pub fn open(scene: &Scene, most_bytes: u64) -> Result<Opened> {
    if scene.source.starts_with("builtin:") {
        let (glb, warnings) = write::document(scene)?;
        let world_from_node = (0..scene.objects.len())
            .map(|node| (node, DAffine3::IDENTITY))
            .collect();
        return Ok(Opened {
            glb,
            world_from_node,
            warnings,
        });
    }
    let path = Path::new(&scene.source);
    let bytes = files::read_file(path, most_bytes)?;
    let mut report = Report::default();
    let split = container::split(&bytes, &mut report)?;
    let typed = document::parse(split.json, &mut report)?;
    let placed = nodes::place(&typed, &mut report)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let parts = Parts::of(&bytes, split.json, folder, most_bytes)?;
    let broken = |what: String| Error::failure(&scene.source, what, "export the file again");
    let json: Value =
        serde_json::from_str(&parts.json.into_text()).map_err(|error| broken(error.to_string()))?;
    let has_elsewhere = json["buffers"][0].get("uri").is_some();
    if has_elsewhere {
        return Err(broken(
            "has its first buffer within its text, where nothing can be added".into(),
        ));
    }
    let binary = parts.chunks.get(8..).unwrap_or_default();
    let stated = json["buffers"][0]["byteLength"].as_u64().unwrap_or(0);
    let length = usize::try_from(stated).unwrap_or(usize::MAX).min(binary.len());
    Ok(Opened {
        glb: Glb::from_parts(json, binary[..length].to_vec()),
        world_from_node: placed
            .into_iter()
            .map(|placed| (placed.node, placed.world_from_node))
            .collect(),
        warnings: Vec::new(),
    })
}
