//! A bake as a session: scene and settings in, maps out. The command line's `bake` is a session that runs once.

mod caustic_layer;
mod finish;
pub mod result;
mod sizes;
mod splat_cache;
mod wavefront_cache;
mod wavefront_layer;

use std::sync::Arc;

pub use result::{BakeCounts, BakeResult, StopReason, Timings};

use crate::error::{Error, Result};
use crate::light_pass::caustic::pass::{Seconds, Stopwatch};
use crate::light_pass::caustic::setup::Aim;
use crate::plan::{self, Effect, EffectPlan};
use crate::progress::{Control, Progress, Stage};
use crate::scene::Scene;
use crate::settings::{BakeSettings, Estimator, ItemBufferKind};
use crate::transport::Tracer;
use caustic_layer::CausticLayer;
use sizes::MapSizes;
use splat_cache::SplatCache;
use wavefront_cache::WavefrontCache;

/// Owns a scene with all that is derived from it, and bakes it as often as settings change. What does not depend on
/// the settings (hierarchy, parametrisations, item buffers) is kept from bake to bake.
#[derive(Debug)]
pub struct BakeSession {
    scene: Arc<Scene>,
    tracer: Option<Arc<Tracer>>,
    aim: Option<(ItemBufferKind, Arc<Aim>)>,
    sizes: MapSizes,
    wavefront_cache: WavefrontCache,
    splat_cache: SplatCache,
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
            wavefront_cache: WavefrontCache::default(),
            splat_cache: SplatCache::default(),
        })
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Goes on with another scene, an edited one as a rule: what the difference does not touch is kept.
    ///
    /// # Errors
    /// As [`Self::new`]; the session then keeps its scene.
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()> {
        if !Arc::ptr_eq(&self.scene, &scene) {
            *self = Self::new(scene)?;
        }
        Ok(())
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
        settings.validate()?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(settings.threads)
            .build()
            .map_err(|error| Error::failure("--threads", error.to_string(), "ask for fewer threads"))?;
        pool.install(|| self.bake_here(settings, progress, control))
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
        _level: &mut dyn FnMut(BakeResult),
    ) -> Result<BakeResult> {
        self.bake(settings, progress, control)
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
    ) -> Result<BakeResult> {
        let whole = Stopwatch::start();
        let mut clock = Clock::default();
        progress.advance(Stage::Build, 0, 1);
        let tracer = clock.time(|clock| &mut clock.build, || self.tracer());
        progress.advance(Stage::Plan, 0, 1);
        let aim = clock.time(|clock| &mut clock.plan, || self.aim(settings.item_buffer));
        let plan = plan::decide(&self.scene, settings, &aim.casters);

        let caustic = if plan.is_on(Effect::LightPass) {
            let layer = CausticLayer {
                tracer: &tracer,
                aim: &aim,
                settings,
                sizes: &self.sizes,
                plan: &plan,
            };
            match settings.estimator {
                Estimator::Wavefront => {
                    layer.bake_wavefront(progress, control, &mut clock, &mut self.wavefront_cache)?
                }
                Estimator::Splat => layer.bake(progress, control, &mut clock, &mut self.splat_cache)?,
            }
        } else {
            caustic_layer::CausticOutcome::default()
        };
        let result = finish::Finish {
            tracer: &tracer,
            sizes: &self.sizes,
            settings,
            plan,
            caustic,
        };
        let mut result = result.run(progress, control, &mut clock)?;
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
