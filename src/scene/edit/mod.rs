//! Edits of a scene as data.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Light, LightList, Material, Motion, Scene};
use crate::error::{Error, Result};

mod light;
mod material;

pub use self::light::{LightEdit, why_light_stays};
pub use self::material::MaterialEdit;

/// One change of a scene. Indices are those of [`Scene::lights`], [`Scene::materials`] and [`Scene::objects`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Edit {
    /// A property of a light.
    Light(usize, LightEdit),
    /// Appends a light.
    AddLight(Arc<Light>),
    /// Removes a light; not that of an emissive object or of the environment.
    RemoveLight(usize),
    /// A property of a material.
    Material(usize, MaterialEdit),
    /// Moves an object's node, with all of its parts.
    Place(usize, Motion),
}

impl Edit {
    /// The edited scene, which shares all untouched meshes and images.
    ///
    /// # Errors
    /// An index that does not exist, a property that the light does not have, a value out of range.
    pub fn apply(&self, scene: &Scene) -> Result<Scene> {
        let mut edited = scene.clone();
        match self {
            Self::Light(light, edit) => edit.apply(existing(&mut edited.lights, *light, "light")?)?,
            Self::AddLight(light) => light::add(&mut edited, light)?,
            Self::RemoveLight(light) => light::remove(&mut edited, *light)?,
            Self::Material(material, edit) => {
                edit.apply(existing(&mut edited.materials, *material, "material")?)?;
            }
            Self::Place(object, motion) => place(&mut edited, *object, motion)?,
        }
        edited.displace_by_waves();
        Ok(edited)
    }

    /// Edited property, by name and index: edits of the same target replace one another.
    pub fn target(&self) -> String {
        match self {
            Self::Light(light, edit) => format!("{}({light})", edit.names()[0]),
            Self::AddLight(_) | Self::RemoveLight(_) => "LightList".into(),
            Self::Material(material, edit) => format!("{}({material})", edit.names()[0]),
            Self::Place(object, _) => format!("ObjectPlace({object})"),
        }
    }

    /// Description for people, like "power of `lamp`"; the edit must be possible in `scene`.
    pub fn in_words(&self, scene: &Scene) -> String {
        let (what, whose) = match self {
            Self::Light(light, edit) => (edit.names()[1], &scene.lights[*light].name),
            Self::AddLight(light) => return format!("`{}`, a new light", light.name),
            Self::RemoveLight(light) => ("removal", &scene.lights[*light].name),
            Self::Material(material, edit) => (edit.names()[1], &scene.materials[*material].name),
            Self::Place(object, _) => ("place", &scene.objects[*object].name),
        };
        format!("{what} of `{whose}`")
    }
}

/// Everything that edits can change, to be restored exactly. Holds no mesh.
#[derive(Clone, Debug)]
pub struct EditState {
    lights: Vec<Light>,
    light_list: LightList,
    materials: Vec<Material>,
    motions: Vec<Motion>,
}

impl EditState {
    /// State of a scene.
    pub fn of(scene: &Scene) -> Self {
        Self {
            lights: scene.lights.clone(),
            light_list: scene.light_list.clone(),
            materials: scene.materials.clone(),
            motions: scene.objects.iter().map(|object| *object.motion()).collect(),
        }
    }

    /// The scene in this state.
    pub fn set(&self, scene: &Scene) -> Scene {
        let mut edited = scene.clone();
        edited.lights.clone_from(&self.lights);
        edited.light_list.clone_from(&self.light_list);
        edited.materials.clone_from(&self.materials);
        for (index, (object, motion)) in edited.objects.iter_mut().zip(&self.motions).enumerate() {
            if object.motion() != motion {
                object.set_motion(*motion, scene.pivot(index));
            }
        }
        edited.displace_by_waves();
        edited
    }
}

fn place(scene: &mut Scene, object: usize, motion: &Motion) -> Result<()> {
    let found = existing(&mut scene.objects, object, "object")?;
    let owner = format!("object `{}`", found.name);
    let (node, rotation) = (found.node, motion.rotation);
    check_place(motion.translation, &owner)?;
    if !(rotation.is_finite() && rotation.length() > 0.0) {
        return Err(out_of_range(&owner, "rotation", rotation, "unit quaternions"));
    }
    let motion = Motion {
        rotation: rotation.normalize(),
        ..*motion
    };
    let pivot = scene.pivot(object);
    for part in scene.objects.iter_mut().filter(|part| part.node == node) {
        part.set_motion(motion, pivot);
        if let Some((low, high)) = part.bounds() {
            check_place(low, &owner)?;
            check_place(high, &owner)?;
        }
    }
    Ok(())
}

fn existing<'a, T>(list: &'a mut [T], index: usize, noun: &str) -> Result<&'a mut T> {
    let count = list.len();
    list.get_mut(index).ok_or_else(|| {
        Error::usage(
            format!("{noun} {index}"),
            format!("the scene has {count} of them, counted from 0"),
            format!("choose a {noun} of the scene"),
        )
    })
}

/// Largest coordinate after an edit [m]: beyond it, the scene is lost in the rounding of squared distances.
const FARTHEST_M: f64 = 1e12;

fn out_of_range(owner: &str, what: &str, value: impl std::fmt::Display, range: &str) -> Error {
    Error::usage(
        owner,
        format!("a {what} of {value} is outside {range}"),
        "give a value in that range",
    )
}

fn check_place(place: DVec3, owner: &str) -> Result<()> {
    if place.is_finite() && place.abs().max_element() <= FARTHEST_M {
        return Ok(());
    }
    let range = format!("−{FARTHEST_M:e} to {FARTHEST_M:e} m");
    Err(out_of_range(owner, "place", format!("{place} m"), &range))
}
