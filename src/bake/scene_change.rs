//! What an edit changed in a scene, as far as baked light depends on it.

use std::sync::Arc;

use crate::geometry::enclosure::Bounds;
use crate::scene::{Light, LightKind, Material, Scene};

/// The difference between a scene and its edited copy.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct SceneChange {
    /// Objects with another shape or place.
    pub(super) shapes: Vec<usize>,
    /// Objects whose material sends light in other directions.
    pub(super) directions: Vec<usize>,
    /// Objects that take another share of the light, those included.
    pub(super) shares: Vec<usize>,
    /// Whether light that meets nothing specular may be another.
    pub(super) moves_shadows: bool,
    /// Lights with another place, size or emission profile; strength and colour alone do not count.
    pub(super) lights: Vec<usize>,
}

impl SceneChange {
    /// `None` if the scenes do not have the same textures and environment, or as many objects and lights.
    pub(super) fn between(old: &Scene, new: &Scene) -> Option<Self> {
        // Objects and lights are compared by index. Textures and environment are compared by address: an edit shares
        // them.
        let same_parts = old.objects.len() == new.objects.len()
            && old.lights.len() == new.lights.len()
            && same_sky(old, new)
            && old.textures.len() == new.textures.len()
            && old
                .textures
                .iter()
                .zip(&new.textures)
                .all(|(a, b)| Arc::ptr_eq(a, b));
        if !same_parts {
            return None;
        }

        // A glowing surface takes its light along when it moves.
        let objects = 0..new.objects.len();
        let shapes: Vec<usize> = objects
            .clone()
            .filter(|&object| !old.objects[object].stands_as(&new.objects[object]))
            .collect();
        let is_moved_with =
            |light: &Light| glowing_object(light).is_some_and(|object| shapes.contains(&object));

        // A material may change the paths of light, its shares, or shadows: different caches depend on these.
        let changed = |is_same: fn(&Material, &Material) -> bool| {
            let is_changed =
                move |&object: &usize| !is_same(old.material_of(object), new.material_of(object));
            objects.clone().filter(is_changed)
        };
        let lights = old.lights.iter().zip(&new.lights).enumerate();
        Some(Self {
            directions: changed(leave_alike).collect(),
            shares: changed(share_alike).collect(),
            moves_shadows: !shapes.is_empty() || changed(shade_alike).next().is_some(),
            lights: lights
                .filter(|(_, (old, new))| !shine_alike(old, new) || is_moved_with(new))
                .map(|(light, _)| light)
                .collect(),
            shapes,
        })
    }

    /// Whether light may take other paths than before.
    pub(super) fn moves_paths(&self) -> bool {
        !(self.shapes.is_empty() && self.directions.is_empty())
    }

    /// Objects that changed, with the boxes that they were and are in [m]; `None` where the scene's own box is another.
    pub(super) fn boxes(&self, old: &Scene, new: &Scene) -> Option<Vec<(usize, Bounds)>> {
        let changed = self.shapes.iter().chain(&self.shares);
        let boxes = |&object: &usize| [old, new].map(|scene| Some((object, scene.objects[object].bounds()?)));
        (old.bounds() == new.bounds()).then(|| changed.flat_map(boxes).flatten().collect())
    }
}

/// Whether both materials send light in the same directions.
fn leave_alike(a: &Material, b: &Material) -> bool {
    a.bending_waves() == b.bending_waves() && leave_alike_without_waves(a, b)
}

fn leave_alike_without_waves(a: &Material, b: &Material) -> bool {
    let has_alpha = a.alpha_mask.is_some() || a.coverage.is_some();
    a.surface == b.surface
        && a.ior == b.ior
        && a.glass == b.glass
        && a.volume.is_some() == b.volume.is_some()
        && a.bending_map() == b.bending_map()
        && a.double_sided == b.double_sided
        && a.alpha_mask == b.alpha_mask
        && a.coverage == b.coverage
        && a.variation == b.variation
        && a.emission_texture == b.emission_texture
        && (!has_alpha || a.base_colour_texture == b.base_colour_texture)
}

/// Whether both materials also reflect, transmit and absorb the same shares of light.
fn share_alike(a: &Material, b: &Material) -> bool {
    leave_alike(a, b) && have_same_shares(a, b)
}

/// The same for light that meets nothing specular: clear surfaces stop it, whatever their waves.
fn shade_alike(a: &Material, b: &Material) -> bool {
    leave_alike_without_waves(a, b)
        && have_same_shares(a, b)
        && (!a.surface.is_receiver() || a.bending_waves() == b.bending_waves())
}

fn have_same_shares(a: &Material, b: &Material) -> bool {
    a.base_colour == b.base_colour
        && a.base_colour_texture == b.base_colour_texture
        && a.metallic == b.metallic
        && a.roughness == b.roughness
        && a.transmission == b.transmission
        && a.coat == b.coat
        && a.volume == b.volume
}

/// Whether both lights are the same except for strength and colour.
fn shine_alike(a: &Light, b: &Light) -> bool {
    let unit = |light: &Light| -> LightKind { light.of_unit_strength().kind };
    unit(a) == unit(b) && a.size == b.size
}

/// The object whose emission is the light.
fn glowing_object(light: &Light) -> Option<usize> {
    match light.kind {
        LightKind::Surface { object, .. } => Some(object),
        _ => None,
    }
}

/// Whether both scenes have the same environment, or none.
fn same_sky(a: &Scene, b: &Scene) -> bool {
    match (&a.environment, &b.environment) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (a, b) => a.is_none() && b.is_none(),
    }
}
