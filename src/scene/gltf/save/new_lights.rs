//! Lights that are new to a file: a node of their own each, and an entry in the list of its extension.

use glam::DVec3;
use serde_json::json;

use super::JsonDocument;
use crate::error::{Error, Result};
use crate::scene::Light;
use crate::scene::gltf::document::Document;
use crate::scene::gltf::write::lights;

/// Writes a light as a node at the top of the scene that is shown.
///
/// # Errors
/// A spectrum without a name.
pub fn write(light: &Light, shift: DVec3, document: &Document, json: &mut JsonDocument) -> Result<()> {
    let Some((list, entry)) = lights::stated(light) else {
        return Ok(());
    };
    let (extras, is_whole) = lights::extras(light);
    if !is_whole {
        return Err(Error::failure(
            format!("light `{}`", light.name),
            "has a spectrum without a name, which a file cannot hold",
            "choose a colour or a named spectrum, and save again",
        ));
    }
    let listed = json.append(&format!("/extensions/{list}/lights"), entry);
    json.use_extension(list);
    let mut node = lights::node(light, shift);
    node["extensions"] = json!({list: {"light": listed}});
    if extras != json!({}) {
        node["extras"] = extras;
    }
    let node = json.append("/nodes", node);
    let scene = document.root.scene.map_or(0, |scene| scene.value());
    // Without scenes, nodes that are nobody's child are at the top.
    if json.get(&format!("/scenes/{scene}")).is_some() {
        json.append(&format!("/scenes/{scene}/nodes"), json!(node));
    }
    Ok(())
}
