//! What a session caches of one light: rays, and the maps of the last bake's levels.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::band_layers::LevelBand;
use super::band_maps::BandMaps;
use super::map_size::Sizes;
use super::spectra::SpectralKey;
use crate::geometry::enclosure::Bounds;
use crate::illumination::Receiver;
use crate::illumination::accumulator::{FluxCount, FluxUnit};
use crate::light_pass::accuracy::{LightError, Noise};
use crate::light_pass::caustic::arrival_cache::ArrivalCache;
use crate::light_pass::caustic::setup::VisibleLight;
use crate::light_pass::caustic::statistics::FootprintStatistics;
use crate::light_pass::ledger::CarriedFlux;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::light_pass::wavefront::cell::SubdivisionLimits;
use crate::light_pass::wavefront::kept_rays::RayCache;
use crate::light_pass::wavefront::overshoot::PatchOvershoot;
use crate::light_pass::wavefront::pass::TracedLight;
use crate::light_pass::wavefront::refine::Round;
use crate::optics::LinearSrgb;
use crate::scene::{Light, Scene};
use crate::settings::{BakeSettings, Estimator};
use crate::transport::{EffectSet, TraversedCells};

/// All that a light's paths depend on beside the scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TraceKey {
    /// With what does not matter to paths at its default.
    pub(super) settings: BakeSettings,
    /// What they may need.
    pub(super) effects: EffectSet,
    /// Cells across and down each face.
    pub(super) size: (usize, usize),
    /// How many lattices this one comes before the usual finest, where surfaces have bumps: what cells may miss of them.
    pub(super) coarser: i32,
    /// How often cells are split.
    pub(super) splits: SubdivisionLimits,
    /// Where cells are divided further, round by round.
    pub(super) rounds: Vec<Round>,
    /// What chose its wavelengths, where it is traced by wavelength.
    pub(super) spectrum: Option<SpectralKey>,
    /// Whether the light is taken to show hardly beside the others.
    pub(super) is_negligible: bool,
}

/// All that mean footprints depend on: the paths of each light, and the density that maps are made for [rays/sr].
pub(super) type StatisticsKey = (BTreeMap<usize, TraceKey>, f64);

/// All that a light's maps depend on beside the scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LevelKey {
    /// Its paths.
    pub(super) trace: TraceKey,
    /// Of the maps; those of the rounds are the same.
    pub(super) sizes: Sizes,
    /// How much coarser or finer triangles are than is usual.
    pub(super) coarseness: f64,
    /// Kernels of splats; with what does not matter to them at its default.
    pub(super) kernels: BakeSettings,
    /// Every so many-th ray alone (splats).
    pub(super) stride: usize,
    /// Of a light by photons: how many each half has.
    pub(super) photons: Option<u32>,
}

/// Levels that are kept whatever they take: an error needs them.
const LEVELS_TO_KEEP: usize = 3;

/// Maps of one light at one level, as of a white light of unit strength.
#[derive(Debug)]
pub(super) struct LightLevel {
    pub(super) key: LevelKey,
    /// Flux per texel.
    pub(super) maps: ReceiverMaps,
    /// The same by band of its spectrum, as X, Y and Z; none unless that is to be kept.
    pub(super) bands: Vec<LevelBand>,
    /// Radiant watts of the light over its luminous-equivalent ones, where it has a spectrum.
    pub(super) radiant: Option<f64>,
    pub(super) unit: FluxUnit,
    /// From the casters to the farthest receiver [m].
    pub(super) reach_m: f64,
    /// Of all paths.
    pub(super) ledger: LedgerSum,
    /// Maps that were given up: next to no light was on them.
    pub(super) strays: Vec<Receiver>,
    /// Patches that reach farther than their rays.
    pub(super) overshoots: Vec<PatchOvershoot>,
    /// Of splats: the squared difference of half sets, by receiver.
    pub(super) noise: Option<Noise>,
    /// By the levels before it; `None` where there are none, or no light arrived.
    pub(super) error: Option<KeptError>,
    /// Of the last level of a light by photons: what the next one adds to.
    pub(super) photons: Option<PhotonSums>,
    /// What the level took, whatever was known before: cells of patches and rays that looked for their receivers, or
    /// closest-hit queries of photons and nothing.
    pub(super) work: (u64, u64),
    /// Of patches: share of their light that holds a part of the spectrum in one place.
    pub(super) in_one_place: f64,
    /// To be deposited again; `None` where that was too much to keep.
    pub(super) traced: Option<TracedLight>,
    /// Whether the maps have the light's colour already.
    pub(super) has_own_colour: bool,
}

