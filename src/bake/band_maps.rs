//! Maps of one light during a bake: one set for all of it, or one for each band of its spectrum.

use std::borrow::Cow;

use crate::light_pass::receiver_maps::ReceiverMaps;

/// One set of maps, or one for each band that is kept.
#[derive(Clone, Debug)]
pub(super) struct BandMaps(Vec<ReceiverMaps>);

impl BandMaps {
    /// No light yet; `kept_bands`: how many bands have maps of their own.
    pub(super) fn new(objects: usize, kept_bands: usize) -> Self {
        Self(vec![ReceiverMaps::new(objects); kept_bands.max(1)])
    }

    /// Where light of a band goes.
    pub(super) fn of(&mut self, band: Option<usize>) -> &mut ReceiverMaps {
        let only = self.0.len() == 1;
        &mut self.0[band.filter(|_| !only).unwrap_or(0)]
    }

    /// All sets.
    pub(super) fn sets(&self) -> &[ReceiverMaps] {
        &self.0
    }

    /// The same, to be added to.
    pub(super) fn sets_mut(&mut self) -> &mut [ReceiverMaps] {
        &mut self.0
    }

    /// Adds other light.
    pub(super) fn add(&mut self, other: &Self) {
        for (sum, part) in self.0.iter_mut().zip(&other.0) {
            sum.add(part);
        }
    }

    /// The sum of all.
    pub(super) fn sum(&self) -> Cow<'_, ReceiverMaps> {
        let mut sum = Cow::Borrowed(&self.0[0]);
        for band in &self.0[1..] {
            sum.to_mut().add(band);
        }
        sum
    }

    /// Maps of bands, where they are kept.
    pub(super) fn bands(&self) -> &[ReceiverMaps] {
        if self.0.len() == 1 { &[] } else { &self.0 }
    }

    /// The sum of all, and the bands where they are kept.
    pub(super) fn into_sum(mut self) -> (ReceiverMaps, Vec<ReceiverMaps>) {
        if self.0.len() == 1 {
            return (self.0.remove(0), Vec::new());
        }
        (self.sum().into_owned(), self.0)
    }
}
