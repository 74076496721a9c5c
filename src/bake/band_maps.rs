//! Maps of one light during a bake: one set for all of it, or one for each band of its spectrum.

use std::borrow::Cow;

use crate::light_pass::receiver_maps::ReceiverMaps;

/// One set of maps, or one per kept band.
#[derive(Clone, Debug)]
pub(super) struct BandMaps(Vec<ReceiverMaps>);

impl BandMaps {
    /// Empty maps; `kept_bands` bands have maps of their own.
    pub(super) fn new(objects: usize, kept_bands: usize) -> Self {
        Self(vec![ReceiverMaps::new(objects); kept_bands.max(1)])
    }

    /// The maps that light of a band is deposited on.
    pub(super) fn of(&mut self, band: Option<usize>) -> &mut ReceiverMaps {
        let only = self.0.len() == 1;
        &mut self.0[band.filter(|_| !only).unwrap_or(0)]
    }

    pub(super) fn sets(&self) -> &[ReceiverMaps] {
        &self.0
    }

    pub(super) fn sets_mut(&mut self) -> &mut [ReceiverMaps] {
        &mut self.0
    }

    pub(super) fn add(&mut self, other: &Self) {
        for (sum, part) in self.0.iter_mut().zip(&other.0) {
            sum.add(part);
        }
    }

    pub(super) fn sum(&self) -> Cow<'_, ReceiverMaps> {
        let mut sum = Cow::Borrowed(&self.0[0]);
        for band in &self.0[1..] {
            sum.to_mut().add(band);
        }
        sum
    }

    /// Maps per band; empty unless bands are kept.
    pub(super) fn bands(&self) -> &[ReceiverMaps] {
        if self.0.len() == 1 { &[] } else { &self.0 }
    }

    /// The sum over all bands, and the maps per band if they are kept.
    pub(super) fn into_sum(mut self) -> (ReceiverMaps, Vec<ReceiverMaps>) {
        if self.0.len() == 1 {
            return (self.0.remove(0), Vec::new());
        }
        (self.sum().into_owned(), self.0)
    }
}
