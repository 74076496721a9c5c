//! Whether the eye needs its specular chains.

use super::{Effect, EffectLine, EffectSwitch};
use crate::scene::{Camera, Scene};

/// Decides [`Effect::Chains`] for a camera and the `aspect` = width/height of its picture: on where the box of a
/// specular surface may be seen. Without a camera, where there is a specular surface at all.
pub fn chains(scene: &Scene, camera: Option<(&Camera, f64)>, switch: EffectSwitch) -> EffectLine {
    let seen = first_specular(scene, camera).map(|object| &scene.objects[object].name);
    let (on, reason) = match (switch, seen, camera) {
        (EffectSwitch::Off, _, _) => (false, "switched off by the user".into()),
        (_, Some(name), Some((camera, _))) => (true, format!("`{name}` is in view of `{}`", camera.name)),
        (_, Some(name), None) => (true, format!("`{name}` is specular")),
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

fn first_specular(scene: &Scene, camera: Option<(&Camera, f64)>) -> Option<usize> {
    let frustum = camera.map(|(camera, aspect)| camera.frustum(aspect));
    let is_seen = |object: &usize| {
        let bounds = scene.objects[*object].mesh.bounds();
        bounds.is_some_and(|bounds| frustum.is_none_or(|frustum| frustum.may_see(bounds)))
    };
    (0..scene.objects.len())
        .filter(|object| scene.material_of(*object).surface.is_specular())
        .find(is_seen)
}
