//! Chooses the carrier of each light: patches of its wavefront, or photons.
//!
//! Area lights and light on rough surfaces always need photons. For any other light, `auto` first traces a few photons,
//! which tell what the target would cost with photons, and refines patches while they cost less. Costs are counts of
//! operations, so that the choice does not depend on the machine.

use super::caustic::{BakeContext, CausticLayer, LightProgress};
use super::light_level::{LightLevel, LightState};
use super::map_size::Sizes;
use super::photon_level::GROWTH;
use crate::error::{Error, Result};
use crate::light_pass::caustic::setup::VisibleLight;
use crate::light_pass::photon::pass::HALVES;
use crate::plan::Effect;
use crate::settings::Estimator;

/// Time of a cell of patches over that of a photon's segment, where a photon has but one; it grows with the cube of their
/// number, as the branches do that patches follow. Measured on the built-in scenes.
const CELL_COST: f64 = 2.0;

/// Cost of a receiver query, including the deposit of its triangle, relative to a photon segment.
const RECEIVER_QUERY: f64 = 0.4;

/// Cost of a level of patches relative to the level before it.
const LEVEL_GROWTH: f64 = 4.0;

/// Segments per photon above which light branches too much for patches.
const MAX_PATHS: f64 = 4.0;

/// Patches have to promise the target at this fraction of the photons' cost: their forecasts tend to be too low, and
/// their work is lost if the carrier changes.
const PATCH_COST_FRACTION: f64 = 0.5;

/// Relative RMSE of the photons that audit patches which interpolate between wavelengths. On the map of a prism, with
/// some sixty lit texels, it reveals a bias of 10 %.
const AUDIT_RMSE: f64 = 0.15;

/// Most segments of the photons that audit patches, relative to the cost of the patches.
const MAX_AUDIT_COST: f64 = 4.0;

/// Range of the power of 1/error with which work grows.
const POWERS: (f64, f64) = (1.0, 2.5);

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Carrier {
    /// Patches, or photons once they are known to be cheaper.
    Undecided,
    /// Patches of the wavefront.
    #[default]
    Patches,
    Photons,
    /// Kernel splats of the paper.
    Splats,
}

impl LightProgress {
    /// Continues from the first photons; the last level of patches becomes the rival.
    pub(super) fn turn_to_photons(&mut self) {
        self.carrier = Carrier::Photons;
        self.rounds.clear();
        let patches = self.levels.pop();
        self.levels = self.rival.take().into_iter().collect();
        self.rival = patches;
    }
}

