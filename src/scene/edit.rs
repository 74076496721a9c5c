//! Edits of a scene as data: each gives the edited scene and the edit that takes it back, bit for bit.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::{Light, LightKind, Material, Mesh, Scene};
use crate::error::{Error, Result};
use crate::optics::LinearSrgb;
use crate::units::{Irradiance, RadiantIntensity};

/// A direction whose squared length is this near to 1 is unit already and stays bit for bit.
const UNIT: f64 = 1e-12;
/// Farthest that anything is moved to [m]: beyond it, squares of distances lose the scene.
const FARTHEST_M: f64 = 1e12;

/// One change of a scene. Indices are those of [`Scene::lights`], [`Scene::materials`] and [`Scene::objects`].
#[derive(Clone, Debug, PartialEq)]
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
    /// Place of a point or spot light.
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
    /// Colour of a light.
    LightColour {
        /// Which light.
        light: usize,
        /// Each channel ≥ 0, not all 0.
        colour: LinearSrgb,
    },
    /// Refractive index of a material.
    MaterialIor {
        /// Which material.
        material: usize,
        /// At least 1.
        ior: f64,
    },
    /// Base colour of a material: the tint of glass, the albedo of what is matte.
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
    /// An object turned about the middle of its box, and then moved.
    ObjectMoved {
        /// Which object.
        object: usize,
        /// Unit; made so.
        rotation: DQuat,
        /// [m].
        translation: DVec3,
    },
    /// Another shape for an object: what takes a movement back.
    ObjectMesh {
        /// Which object.
        object: usize,
        /// In scene coordinates; finite, with valid indices.
        mesh: Arc<Mesh>,
    },
    /// Several edits, one after the other.
    Several(Vec<Self>),
}

/// What an edit sets: edits of the same target replace one another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EditTarget {
    /// Strength of a light.
    LightPower(usize),
    /// Place of a light.
    LightPosition(usize),
    /// Direction of a light.
    LightDirection(usize),
    /// Colour of a light.
    LightColour(usize),
    /// Refractive index of a material.
    MaterialIor(usize),
    /// Base colour of a material.
    MaterialTint(usize),
    /// Roughness of a material.
    MaterialRoughness(usize),
    /// Place of an object.
    ObjectPlace(usize),
    /// All of these.
    Several(Vec<Self>),
}

