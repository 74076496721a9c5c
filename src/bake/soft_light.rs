//! Lights and surfaces that not every estimator can follow.

use super::caustic::CausticLayer;
use crate::error::{Error, Result};
use crate::light_pass::visibility::VisibleLight;
use crate::plan::Effect;

impl CausticLayer<'_> {
    /// Whether the light is sampled as an area light.
    pub(super) fn has_places(&self, light: &VisibleLight) -> bool {
        self.plan.is_on(Effect::AreaLights) && self.tracer.scene().lights[light.light].has_extent()
    }

    /// The first rough or spatially varying object that the light reaches; `None` if roughness is off.
    pub(super) fn rough_object(&self, light: &VisibleLight) -> Option<usize> {
        let scene = self.tracer.scene();
        let reached = self.visibility.reaches[light.light].reached.iter();
        let mut objects = reached.map(|&(object, _)| object);
        let rough = objects.find(|&object| scene.material_of(object).is_rough());
        rough.filter(|_| self.plan.is_on(Effect::Roughness))
    }

    /// # Errors
    /// A light with an extent or on rough surfaces, with an estimator that supports neither.
    pub(super) fn refuse_soft_light(&self) -> Result<()> {
        let estimator = self.settings.estimator;
        if estimator.refines() {
            return Ok(());
        }

        // A splat takes its footprint from its neighbours on the lattice. Rays from many places, or scattered by
        // roughness, form no wavefront, in which neighbours land side by side.
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
}
