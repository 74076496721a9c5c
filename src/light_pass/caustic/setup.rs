//! Looks around from every light, before any ray is traced.

use glam::DVec3;

use super::pass::{Seconds, Stopwatch};
use crate::light_pass::emitter::Emitter;
use crate::light_pass::item_buffer::{Hiding, ItemBuffer};
use crate::light_pass::launch::Launch;
use crate::plan::{Reach, Sight};
use crate::scene::{Scene, SurfaceKind};
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
    /// Where light can matter, if less than that.
    visible: Option<ItemBuffer>,
    /// Distance from the casters' centre to their farthest receiver [m]: scales the density of suns.
    pub reach_m: f64,
}

impl AimedLight {
    /// Where light can matter: the item buffer, or less where everything is aimed at.
    pub fn visible(&self) -> &ItemBuffer {
        self.visible.as_ref().unwrap_or(&self.item_buffer)
    }
}

/// How thoroughly what cannot matter is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aiming {
    /// Specular objects that are sealed off, hidden, or can send no light to a diffuse one are left out.
    Reachable,
    /// Everything specular is aimed at.
    Everything,
}

/// What it took to look around from one light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LookAround {
    /// Marked cells of the item buffer.
    pub cells: u64,
    /// Cells that opaque faces cover.
    pub hidden_cells: u64,
    /// Nodes, triangles and cells that were tested.
    pub tests: u64,
    /// Wall-clock and CPU seconds.
    pub seconds: Seconds,
}

/// What all lights see.
#[derive(Debug, Default)]
pub struct Aim {
    /// Lights with at least one marked cell.
    pub lights: Vec<AimedLight>,
    /// What each light of the scene sees.
    pub sights: Vec<Sight>,
    /// What that took, light by light.
    pub looks: Vec<LookAround>,
}

impl Aim {
    /// Builds the item buffers of all lights that something specular could call for.
    pub fn take(tracer: &Tracer, item_buffer: ItemBufferKind, aiming: Aiming) -> Self {
        let scene = tracer.scene();
        let has = |wanted: fn(SurfaceKind) -> bool| {
            (0..scene.objects.len()).any(|object| wanted(scene.material_of(object).surface))
        };
        let mut aim = Self::default();
        if !has(SurfaceKind::is_specular) || !has(SurfaceKind::is_receiver) {
            aim.sights = vec![Sight::default(); scene.lights.len()];
            aim.looks = vec![LookAround::default(); scene.lights.len()];
            return aim;
        }
        let looker = Looker {
            tracer,
            item_buffer,
            aiming,
            reach: Reach::of(scene),
        };
        for light in 0..scene.lights.len() {
            let watch = Stopwatch::start();
            let (sight, aimed, mut look) = looker.look(light);
            look.seconds = watch.elapsed();
            aim.sights.push(sight);
            aim.looks.push(look);
            aim.lights.extend(aimed);
        }
        aim
    }
}

impl Aim {
    /// Nodes, triangles and cells that were tested for all lights.
    pub fn tests(&self) -> u64 {
        self.looks.iter().map(|look| look.tests).sum()
    }
}

struct Looker<'a> {
    tracer: &'a Tracer,
    item_buffer: ItemBufferKind,
    aiming: Aiming,
    reach: Reach<'a>,
}

