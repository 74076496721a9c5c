//! Maps of each band of the spectrum, for `--keep-spectrum`: the paper's n-band illumination map.

use rayon::prelude::*;

use super::finish::{Levels, MapAssembler};
use super::spectra::SpectralBand;
use crate::illumination::{IlluminationMap, Receiver};
use crate::light_pass::receiver_maps::ReceiverMaps;

/// Maps of one band of one light at one level.
#[derive(Clone, Debug)]
pub(super) struct LevelBand {
    /// Index among the bake's bands.
    pub(super) index: usize,
    pub(super) band: SpectralBand,
    /// Flux as X, Y and Z per texel.
    pub(super) maps: ReceiverMaps,
    /// The channel, X, Y or Z, in which the band is brightest.
    pub(super) channel: usize,
    /// Radiant watts per unit of that channel.
    pub(super) radiant: f64,
}

/// One band's share of the caustic layer of one map.
#[derive(Clone, Debug, PartialEq)]
pub struct BandLayer {
    /// Receiver of the map.
    pub receiver: Receiver,
    /// Range of wavelengths.
    pub band: SpectralBand,
    /// Mean spectral irradiance over the band, per texel [W/(m² nm), radiant].
    pub irradiance: Vec<f32>,
}

impl MapAssembler<'_> {
    /// Band layers of all maps, map by map, by rising wavelength; empty unless bands are kept.
    pub(super) fn band_layers(&self, maps: &[IlluminationMap], levels: &Levels) -> Vec<BandLayer> {
        let mut bands: Vec<(usize, &SpectralBand)> = levels
            .iter()
            .flat_map(|(_, level)| &level.bands)
            .map(|band| (band.index, &band.band))
            .collect();
        bands.sort_by_key(|(index, _)| *index);
        bands.dedup_by_key(|(index, _)| *index);
        let of_map = |map: &IlluminationMap| -> Vec<BandLayer> {
            let of_band = |(index, band): &(usize, &SpectralBand)| BandLayer {
                receiver: map.chart.receiver,
                band: (*band).clone(),
                irradiance: self.band_of_map(map, *index, levels),
            };
            bands.iter().map(of_band).collect()
        };
        maps.iter().flat_map(of_map).collect()
    }

    fn band_of_map(&self, map: &IlluminationMap, index: usize, levels: &Levels) -> Vec<f32> {
        let chart = &map.chart;
        let mut sums = vec![0.0; chart.texel_count()];
        for (light, level) in levels.iter() {
            let band = level.bands.iter().find(|band| band.index == index);
            let Some((band, lit)) = band.and_then(|band| Some((band, band.maps.get(chart.receiver)?))) else {
                continue;
            };
            let mut flux = lit.flux().into_owned();
            self.smooth(chart, level, &mut flux);
            let strength = level.strength(&self.scene.lights[*light]).luminance();
            let width_nm = band.band.to_nm - band.band.from_nm;
            let scale = strength * level.unit.watts() * band.radiant / width_nm;
            let texels = sums.par_iter_mut().zip(flux.texels());
            texels.for_each(|(sum, counts)| *sum += counts[band.channel] as f64 * scale);
        }
        let sums = sums.into_iter().enumerate();
        sums.map(|(texel, flux)| chart.per_area(texel, flux) as f32)
            .collect()
    }
}
