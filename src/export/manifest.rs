//! `manifest.json`: how a folder of maps was made, and where each map is.

use serde::{Deserialize, Serialize};

use super::sequence::FrameTimes;
use crate::bake::{
    BYTES_PER_TEXEL, Bake, BakeCounts, CostPoint, ForecastReport, ItemBufferReport, SpectralBand, StopReason,
    Timings,
};
use crate::error::Warning;
use crate::files::cache::ContentHash;
use crate::illumination::{IlluminationMap, Side, UvSet};
use crate::light_pass::ledger::{EnergyLedger, LightLedger};
use crate::plan::EffectLine;
use crate::scene::Scene;
use crate::settings::{BakeSettings, LayerKind};

/// Version of the format.
pub const SCHEMA: u32 = 1;

/// Name of the file in its folder.
pub const FILE_NAME: &str = "manifest.json";

/// Everything in `manifest.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Manifest {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of the program that wrote it.
    pub program_version: &'static str,
    /// Settings of the bake.
    pub settings: BakeSettings,
    /// Scene of the maps.
    pub scene: SceneSummary,
    /// Whether the bake was cancelled before it was done.
    pub partial: bool,
    /// Why the bake ended.
    pub stop_reason: StopReason,
    /// Warnings of loading and of the bake.
    pub warnings: Vec<Warning>,
    /// Wall-clock seconds.
    pub timings_s: Timings,
    /// CPU seconds of the process.
    pub cpu_s: Timings,
    /// Counters of the bake.
    pub counts: BakeCounts,
    /// Why each effect was on or off, and how the user set it.
    pub effects: Vec<EffectLine>,
    /// Cost of each light's item buffers.
    pub item_buffers: Vec<ItemBufferReport>,
    /// Forecast and actual cost of the target.
    pub forecast: Option<ForecastReport>,
    /// Cost and error after each level whose error was known.
    pub course: Vec<CostPoint>,
    /// Energy of the caustic layer over all lights.
    pub energy_w: EnergyLedger,
    /// One per light and layer.
    pub ledgers: Vec<LedgerEntry>,
    /// Estimated error of the whole bake.
    pub error: ErrorEstimate,
    /// One per surface that received flux.
    pub maps: Vec<MapEntry>,
    /// Frames of a moving scene; all other fields are then those of the first frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sequence: Option<Sequence>,
}

/// Maps of a scene at several moments.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sequence {
    /// Frames per second.
    pub fps: f64,
    /// Whether the first frame follows the last.
    pub is_loop: bool,
    /// In the order of time.
    pub frames: Vec<FrameEntry>,
}

impl Sequence {
    /// The scene at the time of each frame.
    pub fn scenes(&self, rest: &Scene) -> Vec<Scene> {
        let times = FrameTimes {
            frames: self.frames.len(),
            fps: self.fps,
            is_loop: self.is_loop,
        };
        let rest = times.scene(rest);
        self.frames.iter().map(|frame| rest.at(frame.time_s)).collect()
    }
}

/// One frame of a sequence.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrameEntry {
    /// Counted from 1.
    pub frame: usize,
    /// Time since the start of the scene [s].
    pub time_s: f64,
    /// Hash of the scene's geometry at that time.
    pub geometry_hash: String,
    /// Why its bake ended.
    pub stop_reason: StopReason,
    /// Estimated error.
    pub error: ErrorEstimate,
    /// Light rays of its caustic layer.
    pub rays: u64,
    /// Energy of its caustic layer over all lights.
    #[serde(skip_deserializing)]
    pub energy_w: EnergyLedger,
    /// CPU seconds of its bake.
    pub cpu_s: f64,
    /// One per surface that received flux.
    pub maps: Vec<MapEntry>,
}

/// The scene that maps belong to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneSummary {
    /// Path as the user gave it, or `builtin:NAME`.
    pub source: String,
    /// A short name.
    pub name: String,
    /// Number of primitives.
    pub objects: usize,
    /// Number of triangles over all objects.
    pub triangles: usize,
    /// Names of the lights.
    pub lights: Vec<String>,
    /// Hash of all geometry; maps fit only a scene with the same one.
    pub geometry_hash: String,
}

