//! Decides the plan, once per scene and settings.

use super::{Effect, EffectLine, EffectPlan, EffectSwitch, LightLine};
use crate::scene::{Material, Scene, SurfaceKind};
use crate::settings::{BakeSettings, ErrorMetric, LayerKind};

/// Specular objects that a light sees or reaches.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightReach {
    /// Specular objects that no opaque closed surface seals from the light.
    pub unsealed: usize,
    /// Those whose light may continue to a diffuse surface.
    pub casters: usize,
    /// Objects that the light's item buffer found, in ascending order.
    pub seen: Vec<usize>,
    /// Cells of the item buffer that opaque faces cover.
    pub hidden_cells: u64,
    /// All specular objects that the light may reach, each with the object that sends light there; `None` if the light
    /// sees it directly.
    pub reached: Vec<(usize, Option<usize>)>,
}

/// Decides every effect. `reaches` is in the order of `Scene::lights`.
pub fn decide(scene: &Scene, settings: &BakeSettings, reaches: &[LightReach]) -> EffectPlan {
    // The light pass is decided first: without it, no effect on its paths is simulated.
    let decision = Decision {
        scene,
        settings,
        reaches,
        caustic: wants_caustics(settings),
    };
    let pass = decision.light_pass();
    let on_paths = |effect, wanted: &dyn Fn(&Material) -> bool, none: &str| {
        decision.on_paths(effect, pass.on, wanted, none)
    };

    // An effect on paths is on as soon as light may reach one surface that calls for it.
    let lets_through = |material: &Material| !material.surface.is_opaque();
    let absorbs = |material: &Material| {
        let volume = material.volume.as_ref();
        material.is_solid() && volume.is_some_and(|volume| volume.attenuation_distance_m.is_finite())
    };
    let effects = vec![
        on_paths(
            Effect::Refraction,
            &lets_through,
            "no lit surface lets light through",
        ),
        decision.dispersion(pass.on),
        on_paths(
            Effect::Reflection,
            &Material::is_specular,
            "no lit surface is specular",
        ),
        on_paths(
            Effect::Absorption,
            &absorbs,
            "no lit solid has a finite attenuation distance",
        ),
        on_paths(
            Effect::Textures,
            &|material| {
                let has_tint =
                    material.surface != SurfaceKind::Coated && material.base_colour_texture.is_some();
                has_tint || material.variation.is_some()
            },
            "no lit mirror or glass has a texture",
        ),
        on_paths(
            Effect::Roughness,
            &Material::is_rough,
            "no lit mirror, glass or coat is rough",
        ),
        on_paths(
            Effect::Bumps,
            &Material::has_bumps,
            "no lit mirror, glass or coat has waves or a normal texture",
        ),
        decision.area_lights(pass.on),
        decision.direct(pass.on),
        decision.indirect(),
        decision.motion(),
    ];
    EffectPlan {
        effects: std::iter::once(pass).chain(effects).collect(),
        lights: decision.lights(),
    }
}

/// Whether the caustic layer is baked: for its own sake, or because other layers gather from it.
pub fn wants_caustics(settings: &BakeSettings) -> bool {
    is_needed(settings, LayerKind::Caustic)
}

/// Whether a layer is in the maps: by the switch of its effect or, if that is auto, by the chosen layers.
pub fn is_wanted(settings: &BakeSettings, layer: LayerKind) -> bool {
    match settings.effects.get(effect_of(layer)) {
        EffectSwitch::On => true,
        EffectSwitch::Off => false,
        EffectSwitch::Auto => settings.layers.contains(&layer),
    }
}

/// Whether a layer is baked, in the maps or not.
fn is_needed(settings: &BakeSettings, layer: LayerKind) -> bool {
    let is_off = settings.effects.get(effect_of(layer)) == EffectSwitch::Off;
    !is_off && (is_wanted(settings, layer) || is_wanted(settings, LayerKind::Indirect))
}

/// Whether the error of caustics is judged beside direct light, baked or not. `pass`: whether the light pass is on.
pub fn weighs_direct(settings: &BakeSettings, pass: bool) -> bool {
    pass && settings.error_metric == ErrorMetric::Visible
        && is_wanted(settings, LayerKind::Caustic)
        && settings.effects.get(Effect::Direct) != EffectSwitch::Off
}

/// The effect that produces a layer.
fn effect_of(layer: LayerKind) -> Effect {
    match layer {
        LayerKind::Caustic => Effect::LightPass,
        LayerKind::Direct => Effect::Direct,
        LayerKind::Indirect => Effect::Indirect,
    }
}

/// Reason of an effect that the user switched off.
const SWITCHED_OFF: &str = "switched off by the user";

