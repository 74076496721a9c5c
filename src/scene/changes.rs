//! What edits made of a scene, found by comparing it with what was loaded: to be kept, done again, or written to a file.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::{Edit, Light, LightKind, Material, Mesh, Scene};
use crate::optics::Glass;

/// Corners that lie so near to where a motion puts them are put there by it, as a share of the mesh's extent [1].
const SAME_PLACE: f64 = 1e-9;

/// One edit, with the name of what it edits: a file that is exported again may hold it at another place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Name of the light, material or object.
    pub of: String,
    /// What sets it as it is.
    pub edit: Edit,
}

/// What leads from a loaded scene to an edited one, and one sentence for each edit that no file can hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes {
    /// In the order of lights, lights that were taken out, materials and objects.
    pub changes: Vec<Change>,
    /// What is lost.
    pub lost: Vec<String>,
}

/// How an object moved: turned about the middle of its box as it was loaded, and then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Unit.
    pub rotation: DQuat,
    /// [m]
    pub translation: DVec3,
}

impl Changes {
    /// What was done to a scene since it was loaded.
    pub fn between(loaded: &Scene, edited: &Scene) -> Self {
        let mut found = Self::default();
        found.lights(loaded, edited);
        for (index, (before, now)) in loaded.materials.iter().zip(&edited.materials).enumerate() {
            found.extend(&now.name, of_material(index, before, now));
        }
        for (object, (before, now)) in loaded.objects.iter().zip(&edited.objects).enumerate() {
            match Motion::between(before.mesh_in_scene(), now.mesh_in_scene()) {
                Some(None) => {}
                Some(Some(motion)) => {
                    let Motion {
                        rotation,
                        translation,
                    } = motion;
                    let edit = Edit::ObjectMoved {
                        object,
                        rotation,
                        translation,
                    };
                    found.extend(&now.name, vec![edit]);
                }
                None => found.lost.push(format!(
                    "object `{}`: has another shape than its file gives it",
                    now.name
                )),
            }
        }
        found
    }

    /// Those that were taken out last and from behind, so that the places of the others hold until then.
    fn lights(&mut self, loaded: &Scene, edited: &Scene) {
        for (index, now) in edited.lights.iter().enumerate() {
            let edits = match edited.light_when_loaded(index) {
                Some(place) => of_light(place, &loaded.lights[place], now),
                None => vec![Edit::LightAdded {
                    added: Arc::new(now.clone()),
                }],
            };
            self.extend(&now.name, edits);
        }
        for &light in edited.light_list.removed.iter().rev() {
            let edit = Edit::LightRemoved { light };
            self.extend(&loaded.lights[light].name, vec![edit]);
        }
    }

    fn extend(&mut self, name: &str, edits: Vec<Edit>) {
        self.changes.extend(edits.into_iter().map(|edit| Change {
            of: name.to_owned(),
            edit,
        }));
    }
}

impl Change {
    /// Whether a scene that was loaded has it already: the light that is to be added or removed is there or is not, since
    /// the edited scene was saved in the place of the file.
    pub fn is_done_in(&self, scene: &Scene) -> bool {
        let has_light = || scene.lights.iter().any(|light| light.name == self.of);
        match self.edit {
            Edit::LightAdded { .. } => has_light(),
            Edit::LightRemoved { .. } => !has_light(),
            _ => false,
        }
    }

    /// The same edit for a scene: of what has this name there, at its own place if it can be; `None` where nothing has it,
    /// or several do.
    pub fn for_scene(&self, scene: &Scene) -> Option<Edit> {
        let mut edit = self.edit.clone();
        if matches!(edit, Edit::LightAdded { .. }) {
            return Some(edit);
        }
        let index = match edit.part_mut()? {
            Part::Light(index) => self.place(*index, scene.lights.iter().map(|light| light.name.as_str())),
            Part::Material(index) => self.place(
                *index,
                scene.materials.iter().map(|material| material.name.as_str()),
            ),
            Part::Object(index) => {
                self.place(*index, scene.objects.iter().map(|object| object.name.as_str()))
            }
        }?;
        match edit.part_mut()? {
            Part::Light(place) | Part::Material(place) | Part::Object(place) => *place = index,
        }
        Some(edit)
    }

