//! Edits of lights.

use std::sync::Arc;

use glam::DVec3;

use super::{Edit, check_place, existing, out_of_range};
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::scene::{Light, LightKind, LightSize, Scene};
use crate::units::{Irradiance, RadiantIntensity};

/// A direction whose squared length is this near to 1 is unit already and stays bit for bit.
const UNIT: f64 = 1e-12;

/// Edits a light.
pub(super) fn apply(edit: &Edit, light: &mut Light) -> Result<()> {
    let owner = format!("light `{}`", light.name);
    let lacks = |what: &str, remedy: &str| Error::usage(&owner, format!("has no {what}"), remedy);
    let kind = &mut light.kind;
    match edit {
        Edit::LightIntensity { intensity: new, .. } => {
            let instead = "set its normal irradiance";
            let old = intensity(kind).ok_or_else(|| lacks("radiant intensity, as it is a sun", instead))?;
            check_power(new.0, "W/sr", &owner)?;
            *old = *new;
        }
        Edit::LightNormalIrradiance {
            normal_irradiance: new,
            ..
        } => {
            let instead = "set its radiant intensity";
            let old = normal_irradiance(kind)
                .ok_or_else(|| lacks("normal irradiance, as it is no sun", instead))?;
            check_power(new.0, "W/m²", &owner)?;
            *old = *new;
        }
        Edit::LightPosition { position: new, .. } => {
            let old = position(kind).ok_or_else(|| lacks("position, as it is a sun", "set its direction"))?;
            check_place(*new, &owner)?;
            *old = *new;
        }
        Edit::LightDirection { direction: new, .. } => {
            let why = "direction, as it shines everywhere alike";
            let old = direction(kind).ok_or_else(|| lacks(why, "set its position"))?;
            *old = unit(*new, &owner)?;
        }
        Edit::LightBrightness { brightness: new, .. } => {
            let why = "brightness of its own, since it is a point or a direction";
            let old = brightness(&mut light.kind).ok_or_else(|| lacks(why, "set its intensity"))?;
            check_power(*new, "W/(m² sr)", &owner)?;
            *old = *new;
        }
        Edit::LightSize { size: new, .. } => {
            check_size(&light.kind, *new, &owner)?;
            light.size = *new;
        }
        Edit::LightColour { colour: new, .. } => {
            check_colour(*new, &owner)?;
            (light.colour, light.spectrum) = (*new, None);
        }
        Edit::LightSpectrum {
            colour,
            spectrum: new,
            ..
        } => {
            if !(colour.is_finite() && colour.luminance() > 0.0) {
                let value = format!("{:?}", colour.to_array());
                return Err(out_of_range(
                    &owner,
                    "colour",
                    value,
                    "what has a luminance above 0",
                ));
            }
            (light.colour, light.spectrum) = (*colour, new.clone());
        }
        _ => return Err(lacks("such property", "edit what it has")),
    }
    Ok(())
}

fn intensity(kind: &mut LightKind) -> Option<&mut RadiantIntensity> {
    match kind {
        LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => Some(intensity),
        _ => None,
    }
}

fn normal_irradiance(kind: &mut LightKind) -> Option<&mut Irradiance> {
    match kind {
        LightKind::Sun {
            normal_irradiance, ..
        } => Some(normal_irradiance),
        _ => None,
    }
}

fn brightness(kind: &mut LightKind) -> Option<&mut f64> {
    match kind {
        LightKind::Panel { radiance, .. } | LightKind::Surface { radiance, .. } => Some(&mut radiance.0),
        LightKind::Environment { scale } => Some(scale),
        _ => None,
    }
}

fn check_size(kind: &LightKind, size: LightSize, owner: &str) -> Result<()> {
    let is_sound = match (kind, size) {
        (LightKind::Point { .. } | LightKind::Spot { .. } | LightKind::Sun { .. }, LightSize::None) => true,
        (LightKind::Point { .. } | LightKind::Spot { .. }, LightSize::Radius { radius_m }) => {
            radius_m > 0.0 && radius_m.is_finite()
        }
        (LightKind::Sun { .. }, LightSize::Angle { diameter_rad }) => {
            diameter_rad > 0.0 && diameter_rad <= std::f64::consts::PI
        }
        _ => false,
    };
    if is_sound {
        return Ok(());
    }
    let range = "a radius above 0 m for point lights and spots, an angle above 0 and up to π for suns";
    Err(out_of_range(owner, "size", format!("{size:?}"), range))
}

