//! Which lights are traced by wavelength, and at which wavelengths: those that reach dispersive glass, or all with
//! `--keep-spectrum`.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::band_layers::LevelBand;
use crate::error::Result;
use crate::light_pass::ledger_sum::LedgerSum;
use crate::light_pass::photon::spectrum::PhotonSpectrum;
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::light_pass::spectral_node::{SpectralNode, channels_within, to_linear_srgb};
use crate::light_pass::visibility::LightVisibility;
use crate::optics::Nanometres;
use crate::optics::spectrum::{Emission, Spectrum, WavelengthSampler, illuminant, xyz_bar};
use crate::plan::{Effect, EffectPlan};
use crate::scene::{Light, LightKind};
use crate::settings::{BakeSettings, CONTINUOUS_BANDS, Estimator, SpectralSampling, Wavelengths};
use crate::transport::Tracer;

/// Margin over a lamp's largest channel for the conversion to linear sRGB: above the largest coefficient from XYZ.
const CHANNEL_MARGIN: f64 = 8.0;

/// Bands that photons sample if the whole spectrum is requested.
const PHOTON_BANDS: u32 = 256;

/// Everything that determines the wavelengths of a light's rays.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SpectralKey {
    lamp: Arc<Spectrum>,
    wavelengths: Wavelengths,
    sampling: SpectralSampling,
    estimator: Estimator,
}

/// A band of the spectrum that one traced wavelength stands for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpectralBand {
    /// Lower end [nm].
    pub from_nm: f64,
    /// Upper end [nm].
    pub to_nm: f64,
    /// Median of the eye's response within the band [nm], which names it.
    pub wavelength_nm: f64,
}

impl SpectralBand {
    fn range(&self) -> RangeInclusive<Nanometres> {
        Nanometres(self.from_nm)..=Nanometres(self.to_nm)
    }
}

/// Spectra of the lights that are traced by wavelength.
#[derive(Debug, Default)]
pub(super) struct Spectra {
    of_lights: BTreeMap<usize, SpectralLight>,
    /// Bands, the same for every light; empty if photons sample the whole spectrum.
    bands: Vec<SpectralBand>,
    /// Number of lattice rays that the wavelengths are distributed over; 1 if every ray is split into all of them.
    rays_per_split: f64,
    keeps_bands: bool,
}

/// One light that is traced by wavelength.
#[derive(Debug)]
struct SpectralLight {
    key: SpectralKey,
    /// One node for each band in which the lamp emits.
    bands: Vec<(usize, SpectralNode)>,
    /// `None` if photons cannot carry the light.
    photons: Option<PhotonSpectrum>,
}

impl Spectra {
    /// The spectra of a scene's lights.
    ///
    /// # Errors
    /// A light whose colour has no spectrum.
    pub(super) fn new(
        tracer: &Tracer,
        visibility: &LightVisibility,
        plan: &EffectPlan,
        settings: &BakeSettings,
    ) -> Result<Self> {
        // All lights share the same bands, so that their maps can be added band by band.
        let scene = tracer.scene();
        let mut spectra = Self {
            bands: bands(settings),
            keeps_bands: settings.keep_spectrum,
            ..Self::default()
        };
        spectra.rays_per_split = match settings.ray_sampling() {
            SpectralSampling::Split => 1.0,
            SpectralSampling::Stochastic => spectra.bands.len().max(1) as f64,
        };

        // Without dispersion, light is traced in RGB, unless the files are to hold its spectrum.
        if !plan.is_on(Effect::Dispersion) && !settings.keep_spectrum {
            return Ok(spectra);
        }

        // Only lights that reach dispersive glass pay for wavelengths, unless the files are to hold the whole spectrum.
        for visible_light in &visibility.lights {
            let light = &scene.lights[visible_light.light];
            let reached = &visibility.reaches[visible_light.light].reached;
            let parts = |&(object, _): &(usize, Option<usize>)| scene.material_of(object).is_dispersive();
            let is_parted = plan.is_on(Effect::Dispersion) && reached.iter().any(parts);
            if light.strength().max_channel() > 0.0 && (is_parted || settings.keep_spectrum) {
                let lamp = lamp_of(light).map_err(|error| error.at(format!("light `{}`", light.name)))?;
                let key = SpectralKey {
                    lamp,
                    wavelengths: settings.wavelengths,
                    sampling: settings.ray_sampling(),
                    estimator: settings.estimator,
                };

                // Splats trace each band on a lattice of its own. Photons and bundles draw from bands of their own,
                // finer if the whole spectrum is wanted.
                let bands = nodes(tracer, &key.lamp, &spectra.bands);
                let photons = matches!(settings.estimator, Estimator::Auto | Estimator::Photon).then(|| {
                    let sampled = nodes(tracer, &key.lamp, &photon_bands(settings));
                    PhotonSpectrum::new(
                        tracer.with_metals_under(&key.lamp),
                        sampled,
                        settings.keep_spectrum,
                    )
                });
                let light = SpectralLight { key, bands, photons };
                spectra.of_lights.insert(visible_light.light, light);
            }
        }
        Ok(spectra)
    }

