//! What each effect of a scene's plan costs and what it is worth, and what code for every effect costs over code for
//! those that the scene calls for.

use std::sync::Arc;

use serde::Serialize;

use super::repeats::{bake, light_pass_cpu_s, median};
use crate::effect::{Effect, EffectSwitch, EffectSwitches};
use crate::error::{Result, Warning};
use crate::illumination::difference::{Difference, SignedMap, difference};
use crate::illumination::difference_colours;
use crate::progress::{Control, Progress};
use crate::scene::Scene;
use crate::session::{BakeResult, EffectCounts};
use crate::settings::{BakeSettings, LayerKind};

/// Name of the row that compares a bake with everything switched on with the planned one.
pub const FORCED: &str = "everything forced on";

/// What is measured.
#[derive(Clone, Debug)]
pub struct EffectStudy {
    /// Of the planned bake; all others switch effects on or off.
    pub settings: BakeSettings,
    /// Bakes as planned, and as many with everything forced on; their median CPU times count. At least one of each.
    pub repeats: usize,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct EffectTable {
    /// One for each effect that is on in the plan, in its order.
    pub effects: Vec<EffectWorth>,
    /// With everything forced on against without, which is as planned.
    pub forced: EffectRow,
    /// Of the planned bake.
    pub warnings: Vec<Warning>,
}

/// An effect with a picture of what it does.
#[derive(Clone, Debug)]
pub struct EffectWorth {
    /// Which effect.
    pub effect: Effect,
    /// Costs and worth.
    pub row: EffectRow,
    /// Where it adds or takes light on the largest map; `None` where no surface is lit either way.
    pub picture: Option<DifferencePicture>,
}

/// One row of the table: a bake with something and one without it.
#[derive(Clone, Debug, Serialize)]
pub struct EffectRow {
    /// Its name on the command line, or [`FORCED`].
    pub effect: String,
    /// Why it is on.
    pub reason: String,
    /// Rays traced for it: see [`EffectCounts::rays`]. With everything forced on, of the whole light pass, as the next
    /// three.
    pub rays: u64,
    /// Patches and kernels that it brought to a map, by the last event of their paths.
    pub deposits: u64,
    /// Memory that is held for it [bytes].
    pub bytes: u64,
    /// CPU time of the median bake [ms]; `None` where it is a part of others.
    pub cpu_ms: Option<f64>,
    /// On all maps and layers with it [W].
    pub with_w: f64,
    /// On all maps and layers without it [W].
    pub without_w: f64,
    /// With minus without [W].
    pub difference_w: f64,
    /// Relative RMSE between the maps with and without it; `None` where the maps with it are dark.
    pub relative_rmse: Option<f64>,
    /// Item buffers, tracing and depositing with it [s of CPU]; median of the repeats.
    pub cpu_with_s: f64,
    /// The same without it: of one bake, or median of the repeats where that is the planned one.
    pub cpu_without_s: f64,
    /// CPU seconds with it over those without; `None` where no ray was traced without.
    pub cpu_ratio: Option<f64>,
    /// Light rays of the bake with it over those without; `None` where there are none without.
    pub rays_ratio: Option<f64>,
}

/// Differences of a map in false colours.
#[derive(Clone, Debug)]
pub struct DifferencePicture {
    /// The surface's name.
    pub surface: String,
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// sRGB and opacity of each texel, row 0 first.
    pub rgba: Vec<u8>,
}

/// Bakes as planned, with everything forced on, and once without each effect that is on in the plan.
///
/// # Errors
/// Those of a bake; stopped before the end; maps of sizes that cannot be compared.
pub fn measure(
    scene: &Arc<Scene>,
    study: &EffectStudy,
    progress: &dyn Progress,
    control: &Control,
) -> Result<EffectTable> {
    let bake = |effects: EffectSwitches| {
        let settings = BakeSettings {
            effects,
            ..study.settings.clone()
        };
        bake(scene, &settings, progress, control)
    };
    let switches = [study.settings.effects.clone(), forced(&study.settings)];
    let [planned, forced] = alternating(study.repeats.max(1), |which| bake(switches[which].clone()))?;
    let mut effects = Vec::new();
    for line in planned.result.plan.effects.iter().filter(|line| line.on) {
        let off = study.settings.effects.clone();
        let without = Timed::of(vec![bake(off.with(line.effect, EffectSwitch::Off))?]);
        let counts = counts_of(&planned.result, line.effect);
        let (row, found) = compared(line.effect.name(), &line.reason, &counts, [&planned, &without])?;
        effects.push(EffectWorth {
            effect: line.effect,
            row,
            picture: picture(scene, &found),
        });
    }
    let reason = "code for every effect, run whether the scene calls for it or not";
    let counts = counts_of(&forced.result, Effect::LightPass);
    let (forced, _) = compared(FORCED, reason, &counts, [&forced, &planned])?;
    Ok(EffectTable {
        effects,
        forced,
        warnings: planned.result.warnings,
    })
}

/// Everything on, but for what would add or take light: layers are those of the settings, and what is off stays off.
fn forced(settings: &BakeSettings) -> EffectSwitches {
    let has_caustics = settings.layers.contains(&LayerKind::Caustic);
    let keeps_switch = |effect: &Effect| match effect {
        Effect::Direct | Effect::Indirect => true,
        Effect::LightPass if !has_caustics => true,
        _ => settings.effects.get(*effect) == EffectSwitch::Off,
    };
    let kept = Effect::ALL.into_iter().filter(keeps_switch);
    kept.fold(EffectSwitches::all_on(), |switches, effect| {
        switches.with(effect, settings.effects.get(effect))
    })
}

/// A bake with the CPU seconds of the light pass of the median bake of its kind.
struct Timed {
    /// The first of its kind, with what effects took in the median one.
    result: BakeResult,
    cpu_s: f64,
}

impl Timed {
    /// Of at least one bake.
    fn of(mut bakes: Vec<BakeResult>) -> Self {
        let cpu_s = median(bakes.iter().map(light_pass_cpu_s).collect());
        let is_median = |bake: &&BakeResult| light_pass_cpu_s(bake).to_bits() == cpu_s.to_bits();
        let effects = bakes.iter().find(is_median).map(|bake| bake.effects.clone());
        let mut result = bakes.swap_remove(0);
        result.effects = effects.unwrap_or_default();
        Self { result, cpu_s }
    }

