//! What carries a light: patches of its wavefront, or photons.
//!
//! Light of many places and on rough surfaces is for photons. Of any other light `auto` makes a few photons first; they
//! tell what the target would cost by photons, and patches go on while they cost less than that. Costs are counted
//! operations, so that the choice does not depend on the machine.

use super::BakeCounts;
use super::caustic::{CausticLayer, Climb, Course};
use super::light_level::LightLevel;
use super::map_size::Sizes;
use crate::error::{Error, Result};
use crate::light_pass::caustic::setup::AimedLight;
use crate::plan::Effect;
use crate::settings::Estimator;

/// Time of a segment of a patch's ray, with all that is kept of it, over that of a photon's segment.
const PATCH_SEGMENT: f64 = 12.0;

/// Time of a ray that only looks for its receiver, with its triangle's deposit, over that of a photon's segment.
const RECEIVER_QUERY: f64 = 0.6;

/// A level of patches costs so many times the one before it.
const LEVEL_GROWTH: f64 = 4.0;

/// What carries a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Carrier {
    /// Patches, or photons once they are known to be cheaper.
    Undecided,
    /// Patches of the wavefront.
    #[default]
    Patches,
    /// Photons.
    Photons,
    /// The paper's kernels.
    Splats,
}

/// Operations of patches so far, in segments of photons.
pub(super) fn patch_cost(counts: &BakeCounts) -> f64 {
    PATCH_SEGMENT * counts.segments as f64 + RECEIVER_QUERY * counts.receiver_queries as f64
}

impl CausticLayer<'_> {
    /// What carries a light to begin with.
    ///
    /// # Errors
    /// An estimator that cannot carry it.
    pub(super) fn carrier(&self, light: &AimedLight) -> Result<Carrier> {
        let carrier = match self.settings.estimator {
            Estimator::Photon => Carrier::Photons,
            Estimator::Auto if self.settings.max_error.is_none() => Carrier::Photons,
            Estimator::Auto if self.why_soft(light).is_some() => Carrier::Photons,
            Estimator::Auto => Carrier::Undecided,
            Estimator::Wavefront => Carrier::Patches,
            Estimator::Splat => Carrier::Splats,
        };
        if let (Carrier::Patches | Carrier::Splats, Some(why)) = (carrier, self.why_soft(light)) {
            let estimator: &str = self.settings.estimator.into();
            return Err(Error::usage(
                "--estimator",
                format!("{why}, and {estimator} follows light of one place over smooth surfaces only"),
                "use --estimator auto or photon",
            ));
        }
        Ok(carrier)
    }

    /// Whether a light has many places, so that photons draw theirs.
    pub(super) fn has_places(&self, light: &AimedLight) -> bool {
        self.plan.is_on(Effect::AreaLights) && self.tracer.scene().lights[light.light].has_extent()
    }

    /// Why light is not that of one wavefront; `None` where it is.
    fn why_soft(&self, light: &AimedLight) -> Option<String> {
        let scene = self.tracer.scene();
        let name = &scene.lights[light.light].name;
        if self.has_places(light) {
            return Some(format!("light `{name}` has a size"));
        }
        let reached = self.aim.sights[light.light].reached.iter();
        let mut rough = reached.filter(|(object, _)| scene.material_of(*object).is_rough());
        let (object, _) = rough.next().filter(|_| self.plan.is_on(Effect::Roughness))?;
        Some(format!(
            "light `{name}` meets `{}`, which is rough",
            scene.objects[*object].name
        ))
    }

    /// Of a light that may have either: makes the photons that tell their cost, then decides whether another level of
    /// patches is worth it.
    pub(super) fn decide_carrier(
        &self,
        light: &AimedLight,
        sizes: &Sizes,
        climb: &mut Climb,
        course: &mut Course,
    ) -> Result<()> {
        let Some(target) = self.settings.max_error else {
            return Ok(());
        };
        if climb.pilot.is_none() {
            climb.pilot = self.first_photons(light, sizes, course)?;
        }
        let Some(by_photons) = climb.pilot.as_ref().and_then(|pilot| photon_cost(pilot, target)) else {
            // Nothing arrived: patches find what is too rare for a few photons.
            climb.carrier = Carrier::Patches;
            return Ok(());
        };
        let next = climb.last_patch_cost * LEVEL_GROWTH;
        let is_cheaper = climb.patch_cost + next <= by_photons;
        if is_cheaper {
            return Ok(());
        }
        climb.carrier = Carrier::Photons;
        climb.levels.clear();
        climb.rounds.clear();
        climb.levels.extend(climb.pilot.take());
        Ok(())
    }
}

/// Segments that photons are expected to take for a target; `None` where none arrived.
fn photon_cost(pilot: &LightLevel, target: f64) -> Option<f64> {
    let rmse = pilot.error.as_ref()?.estimate.relative_rmse;
    let segments = pilot.photons.as_ref()?.segments as f64;
    (rmse > 0.0).then(|| segments * (rmse / target).powi(2).max(1.0))
}