    /// The bands of a light that splats trace on lattices of their own; a single part without a node for light in RGB.
    pub(super) fn parts(&self, light: usize) -> Vec<(Option<usize>, Option<&SpectralNode>)> {
        match self.of_lights.get(&light) {
            None => vec![(None, None)],
            Some(light) => {
                let bands = light.bands.iter();
                bands.map(|(band, node)| (Some(*band), Some(node))).collect()
            }
        }
    }

    /// Cells across and down of each part's lattice, given those of the light's lattice.
    pub(super) fn part_size(&self, light: usize, (columns, rows): (usize, usize)) -> (usize, usize) {
        if !self.has(light) {
            return (columns, rows);
        }
        let thinner = self.rays_per_split.sqrt();
        let side = |cells: usize| ((cells as f64 / thinner).round() as usize).max(1);
        (side(columns), side(rows))
    }

    /// The spectrum of a light for photons.
    pub(super) fn photons(&self, light: usize) -> Option<&PhotonSpectrum> {
        self.of_lights.get(&light)?.photons.as_ref()
    }

    /// Position of a band's rays in their cells, [0, 1)². Bands that share rays are spread evenly (M. Roberts' R₂
    /// sequence).
    pub(super) fn ray_place(&self, light: usize, band: Option<usize>) -> DVec2 {
        let middle = DVec2::splat(0.5);
        match band {
            Some(band) if self.rays_per_split > 1.0 && self.has(light) => {
                let steps = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);
                (middle + steps * band as f64).fract()
            }
            _ => middle,
        }
    }

    /// Whether a light is traced by wavelength.
    pub(super) fn has(&self, light: usize) -> bool {
        self.of_lights.contains_key(&light)
    }

    /// What determines the wavelengths of a light's rays.
    pub(super) fn key(&self, light: usize) -> Option<&SpectralKey> {
        self.of_lights.get(&light).map(|light| &light.key)
    }

    /// Number of bands whose maps are kept besides their sum.
    pub(super) fn kept_bands(&self) -> usize {
        if self.keeps_bands { self.bands.len() } else { 0 }
    }

    /// Radiant over luminous-equivalent power of a light; `None` if it is not traced by wavelength.
    pub(super) fn radiant(&self, light: usize) -> Option<f64> {
        let lamp = &self.of_lights.get(&light)?.key.lamp;
        Some(lamp.radiant() / lamp.xyz().y)
    }

    /// Maps of a light's bands with what they mean; empty if the light has no bands.
    pub(super) fn level_bands(&self, light: usize, maps: Vec<ReceiverMaps>) -> Vec<LevelBand> {
        let Some(SpectralLight {
            key, bands: nodes, ..
        }) = self.of_lights.get(&light)
        else {
            return Vec::new();
        };
        let with_maps = maps.into_iter().enumerate();
        let bands = with_maps.filter_map(|(index, maps)| {
            let (_, node) = nodes.iter().find(|(band, _)| *band == index)?;
            let white = node.channels.of_white().to_array();
            let channel = (0..3).max_by(|a, b| white[*a].total_cmp(&white[*b]))?;
            let band = self.bands[index].clone();
            let [radiant_w] = key.lamp.integral_times(band.range(), |_| [1.0]);
            Some(LevelBand {
                index,
                radiant: radiant_w / white[channel],
                band,
                maps: maps.packed(),
                channel,
            })
        });
        bands.collect()
    }

    /// Converts a light's sums from XYZ to linear sRGB, if it is traced by wavelength.
    pub(super) fn to_linear_srgb(&self, light: usize, maps: &mut ReceiverMaps, ledger: &mut LedgerSum) {
        if self.has(light) {
            maps.transform(to_linear_srgb);
            *ledger = ledger.transformed(to_linear_srgb);
        }
    }

    /// Upper limit of a light's largest channel relative to its luminance.
    pub(super) fn most_of_a_channel(&self, light: usize) -> f64 {
        self.of_lights.get(&light).map_or(1.0, |light| {
            let xyz = light.key.lamp.xyz();
            xyz.x.max(xyz.y).max(xyz.z) * CHANNEL_MARGIN
        })
    }
}

