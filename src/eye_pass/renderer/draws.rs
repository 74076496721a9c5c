//! The draw list of a picture: visible objects, each with the pipelines that it needs.

use super::MapStyle;
use super::objects::{Appearance, Objects};
use super::pipelines::{Faces, PipelineFlags, PipelineKey, RenderTarget};
use crate::eye_pass::View;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Draw {
    /// Index into the scene's objects.
    pub(super) object: usize,
    pub(super) key: PipelineKey,
}

/// What the pipeline of an object depends on, besides the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DrawState {
    pub(super) style: MapStyle,
    /// Whether chains are traced.
    pub(super) has_chains: bool,
    /// What pipelines of chains support.
    pub(super) flags: PipelineFlags,
}

impl DrawState {
    /// Whether an object is drawn by the pipelines of specular surfaces.
    pub(super) fn is_specular(self, look: &Appearance) -> bool {
        self.style == MapStyle::Lit && self.has_chains && look.surface.is_specular()
    }

    /// Whether any object shows chains, in view or not.
    pub(super) fn has_specular(self, objects: &Objects) -> bool {
        objects.list.iter().any(|look| self.is_specular(look))
    }

    /// Pipeline of an object in the frame; `None` if it is left out.
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

    /// Pipelines of an object in the traced image: the depth prepass, and chains if it is specular.
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
        let flags = match writes {
            RenderTarget::Traced => self.flags,
            _ => PipelineFlags {
                has_texture: look.has_texture,
                has_bumps: look.has_bumps,
                has_mask: look.has_mask(),
                ..self.flags
            },
        };
        PipelineKey::new(writes, look.surface, faces, flags)
    }
}

/// Everything that a frame draws, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DrawList {
    /// Depth prepass of the traced image.
    pub(super) depths: Vec<Draw>,
    /// Chains of the traced image.
    pub(super) traced: Vec<Draw>,
    /// The frame itself.
    pub(super) surfaces: Vec<Draw>,
    /// Visible specular objects.
    pub(super) specular_objects: usize,
}

impl DrawList {
    /// Draws of the objects in `visible`, grouped by pipeline.
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

    pub(super) fn all(&self) -> impl Iterator<Item = &Draw> {
        self.depths.iter().chain(&self.traced).chain(&self.surfaces)
    }
}

/// The objects whose bounding boxes may be visible, in the scene's order.
pub(super) fn visible_objects(objects: &Objects, view: &View) -> Vec<usize> {
    let aspect = f64::from(view.width) / f64::from(view.height);
    let frustum = view.camera.frustum(aspect);
    let is_seen = |index: &usize| {
        let bounds = objects.list[*index].bounds;
        bounds.is_some_and(|bounds| frustum.may_see(bounds))
    };
    (0..objects.list.len()).filter(is_seen).collect()
}

/// Quality of frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeQuality {
    /// Pixels of the traced image per pixel of the frame, across and down, [1/8, 4]. Below 1, reflections and
    /// refractions are coarser than the frame; above 1, they are supersampled.
    pub traced_scale: f64,
    /// Number of specular surfaces on a chain, at most 4, at which both branches are followed; beyond, only the
    /// stronger one is.
    pub branching_depth: u32,
    /// Whether maps and textures are read at the mip level of their footprint; otherwise always at the finest, as in
    /// the CPU eye pass.
    pub minifies: bool,
}

impl EyeQuality {
    /// For interactive views.
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

    /// Clamped to the ranges above; NaN becomes the minimum.
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

/// Subpixel position of a frame, and the level of detail that suits it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// Offset from the pixel centre, right and down [pixels].
    pub(super) offset: [f64; 2],
    /// Added to the mip level of lookups.
    pub(super) level_bias: f64,
    /// Index among the frames of the same view; selects the wavelengths.
    pub(super) picture: u32,
}

impl Sample {
    pub(super) const CENTRE: Self = Self {
        offset: [0.0; 2],
        level_bias: 0.0,
        picture: 0,
    };

    /// Offset of the traced image: if that is coarser than the frame, samples are spread over its own pixels.
    pub(super) fn traced_offset(self, quality: EyeQuality) -> [f64; 2] {
        self.offset.map(|offset| offset / quality.traced_scale.min(1.0))
    }

    /// One position of a regular grid of `side`² in a pixel, in turn; the same as in the CPU eye pass.
    pub(super) fn of_grid(index: u32, side: u32) -> Self {
        let place = |index: u32| (f64::from(index) + 0.5) / f64::from(side) - 0.5;
        Self {
            offset: [place(index % side), place(index / side % side)],
            level_bias: -f64::from(side).log2(),
            // Many frames are averaged, so that no single one has to cover the spectrum.
            picture: index + 1,
        }
    }

    /// A position of the sequence R2, which covers pixels evenly at any length (M. Roberts, "The Unreasonable
    /// Effectiveness of Quasirandom Sequences", 2018).
    pub(super) fn of_sequence(index: u32) -> Self {
        const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
        Self {
            offset: STEPS.map(|step| (0.5 + step * f64::from(index)).fract() - 0.5),
            // The mean over the pixel blurs enough by itself.
            level_bias: -1.0,
            picture: index,
        }
    }
}

/// Counts of resources, and figures of the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EyeCounts {
    /// Render pipelines for surfaces and tone mapping.
    pub pipelines: u64,
    /// Those of them for reflections and refractions.
    pub specular_pipelines: u64,
    /// Device memory of the hierarchy and its triangles [bytes].
    pub chain_bytes: u64,
    /// Device memory of the environment [bytes].
    pub sky_bytes: u64,
    /// Device memory of illumination maps [bytes].
    pub map_bytes: u64,
    /// Maps whose finest level is not resident, for lack of memory.
    pub coarse_maps: u64,
    /// Objects drawn in the last frame.
    pub drawn_objects: u64,
    /// Specular objects among them.
    pub drawn_specular: u64,
    /// Pixels of the traced image; 0 if nothing specular was in view.
    pub traced_pixels: u64,
    /// Frames in the mean that was shown last.
    pub samples: u32,
    /// The latest frame whose GPU time is known; `None` without timestamp queries, or before the first result.
    pub timed: Option<TimedFrame>,
}

/// GPU time of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedFrame {
    pub ms: GpuMs,
    pub quality: EyeQuality,
    /// Width of the frame [pixels].
    pub width: u32,
}

/// GPU time by pass [ms].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuMs {
    /// The pass over all surfaces, including the multisample resolve.
    pub opaque: f64,
    /// Tracing chains; 0 if nothing specular was drawn.
    pub specular: f64,
    /// Tone mapping; 0 for frames that are read back as radiance.
    pub tone_mapping: f64,
}

impl GpuMs {
    /// All passes [ms].
    pub fn sum(&self) -> f64 {
        self.opaque + self.specular + self.tone_mapping
    }
}
