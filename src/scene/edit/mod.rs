//! Edits of a scene as data: each gives the edited scene and the edit that takes it back, bit for bit.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::{Light, LightSize, Mesh, Object, Scene, Waves};
use crate::error::{Error, Result};
use crate::optics::spectrum::Spectrum;
use crate::optics::{Glass, LinearSrgb, Metal};
use crate::units::{Irradiance, RadiantIntensity};

mod light;
mod material;
mod shape;

pub use self::light::why_light_stays;

/// One change of a scene. Indices are those of [`Scene::lights`], [`Scene::materials`] and [`Scene::objects`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Edit {
    /// Strength of a point or spot light.
    LightIntensity {
        /// Which light.
        light: usize,
        /// On a spot's axis; > 0 and finite.
        intensity: RadiantIntensity,
    },
    /// Strength of a sun.
    LightNormalIrradiance {
        /// Which light.
        light: usize,
        /// Measured across the beam; > 0 and finite.
        normal_irradiance: Irradiance,
    },
    /// Strength of a lamp with a surface, or of the environment.
    LightBrightness {
        /// Which light.
        light: usize,
        /// Radiance [W/(m² sr)], or the environment's scale [1]; > 0 and finite.
        brightness: f64,
    },
    /// How large a point light, spot or sun is.
    LightSize {
        /// Which light.
        light: usize,
        /// A radius for point lights and spots, an angle for suns; positive and finite.
        size: LightSize,
    },
    /// Place of a point or spot light, or of a flat lamp's middle.
    LightPosition {
        /// Which light.
        light: usize,
        /// Scene coordinates [m].
        position: DVec3,
    },
    /// Where a spot points, or a sun's light travels.
    LightDirection {
        /// Which light.
        light: usize,
        /// Of any length but 0; made unit.
        direction: DVec3,
    },
    /// Colour of a light, which takes the place of a spectrum.
    LightColour {
        /// Which light.
        light: usize,
        /// Each channel ≥ 0, not all 0.
        colour: LinearSrgb,
    },
    /// Spectrum of a light, with its colour.
    LightSpectrum {
        /// Which light.
        light: usize,
        /// The spectrum's; channels may be negative, but its luminance is above 0.
        colour: LinearSrgb,
        /// Scaled to one luminous-equivalent watt; `None` for none.
        spectrum: Option<Arc<Spectrum>>,
    },
    /// One light more.
    LightAdded {
        /// As it looks; its place is behind the others.
        added: Arc<Light>,
    },
    /// One light less: not of the glow of an object, nor of the environment.
    LightRemoved {
        /// Which light.
        light: usize,
    },
    /// Refractive index of a material; a glass keeps its Abbe number.
    MaterialIor {
        /// Which material.
        material: usize,
        /// At least 1.
        ior: f64,
    },
    /// What a material is made of.
    MaterialSubstance {
        /// Which material.
        material: usize,
        /// At least 1: the glass's at 587.56 nm.
        ior: f64,
        /// `None` for one index at every wavelength.
        glass: Option<Arc<Glass>>,
        /// Each channel in [0, 1].
        base_colour: LinearSrgb,
        /// `None` for no metal of a table.
        #[serde(serialize_with = "Metal::write_name", deserialize_with = "Metal::read_name")]
        metal: Option<&'static Metal>,
    },
    /// Base colour of a material: the tint of glass, the albedo of what is matte; it takes the place of a metal's table.
    MaterialTint {
        /// Which material.
        material: usize,
        /// Each channel in [0, 1].
        base_colour: LinearSrgb,
    },
    /// Roughness of a material; its class follows as it does on loading.
    MaterialRoughness {
        /// Which material.
        material: usize,
        /// [0, 1].
        roughness: f64,
    },
    /// Waves that bend the normals of a material.
    MaterialWaves {
        /// Which material.
        material: usize,
        /// `None` for none.
        waves: Option<Waves>,
    },
    /// An object turned about the middle of its box, and then moved.
    ObjectMoved {
        /// Which object.
        object: usize,
        /// Unit; made so.
        rotation: DQuat,
        /// [m].
        translation: DVec3,
    },
    /// Another shape for an object. Not written down.
    #[serde(skip)]
    ObjectMesh {
        /// Which object.
        object: usize,
        /// In scene coordinates; finite, with valid indices.
        mesh: Arc<Mesh>,
    },
    /// Several edits, one after the other.
    Several(Vec<Self>),
    /// A whole scene: what takes an edit back. Not written down.
    #[serde(skip)]
    Whole(Snapshot),
}

/// A scene as it was, which shares meshes and images with what it became.
#[derive(Clone, Debug)]
pub struct Snapshot(Arc<Scene>);

impl PartialEq for Snapshot {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// What an edit sets: edits of the same target replace one another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EditTarget {
    /// Strength of a light.
    LightPower(usize),
    /// Size of a light.
    LightSize(usize),
    /// Place of a light.
    LightPosition(usize),
    /// Direction of a light.
    LightDirection(usize),
    /// Colour of a light.
    LightColour(usize),
    /// Which lights there are.
    LightList,
    /// Refractive index of a material.
    MaterialIor(usize),
    /// Base colour of a material.
    MaterialTint(usize),
    /// What a material is made of.
    MaterialSubstance(usize),
    /// Roughness of a material.
    MaterialRoughness(usize),
    /// Waves of a material.
    MaterialWaves(usize),
    /// Place of an object.
    ObjectPlace(usize),
    /// All of these.
    Several(Vec<Self>),
    /// Everything.
    Whole,
}

