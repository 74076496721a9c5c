//! What a wavefront bake traced, kept for the next: another map size or smoothing deposits it again without a ray.

use super::caustic_layer::CausticLayer;
use crate::light_pass::caustic::statistics::FootprintStatistics;
use crate::light_pass::wavefront::pass::TracedLight;
use crate::plan::Effect;
use crate::settings::{BakeSettings, ItemBufferKind, MapResolution};

/// All that tracing depends on, beside the scene.
#[derive(Clone, Debug, PartialEq)]
struct TraceKey {
    density_per_sr: f64,
    /// With the map size that the target is meant at.
    target: Option<(f64, MapResolution)>,
    max_depth: u32,
    branch_threshold: f64,
    item_buffer: ItemBufferKind,
    absorption: bool,
}

/// Traced light of the last wavefront bake.
#[derive(Debug, Default)]
pub(super) struct WavefrontCache {
    key: Option<TraceKey>,
    /// Sizes of lit areas, by a coarser lattice.
    pub(super) statistics: Option<FootprintStatistics>,
    /// By light, in the order of the aim; empty where it was not kept.
    pub(super) lights: Vec<TracedLight>,
}

impl WavefrontCache {
    /// Forgets what other settings traced.
    pub(super) fn prepare(&mut self, layer: &CausticLayer) {
        let BakeSettings {
            density_per_sr,
            max_error,
            map_resolution,
            max_depth,
            branch_threshold,
            item_buffer,
            ..
        } = *layer.settings;
        let key = TraceKey {
            density_per_sr,
            target: max_error.map(|target| (target, map_resolution)),
            max_depth,
            branch_threshold,
            item_buffer,
            absorption: layer.plan.is_on(Effect::Absorption),
        };
        if self.key.as_ref() != Some(&key) {
            *self = Self {
                key: Some(key),
                ..Self::default()
            };
        }
    }
}
