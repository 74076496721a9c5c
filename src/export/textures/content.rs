//! Which light of a map a texture holds.

use crate::error::{Error, Result, Warning};
use crate::export::map_set::{MapSet, StoredLight, StoredMap};
use crate::files;
use crate::settings::LayerKind;

use super::index::PlacedMap;

/// Share of a map's light by which rounding may change the sum of the lights' parts.
const ROUNDING: f64 = 1e-4;

/// Light that textures hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Sum of all layers that were baked.
    Sum,
    /// One layer.
    Layer(LayerKind),
    /// Each layer in its own texture.
    EachLayer,
    /// Each light in its own texture, summed over its layers.
    EachLight,
}

/// The light of one texture.
#[derive(Clone, Debug)]
pub struct TextureLight {
    /// Layers in the sum.
    pub layers: Vec<LayerKind>,
    /// Name of the light, if it is one alone.
    pub light: Option<String>,
    /// Part of the file name; empty for the sum.
    pub key: String,
    /// E per texel [W/m²].
    pub irradiance: Vec<[f32; 3]>,
}

impl TextureLight {
    /// A copy without layers and irradiance.
    pub fn without_light(&self) -> Self {
        Self {
            layers: Vec::new(),
            light: self.light.clone(),
            key: self.key.clone(),
            irradiance: Vec::new(),
        }
    }

    /// End of the file name.
    pub fn suffix(&self) -> String {
        match self.key.as_str() {
            "" => String::new(),
            key => format!("_{key}"),
        }
    }

    /// Description for the file.
    pub fn what(&self, maps: &[PlacedMap]) -> String {
        let layers: Vec<&str> = self.layers.iter().map(|layer| layer.name()).collect();
        let surfaces: Vec<&str> = maps.iter().map(|map| map.surface.as_str()).collect();
        let light = self.light.as_ref().map(|light| format!(" of light {light}"));
        format!(
            "{}{} on {}",
            layers.join(" + "),
            light.unwrap_or_default(),
            surfaces.join(", ")
        )
    }
}

impl Content {
    /// # Errors
    /// A layer that no map has.
    pub fn check(self, reader: &MapSet<'_>) -> Result<()> {
        let Self::Layer(kind) = self else {
            return Ok(());
        };
        if reader.entries().iter().any(|entry| entry.layers.contains(&kind)) {
            return Ok(());
        }
        Err(Error::failure(
            reader.folder().display().to_string(),
            format!("the {} layer was not baked", kind.name()),
            "name a layer that was, or bake it (--layers)",
        ))
    }

    /// The textures of a map, and a warning about light that is in none of them. Empty if the map lacks a layer that
    /// others have, such as the back of a surface.
    ///
    /// # Errors
    /// A map without the requested parts of lights.
    pub fn parts(self, stored: &StoredMap) -> Result<(Vec<TextureLight>, Option<Warning>)> {
        let map = &stored.map;
        let kinds: Vec<LayerKind> = map.layers.iter().map(|layer| layer.kind).collect();
        let part = |layers: Vec<LayerKind>, key: &str, irradiance| TextureLight {
            layers,
            light: None,
            key: key.into(),
            irradiance,
        };
        let layer = |kind: LayerKind| {
            let layer = map.layer(kind)?;
            Some(part(vec![kind], kind.name(), layer.irradiance.clone()))
        };

        // The layers add up to the map. Shares of lights may leave something out, of which a warning tells.
        match self {
            Self::Sum => Ok((vec![part(kinds, "", map.total())], None)),
            Self::Layer(kind) => Ok((layer(kind).into_iter().collect(), None)),
            Self::EachLayer => Ok((kinds.into_iter().filter_map(layer).collect(), None)),
            Self::EachLight => {
                let parts = parts_of_lights(stored);
                if parts.is_empty() && has_light(&map.total()) {
                    return Err(lacking(
                        stored,
                        "holds no light apart from others",
                        "bake it with --per-light",
                    ));
                }
                let warning = rest(stored, &parts);
                Ok((parts, warning))
            }
        }
    }
}

fn lacking(stored: &StoredMap, what: impl Into<String>, remedy: &str) -> Error {
    Error::failure(format!("the map of {}", stored.entry.surface), what, remedy)
}

/// One texture for each light, in the order of the file.
fn parts_of_lights(stored: &StoredMap) -> Vec<TextureLight> {
    let mut parts: Vec<TextureLight> = Vec::new();
    for StoredLight { channels, irradiance } in &stored.lights {
        // Lights of the same name differ by their channels.
        let own = channels.channels.split_once('.').map_or("", |(_, own)| own);
        let key = files::slug(own, "light");
        let known = parts.iter().position(|part| part.key == key);
        let Some(known) = known else {
            parts.push(TextureLight {
                layers: vec![channels.layer],
                light: Some(channels.light.clone()),
                key,
                irradiance: irradiance.clone(),
            });
            continue;
        };
        let part = &mut parts[known];
        part.layers.push(channels.layer);
        let sums = part.irradiance.as_flattened_mut().iter_mut();
        for (sum, value) in sums.zip(irradiance.as_flattened()) {
            *sum += value;
        }
    }
    parts
}

/// The warning about light that is in no light's texture.
fn rest(stored: &StoredMap, parts: &[TextureLight]) -> Option<Warning> {
    let sum = |values: &[[f32; 3]]| {
        let values = values.as_flattened().iter();
        values.map(|value| f64::from(*value)).sum::<f64>()
    };
    let whole = sum(&stored.map.total());
    let of_lights: f64 = parts.iter().map(|part| sum(&part.irradiance)).sum();
    let left = 1.0 - of_lights / whole;
    (whole > 0.0 && left.abs() > ROUNDING).then(|| {
        Warning::new(
            format!("the map of {}", stored.entry.surface),
            format!("{:.2} % of its light is in the texture of no light", 100.0 * left),
            "write a layer or the sum beside them",
        )
    })
}

fn has_light(values: &[[f32; 3]]) -> bool {
    values.as_flattened().iter().any(|value| *value != 0.0)
}
