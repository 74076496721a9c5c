//! Which lights are traced wavelength by wavelength: those whose light meets glass that parts it.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::Result;
use crate::light_pass::caustic::setup::Aim;
use crate::light_pass::ledger_sum::LedgerSum;
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::light_pass::wavefront::spectrum::{LightSpectrum, to_linear_srgb};
use crate::optics::spectrum::{Emission, Spectrum};
use crate::plan::{Effect, EffectPlan};
use crate::scene::{Light, LightKind};
use crate::transport::Tracer;

/// Room above a lamp's largest channel for what becomes of it in linear sRGB: the largest coefficient from XYZ.
const CHANNEL_MARGIN: f64 = 8.0;

/// Spectra of lights whose wavelengths go different ways, by light.
#[derive(Debug, Default)]
pub(super) struct Spectra {
    of_lights: BTreeMap<usize, (Arc<Spectrum>, LightSpectrum)>,
}

impl Spectra {
    /// For the lights of a scene.
    ///
    /// # Errors
    /// A light's colour has no spectrum.
    pub(super) fn new(tracer: &Tracer, aim: &Aim, plan: &EffectPlan) -> Result<Self> {
        let scene = tracer.scene();
        let mut of_lights = BTreeMap::new();
        if !plan.is_on(Effect::Dispersion) {
            return Ok(Self { of_lights });
        }
        for aimed in &aim.lights {
            let light = &scene.lights[aimed.light];
            let reached = &aim.sights[aimed.light].reached;
            let parts = |&(object, _): &(usize, Option<usize>)| scene.material_of(object).is_dispersive();
            // A sky has a colour in every direction.
            let has_one_colour = !matches!(light.kind, LightKind::Environment { .. });
            if has_one_colour && light.strength().max_channel() > 0.0 && reached.iter().any(parts) {
                let lamp = lamp_of(light).map_err(|error| error.at(format!("light `{}`", light.name)))?;
                let spectrum = LightSpectrum::new(tracer, &lamp);
                of_lights.insert(aimed.light, (lamp, spectrum));
            }
        }
        Ok(Self { of_lights })
    }

    /// How a light is traced; `None` where it has no wavelengths.
    pub(super) fn of(&self, light: usize) -> Option<&LightSpectrum> {
        self.of_lights.get(&light).map(|(_, spectrum)| spectrum)
    }

    /// Its lamp, of 1 luminous-equivalent watt.
    pub(super) fn lamp(&self, light: usize) -> Option<&Arc<Spectrum>> {
        self.of_lights.get(&light).map(|(lamp, _)| lamp)
    }

    /// Puts what was summed of a light's XYZ into linear sRGB; nothing of a light without wavelengths.
    pub(super) fn to_linear_srgb(&self, light: usize, maps: &mut ReceiverMaps, ledger: &mut LedgerSum) {
        if self.of(light).is_some() {
            maps.transform(to_linear_srgb);
            *ledger = ledger.transformed(to_linear_srgb);
        }
    }

    /// How many times its luminance a light may have in one channel.
    pub(super) fn most_of_a_channel(&self, light: usize) -> f64 {
        self.of(light)
            .map_or(1.0, |spectrum| spectrum.xyz.max_channel() * CHANNEL_MARGIN)
    }
}

/// A light's own spectrum, or a smooth one of its colour.
fn lamp_of(light: &Light) -> std::result::Result<Arc<Spectrum>, crate::optics::spectrum::SpectrumError> {
    match &light.spectrum {
        Some(spectrum) => Ok(Arc::clone(spectrum)),
        None => Ok(Arc::new(
            Emission::from_colour(light.colour)?
                .light
                .to_luminous_equivalent(1.0)?,
        )),
    }
}
