//! Lights that come and go.

use std::sync::Arc;

use super::existing;
use crate::error::{Error, Result};
use crate::scene::{Light, LightKind, Scene};

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
