//! Objects that glow, as lights: emissive materials, KHR_materials_emissive_strength included.

use crate::scene::{Light, LightKind, LightSize, Scene};
use crate::units::Radiance;

/// Adds a light for every object whose material emits light, in their order. Its radiance is the luminance of what is
/// emitted, its colour has a luminance of 1, and its
/// spectrum is the material's.
pub fn add_lights(scene: &mut Scene) {
    for (object, part) in scene.objects.iter().enumerate() {
        let material = scene.material_of(object);
        let emitted = material.emitted_radiance;
        let spectrum = material.emission_spectrum.clone();
        let luminance = emitted.luminance();
        if luminance > 0.0 && part.mesh.area_m2() > 0.0 {
            scene.lights.push(Light {
                name: part.name.clone(),
                colour: emitted / luminance,
                spectrum,
                kind: LightKind::Surface {
                    object,
                    radiance: Radiance(luminance),
                },
                size: LightSize::None,
            });
        }
    }
}
