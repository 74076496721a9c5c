//! A bake as a session: scene and settings in, maps out. The command line's `bake` is a session that runs once.

mod caustic;
mod direct_cache;
mod finish;
mod level_plan;
mod light_level;
pub mod result;
mod scene_change;
mod sizes;
mod splat_level;
mod wavefront_level;

use std::sync::Arc;
use std::time::Instant;

pub use result::{BakeCounts, BakeResult, EffectCounts, EffectReport, StopReason, Timings};

use crate::error::{Error, Result};
use crate::light_pass::caustic::pass::{Seconds, Stopwatch};
use crate::light_pass::caustic::setup::Aim;
use crate::plan::{self, Effect, EffectPlan};
use crate::progress::{Control, Progress, Stage};
use crate::scene::Scene;
use crate::settings::{BakeSettings, ItemBufferKind};
use crate::transport::Tracer;
use caustic::{CausticLayer, CausticOutcome, Stopped};
use direct_cache::DirectCache;
use finish::{Finish, Shown};
use light_level::LightStates;
use scene_change::SceneChange;
use sizes::MapSizes;

/// Owns a scene with all that is derived from it, and bakes it as often as scene or settings change. What a change does
/// not touch is kept: hierarchy, parametrisations, item buffers, what rays met, patches, maps, and their errors.
#[derive(Debug)]
pub struct BakeSession {
    scene: Arc<Scene>,
    tracer: Option<Arc<Tracer>>,
    aim: Option<(ItemBufferKind, Arc<Aim>)>,
    sizes: MapSizes,
    lights: LightStates,
    direct: DirectCache,
}

/// What `inspect` says before any bake.
#[derive(Clone, Debug)]
pub struct BakeEstimate {
    /// Which effects are on, and why.
    pub plan: EffectPlan,
    /// Upper bound of the light rays of the caustic layer.
    pub rays: u64,
    /// Marked cells of all item buffers.
    pub item_buffer_cells: u64,
}

