//! What a splat bake traced, kept for the next: another map size, sigma, kernel or footprint deposits it again without
//! a ray.

use super::caustic_layer::CausticLayer;
use crate::light_pass::caustic::kept::KeptLight;
use crate::light_pass::caustic::pass::Source;
use crate::plan::Effect;
use crate::settings::{ItemBufferKind, RayPlacement};

/// All that tracing depends on, beside the scene.
#[derive(Clone, Debug, PartialEq)]
struct TraceKey {
    density_per_sr: f64,
    rays: RayPlacement,
    seed: u64,
    max_depth: u32,
    branch_threshold: f64,
    item_buffer: ItemBufferKind,
    absorption: bool,
}

/// Light of the last splat bake.
#[derive(Debug, Default)]
pub(super) struct SplatCache {
    key: Option<TraceKey>,
    /// By light, in the order of the aim: of all lights, or of none.
    lights: Vec<KeptLight>,
    /// Of the bake under way.
    new: Option<Vec<KeptLight>>,
    /// Memory that the bake under way may still keep [bytes].
    left_bytes: u64,
}

impl SplatCache {
    /// At the start of a bake: forgets what other settings traced, and what is more than these allow.
    pub(super) fn prepare(&mut self, layer: &CausticLayer) {
        let settings = layer.settings;
        let key = TraceKey {
            density_per_sr: settings.density_per_sr,
            rays: settings.rays,
            seed: settings.seed,
            max_depth: settings.max_depth,
            branch_threshold: settings.branch_threshold,
            item_buffer: settings.item_buffer,
            absorption: layer.plan.is_on(Effect::Absorption),
        };
        self.left_bytes = settings.kept_light_bytes();
        let held: u64 = self.lights.iter().map(KeptLight::bytes).sum();
        if self.key.as_ref() != Some(&key) || held > self.left_bytes {
            self.lights.clear();
        }
        self.new = self.lights.is_empty().then(Vec::new);
        self.key = Some(key);
    }

    /// Arrivals of all lights; `None` where they are to be traced.
    pub(super) fn arrivals(&self) -> Option<u64> {
        (!self.lights.is_empty()).then(|| self.lights.iter().map(KeptLight::arrivals).sum())
    }

    /// Where the light of a light is to come from, by its place in the aim.
    pub(super) fn source(&self, light: usize) -> Source<'_> {
        match self.lights.get(light) {
            Some(kept) => Source::Kept(kept),
            None => Source::Rays {
                keep_bytes: if self.new.is_some() { self.left_bytes } else { 0 },
            },
        }
    }

    /// After a light was traced: keeps what it sent. One light that cannot be kept, and none is.
    pub(super) fn keep(&mut self, traced: Option<KeptLight>) {
        match (&mut self.new, traced) {
            (Some(new), Some(light)) => {
                self.left_bytes -= light.bytes().min(self.left_bytes);
                new.push(light);
            }
            _ => self.new = None,
        }
    }

    /// After the last light.
    pub(super) fn finish(&mut self) {
        if let Some(new) = self.new.take() {
            self.lights = new;
        }
    }
}