impl CausticLayer<'_> {
    /// Whether the light is sampled as an area light.
    pub(super) fn has_places(&self, light: &VisibleLight) -> bool {
        self.plan.is_on(Effect::AreaLights) && self.tracer.scene().lights[light.light].has_extent()
    }

    /// The first rough or spatially varying object that the light reaches; `None` if roughness is off.
    pub(super) fn rough_object(&self, light: &VisibleLight) -> Option<usize> {
        let scene = self.tracer.scene();
        let reached = self.aim.sights[light.light].reached.iter();
        let mut objects = reached.map(|&(object, _)| object);
        let rough = objects.find(|&object| scene.material_of(object).is_rough());
        rough.filter(|_| self.plan.is_on(Effect::Roughness))
    }

    /// Whether only photons can carry the light.
    pub(super) fn is_soft(&self, light: &VisibleLight) -> bool {
        self.has_places(light) || self.rough_object(light).is_some()
    }

    /// # Errors
    /// A light with an extent or on rough surfaces, with an estimator that supports neither.
    pub(super) fn refuse_soft_light(&self, lights: &[&VisibleLight]) -> Result<()> {
        let estimator = self.settings.estimator;
        if matches!(estimator, Estimator::Auto | Estimator::Photon) {
            return Ok(());
        }
        let scene = self.tracer.scene();
        for light in lights {
            let source = &scene.lights[light.light];
            let (cause, effect) = if self.has_places(light) {
                (String::from("has a size"), Effect::AreaLights)
            } else if let Some(object) = self.rough_object(light) {
                let name = &scene.objects[object].name;
                (
                    format!("shines on `{name}`, which is rough or changes from place to place"),
                    Effect::Roughness,
                )
            } else {
                continue;
            };
            return Err(Error::failure(
                &scene.source,
                format!(
                    "light `{}` {cause}, which the {} estimator cannot follow",
                    source.name,
                    <&str>::from(estimator)
                ),
                format!(
                    "use --estimator auto or photon, or leave the effect out with --effects {}=off",
                    effect.name()
                ),
            ));
        }
        Ok(())
    }

    /// The carrier that a light starts with.
    pub(super) fn carrier(&self, light: &VisibleLight) -> Carrier {
        match self.settings.estimator {
            Estimator::Photon => Carrier::Photons,
            Estimator::Auto if self.settings.max_error.is_none() || self.is_soft(light) => Carrier::Photons,
            Estimator::Auto => Carrier::Undecided,
            Estimator::Wavefront => Carrier::Patches,
            Estimator::Splat => Carrier::Splats,
        }
    }

    /// Chooses the carrier of an undecided light: traces the photons that tell their cost, more of them while they are
    /// cheaper than the first level of patches, then judges whether another level of patches pays off. True if photons
    /// were traced.
    pub(super) fn decide_carrier(
        &self,
        light: &VisibleLight,
        sizes: &Sizes,
        state: &mut LightState,
        light_progress: &mut LightProgress,
        course: &mut BakeContext,
    ) -> Result<bool> {
        let Some(target) = self.settings.max_error else {
            return Ok(false);
        };
        let is_first = light_progress.rival.is_none();
        let lacks_auditors = self.lacks_auditors(light, light_progress);
        if is_first || self.are_photons_sooner(light, light_progress) || lacks_auditors {
            let aim = if lacks_auditors {
                Some(AUDIT_RMSE)
            } else {
                light_progress.aim
            };
            let before = (light_progress.rival.as_mut(), aim);
            let made = self.more_photons(light, sizes, state, before, course)?;
            let is_made = made.is_some();
            light_progress.rival = made.or(light_progress.rival.take());
            if lacks_auditors && is_made {
                eprintln!(
                    "AUDITORS {:?} rmse {:?}",
                    light_progress.rival.as_ref().and_then(|r| r.key.photons),
                    light_progress
                        .rival
                        .as_ref()
                        .and_then(|r| r.error.as_ref().map(|e| e.estimate.relative_rmse))
                );
                if let Some(level) = light_progress.levels.pop() {
                    self.judge(light, level, state, light_progress, course)?;
                }
            }
            if is_made || !is_first {
                return Ok(is_made);
            }
        }
        let Some((segments, per_photon)) = light_progress.rival.as_ref().and_then(photon_segments) else {
            // Nothing arrived: patches find paths that are too rare for a few photons.
            light_progress.carrier = Carrier::Patches;
            return Ok(false);
        };
        let most_share = light_progress.most_share.unwrap_or(target);
        let by_photons = match light_progress.shares.first() {
            Some((0, share)) => segments * (share / most_share).powi(2).max(1.0),
            _ => f64::INFINITY,
        };
        let cost = |level: &LightLevel| cost(level, per_photon);
        let so_far = cost_of(&light_progress.levels, per_photon);
        let next = light_progress.levels.last().map_or(0.0, cost) * LEVEL_GROWTH;
        let promised = promised(light_progress, cost, most_share).unwrap_or(0.0);
        let goes_many_ways = light_progress.levels.is_empty() && per_photon > MAX_PATHS;
        let is_late = are_photons_in_time(light_progress, state, course);
        let is_biased = is_biased(light_progress)
            && light_progress
                .shares
                .last()
                .is_some_and(|(_, share)| *share > most_share);
        if goes_many_ways
            || is_late
            || is_biased
            || so_far + next > by_photons
            || promised > PATCH_COST_FRACTION * by_photons
        {
            light_progress.turn_to_photons();
        }
        // The number of queries is not known before cells are subdivided, so it is capped.
        course.most_queries = ((by_photons - so_far) / RECEIVER_QUERY) as u64;
        Ok(false)
    }

    /// Whether patches may have a bias that the first photons are too few to detect, and more photons cost less than
    /// the patches did.
    pub(super) fn lacks_auditors(&self, light: &VisibleLight, light_progress: &LightProgress) -> bool {
        let Some(rival) = light_progress
            .rival
            .as_ref()
            .filter(|_| self.spectra.is_interpolated(light.light))
        else {
            return false;
        };
        let rmse = rival.error.as_ref().map(|error| error.estimate.relative_rmse);
        let known = photon_segments(rival).zip(rmse.filter(|rmse| *rmse > AUDIT_RMSE));
        let known = known.filter(|_| self.next_photons(light, Some(rival), Some(AUDIT_RMSE)).is_some());
        known.is_some_and(|((segments, per_photon), rmse)| {
            let growth = (rmse / AUDIT_RMSE).powi(2).clamp(GROWTH.0, GROWTH.1);
            growth * segments < MAX_AUDIT_COST * cost_of(&light_progress.levels, per_photon)
        })
    }

    /// Whether another level of photons costs less than the first level of patches.
    fn are_photons_sooner(&self, light: &VisibleLight, light_progress: &LightProgress) -> bool {
        let known = light_progress.rival.as_ref().and_then(photon_segments);
        let (Some((segments, per_photon)), true) = (known, light_progress.levels.is_empty()) else {
            return false;
        };
        let cells: f64 = self
            .spectra
            .parts(light.light)
            .iter()
            .map(|(_, part)| {
                let size = self.spectra.part_size(light.light, self.lattices(light)[0]);
                let cells = light.item_buffer.lattice_cells(light.launch.face_count(), size);
                cells as f64 * part.node_count() as f64
            })
            .sum();
        GROWTH.1 * segments < CELL_COST * per_photon.powi(3) * cells
    }
}

