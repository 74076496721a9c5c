//! Edits of lights.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{check_place, existing, out_of_range};
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::optics::spectrum::Spectrum;
use crate::scene::{Light, LightKind, LightSize, Scene};

/// One property of a light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightEdit {
    /// [`LightKind::strength`]; > 0 and finite.
    Strength(f64),
    /// Extent: a radius for point lights and spots, an angle for suns; positive and finite.
    Size(LightSize),
    /// Position of a point light or spot, or centre of a panel, in scene coordinates [m].
    Position(DVec3),
    /// Direction of travel of the light of a spot or sun; of any length but 0, normalised on application.
    Direction(DVec3),
    /// Colour and, if known, its spectrum. The luminance is above 0; without a spectrum each channel is at least 0.
    Colour(LinearSrgb, Option<Arc<Spectrum>>),
}

/// Tolerance of the squared length of a unit direction, which is then kept bit for bit.
const UNIT: f64 = 1e-12;

impl LightEdit {
    /// Names for the log and for people.
    pub(super) fn names(&self) -> [&'static str; 2] {
        match self {
            Self::Strength(_) => ["LightPower", "power"],
            Self::Size(_) => ["LightSize", "size"],
            Self::Position(_) => ["LightPosition", "position"],
            Self::Direction(_) => ["LightDirection", "direction"],
            Self::Colour(..) => ["LightColour", "colour"],
        }
    }

    pub(super) fn apply(&self, light: &mut Light) -> Result<()> {
        let owner = format!("light `{}`", light.name);
        let lacks = |what: &str, remedy: &str| Error::usage(&owner, format!("has no {what}"), remedy);

        // Every value is checked before it is set, so that a refused edit changes nothing.
        match self {
            Self::Strength(strength) => {
                if !(*strength > 0.0 && strength.is_finite()) {
                    let range = "what is above 0 and finite";
                    return Err(out_of_range(&owner, "strength", strength, range));
                }
                light.kind.set_strength(*strength);
            }
            Self::Size(size) => {
                check_size(&light.kind, *size, &owner)?;
                light.size = *size;
            }
            Self::Position(new) => {
                let why = "position, as it is a sun";
                let old = light
                    .kind
                    .position_mut()
                    .ok_or_else(|| lacks(why, "set its direction"))?;
                check_place(*new, &owner)?;
                *old = *new;
            }
            Self::Direction(new) => {
                let why = "direction, as it shines everywhere alike";
                let old = light
                    .kind
                    .direction_mut()
                    .ok_or_else(|| lacks(why, "set its position"))?;
                *old = unit(*new, &owner)?;
            }
            Self::Colour(colour, spectrum) => {
                check_colour(*colour, spectrum.is_some(), &owner)?;
                (light.colour, light.spectrum) = (*colour, spectrum.clone());
            }
        }
        Ok(())
    }

    /// Edits that turn `was` into `is`.
    pub(in crate::scene) fn diff(was: &Light, is: &Light) -> Vec<Self> {
        let mut edits = Vec::new();
        if was.kind.strength() != is.kind.strength() {
            edits.push(Self::Strength(is.kind.strength()));
        }
        let moved = is
            .kind
            .position()
            .filter(|position| was.kind.position() != Some(*position));
        edits.extend(moved.map(Self::Position));
        let turned = is
            .kind
            .direction()
            .filter(|direction| was.kind.direction() != Some(*direction));
        edits.extend(turned.map(Self::Direction));
        if was.size != is.size {
            edits.push(Self::Size(is.size));
        }
        if was.spectrum != is.spectrum || was.colour != is.colour {
            edits.push(Self::Colour(is.colour, is.spectrum.clone()));
        }
        edits
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

fn check_colour(colour: LinearSrgb, has_spectrum: bool, owner: &str) -> Result<()> {
    let channels = colour.to_array();
    let is_colour = has_spectrum || channels.iter().all(|channel| *channel >= 0.0);
    if is_colour && colour.luminance() > 0.0 && colour.is_finite() {
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

/// Appends a light to a scene.
pub(super) fn add(scene: &mut Scene, added: &Arc<Light>) -> Result<()> {
    check(added)?;
    scene.lights.push(Light::clone(added));
    scene.light_list.added.push(Arc::clone(added));
    Ok(())
}

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
    match scene.original_light_index(index) {
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

/// Reason why a light cannot be removed from its scene; `None` if it can.
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

/// Checks an added light, since an edit that was read from a file may have been written by hand.
fn check(light: &Light) -> Result<()> {
    // Only lamps can be added: glowing objects and the environment bring their own lights.
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
        } => {
            let area = across.cross(down).length();
            numbers(&centre.to_array()) && area > 0.0 && area.is_finite()
        }
        LightKind::Surface { .. } | LightKind::Environment { .. } => false,
    };
    let owner = format!("light `{}`", light.name);
    let is_panel = matches!(light.kind, LightKind::Panel { .. });
    if !(is_panel && light.size == LightSize::None) {
        check_size(&light.kind, light.size, &owner)?;
    }
    check_colour(light.colour, light.spectrum.is_some(), &owner)?;

    // A scene holds no light without power.
    let strength = light.strength().luminance();
    if is_sound && strength > 0.0 && strength.is_finite() {
        return Ok(());
    }
    Err(Error::usage(
        owner,
        "is none that can be added: it needs a place, a direction and a power",
        "add a lamp, a spot, a sun or a panel",
    ))
}
