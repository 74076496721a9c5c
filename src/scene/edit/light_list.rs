//! Lights that come and go.

use std::sync::Arc;

use super::{Edit, existing};
use crate::error::{Error, Result};
use crate::scene::{Light, LightKind, Scene};

/// Where a light that is put into a scene comes from.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum LightOrigin {
    /// It is a new one.
    #[default]
    New,
    /// It was taken out before: that of the scene as it was loaded, at this place there.
    Loaded(usize),
    /// It was taken out before, and looked like this when it was new.
    Added(Arc<Light>),
}

/// Puts a light into a scene, and gives the edit that takes it out again. New ones stand behind those of the file.
pub(super) fn add(
    scene: &mut Scene,
    light: Option<usize>,
    added: &Arc<Light>,
    origin: &LightOrigin,
) -> Result<Edit> {
    let index = light.unwrap_or(scene.lights.len());
    let of_file = scene.lights.len() - scene.light_list.added.len();
    let places = match origin {
        LightOrigin::Loaded(_) => 0..=of_file,
        LightOrigin::New | LightOrigin::Added(_) => of_file..=scene.lights.len(),
    };
    if !places.contains(&index) {
        return Err(Error::usage(
            format!("light `{}`", added.name),
            format!("cannot become light {index}: its place is one of {places:?}"),
            "leave its place open",
        ));
    }
    check(added)?;
    scene.lights.insert(index, Light::clone(added));
    let list = &mut scene.light_list;
    match origin {
        LightOrigin::New => list.added.insert(index - of_file, Arc::clone(added)),
        LightOrigin::Added(at_first) => list.added.insert(index - of_file, Arc::clone(at_first)),
        LightOrigin::Loaded(place) => list.removed.retain(|removed| removed != place),
    }
    Ok(Edit::LightRemoved { light: index })
}

/// Takes a light out of a scene, and gives the edit that puts it back.
pub(super) fn remove(scene: &mut Scene, index: usize) -> Result<Edit> {
    let found = existing(&mut scene.lights, index, "light")?;
    if let Some(why) = why_light_stays(&found.kind) {
        return Err(Error::usage(
            format!("light `{}`", found.name),
            why,
            "dim it instead",
        ));
    }
    let of_file = scene.lights.len() - scene.light_list.added.len();
    let origin = match scene.light_when_loaded(index) {
        Some(place) => {
            let removed = &mut scene.light_list.removed;
            removed.push(place);
            removed.sort_unstable();
            LightOrigin::Loaded(place)
        }
        None => LightOrigin::Added(scene.light_list.added.remove(index - of_file)),
    };
    Ok(Edit::LightAdded {
        light: Some(index),
        added: Arc::new(scene.lights.remove(index)),
        origin,
    })
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