impl Edit {
    /// The edited scene, which shares every mesh and image that is not touched, and the edit that undoes this one
    /// exactly.
    ///
    /// # Errors
    /// An index that the scene lacks, a property that the light does not have, a value outside its range.
    pub fn apply(&self, scene: &Scene) -> Result<(Scene, Self)> {
        let mut edited = scene.clone();
        self.apply_to(&mut edited)?;
        Ok((edited, Self::Whole(Snapshot(Arc::new(scene.clone())))))
    }

    /// An object's mesh at an offset [m] from its place in `mesh`; that mesh itself where the offset is 0.
    pub fn object_at(object: usize, mesh: &Arc<Mesh>, offset: DVec3) -> Self {
        let mesh = if offset == DVec3::ZERO {
            Arc::clone(mesh)
        } else {
            Arc::new(Mesh {
                positions: mesh.positions.iter().map(|point| *point + offset).collect(),
                ..Mesh::clone(mesh)
            })
        };
        Self::ObjectMesh { object, mesh }
    }

    /// An object's mesh turned about a point of the scene, and then moved [m], from its place in `mesh`. The rotation is
    /// a unit quaternion.
    pub fn object_turned(
        object: usize,
        mesh: &Arc<Mesh>,
        (rotation, pivot): (DQuat, DVec3),
        offset: DVec3,
    ) -> Self {
        let place = |point: &DVec3| rotation * (*point - pivot) + pivot + offset;
        let mesh = Arc::new(Mesh {
            positions: mesh.positions.iter().map(place).collect(),
            normals: mesh.normals.iter().map(|normal| rotation * *normal).collect(),
            ..Mesh::clone(mesh)
        });
        Self::ObjectMesh { object, mesh }
    }

    /// What it sets.
    pub fn target(&self) -> EditTarget {
        match self {
            Self::LightIntensity { light, .. }
            | Self::LightNormalIrradiance { light, .. }
            | Self::LightBrightness { light, .. } => EditTarget::LightPower(*light),
            Self::LightSize { light, .. } => EditTarget::LightSize(*light),
            Self::LightPosition { light, .. } => EditTarget::LightPosition(*light),
            Self::LightDirection { light, .. } => EditTarget::LightDirection(*light),
            Self::LightColour { light, .. } | Self::LightSpectrum { light, .. } => {
                EditTarget::LightColour(*light)
            }
            Self::LightAdded { .. } | Self::LightRemoved { .. } => EditTarget::LightList,
            Self::MaterialIor { material, .. } => EditTarget::MaterialIor(*material),
            Self::MaterialTint { material, .. } => EditTarget::MaterialTint(*material),
            Self::MaterialSubstance { material, .. } => EditTarget::MaterialSubstance(*material),
            Self::MaterialRoughness { material, .. } => EditTarget::MaterialRoughness(*material),
            Self::MaterialWaves { material, .. } => EditTarget::MaterialWaves(*material),
            Self::ObjectMoved { object, .. } | Self::ObjectMesh { object, .. } => {
                EditTarget::ObjectPlace(*object)
            }
            Self::Several(edits) => EditTarget::Several(edits.iter().map(Self::target).collect()),
            Self::Whole(_) => EditTarget::Whole,
        }
    }

    fn apply_to(&self, scene: &mut Scene) -> Result<()> {
        match self {
            Self::LightIntensity { light, .. }
            | Self::LightNormalIrradiance { light, .. }
            | Self::LightBrightness { light, .. }
            | Self::LightSize { light, .. }
            | Self::LightPosition { light, .. }
            | Self::LightDirection { light, .. }
            | Self::LightColour { light, .. }
            | Self::LightSpectrum { light, .. } => {
                let found = existing(&mut scene.lights, *light, "light")?;
                light::apply(self, found)
            }
            Self::LightAdded { added } => light::add(scene, added),
            Self::LightRemoved { light } => light::remove(scene, *light),
            Self::MaterialIor { material, .. }
            | Self::MaterialSubstance { material, .. }
            | Self::MaterialTint { material, .. }
            | Self::MaterialRoughness { material, .. }
            | Self::MaterialWaves { material, .. } => {
                let found = existing(&mut scene.materials, *material, "material")?;
                material::apply(self, found)
            }
            Self::ObjectMoved {
                object,
                rotation,
                translation,
            } => {
                let found = existing(&mut scene.objects, *object, "object")?;
                let moved = shape::moved(found.mesh_in_scene(), *rotation, *translation, &found.name)?;
                *found.mesh_in_scene_mut() = moved;
                Ok(())
            }
            Self::ObjectMesh { object, mesh } => {
                let found = existing(&mut scene.objects, *object, "object")?;
                shape::check_mesh(mesh, &found.name)?;
                found.share(&Object::new("", (0, 0), 0, Arc::clone(mesh)));
                Ok(())
            }
            Self::Several(edits) => edits.iter().try_for_each(|edit| edit.apply_to(scene)),
            Self::Whole(Snapshot(whole)) => {
                scene.clone_from(whole);
                Ok(())
            }
        }
    }
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

/// Farthest that anything is moved to [m]: beyond it, squares of distances lose the scene.
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