impl Looker<'_> {
    fn look(&self, light: usize) -> (Sight, Option<AimedLight>, LookAround) {
        let casters = self.reach.casters(light);
        let mut look = LookAround::default();
        let visible = self.visible(light, &casters, &mut look);
        match self.aiming {
            Aiming::Reachable => self.at_reachable(light, casters.len(), visible, look),
            Aiming::Everything => self.at_everything(light, visible, look),
        }
    }

    fn at_reachable(
        &self,
        light: usize,
        casters: usize,
        visible: Option<(Launch, ItemBuffer)>,
        mut look: LookAround,
    ) -> (Sight, Option<AimedLight>, LookAround) {
        let mut sight = Sight {
            unsealed: self.reach.unsealed(light).len(),
            casters,
            ..Sight::default()
        };
        let Some((launch, item_buffer)) = visible else {
            return (sight, None, look);
        };
        sight.seen.clone_from(&item_buffer.casters);
        sight.hidden_cells = item_buffer.hidden_cells;
        sight.reached = self.reach.reached(light, &sight.seen);
        look.cells = item_buffer.marked_cells();
        look.hidden_cells = item_buffer.hidden_cells;
        let aimed = (!sight.seen.is_empty()).then(|| AimedLight {
            light,
            reach_m: reach_m(self.tracer.scene(), &sight.seen),
            launch,
            item_buffer,
            visible: None,
        });
        (sight, aimed, look)
    }

    /// Rays start from the same lattice, so that its maps are the same; more of its cells are traced.
    fn at_everything(
        &self,
        light: usize,
        visible: Option<(Launch, ItemBuffer)>,
        mut look: LookAround,
    ) -> (Sight, Option<AimedLight>, LookAround) {
        let scene = self.tracer.scene();
        let specular: Vec<usize> = (0..scene.objects.len())
            .filter(|&object| scene.material_of(object).surface.is_specular())
            .collect();
        let mut sight = Sight {
            unsealed: specular.len(),
            casters: specular.len(),
            reached: specular.iter().map(|&object| (object, None)).collect(),
            ..Sight::default()
        };
        let visible = visible.filter(|(_, visible)| !visible.casters.is_empty());
        let (launch, visible) = match visible {
            Some((launch, visible)) => (Some(launch), Some(visible)),
            None => (self.launch(light, &specular), None),
        };
        let Some(launch) = launch else {
            return (sight, None, look);
        };
        let item_buffer = ItemBuffer::build(&launch, self.tracer, &specular, Hiding::Keep);
        look.tests += item_buffer.tests;
        look.cells = item_buffer.marked_cells();
        sight.seen.clone_from(&item_buffer.casters);
        let near = visible.as_ref().map_or(&sight.seen, |visible| &visible.casters);
        let reach_m = reach_m(scene, near);
        if sight.seen.is_empty() {
            return (sight, None, look);
        }
        let aimed = AimedLight {
            light,
            reach_m,
            launch,
            item_buffer,
            visible,
        };
        (sight, Some(aimed), look)
    }

    fn launch(&self, light: usize, casters: &[usize]) -> Option<Launch> {
        let scene = self.tracer.scene();
        let emitter = Emitter::middle(&scene.lights[light].of_unit_strength(), scene)?;
        Launch::new(emitter, scene, casters, self.item_buffer)
    }

    /// Where light can matter; `None` where nothing could be aimed at.
    fn visible(
        &self,
        light: usize,
        casters: &[usize],
        look: &mut LookAround,
    ) -> Option<(Launch, ItemBuffer)> {
        let mut build = |casters: &[usize]| {
            if casters.is_empty() {
                return None;
            }
            let launch = self.launch(light, casters)?;
            let item_buffer = ItemBuffer::build(&launch, self.tracer, casters, Hiding::Drop);
            look.tests += item_buffer.tests;
            Some((launch, item_buffer))
        };
        let (launch, item_buffer) = build(casters)?;
        // What a sun does not see is to have no part in its rectangle.
        let is_smaller = launch.is_fitted() && item_buffer.casters.len() < casters.len();
        let smaller = if is_smaller {
            build(&item_buffer.casters)
        } else {
            None
        };
        Some(smaller.unwrap_or((launch, item_buffer)))
    }
}

fn bounds_of(scene: &Scene, objects: &[usize]) -> Option<(DVec3, DVec3)> {
    objects
        .iter()
        .filter_map(|&object| scene.objects[object].mesh.bounds())
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// At least the casters' own radius, so that it is never zero where they have a size.
fn reach_m(scene: &Scene, casters: &[usize]) -> f64 {
    let Some((low, high)) = bounds_of(scene, casters) else {
        return 1.0;
    };
    let centre = low * 0.5 + high * 0.5;
    let own = (high - centre).length();
    let farthest = (0..scene.objects.len())
        .filter(|&object| scene.material_of(object).surface.is_receiver())
        .flat_map(|object| &scene.objects[object].mesh.positions)
        .map(|position| position.distance(centre))
        .fold(own, f64::max);
    if farthest > 0.0 { farthest } else { 1.0 }
}