impl BakeSession {
    /// A session on a scene; builds nothing yet.
    ///
    /// # Errors
    /// More triangles than the hierarchy can count.
    pub fn new(scene: Arc<Scene>) -> Result<Self> {
        if u32::try_from(scene.triangle_count()).is_err() {
            return Err(Error::failure(
                &scene.source,
                format!("it has {} triangles, 2^32 are too many", scene.triangle_count()),
                "simplify its meshes",
            ));
        }
        let sizes = MapSizes::new(scene.clone());
        Ok(Self {
            scene,
            tracer: None,
            aim: None,
            sizes,
            lights: LightStates::default(),
            direct: DirectCache::default(),
        })
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Goes on with another scene, an edited one as a rule: what the difference does not touch is kept. Another strength
    /// or colour of a light touches nothing: it is a scale of its maps.
    ///
    /// # Errors
    /// As [`Self::new`]; the session then keeps its scene.
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()> {
        match SceneChange::between(&self.scene, &scene) {
            Some(change) => self.edit(scene, &change),
            None => *self = Self::new(scene)?,
        }
        Ok(())
    }

    fn edit(&mut self, scene: Arc<Scene>, change: &SceneChange) {
        self.tracer = self
            .tracer
            .take()
            .map(|tracer| Arc::new(tracer.edited(scene.clone())));
        let sizes = std::mem::replace(&mut self.sizes, MapSizes::new(scene.clone()));
        self.sizes = sizes.edited(scene.clone(), &change.shapes);
        if change.moves_paths() || change.shares {
            self.direct.clear();
            self.lights.statistics = None;
        }
        if change.moves_paths() || !change.lights.is_empty() {
            self.aim = None;
        }
        for state in self.lights.iter_mut() {
            if change.moves_paths() || change.shares {
                state.forget_maps();
            }
            if change.moves_paths() {
                state.rays.begin_edit();
            }
            for &object in &change.shapes {
                let nowhere = (glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY);
                let bounds = scene.objects[object].mesh.bounds().unwrap_or(nowhere);
                state.rays.shape_changed(object, bounds);
            }
            for &object in &change.directions {
                state.rays.material_changed(object);
            }
        }
        for &light in &change.lights {
            self.lights.forget(light);
            self.direct.forget(light);
        }
        self.scene = scene;
    }

    /// The scene with its hierarchy, built on first use.
    pub fn tracer(&mut self) -> Arc<Tracer> {
        self.tracer
            .get_or_insert_with(|| Arc::new(Tracer::new(self.scene.clone())))
            .clone()
    }

    /// Which effects the scene calls for under these settings.
    ///
    /// # Errors
    /// Settings outside their ranges.
    pub fn plan(&mut self, settings: &BakeSettings) -> Result<EffectPlan> {
        Ok(self.estimate(settings)?.plan)
    }

    /// The plan and what a bake would take.
    ///
    /// # Errors
    /// Settings outside their ranges.
    pub fn estimate(&mut self, settings: &BakeSettings) -> Result<BakeEstimate> {
        settings.validate()?;
        let aim = self.aim(settings.item_buffer);
        let plan = plan::decide(&self.scene, settings, &aim.casters);
        let mut estimate = BakeEstimate {
            plan,
            rays: 0,
            item_buffer_cells: 0,
        };
        if estimate.plan.is_on(Effect::LightPass) {
            for light in &aim.lights {
                let size = light.launch.lattice_size(settings.density_per_sr, aim.reach_m);
                estimate.rays += light.item_buffer.lattice_cells(light.launch.face_count(), size);
                estimate.item_buffer_cells += light.item_buffer.marked_cells();
            }
        }
        Ok(estimate)
    }

    /// Bakes. Cancelled bakes return what they have, marked partial.
    ///
    /// # Errors
    /// Settings outside their ranges; maps that do not fit into the memory limit; no threads to be had.
    pub fn bake(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
    ) -> Result<BakeResult> {
        self.bake_on_threads(settings, progress, control, None)
    }

    /// Bakes like [`Self::bake`] and hands out whole maps of lower quality on the way, from the coarsest on; each is
    /// better than the one before. The last is returned, not handed out.
    ///
    /// # Errors
    /// As [`Self::bake`].
    pub fn bake_levels(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: &mut (dyn FnMut(BakeResult) + Send),
    ) -> Result<BakeResult> {
        self.bake_on_threads(settings, progress, control, Some(level))
    }

    fn bake_on_threads(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: Option<&mut (dyn FnMut(BakeResult) + Send)>,
    ) -> Result<BakeResult> {
        settings.validate()?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(settings.threads)
            .build()
            .map_err(|error| Error::failure("--threads", error.to_string(), "ask for fewer threads"))?;
        pool.install(|| self.bake_here(settings, progress, control, level))
    }

    fn aim(&mut self, kind: ItemBufferKind) -> Arc<Aim> {
        match &self.aim {
            Some((cached, aim)) if *cached == kind => aim.clone(),
            _ => {
                let aim = Arc::new(Aim::take(&self.tracer(), kind));
                self.aim = Some((kind, aim.clone()));
                aim
            }
        }
    }

    fn bake_here(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        mut level: Option<&mut (dyn FnMut(BakeResult) + Send)>,
    ) -> Result<BakeResult> {
        let whole = Stopwatch::start();
        let mut clock = Clock::default();
        progress.advance(Stage::Build, 0, 1);
        let tracer = clock.time(|clock| &mut clock.build, || self.tracer());
        let began = Instant::now();
        progress.advance(Stage::Plan, 0, 1);
        let aim = clock.time(|clock| &mut clock.plan, || self.aim(settings.item_buffer));
        let plan = plan::decide(&self.scene, settings, &aim.casters);
        let finish = Finish {
            scene: &self.scene,
            sizes: &self.sizes,
            settings,
            plan: &plan,
        };
        let (lights, direct) = (&mut self.lights, &mut self.direct);
        let mut outcome = CausticOutcome::default();
        if plan.is_on(Effect::LightPass) {
            let layer = CausticLayer {
                tracer: &tracer,
                aim: &aim,
                settings,
                sizes: &self.sizes,
                plan: &plan,
                progress,
                control,
                began,
            };
            let mut is_first = true;
            outcome = layer.bake(lights, &mut clock, &mut |levels, counts, clock| {
                let Some(level) = &mut level else {
                    return Ok(());
                };
                let mut so_far = CausticOutcome {
                    counts,
                    ..CausticOutcome::default()
                };
                let charts = finish.charts(levels)?;
                // The first picture is to come soon: direct light follows with the second.
                let waits =
                    std::mem::take(&mut is_first) && !direct.knows(finish.scene.lights.len(), &charts);
                if !waits && plan.is_on(Effect::Direct) {
                    let watch = Stopwatch::start();
                    let report = direct.complete(&tracer, &charts, progress, control);
                    so_far.counts.shadow_rays += report.shadow_rays;
                    clock.trace.add(watch.elapsed());
                }
                let mut result = finish.run(levels, &charts, direct, &so_far);
                clock.total = whole.elapsed();
                (result.timings_s, result.cpu_s) = clock.timings();
                level(result);
                Ok(())
            })?;
        }
        let finished: Vec<Shown> = outcome
            .finished
            .iter()
            .filter_map(|&light| Some((light, lights.finest(light)?)))
            .collect();
        let charts = finish.charts(&finished)?;
        if plan.is_on(Effect::Direct) {
            let watch = Stopwatch::start();
            let report = direct.complete(&tracer, &charts, progress, control);
            outcome.counts.shadow_rays += report.shadow_rays;
            if !report.complete {
                outcome.stopped = Some(Stopped::Cancelled);
            }
            clock.trace.add(watch.elapsed());
        }
        let watch = Stopwatch::start();
        let mut result = finish.run(&finished, &charts, direct, &outcome);
        clock.deposit.add(watch.elapsed());
        clock.total = whole.elapsed();
        (result.timings_s, result.cpu_s) = clock.timings();
        Ok(result)
    }
}

/// Both clocks of every stage.
#[derive(Clone, Copy, Debug, Default)]
struct Clock {
    build: Seconds,
    plan: Seconds,
    trace: Seconds,
    deposit: Seconds,
    total: Seconds,
}

impl Clock {
    fn time<T>(&mut self, stage: impl Fn(&mut Self) -> &mut Seconds, work: impl FnOnce() -> T) -> T {
        let watch = Stopwatch::start();
        let done = work();
        stage(self).add(watch.elapsed());
        done
    }

    fn timings(&self) -> (Timings, Timings) {
        let of = |pick: fn(Seconds) -> f64| Timings {
            load: 0.0,
            build: pick(self.build),
            plan: pick(self.plan),
            trace: pick(self.trace),
            deposit: pick(self.deposit),
            total: pick(self.total),
        };
        (of(|seconds| seconds.wall), of(|seconds| seconds.cpu))
    }
}
