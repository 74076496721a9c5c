//! What a baker caches for one light: squares or arrivals, and the maps of the last bake's levels.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::band_layers::LevelBand;
use super::band_maps::BandMaps;
use super::map_size::Sizes;
use super::spectra::SpectralKey;
use crate::geometry::enclosure::Bounds;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::accuracy::{LightError, Noise};
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::light_pass::ledger::{CarriedFlux, EnergyLedger};
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::photon::residual::LightSquares;
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::light_pass::splat::arrival_cache::ArrivalCache;
use crate::light_pass::visibility::VisibleLight;
use crate::optics::LinearSrgb;
use crate::scene::{Light, Scene};
use crate::settings::BakeSettings;
use crate::transport::{EffectSet, TraversedCells};

/// Everything that a light's paths depend on besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TraceKey {
    /// Those that do not matter to paths are at their defaults.
    pub(super) settings: BakeSettings,
    /// Effects that are on.
    pub(super) effects: EffectSet,
    /// Cells across and down each face of the lattice of splats.
    pub(super) lattice: Option<(usize, usize)>,
    /// What its wavelengths depend on, if it is traced by wavelength.
    pub(super) spectrum: Option<SpectralKey>,
    /// Whether the light is treated as hardly visible beside the others.
    pub(super) is_negligible: bool,
}

/// Everything that mean footprints depend on: the paths of each light, and the density that maps are made for
/// [rays/sr].
pub(super) type StatisticsKey = (BTreeMap<usize, TraceKey>, f64);

/// Everything that a light's maps depend on besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LevelKey {
    pub(super) trace: TraceKey,
    /// Sizes of the maps.
    pub(super) sizes: Sizes,
    /// Kernels of splats; settings that do not matter to them are at their defaults.
    pub(super) kernels: BakeSettings,
    /// Only every `stride`-th ray across and down is traced (splats).
    pub(super) stride: usize,
    /// What photons aim at; `None` for other carriers.
    pub(super) photons: Option<PhotonAim>,
}

/// What a level of photons aims at.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum PhotonAim {
    /// So many photons in each half, and no bundles.
    Count(u32),
    /// Relative RMSEs, by bundles and residual photons: that of the level, after those of the levels before it, on
    /// whose squares it builds.
    Goals(Vec<f64>),
}

impl PhotonAim {
    /// Photons in each half, if that is the aim.
    pub(super) fn count(&self) -> Option<u32> {
        match self {
            Self::Count(photons) => Some(*photons),
            Self::Goals(_) => None,
        }
    }
}

/// Maps of one light at one level, as of a white light of unit strength.
#[derive(Debug)]
pub(super) struct LightLevel {
    pub(super) key: LevelKey,
    /// Flux per texel.
    pub(super) maps: ReceiverMaps,
    /// The same per band of the spectrum, in X, Y and Z; empty unless bands are kept.
    pub(super) bands: Vec<LevelBand>,
    /// Radiant over luminous-equivalent power of the light, if it has a spectrum.
    pub(super) radiant: Option<f64>,
    pub(super) unit: FluxUnit,
    /// Distance from the casters to the farthest receiver [m].
    pub(super) reach_m: f64,
    /// Energy of all paths.
    pub(super) ledger: LedgerSum,
    /// Squared difference between the half sets of splats, by receiver.
    pub(super) noise: Option<Noise>,
    /// Relative RMSE that bundles and residual photons aimed at; 0 for other carriers.
    pub(super) goal: f64,
    /// Relative error that the flux of its photons tells; 0 without a goal.
    pub(super) found: f64,
    /// `None` for splats of a thinned lattice, or if no light arrived.
    pub(super) error: Option<LightError>,
    /// Sums that the next level adds to; only the last level of a light by photons has them.
    pub(super) photons: Option<PhotonSums>,
    /// Closest-hit queries of its photons if nothing were cached.
    pub(super) segments: u64,
    /// Whether the maps include the light's colour.
    pub(super) has_own_colour: bool,
}

