//! One level of one light by bundles and residual photons: finer squares than the level before, and photons drawn anew,
//! as many as those before tell.

use std::time::Instant;

use glam::DVec2;

use super::band_maps::BandMaps;
use super::caustic::{BakeContext, CausticLayer, LightProgress};
use super::light_level::{KeptSquares, LevelKey, LightLevel, LightState, PhotonAim, PhotonSums};
use super::photon_level::{Layers, PART_OF_TIME, PlannedNoise, squared_noise};
use crate::error::Result;
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::accuracy;
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::light_pass::photon::domain::FIRST_LEVEL;
use crate::light_pass::photon::footprints::FootprintPass;
use crate::light_pass::photon::launch::PhotonLaunch;
use crate::light_pass::photon::pass::HALVES;
use crate::light_pass::photon::residual::{LightSquares, ResidualMaps, ResidualPass, ResidualReport, TIMES};
use crate::light_pass::photon::subcell_features::SubcellFeatures;
use crate::light_pass::photon::walk::PhotonRules;
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::visibility::VisibleLight;
use crate::settings::{ErrorMetric, Estimator};
use crate::transport::EffectSet;

/// Relative RMSE up to which automatic maps are as fine as in a preview.
const USUAL_MAP_ERROR: f64 = 0.03;

/// Texels for the light of a cell of the lattice that maps are made for: in a preview of the built-in scenes, 0.5 to 2
/// mm each, as fine as their caustics are seen to be.
const TEXELS_PER_CELL: f64 = 64.0;

/// Goal of the first level, which gives the first picture.
const FIRST_GOAL: f64 = 0.2;

/// Root mean square of E relative to its mean up to which that goal is one for the visible error, too. Beyond, it asks
/// for far more: it is relative to the mean.
const USUAL_CONCENTRATION: f64 = 5.0;

/// A level aims a little below what is asked: a near miss costs another level, and of levels that differ by chance, one
/// ends the bake that looks better than it is, by up to a sixth where light is uneven.
const AIM: f64 = 0.85;

/// Minimum and maximum of a goal relative to the one before.
const STEPS: (f64, f64) = (0.08, 0.8);

/// Goals differ by at least so many parts of an octave.
const GOALS_PER_OCTAVE: f64 = 8.0;

/// A goal so much larger than the target tells little about it.
const FAR: f64 = 2.5;

/// An error so much larger than its goal comes from light that the plan did not know, and knows now.
const SURPRISE: f64 = 2.0;

/// A light whose error is still unknown at this goal is given up.
const LEAST_WITHOUT_ERROR: f64 = 0.05;

/// A light of which less than this fraction arrives is not followed any further.
const LEAST_ARRIVING: f64 = 1e-5;

/// What became of a level of bundles.
pub(super) enum BundleLevel {
    Made(Box<LightLevel>),
    Stopped,
    /// Bundles can carry next to nothing of the light.
    LeftToPhotons,
}

/// What squares and their photons carried.
struct Carried {
    report: ResidualReport,
    bundles: ReceiverMaps,
    halves: Vec<BandMaps>,
}