impl Edit {
    /// The edited scene, which shares every mesh and image that is not touched, and the edit that undoes this one
    /// exactly.
    ///
    /// # Errors
    /// An index that the scene lacks, a property that the light does not have, a value outside its range.
    pub fn apply(&self, scene: &Scene) -> Result<(Scene, Self)> {
        let mut edited = scene.clone();
        let inverse = self.apply_to(&mut edited)?;
        Ok((edited, inverse))
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

    /// What it sets.
    pub fn target(&self) -> EditTarget {
        match self {
            Self::LightIntensity { light, .. } | Self::LightNormalIrradiance { light, .. } => {
                EditTarget::LightPower(*light)
            }
            Self::LightPosition { light, .. } => EditTarget::LightPosition(*light),
            Self::LightDirection { light, .. } => EditTarget::LightDirection(*light),
            Self::LightColour { light, .. } => EditTarget::LightColour(*light),
            Self::MaterialIor { material, .. } => EditTarget::MaterialIor(*material),
            Self::MaterialTint { material, .. } => EditTarget::MaterialTint(*material),
            Self::MaterialRoughness { material, .. } => EditTarget::MaterialRoughness(*material),
            Self::ObjectMoved { object, .. } | Self::ObjectMesh { object, .. } => {
                EditTarget::ObjectPlace(*object)
            }
            Self::Several(edits) => EditTarget::Several(edits.iter().map(Self::target).collect()),
        }
    }

    fn apply_to(&self, scene: &mut Scene) -> Result<Self> {
        match self {
            Self::LightIntensity { light, .. }
            | Self::LightNormalIrradiance { light, .. }
            | Self::LightPosition { light, .. }
            | Self::LightDirection { light, .. }
            | Self::LightColour { light, .. } => {
                let found = existing(&mut scene.lights, *light, "light")?;
                self.apply_to_light(*light, found)
            }
            Self::MaterialIor { material, .. }
            | Self::MaterialTint { material, .. }
            | Self::MaterialRoughness { material, .. } => {
                let found = existing(&mut scene.materials, *material, "material")?;
                self.apply_to_material(*material, found)
            }
            Self::ObjectMoved {
                object,
                rotation,
                translation,
            } => {
                let found = existing(&mut scene.objects, *object, "object")?;
                let moved = moved(&found.mesh, *rotation, *translation, &found.name)?;
                Ok(replace_mesh(*object, &mut found.mesh, Arc::new(moved)))
            }
            Self::ObjectMesh { object, mesh } => {
                let found = existing(&mut scene.objects, *object, "object")?;
                check_mesh(mesh, &found.name)?;
                Ok(replace_mesh(*object, &mut found.mesh, Arc::clone(mesh)))
            }
            Self::Several(edits) => {
                let inverses: Result<Vec<Self>> = edits.iter().map(|edit| edit.apply_to(scene)).collect();
                let mut inverses = inverses?;
                inverses.reverse();
                Ok(Self::Several(inverses))
            }
        }
    }

    fn apply_to_light(&self, index: usize, light: &mut Light) -> Result<Self> {
        let owner = format!("light `{}`", light.name);
        let lacks = |what: &str, remedy: &str| Err(Error::usage(&owner, format!("has no {what}"), remedy));
        match (self, &mut light.kind) {
            (
                Self::LightIntensity { intensity: new, .. },
                LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. },
            ) => {
                check_power(new.0, "W/sr", &owner)?;
                Ok(Self::LightIntensity {
                    light: index,
                    intensity: std::mem::replace(intensity, *new),
                })
            }
            (Self::LightIntensity { .. }, LightKind::Sun { .. }) => {
                lacks("radiant intensity, as it is a sun", "set its normal irradiance")
            }
            (
                Self::LightNormalIrradiance {
                    normal_irradiance: new,
                    ..
                },
                LightKind::Sun {
                    normal_irradiance, ..
                },
            ) => {
                check_power(new.0, "W/m²", &owner)?;
                Ok(Self::LightNormalIrradiance {
                    light: index,
                    normal_irradiance: std::mem::replace(normal_irradiance, *new),
                })
            }
            (Self::LightNormalIrradiance { .. }, _) => {
                lacks("normal irradiance, as it is no sun", "set its radiant intensity")
            }
            (
                Self::LightPosition { position: new, .. },
                LightKind::Point { position, .. } | LightKind::Spot { position, .. },
            ) => {
                check_place(*new, &owner)?;
                Ok(Self::LightPosition {
                    light: index,
                    position: std::mem::replace(position, *new),
                })
            }
            (Self::LightPosition { .. }, LightKind::Sun { .. }) => {
                lacks("position, as it is a sun", "set its direction")
            }
            (
                Self::LightDirection { direction: new, .. },
                LightKind::Spot { direction, .. } | LightKind::Sun { direction, .. },
            ) => Ok(Self::LightDirection {
                light: index,
                direction: std::mem::replace(direction, unit(*new, &owner)?),
            }),
            (Self::LightDirection { .. }, LightKind::Point { .. }) => {
                lacks("direction, as it shines everywhere alike", "set its position")
            }
            (Self::LightColour { colour: new, .. }, _) => {
                let is_light = new.is_finite()
                    && new.to_array().iter().all(|channel| *channel >= 0.0)
                    && new.luminance() > 0.0;
                if !is_light {
                    return Err(out_of_range(
                        &owner,
                        "colour",
                        format!("{:?}", new.to_array()),
                        "0 up, not all 0",
                    ));
                }
                Ok(Self::LightColour {
                    light: index,
                    colour: std::mem::replace(&mut light.colour, *new),
                })
            }
            _ => lacks("such property", "edit what it has"),
        }
    }

