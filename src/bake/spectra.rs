//! Which lights are traced by wavelength, and at which wavelengths: those that reach dispersive glass, or all with
//! `--keep-spectrum`.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::band_layers::LevelBand;
use crate::error::Result;
use crate::light_pass::caustic::setup::{LightVisibility, VisibleLight};
use crate::light_pass::ledger_sum::LedgerSum;
use crate::light_pass::photon::spectrum::PhotonSpectrum;
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::light_pass::spectral_node::{SpectralNode, channels_within, to_linear_srgb};
use crate::light_pass::wavefront::spectrum::{LightPart, LightSpectrum};
use crate::optics::Nanometres;
use crate::optics::spectrum::{Emission, Spectrum, WavelengthSampler, illuminant, xyz_bar};
use crate::plan::{Effect, EffectPlan};
use crate::scene::{Light, LightKind};
use crate::settings::{BakeSettings, CONTINUOUS_BANDS, Estimator, SpectralSampling, Wavelengths};
use crate::transport::Tracer;

/// Room above a lamp's largest channel for what becomes of it in linear sRGB: the largest coefficient from XYZ.
const CHANNEL_MARGIN: f64 = 8.0;

/// Wavelengths that photons draw from where the whole spectrum is asked for.
const PHOTON_BANDS: u32 = 256;

/// All that chooses the wavelengths of a light's rays.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SpectralKey {
    lamp: Arc<Spectrum>,
    wavelengths: Wavelengths,
    sampling: SpectralSampling,
    estimator: Estimator,
}

/// Wavelengths that one traced wavelength stands for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpectralBand {
    /// From this wavelength on [nm].
    pub from_nm: f64,
    /// Up to this one [nm].
    pub to_nm: f64,
    /// The median of the eye's share of it [nm]: what the band is named by.
    pub wavelength_nm: f64,
}

impl SpectralBand {
    fn range(&self) -> RangeInclusive<Nanometres> {
        Nanometres(self.from_nm)..=Nanometres(self.to_nm)
    }
}

/// Spectra of lights that are traced by wavelength.
#[derive(Debug, Default)]
pub(super) struct Spectra {
    of_lights: BTreeMap<usize, SpectralLight>,
    /// Where so many wavelengths stand for all: the same for every light.
    bands: Vec<SpectralBand>,
    /// Rays of the lattice that share one ray's wavelengths out among them.
    rays_per_split: f64,
    keeps_bands: bool,
}

/// One light by wavelength.
#[derive(Debug)]
struct SpectralLight {
    key: SpectralKey,
    traced: Traced,
    /// Where photons may carry it.
    photons: Option<PhotonSpectrum>,
}

#[derive(Debug)]
enum Traced {
    Whole(Box<LightSpectrum>),
    /// By band, where the lamp has light.
    Bands(Vec<(usize, SpectralNode)>),
}