/// What photons have left so far, before it is divided by their number.
#[derive(Clone, Debug)]
pub(super) struct PhotonSums {
    pub(super) ledger: LedgerSum,
    /// Maps of both halves, in the channels that the light is followed in.
    pub(super) halves: Vec<BandMaps>,
}

impl PhotonSums {
    /// Adds other photons of the same light.
    pub(super) fn add(&mut self, other: &Self) {
        self.ledger.merge(&other.ledger);
        for (half, more) in self.halves.iter_mut().zip(&other.halves) {
            half.add(more);
        }
    }
}

/// An estimate with what it was made from.
#[derive(Clone, Debug)]
pub(super) struct KeptError {
    /// Coarser levels that it is made from.
    pub(super) predecessors: usize,
    /// Photons of each half that patches were compared with.
    pub(super) auditors: Option<u32>,
    pub(super) estimate: LightError,
}

/// What is kept of all lights of a scene.
#[derive(Debug, Default)]
pub(super) struct LightStates {
    by_light: BTreeMap<usize, LightState>,
    /// Mean footprints that set the sizes of maps, with what they depend on.
    pub(super) statistics: Option<(StatisticsKey, FootprintStatistics)>,
}

impl LightStates {
    /// Whether nothing is known of any light.
    pub(super) fn is_empty(&self) -> bool {
        self.by_light.is_empty()
    }

    /// Of a light, by its place in the scene.
    pub(super) fn of_mut(&mut self, light: usize) -> &mut LightState {
        self.by_light.entry(light).or_default()
    }

    pub(super) fn finest(&self, light: usize) -> Option<&LightLevel> {
        self.by_light.get(&light)?.levels.last()
    }

    /// A light is not what it was.
    pub(super) fn forget(&mut self, light: usize) {
        self.by_light.remove(&light);
        self.statistics = None;
    }

    /// Memory of all that is kept [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.by_light.values().map(LightState::bytes).sum()
    }

    /// All states.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut LightState> {
        self.by_light.values_mut()
    }
}

/// What is kept of one light.
#[derive(Debug, Default)]
pub(super) struct LightState {
    /// Where its rays start, and what they are aimed at.
    aim: Option<VisibleLight>,
    /// Where they went, of all that is kept.
    pub(super) traversed: Option<Arc<TraversedCells>>,
    /// Whether bumps bent them.
    has_bumps: bool,
    /// What chose their wavelengths.
    spectrum: Option<SpectralKey>,
    /// What its rays met.
    pub(super) rays: RayCache,
    /// Levels of the last bake, the coarsest first.
    pub(super) levels: Vec<LightLevel>,
    /// Wall-clock seconds of a photon, of those that were followed last.
    pub(super) photon_s: Option<f64>,
    /// What splats were made of.
    pub(super) arrivals: Option<(TraceKey, ArrivalCache)>,
}

impl LightLevel {
    /// What its maps are multiplied by per channel.
    pub(super) fn strength(&self, light: &Light) -> LinearSrgb {
        if self.has_own_colour {
            LinearSrgb::grey(light.strength().luminance())
        } else {
            light.strength()
        }
    }

    /// Radiant flux on all maps [W], where bands are kept.
    pub(super) fn deposited_radiant_w(&self, light: &Light) -> Option<f64> {
        if self.bands.is_empty() {
            return None;
        }
        let of_band = |band: &LevelBand| {
            let counts = band.maps.iter().map(|(_, map)| map.flux_counts()[band.channel]);
            counts.sum::<i128>() as f64 * band.radiant
        };
        let flux: f64 = self.bands.iter().map(of_band).sum();
        Some(flux * self.unit.watts() * self.strength(light).luminance())
    }

    /// What it deposited [W], by what carried it.
    pub(super) fn carried_w(&self, deposited: f64, light: &Light, estimator: Estimator) -> CarriedFlux {
        let bundles = self
            .ledger
            .watts(Account::Bundled, self.unit, self.strength(light));
        let nothing = CarriedFlux::default();
        match (self.key.photons, estimator) {
            (Some(_), _) => CarriedFlux {
                bundles,
                photons: deposited - bundles,
                ..nothing
            },
            (None, Estimator::Splat) => CarriedFlux {
                splats: deposited,
                ..nothing
            },
            (None, _) => CarriedFlux {
                patches: deposited,
                ..nothing
            },
        }
    }

