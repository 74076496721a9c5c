//! Cache of the rays between diffuse surfaces. They depend on geometry alone, so edits of lights reuse them.

use std::sync::Arc;

use super::sizes::ChartCache;
use crate::illumination::{Chart, Receiver};
use crate::light_pass::indirect::Network;
use crate::progress::{Control, Progress};
use crate::settings::BakeSettings;
use crate::transport::Tracer;

/// What the rays depend on besides the scene: grids by receiver, maximum depth, seed.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Key {
    grids: Vec<(Receiver, (usize, usize))>,
    max_depth: u32,
    seed: u64,
}

/// Elements of all grids for the draft preset; each better preset has four times as many.
const DRAFT_TEXELS: u64 = 8_000;

/// Rays that are kept between bakes.
#[derive(Debug, Default)]
pub(super) struct IndirectCache {
    network: Option<(Key, Network)>,
    /// Passes of each element in the last maps.
    pub(super) passes: Vec<u8>,
}

impl IndirectCache {
    /// Drops everything, because shapes or materials changed.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// The elements with their traced rays, once prepared.
    pub(super) fn network(&self) -> Option<&Network> {
        self.network.as_ref().map(|(_, network)| network)
    }

    /// Prepares the grids for `settings`, with at most `most_texels` texels in total; drops the rays of other grids.
    pub(super) fn prepare(
        &mut self,
        tracer: &Tracer,
        sizes: &ChartCache,
        settings: &BakeSettings,
        most_texels: u64,
    ) {
        let key = Key {
            grids: sizes.grid_sizes(settings, most_texels),
            max_depth: settings.depth(),
            seed: settings.seed,
        };
        if self.network.as_ref().is_some_and(|(known, _)| *known == key) {
            return;
        }
        let charts: Vec<Arc<Chart>> = key
            .grids
            .iter()
            .filter_map(|&(receiver, size)| sizes.chart(receiver, size))
            .collect();
        let network = Network::new(tracer.scene(), &charts);
        (self.network, self.passes) = (Some((key, network)), Vec::new());
    }

    /// Traces what is missing for each element to have its number of passes; false if cancelled.
    pub(super) fn trace(
        &mut self,
        tracer: &Tracer,
        passes: &[u8],
        progress: &dyn Progress,
        control: &Control,
    ) -> bool {
        match &mut self.network {
            Some((key, network)) => {
                let (max_depth, seed) = (key.max_depth, key.seed);
                network.trace(tracer, passes, (max_depth, seed), progress, control)
            }
            None => false,
        }
    }
}

/// Maximum texels of all grids: as many as the preset wants and memory allows.
pub(super) fn most_texels(settings: &BakeSettings) -> u64 {
    let wanted = DRAFT_TEXELS << (2 * settings.detail());
    wanted.min(link_bytes(settings) / BYTES_OF_FIRST_PASSES).max(1)
}

/// Memory of one texel with its first passes [bytes].
const BYTES_OF_FIRST_PASSES: u64 = 1 << 10;

/// Memory limit of the rays between diffuse surfaces [bytes]: a quarter of the whole.
pub(super) fn link_bytes(settings: &BakeSettings) -> u64 {
    settings.memory_bytes / 4
}
