//! Mean sizes of footprints per receiver: they set automatic map sizes, the fixed footprint and the adaptive sigma.

use std::collections::BTreeMap;

/// Flux-weighted sums over footprints, by object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FootprintStatistics {
    objects: BTreeMap<usize, Sums>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    flux: f64,
    log_area_m2: f64,
    log_area_share: f64,
}

/// Flux-weighted geometric means of one object's footprints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanFootprint {
    /// Area on the surface [m²].
    pub area_m2: f64,
    /// Share of the whole map that it covers.
    pub map_share: f64,
}

/// Footprints below this share of a map count as this size: a focus must not ask for texels without end.
const LEAST_SHARE: f64 = 1e-10;

impl FootprintStatistics {
    /// One more footprint, with the flux [W] it carries.
    pub fn add(&mut self, object: usize, flux_w: f64, area_m2: f64, map_share: f64) {
        let share = map_share.max(LEAST_SHARE);
        // Both areas are cut alike, as their ratio is the map's own.
        let area_m2 = if map_share > 0.0 {
            area_m2 * (share / map_share)
        } else {
            return;
        };
        let sums = self.objects.entry(object).or_default();
        sums.flux += flux_w;
        sums.log_area_m2 += flux_w * area_m2.ln();
        sums.log_area_share += flux_w * share.ln();
    }

    /// Adds the sums of another part of the run.
    pub fn merge(&mut self, other: &Self) {
        for (&object, part) in &other.objects {
            let sums = self.objects.entry(object).or_default();
            sums.flux += part.flux;
            sums.log_area_m2 += part.log_area_m2;
            sums.log_area_share += part.log_area_share;
        }
    }

    /// The mean footprint of an object; `None` where none was seen.
    pub fn mean(&self, object: usize) -> Option<MeanFootprint> {
        let sums = self.objects.get(&object).filter(|sums| sums.flux > 0.0)?;
        Some(MeanFootprint {
            area_m2: (sums.log_area_m2 / sums.flux).exp(),
            map_share: (sums.log_area_share / sums.flux).exp(),
        })
    }

    /// For a lattice with `ratio` times the cells: every footprint shrinks by as much.
    #[must_use]
    pub fn refined(mut self, ratio: f64) -> Self {
        for sums in self.objects.values_mut() {
            sums.log_area_m2 -= sums.flux * ratio.ln();
            sums.log_area_share -= sums.flux * ratio.ln();
        }
        self
    }
}