    /// Memory of its maps and paths [bytes].
    pub(super) fn bytes(&self) -> u64 {
        let halves = self.photons.iter().flat_map(|sums| &sums.halves);
        let all = std::iter::once(&self.maps)
            .chain(self.bands.iter().map(|band| &band.maps))
            .chain(halves.flat_map(BandMaps::sets));
        let maps = all.flat_map(ReceiverMaps::iter);
        let texels = maps.map(|(_, map)| map.chart.texel_count() as u64);
        texels.sum::<u64>() * size_of::<FluxCount>() as u64
            + self.traced.as_ref().map_or(0, TracedLight::bytes)
    }
}

impl LightState {
    /// Memory of all that is kept [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.rays.bytes()
            + self.levels.iter().map(LightLevel::bytes).sum::<u64>()
            + self.arrivals.as_ref().map_or(0, |(_, arrivals)| arrivals.bytes())
    }

    /// Forgets rays that start elsewhere or went otherwise, and what is more than so many bytes. From then on their ways
    /// are noted where the scene is moving.
    pub(super) fn begin(
        &mut self,
        light: &VisibleLight,
        (has_bumps, spectrum): (bool, Option<&SpectralKey>),
        kept_bytes: u64,
        moving: Option<&Scene>,
    ) {
        match &self.aim {
            Some(aim) if aim.launch == light.launch => {
                if !aim.aims_as(light) {
                    self.forget_maps();
                }
            }
            _ => *self = Self::default(),
        }
        self.aim = Some(light.clone());
        // Tracers of single wavelengths note nothing.
        let noted = moving.filter(|_| spectrum.is_none()).and_then(Scene::bounds);
        self.traversed.take_if(|_| noted.is_none());
        if self.rays.is_empty() && self.levels.is_empty() && self.traversed.is_none() {
            self.traversed = noted.map(|bounds| Arc::new(TraversedCells::within(bounds)));
        }
        let went_alike = self.has_bumps == has_bumps && self.spectrum.as_ref() == spectrum;
        (self.has_bumps, self.spectrum) = (has_bumps, spectrum.cloned());
        if self.rays.bytes() > kept_bytes || !went_alike {
            self.rays = RayCache::default();
        }
        self.arrivals
            .take_if(|(_, arrivals)| arrivals.bytes() > kept_bytes);
    }

    /// Whether no path can have come near what changed: objects and the boxes in which they are or were [m].
    pub(super) fn is_beyond(&self, changed: &[(usize, Bounds)], scene: &Scene) -> bool {
        self.aim
            .as_ref()
            .zip(self.traversed.as_ref())
            .is_some_and(|(aim, traversed)| {
                changed.iter().all(|&(object, bounds)| {
                    !traversed.meets(bounds) && !aim.is_aimed_at(object, bounds, scene)
                })
            })
    }

    /// Paths have changed: maps are to be made anew. Rays stay, as they know what holds of them.
    pub(super) fn forget_maps(&mut self) {
        self.levels.clear();
        self.arrivals = None;
    }

    /// Takes the level of a key out, if it is there.
    pub(super) fn take(&mut self, key: &LevelKey) -> Option<LightLevel> {
        let place = self.levels.iter().position(|level| level.key == *key)?;
        Some(self.levels.remove(place))
    }

    /// Takes the paths of a level out that differs in its maps alone.
    pub(super) fn take_traced(&mut self, key: &LevelKey) -> Option<TracedLight> {
        self.levels
            .iter_mut()
            .find(|level| level.key.trace == key.trace && level.traced.is_some())
            .and_then(|level| level.traced.take())
    }

    /// Keeps the levels of a bake for the next one; older ones only while that bake was stopped early, coarse ones only
    /// as memory allows.
    pub(super) fn keep(&mut self, levels: Vec<LightLevel>, memory_bytes: u64) {
        self.levels = levels;
        drop_coarse(&mut self.levels, LEVELS_TO_KEEP, memory_bytes / 2);
    }
}

/// Drops the first levels while all take more than so many bytes.
pub(super) fn drop_coarse(levels: &mut Vec<LightLevel>, least: usize, most_bytes: u64) {
    let mut bytes: u64 = levels.iter().map(LightLevel::bytes).sum();
    while bytes > most_bytes && levels.len() > least {
        bytes -= levels.remove(0).bytes();
    }
}
