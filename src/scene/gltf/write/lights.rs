//! Lights as glTF states them: KHR_lights_punctual and EXT_lights_area, at nodes of their own.

use glam::{DMat3, DQuat, DVec3};
use gltf::json::Value;
use serde_json::json;

use super::super::glb::Glb;
use super::super::{area_light, light, spectrum};
use super::placed;
use crate::error::Warning;
use crate::optics::LinearSrgb;
use crate::optics::spectrum::illuminant;
use crate::scene::{Light, LightKind, LightSize, PanelShape, Scene};
use crate::units::LUMENS_PER_WATT;

/// Adds every light that is not the glow of an object, which its material states.
pub fn add_all(scene: &Scene, glb: &mut Glb, warnings: &mut Vec<Warning>) {
    for source in &scene.lights {
        let lost = |what: &str| {
            let remedy = "name it when the file is opened (--environment)";
            Warning::new(format!("light `{}`", source.name), what.to_owned(), remedy)
        };
        let Some((list, stated)) = stated(source) else {
            if matches!(source.kind, LightKind::Environment { .. }) {
                warnings.push(lost(
                    "is an environment, which glTF has no place for; it was left out",
                ));
            }
            continue;
        };
        let (extras, is_whole) = extras(source);
        if !is_whole {
            warnings.push(lost(
                "has a spectrum without a name; its colour was written instead",
            ));
        }
        let mut node = node(source, scene.origin_world);
        if extras != json!({}) {
            node["extras"] = extras;
        }
        let index = add_to_list(list, stated, glb);
        node["extensions"][list]["light"] = json!(index);
        let node = glb.push("nodes", node);
        glb.push_root(node);
    }
}

fn add_to_list(list: &str, stated: Value, glb: &mut Glb) -> usize {
    glb.use_extension(list);
    let lights = &mut glb.json["extensions"][list]["lights"];
    match lights.as_array_mut() {
        Some(lights) => {
            lights.push(stated);
            lights.len() - 1
        }
        None => {
            *lights = json!([stated]);
            0
        }
    }
}

/// The extension that lists a light, and its entry without the colour.
pub fn stated(source: &Light) -> Option<(&'static str, Value)> {
    let (list, mut stated) = by_kind(source)?;
    let colour = match named_spectrum(source) {
        Some(_) => LinearSrgb::WHITE,
        None => source.colour,
    };
    stated["color"] = json!(colour.to_array().map(|channel| channel.max(0.0)));
    Some((list, stated))
}

/// The name of a light's spectrum, by which it is found again.
fn named_spectrum(source: &Light) -> Option<&str> {
    let name = source.spectrum.as_ref()?.name()?;
    illuminant(name).is_ok().then_some(name)
}

/// What glTF has no place for, and whether all of it could be stated: a spectrum without a name cannot.
pub fn extras(source: &Light) -> (Value, bool) {
    let mut extras = json!({});
    let name = named_spectrum(source);
    if let Some(name) = name {
        extras[spectrum::KEY] = json!(name);
    }
    match source.size {
        LightSize::None => {}
        LightSize::Radius { radius_m } => extras["radius_m"] = json!(radius_m),
        LightSize::Angle { diameter_rad } => {
            extras["angular_diameter_deg"] = json!(diameter_rad.to_degrees());
        }
    }
    (extras, name.is_some() == source.spectrum.is_some())
}

fn by_kind(source: &Light) -> Option<(&'static str, Value)> {
    let photometric = source.kind.strength() * LUMENS_PER_WATT;
    let punctual = |kind: &str| json!({ "type": kind, "intensity": photometric });
    match source.kind {
        LightKind::Point { .. } => Some((light::NAME, punctual("point"))),
        LightKind::Sun { .. } => Some((light::NAME, punctual("directional"))),
        LightKind::Spot {
            inner_cone_rad,
            outer_cone_rad,
            ..
        } => {
            let mut spot = punctual("spot");
            spot["spot"] = json!({ "innerConeAngle": inner_cone_rad, "outerConeAngle": outer_cone_rad });
            Some((light::NAME, spot))
        }
        LightKind::Panel {
            across, down, shape, ..
        } => {
            let (name, aspect) = match shape {
                PanelShape::Rectangle => ("rect", across.length() / down.length()),
                PanelShape::Disc => ("disk", 1.0),
            };
            let panel = json!({ "type": name, "shape": name, "intensity": photometric,
                "size": 2.0 * down.length(), "rect": { "aspect": aspect } });
            Some((area_light::NAME, panel))
        }
        LightKind::Surface { .. } | LightKind::Environment { .. } => None,
    }
}

/// A node whose −z is the way that the light goes.
pub fn node(source: &Light, shift: DVec3) -> Value {
    let position = source
        .kind
        .position()
        .map_or(DVec3::ZERO, |position| position + shift);
    let turn = match source.kind {
        LightKind::Spot { direction, .. } | LightKind::Sun { direction, .. } => {
            DQuat::from_rotation_arc(DVec3::NEG_Z, direction)
        }
        LightKind::Panel { across, down, .. } => {
            let right = across.normalize();
            let back = -across.cross(down).normalize();
            DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back))
        }
        _ => DQuat::IDENTITY,
    };
    placed(&source.name, position, turn)
}
