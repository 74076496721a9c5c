//! Mean footprint sizes of each receiver: they set automatic map sizes, the fixed footprint and the adaptive sigma.

use crate::illumination::Receiver;
use std::collections::BTreeMap;

use glam::DVec2;

/// Flux-weighted sums over footprints by receiver, and optionally their positions on the maps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FootprintStatistics {
    receivers: BTreeMap<Receiver, Sums>,
    /// Number of lights that reach a receiver.
    lights: BTreeMap<Receiver, u64>,
    spots: Vec<FootprintSample>,
}

/// Light on a part of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootprintSample {
    pub receiver: Receiver,
    /// Minimum and maximum map coordinates that it reaches; both within the map.
    pub bounds: (DVec2, DVec2),
    /// [W].
    pub flux_w: f64,
    /// Share of the whole map that one of its details covers, > 0: a footprint, or less.
    pub map_share: f64,
}

impl FootprintSample {
    /// Share of the map that it lights, as a triangle: half of its bounds.
    fn lit_share(&self) -> f64 {
        (0.5 * (self.bounds.1 - self.bounds.0).element_product()).max(self.map_share)
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    flux: f64,
    log_area_m2: f64,
    log_area_share: f64,
}

/// Flux-weighted geometric means of one receiver's footprints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanFootprint {
    /// Area on the surface [m²].
    pub area_m2: f64,
    /// Share of the whole map that it covers.
    pub map_share: f64,
    /// Flux of all footprints [W].
    pub flux_w: f64,
}

/// How detailed the light of one receiver is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightDetail {
    /// Flux-weighted geometric mean of the share of the whole map that a detail covers.
    pub map_share: f64,
    /// Share of the map that the light would cover if all of it were as bright as its flux-weighted geometric mean.
    pub lit_share: f64,
}

/// Footprints below this share of a map are clamped to it: a focus must not demand unlimited texels.
const MIN_SHARE: f64 = 1e-10;

impl FootprintStatistics {
    /// Adds a footprint with its flux [W].
    pub fn add(&mut self, receiver: Receiver, flux_w: f64, area_m2: f64, map_share: f64) {
        let share = map_share.max(MIN_SHARE);
        // Both areas are clamped alike, as their ratio is the map's own.
        let area_m2 = if map_share > 0.0 {
            area_m2 * (share / map_share)
        } else {
            return;
        };
        let sums = self.receivers.entry(receiver).or_default();
        sums.flux += flux_w;
        sums.log_area_m2 += flux_w * area_m2.ln();
        sums.log_area_share += flux_w * share.ln();
    }

    /// Records the position of light. Ignores light that covers nothing or lies off the map.
    pub fn add_spot(&mut self, spot: FootprintSample) {
        let (low, high) = spot.bounds;
        let bounds = (
            low.clamp(DVec2::ZERO, DVec2::ONE),
            high.clamp(DVec2::ZERO, DVec2::ONE),
        );
        let is_on_map = low.cmple(DVec2::ONE).all() && high.cmpge(DVec2::ZERO).all();
        if is_on_map && spot.flux_w > 0.0 && spot.map_share > 0.0 {
            self.spots.push(FootprintSample {
                bounds,
                map_share: spot.map_share.max(MIN_SHARE),
                ..spot
            });
        }
    }

    /// Samples on the map of a receiver.
    pub fn spots(&self, receiver: Receiver) -> impl Iterator<Item = &FootprintSample> {
        self.spots.iter().filter(move |spot| spot.receiver == receiver)
    }

    /// Adds the sums of another part of the run.
    pub fn merge(&mut self, other: &Self) {
        self.spots.extend_from_slice(&other.spots);
        for (&receiver, part) in &other.receivers {
            let sums = self.receivers.entry(receiver).or_default();
            sums.flux += part.flux;
            sums.log_area_m2 += part.log_area_m2;
            sums.log_area_share += part.log_area_share;
        }
    }

    /// Adds all of one light.
    pub fn add_light(&mut self, light: &Self) {
        for &receiver in light.receivers.keys() {
            *self.lights.entry(receiver).or_default() += 1;
        }
        self.merge(light);
    }

    /// Number of lights that reach a receiver, by receiver.
    pub fn lights(&self) -> &BTreeMap<Receiver, u64> {
        &self.lights
    }

    /// The mean footprint on a receiver; `None` without one.
    pub fn mean(&self, receiver: Receiver) -> Option<MeanFootprint> {
        let sums = self.receivers.get(&receiver).filter(|sums| sums.flux > 0.0)?;
        Some(MeanFootprint {
            area_m2: (sums.log_area_m2 / sums.flux).exp(),
            map_share: (sums.log_area_share / sums.flux).exp(),
            flux_w: sums.flux,
        })
    }

    /// Root mean square of E over all receivers that are lit, relative to its mean: large where bright light lies in wide
    /// and nearly dark surroundings.
    pub fn concentration(&self) -> f64 {
        let (mut flux_w, mut area_m2, mut square) = (0.0, 0.0, 0.0);
        for &receiver in self.receivers.keys() {
            let Some(mean) = self.mean(receiver) else {
                continue;
            };
            let receiver_m2 = mean.area_m2 / mean.map_share;
            area_m2 += receiver_m2;
            for spot in self.spots(receiver) {
                flux_w += spot.flux_w;
                square += spot.flux_w * (spot.flux_w / (spot.lit_share() * receiver_m2));
            }
        }
        if flux_w > 0.0 {
            (area_m2 * square).sqrt() / flux_w
        } else {
            1.0
        }
    }

    /// The details of the light on a receiver; `None` if nothing is known of them.
    pub fn detail(&self, receiver: Receiver) -> Option<LightDetail> {
        let (mut flux, mut log_share, mut log_brightness) = (0.0, 0.0, 0.0);
        for spot in self.spots(receiver) {
            flux += spot.flux_w;
            log_share += spot.flux_w * spot.map_share.ln();
            log_brightness += spot.flux_w * (spot.flux_w / spot.lit_share()).ln();
        }
        (flux > 0.0).then(|| LightDetail {
            map_share: (log_share / flux).exp(),
            lit_share: (flux / (log_brightness / flux).exp()).min(1.0),
        })
    }

    /// For a lattice with `ratio` times the cells: every footprint shrinks by this factor.
    #[must_use]
    pub fn refined(mut self, ratio: f64) -> Self {
        for sums in self.receivers.values_mut() {
            sums.log_area_m2 -= sums.flux * ratio.ln();
            sums.log_area_share -= sums.flux * ratio.ln();
        }
        for spot in &mut self.spots {
            spot.map_share = (spot.map_share / ratio).max(MIN_SHARE);
        }
        self
    }
}
