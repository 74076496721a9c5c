//! Chooses the carrier of each light: patches of its wavefront, or photons.
//!
//! Area lights and light on rough surfaces always need photons. For any other light, `auto` first traces a few photons,
//! which tell what the target would cost with photons, and refines patches while they cost less. Costs are counts of
//! operations, so that the choice does not depend on the machine.

use super::caustic::{BakeContext, CausticLayer, LightProgress};
use super::light_level::LightLevel;
use super::photon_level::GROWTH;
use crate::error::{Error, Result};
use crate::light_pass::photon::pass::HALVES;
use crate::light_pass::visibility::VisibleLight;
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

/// Maximum segments of the photons that audit patches, relative to the cost of the patches.
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

impl LightProgress<'_> {
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
        let reached = self.visibility.sights[light.light].reached.iter();
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
    pub(super) fn refuse_soft_light(&self) -> Result<()> {
        let estimator = self.settings.estimator;
        if matches!(estimator, Estimator::Auto | Estimator::Photon) {
            return Ok(());
        }
        let scene = self.tracer.scene();
        for light in self.lit() {
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
        light: &mut LightProgress,
        context: &mut BakeContext,
    ) -> Result<bool> {
        let Some(target) = self.settings.max_error else {
            return Ok(false);
        };
        let is_first = light.rival.is_none();
        let lacks_auditors = self.lacks_auditors(light);
        if is_first || self.are_photons_sooner(light) || lacks_auditors {
            let target_rmse = if lacks_auditors {
                Some(AUDIT_RMSE)
            } else {
                light.target_rmse
            };
            let mut rival = light.rival.take();
            let made = self.more_photons(light, rival.as_mut(), target_rmse, context)?;
            let is_made = made.is_some();
            light.rival = made.or(rival);
            if lacks_auditors && let Some(level) = light.levels.pop() {
                self.push_judged(light, level, context)?;
            }
            if is_made || !is_first {
                return Ok(is_made);
            }
        }
        let Some((segments, per_photon)) = light.rival.as_ref().and_then(photon_segments) else {
            // Nothing arrived: patches find paths that are too rare for a few photons.
            light.carrier = Carrier::Patches;
            return Ok(false);
        };
        let most_share = light.most_share.unwrap_or(target);
        let by_photons = match light.shares.first() {
            Some((0, share)) => segments * (share / most_share).powi(2).max(1.0),
            _ => f64::INFINITY,
        };
        let so_far = cost_of(&light.levels, per_photon);
        let next = light.levels.last().map_or(0.0, |level| cost(level, per_photon)) * LEVEL_GROWTH;
        let promised = promised(light, per_photon, most_share).unwrap_or(0.0);
        let goes_many_ways = light.levels.is_empty() && per_photon > MAX_PATHS;
        let is_above_share = light.shares.last().is_some_and(|(_, share)| *share > most_share);
        if goes_many_ways
            || are_photons_in_time(light, context)
            || (is_biased(light) && is_above_share)
            || so_far + next > by_photons
            || promised > PATCH_COST_FRACTION * by_photons
        {
            light.turn_to_photons();
        }
        // The number of queries is not known before cells are subdivided, so it is capped.
        context.most_queries = ((by_photons - so_far) / RECEIVER_QUERY) as u64;
        Ok(false)
    }

    /// Whether patches may have a bias that the photons so far are too few to detect, and enough of them cost little
    /// beside the patches.
    pub(super) fn lacks_auditors(&self, light: &LightProgress) -> bool {
        let interpolated = self.spectra.is_interpolated(light.visible.light);
        let (true, Some(rival)) = (light.carrier == Carrier::Undecided && interpolated, &light.rival) else {
            return false;
        };
        let rmse = rival.error.as_ref().map(|error| error.estimate.relative_rmse);
        let (Some((segments, per_photon)), Some(rmse)) = (photon_segments(rival), rmse) else {
            return false;
        };
        let growth = (rmse / AUDIT_RMSE).powi(2).clamp(GROWTH.0, GROWTH.1);
        rmse > AUDIT_RMSE
            && growth * segments < MAX_AUDIT_COST * cost_of(&light.levels, per_photon)
            && self
                .next_photons(light.visible, Some(rival), Some(AUDIT_RMSE))
                .is_some()
    }

    /// Whether another level of photons costs less than the first level of patches.
    fn are_photons_sooner(&self, light: &LightProgress) -> bool {
        let known = light.rival.as_ref().and_then(photon_segments);
        let (Some((segments, per_photon)), true) = (known, light.levels.is_empty()) else {
            return false;
        };
        let light = light.visible;
        let size = self.spectra.part_size(light.light, self.lattices(light)[0]);
        let cells = light.item_buffer.lattice_cells(light.launch.face_count(), size);
        let parts = self.spectra.parts(light.light);
        let cells: f64 = parts
            .iter()
            .map(|(_, part)| cells as f64 * part.node_count() as f64)
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
fn is_biased(light: &LightProgress) -> bool {
    let mut last = light.levels.iter().rev().take(2);
    let is_raised = |level: &LightLevel| level.error.as_ref().is_some_and(|error| error.estimate.is_raised);
    light.levels.len() > 1 && last.all(is_raised)
}

/// Whether the time left is too short for another level of patches, but enough for photons that beat the last one.
fn are_photons_in_time(light: &LightProgress, context: &BakeContext) -> bool {
    let (Some(left_s), Some(photon_s)) = (context.limited.time_left_s(), light.state.photon_s) else {
        return false;
    };
    let photons = light
        .rival
        .as_ref()
        .and_then(|rival| rival.key.photons)
        .unwrap_or(0);
    let (Some(&(0, of_photons)), Some(&(_, of_patches))) = (light.shares.first(), light.shares.last()) else {
        return false;
    };
    let own_s = left_s / context.open_lights as f64;
    let times = 1.0 + own_s / (photon_s * f64::from(photons));
    light.level_s * LEVEL_GROWTH > own_s && of_photons / times.sqrt() < of_patches
}

/// Predicted total cost of patches that contribute `most_share` to the error of the bake, extrapolated from the last
/// two levels with a known share; `None` with fewer.
fn promised(light: &LightProgress, per_photon: f64, most_share: f64) -> Option<f64> {
    let point = |&(count, share): &(usize, f64)| {
        let levels = light.levels.get(..count)?;
        let is_known = levels.last()?.error.is_some();
        is_known.then(|| (cost_of(levels, per_photon), share))
    };
    let known: Vec<(f64, f64)> = light.shares.iter().filter_map(point).collect();
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
