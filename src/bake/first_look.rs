//! A coarse preview of direct and indirect light, shown until the final layers are finished.
//!
//! Before caustics are known, light goes straight through clear bodies: it arrives at wrong places, but in the right
//! amount.

use super::direct_cache::DirectCache;
use super::direct_work::DirectWork;
use super::finish::{DirectDetail, Levels, MapAssembler};
use super::indirect_cache::IndirectCache;
use super::indirect_work::IndirectWork;
use super::result::LightLayer;
use crate::illumination::IlluminationMap;
use crate::light_pass::indirect::{MIN_PASSES, Network};
use crate::plan::{Effect, wants_caustics};
use crate::progress::{Control, Progress};
use crate::transport::Tracer;

/// Elements of all grids of indirect light together.
const ELEMENTS: u64 = 1_500;

/// Rays between surfaces, kept for the rest of the bake.
#[derive(Debug, Default)]
pub(super) struct FirstLook {
    indirect: IndirectCache,
}

impl FirstLook {
    /// All maps: the caustics of the levels, and direct and indirect layers if requested.
    pub(super) fn maps(
        &mut self,
        finish: &MapAssembler,
        tracer: &Tracer,
        levels: &Levels,
        progress: &dyn Progress,
        control: &Control,
    ) -> (Vec<IlluminationMap>, Vec<LightLayer>) {
        let finish = &MapAssembler {
            direct: finish.direct.of_first_look(),
            ..*finish
        };
        let (charts, _) = finish.charts(levels);
        let mut direct = DirectCache::default();
        if finish.direct != DirectDetail::Absent {
            let passes_glass = levels.is_empty() && wants_caustics(finish.settings);
            let passing = passes_glass.then(|| tracer.without_clear_bodies());
            let direct_charts = finish.direct_charts(&charts);
            let lit_by = passing.as_ref().unwrap_or(tracer);
            DirectWork::default().bake_missing(lit_by, &direct_charts, &mut direct, progress, control);
        }
        let (mut maps, mut parts) = finish.maps(levels, &charts, &direct);
        if finish.plan.is_on(Effect::Indirect) {
            let known = self.traced(finish, tracer, progress, control);
            IndirectWork::of_known(known, &maps).add_to(known, &mut maps, &mut parts);
        }
        (maps, parts)
    }

    /// The rays between surfaces, traced on first use.
    pub(super) fn traced(
        &mut self,
        finish: &MapAssembler,
        tracer: &Tracer,
        progress: &dyn Progress,
        control: &Control,
    ) -> &IndirectCache {
        let indirect = &mut self.indirect;
        indirect.prepare(tracer, finish.sizes, finish.settings, ELEMENTS);
        let passes = vec![MIN_PASSES; indirect.network().map_or(0, Network::element_count)];
        if indirect.passes != passes && indirect.trace(tracer, &passes, progress, control) {
            indirect.passes = passes;
        }
        indirect
    }

    pub(super) fn indirect(&self) -> &IndirectCache {
        &self.indirect
    }
}
