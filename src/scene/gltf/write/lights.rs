//! Writes lights as KHR_lights_punctual and EXT_lights_area, each on its own node.

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

/// Adds every light but those of emissive objects, which their materials state.
pub fn add_all(scene: &Scene, glb: &mut Glb, warnings: &mut Vec<Warning>) {
    for source in &scene.lights {
        let lost = match (&source.kind, &source.spectrum) {
            (LightKind::Environment { .. }, _) => Some((
                "is an environment, which glTF has no place for; it was left out",
                "name it when the file is opened (--environment)",
            )),
            (_, Some(_)) if named_spectrum(source).is_none() && stated(source).is_some() => Some((
                "has a spectrum without a name; its colour was written instead",
                "name its spectrum in the `extras` of the light",
            )),
            _ => None,
        };
        if let Some((lost, remedy)) = lost {
            warnings.push(Warning::new(format!("light `{}`", source.name), lost, remedy));
        }
        add(source, scene.origin_world, glb);
    }
}

/// Adds a light on a node of its own, if glTF can represent it.
pub fn add(source: &Light, shift: DVec3, glb: &mut Glb) {
    let Some((list, stated)) = stated(source) else {
        return;
    };
    let mut node = node(source, shift);
    let extras = extras(source);
    if extras != json!({}) {
        node["extras"] = extras;
    }
    let index = glb.push(&format!("/extensions/{list}/lights"), stated);
    node["extensions"][list]["light"] = json!(index);
    glb.push_root(node);
}

/// Extension that lists a light, and the light's entry there.
pub fn stated(source: &Light) -> Option<(&'static str, Value)> {
    let (list, mut stated) = by_kind(source)?;
    let colour = match named_spectrum(source) {
        Some(_) => LinearSrgb::WHITE,
        None => source.colour,
    };
    stated["color"] = json!(colour.to_array().map(|channel| channel.max(0.0)));
    Some((list, stated))
}

/// Name of a light's spectrum, if the spectrum can be found by it.
pub fn named_spectrum(source: &Light) -> Option<&str> {
    let name = source.spectrum.as_ref()?.name()?;
    illuminant(name).is_ok().then_some(name)
}

/// Keys of light properties that glTF lacks, in the extras of the light's node.
pub const EXTRAS: [&str; 3] = [spectrum::KEY, "radius_m", "angular_diameter_deg"];

/// Values of a light for these keys.
pub fn extras(source: &Light) -> Value {
    let size = match source.size {
        LightSize::None => [None; 2],
        LightSize::Radius { radius_m } => [Some(radius_m), None],
        LightSize::Angle { diameter_rad } => [None, Some(diameter_rad.to_degrees())],
    };
    let [radius, angle] = size.map(|size| size.map(Value::from));
    let stated = [named_spectrum(source).map(Value::from), radius, angle];
    let stated = EXTRAS.into_iter().zip(stated);
    stated
        .filter_map(|(key, value)| Some((key.to_owned(), value?)))
        .collect()
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

/// A node whose −z is the light's direction of travel.
fn node(source: &Light, shift: DVec3) -> Value {
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
