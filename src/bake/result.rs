//! The result of a bake.

use super::band_layers::BandLayer;
use serde::{Deserialize, Serialize};

use super::forecast::{CostPoint, ForecastReport};
use crate::error::Warning;
use crate::illumination::{IlluminationMap, Receiver};
use crate::light_pass::ledger::LightLedger;
use crate::plan::EffectPlan;
use crate::settings::{ErrorMetric, LayerKind};

/// Why a bake ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The lattice of the asked density was traced.
    Density,
    /// The estimated error is below the target.
    MaxError,
    /// The time was up.
    MaxTime,
    /// More rays do not help: the maps are as fine as memory allows, and the estimated error is above the target.
    Memory,
    /// Nothing specular is lit, or nothing can receive it: there was nothing to do.
    NothingToDo,
    /// It was asked to stop.
    Cancelled,
}

/// Counters of a bake; DESIGN's `counts`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BakeCounts {
    /// Light directions launched for light transport.
    pub rays: u64,
    /// Rays traced to build item buffers: none, the scene is projected onto their cells.
    pub item_buffer_rays: u64,
    /// Nodes, triangles and cells tested to build item buffers.
    pub item_buffer_tests: u64,
    /// Closest-hit queries along light paths, without those that look for bundles.
    pub segments: u64,
    /// Any-hit queries of the direct layer.
    pub shadow_rays: u64,
    /// Rays that diffuse surfaces sent out to gather indirect light.
    #[serde(default)]
    pub gather_rays: u64,
    /// Closest-hit queries along them.
    #[serde(default)]
    pub gather_segments: u64,
    /// How often indirect light was sent on until it stood.
    #[serde(default)]
    pub bounces: u32,
    /// Interpolated rays against candidate receivers.
    pub receiver_queries: u64,
    /// Kernels deposited.
    pub splats: u64,
    /// Wavefront cells deposited.
    pub cells: u64,
}

/// What it took to look around from one light: tests, no rays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ItemBufferReport {
    /// The light's name.
    pub light: String,
    /// Cells that may see something specular.
    pub cells: u64,
    /// Cells that would, if opaque surfaces did not cover them.
    pub hidden_cells: u64,
    /// Nodes, triangles and cells that were tested.
    pub tests: u64,
    /// CPU time [ms].
    pub cpu_ms: f64,
}

/// Seconds per stage; used for wall-clock times and for CPU times of the whole process.
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

/// What one light gives to one layer of one map.
#[derive(Clone, Debug, PartialEq)]
pub struct LightLayer {
    /// Whose light it is.
    pub receiver: Receiver,
    /// Index into `Scene::lights`.
    pub light: usize,
    /// Of which layer.
    pub kind: LayerKind,
    /// E per texel [W/m²], as in the map; all lights add up to its layer.
    pub irradiance: Vec<[f32; 3]>,
}

/// Maps with everything that is known of how they came about.
#[derive(Clone, Debug)]
pub struct Bake {
    /// One per surface that received flux, in the order of `Scene::objects`.
    pub maps: Vec<IlluminationMap>,
    /// What each light gives to them, where that is asked for: map by map, caustic before direct, in the order of lights, and all of
    /// indirect after them.
    pub light_layers: Vec<LightLayer>,
    /// What each band of the spectrum gives to them, where that is asked for: map by map, from the shortest wavelength on.
    pub band_layers: Vec<BandLayer>,
    /// Which effects were on, and why.
    pub plan: EffectPlan,
    /// What looking around from each light took.
    pub item_buffers: Vec<ItemBufferReport>,
    /// Energy of the caustic layer, one per light with its name.
    pub ledgers: Vec<LightLedger>,
    /// Counters.
    pub counts: BakeCounts,
    /// Where it stood after each level whose error was known.
    pub course: Vec<CostPoint>,
    /// What the target was expected to cost, and what it cost; `None` without a target.
    pub forecast: Option<ForecastReport>,
    /// Wall-clock seconds.
    pub timings_s: Timings,
    /// CPU seconds over all threads of the process.
    pub cpu_s: Timings,
    /// Estimated relative RMSE over all maps; `None` where nothing was estimated.
    pub estimated_relative_rmse: Option<f64>,
    /// Estimated visible error of all maps; `None` where nothing was estimated.
    pub estimated_visible: Option<f64>,
    /// Why it ended.
    pub stop_reason: StopReason,
    /// True where it was stopped before it was done.
    pub partial: bool,
    /// What the user should know of.
    pub warnings: Vec<Warning>,
}

impl Bake {
    /// The estimated error of all maps, in a metric.
    pub fn estimated_error(&self, metric: ErrorMetric) -> Option<f64> {
        metric.of(self.estimated_visible, self.estimated_relative_rmse)
    }
}