/// Nodes of a lamp, one for each band in which it emits.
fn nodes(tracer: &Tracer, lamp: &Spectrum, bands: &[SpectralBand]) -> Vec<(usize, SpectralNode)> {
    let lit = bands.iter().enumerate().filter_map(|(index, band)| {
        let wavelength = middle_of(lamp, band)?;
        let node = SpectralNode {
            tracer: tracer.at_wavelength(wavelength),
            wavelength,
            channels: channels_within(lamp, band.range(), |_| 1.0),
            number: index as u32,
        };
        Some((index, node))
    });
    lit.collect()
}

/// Bands of equal weight to the eye, or of the rainbow's colours; empty if wavelengths are interpolated.
fn bands(settings: &BakeSettings) -> Vec<SpectralBand> {
    match (settings.wavelengths, settings.estimator) {
        (Wavelengths::Continuous, estimator) if estimator.refines() => Vec::new(),
        (Wavelengths::Continuous, _) => some_bands(settings, CONTINUOUS_BANDS),
        _ => some_bands(settings, 0),
    }
}

/// Bands that photons sample.
fn photon_bands(settings: &BakeSettings) -> Vec<SpectralBand> {
    some_bands(settings, PHOTON_BANDS)
}

/// Bands as the settings say, or `continuous` of them for the whole spectrum.
fn some_bands(settings: &BakeSettings, continuous: u32) -> Vec<SpectralBand> {
    let sampler = WavelengthSampler::equal_energy();
    let bands = match settings.wavelengths {
        Wavelengths::Continuous => sampler.bands(continuous as usize),
        Wavelengths::Rainbow => sampler.rainbow_seven(),
        Wavelengths::Fixed(count) => sampler.bands(count as usize),
    };
    let bands = bands.into_iter().map(|band| SpectralBand {
        from_nm: band.range.start().0,
        to_nm: band.range.end().0,
        wavelength_nm: band.place.0,
    });
    bands.collect()
}

/// Mean wavelength of a lamp's light within a band, weighted by the eye's response; `None` if it has none there.
fn middle_of(lamp: &Spectrum, band: &SpectralBand) -> Option<Nanometres> {
    let [weighted, weights] = lamp.integral_times(band.range(), |wavelength| {
        let [x, y, z] = xyz_bar(wavelength);
        let weight = x + y + z;
        [weight * wavelength.0, weight]
    });
    (weights > 0.0).then(|| Nanometres(weighted / weights))
}

/// A light's own spectrum, or a smooth one for its colour. A sky gets a white one, which its colours by direction
/// scale.
fn lamp_of(light: &Light) -> Result<Arc<Spectrum>> {
    match (&light.spectrum, &light.kind) {
        (Some(spectrum), _) => Ok(Arc::clone(spectrum)),
        (None, LightKind::Environment { .. }) => Ok(Arc::new(illuminant("D65")?)),
        (None, _) => Ok(Arc::new(
            Emission::from_colour(light.colour)?
                .light
                .to_luminous_equivalent(1.0)?,
        )),
    }
}
