//! Chooses the size of each surface's map from the light that a coarse lattice deposited on it.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::caustic::{BakeContext, CausticLayer};
use super::map_size::{self, MapSize, SizeRequest, Sizes};
use super::sizes::{LARGEST_AUTOMATIC_SIDE, LARGEST_TILED_SIDE, MapMemory};
use crate::error::Warning;
use crate::illumination::tiles::COARSEST;
use crate::illumination::{Chart, Receiver};
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::plan::Effect;
use crate::settings::{Estimator, MapResolution};

impl CausticLayer<'_> {
    /// Whether maps of the requested fixed size fit into memory whatever is lit; true for automatic sizes.
    pub(super) fn fits_anyway(&self) -> bool {
        let MapResolution::Fixed { width, height } = self.settings.map_resolution else {
            return true;
        };
        let scene = self.tracer.scene();
        let is_receiver = |&object: &usize| scene.material_of(object).surface.is_receiver();
        let receivers = Receiver::all(scene.objects.len()).filter(|receiver| is_receiver(&receiver.object()));
        let (limit, memory) = self.map_memory(None);
        memory.bytes(receivers.map(|receiver| (receiver, width as u64 * height as u64))) <= limit
    }

    /// Memory limit of all maps [bytes], and the memory that they need. All lights reach all receivers, unless a coarse
    /// run tells which.
    fn map_memory(&self, statistics: Option<&FootprintStatistics>) -> (u64, MapMemory) {
        let settings = self.settings;
        let lights = statistics.map_or_else(
            || {
                let all = Receiver::all(self.tracer.scene().objects.len());
                let lights = self.lit().count() as u64;
                all.map(|receiver| (receiver, lights)).collect()
            },
            |statistics| statistics.lights().clone(),
        );
        let keeps_photons = self.lit().any(|light| !self.has_bundles(light));
        let direct = if self.plan.is_on(Effect::Direct) {
            settings.direct_bytes()
        } else {
            0
        };
        // Squares of lights that are done, and of the others.
        let squares = match settings.estimator {
            Estimator::Auto => 2 * settings.squares_bytes(),
            Estimator::Photon | Estimator::Splat => 0,
        };
        (
            settings.map_memory_bytes().saturating_sub(direct + squares),
            MapMemory::with(settings.estimator, keeps_photons, lights),
        )
    }

    /// What each light may keep besides its last maps, of coarser levels and again of squares: half of what the maps
    /// leave of the memory limit [bytes].
    pub(super) fn spare_bytes(&self, sizes: &Sizes, statistics: Option<&FootprintStatistics>) -> u64 {
        let (limit, memory) = self.map_memory(statistics);
        limit.saturating_sub(memory.of_sizes(sizes)) / (2 * self.lit().count().max(1)) as u64
    }

    /// What the squares of a light may take while it is refined [bytes].
    pub(super) fn squares_bytes(&self, context: &BakeContext) -> u64 {
        context.spare_bytes + self.settings.squares_bytes() / context.open_lights.max(1) as u64
    }

    /// What each light may keep for the next bake [bytes].
    pub(super) fn kept_light_bytes(&self) -> u64 {
        self.settings.kept_light_bytes() / self.lit().count().max(1) as u64
    }

    /// Sizes of the maps that the coarse run found lit, and warnings about them.
    pub(super) fn map_sizes(&self, statistics: Option<&FootprintStatistics>) -> (Sizes, Vec<Warning>) {
        // Fixed sizes that fit into memory whatever is lit need no statistics.
        let receivers = Receiver::all(self.tracer.scene().objects.len());
        if let (MapResolution::Fixed { width, height }, true) =
            (self.settings.map_resolution, self.fits_anyway())
        {
            let even = |receiver| (receiver, MapSize::dense((width, height)));
            return (receivers.map(even).collect(), Vec::new());
        }

        // Otherwise each lit map asks for a size by the light that was seen on it.
        let wish = |receiver: Receiver| {
            let wish = match (self.settings.map_resolution, statistics) {
                (MapResolution::Fixed { width, height }, None) => Some(SizeRequest::dense((width, height))),
                (MapResolution::Fixed { width, height }, Some(seen)) => {
                    self.fixed_wish(receiver, (width, height), seen)
                }
                (MapResolution::Auto, Some(seen)) => self.automatic_wish(receiver, seen),
                (MapResolution::Auto, None) => None,
            };
            let flux_w = statistics
                .and_then(|seen| seen.mean(receiver))
                .map_or(0.0, |mean| mean.flux_w);
            wish.map(|wish| (receiver, SizeRequest { flux_w, ..wish }))
        };
        let wishes: BTreeMap<Receiver, SizeRequest> = receivers.filter_map(wish).collect();

        // If memory is short, all maps become coarser together.
        let (limit, memory) = self.map_memory(statistics);
        let requested = map_size::requested(&wishes);
        let mut sizes = map_size::fit(&wishes, (limit, &memory));
        let is_scarce = sizes != requested;
        if let (MapResolution::Fixed { width, height }, false) = (self.settings.map_resolution, is_scarce) {
            // Maps that only the full lattice lights.
            for receiver in Receiver::all(self.tracer.scene().objects.len()) {
                sizes.entry(receiver).or_insert(MapSize::dense((width, height)));
            }
        }

        // Scarce memory makes maps coarser than their light, too, so that it is the only cause that is named.
        let warnings = if is_scarce {
            vec![memory_warning(&requested, &sizes, (limit, &memory))]
        } else if let (MapResolution::Auto, Some(statistics)) = (self.settings.map_resolution, statistics) {
            self.coarse_maps(&sizes, statistics)
        } else {
            Vec::new()
        };
        (sizes, warnings)
    }

    /// At the requested size, with all texels equally fine if memory allows.
    fn fixed_wish(
        &self,
        receiver: Receiver,
        size: (usize, usize),
        seen: &FootprintStatistics,
    ) -> Option<SizeRequest> {
        let share = seen.mean(receiver)?.map_share;
        let texels = size.0 as f64 * size.1 as f64;
        Some(SizeRequest {
            fineness: 0.5 * (texels * share).log2(),
            tiles: self
                .may_be_tiled(receiver.object(), size)
                .then(|| map_size::needs(size, seen.spots(receiver))),
            ..SizeRequest::dense(size)
        })
    }

    /// As fine as the light requires; tiled where that takes less memory.
    fn automatic_wish(&self, receiver: Receiver, seen: &FootprintStatistics) -> Option<SizeRequest> {
        // The map has to resolve footprints and direct light. Shadow borders count only with estimators whose maps may
        // be tiled.
        let object = receiver.object();
        let mut times = self.sizes.doublings(receiver, seen, LARGEST_TILED_SIDE)?;
        let is_direct = self.plan.is_on(Effect::Direct);
        let finer = if is_direct && self.settings.estimator.refines() {
            self.sizes.border_doublings(receiver, self.settings)
        } else {
            0
        };
        if is_direct {
            // Not coarser than direct light on a map of its own.
            times = times.max(self.sizes.doublings_for_direct(object, self.settings) + finer);
        }

        // The finest size that is small enough is taken: in tiles, which are coarse in the dark, or else as a dense
        // map.
        let borders = self.sizes.borders(receiver).filter(|_| finer > 0);
        for times in (0..=times).rev() {
            let size = self.sizes.doubled_size(object, times)?;
            let is_small = size.0.max(size.1) <= LARGEST_AUTOMATIC_SIDE;
            let coarsest = self.coarsest_tile(object, size);
            if self.may_be_tiled(object, size) && coarsest > 0 {
                let mut tiles = map_size::needs(size, seen.spots(receiver));
                if let Some(borders) = &borders {
                    borders.refine(size, coarsest.saturating_sub(finer as u8), &mut tiles);
                }
                let wish = SizeRequest {
                    is_even: false,
                    tiles: Some(tiles),
                    coarsest,
                    ..SizeRequest::dense(size)
                };
                let texels = wish.granted(map_size::MemoryReduction::Nothing).texels();
                if is_small || texels <= (LARGEST_AUTOMATIC_SIDE * LARGEST_AUTOMATIC_SIDE) as u64 {
                    return Some(wish);
                }
            }
            if is_small {
                return Some(SizeRequest::dense(size));
            }
        }
        None
    }

    /// Whether a map of a size can be tiled: the estimator has to refine, and the surface to fill its map.
    fn may_be_tiled(&self, object: usize, size: (usize, usize)) -> bool {
        self.settings.estimator.refines()
            && map_size::is_divisible(size)
            && self
                .sizes
                .parametrisation(object)
                .is_some_and(|parametrisation| parametrisation.is_uniform())
    }

    /// The coarsest level of tiles on which direct light is no coarser than without caustics.
    fn coarsest_tile(&self, object: usize, size: (usize, usize)) -> u8 {
        if !self.plan.is_on(Effect::Direct) {
            return COARSEST;
        }
        self.sizes
            .direct_halvings(object, size, self.settings)
            .min(u32::from(COARSEST)) as u8
    }

    /// Warnings about automatic maps that stay coarser than their light because of the largest automatic size.
    fn coarse_maps(&self, sizes: &Sizes, statistics: &FootprintStatistics) -> Vec<Warning> {
        let coarse = |(&receiver, MapSize { size, .. }): (&Receiver, &MapSize)| {
            let (width, height) = *size;
            let footprint_texels = (width * height) as f64 * statistics.mean(receiver)?.map_share;
            (footprint_texels < 1.0).then(|| {
                Warning::new(
                    &self.tracer.scene().objects[receiver.object()].name,
                    format!(
                        "its map of {width} x {height} texels is coarser than the light it holds: a ray's mean \
                         footprint is {footprint_texels:.2} texels"
                    ),
                    "ask for a larger --map-resolution",
                )
            })
        };
        sizes.iter().filter_map(coarse).collect()
    }

    /// The chart of a receiver at its size among `sizes`, else at its default size.
    pub(super) fn chart(&self, receiver: Receiver, sizes: &Sizes) -> Option<Arc<Chart>> {
        match sizes.get(&receiver) {
            Some(size) => self.sizes.chart_of(receiver, size),
            None => self.sizes.chart_of(receiver, &self.default_size(receiver)?),
        }
    }

    /// Size for a surface that only later photons reached: at least that of a map without caustics, if it holds direct
    /// light.
    fn default_size(&self, receiver: Receiver) -> Option<MapSize> {
        let (width, height) = self.sizes.doubled_size(receiver.object(), 0)?;
        if let MapResolution::Fixed {
            width: most,
            height: highest,
        } = self.settings.map_resolution
        {
            return Some(MapSize::dense((width.min(most), height.min(highest))));
        }
        let first = MapSize::dense((width, height));
        let holds_direct = self.plan.is_on(Effect::Direct)
            && self.settings.estimator.refines()
            && self.sizes.may_see_lights(receiver);
        if !holds_direct {
            return Some(first);
        }
        let wish = self.sizes.direct_wish(receiver, self.settings)?;
        let of_direct = wish.granted(map_size::MemoryReduction::Nothing);
        Some(if of_direct.texels() > first.texels() {
            of_direct
        } else {
            first
        })
    }
}

/// Location of warnings about scarce memory.
pub(super) const MEMORY: &str = "--memory";

/// The warning that the memory limit [bytes] makes maps coarser than requested.
pub(super) fn memory_warning(
    requested: &Sizes,
    granted: &Sizes,
    (limit, memory): (u64, &MapMemory),
) -> Warning {
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let taken = memory.of_sizes(granted);
    Warning::new(
        MEMORY,
        format!(
            "the maps need {:.1} MiB, the limit is {:.1} MiB: they were made {} {:.1} MiB",
            mebibytes(memory.of_sizes(requested)),
            mebibytes(limit),
            if taken <= limit {
                "coarser and take"
            } else {
                "as coarse as can be and still take"
            },
            mebibytes(taken),
        ),
        "allow more --memory, or ask for a smaller --map-resolution",
    )
}
