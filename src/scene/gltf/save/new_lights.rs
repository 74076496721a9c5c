//! Lights that are new to a file: a node of their own each, and an entry in the list of its extension.

use glam::{DMat3, DQuat, DVec3};
use gltf::json::Value;
use serde_json::{Map, json};

use super::json_document::JsonDocument;
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::optics::spectrum::illuminant;
use crate::scene::gltf::document::Document;
use crate::scene::gltf::{area_light, light, spectrum};
use crate::scene::{Light, LightKind, LightSize, PanelShape};
use crate::units::LUMENS_PER_WATT;

/// Whether there is a node for lights of this kind.
pub fn can_be_written(kind: &LightKind) -> bool {
    !matches!(kind, LightKind::Surface { .. } | LightKind::Environment { .. })
}

/// Writes a light as a node at the top of the scene that is shown.
///
/// # Errors
/// A spectrum without a name.
pub fn write(light: &Light, shift: DVec3, document: &Document, json: &mut JsonDocument) -> Result<()> {
    let (list, entry) = entry(light);
    let listed = json.append(&format!("/extensions/{list}/lights"), entry);
    json.use_extension(list);
    let mut node = json!({
        "name": light.name,
        "rotation": turn(&light.kind).to_array(),
        "extensions": {list: {"light": listed}},
    });
    if let Some(position) = light.kind.position() {
        node["translation"] = json!((position + shift).to_array());
    }
    let extras = extras(light)?;
    if !extras.is_empty() {
        node["extras"] = Value::Object(extras);
    }
    let node = json.append("/nodes", node);
    let scene = document.root.scene.map_or(0, |scene| scene.value());
    // Without scenes, nodes that are nobody's child are at the top.
    if json.get(&format!("/scenes/{scene}")).is_some() {
        json.append(&format!("/scenes/{scene}/nodes"), json!(node));
    }
    Ok(())
}

/// The extension that lists such lights, and what it lists.
fn entry(light: &Light) -> (&'static str, Value) {
    let colour = match light.spectrum {
        Some(_) => LinearSrgb::WHITE,
        None => light.colour,
    };
    let (list, kind) = match light.kind {
        LightKind::Spot { .. } => (light::NAME, "spot"),
        LightKind::Sun { .. } => (light::NAME, "directional"),
        LightKind::Panel { shape, .. } => match shape {
            PanelShape::Rectangle => (area_light::NAME, "rect"),
            PanelShape::Disc => (area_light::NAME, "disk"),
        },
        _ => (light::NAME, "point"),
    };
    let mut entry = json!({
        "type": kind,
        "color": colour.to_array(),
        "intensity": light.kind.strength() * LUMENS_PER_WATT,
    });
    match light.kind {
        LightKind::Spot {
            inner_cone_rad,
            outer_cone_rad,
            ..
        } => {
            let cone = json!({"innerConeAngle": inner_cone_rad, "outerConeAngle": outer_cone_rad});
            entry["spot"] = cone;
        }
        LightKind::Panel {
            across, down, shape, ..
        } => {
            entry["size"] = json!(2.0 * down.length());
            if shape == PanelShape::Rectangle {
                entry["rect"] = json!({"aspect": across.length() / down.length()});
            }
        }
        _ => {}
    }
    (list, entry)
}

/// From the node to the world: lights shine along −z.
fn turn(kind: &LightKind) -> DQuat {
    match *kind {
        LightKind::Spot { direction, .. } | LightKind::Sun { direction, .. } => {
            DQuat::from_rotation_arc(DVec3::NEG_Z, direction)
        }
        LightKind::Panel { across, down, .. } => {
            let z = -across.cross(down).normalize();
            let x = across.normalize();
            DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z)).normalize()
        }
        _ => DQuat::IDENTITY,
    }
}

/// What glTF has no place for: size and spectrum.
fn extras(light: &Light) -> Result<Map<String, Value>> {
    let mut extras = Map::new();
    match light.size {
        LightSize::None => {}
        LightSize::Radius { radius_m } => drop(extras.insert("radius_m".into(), json!(radius_m))),
        LightSize::Angle { diameter_rad } => {
            extras.insert("angular_diameter_deg".into(), json!(diameter_rad.to_degrees()));
        }
    }
    if let Some(spectrum) = &light.spectrum {
        let name = spectrum.name().filter(|name| illuminant(name).is_ok());
        let name = name.ok_or_else(|| {
            Error::failure(
                format!("light `{}`", light.name),
                "has a spectrum without a name, which a file cannot hold",
                "choose a colour or a named spectrum, and save again",
            )
        })?;
        extras.insert(spectrum::KEY.into(), json!(name));
    }
    Ok(extras)
}