    fn apply_to_material(&self, index: usize, material: &mut Material) -> Result<Self> {
        let owner = format!("material `{}`", material.name);
        // A class that a file sets otherwise (unlit) is not ours to change.
        let follows = material.surface == material.classified();
        let inverse = match self {
            Self::MaterialIor { ior, .. } => {
                if !(*ior >= 1.0 && ior.is_finite()) {
                    return Err(out_of_range(&owner, "refractive index", ior.to_string(), "1 up"));
                }
                Self::MaterialIor {
                    material: index,
                    ior: std::mem::replace(&mut material.ior, *ior),
                }
            }
            Self::MaterialTint { base_colour, .. } => {
                let channels = base_colour.to_array();
                if !channels.iter().all(|channel| (0.0..=1.0).contains(channel)) {
                    return Err(out_of_range(
                        &owner,
                        "base colour",
                        format!("{channels:?}"),
                        "0 to 1",
                    ));
                }
                Self::MaterialTint {
                    material: index,
                    base_colour: std::mem::replace(&mut material.base_colour, *base_colour),
                }
            }
            Self::MaterialRoughness { roughness, .. } => {
                if !(0.0..=1.0).contains(roughness) {
                    return Err(out_of_range(&owner, "roughness", roughness.to_string(), "0 to 1"));
                }
                Self::MaterialRoughness {
                    material: index,
                    roughness: std::mem::replace(&mut material.roughness, *roughness),
                }
            }
            _ => {
                return Err(Error::usage(&owner, "has no such property", "edit what it has"));
            }
        };
        if follows {
            material.surface = material.classified();
        }
        Ok(inverse)
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

fn out_of_range(owner: &str, what: &str, value: String, range: &str) -> Error {
    Error::usage(
        owner,
        format!("a {what} of {value} is outside {range}"),
        "give a value in that range",
    )
}

fn check_power(value: f64, unit: &str, owner: &str) -> Result<()> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(out_of_range(
        owner,
        "strength",
        format!("{value} {unit}"),
        "what is above 0 and finite",
    ))
}

fn check_place(place: DVec3, owner: &str) -> Result<()> {
    if place.abs().max_element() <= FARTHEST_M && place.is_finite() {
        return Ok(());
    }
    let range = format!("−{FARTHEST_M:e} to {FARTHEST_M:e} m");
    Err(out_of_range(owner, "place", format!("{place} m"), &range))
}

fn unit(direction: DVec3, owner: &str) -> Result<DVec3> {
    if (direction.length_squared() - 1.0).abs() <= UNIT {
        return Ok(direction);
    }
    direction
        .try_normalize()
        .ok_or_else(|| out_of_range(owner, "direction", direction.to_string(), "what has a length"))
}

fn replace_mesh(object: usize, place: &mut Arc<Mesh>, mesh: Arc<Mesh>) -> Edit {
    Edit::ObjectMesh {
        object,
        mesh: std::mem::replace(place, mesh),
    }
}

/// A mesh turned about the middle of its box, and then moved.
fn moved(mesh: &Mesh, rotation: DQuat, translation: DVec3, name: &str) -> Result<Mesh> {
    let owner = format!("object `{name}`");
    check_place(translation, &owner)?;
    if !(rotation.is_finite() && rotation.length() > 0.0) {
        return Err(out_of_range(
            &owner,
            "rotation",
            rotation.to_string(),
            "unit quaternions",
        ));
    }
    let rotation = rotation.normalize();
    let is_turned = rotation != DQuat::IDENTITY;
    let (low, high) = mesh.bounds().unwrap_or_default();
    let centre = 0.5 * (low + high);
    let place = |point: &DVec3| {
        if is_turned {
            rotation * (*point - centre) + centre + translation
        } else {
            *point + translation
        }
    };
    let turn = |normal: &DVec3| if is_turned { rotation * *normal } else { *normal };
    let moved = Mesh {
        positions: mesh.positions.iter().map(place).collect(),
        normals: mesh.normals.iter().map(turn).collect(),
        ..mesh.clone()
    };
    if let Some((low, high)) = moved.bounds() {
        check_place(low, &owner)?;
        check_place(high, &owner)?;
    }
    Ok(moved)
}

fn check_mesh(mesh: &Mesh, name: &str) -> Result<()> {
    let vertices = mesh.positions.len();
    let is_whole = mesh.normals.len() == vertices
        && [&mesh.uv0, &mesh.uv1]
            .iter()
            .all(|uvs| uvs.as_ref().is_none_or(|uvs| uvs.len() == vertices))
        && mesh
            .triangles
            .iter()
            .flatten()
            .all(|vertex| (*vertex as usize) < vertices)
        && mesh
            .positions
            .iter()
            .chain(&mesh.normals)
            .all(|vector| vector.is_finite());
    if is_whole {
        return Ok(());
    }
    Err(Error::usage(
        format!("object `{name}`"),
        "its new mesh has an index or a number that is not valid",
        "give finite coordinates, and as many normals as positions",
    ))
}
