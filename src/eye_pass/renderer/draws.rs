//! The draw list of a picture: visible objects, each with the pipelines that it needs.

use super::MapStyle;
use super::objects::{Appearance, Objects};
use super::pipelines::{Faces, PipelineFlags, PipelineKey, RenderTarget};
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
pub(super) struct DrawState {
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
    /// Whether anything has holes.
    pub(super) has_masks: bool,
}

impl DrawState {
    /// Whether an object is drawn by the pipelines of specular surfaces.
    pub(super) fn is_specular(self, look: &Appearance) -> bool {
        self.style == MapStyle::Lit && self.has_chains && look.surface.is_specular()
    }

    /// How an object appears in the picture; `None` where it is left out.
    pub(super) fn key(self, look: &Appearance) -> Option<PipelineKey> {
        let writes = match self.style {
            MapStyle::AsItIs => RenderTarget::MapValue,
            MapStyle::Inspected { what, .. } => RenderTarget::Inspected(what),
            MapStyle::Lit if self.is_specular(look) => RenderTarget::Composed,
            MapStyle::Lit => RenderTarget::Own,
        };
        let is_shape = matches!(writes, RenderTarget::Inspected(what) if what.is_of_shape());
        let is_left_out = look.surface.is_clear() && writes != RenderTarget::Composed && !is_shape;
        (!is_left_out).then(|| self.of(look, writes))
    }

    /// How an object appears in the traced picture: what hides others, and what is traced.
    pub(super) fn traced_keys(self, look: &Appearance) -> Vec<PipelineKey> {
        let writes: &[RenderTarget] = if self.is_specular(look) {
            &[RenderTarget::Depth, RenderTarget::Traced]
        } else if !look.surface.is_clear() {
            &[RenderTarget::Depth]
        } else {
            &[]
        };
        writes.iter().map(|writes| self.of(look, *writes)).collect()
    }