    fn place<'a>(&self, index: usize, mut names: impl Iterator<Item = &'a str> + Clone) -> Option<usize> {
        if names.clone().nth(index) == Some(&self.of) {
            return Some(index);
        }
        let found = names.position(|name| name == self.of)?;
        // `position` has gone past it: another of the name makes it unclear which is meant.
        (!names.any(|name| name == self.of)).then_some(found)
    }
}

/// The index within an edit of one thing.
enum Part<'a> {
    Light(&'a mut usize),
    Material(&'a mut usize),
    Object(&'a mut usize),
}

impl Edit {
    fn part_mut(&mut self) -> Option<Part<'_>> {
        Some(match self {
            Self::LightIntensity { light, .. }
            | Self::LightNormalIrradiance { light, .. }
            | Self::LightBrightness { light, .. }
            | Self::LightSize { light, .. }
            | Self::LightPosition { light, .. }
            | Self::LightDirection { light, .. }
            | Self::LightColour { light, .. }
            | Self::LightSpectrum { light, .. }
            | Self::LightRemoved { light } => Part::Light(light),
            Self::MaterialIor { material, .. }
            | Self::MaterialSubstance { material, .. }
            | Self::MaterialTint { material, .. }
            | Self::MaterialRoughness { material, .. }
            | Self::MaterialWaves { material, .. } => Part::Material(material),
            Self::ObjectMoved { object, .. } | Self::ObjectMesh { object, .. } => Part::Object(object),
            Self::LightAdded { .. } | Self::Several(_) | Self::Whole(_) => return None,
        })
    }
}

fn of_light(light: usize, before: &Light, now: &Light) -> Vec<Edit> {
    let mut edits = Vec::new();
    if before.kind.strength() != now.kind.strength() {
        edits.push(strength(light, &now.kind));
    }
    if let (Some(was), Some(position)) = (before.kind.position(), now.kind.position())
        && was != position
    {
        edits.push(Edit::LightPosition { light, position });
    }
    if let (Some(was), Some(direction)) = (direction(&before.kind), direction(&now.kind))
        && was != direction
    {
        edits.push(Edit::LightDirection { light, direction });
    }
    if before.size != now.size {
        let size = now.size;
        edits.push(Edit::LightSize { light, size });
    }
    if before.spectrum != now.spectrum || before.colour != now.colour {
        let (colour, spectrum) = (now.colour, now.spectrum.clone());
        edits.push(match spectrum {
            Some(_) => Edit::LightSpectrum {
                light,
                colour,
                spectrum,
            },
            None => Edit::LightColour { light, colour },
        });
    }
    edits
}

fn strength(light: usize, kind: &LightKind) -> Edit {
    match *kind {
        LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => {
            Edit::LightIntensity { light, intensity }
        }
        LightKind::Sun {
            normal_irradiance, ..
        } => Edit::LightNormalIrradiance {
            light,
            normal_irradiance,
        },
        LightKind::Panel { .. } | LightKind::Surface { .. } | LightKind::Environment { .. } => {
            Edit::LightBrightness {
                light,
                brightness: kind.strength(),
            }
        }
    }
}

/// The way a light travels, where that can be edited.
pub(super) fn direction(kind: &LightKind) -> Option<DVec3> {
    match kind {
        LightKind::Spot { direction, .. } | LightKind::Sun { direction, .. } => Some(*direction),
        _ => None,
    }
}

fn of_material(material: usize, before: &Material, now: &Material) -> Vec<Edit> {
    let mut edits = Vec::new();
    let is_same_glass = |a: &Option<Arc<Glass>>, b: &Option<Arc<Glass>>| a.as_deref() == b.as_deref();
    let is_same_substance = before.ior == now.ior
        && is_same_glass(&before.glass, &now.glass)
        && before.base_colour == now.base_colour
        && before.metal == now.metal;
    if !is_same_substance {
        edits.push(Edit::MaterialSubstance {
            material,
            ior: now.ior,
            glass: now.glass.clone(),
            base_colour: now.base_colour,
            metal: now.metal,
        });
    }
    if before.roughness != now.roughness {
        let roughness = now.roughness;
        edits.push(Edit::MaterialRoughness { material, roughness });
    }
    if before.waves != now.waves {
        let waves = now.waves.clone();
        edits.push(Edit::MaterialWaves { material, waves });
    }
    edits
}

impl Motion {
    /// The motion that leads from one mesh to the other: `Some(None)` for none at all, `None` where no motion does.
    pub fn between(before: &Arc<Mesh>, now: &Arc<Mesh>) -> Option<Option<Self>> {
        if Arc::ptr_eq(before, now) || before == now {
            return Some(None);
        }
        if before.positions.len() != now.positions.len() || before.triangles != now.triangles {
            return None;
        }
        let (first, last) = (before.positions.first()?, now.positions.first()?);
        let (low, high) = before.bounds()?;
        let tolerance_m = SAME_PLACE * ((high - low).length() + first.distance(*last));
        // What was typed, and not what rounding made of it.
        let offset = ((*last - *first) * 1e9).round() / 1e9;
        let straight = Self {
            rotation: DQuat::IDENTITY,
            translation: offset,
        };
        if straight.leads_to(before, now, tolerance_m) {
            return Some(Some(straight));
        }
        let turned = Self::turned(before, now)?;
        turned.leads_to(before, now, tolerance_m).then_some(Some(turned))
    }

    /// Where a corner of the mesh comes to.
    fn place(&self, corner: DVec3, centre: DVec3) -> DVec3 {
        if self.rotation == DQuat::IDENTITY {
            return corner + self.translation;
        }
        self.rotation * (corner - centre) + centre + self.translation
    }

    fn leads_to(&self, before: &Mesh, now: &Mesh, tolerance_m: f64) -> bool {
        let centre = centre(before);
        let mut pairs = before.positions.iter().zip(&now.positions);
        pairs.all(|(was, is)| self.place(*was, centre).distance(*is) <= tolerance_m)
    }

    /// By three corners that span a plane as well as any.
    fn turned(before: &Mesh, now: &Mesh) -> Option<Self> {
        let corners = &before.positions;
        let farthest = |measure: &dyn Fn(DVec3) -> f64| {
            (0..corners.len()).max_by(|a, b| measure(corners[*a]).total_cmp(&measure(corners[*b])))
        };
        let a = 0;
        let b = farthest(&|corner| corner.distance_squared(corners[a]))?;
        let along = corners[b] - corners[a];
        let c = farthest(&|corner| (corner - corners[a]).cross(along).length_squared())?;
        let frame = |positions: &[DVec3]| {
            let x = (positions[b] - positions[a]).try_normalize()?;
            let z = x.cross(positions[c] - positions[a]).try_normalize()?;
            Some(DMat3::from_cols(x, z.cross(x), z))
        };
        let turn = frame(&now.positions)? * frame(corners)?.transpose();
        let rotation = DQuat::from_mat3(&turn).normalize();
        let centre = centre(before);
        let translation = now.positions[a] - centre - rotation * (corners[a] - centre);
        Some(Self {
            rotation,
            translation,
        })
    }

    /// The middle of a mesh's box, which it turns about [m].
    pub fn centre(before: &Mesh) -> DVec3 {
        centre(before)
    }
}

fn centre(mesh: &Mesh) -> DVec3 {
    let (low, high) = mesh.bounds().unwrap_or_default();
    0.5 * (low + high)
}
