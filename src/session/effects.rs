//! What each effect took, put together from what was counted where the work is done.

use super::BakeCounts;
use super::caustic::CausticOutcome;
use super::clock::Clock;
use super::result::{EffectCounts, EffectReport, ItemBufferReport};
use crate::light_pass::caustic::pass::Seconds;
use crate::light_pass::caustic::setup::Aim;
use crate::light_pass::wavefront::kept_rays::KeptHit;
use crate::plan::{Effect, EffectLine, EffectPlan};
use crate::scene::Scene;
use crate::transport::PathCounts;

/// What a bake did, as far as effects have part in it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EffectMeter {
    /// Segments of light paths by what began them.
    pub(super) paths: PathCounts,
    /// Patches and kernels by what took part in them.
    pub(super) deposits: PathCounts,
    /// Held for the caustic layer: rays, patches, maps [bytes].
    pub(super) caustic_bytes: u64,
    /// Wavefronts of lights with a size.
    pub(super) places: EffectCounts,
    /// Held for the direct layer [bytes].
    pub(super) direct_bytes: u64,
    /// The direct layer alone.
    pub(super) direct_s: Seconds,
    /// The indirect layer.
    pub(super) indirect: EffectCounts,
    pub(super) indirect_s: Seconds,
}

/// What all effects of a plan took.
pub(super) fn reports(
    scene: &Scene,
    plan: &EffectPlan,
    aim: &Aim,
    outcome: &CausticOutcome,
    clock: &Clock,
) -> Vec<EffectReport> {
    let accounts = Accounts {
        scene,
        aim,
        counts: &outcome.counts,
        meter: &outcome.meter,
        clock,
    };
    plan.effects
        .iter()
        .map(|line| EffectReport {
            line: line.clone(),
            counts: accounts.of(line),
        })
        .collect()
}

/// What looking around took, light by light.
pub(super) fn item_buffers(scene: &Scene, aim: &Aim) -> Vec<ItemBufferReport> {
    let lights = scene.lights.iter().zip(&aim.looks);
    lights
        .map(|(light, look)| ItemBufferReport {
            light: light.name.clone(),
            cells: look.cells,
            hidden_cells: look.hidden_cells,
            tests: look.tests,
            cpu_ms: 1e3 * look.seconds.cpu,
        })
        .collect()
}

struct Accounts<'a> {
    scene: &'a Scene,
    aim: &'a Aim,
    counts: &'a BakeCounts,
    meter: &'a EffectMeter,
    clock: &'a Clock,
}

impl Accounts<'_> {
    fn of(&self, line: &EffectLine) -> EffectCounts {
        let (paths, deposits) = (&self.meter.paths, &self.meter.deposits);
        match line.effect {
            Effect::LightPass => EffectCounts {
                rays: self.counts.rays,
                deposits: deposits.transmitted + deposits.reflected,
                bytes: self.meter.caustic_bytes + self.item_buffer_bytes(),
                cpu_ms: Some(1e3 * (self.clock.plan.cpu + self.trace_s() + self.clock.deposit.cpu)),
                ..EffectCounts::default()
            },
            Effect::Refraction => self.branch(paths.transmitted, deposits.transmitted),
            Effect::Reflection => self.branch(paths.reflected, deposits.reflected),
            Effect::Absorption => EffectCounts {
                rays: paths.attenuated,
                deposits: deposits.attenuated,
                ..EffectCounts::default()
            },
            Effect::Textures => EffectCounts {
                rays: paths.textured,
                deposits: deposits.textured,
                bytes: if paths.textured > 0 {
                    self.texture_bytes()
                } else {
                    0
                },
                ..EffectCounts::default()
            },
            Effect::Roughness => EffectCounts {
                rays: paths.scattered,
                deposits: deposits.scattered,
                ..EffectCounts::default()
            },
            Effect::Bumps => EffectCounts {
                rays: paths.bent,
                deposits: deposits.bent,
                ..EffectCounts::default()
            },
            Effect::AreaLights => self.meter.places,
            Effect::Direct => EffectCounts {
                rays: self.counts.shadow_rays,
                bytes: self.meter.direct_bytes,
                cpu_ms: Some(1e3 * self.meter.direct_s.cpu),
                ..EffectCounts::default()
            },
            Effect::Indirect => self.meter.indirect,
            Effect::Dispersion => EffectCounts {
                rays: paths.of_a_wavelength,
                deposits: deposits.of_a_wavelength,
                ..EffectCounts::default()
            },
            Effect::Chains => EffectCounts::default(),
        }
    }

    /// Tracing light paths alone [s of CPU].
    fn trace_s(&self) -> f64 {
        (self.clock.trace.cpu - self.meter.direct_s.cpu - self.meter.indirect_s.cpu).max(0.0)
    }

    /// One kind of branch, with its share of the loops that all branches share.
    fn branch(&self, segments: u64, deposits: u64) -> EffectCounts {
        let share = |part: u64, whole: u64| part as f64 / whole.max(1) as f64;
        let all_deposits = self.meter.deposits.transmitted + self.meter.deposits.reflected;
        let cpu_s = self.trace_s() * share(segments, self.counts.segments)
            + self.clock.deposit.cpu * share(deposits, all_deposits);
        EffectCounts {
            rays: segments,
            deposits,
            bytes: segments * size_of::<KeptHit>() as u64,
            cpu_ms: Some(1e3 * cpu_s),
            ..EffectCounts::default()
        }
    }

    fn item_buffer_bytes(&self) -> u64 {
        self.aim
            .lights
            .iter()
            .map(|light| light.item_buffer.bytes())
            .sum()
    }

    /// Of textures on specular surfaces.
    fn texture_bytes(&self) -> u64 {
        let materials = self
            .scene
            .objects
            .iter()
            .map(|object| &self.scene.materials[object.material]);
        let mut textures: Vec<usize> = materials
            .filter(|material| material.surface.is_specular())
            .filter_map(|material| Some(material.base_colour_texture.as_ref()?.texture))
            .collect();
        textures.sort_unstable();
        textures.dedup();
        textures
            .into_iter()
            .map(|texture| size_of_val(&self.scene.textures[texture].rgba[..]) as u64)
            .sum()
    }
}