/// Sums over all photons so far, not yet divided by their number.
#[derive(Clone, Debug)]
pub(super) struct PhotonSums {
    pub(super) ledger: LedgerSum,
    /// Maps of both halves, in the channels that the light is traced in.
    pub(super) halves: Vec<BandMaps>,
}

impl PhotonSums {
    pub(super) fn add(&mut self, other: &Self) {
        self.ledger.merge(&other.ledger);
        for (half, more) in self.halves.iter_mut().zip(&other.halves) {
            half.add(more);
        }
    }
}

/// What is kept of all lights of a scene between bakes.
#[derive(Debug, Default)]
pub(super) struct LightStates {
    by_light: BTreeMap<usize, LightState>,
    /// Mean footprints that set the sizes of maps, and what they depend on.
    pub(super) statistics: Option<(StatisticsKey, Arc<FootprintStatistics>)>,
}

impl LightStates {
    pub(super) fn is_empty(&self) -> bool {
        self.by_light.is_empty()
    }

    /// Removes and returns the state of a light, by its index in the scene.
    pub(super) fn take(&mut self, light: usize) -> LightState {
        self.by_light.remove(&light).unwrap_or_default()
    }

    pub(super) fn put(&mut self, light: usize, state: LightState) {
        self.by_light.insert(light, state);
    }

    pub(super) fn finest(&self, light: usize) -> Option<&LightLevel> {
        self.by_light.get(&light)?.levels.last()
    }

    /// Drops a light that changed.
    pub(super) fn forget(&mut self, light: usize) {
        self.by_light.remove(&light);
        self.statistics = None;
    }

    /// Memory of everything that is kept [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.by_light.values().map(LightState::bytes).sum()
    }

    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut LightState> {
        self.by_light.values_mut()
    }
}

/// Squares of a light's launch domain, and what they depend on.
#[derive(Debug)]
pub(super) struct KeptSquares {
    pub(super) trace: TraceKey,
    pub(super) sizes: Sizes,
    /// Goals that they were refined for, one after the other.
    pub(super) goals: Vec<f64>,
    pub(super) squares: LightSquares,
}

/// Wall-clock times of a level of photons.
#[derive(Clone, Copy, Debug)]
pub(super) struct PhotonTime {
    /// Per photon of each half [s].
    pub(super) photon_s: f64,
    /// Of filtering and measuring the maps, however many photons there are [s].
    pub(super) maps_s: f64,
}

/// What is kept of one light between bakes.
#[derive(Debug, Default)]
pub(super) struct LightState {
    /// Where its rays start, and what they are aimed at.
    visible: Option<VisibleLight>,
    /// Where they went, of all that is kept.
    pub(super) traversed: Option<Arc<TraversedCells>>,
    /// Levels of the last bake, from coarse to fine.
    pub(super) levels: Vec<LightLevel>,
    /// What the last level of photons took.
    pub(super) photon_time: Option<PhotonTime>,
    pub(super) squares: Option<KeptSquares>,
    /// Wall-clock time of the last level with a goal [s].
    pub(super) goal_s: Option<f64>,
    /// Arrivals that splats were made of.
    pub(super) arrivals: Option<(TraceKey, ArrivalCache)>,
}

impl LightLevel {
    /// Factor of its maps per channel.
    pub(super) fn strength(&self, light: &Light) -> LinearSrgb {
        if self.has_own_colour {
            LinearSrgb::grey(light.strength().luminance())
        } else {
            light.strength()
        }
    }

    /// Energy of all paths at unit strength [W].
    pub(super) fn energy(&self) -> EnergyLedger {
        self.ledger.report("", self.unit, LinearSrgb::WHITE).energy_w
    }

    /// Radiant flux on all maps [W]; `None` unless bands are kept.
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

