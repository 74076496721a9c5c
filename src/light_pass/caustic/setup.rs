//! Looks around from every light, before any ray is traced.

use glam::DVec3;

use crate::light_pass::item_buffer::ItemBuffer;
use crate::light_pass::launch::Launch;
use crate::scene::Scene;
use crate::settings::ItemBufferKind;
use crate::transport::Tracer;

/// A light that sees something specular.
#[derive(Debug)]
pub struct AimedLight {
    /// Index into `Scene::lights`.
    pub light: usize,
    /// Where its rays start, as of a white light of unit strength: what the real one gives is a scale of that.
    pub launch: Launch,
    /// Which of them are worth tracing.
    pub item_buffer: ItemBuffer,
}

/// What all lights see.
#[derive(Debug)]
pub struct Aim {
    /// Lights with at least one marked cell.
    pub lights: Vec<AimedLight>,
    /// Specular objects seen, by light; `None` where there was nothing to look for.
    pub casters: Vec<Option<Vec<usize>>>,
    /// Distance from the casters' centre to their farthest receiver [m]: scales the density of suns.
    pub reach_m: f64,
}

impl Aim {
    /// Builds the item buffers of all lights. Nothing is looked for where no surface can receive light.
    pub fn take(tracer: &Tracer, item_buffer: ItemBufferKind) -> Self {
        let scene = tracer.scene();
        let of_kind = |wanted: fn(crate::scene::SurfaceKind) -> bool| -> Vec<usize> {
            (0..scene.objects.len())
                .filter(|&object| wanted(scene.material_of(object).surface))
                .collect()
        };
        let casters = of_kind(crate::scene::SurfaceKind::is_specular);
        let receivers = of_kind(crate::scene::SurfaceKind::is_receiver);
        let reach_m = reach_m(scene, &casters, &receivers);
        let mut aim = Self {
            lights: Vec::new(),
            casters: vec![None; scene.lights.len()],
            reach_m,
        };
        if casters.is_empty() || receivers.is_empty() {
            return aim;
        }
        for (light, source) in scene.lights.iter().enumerate() {
            let Some(launch) = Launch::new(&source.of_unit_strength(), scene, &casters, item_buffer) else {
                aim.casters[light] = Some(Vec::new());
                continue;
            };
            let item_buffer = ItemBuffer::build(&launch, tracer, &casters);
            aim.casters[light] = Some(item_buffer.casters.clone());
            if !item_buffer.casters.is_empty() {
                aim.lights.push(AimedLight {
                    light,
                    launch,
                    item_buffer,
                });
            }
        }
        aim
    }
}

fn bounds_of(scene: &Scene, objects: &[usize]) -> Option<(DVec3, DVec3)> {
    objects
        .iter()
        .filter_map(|&object| scene.objects[object].mesh.bounds())
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// At least the casters' own radius, so that it is never zero where they have a size.
fn reach_m(scene: &Scene, casters: &[usize], receivers: &[usize]) -> f64 {
    let Some((low, high)) = bounds_of(scene, casters) else {
        return 1.0;
    };
    let centre = low * 0.5 + high * 0.5;
    let own = (high - centre).length();
    let farthest = receivers
        .iter()
        .flat_map(|&object| &scene.objects[object].mesh.positions)
        .map(|position| position.distance(centre))
        .fold(own, f64::max);
    if farthest > 0.0 { farthest } else { 1.0 }
}
