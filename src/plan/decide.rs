//! The decision, once per scene and settings.

use super::{Effect, EffectLine, EffectPlan, EffectSwitch, LightLine};
use crate::scene::{Scene, SurfaceKind};
use crate::settings::{BakeSettings, LayerKind};

/// Specular objects that each light's item buffer found, in the order of `Scene::lights`; `None` where the light was
/// not looked at.
pub type CastersByLight = [Option<Vec<usize>>];

/// Decides every effect.
pub fn decide(scene: &Scene, settings: &BakeSettings, casters: &CastersByLight) -> EffectPlan {
    let lights = light_lines(scene, settings, casters);
    let lit: Vec<(usize, usize)> = casters
        .iter()
        .enumerate()
        .flat_map(|(light, seen)| seen.iter().flatten().map(move |&object| (object, light)))
        .collect();
    let pass = light_pass(scene, settings, &lit);
    let branch = |effect, wanted: &dyn Fn(SurfaceKind) -> bool, none: &str| {
        let cause = lit
            .iter()
            .find(|(object, _)| wanted(scene.material_of(*object).surface));
        match cause {
            _ if !pass.on => EffectLine {
                effect,
                switch: settings.effects.get(effect),
                on: false,
                reason: "the light pass is off".into(),
            },
            Some(&(object, light)) => EffectLine {
                effect,
                switch: settings.effects.get(effect),
                on: true,
                reason: lit_by(scene, object, light),
            },
            None => EffectLine {
                effect,
                switch: settings.effects.get(effect),
                on: false,
                reason: none.into(),
            },
        }
    };
    let refraction = branch(
        Effect::Refraction,
        &|kind| matches!(kind, SurfaceKind::Dielectric | SurfaceKind::ThinWall),
        "no lit surface lets light through",
    );
    let reflection = branch(
        Effect::Reflection,
        &|kind| kind.is_specular(),
        "no lit surface is specular",
    );
    let effects = vec![
        refraction,
        reflection,
        absorption(scene, &pass),
        direct(scene, settings),
    ];
    EffectPlan {
        effects: std::iter::once(pass).chain(effects).collect(),
        lights,
    }
}

fn lit_by(scene: &Scene, object: usize, light: usize) -> String {
    format!(
        "`{}` is lit by `{}`",
        scene.objects[object].name, scene.lights[light].name
    )
}

fn light_pass(scene: &Scene, settings: &BakeSettings, lit: &[(usize, usize)]) -> EffectLine {
    let line = |on, reason: String| EffectLine {
        effect: Effect::LightPass,
        switch: settings.effects.get(Effect::LightPass),
        on,
        reason,
    };
    if !settings.layers.contains(&LayerKind::Caustic) {
        return line(false, "the caustic layer is not asked for".into());
    }
    if scene.lights.is_empty() {
        return line(false, "the scene has no light".into());
    }
    if !scene
        .objects
        .iter()
        .any(|object| scene.materials[object.material].surface.is_specular())
    {
        return line(false, "nothing in the scene is specular".into());
    }
    if !scene
        .objects
        .iter()
        .any(|object| scene.materials[object.material].surface.is_receiver())
    {
        return line(false, "nothing in the scene can receive light diffusely".into());
    }
    match lit.first() {
        Some(&(object, light)) => line(true, lit_by(scene, object, light)),
        None => line(false, "no light sees a specular surface".into()),
    }
}

fn light_lines(scene: &Scene, settings: &BakeSettings, casters: &CastersByLight) -> Vec<LightLine> {
    let asked = settings.layers.contains(&LayerKind::Caustic);
    scene
        .lights
        .iter()
        .zip(casters)
        .map(|(light, seen)| {
            let names: Vec<String> = seen
                .iter()
                .flatten()
                .map(|&object| format!("`{}`", scene.objects[object].name))
                .collect();
            let reason = match (asked, seen) {
                (false, _) => "the caustic layer is not asked for".into(),
                (true, None) => "there is nothing specular to aim at, or nothing to receive it".into(),
                (true, Some(_)) if names.is_empty() => "it sees nothing specular".into(),
                (true, Some(_)) if names.len() > 3 => {
                    format!("sees {} and {} more", names[..3].join(", "), names.len() - 3)
                }
                (true, Some(_)) => format!("sees {}", names.join(", ")),
            };
            LightLine {
                light: light.name.clone(),
                on: asked && !names.is_empty(),
                reason,
            }
        })
        .collect()
}

fn absorption(scene: &Scene, pass: &EffectLine) -> EffectLine {
    let line = |on, reason: String| EffectLine {
        effect: Effect::Absorption,
        switch: EffectSwitch::Auto,
        on,
        reason,
    };
    if !pass.on {
        return line(false, "the light pass is off".into());
    }
    let absorbing = scene.objects.iter().find(|object| {
        scene.materials[object.material]
            .volume
            .is_some_and(|volume| volume.attenuation_distance_m.is_finite())
    });
    match absorbing {
        Some(object) => line(true, format!("`{}` has an attenuation distance", object.name)),
        None => line(false, "no solid has a finite attenuation distance".into()),
    }
}

fn direct(scene: &Scene, settings: &BakeSettings) -> EffectLine {
    let line = |on, reason: &str| EffectLine {
        effect: Effect::Direct,
        switch: settings.effects.get(Effect::Direct),
        on,
        reason: reason.into(),
    };
    if !settings.layers.contains(&LayerKind::Direct) {
        line(false, "the direct layer is not asked for")
    } else if scene.lights.is_empty() {
        line(false, "the scene has no light")
    } else {
        line(true, "the direct layer is asked for")
    }
}