fn position(kind: &mut LightKind) -> Option<&mut DVec3> {
    match kind {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(position),
        LightKind::Panel { centre, .. } => Some(centre),
        _ => None,
    }
}

fn direction(kind: &mut LightKind) -> Option<&mut DVec3> {
    match kind {
        LightKind::Spot { direction, .. } | LightKind::Sun { direction, .. } => Some(direction),
        _ => None,
    }
}

fn check_power(value: f64, unit: &str, owner: &str) -> Result<()> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    let range = "what is above 0 and finite";
    Err(out_of_range(owner, "strength", format!("{value} {unit}"), range))
}

fn check_colour(colour: LinearSrgb, owner: &str) -> Result<()> {
    let channels = colour.to_array();
    let is_light = channels.iter().all(|channel| *channel >= 0.0) && colour.luminance() > 0.0;
    if is_light && colour.is_finite() {
        return Ok(());
    }
    let range = "0 up, not all 0";
    Err(out_of_range(owner, "colour", format!("{channels:?}"), range))
}

fn unit(direction: DVec3, owner: &str) -> Result<DVec3> {
    if (direction.length_squared() - 1.0).abs() <= UNIT {
        return Ok(direction);
    }
    direction
        .try_normalize()
        .ok_or_else(|| out_of_range(owner, "direction", direction, "what has a length"))
}

/// Puts a light into a scene, behind those that are there.
pub(super) fn add(scene: &mut Scene, added: &Arc<Light>) -> Result<()> {
    check(added)?;
    scene.lights.push(Light::clone(added));
    scene.light_list.added.push(Arc::clone(added));
    Ok(())
}

/// Takes a light out of a scene.
pub(super) fn remove(scene: &mut Scene, index: usize) -> Result<()> {
    let found = existing(&mut scene.lights, index, "light")?;
    if let Some(why) = why_light_stays(&found.kind) {
        return Err(Error::usage(
            format!("light `{}`", found.name),
            why,
            "dim it instead",
        ));
    }
    let of_file = scene.lights.len() - scene.light_list.added.len();
    match scene.light_when_loaded(index) {
        Some(place) => {
            let removed = &mut scene.light_list.removed;
            removed.push(place);
            removed.sort_unstable();
        }
        None => drop(scene.light_list.added.remove(index - of_file)),
    }
    scene.lights.remove(index);
    Ok(())
}

/// Why a light cannot be taken out of its scene; `None` where it can.
pub fn why_light_stays(kind: &LightKind) -> Option<&'static str> {
    match kind {
        LightKind::Surface { .. } => Some("is the glow of an object, which would be seen without it"),
        LightKind::Environment { .. } => {
            Some("is what lies around the scene, which would be seen without it")
        }
        LightKind::Point { .. }
        | LightKind::Spot { .. }
        | LightKind::Sun { .. }
        | LightKind::Panel { .. } => None,
    }
}

/// What was kept may have been written by hand.
fn check(light: &Light) -> Result<()> {
    let numbers = |values: &[f64]| values.iter().all(|value| value.is_finite());
    let is_sound = match light.kind {
        LightKind::Point { position, .. } => numbers(&position.to_array()),
        LightKind::Spot {
            position,
            direction,
            inner_cone_rad,
            outer_cone_rad,
            ..
        } => {
            let is_cone = 0.0 <= inner_cone_rad
                && inner_cone_rad < outer_cone_rad
                && outer_cone_rad <= std::f64::consts::FRAC_PI_2;
            numbers(&position.to_array()) && direction.is_normalized() && is_cone
        }
        LightKind::Sun { direction, .. } => direction.is_normalized(),
        LightKind::Panel {
            centre, across, down, ..
        } => numbers(&centre.to_array()) && across.cross(down).length() > 0.0,
        LightKind::Surface { .. } | LightKind::Environment { .. } => false,
    };
    let strength = light.strength().luminance();
    if is_sound && strength > 0.0 && strength.is_finite() {
        return Ok(());
    }
    Err(Error::usage(
        format!("light `{}`", light.name),
        "is none that can be added: it needs a place, a direction and a power",
        "add a lamp, a spot, a sun or a panel",
    ))
}