    /// Rays from the lights, for both layers.
    fn rays(&self) -> u64 {
        self.result.counts.rays + self.result.counts.shadow_rays
    }
}

/// Bakes of two kinds in turns, now one first, now the other, so that what drifts meets both alike.
fn alternating(repeats: usize, mut bake: impl FnMut(usize) -> Result<BakeResult>) -> Result<[Timed; 2]> {
    let mut bakes = [Vec::new(), Vec::new()];
    for round in 0..repeats {
        for turn in 0..2 {
            let which = (round + turn) % 2;
            let mut result = bake(which)?;
            if round > 0 {
                // Only what they took counts.
                result.maps.clear();
            }
            bakes[which].push(result);
        }
    }
    Ok(bakes.map(Timed::of))
}

fn counts_of(result: &BakeResult, effect: Effect) -> EffectCounts {
    let report = result.effects.iter().find(|report| report.line.effect == effect);
    report.map(|report| report.counts).unwrap_or_default()
}

fn compared(
    effect: &str,
    reason: &str,
    counts: &EffectCounts,
    [with, without]: [&Timed; 2],
) -> Result<(EffectRow, Difference)> {
    let found = difference(&with.result.maps, &without.result.maps)?;
    let ratio = |a: f64, b: f64| (without.rays() > 0 && b > 0.0).then(|| a / b);
    let light_rays = |timed: &Timed| timed.result.counts.rays as f64;
    let row = EffectRow {
        effect: effect.into(),
        reason: reason.into(),
        rays: counts.rays,
        deposits: counts.deposits,
        bytes: counts.bytes,
        cpu_ms: counts.cpu_ms,
        with_w: found.with_w,
        without_w: found.without_w,
        difference_w: found.difference_w(),
        relative_rmse: found.relative_rmse,
        cpu_with_s: with.cpu_s,
        cpu_without_s: without.cpu_s,
        cpu_ratio: ratio(with.cpu_s, without.cpu_s),
        rays_ratio: ratio(light_rays(with), light_rays(without)),
    };
    Ok((row, found))
}

/// The map of most texels; among equals that of the largest surface.
fn picture(scene: &Scene, found: &Difference) -> Option<DifferencePicture> {
    let map = found.maps.iter().max_by(|a, b| {
        let texels = |map: &SignedMap| map.irradiance.len();
        let area_m2 = |map: &SignedMap| -> f64 {
            let texels = 0..map.irradiance.len();
            texels.map(|texel| map.chart.texel_area_m2(texel)).sum()
        };
        let by_area = || area_m2(a).total_cmp(&area_m2(b));
        // Both sides of a sheet are as large: its front.
        let is_first = || b.chart.receiver.cmp(&a.chart.receiver);
        texels(a).cmp(&texels(b)).then_with(by_area).then_with(is_first)
    })?;
    let rgba = difference_colours::of_map(map).flat_map(|[r, g, b]| [r, g, b, u8::MAX]);
    Some(DifferencePicture {
        surface: scene.objects[map.chart.object()].name.clone(),
        // Sides are at most 16384.
        width: map.chart.width as u32,
        height: map.chart.height as u32,
        rgba: rgba.collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_and_what_is_off_stay_as_they_are() {
        let settings = BakeSettings {
            effects: EffectSwitches::default().with(Effect::Absorption, EffectSwitch::Off),
            ..BakeSettings::default()
        };
        let switches = forced(&settings);
        assert_eq!(switches.get(Effect::LightPass), EffectSwitch::On);
        assert_eq!(switches.get(Effect::Refraction), EffectSwitch::On);
        assert_eq!(switches.get(Effect::Absorption), EffectSwitch::Off);
        assert_eq!(switches.get(Effect::Direct), EffectSwitch::Auto);
        let direct = BakeSettings {
            layers: vec![LayerKind::Direct],
            ..settings
        };
        assert_eq!(forced(&direct).get(Effect::LightPass), EffectSwitch::Auto);
    }
}
