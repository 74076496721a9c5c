//! What a picture draws: the objects in view, each by the pipelines that it calls for.

use super::MapStyle;
use super::objects::{Look, Objects};
use super::pipelines::{DrawnHow, Faces, PipelineKey, Writes};
use crate::eye_pass::View;

/// An object drawn once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Draw {
    /// Index into the scene's objects.
    pub(super) object: usize,
    pub(super) key: PipelineKey,
}

/// What objects are drawn as.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Manner {
    pub(super) style: MapStyle,
    /// Whether mirrors, polish and clear bodies show more than themselves.
    pub(super) has_chains: bool,
    /// Whether anything that chains go on from has a texture.
    pub(super) has_tinted_glass: bool,
    /// Whether normals of anything are bent.
    pub(super) has_bumps: bool,
    /// Whether the traced picture has other pixels than the picture.
    pub(super) is_scaled: bool,
    /// Whether light straight from the lamps is traced.
    pub(super) traces_lights: bool,
    /// Whether an environment is seen.
    pub(super) has_sky: bool,
    /// Whether anything that chains may meet parts wavelengths.
    pub(super) parts_wavelengths: bool,
}

impl Manner {
    /// Whether an object is drawn by the pipelines of specular surfaces.
    pub(super) fn is_specular(self, look: &Look) -> bool {
        self.style == MapStyle::Lit && self.has_chains && look.surface.is_specular()
    }

    /// How an object appears in the picture; `None` where it is left out.
    pub(super) fn key(self, look: &Look) -> Option<PipelineKey> {
        let writes = match self.style {
            MapStyle::AsItIs => Writes::MapValue,
            MapStyle::Inspected { what, .. } => Writes::Inspected(what),
            MapStyle::Lit if self.is_specular(look) => Writes::Composed,
            MapStyle::Lit => Writes::Own,
        };
        let is_shape = matches!(writes, Writes::Inspected(what) if what.is_of_shape());
        let is_left_out = !look.surface.is_opaque() && writes != Writes::Composed && !is_shape;
        (!is_left_out).then(|| self.of(look, writes))
    }

    /// How an object appears in the traced picture: what hides others, and what is traced.
    pub(super) fn traced_keys(self, look: &Look) -> Vec<PipelineKey> {
        let writes: &[Writes] = if self.is_specular(look) {
            &[Writes::Depth, Writes::Traced]
        } else if look.surface.is_opaque() {
            &[Writes::Depth]
        } else {
            &[]
        };
        writes.iter().map(|writes| self.of(look, *writes)).collect()
    }

    fn of(self, look: &Look, writes: Writes) -> PipelineKey {
        let has_back = look.double_sided || !look.surface.is_opaque();
        let faces = if has_back { Faces::Both } else { Faces::Front };
        let how = DrawnHow {
            has_texture: match writes {
                Writes::Traced => self.has_tinted_glass,
                _ => look.has_texture(),
            },
            is_scaled: self.is_scaled,
            traces_lights: self.traces_lights,
            has_bumps: match writes {
                Writes::Traced => self.has_bumps,
                _ => look.has_bumps,
            },
            has_sky: self.has_sky,
            parts_wavelengths: self.parts_wavelengths,
            is_logarithmic: self.style.is_logarithmic(),
        };
        PipelineKey::new(writes, look.surface, faces, how)
    }
}

/// Everything that a picture draws, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DrawList {
    /// Depths of the traced picture.
    pub(super) depths: Vec<Draw>,
    /// Chains of the traced picture.
    pub(super) traced: Vec<Draw>,
    /// The picture itself.
    pub(super) surfaces: Vec<Draw>,
    /// Objects that are specular.
    pub(super) specular_objects: usize,
}

impl DrawList {
    /// The objects of `visible`, in order; what draws alike together.
    pub(super) fn new(objects: &Objects, visible: &[usize], manner: Manner) -> Self {
        let mut list = Self::default();
        let look = |object: usize| &objects.list[object];
        let is_specular = |object: &&usize| manner.is_specular(look(**object));
        list.specular_objects = visible.iter().filter(is_specular).count();
        for &object in visible {
            let draw = |key| Draw { object, key };
            list.surfaces.extend(manner.key(look(object)).map(draw));
            if list.specular_objects > 0 {
                let keys = manner.traced_keys(look(object)).into_iter();
                let (depths, traced): (Vec<_>, Vec<_>) =
                    keys.map(draw).partition(|draw| draw.key.writes == Writes::Depth);
                list.depths.extend(depths);
                list.traced.extend(traced);
            }
        }
        for draws in [&mut list.depths, &mut list.traced, &mut list.surfaces] {
            draws.sort_by_key(|draw| draw.key);
        }
        list
    }

    /// All draws.
    pub(super) fn all(&self) -> impl Iterator<Item = &Draw> {
        self.depths.iter().chain(&self.traced).chain(&self.surfaces)
    }
}

/// The objects whose boxes may be seen, in the scene's order.
pub(super) fn visible_objects(objects: &Objects, view: &View) -> Vec<usize> {
    let aspect = f64::from(view.width) / f64::from(view.height);
    let frustum = view.camera.frustum(aspect);
    let is_seen = |index: &usize| {
        let bounds = objects.list[*index].bounds;
        bounds.is_some_and(|bounds| frustum.may_see(bounds))
    };
    (0..objects.list.len()).filter(is_seen).collect()
}