impl Spectra {
    /// For the lights of a scene.
    ///
    /// # Errors
    /// A light's colour has no spectrum.
    pub(super) fn new(
        tracer: &Tracer,
        aim: &LightVisibility,
        plan: &EffectPlan,
        settings: &BakeSettings,
    ) -> Result<Self> {
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
        if !plan.is_on(Effect::Dispersion) && !settings.keep_spectrum {
            return Ok(spectra);
        }
        for visible_light in &aim.lights {
            let light = &scene.lights[visible_light.light];
            let reached = &aim.sights[visible_light.light].reached;
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
                let traced = spectra.traced(tracer, &key.lamp);
                let photons = matches!(settings.estimator, Estimator::Auto | Estimator::Photon).then(|| {
                    let bands = nodes(tracer, &key.lamp, &photon_bands(settings));
                    PhotonSpectrum::new(tracer.with_metals_under(&key.lamp), bands, settings.keep_spectrum)
                });
                let light = SpectralLight { key, traced, photons };
                spectra.of_lights.insert(visible_light.light, light);
            }
        }
        Ok(spectra)
    }

    fn traced(&self, tracer: &Tracer, lamp: &Spectrum) -> Traced {
        if self.bands.is_empty() {
            return Traced::Whole(Box::new(LightSpectrum::new(tracer, lamp)));
        }
        Traced::Bands(nodes(tracer, lamp, &self.bands))
    }

    /// What is traced of a light, one lattice after the other, each with its band where there are any.
    pub(super) fn parts(&self, light: usize) -> Vec<(Option<usize>, LightPart<'_>)> {
        match self.of_lights.get(&light).map(|light| &light.traced) {
            None => vec![(None, LightPart::White)],
            Some(Traced::Whole(spectrum)) => vec![(None, LightPart::Spectrum(spectrum))],
            Some(Traced::Bands(bands)) => bands
                .iter()
                .map(|(band, node)| (Some(*band), LightPart::Band(node)))
                .collect(),
        }
    }

    /// Cells across and down of each band's lattice, where the light's lattice is of a size.
    pub(super) fn part_size(&self, light: usize, (columns, rows): (usize, usize)) -> (usize, usize) {
        match self.of_lights.get(&light).map(|light| &light.traced) {
            Some(Traced::Bands(_)) => {
                let thinner = self.rays_per_split.sqrt();
                let side = |cells: usize| ((cells as f64 / thinner).round() as usize).max(1);
                (side(columns), side(rows))
            }
            Some(Traced::Whole(_)) | None => (columns, rows),
        }
    }

    /// A light by wavelength for photons.
    pub(super) fn photons(&self, light: usize) -> Option<&PhotonSpectrum> {
        self.of_lights.get(&light)?.photons.as_ref()
    }

    /// Whether patches interpolate a light between a few of its wavelengths, with an error that is alike at every level.
    pub(super) fn is_interpolated(&self, light: usize) -> bool {
        let spectral = self.of_lights.get(&light);
        spectral.is_some_and(|light| matches!(light.traced, Traced::Whole(_)))
    }

    /// Where in its cell a ray of a band starts, [0, 1)²: bands that share rays out start between each other's, evenly
    /// (M. Roberts' R₂ sequence).
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

    /// What chose the wavelengths of a light's rays.
    pub(super) fn key(&self, light: usize) -> Option<&SpectralKey> {
        self.of_lights.get(&light).map(|light| &light.key)
    }

    /// How many bands' maps are kept beside their sum.
    pub(super) fn kept_bands(&self) -> usize {
        if self.keeps_bands { self.bands.len() } else { 0 }
    }

    /// Radiant watts of a light over its luminous-equivalent ones; `None` of light that is not traced by wavelength.
    pub(super) fn radiant(&self, light: usize) -> Option<f64> {
        let lamp = &self.of_lights.get(&light)?.key.lamp;
        Some(lamp.radiant() / lamp.xyz().y)
    }

    /// Maps of a light's bands with what they mean; none where the light has no bands.
    pub(super) fn level_bands(&self, light: usize, maps: Vec<ReceiverMaps>) -> Vec<LevelBand> {
        let Some(SpectralLight {
            key,
            traced: Traced::Bands(nodes),
            ..
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
                maps,
                channel,
            })
        });
        bands.collect()
    }

    /// Puts what was summed of a light's XYZ into linear sRGB; nothing of a light without wavelengths.
    pub(super) fn to_linear_srgb(&self, light: usize, maps: &mut ReceiverMaps, ledger: &mut LedgerSum) {
        if self.has(light) {
            maps.transform(to_linear_srgb);
            *ledger = ledger.transformed(to_linear_srgb);
        }
    }

    /// How many times its luminance a light may have in one channel.
    pub(super) fn most_of_a_channel(&self, light: usize) -> f64 {
        self.of_lights.get(&light).map_or(1.0, |light| {
            let xyz = light.key.lamp.xyz();
            xyz.x.max(xyz.y).max(xyz.z) * CHANNEL_MARGIN
        })
    }

    /// Whether a light's rays are not those of its lattice as it is.
    pub(super) fn has_bands(&self, light: &VisibleLight) -> bool {
        let light = self.of_lights.get(&light.light);
        light.is_some_and(|light| matches!(light.traced, Traced::Bands(_)))
    }
}

/// Wavelengths of a lamp, one for each band in which it has light.
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

/// Bands of equal importance to the eye, or of the rainbow's colours; none where wavelengths are interpolated.
fn bands(settings: &BakeSettings) -> Vec<SpectralBand> {
    match (settings.wavelengths, settings.estimator) {
        (Wavelengths::Continuous, estimator) if estimator.refines() => Vec::new(),
        (Wavelengths::Continuous, _) => some_bands(settings, CONTINUOUS_BANDS),
        _ => some_bands(settings, 0),
    }
}

/// Bands that photons draw theirs from.
fn photon_bands(settings: &BakeSettings) -> Vec<SpectralBand> {
    some_bands(settings, PHOTON_BANDS)
}

/// As the settings say, or so many where they name the whole spectrum.
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

/// Where the light of a lamp within a band lies on average, as the eye weighs it; `None` where it has none.
fn middle_of(lamp: &Spectrum, band: &SpectralBand) -> Option<Nanometres> {
    let [weighted, weights] = lamp.integral_times(band.range(), |wavelength| {
        let [x, y, z] = xyz_bar(wavelength);
        let weight = x + y + z;
        [weight * wavelength.0, weight]
    });
    (weights > 0.0).then(|| Nanometres(weighted / weights))
}

/// A light's own spectrum, or a smooth one of its colour. A sky has a colour in every direction: white, on which those
/// are factors.
fn lamp_of(light: &Light) -> std::result::Result<Arc<Spectrum>, crate::optics::spectrum::SpectrumError> {
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
