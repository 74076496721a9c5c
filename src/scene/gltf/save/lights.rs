//! Writes edited lights back into their file.

use glam::{DAffine3, DQuat, DVec3};
use gltf::json::Value;
use serde_json::json;

use super::placing::NodePlacement;
use crate::error::{Error, Result};
use crate::scene::gltf::glb::Glb;
use crate::scene::gltf::light::Origin;
use crate::scene::gltf::spectrum;
use crate::scene::gltf::write::lights;
use crate::scene::{Light, LightKind, Scene};

/// A light before and after editing.
pub struct Edited<'a> {
    pub was: &'a Light,
    pub is: &'a Light,
}

impl Edited<'_> {
    fn refused(&self, what: &str) -> Error {
        Error::failure(
            format!("light `{}`", self.is.name),
            format!("{what}, which a file cannot hold"),
            "undo that edit and save again",
        )
    }

    /// Writes a light that has a node.
    ///
    /// # Errors
    /// A spectrum without a name.
    pub fn write(
        &self,
        origin: &Origin,
        shift: DVec3,
        placing: &mut NodePlacement<'_>,
        glb: &mut Glb,
    ) -> Result<()> {
        // The light is stated as it was and as it is; only what differs between the two is changed in the file.
        let (was, is) = (self.was, self.is);
        let stated = |light| lights::stated(light).map_or(Value::Null, |(_, stated)| stated);
        let (mut before, after) = (stated(was), stated(is));
        let new_spectrum = was.spectrum != is.spectrum;
        if new_spectrum {
            check_spectrum(is)?;
            // With a spectrum, the colour as loaded is not that in the file.
            before["color"] = Value::Null;
        }

        // The entry becomes that of this node alone, since other nodes may share it.
        let [had, has] = [was, is].map(lights::extras);
        if before != after || had != has || new_spectrum {
            let entry = own_entry(origin, glb);
            glb.patch(&entry, &before, &after);

            // Extras of the node win over those of the light: values go there, and what is removed goes from both.
            for key in lights::EXTRAS {
                let is_same = had.get(key) == has.get(key) && !(new_spectrum && key == spectrum::KEY);
                let of_node = format!("/nodes/{}/extras/{key}", origin.node);
                match has.get(key) {
                    _ if is_same => {}
                    Some(stated) => glb.set(&of_node, stated.clone()),
                    None => {
                        glb.remove(&of_node);
                        glb.remove(&format!("{entry}/extras/{key}"));
                    }
                }
            }
        }
        self.place(origin, shift, placing)
    }

    /// Rotates and moves its node, as little as the light itself was.
    fn place(&self, origin: &Origin, shift: DVec3, placing: &mut NodePlacement<'_>) -> Result<()> {
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

    /// Writes the light of an emissive object, as the strength of its material.
    ///
    /// # Errors
    /// Another colour or spectrum; a light that is not an object's; a material that the file only implies.
    pub fn write_glow(&self, edited: &Scene, in_file: usize, glb: &mut Glb) -> Result<()> {
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
        let strength = format!("/materials/{material}/extensions/{STRENGTH}/emissiveStrength");
        let before = glb.json.pointer(&strength).and_then(Value::as_f64);
        let times = is.kind.strength() / was.kind.strength();
        glb.set(&strength, json!(before.unwrap_or(1.0) * times));
        glb.name_extension(STRENGTH);
        Ok(())
    }
}

/// Extension with the strength of a material's emission.
const STRENGTH: &str = "KHR_materials_emissive_strength";

/// Refuses a spectrum that a file cannot hold.
///
/// # Errors
/// A spectrum without a name.
pub fn check_spectrum(light: &Light) -> Result<()> {
    if light.spectrum.is_none() || lights::named_spectrum(light).is_some() {
        return Ok(());
    }
    Err(Error::failure(
        format!("light `{}`", light.name),
        "has a spectrum without a name, which a file cannot hold",
        "choose a colour or a named spectrum, and save again",
    ))
}

/// JSON pointer to a light's entry in its list; an entry that other nodes share is copied first.
fn own_entry(origin: &Origin, glb: &mut Glb) -> String {
    let list = origin.list;
    let lights = format!("/extensions/{list}/lights");
    let reference = format!("/extensions/{list}/light");
    let refers = |node: &&Value| {
        let stated = node.pointer(&reference).and_then(Value::as_u64);
        stated == Some(origin.index as u64)
    };
    let nodes = glb.json["nodes"].as_array().into_iter().flatten();
    let sharing = nodes.filter(refers).count();
    let entry = format!("{lights}/{}", origin.index);
    if sharing <= 1 {
        return entry;
    }
    let copy = glb.json.pointer(&entry).cloned().unwrap_or_default();
    let next = glb.push(&lights, copy);
    glb.set(&format!("/nodes/{}{reference}", origin.node), json!(next));
    format!("{lights}/{next}")
}
