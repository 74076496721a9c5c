//! Area lights of EXT_lights_area, by its draft of 2025 (KhronosGroup/glTF, pull request 2525).
//!
//! A light lies in the node's xy plane around its origin and shines along −z. Its size is scaled uniformly, by the
//! largest scale of the node.

use glam::DVec3;
use gltf::json::Value;
use serde::Deserialize;

use super::document::Document;
use super::light::{ReadLight, strength};
use super::nodes::PlacedNode;
use crate::optics::LinearSrgb;
use crate::scene::{LightKind, PanelShape};
use crate::units::Radiance;

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

/// The area light of a node, if it has one.
pub(super) fn read(document: &Document, placed: &PlacedNode) -> Option<ReadLight> {
    let root = &document.root;
    let on_node = root.nodes[placed.node].extensions.as_ref()?.others.get(NAME)?;
    let list = root.extensions.as_ref().and_then(|all| all.others.get(NAME));
    let sources = list.and_then(|list| list.get("lights")?.as_array());
    Some(lamp(on_node, sources.map_or(&[], Vec::as_slice), placed))
}

fn lamp(on_node: &Value, sources: &[Value], placed: &PlacedNode) -> ReadLight {
    let index = on_node.get("light").and_then(Value::as_u64);
    let index = index.ok_or("does not say which area light it is")?;
    let missing = || format!("is area light {index}, which does not exist");
    let index = usize::try_from(index).map_err(|_| missing())?;
    let source = sources.get(index).ok_or_else(missing)?;
    let source =
        AreaLightEntry::deserialize(source).map_err(|error| format!("does not follow {NAME} ({error})"))?;
    let colour = LinearSrgb::from(source.color);
    let radiance = strength(colour, source.intensity)?;
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