/// Reason of an effect that the user switched on although nothing requires it.
const FORCED_ON: &str = "switched on by the user, though nothing calls for it";

struct Decision<'a> {
    scene: &'a Scene,
    settings: &'a BakeSettings,
    reaches: &'a [LightReach],
    /// Whether the caustic layer is baked.
    caustic: bool,
}

impl Decision<'_> {
    fn line(&self, effect: Effect, on: bool, reason: impl Into<String>) -> EffectLine {
        EffectLine {
            effect,
            switch: self.settings.effects.get(effect),
            on,
            reason: reason.into(),
        }
    }

    /// Whether any object has a material that `wanted` accepts.
    fn has(&self, wanted: impl Fn(&Material) -> bool) -> bool {
        (0..self.scene.objects.len()).any(|object| wanted(self.scene.material_of(object)))
    }

    fn light_pass(&self) -> EffectLine {
        let effect = Effect::LightPass;
        let line = |on, reason: &str| self.line(effect, on, reason);
        if self.settings.effects.get(effect) == EffectSwitch::Off {
            return line(false, SWITCHED_OFF);
        }
        if !self.caustic {
            return line(false, "the caustic layer is not asked for");
        }
        if self.scene.lights.is_empty() {
            return line(false, "the scene has no light");
        }
        if !self.has(Material::is_specular) {
            return line(false, "nothing in the scene is specular");
        }
        if !self.has(|material| material.surface.is_receiver()) {
            return line(false, "nothing in the scene can receive light diffusely");
        }
        let lit = self.lit_objects().find(|(_, _, way)| way.is_none());
        match lit {
            Some((object, light, way)) => line(true, &self.lit_by(object, light, way)),
            None => line(
                false,
                "no light sees a specular surface that could send light to a diffuse one",
            ),
        }
    }

    /// Objects that light may reach: object, light, and the object that sends light there, if any.
    fn lit_objects(&self) -> impl Iterator<Item = (usize, usize, Option<usize>)> {
        let shining = |light: usize| self.scene.lights[light].strength().max_channel() > 0.0;
        let reaches = self.reaches.iter().enumerate();
        reaches
            .filter(move |(light, _)| shining(*light))
            .flat_map(|(light, reach)| {
                let reached = reach.reached.iter();
                reached.map(move |&(object, way)| (object, light, way))
            })
    }

    fn lit_by(&self, object: usize, light: usize, way: Option<usize>) -> String {
        let name = |object: usize| &self.scene.objects[object].name;
        let (object, light) = (name(object), &self.scene.lights[light].name);
        match way {
            None => format!("`{object}` is lit by `{light}`"),
            Some(way) => format!("`{object}` may be lit by `{light}` by way of `{}`", name(way)),
        }
    }

    /// An effect on paths of the light pass: on if a lit object requires it.
    fn on_paths(
        &self,
        effect: Effect,
        pass: bool,
        wanted: &dyn Fn(&Material) -> bool,
        none: &str,
    ) -> EffectLine {
        let calls = |object: usize| wanted(self.scene.material_of(object));
        let cause = self.lit_objects().find(|&(object, ..)| calls(object));
        match (self.settings.effects.get(effect), cause) {
            (EffectSwitch::Off, _) => self.line(effect, false, SWITCHED_OFF),
            _ if !pass => self.line(effect, false, "the light pass is off"),
            (_, Some((object, light, way))) => self.line(effect, true, self.lit_by(object, light, way)),
            (EffectSwitch::On, None) => self.line(effect, true, FORCED_ON),
            (EffectSwitch::Auto, None) => self.line(effect, false, none),
        }
    }

    /// On if a lit object is dispersive, whatever the colour of the light.
    fn dispersion(&self, pass: bool) -> EffectLine {
        let none = "no lit solid bends one wavelength more than another";
        let line = self.on_paths(Effect::Dispersion, pass, &Material::is_dispersive, none);
        let glasses = self.lit_objects().find_map(|(object, ..)| {
            let material = self.scene.material_of(object);
            material.glass.as_ref().filter(|_| material.is_dispersive())
        });
        match glasses {
            Some(glass) if line.on => EffectLine {
                reason: format!(
                    "{}, and its glass has an Abbe number of {:.1}",
                    line.reason,
                    glass.dispersion.abbe_number()
                ),
                ..line
            },
            _ => line,
        }
    }

    fn area_lights(&self, pass: bool) -> EffectLine {
        let effect = Effect::AreaLights;
        let sized = |light: usize| self.scene.lights[light].has_extent();
        let lit = self.lit_objects().find(|&(_, light, _)| sized(light));
        match (self.settings.effects.get(effect), lit) {
            (EffectSwitch::Off, _) => self.line(effect, false, SWITCHED_OFF),
            _ if !pass => self.line(effect, false, "the light pass is off"),
            (_, Some((object, light, way))) => {
                let reason = format!("{}, which has a size", self.lit_by(object, light, way));
                self.line(effect, true, reason)
            }
            (EffectSwitch::On, None) => self.line(effect, true, FORCED_ON),
            (EffectSwitch::Auto, None) => self.line(
                effect,
                false,
                "every light that sees a caster is a point or a direction",
            ),
        }
    }

    fn direct(&self, pass: bool) -> EffectLine {
        let effect = Effect::Direct;
        let line = |on, reason: &str| self.line(effect, on, reason);
        match self.settings.effects.get(effect) {
            EffectSwitch::Off => line(false, SWITCHED_OFF),
            switch if is_needed(self.settings, LayerKind::Direct) => match self.why_dark() {
                Some(why) => line(false, why),
                None if switch == EffectSwitch::On => line(true, "switched on by the user"),
                None if is_wanted(self.settings, LayerKind::Direct) => {
                    line(true, "the direct layer is asked for")
                }
                None => line(true, "the indirect layer gathers from it"),
            },
            _ if weighs_direct(self.settings, pass) => line(
                false,
                "the direct layer is not asked for, but the visible error is judged beside it",
            ),
            _ => line(false, "the direct layer is not asked for"),
        }
    }

    fn indirect(&self) -> EffectLine {
        let effect = Effect::Indirect;
        let line = |on, reason: &str| self.line(effect, on, reason);
        match self.settings.effects.get(effect) {
            EffectSwitch::Off => line(false, SWITCHED_OFF),
            _ if !is_wanted(self.settings, LayerKind::Indirect) => {
                line(false, "the indirect layer is not asked for")
            }
            switch => match self.why_dark() {
                Some(why) => line(false, why),
                None if switch == EffectSwitch::On => line(true, "switched on by the user"),
                None => line(true, "the indirect layer is asked for"),
            },
        }
    }

    fn motion(&self) -> EffectLine {
        let effect = Effect::Motion;
        match (self.settings.effects.get(effect), self.scene.why_animated()) {
            (EffectSwitch::Off, _) => self.line(effect, false, SWITCHED_OFF),
            (_, Some(why)) => self.line(effect, true, why),
            (EffectSwitch::On, None) => self.line(effect, true, FORCED_ON),
            (EffectSwitch::Auto, None) => self.line(effect, false, "nothing in the scene moves by itself"),
        }
    }

    /// Why no diffuse surface can receive light, if that is so.
    fn why_dark(&self) -> Option<&'static str> {
        if self.scene.lights.is_empty() {
            Some("the scene has no light")
        } else if !self.has(|material| material.surface.is_receiver()) {
            Some("nothing in the scene can receive light diffusely")
        } else {
            None
        }
    }

    fn lights(&self) -> Vec<LightLine> {
        let lights = self.scene.lights.iter().enumerate();
        lights
            .map(|(light, source)| {
                let reach = self.reaches.get(light);
                let shines = source.strength().max_channel() > 0.0;
                let seen = reach.map_or(&[][..], |reach| &reach.seen);
                LightLine {
                    light: source.name.clone(),
                    on: self.caustic && shines && !seen.is_empty(),
                    reason: self.light_reason(shines, reach),
                }
            })
            .collect()
    }

    fn light_reason(&self, shines: bool, reach: Option<&LightReach>) -> String {
        // The first obstacle on the way from the lamp to a receiver is the reason: those behind it do not matter.
        let Some(reach) = reach.filter(|_| self.caustic) else {
            return "the caustic layer is not asked for".into();
        };
        if !shines {
            return "it does not shine".into();
        }
        if !self.has(Material::is_specular) {
            return "nothing in the scene is specular".into();
        }
        if reach.unsealed == 0 {
            return "opaque bodies seal it from everything specular".into();
        }
        if reach.casters == 0 {
            return "nothing specular that it could light can send light to a diffuse surface".into();
        }
        if reach.seen.is_empty() {
            let why = if reach.hidden_cells > 0 {
                "opaque surfaces hide everything specular from it"
            } else {
                "it sees nothing specular"
            };
            return why.into();
        }

        // A plan is read at a glance, so that a few names stand for many.
        let names: Vec<String> = reach
            .seen
            .iter()
            .map(|&object| format!("`{}`", self.scene.objects[object].name))
            .collect();
        match names.len() {
            0..=3 => format!("sees {}", names.join(", ")),
            count => format!("sees {} and {} more", names[..3].join(", "), count - 3),
        }
    }
}