impl CausticLayer<'_> {
    /// Whether bundles may carry the light: it starts from a point, a direction, or a lamp that faces one way, and is
    /// of so many wavelengths that a parabola goes through them.
    pub(super) fn has_bundles(&self, light: &VisibleLight) -> bool {
        let spectrum = self.spectra.photons(light.light);
        self.settings.estimator != Estimator::Photon
            && spectrum.is_some_and(|spectrum| spectrum.tracers().is_some()) == self.spectra.has(light.light)
            && (!self.has_places(light) || self.with_launch(light, |launch| launch.has_offsets()))
    }

    /// Footprints at the density that maps are made for. Rough surfaces count as smooth ones, a lamp as its centre.
    pub(super) fn bundle_statistics(
        &self,
        light: &VisibleLight,
        unit: FluxUnit,
        context: &mut BakeContext,
    ) -> FootprintStatistics {
        // Footprints are shares of their maps, so that charts of the smallest size do.
        let chart_for: &ChartFor = &|receiver: Receiver| {
            self.sizes
                .chart(receiver, self.sizes.doubled_size(receiver.object(), 0)?)
        };

        // Texels are sized by the cells of a lattice: each cell should light about `TEXELS_PER_CELL` of them.
        let density_per_sr = self.map_density_per_sr();
        let (columns, rows) = light.launch.lattice_size(density_per_sr, light.reach_m);
        let cells = columns as f64 * rows as f64;
        // The lattice has whole cells: it is made for a smaller distance than asked for if these are few.
        let reach_m = || (density_per_sr * light.launch.cell_measure(DVec2::ZERO, DVec2::ONE) / cells).sqrt();

        // Dispersion and lobes only blur the light, so that RGB rays and smooth surfaces show its finest detail.
        let pass = FootprintPass {
            launch: &PhotonLaunch::of_cells(light),
            rules: PhotonRules {
                spectrum: None,
                effects: EffectSet {
                    lobes: false,
                    ..EffectSet::of(self.plan)
                },
                ..self.rules(light, unit)
            },
            chart_for,
            blur_rad: if self.has_places(light) {
                light.width_rad(self.tracer.scene())
            } else {
                0.0
            },
            cells: TEXELS_PER_CELL * cells,
            reach_m: (light.launch.is_fitted() && self.settings.max_error.is_some()).then(reach_m),
        };
        let report = pass.run(context.control);
        context.outcome.count(&report, context.clock);
        report.statistics
    }

    /// Density that automatic maps are made for [rays/sr]. With a target it does not depend on the lattice, and texels
    /// are as long as the error allows.
    pub(super) fn map_density_per_sr(&self) -> f64 {
        match self.settings.max_error {
            Some(target) => {
                let coarser = (target / USUAL_MAP_ERROR).max(1.0);
                Estimator::Auto.preview_density_per_sr() / (coarser * coarser)
            }
            None => self.settings.density_per_sr,
        }
    }

    /// Goal of the level after `last`, towards a relative RMSE; `None` if nothing is left to do.
    pub(super) fn next_goal(&self, last: Option<&LightLevel>, target: f64) -> Option<f64> {
        // The first level gives the first picture and stays coarse, however strict the target is.
        let Some(last) = last else {
            return Some(FIRST_GOAL.max(AIM * target));
        };

        // Halves that show no error may not have met the light yet: the next level looks far more closely.
        let before = last.goal;
        let error = last.error.as_ref().map(|error| error.relative_rmse);
        let Some(error) = error.filter(|error| error.is_finite() && *error > 0.0) else {
            return (before > LEAST_WITHOUT_ERROR).then_some(STEPS.0 * before);
        };

        // The error of next to nothing is not worth any rays.
        let energy = last.energy();
        if energy.deposited < LEAST_ARRIVING * energy.emitted {
            return None;
        }

        // Finer squares do not recover truncated light.
        let truncated = accuracy::truncated_share(&energy);
        let [noise2, wanted2] = squared_noise(error, truncated, target);

        // The filter may leave less noise than planned. More noise than planned is in the plan by now, unless the
        // target is near. How much of it the filter will leave is not: if it helps, the next level goes half of the
        // way.
        let scaled = AIM * before * (wanted2 / noise2).sqrt();
        let next = if error.max(last.found) > SURPRISE * before {
            let helps = error < last.found;
            AIM * if helps {
                (target * last.found).sqrt().max(target)
            } else {
                target
            }
        } else if before > FAR * target {
            scaled.max(AIM * target).clamp(STEPS.0 * before, STEPS.1 * before)
        } else {
            scaled.clamp(STEPS.0 * before, STEPS.1 * before)
        };

        // Rounded, so that what changes other lights a little leaves the goals of this one as they were.
        let rounded = ((GOALS_PER_OCTAVE * next.log2()).round() / GOALS_PER_OCTAVE).exp2();
        (noise2 > wanted2).then_some(rounded)
    }

    /// Minimum goal of first levels: [`FIRST_GOAL`]; towards a visible error relative to the root mean square of the
    /// light rather than to its mean where little of the scene is lit.
    pub(super) fn first_goal(&self, statistics: Option<&FootprintStatistics>) -> f64 {
        let statistics = statistics.filter(|_| self.settings.error_metric == ErrorMetric::Visible);
        let concentration = statistics.map_or(1.0, |statistics| statistics.concentration());
        FIRST_GOAL * (concentration / USUAL_CONCENTRATION).max(1.0)
    }

    /// The level of a light with a goal.
    ///
    /// # Errors
    /// A power that is not finite.
    pub(super) fn next_bundles(
        &self,
        light: &mut LightProgress,
        last: Option<&LightLevel>,
        mut goals: Vec<f64>,
        context: &mut BakeContext,
    ) -> Result<BundleLevel> {
        let before = last.map(|last| last.goal).filter(|goal| *goal > 0.0);
        if let Some(goal) = goals.last_mut() {
            if last.is_none() {
                *goal = goal.max(context.first_goal);
            }
            *goal = in_time(*goal, before, &light.state, context);
        }
        let key = self.key(light, Some(PhotonAim::Goals(goals.clone())), context);
        if let Some(level) = light.state.take(&key) {
            return Ok(BundleLevel::Made(Box::new(level)));
        }
        let began = Instant::now();
        let made = self.make_bundles(light, key, &goals, context)?;
        let is_made = matches!(made, BundleLevel::Made(_));
        light.state.goal_s = is_made.then(|| began.elapsed().as_secs_f64());
        Ok(made)
    }

    fn make_bundles(
        &self,
        light: &mut LightProgress,
        key: LevelKey,
        goals: &[f64],
        context: &mut BakeContext,
    ) -> Result<BundleLevel> {
        let unit = self.photon_unit(light.visible)?;

        // Squares of earlier levels are refined further if they stand for the same paths, maps and goals.
        let is_of_before = |kept: &KeptSquares| {
            let is_like_these = kept.trace == key.trace && kept.sizes == key.sizes;
            is_like_these && kept.goals.len() < goals.len() && goals.starts_with(&kept.goals)
        };
        let kept = light.state.squares.take().filter(is_of_before);
        let mut kept = kept.unwrap_or_else(|| KeptSquares {
            trace: key.trace.clone(),
            sizes: key.sizes.clone(),
            goals: Vec::new(),
            squares: LightSquares::default(),
        });

        // A level depends on nothing but the goals so far: where the squares of those before it are gone, or were
        // refined otherwise by another bake, they are made anew.
        let mut last = None;
        for &goal in &goals[kept.goals.len()..] {
            kept.goals.push(goal);
            let carried = self.carry(light.visible, (&key, unit), goal, &mut kept.squares, context);
            if carried.report.pass.cancelled {
                return Ok(BundleLevel::Stopped);
            }
            last = Some(carried);
        }

        // The squares are kept for the next level as far as memory allows.
        light.state.squares = Some(kept);
        light.state.fit_squares(self.squares_bytes(context));

        // Where bundles carry too little of the light, as where rough surfaces scatter nearly all of it, photons take
        // it over.
        let Some(Carried {
            report,
            bundles,
            halves,
        }) = last.filter(|last| !last.report.is_left_to_photons)
        else {
            return Ok(BundleLevel::LeftToPhotons);
        };

        // Bundles stay apart from photons, which alone are noisy and filtered. Dispersed ones are in the halves
        // already: each half samples their wavelengths anew.
        let photons = PhotonSums {
            ledger: report.pass.ledger,
            halves,
        };
        let layers = Layers {
            bundles: (!self.spectra.has(light.visible.light)).then_some(&bundles),
            photons: &photons,
            photon_square: report.photon_square,
            planned: Some(PlannedNoise {
                square: report.goal * report.goal,
                rays: report.pass.rays as f64,
            }),
            bundle_square: report.deposit_square,
        };

        // Flux was counted `TIMES` times in each half.
        let unit = unit.per(u64::from(TIMES) * HALVES as u64);
        let level = context.clock.time(
            |clock| &mut clock.deposit,
            || self.level_of_layers(light.visible, (key, unit), layers),
        );
        Ok(BundleLevel::Made(Box::new(LightLevel {
            segments: report.pass.segments,
            goal: report.goal,
            found: report.photon_square.sqrt(),
            ..level
        })))
    }

    /// Refines the squares for a goal, and carries the light by them.
    fn carry(
        &self,
        light: &VisibleLight,
        (key, unit): (&LevelKey, FluxUnit),
        goal: f64,
        squares: &mut LightSquares,
        context: &mut BakeContext,
    ) -> Carried {
        // Photons go to two halves, whose difference is the noise. What bundles deposit belongs to either.
        let chart_for = |receiver: Receiver| self.chart(receiver, &key.sizes);
        let mut bundles = self.no_maps();
        let mut halves = vec![self.part_maps(), self.part_maps()];
        let listener = self.listener(context, 0);
        let [first, second] = &mut halves[..] else {
            unreachable!("there are two halves");
        };
        let mut maps = ResidualMaps {
            bundles: &mut bundles,
            halves: [first.sets_mut(), second.sets_mut()],
        };

        // The points of the first squares would miss bodies and openings between them, so these are sought first, where
        // all rays start from one point or in one direction.
        let is_of_faces = !self.has_places(light);
        let sought = (squares.is_empty() && is_of_faces).then(|| {
            let square = DVec2::splat((-f64::from(FIRST_LEVEL)).exp2());
            SubcellFeatures::find(self.tracer, &light.launch, light.visible(), square)
        });

        // Refine the squares, deposit their bundles, and send photons for the residual.
        let report = self.with_launch(light, |launch| {
            let pass = ResidualPass {
                launch,
                rules: self.rules(light, unit),
                chart_for: &chart_for,
                sought: sought.as_ref(),
                is_rough: self.rough_object(light).is_some(),
            };
            pass.run(goal, squares, &mut maps, &listener)
        });
        context.outcome.count(&report.pass, context.clock);
        Carried {
            report,
            bundles,
            halves,
        }
    }
}

/// Limits a goal to what the remaining time allows, because an interrupted level is lost: time grows with the inverse
/// square of the goal. The first level is not limited.
fn in_time(goal: f64, before: Option<f64>, state: &LightState, context: &BakeContext) -> f64 {
    let (Some(before), Some(left_s), Some(took_s)) = (before, context.control.time_left_s(), state.goal_s)
    else {
        return goal;
    };
    let own_s = PART_OF_TIME * left_s / context.open_lights as f64;
    goal.max((before * (took_s / own_s.max(f64::MIN_POSITIVE)).sqrt()).min(STEPS.1 * before))
}