/// Energy of one light in one layer.
#[derive(Clone, Debug, Serialize)]
pub struct LedgerEntry {
    /// Layer of the light.
    pub layer: LayerKind,
    /// Energy by account.
    #[serde(flatten)]
    pub ledger: LightLedger,
}

/// Error estimated without a reference.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct ErrorEstimate {
    /// Relative RMSE; `None` if it was not estimated.
    pub estimated_relative_rmse: Option<f64>,
    /// Visible error; `None` if it was not estimated.
    pub estimated_visible: Option<f64>,
}

/// One map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapEntry {
    /// Name of the node in the scene's file.
    pub surface: String,
    /// glTF index of the node.
    pub node: usize,
    /// Index of the primitive within the node's mesh.
    pub primitive: usize,
    /// Side of the surface.
    pub side: Side,
    /// Path of the EXR file, relative to the manifest.
    pub file: String,
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// Texture coordinates of the map.
    pub uv_set: UvSet,
    /// Path of the generated coordinates, relative to the manifest.
    pub uv_file: Option<String>,
    /// Layers in the file.
    pub layers: Vec<LayerKind>,
    /// Each light's part of them, if requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<LightChannels>,
    /// Each band of the caustic layer's spectrum, if requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bands: Vec<BandChannel>,
    /// Mean area of the covered texels [m²].
    pub texel_area_m2: f64,
    /// Unit of the file's values.
    pub units: String,
    /// Relative RMSE of this map; `None` if it was not estimated.
    pub estimated_relative_rmse: Option<f64>,
    /// Visible error of this map; `None` if it was not estimated.
    #[serde(default)]
    pub estimated_visible: Option<f64>,
    /// Memory that the map took in the bake [bytes].
    #[serde(default)]
    pub memory_bytes: u64,
    /// Memory of the map if all texels were as fine as the file's [bytes].
    #[serde(default)]
    pub dense_bytes: u64,
}

/// Where a file holds one light's part of a layer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightChannels {
    /// The light's name.
    pub light: String,
    /// Layer of the light.
    pub layer: LayerKind,
    /// Prefix of its channels, before `.R`, `.G`, `.B`.
    pub channels: String,
}

/// Where a file holds one band of the caustic layer's spectrum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BandChannel {
    /// Range of wavelengths.
    #[serde(flatten)]
    pub band: SpectralBand,
    pub channel: String,
    /// Unit of its values: radiant, per nanometre.
    pub units: String,
}

impl BandChannel {
    /// Channel names follow Fichet, Pacanowski and Wilkie (An OpenEXR layout for spectral images, JCGT 10(3), 2021):
    /// the wavelength has a decimal comma.
    pub fn new(band: &SpectralBand) -> Self {
        let wavelength = format!("{:.3}", band.wavelength_nm).replace('.', ",");
        Self {
            band: band.clone(),
            channel: format!("caustic.S0.{wavelength}nm"),
            units: "W/(m^2 nm)".into(),
        }
    }
}

/// Unit of the maps' values.
pub const UNITS: &str = "W/m^2";

impl Manifest {
    /// Manifest of a bake that ran with `settings` and whose maps are stored as `maps` state.
    pub fn new(scene: &Scene, settings: &BakeSettings, result: &Bake, maps: Vec<MapEntry>) -> Self {
        let ledger = |ledger: &LightLedger| LedgerEntry {
            layer: LayerKind::Caustic,
            ledger: ledger.clone(),
        };
        Self {
            schema: SCHEMA,
            program_version: env!("CARGO_PKG_VERSION"),
            settings: settings.clone(),
            scene: SceneSummary::of(scene),
            partial: result.partial,
            stop_reason: result.stop_reason,
            warnings: scene.warnings.iter().chain(&result.warnings).cloned().collect(),
            timings_s: result.timings_s,
            cpu_s: result.cpu_s,
            counts: result.counts,
            effects: result.plan.effects.clone(),
            item_buffers: result.item_buffers.clone(),
            forecast: result.forecast,
            course: result.course.clone(),
            energy_w: result.ledgers.iter().map(|ledger| &ledger.energy_w).sum(),
            ledgers: result.ledgers.iter().map(ledger).collect(),
            error: ErrorEstimate {
                estimated_relative_rmse: result.estimated_relative_rmse,
                estimated_visible: result.estimated_visible,
            },
            maps,
            sequence: None,
        }
    }

