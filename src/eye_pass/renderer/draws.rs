//! What a picture draws: the objects in view, each by the pipelines that it calls for.

use glam::DVec3;

use super::MapStyle;
use super::objects::{Look, Objects};
use super::pipelines::{Faces, PipelineKey, Writes};
use crate::eye_pass::View;
use crate::scene::SurfaceKind;

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
    /// Whether there are receivers among the surroundings that they show.
    pub(super) has_receivers: bool,
}

impl Manner {
    /// Whether an object is drawn by the pipelines of specular surfaces.
    pub(super) fn is_specular(self, look: &Look) -> bool {
        self.style == MapStyle::Lit && self.has_chains && look.surface.is_specular()
    }

    /// How an object is drawn, step by step; nothing where it is left out.
    pub(super) fn keys(self, look: &Look) -> Vec<PipelineKey> {
        let sides = if look.double_sided {
            Faces::Both
        } else {
            Faces::Front
        };
        let key = |writes, faces| {
            PipelineKey::new(
                writes,
                look.surface,
                faces,
                look.has_texture(),
                self.has_receivers,
            )
        };
        let clear = |faces| {
            let in_turn: &[Writes] = if look.is_grey {
                &[Writes::Grey]
            } else {
                &[Writes::Transmitted, Writes::Reflected]
            };
            in_turn.iter().map(move |writes| key(*writes, faces))
        };
        match (self.style, look.surface) {
            (MapStyle::AsItIs, SurfaceKind::Dielectric | SurfaceKind::ThinWall) => Vec::new(),
            (MapStyle::AsItIs, _) => vec![key(Writes::MapValue, sides)],
            (MapStyle::Lit, SurfaceKind::Dielectric | SurfaceKind::ThinWall) if !self.has_chains => {
                Vec::new()
            }
            (MapStyle::Lit, SurfaceKind::ThinWall) => clear(Faces::Both).collect(),
            // Within a body the far side first.
            (MapStyle::Lit, SurfaceKind::Dielectric) => {
                clear(Faces::Back).chain(clear(Faces::Front)).collect()
            }
            (MapStyle::Lit, SurfaceKind::Mirror | SurfaceKind::Mixed) if self.has_chains => {
                vec![key(Writes::OwnAndReflected, sides)]
            }
            (MapStyle::Lit, _) => vec![key(Writes::Own, sides)],
        }
    }
}

/// Everything that a picture draws, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DrawList {
    pub(super) plain: Vec<Draw>,
    /// Opaque ones, then clear ones from far to near.
    pub(super) specular: Vec<Draw>,
    /// Objects that are drawn.
    pub(super) objects: usize,
    /// Those of them that are specular.
    pub(super) specular_objects: usize,
}

impl DrawList {
    /// The objects of `visible`, in order.
    pub(super) fn new(objects: &Objects, visible: &[usize], eye: DVec3, manner: Manner) -> Self {
        let look = |index: usize| &objects.list[index].look;
        let is_specular = |index: &usize| manner.is_specular(look(*index));
        let (mut specular, plain): (Vec<usize>, Vec<usize>) =
            visible.iter().partition(|index| is_specular(index));
        let distance = |index: &usize| look(*index).centre().distance_squared(eye);
        // Opaque ones stay in the scene's order, before all that is clear.
        let is_clear = |index: &usize| look(*index).is_clear();
        let opaque = specular.iter().copied().filter(|index| !is_clear(index));
        let opaque: Vec<usize> = opaque.collect();
        specular.retain(is_clear);
        specular.sort_by(|a, b| distance(b).total_cmp(&distance(a)));

        let draws = |indices: &[usize]| -> Vec<Draw> {
            let of_object = |&object: &usize| {
                let keys = manner.keys(look(object)).into_iter();
                keys.map(move |key| Draw { object, key })
            };
            indices.iter().flat_map(of_object).collect()
        };
        let specular_objects = opaque.len() + specular.len();
        let plain = draws(&plain);
        Self {
            objects: count_objects(&plain) + specular_objects,
            specular: draws(&[opaque, specular].concat()),
            plain,
            specular_objects,
        }
    }
}

/// Draws of an object follow each other.
fn count_objects(draws: &[Draw]) -> usize {
    draws.chunk_by(|a, b| a.object == b.object).count()
}

/// The objects whose boxes may be seen, in the scene's order.
pub(super) fn visible_objects(objects: &Objects, view: &View) -> Vec<usize> {
    let aspect = f64::from(view.width) / f64::from(view.height);
    let frustum = view.camera.frustum(aspect);
    let is_seen = |index: &usize| {
        let bounds = objects.list[*index].look.bounds;
        bounds.is_some_and(|bounds| frustum.may_see(bounds))
    };
    (0..objects.list.len()).filter(is_seen).collect()
}
