//! Area lights of EXT_lights_area, by its draft of 2025 (KhronosGroup/glTF, pull request 2525).
//!
//! A light lies in the node's xy plane around its origin and shines along −z. Its size is scaled uniformly, by the
//! largest scale of the node.

use std::path::Path;

use glam::DVec3;
use gltf::json::Value;
use serde::Deserialize;

use super::document::Document;
use super::light::{Origin, left_out, light_name};
use super::nodes::PlacedNode;
use super::report::Report;
use super::spectrum;
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::{Light, LightKind, PanelShape};
use crate::units::{LUMENS_PER_WATT, Radiance};

pub(super) const NAME: &str = "EXT_lights_area";

/// A light as stated in the file, unchecked.
#[derive(Deserialize)]
#[serde(default)]
struct AreaLightEntry {
    /// The draft's schema requires `shape` but then describes `type`: files have either or both.
    #[serde(rename = "type")]
    kind: Option<String>,
    shape: Option<String>,
    color: [f64; 3],
    /// [cd/m²].
    intensity: f64,
    /// Height of a rectangle, diameter of a disk, in the node's units.
    size: f64,
    rect: Rect,
}

#[derive(Deserialize)]
#[serde(default)]
struct Rect {
    /// Width over height.
    aspect: f64,
}

impl Default for AreaLightEntry {
    fn default() -> Self {
        Self {
            kind: None,
            shape: None,
            color: [1.0; 3],
            intensity: 1000.0,
            size: 1.0,
            rect: Rect::default(),
        }
    }
}

impl Default for Rect {
    fn default() -> Self {
        Self { aspect: 1.0 }
    }
}

/// Adds the area lights of the placed nodes that have non-zero power, node by node. Unreadable ones are left out with a
/// warning.
///
/// # Errors
/// Those of [`spectrum::apply`].
pub fn add_all(
    lights: &mut Vec<(Light, Origin)>,
    document: &Document,
    placed: &[PlacedNode],
    folder: &Path,
    report: &mut Report,
) -> Result<()> {
    let root = &document.root;
    let extension = root
        .extensions
        .as_ref()
        .and_then(|extensions| extensions.others.get(NAME));
    let sources = extension
        .and_then(|extension| extension.get("lights"))
        .and_then(Value::as_array);
    let sources = sources.map_or(&[][..], Vec::as_slice);
    for placed in placed {
        let extensions = root.nodes[placed.node].extensions.as_ref();
        let Some(on_node) = extensions.and_then(|extensions| extensions.others.get(NAME)) else {
            continue;
        };
        let owner = format!("light `{}`", placed.name);
        match lamp(on_node, sources, placed) {
            Ok((index, colour, kind)) => {
                let mut light = Light {
                    colour,
                    ..Light::new(light_name(placed, lights.len()), kind)
                };
                let stated = spectrum::stated(document, placed.node, &document.extras.area_lights, index);
                spectrum::apply(&mut light, stated, folder, &owner, report)?;
                let (node, list) = (placed.node, NAME);
                lights.push((light, Origin { node, list, index }));
            }
            Err(why) => left_out(report, &owner, &why),
        }
    }
    Ok(())
}

/// Index in the file's list, colour and kind of a light.
fn lamp(
    on_node: &Value,
    sources: &[Value],
    placed: &PlacedNode,
) -> std::result::Result<(usize, LinearSrgb, LightKind), String> {
    let index = on_node.get("light").and_then(Value::as_u64);
    let index = index.ok_or("does not say which area light it is")?;
    let missing = || format!("is area light {index}, which does not exist");
    let index = usize::try_from(index).map_err(|_| missing())?;
    let source = sources.get(index).ok_or_else(missing)?;
    let source =
        AreaLightEntry::deserialize(source).map_err(|error| format!("does not follow {NAME} ({error})"))?;
    let colour = LinearSrgb::from(source.color);
    if !colour.is_finite() || source.color.iter().any(|channel| *channel < 0.0) {
        return Err("has a colour that is negative or not finite".into());
    }
    let radiance = source.intensity / LUMENS_PER_WATT;
    if !(radiance >= 0.0 && radiance.is_finite()) {
        return Err(format!("has an intensity of {}", source.intensity));
    }
    if radiance * colour.luminance() == 0.0 {
        return Err("has no power".into());
    }
    let (shape, aspect) = match source.kind.or(source.shape).as_deref().unwrap_or("rect") {
        "rect" => (PanelShape::Rectangle, source.rect.aspect),
        "disk" => (PanelShape::Disc, 1.0),
        _ => return Err("is of an unknown shape".into()),
    };
    let (across, down) = half_axes(placed, source.size, aspect).ok_or("has no area")?;
    Ok((
        index,
        colour,
        LightKind::Panel {
            centre: placed.world_from_node.translation,
            across,
            down,
            shape,
            radiance: Radiance(radiance),
        },
    ))
}

/// From the centre of a light to its sides [m], across × down along the node's −z; `None` if it has no area.
fn half_axes(placed: &PlacedNode, size: f64, aspect: f64) -> Option<(DVec3, DVec3)> {
    let axes = placed.world_from_node.matrix3;
    let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis];
    let half_height_m = 0.5 * size * x.length().max(y.length()).max(z.length());
    let direction = -z.try_normalize()?;
    let right = x.reject_from_normalized(direction).try_normalize()?;
    let is_sound = size > 0.0 && aspect > 0.0;
    let (across, down) = (
        right * (half_height_m * aspect),
        direction.cross(right) * half_height_m,
    );
    let area_m2 = across.cross(down).length();
    (is_sound && area_m2 > 0.0 && area_m2.is_finite()).then_some((across, down))
}
