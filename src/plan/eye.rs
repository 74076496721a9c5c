//! Whether the eye pass needs specular chains, and dispersion in them.

use super::{Effect, EffectLine, EffectSwitch};
use crate::scene::{Camera, Material, Scene};

/// Decides [`Effect::Chains`] for a camera and the `aspect` = width/height of its picture: on if the bounding box of a
/// specular or glossy surface may be visible. Without a camera, on if there is any.
pub fn chains(scene: &Scene, camera: Option<(&Camera, f64)>, switch: EffectSwitch) -> EffectLine {
    let is_specular = |material: &Material| material.seen_surface().is_specular();
    let found = first_seen(scene, camera, is_specular).map(|object| {
        let is_glossy = !scene.material_of(object).surface.is_specular();
        (
            &scene.objects[object].name,
            if is_glossy { "glossy" } else { "specular" },
        )
    });
    let (on, reason) = match (switch, found, camera) {
        (EffectSwitch::Off, _, _) => (false, "switched off by the user".into()),
        (_, Some((name, _)), Some((camera, _))) => {
            (true, format!("`{name}` is in view of `{}`", camera.name))
        }
        (_, Some((name, kind)), None) => (true, format!("`{name}` is {kind}")),
        (EffectSwitch::On, None, _) => (true, "switched on by the user".into()),
        (EffectSwitch::Auto, None, Some(_)) => (false, "nothing specular is in view".into()),
        (EffectSwitch::Auto, None, None) => (false, "nothing in the scene is specular".into()),
    };
    EffectLine {
        effect: Effect::Chains,
        switch,
        on,
        reason,
    }
}

/// The line of [`Effect::Dispersion`] for both passes if the scene has dispersive glass; otherwise `light` unchanged.
/// `light` is the line of the light pass, `chains` that of the eye's chains.
pub fn dispersion(
    light: EffectLine,
    scene: &Scene,
    camera: Option<(&Camera, f64)>,
    chains: &EffectLine,
) -> EffectLine {
    let anywhere = first_seen(scene, None, Material::is_dispersive);
    let Some(object) = anywhere.filter(|_| light.switch != EffectSwitch::Off) else {
        return light;
    };
    let (on, by_eye) = match first_seen(scene, camera, Material::is_dispersive) {
        _ if !chains.on => (false, "its chains are off".into()),
        Some(object) => (
            true,
            format!("`{}` parts wavelengths", scene.objects[object].name),
        ),
        None => (
            true,
            format!("`{}` may be seen in a mirror", scene.objects[object].name),
        ),
    };
    EffectLine {
        on: light.on || on,
        reason: format!("light pass: {}; eye pass: {by_eye}", light.reason),
        ..light
    }
}

fn first_seen(
    scene: &Scene,
    camera: Option<(&Camera, f64)>,
    wanted: impl Fn(&Material) -> bool,
) -> Option<usize> {
    let frustum = camera.map(|(camera, aspect)| camera.frustum(aspect));
    let is_seen = |object: &usize| {
        let bounds = scene.objects[*object].bounds();
        bounds.is_some_and(|bounds| frustum.is_none_or(|frustum| frustum.may_see(bounds)))
    };
    (0..scene.objects.len())
        .filter(|object| wanted(scene.material_of(*object)))
        .find(is_seen)
}
