//! The sequence of lattices and map sizes that a bake runs through.

use std::sync::Arc;

use glam::DVec2;

use super::caustic::{BakeContext, CausticLayer, ESTIMATED_LEVELS, LightProgress};
use super::light_level::{LevelKey, PhotonAim, StatisticsKey, TraceKey};
use super::splat_level::LEVEL_STRIDES;
use crate::error::{Error, Result};
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::light_pass::path::PathLimits;
use crate::light_pass::splat::lattice::Lattice;
use crate::light_pass::visibility::VisibleLight;
use crate::light_pass::wavefront::refine::Round;
use crate::settings::{BakeSettings, Estimator, Footprint, Kernel, MapResolution, Sigma};
use crate::transport::EffectSet;

/// Upper limit of the density of the coarsest lattice [rays/sr]; it gives the first picture.
const FIRST_PICTURE_PER_SR: f64 = 1_600.0;

/// Cells of the lattice that refinement starts from, times the target.
const CELLS_FOR_AN_ERROR: f64 = 30.0;

/// Smaller targets start with no more cells than this one.
const STARTING_TARGET: f64 = 0.005;

/// Minimum number of cells to start with.
const MIN_CELLS: f64 = 500.0;

/// Maximum factor by which a small caster makes the lattice denser.
const MAX_DENSER: f64 = 64.0;

/// Density at which cells are counted [rays/sr], high enough that rounding of the sides does not matter.
const UNIT_DENSITY_PER_SR: f64 = 1e5;

/// Minimum side of the lattice that mean footprints are taken from [cells].
const MIN_STATISTICS_SIDE: usize = 32;

/// Maximum coarseness of the deposits of coarse lattices, relative to the last lattice.
const MAX_COARSE: f64 = 16.0;

/// Relative RMSE whose triangles are as coarse as those of a bake without a target.
const USUAL_ERROR: f64 = 0.012;