/// Cost of a level of patches in photon segments, at `per_photon` segments per photon.
fn cost(level: &LightLevel, per_photon: f64) -> f64 {
    let (cells, queries) = level.work;
    CELL_COST * per_photon.powi(3) * cells as f64 + RECEIVER_QUERY * queries as f64
}

/// Total [`cost`] of the levels.
fn cost_of(levels: &[LightLevel], per_photon: f64) -> f64 {
    levels.iter().map(|level| cost(level, per_photon)).sum()
}

/// Whether audits exceed the error that the last two levels of patches estimate for themselves: finer patches would not
/// reduce that.
fn is_biased(light_progress: &LightProgress) -> bool {
    let mut last = light_progress.levels.iter().rev().take(2);
    light_progress.levels.len() > 1
        && last.all(|level| level.error.as_ref().is_some_and(|error| error.estimate.is_raised))
}

/// Whether the time left is too short for another level of patches, but enough for photons that beat the last one.
fn are_photons_in_time(light_progress: &LightProgress, state: &LightState, course: &BakeContext) -> bool {
    let (Some(left_s), Some(photon_s)) = (course.limited.time_left_s(), state.photon_s) else {
        return false;
    };
    let photons = light_progress
        .rival
        .as_ref()
        .and_then(|rival| rival.key.photons)
        .unwrap_or(0);
    let (Some(&(0, of_photons)), Some(&(_, of_patches))) =
        (light_progress.shares.first(), light_progress.shares.last())
    else {
        return false;
    };
    let own_s = left_s / course.open_lights as f64;
    let times = 1.0 + own_s / (photon_s * f64::from(photons));
    light_progress.level_s * LEVEL_GROWTH > own_s && of_photons / times.sqrt() < of_patches
}

/// Predicted total cost of patches that contribute `most_share` to the error of the bake, extrapolated from the last
/// two levels with a known share; `None` with fewer.
fn promised(
    light_progress: &LightProgress,
    cost: impl Fn(&LightLevel) -> f64,
    most_share: f64,
) -> Option<f64> {
    let cost_of = |levels: usize| -> f64 { light_progress.levels.iter().take(levels).map(&cost).sum() };
    let has_error = |levels: usize| {
        let last = levels
            .checked_sub(1)
            .and_then(|last| light_progress.levels.get(last));
        last.is_some_and(|level| level.error.is_some())
    };
    let known: Vec<(f64, f64)> = light_progress
        .shares
        .iter()
        .filter(|(levels, _)| has_error(*levels))
        .map(|&(levels, share)| (cost_of(levels), share))
        .collect();
    let [.., (before, coarse), (after, fine)] = known[..] else {
        return None;
    };
    let power = if fine < coarse {
        ((after / before).ln() / (coarse / fine).ln()).clamp(POWERS.0, POWERS.1)
    } else {
        POWERS.1
    };
    (fine > 0.0 && power.is_finite()).then(|| after * (fine / most_share).max(1.0).powf(power))
}

/// Segments of all photons, and per photon; `None` if none arrived.
fn photon_segments(level: &LightLevel) -> Option<(f64, f64)> {
    let rmse = level.error.as_ref()?.estimate.relative_rmse;
    let segments = level.work.0 as f64;
    let photons = HALVES as f64 * f64::from(level.key.photons?);
    (rmse > 0.0).then_some((segments, segments / photons))
}