    /// Paths of all files of the maps, relative to the manifest.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let frames = self.sequence.iter().flat_map(|sequence| &sequence.frames);
        let of_frames = frames.flat_map(|frame| &frame.maps);
        self.maps.iter().chain(of_frames).flat_map(MapEntry::files)
    }
}

impl SceneSummary {
    /// Summary that identifies a scene.
    pub fn of(scene: &Scene) -> Self {
        Self {
            source: scene.source.clone(),
            name: scene.name.clone(),
            objects: scene.objects.len(),
            triangles: scene.triangle_count(),
            lights: scene.lights.iter().map(|light| light.name.clone()).collect(),
            geometry_hash: format!("{:016x}", geometry_hash(scene)),
        }
    }
}

impl MapEntry {
    /// Its files, relative to the manifest.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let coordinates = self.uv_file.as_deref();
        std::iter::once(self.file.as_str()).chain(coordinates)
    }

    /// Entry of a map that is stored in `file`, of a size [texels].
    pub fn new(
        scene: &Scene,
        map: &IlluminationMap,
        (width, height): (usize, usize),
        (lights, bands): (Vec<LightChannels>, Vec<BandChannel>),
        file: String,
        uv_file: Option<String>,
    ) -> Self {
        let object = &scene.objects[map.chart.object()];
        Self {
            surface: object.name.clone(),
            node: object.node,
            primitive: object.primitive,
            side: map.chart.receiver.side(),
            file,
            width,
            height,
            uv_set: map.chart.uv_set,
            uv_file,
            layers: map.layers.iter().map(|layer| layer.kind).collect(),
            lights,
            bands,
            texel_area_m2: mean_texel_area_m2(map, width * height),
            units: UNITS.into(),
            estimated_relative_rmse: map.estimated_relative_rmse,
            estimated_visible: map.estimated_visible,
            memory_bytes: map.chart.texel_count() as u64 * BYTES_PER_TEXEL,
            dense_bytes: (width * height) as u64 * BYTES_PER_TEXEL,
        }
    }
}

/// Mean area of covered texels in a file of `texels`; the map may have fewer.
fn mean_texel_area_m2(map: &IlluminationMap, texels: usize) -> f64 {
    let chart = &map.chart;
    if chart.layout.is_some() {
        return chart.texel_areas_m2.iter().sum::<f64>() / texels as f64;
    }
    let covered = || chart.texel_areas_m2.iter().filter(|area| **area > 0.0);
    let larger = chart.texel_count() as f64 / texels as f64;
    match covered().count() {
        0 => 0.0,
        count => covered().sum::<f64>() / count as f64 * larger,
    }
}

fn geometry_hash(scene: &Scene) -> u64 {
    let mut hash = ContentHash::default();
    let mut take = |word: u64| hash.take(word);
    for object in &scene.objects {
        take(object.node as u64);
        take(object.primitive as u64);
        let mesh = object.in_scene();
        for position in mesh.positions() {
            position.to_array().iter().for_each(|value| take(value.to_bits()));
        }
        for uv in [0, 1].into_iter().filter_map(|set| mesh.uvs(set)).flatten() {
            uv.to_array().iter().for_each(|value| take(value.to_bits()));
        }
        for triangle in mesh.triangles() {
            triangle.iter().for_each(|vertex| take(u64::from(*vertex)));
        }
    }
    hash.value()
}