impl CausticLayer<'_> {
    /// Cells across and down each face, from the coarsest lattice to that of the settings. Splats vary the stride
    /// instead.
    pub(super) fn lattices(&self, light: &VisibleLight) -> Vec<(usize, usize)> {
        let finest = self.lattice_size(light);
        if self.settings.estimator == Estimator::Splat {
            return vec![finest; LEVEL_STRIDES.len()];
        }
        let mut lattices = vec![finest];
        let mut density_per_sr = self.density_per_sr(light);
        while lattices.len() < ESTIMATED_LEVELS || density_per_sr >= FIRST_PICTURE_PER_SR {
            let (columns, rows) = lattices[lattices.len() - 1];
            lattices.push((columns.div_ceil(2), rows.div_ceil(2)));
            density_per_sr /= 4.0;
        }
        lattices.reverse();
        lattices
    }

    fn lattice_size(&self, light: &VisibleLight) -> (usize, usize) {
        light
            .launch
            .lattice_size(self.density_per_sr(light), light.reach_m)
    }

    /// Density of a light's lattice [rays/sr]: as set or, with a target, high enough for a small caster to get its
    /// share of cells.
    fn density_per_sr(&self, light: &VisibleLight) -> f64 {
        let set = self.settings.density_per_sr;
        let Some(target) = self.settings.max_error else {
            return set;
        };
        let wanted = (CELLS_FOR_AN_ERROR / target.max(STARTING_TARGET)).max(MIN_CELLS);
        // Cells on casters are proportional to density; suns scale it by their reach.
        let (columns, rows) = light.launch.lattice_size(UNIT_DENSITY_PER_SR, light.reach_m);
        let whole = (columns * rows * light.launch.face_count()) as f64;
        let share = light.visible().marked_share(&light.launch);
        set.max(UNIT_DENSITY_PER_SR * wanted / (whole * share))
            .min(set * MAX_DENSER)
    }

    /// Everything that a level depends on.
    pub(super) fn key(
        &self,
        light: &LightProgress,
        photons: Option<PhotonAim>,
        context: &BakeContext,
    ) -> LevelKey {
        let lattices = self.lattices(light.visible);
        // Photons are not refined.
        let (step, rounds, goal, is_underrated) = match photons {
            Some(_) => (0, &[][..], None, false),
            None => (
                light.levels.len(),
                &light.rounds[..],
                light.goal,
                light.is_underrated,
            ),
        };
        let size = lattices[step.min(lattices.len() - 1)];
        // Coarse lattices are deposited just as coarsely, so that their difference shows both kinds of error.
        let before_last = (lattices.len() - 1).saturating_sub(step);
        LevelKey {
            trace: TraceKey {
                is_negligible: !is_underrated && self.is_negligible(light.visible),
                ..self.trace_key(light.visible, size, before_last as i32, rounds)
            },
            photons,
            sizes: context.sizes.clone(),
            coarseness: coarseness(self.settings.max_error, goal)
                * (before_last as f64).exp2().min(MAX_COARSE),
            kernels: self.kernels(),
            stride: match self.settings.estimator {
                estimator if estimator.refines() => 1,
                _ => LEVEL_STRIDES[step.min(LEVEL_STRIDES.len() - 1)],
            },
        }
    }

    /// Key of the paths on a lattice of a size, which is `coarser` lattices before the usual finest.
    pub(super) fn trace_key(
        &self,
        light: &VisibleLight,
        size: (usize, usize),
        coarser: i32,
        rounds: &[Round],
    ) -> TraceKey {
        let settings = self.settings;
        let mut paths = BakeSettings {
            estimator: settings.estimator,
            max_depth: settings.max_depth,
            branch_threshold: Some(settings.path_threshold()),
            item_buffer: settings.item_buffer,
            ..BakeSettings::default()
        };
        if settings.estimator != Estimator::Wavefront {
            (paths.rays, paths.seed) = (settings.rays, settings.seed);
        }
        TraceKey {
            settings: paths,
            effects: EffectSet::of(self.plan),
            splits: self.splits(),
            size,
            coarser: if settings.estimator.refines() && self.has_bumps() {
                coarser
            } else {
                0
            },
            rounds: rounds.to_vec(),
            spectrum: self.spectra.key(light.light).cloned(),
            is_negligible: false,
        }
    }

    /// Whether any object has normals with more detail than its mesh.
    fn has_bumps(&self) -> bool {
        (0..self.tracer.scene().objects.len()).any(|object| self.tracer.finest_bump_m(object).is_finite())
    }

    fn kernels(&self) -> BakeSettings {
        let settings = self.settings;
        let usual = BakeSettings::default();
        match settings.estimator {
            estimator if estimator.refines() => usual,
            _ => BakeSettings {
                sigma: settings.sigma,
                kernel: settings.kernel,
                kernel_sampling: settings.kernel_sampling,
                footprint: settings.footprint,
                ..usual
            },
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

    /// Limits of a wavefront's paths.
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
        if self.wants_statistics() {
            let paths = lights.iter().map(|light| {
                let size = self.lattice_size(light.visible);
                (light.visible.light, self.trace_key(light.visible, size, 0, &[]))
            });
            let key = (paths.collect(), self.map_density_per_sr());
            if known.as_ref().is_none_or(|(known, _)| *known != key) {
                let mut statistics = FootprintStatistics::default();
                for light in lights {
                    let unit = self.unit(light.visible)?;
                    statistics.add_light(&self.noting(light, |layer, light| {
                        match self.settings.estimator.refines() {
                            true => layer.bundle_statistics(light, unit, context),
                            false => layer.splat_statistics(light, unit, context),
                        }
                    }));
                }
                // A cancelled run has seen only a part.
                let complete = !context.control.is_cancelled();
                *known = complete.then(|| (key, Arc::new(statistics)));
            }
        }
        context.statistics = known.as_ref().map(|(_, statistics)| Arc::clone(statistics));
        let statistics = context.statistics.as_deref();
        (context.sizes, context.outcome.warnings) = self.map_sizes(statistics);
        context.spare_bytes = self.spare_bytes(&context.sizes, statistics);
        Ok(())
    }

    /// The lattice that mean footprints are taken from: one of the light's lattices.
    pub(super) fn statistics_size(&self, light: &VisibleLight) -> (usize, usize) {
        let lattices = self.lattices(light);
        let coarse = lattices.len().saturating_sub(ESTIMATED_LEVELS);
        let fine_enough = |size: &&(usize, usize)| size.0.max(size.1) >= MIN_STATISTICS_SIDE;
        let last = lattices[lattices.len() - 1];
        lattices[coarse..]
            .iter()
            .find(fine_enough)
            .copied()
            .unwrap_or(last)
    }
}

/// Coarseness of triangles for a target or, in a round of refinement, for its goal.
fn coarseness(target: Option<f64>, goal: Option<f64>) -> f64 {
    match (target, goal) {
        (None, _) => 1.0,
        (Some(target), None) => (target / USUAL_ERROR).clamp(1.0, 8.0),
        (Some(_), Some(goal)) => (goal / USUAL_ERROR).clamp(0.1, 8.0),
    }
}
