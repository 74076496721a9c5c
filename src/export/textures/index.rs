//! `index.json`: describes each texture of an export.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Encoding, TextureOptions};
use crate::export::manifest::{MapEntry, SceneSummary};
use crate::export::map_set::MapSet;
use crate::illumination::{Side, UvSet};
use crate::optics::luminance;
use crate::settings::LayerKind;

/// Version of the format.
pub const SCHEMA: u32 = 1;

/// Name of the file in its folder.
pub const FILE_NAME: &str = "index.json";

/// Marks an index of this program.
pub const KIND: &str = "nephroid textures";

/// By program. Values are to be those of `engines.md`.
const HOW_TO_LOAD: [(&str, &str); 4] = [
    (
        "three.js",
        "ktx2 with --units lux, since r180: light = await new KTX2Loader().detectSupport(renderer).loadAsync(file); \
         (exr: EXRLoader, hdr: HDRLoader) light.channel = 1 (0 for TEXCOORD_0); material.lightMap = light; \
         material.lightMapIntensity = 2 ** -exposure_stops",
    ),
    (
        "Godot",
        "exr with --units E/pi: import as Lossless or VRAM Uncompressed; in a spatial shader \
         EMISSION = base_colour * texture(light_map, UV2).rgb * scale",
    ),
    (
        "Unity",
        "exr with --units E/pi: texture type Lightmap; LightmapSettings.lightmaps = new[] { new LightmapData { \
         lightmapColor = texture } }; renderer.lightmapIndex = 0",
    ),
    (
        "Bevy",
        "ktx2 with --units lux/pi: on the Mesh3d below the node of surface, \
         commands.entity(child).insert(Lightmap { image: assets.load(file), ..default() }); \
         material.lightmap_exposure = 2_f32.powf(-exposure_stops); for TEXCOORD_0, \
         mesh.insert_attribute(Mesh::ATTRIBUTE_UV_1, mesh.attribute(Mesh::ATTRIBUTE_UV_0).unwrap().clone())",
    ),
];

/// Everything in `index.json`.
#[derive(Clone, Debug, Serialize)]
pub struct TextureIndex {
    /// [`KIND`].
    pub kind: &'static str,
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of the program that wrote it.
    pub program_version: &'static str,
    /// Format of the files.
    pub encoding: Encoding,
    /// `E`, `E/pi`, `lux` or `lux/pi`.
    pub quantity: super::Quantity,
    /// Unit of the quantity; a value in a file is the quantity in that unit times 2^`exposure_stops`.
    pub unit: &'static str,
    /// Values were multiplied by 2 to this power.
    pub exposure_stops: f64,
    /// Primaries of all values.
    pub primaries: &'static str,
    /// Edge of the images that comes first.
    pub row_0: &'static str,
    /// Scene of the maps.
    pub scene: SceneSummary,
    /// How programs load the files, a few lines for each.
    pub how_to_load: BTreeMap<&'static str, &'static str>,
    /// Frames per second of a sequence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// One per file.
    pub textures: Vec<TextureEntry>,
}

/// One texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureEntry {
    /// File name, beside the index.
    pub file: String,
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// Number of mip levels in the file; 1 is the image alone.
    pub levels: usize,
    /// Layers whose sum it holds.
    pub layers: Vec<LayerKind>,
    /// The light whose part of them it holds; `None` for all lights.
    pub light: Option<String>,
    /// What the file does not hold.
    pub lost: Loss,
    pub maps: Vec<PlacedMap>,
}

/// Where a map lies in a texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlacedMap {
    /// Name of the node in the scene's file.
    pub surface: String,
    /// glTF index of the node.
    pub node: usize,
    /// Index of the primitive within the node's mesh.
    pub primitive: usize,
    /// Side of the surface.
    pub side: Side,
    /// Texture coordinates of the map, before [`Rectangle`] places them.
    pub uv_set: UvSet,
    /// File of generated coordinates, beside the index.
    pub uv_file: Option<String>,
    /// Where its texels are.
    pub rectangle: Rectangle,
    /// Frame of a sequence, counted from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<usize>,
}

/// A part of a texture. Map coordinates (u, v) lie at (x + u·width, y + v·height) [texels].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rectangle {
    /// Texels from the left.
    pub x: usize,
    /// Texels from row 0.
    pub y: usize,
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
}

impl Rectangle {
    /// The whole of a texture.
    pub fn whole((width, height): (usize, usize)) -> Self {
        Self {
            x: 0,
            y: 0,
            width,
            height,
        }
    }
}

