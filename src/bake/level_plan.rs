//! What levels depend on, and the sizes of maps.

use std::sync::Arc;

use glam::DVec2;

use super::caustic::{BakeContext, CausticLayer, LightProgress};
use super::light_level::{LevelKey, PhotonAim, StatisticsKey, TraceKey};
use super::splat_level::LEVEL_STRIDES;
use crate::error::{Error, Result};
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::light_pass::path::PathLimits;
use crate::light_pass::splat::lattice::Lattice;
use crate::light_pass::visibility::VisibleLight;
use crate::settings::{BakeSettings, Estimator, Footprint, Kernel, MapResolution, Sigma};
use crate::transport::EffectSet;

impl CausticLayer<'_> {
    /// Cells across and down each face of the lattice of splats.
    fn lattice_size(&self, light: &VisibleLight) -> (usize, usize) {
        light
            .launch
            .lattice_size(self.settings.density_per_sr, light.reach_m)
    }

    /// Everything that a level depends on.
    pub(super) fn key(
        &self,
        light: &LightProgress,
        photons: Option<PhotonAim>,
        context: &BakeContext,
    ) -> LevelKey {
        LevelKey {
            trace: TraceKey {
                is_negligible: !light.is_underrated && self.is_negligible(light.visible),
                ..self.trace_key(light.visible)
            },
            sizes: context.sizes.clone(),
            kernels: self.kernels(),
            stride: match &photons {
                Some(_) => 1,
                None => LEVEL_STRIDES[light.levels.len().min(LEVEL_STRIDES.len() - 1)],
            },
            photons,
        }
    }

    /// Key of the paths of a light.
    pub(super) fn trace_key(&self, light: &VisibleLight) -> TraceKey {
        let settings = self.settings;
        TraceKey {
            settings: BakeSettings {
                estimator: settings.estimator,
                max_depth: settings.max_depth,
                branch_threshold: Some(settings.path_threshold()),
                item_buffer: settings.item_buffer,
                rays: settings.rays,
                seed: settings.seed,
                ..BakeSettings::default()
            },
            effects: EffectSet::of(self.plan),
            lattice: (!settings.estimator.refines()).then(|| self.lattice_size(light)),
            spectrum: self.spectra.key(light.light).cloned(),
            is_negligible: false,
        }
    }

    /// Settings of kernels; those that do not matter to the estimator are at their defaults.
    fn kernels(&self) -> BakeSettings {
        let settings = self.settings;
        let usual = BakeSettings::default();
        if settings.estimator.refines() {
            return usual;
        }
        BakeSettings {
            sigma: settings.sigma,
            kernel: settings.kernel,
            kernel_sampling: settings.kernel_sampling,
            footprint: settings.footprint,
            ..usual
        }
    }

    /// Unit of a light's sums, derived from its own launch so that other lights do not change its bits.
    pub(super) fn unit(&self, light: &VisibleLight) -> Result<FluxUnit> {
        self.unit_for(light, light.launch.power_bound_w(), 1.0)
    }

    /// Unit for `sums` sums of a light, each of up to `power_w` [W per channel] at unit strength.
    ///
    /// # Errors
    /// A power that is not finite or not positive.
    pub(super) fn unit_for(&self, light: &VisibleLight, power_w: f64, sums: f64) -> Result<FluxUnit> {
        let source = &self.tracer.scene().lights[light.light];
        let real_w = power_w * source.strength().max_channel();
        if power_w.is_finite() && power_w > 0.0 && real_w.is_finite() {
            let bound_w = power_w * self.spectra.most_of_a_channel(light.light);
            return Ok(FluxUnit::for_power(bound_w * sums));
        }
        Err(Error::failure(
            &self.tracer.scene().source,
            format!("light `{}` sends {real_w:e} W", source.name),
            "give it an intensity that makes that a finite number",
        ))
    }

    /// The lattice of rays for splats.
    pub(super) fn lattice<'a>(&'a self, light: &'a VisibleLight, unit: FluxUnit) -> Lattice<'a> {
        Lattice {
            tracer: self.tracer,
            band: None,
            launch: &light.launch,
            item_buffer: &light.item_buffer,
            size: self.lattice_size(light),
            strides: (1, 1),
            placement: self.settings.rays,
            centre: DVec2::splat(0.5),
            seed: self.settings.seed,
            limits: self.limits(),
            unit,
        }
    }

    /// Limits of the paths of splats.
    pub(super) fn limits(&self) -> PathLimits {
        PathLimits {
            max_depth: self.settings.depth(),
            branch_threshold: self.settings.path_threshold(),
            effects: EffectSet::of(self.plan),
            microfacets: None,
        }
    }

    /// Whether mean footprints are needed.
    fn wants_statistics(&self) -> bool {
        let settings = self.settings;
        let adaptive = settings.kernel == Kernel::Gaussian && settings.sigma == Sigma::Adaptive;
        let of_splats = adaptive || settings.footprint == Footprint::Fixed;
        settings.map_resolution == MapResolution::Auto
            || !self.fits_anyway()
            || (settings.estimator == Estimator::Splat && of_splats)
    }

    /// Finds the sizes of all maps. Measures mean footprints at the settings' density on a thinner lattice, if needed.
    pub(super) fn find_sizes(
        &self,
        known: &mut Option<(StatisticsKey, Arc<FootprintStatistics>)>,
        lights: &mut [LightProgress],
        context: &mut BakeContext,
    ) -> Result<()> {
        // A thin lattice tells which maps are lit, and how finely. It is traced anew only if paths or the density of
        // maps changed.
        if self.wants_statistics() {
            let paths = lights
                .iter()
                .map(|light| (light.visible.light, self.trace_key(light.visible)));
            let key = (paths.collect(), self.map_density_per_sr());
            if known.as_ref().is_none_or(|(known, _)| *known != key) {
                let mut statistics = FootprintStatistics::default();
                for light in lights {
                    let unit = self.unit(light.visible)?;
                    statistics.add_light(&self.noting(light, |layer, light| {
                        match self.settings.estimator.refines() {
                            true => layer.bundle_statistics(light.visible, unit, context),
                            false => layer.splat_statistics(light, unit, context),
                        }
                    }));
                }
                // A cancelled run has seen only a part.
                let complete = !context.control.is_cancelled();
                *known = complete.then(|| (key, Arc::new(statistics)));
            }
        }

        // The first goal, the sizes and the memory that they leave follow from it.
        context.statistics = known.as_ref().map(|(_, statistics)| Arc::clone(statistics));
        let statistics = context.statistics.as_deref();
        context.first_goal = self.first_goal(statistics);
        (context.sizes, context.outcome.warnings) = self.map_sizes(statistics);
        context.spare_bytes = self.spare_bytes(&context.sizes, statistics);
        Ok(())
    }
}
