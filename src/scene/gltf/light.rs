//! Lights of KHR_lights_punctual and EXT_lights_area. glTF gives punctual lights no size, so it is read from `extras`,
//! of the node or else of the light: `radius_m` of point lights and spots, `angular_diameter_deg` of suns.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::Path;

use glam::DVec3;
use gltf::json::Value;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as Source, Spot, Type};
use gltf::json::validation::Checked;

use super::context::LoadContext;
use super::document::Document;
use super::extras::{widen, widen_all};
use super::nodes::PlacedNode;
use super::{area_light, extras, spectrum};
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::{Light, LightKind, LightSize};
use crate::units::{Irradiance, LUMENS_PER_WATT, RadiantIntensity};

/// Extension of punctual lights.
pub(super) const NAME: &str = "KHR_lights_punctual";

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

/// Index of a light in its list, its colour and kind; or why it is left out.
pub(super) type ReadLight = std::result::Result<(usize, LinearSrgb, LightKind), String>;

/// All lights of non-zero power of the placed nodes: punctual ones, then area lights. Unreadable ones are left out with
/// a warning.
///
/// # Errors
/// Those of [`spectrum::apply`].
pub fn all(
    document: &Document,
    placed: &[PlacedNode],
    folder: &Path,
    load: &mut LoadContext,
) -> Result<Vec<(Light, Origin)>> {
    // Lights of both extensions differ in how they are stated; what follows treats them alike.
    let of_file = &document.extras;
    let mut lights = Vec::new();
    for (list, of_lights) in [(NAME, &of_file.lights), (area_light::NAME, &of_file.area_lights)] {
        for placed in placed {
            let owner = format!("light `{}`", placed.name);
            let read = match list {
                NAME => punctual(document, placed, &owner, load),
                _ => area_light::read(document, placed),
            };

            // A fault costs its light, not the scene.
            let (index, colour, kind) = match read {
                None => continue,
                Some(Ok(read)) => read,
                Some(Err(why)) => {
                    let what = format!("{why}; it was left out");
                    load.warn(owner, what, "repair the light or remove it");
                    continue;
                }
            };

            // Nodes may share a light; what their own extras say comes first.
            let stated = |key: &str| {
                let of_node = extras::stated(&of_file.nodes, placed.node, key);
                of_node.or_else(|| extras::stated(of_lights, index, key))
            };
            let mut light = Light::new(placed.name_or("light", lights.len()), kind);
            light.colour = colour;
            if list == NAME {
                light.size = size(stated, &light.kind, &owner, load);
            }
            if let Some(stated) = stated(spectrum::KEY) {
                spectrum::apply(&mut light, stated, folder, &owner, load)?;
            }
            let node = placed.node;
            lights.push((light, Origin { node, list, index }));
        }
    }
    Ok(lights)
}

/// The punctual light of a node, if it has one.
fn punctual(
    document: &Document,
    placed: &PlacedNode,
    owner: &str,
    load: &mut LoadContext,
) -> Option<ReadLight> {
    let root = &document.root;
    let on_node = root.nodes[placed.node].extensions.as_ref()?;
    let index = on_node.khr_lights_punctual.as_ref()?.light.value();
    let list = root
        .extensions
        .as_ref()
        .and_then(|all| all.khr_lights_punctual.as_ref());
    let source = list.and_then(|list| list.lights.get(index));
    let source = source.ok_or_else(|| format!("is light {index}, which does not exist"));
    Some(source.and_then(|source| {
        let colour = LinearSrgb::from(widen_all(source.color));
        Ok((index, colour, kind(source, colour, placed, owner, load)?))
    }))
}

/// Strength of a light, per channel of its colour, from glTF's photometric intensity.
///
/// # Errors
/// Why it cannot be.
pub(super) fn strength(colour: LinearSrgb, intensity: f64) -> std::result::Result<f64, String> {
    if !colour.is_finite() || colour.to_array().iter().any(|channel| *channel < 0.0) {
        return Err("has a colour that is negative or not finite".into());
    }
    let strength = intensity / LUMENS_PER_WATT;
    if !(strength >= 0.0 && strength.is_finite()) {
        return Err(format!("has an intensity of {intensity}"));
    }
    match strength * colour.luminance() {
        0.0 => Err("has no power".into()),
        _ => Ok(strength),
    }
}

fn kind(
    source: &Source,
    colour: LinearSrgb,
    placed: &PlacedNode,
    owner: &str,
    load: &mut LoadContext,
) -> std::result::Result<LightKind, String> {
    // Light falls off with the square of the distance and ends nowhere, whatever range a game would cut it off at.
    let strength = strength(colour, widen(source.intensity))?;
    if source.range.is_some() {
        load.warn(
            owner,
            "its range was ignored, since light does not end at a distance",
            "lower its intensity instead",
        );
    }

    // Light leaves along the −z of the node, which may be scaled to nothing: only point lights shine all the same.
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
            let (inner_cone_rad, outer_cone_rad) = cone(source.spot.as_ref(), owner, load);
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
fn cone(spot: Option<&Spot>, owner: &str, load: &mut LoadContext) -> (f64, f64) {
    // A cone is required of a spot; 45° is what glTF gives one without an outer angle.
    let Some(spot) = spot else {
        load.warn(
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
        load.warn(
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
    load.warn(
        owner,
        format!("its inner cone angle of {inner} rad was read as {repaired:.4}"),
        "use an angle from 0 to below the outer one",
    );
    (repaired, outer)
}

/// Extent of a punctual light; 0 means none. Values that are invalid or unsuitable for the kind cause a warning.
fn size<'a>(
    stated: impl Fn(&str) -> Option<&'a Value>,
    kind: &LightKind,
    owner: &str,
    load: &mut LoadContext,
) -> LightSize {
    // A sun has an angle, as its distance is infinite; every other lamp has a radius.
    const RADIUS: (&str, &str, &str) = ("radius_m", "lamp", "use metres from 0 up");
    const ANGLE: (&str, &str, &str) = ("angular_diameter_deg", "sun", "use degrees from 0 to 180");
    let is_sun = matches!(kind, LightKind::Sun { .. });
    let ((key, kind, range), other) = if is_sun {
        (ANGLE, RADIUS.0)
    } else {
        (RADIUS, ANGLE.0)
    };
    if stated(other).is_some() {
        load.warn(
            owner,
            format!("its {other} was ignored"),
            format!("state {key} for a {kind}"),
        );
    }
    let Some(stated) = stated(key) else {
        return LightSize::None;
    };

    // A size of 0 states a light without extent and needs no warning.
    match stated.as_f64() {
        Some(0.0) => LightSize::None,
        Some(degrees) if is_sun && degrees > 0.0 && degrees <= 180.0 => LightSize::Angle {
            diameter_rad: degrees.to_radians(),
        },
        Some(radius_m) if !is_sun && radius_m > 0.0 && radius_m.is_finite() => LightSize::Radius { radius_m },
        _ => {
            let what = format!("its {key} was ignored, as it is not a size");
            load.warn(owner, what, range);
            LightSize::None
        }
    }
}
