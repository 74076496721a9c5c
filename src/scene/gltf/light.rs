//! Lights of KHR_lights_punctual.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::Path;

use glam::DVec3;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as Source, Spot, Type};
use gltf::json::validation::Checked;

use super::document::Document;
use super::nodes::PlacedNode;
use super::numbers::{widen, widen_all};
use super::report::Report;
use super::{area_light, sizes, spectrum};
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::{Light, LightKind};
use crate::units::{Irradiance, LUMENS_PER_WATT, RadiantIntensity};

/// All lights of a file: punctual lights, then area lights. Unreadable ones are left out with a warning.
///
/// # Errors
/// Those of [`spectrum::apply`].
pub fn all(
    document: &Document,
    placed: &[PlacedNode],
    folder: &Path,
    report: &mut Report,
) -> Result<Vec<(Light, Origin)>> {
    let mut lights = punctual(document, placed, folder, report)?;
    area_light::add_all(&mut lights, document, placed, folder, report)?;
    Ok(lights)
}

/// Punctual lights of non-zero power of the placed nodes, node by node.
fn punctual(
    document: &Document,
    placed: &[PlacedNode],
    folder: &Path,
    report: &mut Report,
) -> Result<Vec<(Light, Origin)>> {
    let root = &document.root;
    let extension = root
        .extensions
        .as_ref()
        .and_then(|extensions| extensions.khr_lights_punctual.as_ref());
    let sources = extension.map_or(&[][..], |extension| &extension.lights);
    let on_node = |placed: &PlacedNode| {
        let extensions = root.nodes[placed.node].extensions.as_ref()?;
        Some(extensions.khr_lights_punctual.as_ref()?.light.value())
    };
    let mut lights = Vec::new();
    for placed in placed {
        let Some(index) = on_node(placed) else { continue };
        let owner = format!("light `{}`", placed.name);
        let Some(source) = sources.get(index) else {
            left_out(report, &owner, &format!("is light {index}, which does not exist"));
            continue;
        };
        let kind = match read(source, placed, &owner, report) {
            Ok(kind) => kind,
            Err(why) => {
                left_out(report, &owner, &why);
                continue;
            }
        };
        let extras = &document.extras;
        let sizes = [extras.nodes.get(placed.node), extras.lights.get(index)];
        let mut light = Light {
            colour: widen_all(source.color).into(),
            size: sizes::read(sizes, &kind, &owner, report),
            ..Light::new(light_name(placed, lights.len()), kind)
        };
        let stated = spectrum::stated(document, placed.node, &extras.lights, index);
        spectrum::apply(&mut light, stated, folder, &owner, report)?;
        let (node, list) = (placed.node, NAME);
        lights.push((light, Origin { node, list, index }));
    }
    Ok(lights)
}

/// Origin of a light in its file.
#[derive(Clone, Copy, Debug)]
pub struct Origin {
    /// glTF index of its node.
    pub node: usize,
    /// Extension that lists it.
    pub list: &'static str,
    /// Index in that list.
    pub index: usize,
}

/// Extension of punctual lights.
pub(super) const NAME: &str = "KHR_lights_punctual";

/// Name of the node; `lightN` without one.
pub(super) fn light_name(placed: &PlacedNode, index: usize) -> String {
    let unnamed = placed.name == format!("node{}", placed.node);
    if unnamed {
        format!("light{index}")
    } else {
        placed.name.clone()
    }
}

/// Warns of a light that is left out.
pub(super) fn left_out(report: &mut Report, owner: &str, why: &str) {
    report.warn(
        owner,
        format!("{why}; it was left out"),
        "repair the light or remove it",
    );
}

fn read(
    source: &Source,
    placed: &PlacedNode,
    owner: &str,
    report: &mut Report,
) -> std::result::Result<LightKind, String> {
    let colour = LinearSrgb::from(widen_all(source.color));
    if !colour.is_finite() || colour.to_array().iter().any(|channel| *channel < 0.0) {
        return Err("has a colour that is negative or not finite".into());
    }
    let strength = widen(source.intensity) / LUMENS_PER_WATT;
    if !(strength >= 0.0 && strength.is_finite()) {
        return Err(format!("has an intensity of {}", source.intensity));
    }
    if strength * colour.luminance() == 0.0 {
        return Err("has no power".into());
    }
    if source.range.is_some() {
        report.warn(
            owner,
            "its range was ignored, since light does not end at a distance",
            "lower its intensity instead",
        );
    }
    let position = placed.world_from_node.translation;
    let direction = placed
        .world_from_node
        .transform_vector3(DVec3::NEG_Z)
        .try_normalize();
    let direction = || direction.ok_or("has no direction, since its node is scaled to nothing");
    match source.type_ {
        Checked::Valid(Type::Point) => Ok(LightKind::Point {
            position,
            intensity: RadiantIntensity(strength),
        }),
        Checked::Valid(Type::Directional) => Ok(LightKind::Sun {
            direction: direction()?,
            normal_irradiance: Irradiance(strength),
        }),
        Checked::Valid(Type::Spot) => {
            let (inner_cone_rad, outer_cone_rad) = cone(source.spot.as_ref(), owner, report);
            Ok(LightKind::Spot {
                position,
                direction: direction()?,
                intensity: RadiantIntensity(strength),
                inner_cone_rad,
                outer_cone_rad,
            })
        }
        Checked::Invalid => Err("is of an unknown kind".into()),
    }
}

/// Half-angles of a spot [rad] with 0 ≤ inner < outer ≤ π/2.
fn cone(spot: Option<&Spot>, owner: &str, report: &mut Report) -> (f64, f64) {
    let Some(spot) = spot else {
        report.warn(
            owner,
            "states no cone; it was given one of 45 degrees",
            "state its angles",
        );
        return (0.0, FRAC_PI_4);
    };
    let (inner, mut outer) = (widen(spot.inner_cone_angle), widen(spot.outer_cone_angle));
    // π/2 in single precision lies slightly above that in double precision.
    if outer > FRAC_PI_2 && outer <= FRAC_PI_2 + 1e-6 {
        outer = FRAC_PI_2;
    }
    if !(outer > 0.0 && outer <= FRAC_PI_2) {
        report.warn(
            owner,
            format!("its outer cone angle of {outer} rad was read as π/4"),
            "use an angle above 0 and at most π/2",
        );
        outer = FRAC_PI_4;
    }
    if inner >= 0.0 && inner < outer {
        return (inner, outer);
    }
    // As hard an edge as stated, but of non-zero width, by which falloff can be divided.
    let repaired = if inner >= outer { outer * (1.0 - 1e-6) } else { 0.0 };
    report.warn(
        owner,
        format!("its inner cone angle of {inner} rad was read as {repaired:.4}"),
        "use an angle from 0 to below the outer one",
    );
    (repaired, outer)
}