    fn of(self, look: &Appearance, writes: RenderTarget) -> PipelineKey {
        let faces = if look.double_sided {
            Faces::Both
        } else {
            Faces::Front
        };
        let how = PipelineFlags {
            has_texture: match writes {
                RenderTarget::Traced => self.has_tinted_glass,
                _ => look.has_texture,
            },
            is_scaled: self.is_scaled,
            traces_lights: self.traces_lights,
            has_bumps: match writes {
                RenderTarget::Traced => self.has_bumps,
                _ => look.has_bumps,
            },
            has_sky: self.has_sky,
            parts_wavelengths: self.parts_wavelengths,
            has_mask: match writes {
                RenderTarget::Traced => self.has_masks,
                _ => look.has_mask(),
            },
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
    pub(super) fn new(objects: &Objects, visible: &[usize], draw_state: DrawState) -> Self {
        let mut list = Self::default();
        let look = |object: usize| &objects.list[object];
        let is_specular = |object: &&usize| draw_state.is_specular(look(**object));
        list.specular_objects = visible.iter().filter(is_specular).count();
        for &object in visible {
            let draw = |key| Draw { object, key };
            list.surfaces.extend(draw_state.key(look(object)).map(draw));
            if list.specular_objects > 0 {
                let keys = draw_state.traced_keys(look(object)).into_iter();
                let (depths, traced): (Vec<_>, Vec<_>) = keys
                    .map(draw)
                    .partition(|draw| draw.key.writes == RenderTarget::Depth);
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

/// Quality of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeQuality {
    /// Traced pixels per pixel, across and down, [1/8, 4]: below 1 what is seen in mirrors and through glass is coarser
    /// than the picture, above 1 each pixel is a mean.
    pub traced_scale: f64,
    /// Up to this many specular surfaces on a chain, at most 4, both ways on are followed, and after them the one that
    /// carries more.
    pub branching_depth: u32,
    /// Whether maps and textures are looked up as coarsely as they are seen; else always at their finest, as the CPU
    /// eye pass does.
    pub minifies: bool,
}

impl EyeQuality {
    /// For pictures of a walk.
    pub const WALKING: Self = Self {
        traced_scale: 1.0,
        branching_depth: 2,
        minifies: true,
    };
    /// For pictures that are kept.
    pub const STILL: Self = Self {
        branching_depth: 4,
        ..Self::WALKING
    };

    /// Within the ranges above; what is no number becomes the least.
    #[must_use]
    pub fn clamped(self) -> Self {
        let traced_scale = if self.traced_scale.is_nan() {
            0.125
        } else {
            self.traced_scale.clamp(0.125, 4.0)
        };
        Self {
            traced_scale,
            branching_depth: self.branching_depth.min(super::chains::MAX_BRANCHING),
            ..self
        }
    }
}

impl Default for EyeQuality {
    fn default() -> Self {
        Self::WALKING
    }
}

/// Where in its pixels a picture is looked at, and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// From the pixel's centre, right and down [pixels].
    pub(super) offset: [f64; 2],
    /// Added to the level of images.
    pub(super) level_bias: f64,
    /// Number of the picture among those of its view, which chooses its wavelengths.
    pub(super) picture: u32,
}

impl Sample {
    /// The pixel's centre.
    pub(super) const CENTRE: Self = Self {
        offset: [0.0; 2],
        level_bias: 0.0,
        picture: 0,
    };

    /// The same for the traced picture: where it is coarser than the picture, its own pixels are shared out.
    pub(super) fn traced_offset(self, quality: EyeQuality) -> [f64; 2] {
        self.offset.map(|offset| offset / quality.traced_scale.min(1.0))
    }

    /// One of `side`² places that share out a pixel evenly, those of the CPU eye pass, in turn.
    pub(super) fn of_grid(index: u32, side: u32) -> Self {
        let place = |index: u32| (f64::from(index) + 0.5) / f64::from(side) - 0.5;
        Self {
            offset: [place(index % side), place(index / side % side)],
            level_bias: -f64::from(side).log2(),
            // Many pictures are made: none has to show all colours by itself.
            picture: index + 1,
        }
    }

    /// A further place of a sequence that fills pixels evenly however long it is (M. Roberts, "The Unreasonable
    /// Effectiveness of Quasirandom Sequences", 2018: R2).
    pub(super) fn of_sequence(index: u32) -> Self {
        const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
        Self {
            offset: STEPS.map(|step| (0.5 + step * f64::from(index)).fract() - 0.5),
            // A pixel's mean blurs enough by itself.
            level_bias: -1.0,
            picture: index,
        }
    }
}

/// Counted where things are made; of the last picture, where it says so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EyeCounts {
    /// Render pipelines of surfaces and tone mapping that exist.
    pub pipelines: u64,
    /// Those of them that draw what is seen in mirrors and through glass.
    pub specular_pipelines: u64,
    /// What chains are traced through: the hierarchy with its triangles [bytes].
    pub chain_bytes: u64,
    /// The environment on the device [bytes].
    pub sky_bytes: u64,
    /// Illumination maps on the device [bytes].
    pub map_bytes: u64,
    /// Maps of which the device does not hold the finest level, for want of memory.
    pub coarse_maps: u64,
    /// Objects that the last picture drew.
    pub drawn_objects: u64,
    /// Those of them that were drawn as specular.
    pub drawn_specular: u64,
    /// Pixels of the traced picture; 0 where nothing specular was in view.
    pub traced_pixels: u64,
    /// Pictures of which the last one is the mean.
    pub samples: u32,
    /// Time on the device of the last picture that it has told of; `None` where it cannot tell, or has not yet.
    pub gpu_ms: Option<GpuMs>,
    /// How that picture was made.
    pub timed_quality: Option<EyeQuality>,
}

/// Time on the device [ms].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuMs {
    /// All surfaces, as the picture shows them, and the resolving of samples after them.
    pub opaque: f64,
    /// Chains of mirrors, polish and clear bodies; 0 where nothing of that kind was drawn.
    pub specular: f64,
    /// The last pass; 0 for pictures that are read back as radiance.
    pub tone_mapping: f64,
}
