//! From sums of flux to finished maps.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::caustic_layer::CausticOutcome;
use super::sizes::{self, MapSizes};
use super::{BakeResult, Clock, StopReason, Timings};
use crate::error::Result;
use crate::illumination::accumulator::FluxUnit;
use crate::illumination::gutter::fill_gutter;
use crate::illumination::{Chart, IlluminationMap, Layer};
use crate::light_pass::caustic::pass::Stopwatch;
use crate::light_pass::direct::bake_direct;
use crate::light_pass::receiver_maps::{ReceiverMap, ReceiverMaps};
use crate::plan::{Effect, EffectPlan};
use crate::progress::{Control, Progress};
use crate::settings::{BakeSettings, LayerKind};
use crate::transport::Tracer;

/// All that finishing needs.
pub(super) struct Finish<'a> {
    pub(super) tracer: &'a Tracer,
    pub(super) sizes: &'a MapSizes,
    pub(super) settings: &'a BakeSettings,
    pub(super) plan: EffectPlan,
    pub(super) caustic: CausticOutcome,
}

impl Finish<'_> {
    /// Converts flux to irradiance, adds the direct layer, and puts everything together.
    pub(super) fn run(
        self,
        progress: &dyn Progress,
        control: &Control,
        clock: &mut Clock,
    ) -> Result<BakeResult> {
        let mut counts = self.caustic.counts;
        let charts = self.charts()?;
        let mut direct = BTreeMap::new();
        if self.plan.is_on(Effect::Direct) {
            let watch = Stopwatch::start();
            let list: Vec<&Chart> = charts.values().map(|chart| &**chart).collect();
            let layers = bake_direct(self.tracer, &list, progress, control);
            counts.shadow_rays += layers.iter().map(|layer| layer.shadow_rays).sum::<u64>();
            direct = charts.keys().copied().zip(layers).collect();
            clock.trace.add(watch.elapsed());
        }
        let partial =
            self.caustic.cancelled || control.is_cancelled() || direct.values().any(|layer| !layer.complete);
        let mut maps = Vec::new();
        for (object, chart) in charts {
            let mut layers = Vec::new();
            if let Some((map, unit)) = self.caustic_map(object) {
                layers.push(caustic_layer(map, unit));
            }
            if let Some(layer) = direct.remove(&object) {
                layers.push(Layer {
                    kind: LayerKind::Direct,
                    irradiance: layer.irradiance,
                });
            }
            maps.push(IlluminationMap {
                chart,
                layers,
                error: None,
                estimated_relative_rmse: None,
            });
        }
        let stop_reason = if partial {
            StopReason::Cancelled
        } else if self.plan.is_on(Effect::LightPass) || self.plan.is_on(Effect::Direct) {
            StopReason::Density
        } else {
            StopReason::NothingToDo
        };
        Ok(BakeResult {
            maps,
            plan: self.plan,
            ledgers: self.caustic.ledgers,
            counts,
            timings_s: Timings::default(),
            cpu_s: Timings::default(),
            estimated_relative_rmse: None,
            stop_reason,
            partial,
            warnings: self.caustic.warnings,
        })
    }
}

impl Finish<'_> {
    fn caustic_map(&self, object: usize) -> Option<(&ReceiverMap, FluxUnit)> {
        let (maps, unit) = self.caustic.maps.as_ref()?;
        Some((maps.get(object)?, *unit))
    }

    /// Charts of all maps, by object: those that received flux, and every receiver where direct light is asked for.
    fn charts(&self) -> Result<BTreeMap<usize, Arc<Chart>>> {
        let scene = self.tracer.scene();
        let mut charts = BTreeMap::new();
        let mut texels = 0;
        for object in 0..scene.objects.len() {
            let chart = if let Some((map, _)) = self.caustic_map(object) {
                Some(map.chart.clone())
            } else if self.plan.is_on(Effect::Direct) && scene.material_of(object).surface.is_receiver() {
                let size = self.sizes.direct_size(object, self.settings);
                texels += size.map_or(0, |(width, height)| width as u64 * height as u64);
                sizes::check_memory(texels, self.settings)?;
                size.and_then(|size| self.sizes.chart(object, size))
            } else {
                None
            };
            if let Some(chart) = chart {
                texels += (chart.width * chart.height) as u64;
                charts.insert(object, chart);
            }
        }
        Ok(charts)
    }
}

/// Unfinished maps as they stand: the caustic layer alone.
pub(super) fn preview(maps: &ReceiverMaps, unit: FluxUnit) -> Vec<IlluminationMap> {
    maps.iter()
        .map(|(_, map)| IlluminationMap {
            chart: map.chart.clone(),
            layers: vec![caustic_layer(map, unit)],
            error: None,
            estimated_relative_rmse: None,
        })
        .collect()
}

/// E = Φ/A per texel; nothing where the surface does not reach, but for the gutter.
fn caustic_layer(map: &ReceiverMap, unit: FluxUnit) -> Layer {
    let flux = map.flux();
    let mut irradiance: Vec<[f32; 3]> = flux
        .texels()
        .iter()
        .enumerate()
        .map(|(texel, &count)| {
            let area_m2 = map.chart.texel_area_m2(texel);
            if area_m2 > 0.0 {
                (unit.flux_w(count) / area_m2)
                    .to_array()
                    .map(|channel| channel as f32)
            } else {
                [0.0; 3]
            }
        })
        .collect();
    fill_gutter(&map.chart, &mut irradiance);
    Layer {
        kind: LayerKind::Caustic,
        irradiance,
    }
}
