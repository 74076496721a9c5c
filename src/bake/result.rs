//! The result of a bake.

use super::band_layers::BandLayer;
use serde::{Deserialize, Serialize};

use super::forecast::{CostPoint, ForecastReport};
use crate::error::Warning;
use crate::illumination::{IlluminationMap, Receiver};
use crate::light_pass::ledger::LightLedger;
use crate::plan::EffectPlan;
use crate::settings::{BakeSettings, ErrorMetric, LayerKind};

/// Why a bake ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The lattice of the requested density was traced.
    #[default]
    Density,
    /// The estimated error met the target.
    MaxError,
    /// The time limit was reached.
    MaxTime,
    /// More rays do not help: maps are as fine as memory allows, and the estimated error exceeds the target.
    Memory,
    /// Nothing specular is lit, or nothing can receive its light.
    NothingToDo,
    /// The user cancelled.
    Cancelled,
}

/// Counters of a bake.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BakeCounts {
    /// Light rays launched.
    pub rays: u64,
    /// Rays traced to build item buffers: none, as the scene is projected onto their cells.
    pub item_buffer_rays: u64,
    /// Nodes, triangles and cells tested to build item buffers.
    pub item_buffer_tests: u64,
    /// Closest-hit queries along light paths, without those that search for bundles.
    pub segments: u64,
    /// Shadow rays of the direct layer.
    pub shadow_rays: u64,
    /// Rays traced from diffuse surfaces to gather indirect light.
    #[serde(default)]
    pub gather_rays: u64,
    /// Closest-hit queries along gather rays.
    #[serde(default)]
    pub gather_segments: u64,
    /// Bounces of indirect light until it converged.
    #[serde(default)]
    pub bounces: u32,
    /// Interpolated rays tested against candidate receivers: none, as bundles interpolate where light arrives.
    pub receiver_queries: u64,
    /// Kernels deposited.
    pub splats: u64,
    /// Squares of the launch domain whose bundles were deposited, level by level.
    pub cells: u64,
}

/// Cost of one light's item buffers: tests, no rays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ItemBufferReport {
    /// The light's name.
    pub light: String,
    /// Cells that may see something specular.
    pub cells: u64,
    /// Cells that would, if opaque surfaces did not hide it.
    pub hidden_cells: u64,
    /// Nodes, triangles and cells tested.
    pub tests: u64,
    /// CPU time [ms].
    pub cpu_ms: f64,
}

/// Seconds per stage: wall-clock time, or CPU time of the whole process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timings {
    /// Reading the scene.
    pub load: f64,
    /// Building the bounding volume hierarchy.
    pub build: f64,
    /// Effects, item buffers, map sizes.
    pub plan: f64,
    /// Tracing light rays, shadow rays included.
    pub trace: f64,
    /// Depositing flux.
    pub deposit: f64,
    /// The whole run.
    pub total: f64,
}

/// One light's part of one layer of one map.
#[derive(Clone, Debug, PartialEq)]
pub struct LightLayer {
    /// Receiver of the map.
    pub receiver: Receiver,
    /// Index into `Scene::lights`.
    pub light: usize,
    /// Layer of the map.
    pub kind: LayerKind,
    /// E per texel [W/m²]; the parts of all lights add up to the layer.
    pub irradiance: Vec<[f32; 3]>,
}

/// Maps and everything that is known about how they were made.
#[derive(Clone, Debug, Default)]
pub struct Bake {
    /// One per surface that received flux, in the order of `Scene::objects`.
    pub maps: Vec<IlluminationMap>,
    /// Each light's part of the maps, if requested: map by map, caustic before direct, in the order of lights; then the
    /// indirect parts.
    pub light_layers: Vec<LightLayer>,
    /// Each band's part of the maps, if requested: map by map, by rising wavelength.
    pub band_layers: Vec<BandLayer>,
    /// Effects that were on, and why.
    pub plan: EffectPlan,
    /// Cost of each light's item buffers.
    pub item_buffers: Vec<ItemBufferReport>,
    /// Energy of the caustic layer, one ledger per light.
    pub ledgers: Vec<LightLedger>,
    /// Counters.
    pub counts: BakeCounts,
    /// Cost and error after each level whose error was known.
    pub course: Vec<CostPoint>,
    /// Forecast and actual cost of the target; `None` without a target.
    pub forecast: Option<ForecastReport>,
    /// Wall-clock seconds.
    pub timings_s: Timings,
    /// CPU seconds over all threads of the process.
    pub cpu_s: Timings,
    /// Estimated relative RMSE over all maps; `None` if nothing was estimated.
    pub estimated_relative_rmse: Option<f64>,
    /// Estimated visible error of all maps; `None` if nothing was estimated.
    pub estimated_visible: Option<f64>,
    /// Why the bake ended.
    pub stop_reason: StopReason,
    /// Whether it was cancelled before it was done.
    pub partial: bool,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
}

impl Bake {
    /// The estimated error of all maps, in a metric.
    pub fn estimated_error(&self, metric: ErrorMetric) -> Option<f64> {
        metric.of(self.estimated_visible, self.estimated_relative_rmse)
    }

    /// Whether refinement ended by the target, and the error of all layers meets it as well: the rays of indirect light
    /// may not suffice.
    pub fn has_met_target(&self, settings: &BakeSettings) -> bool {
        let error = self.estimated_error(settings.error_metric);
        let is_met = settings
            .max_error
            .is_none_or(|target| error.is_none_or(|error| error <= target));
        self.stop_reason == StopReason::MaxError && is_met
    }
}