impl PlacedMap {
    /// Place of a map from a folder; `uv_file` has its generated coordinates.
    pub(super) fn new(
        (reader, entry): (&MapSet<'_>, &MapEntry),
        uv_file: Option<String>,
        rectangle: Rectangle,
    ) -> Self {
        Self {
            surface: entry.surface.clone(),
            node: entry.node,
            primitive: entry.primitive,
            side: entry.side,
            uv_set: entry.uv_set,
            uv_file,
            rectangle,
            frame: reader.frame().map(|frame| frame + 1),
        }
    }
}

impl TextureIndex {
    /// Index of textures that were made from a folder of maps.
    pub(super) fn new(
        reader: &MapSet<'_>,
        options: TextureOptions,
        exposure_stops: f64,
        textures: Vec<TextureEntry>,
    ) -> Self {
        Self {
            kind: KIND,
            schema: SCHEMA,
            program_version: env!("CARGO_PKG_VERSION"),
            encoding: options.encoding,
            quantity: options.quantity,
            unit: options.quantity.unit(),
            exposure_stops,
            primaries: "BT.709 (linear sRGB)",
            row_0: "v = 0",
            scene: reader.scene_summary().clone(),
            how_to_load: HOW_TO_LOAD.into_iter().collect(),
            fps: reader.fps(),
            textures,
        }
    }
}

impl TextureEntry {
    /// Names of its file and of its maps' coordinate files.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let uvs = self.maps.iter().filter_map(|map| map.uv_file.as_deref());
        std::iter::once(self.file.as_str()).chain(uvs)
    }
}

/// Differences between light and what a reader of its file gets. A texel counts once, whichever channels differ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Loss {
    /// Texels above the largest value of the file.
    pub above_texels: usize,
    /// Share of all light above that value, [0, 1].
    pub above_share: f64,
    /// Texels below 0 (colours outside of sRGB) that became 0.
    pub negative_texels: usize,
    /// Texels whose light was below the smallest step and became 0.
    pub vanished_texels: usize,
    /// √(mean((stored − light)²)) / mean(light) of luminance, over all texels of the file; 0 without light.
    pub relative_rmse: f64,
}

impl Loss {
    /// Compares light with what a reader gets, texel by texel; `most` is the largest value of the file.
    pub fn measure(light: &[[f32; 3]], stored: &[[f32; 3]], most: f32) -> Self {
        let (mut above, mut negative, mut vanished) = (0, 0, 0);
        let (mut all, mut cut, mut squares, mut mean) = (0.0, 0.0, 0.0, 0.0);
        for (wanted, got) in light.iter().zip(stored) {
            let has = |is: &dyn Fn(f32, f32) -> bool| {
                usize::from(wanted.iter().zip(got).any(|(wanted, got)| is(*wanted, *got)))
            };
            above += has(&|wanted, _| wanted > most);
            negative += has(&|wanted, got| wanted < 0.0 && got >= 0.0);
            vanished += has(&|wanted, got| wanted > 0.0 && got <= 0.0);

            // White clips each channel by itself, so that clipped light is summed by channel.
            for value in wanted {
                all += f64::from(value.max(0.0));
                cut += (f64::from(*value) - f64::from(most)).max(0.0);
            }

            // Luminance weighs the error as the eye does, whatever caused it: clipping, steps or blocks.
            let [wanted, got] = [wanted, got].map(luminance);
            mean += wanted;
            squares += (got - wanted) * (got - wanted);
        }

        // Without light there is nothing that an error could be relative to.
        let texels = light.len() as f64;
        Self {
            above_texels: above,
            above_share: if all > 0.0 { cut / all } else { 0.0 },
            negative_texels: negative,
            vanished_texels: vanished,
            relative_rmse: if mean > 0.0 {
                (squares / texels).sqrt() / (mean / texels)
            } else {
                0.0
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_loss_is_counted() {
        let light = [[2.0, 1.0, 0.5], [-0.1, 0.2, 0.0], [1e-9, 0.0, 0.0], [0.25; 3]];
        let stored = [[1.0, 1.0, 0.5], [0.0, 0.2, 0.0], [0.0; 3], [0.25; 3]];
        let loss = Loss::measure(&light, &stored, 1.0);
        assert_eq!(
            (loss.above_texels, loss.negative_texels, loss.vanished_texels),
            (1, 1, 1)
        );
        assert!((loss.above_share - 1.0 / 4.45).abs() < 1e-6, "{loss:?}");
        assert!(loss.relative_rmse > 0.0);
        let same = Loss::measure(&light, &light, 10.0);
        assert_eq!((same.above_share, same.relative_rmse), (0.0, 0.0));
    }
}