    /// Deposited flux by carrier [W].
    pub(super) fn carried_w(&self, deposited: f64, light: &Light) -> CarriedFlux {
        let bundles = self
            .ledger
            .watts(Account::Bundled, self.unit, self.strength(light));
        let nothing = CarriedFlux::default();
        match &self.key.photons {
            Some(_) => CarriedFlux {
                bundles,
                photons: deposited - bundles,
                ..nothing
            },
            None => CarriedFlux {
                splats: deposited,
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
        let error = self.error.iter().flat_map(|error| error.maps.values());
        all.map(ReceiverMaps::bytes).sum::<u64>() + error.map(|map| 4 * map.len() as u64).sum::<u64>()
    }
}

impl LightState {
    /// Memory of everything that is kept [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.levels.iter().map(LightLevel::bytes).sum::<u64>()
            + self.arrivals.as_ref().map_or(0, |(_, arrivals)| arrivals.bytes())
            + self.squares.as_ref().map_or(0, |kept| kept.squares.bytes())
    }

    /// Forgets rays that start elsewhere or went otherwise, and what is more than so many bytes. From then on their
    /// ways are noted where the scene is moving.
    pub(super) fn begin(
        &mut self,
        light: &VisibleLight,
        is_by_wavelength: bool,
        kept_bytes: u64,
        moving: Option<&Scene>,
    ) {
        match &self.visible {
            Some(visible) if visible.launch == light.launch => {
                if !visible.aims_as(light) {
                    self.forget_maps();
                }
            }
            _ => *self = Self::default(),
        }
        self.visible = Some(light.clone());
        // Tracers of single wavelengths note nothing.
        let noted = moving.filter(|_| !is_by_wavelength).and_then(Scene::bounds);
        self.traversed.take_if(|_| noted.is_none());
        if self.levels.is_empty() && self.traversed.is_none() {
            self.traversed = noted.map(|bounds| Arc::new(TraversedCells::within(bounds)));
        }
        self.arrivals
            .take_if(|(_, arrivals)| arrivals.bytes() > kept_bytes);
    }

    /// Whether no path can have come near what changed: objects and the boxes in which they are or were [m].
    pub(super) fn is_beyond(&self, changed: &[(usize, Bounds)], scene: &Scene) -> bool {
        let (Some(visible), Some(traversed)) = (&self.visible, &self.traversed) else {
            return false;
        };
        changed
            .iter()
            .all(|&(object, bounds)| !traversed.meets(bounds) && !visible.is_aimed_at(object, bounds, scene))
    }

    /// Drops maps whose paths changed.
    pub(super) fn forget_maps(&mut self) {
        self.levels.clear();
        self.squares = None;
        self.arrivals = None;
    }

    /// Drops squares that take more than so many bytes. They are made anew when needed.
    pub(super) fn fit_squares(&mut self, most_bytes: u64) {
        self.squares.take_if(|kept| kept.squares.bytes() > most_bytes);
    }

    /// Removes and returns the level with a key, if there is one.
    pub(super) fn take(&mut self, key: &LevelKey) -> Option<LightLevel> {
        let place = self.levels.iter().position(|level| level.key == *key)?;
        Some(self.levels.remove(place))
    }

    /// Keeps the levels of a bake for the next one.
    pub(super) fn keep(&mut self, levels: Vec<LightLevel>, spare_bytes: u64) {
        self.levels = levels;
        drop_coarse(&mut self.levels, 1, spare_bytes);
    }
}

/// Drops the coarsest levels while all but the last `least` take more than `spare_bytes`.
pub(super) fn drop_coarse(levels: &mut Vec<LightLevel>, least: usize, spare_bytes: u64) {
    let coarse = levels.len().saturating_sub(least);
    let mut bytes: u64 = levels[..coarse].iter().map(LightLevel::bytes).sum();
    let is_dropped = |level: &LightLevel| {
        let is_over = bytes > spare_bytes;
        bytes -= level.bytes();
        is_over
    };
    let dropped = levels[..coarse]
        .iter()
        .map(is_dropped)
        .take_while(|is_over| *is_over);
    let dropped = dropped.count();
    levels.drain(..dropped);
}
