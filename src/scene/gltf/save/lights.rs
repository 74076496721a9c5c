//! Lights as their file is to have them.

use glam::{DAffine3, DQuat, DVec3};
use gltf::json::Value;
use serde_json::json;

use super::JsonDocument;
use super::placing::Placing;
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::optics::spectrum::illuminant;
use crate::scene::gltf::document::Document;
use crate::scene::gltf::light::Origin;
use crate::scene::gltf::spectrum;
use crate::scene::{Light, LightKind, LightSize, Scene};
use crate::units::LUMENS_PER_WATT;

/// A light before and after it was edited.
pub struct Edited<'a> {
    /// As it was loaded.
    pub was: &'a Light,
    /// As it is now.
    pub is: &'a Light,
}

impl Edited<'_> {
    fn refused(&self, what: &str) -> Error {
        Error::failure(
            format!("light `{}`", self.is.name),
            format!("{what}, which a file cannot hold"),
            "take that edit back and save again",
        )
    }

    /// Writes a light that stands at a node.
    ///
    /// # Errors
    /// A spectrum without a name.
    pub fn write(
        &self,
        origin: &Origin,
        (document, shift): (&Document, DVec3),
        placing: &mut Placing<'_>,
        json: &mut JsonDocument,
    ) -> Result<()> {
        let (was, is) = (self.was, self.is);
        if was.kind.strength() != is.kind.strength() || was.colour != is.colour || was.spectrum != is.spectrum
        {
            let light = own_light(document, origin, json);
            if was.kind.strength() != is.kind.strength() {
                let candela = is.kind.strength() * LUMENS_PER_WATT;
                json.set(&format!("{light}/intensity"), json!(candela));
            }
            if was.colour != is.colour || was.spectrum != is.spectrum {
                self.write_colour(origin, &light, json)?;
            }
        }
        if was.size != is.size {
            self.write_size(origin, json);
        }
        self.place(origin, shift, placing)
    }

    fn write_colour(&self, origin: &Origin, light: &str, json: &mut JsonDocument) -> Result<()> {
        let of_node = format!("/nodes/{}/extras/{}", origin.node, spectrum::KEY);
        let of_light = format!("{light}/extras/{}", spectrum::KEY);
        let Some(spectrum) = &self.is.spectrum else {
            json.remove(&of_node);
            json.remove(&of_light);
            json.set(&format!("{light}/color"), json!(self.is.colour.to_array()));
            return Ok(());
        };
        let name = spectrum.name().filter(|name| illuminant(name).is_ok());
        let name = name.ok_or_else(|| self.refused("has a spectrum without a name"))?;
        json.set(&of_node, json!(name));
        json.set(&format!("{light}/color"), json!(LinearSrgb::WHITE.to_array()));
        Ok(())
    }

    fn write_size(&self, origin: &Origin, json: &mut JsonDocument) {
        let extras = |name: &str| format!("/nodes/{}/extras/{name}", origin.node);
        let (name, size) = match (self.is.size, &self.is.kind) {
            (LightSize::Radius { radius_m }, _) => ("radius_m", radius_m),
            (LightSize::Angle { diameter_rad }, _) => ("angular_diameter_deg", diameter_rad.to_degrees()),
            (LightSize::None, LightKind::Sun { .. }) => ("angular_diameter_deg", 0.0),
            (LightSize::None, _) => ("radius_m", 0.0),
        };
        json.set(&extras(name), json!(size));
    }

    /// Turns and moves its node, as little as the light itself was.
    fn place(&self, origin: &Origin, shift: DVec3, placing: &mut Placing<'_>) -> Result<()> {
        let (was, is) = (&self.was.kind, &self.is.kind);
        let turn = match (was.direction(), is.direction()) {
            (Some(was), Some(is)) if was != is => DQuat::from_rotation_arc(was.normalize(), is.normalize()),
            _ => DQuat::IDENTITY,
        };
        let is_moved = was.position() != is.position();
        if turn == DQuat::IDENTITY && !is_moved {
            return Ok(());
        }
        let Some(stands) = placing.of(origin.node) else {
            return Err(self.refused("has no node"));
        };
        let place = match is.position() {
            Some(position) if is_moved => position + shift,
            _ => stands.translation,
        };
        let turned = DAffine3::from_quat(turn) * DAffine3::from_mat3(stands.matrix3);
        let wanted = DAffine3 {
            matrix3: turned.matrix3,
            translation: place,
        };
        placing.put(origin.node, wanted, &self.is.name)
    }

    /// Writes a light that is the glow of an object: its material's.
    ///
    /// # Errors
    /// Another colour, or a material that glows elsewhere too and did not change there.
    pub fn write_glow(&self, edited: &Scene, in_file: usize, json: &mut JsonDocument) -> Result<()> {
        let (was, is) = (self.was, self.is);
        if was.colour != is.colour || was.spectrum != is.spectrum {
            return Err(self.refused("glows in another colour"));
        }
        let LightKind::Surface { object, .. } = is.kind else {
            return Err(self.refused("is not part of the file and was edited"));
        };
        let material = edited.objects[object].material;
        if material >= in_file {
            return Err(self.refused("glows by a material that the file only implies"));
        }
        let path = format!("/materials/{material}/extensions/KHR_materials_emissive_strength");
        let path = format!("{path}/emissiveStrength");
        let before = json.get(&path).and_then(Value::as_f64);
        let times = is.kind.strength() / was.kind.strength();
        json.set(&path, json!(before.unwrap_or(1.0) * times));
        json.use_extension("KHR_materials_emissive_strength");
        Ok(())
    }
}

/// The path of a light's entry in its list: one of its own where other nodes refer to the same.
fn own_light(document: &Document, origin: &Origin, json: &mut JsonDocument) -> String {
    let list = origin.list;
    let lights = format!("/extensions/{list}/lights");
    let of_node = |node: usize| format!("/nodes/{node}/extensions/{list}/light");
    let refers = |node: &usize| {
        let stated = json.get(&of_node(*node)).and_then(Value::as_u64);
        stated == Some(origin.index as u64)
    };
    let sharing = (0..document.root.nodes.len()).filter(refers).count();
    let path = format!("{lights}/{}", origin.index);
    if sharing <= 1 {
        return path;
    }
    let copy = json.get(&path).cloned().unwrap_or_else(|| json!({}));
    let next = json.append(&lights, copy);
    json.set(&of_node(origin.node), json!(next));
    format!("{lights}/{next}")
}
