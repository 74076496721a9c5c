//! A bake: scene and settings in, maps out. A [`Baker`] keeps its caches between bakes; the command line bakes once.

mod band_layers;
mod band_maps;
mod bundle_level;
mod caustic;
mod clock;
mod direct_cache;
mod direct_work;
mod finish;
mod first_look;
pub mod forecast;
mod goals;
mod indirect_cache;
mod indirect_work;
mod level_plan;
mod light_level;
mod map_plan;
mod map_size;
mod metric;
mod photon_level;
pub mod result;
mod scene_change;
pub mod shards;
mod showing;
mod sizes;
mod soft_light;
mod spectra;
mod splat_level;
pub mod survey;

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuilder};

pub use band_layers::BandLayer;
pub use forecast::{CostPoint, Forecast, ForecastReport};
pub use result::{Bake, BakeCounts, ItemBufferReport, LightLayer, StopReason, Timings};
pub use shards::{ShardSource, ShardSums};
pub use sizes::BYTES_PER_TEXEL;
pub use spectra::SpectralBand;
pub use survey::{PresetForecast, Survey};

use crate::effect::EffectSwitch;
use crate::error::{Error, Result};
use crate::light_pass::pass_report::Stopwatch;
use crate::light_pass::visibility::{CullMode, LightVisibility};
use crate::plan::{self, Effect, EffectPlan};
use crate::progress::{Control, Progress, Stage};
use crate::scene::Scene;
use crate::settings::{BakeSettings, ItemBufferKind};
use crate::transport::Tracer;
use caustic::{CausticLayer, CausticOutcome};
use clock::Clock;
use direct_cache::DirectCache;
use direct_work::DirectWork;
use finish::{CompletedLevel, DirectDetail, MapAssembler};
use first_look::FirstLook;
use indirect_cache::IndirectCache;
use light_level::LightStates;
use scene_change::SceneChange;
use shards::ShardRole;
use showing::{LevelCallback, Showing};
use sizes::ChartCache;
use spectra::Spectra;

/// Owns a scene and everything derived from it, and bakes it again whenever scene or settings change. What a change
/// does not affect is kept: hierarchy, parametrisations, item buffers, squares and bundles, maps and their errors.
#[derive(Debug)]
pub struct Baker {
    scene: Arc<Scene>,
    tracer: Option<Arc<Tracer>>,
    visibility: Option<(VisibilityKey, Arc<LightVisibility>)>,
    sizes: ChartCache,
    lights: LightStates,
    direct: DirectCache,
    indirect: IndirectCache,
    threads: Threads,
}

/// What a [`LightVisibility`] depends on besides the scene: the kind of item buffer, what is culled, and whether lights
/// have an extent.
type VisibilityKey = (ItemBufferKind, CullMode, bool);

fn visibility_key(settings: &BakeSettings) -> VisibilityKey {
    let mode = match settings.effects.get(Effect::LightPass) {
        EffectSwitch::On => CullMode::Everything,
        EffectSwitch::Auto | EffectSwitch::Off => CullMode::Reachable,
    };
    let sizes = settings.effects.get(Effect::AreaLights) != EffectSwitch::Off;
    (settings.item_buffer, mode, sizes)
}

/// What `inspect` reports before any bake.
#[derive(Clone, Debug)]
pub struct BakeEstimate {
    /// Effects that are on, and why.
    pub plan: EffectPlan,
    /// Upper bound of the light rays of the caustic layer.
    pub rays: u64,
    /// Marked cells of all item buffers.
    pub item_buffer_cells: u64,
}

impl Baker {
    /// A baker of a scene; builds nothing yet.
    ///
    /// # Errors
    /// More triangles than the hierarchy can count.
    pub fn new(scene: impl Into<Arc<Scene>>) -> Result<Self> {
        let scene = scene.into();
        if u32::try_from(scene.triangle_count()).is_err() {
            return Err(Error::failure(
                &scene.source,
                format!("it has {} triangles, 2^32 are too many", scene.triangle_count()),
                "simplify its meshes",
            ));
        }
        let sizes = ChartCache::new(scene.clone());
        Ok(Self {
            scene,
            tracer: None,
            visibility: None,
            sizes,
            lights: LightStates::default(),
            direct: DirectCache::default(),
            indirect: IndirectCache::default(),
            threads: Threads::default(),
        })
    }

    /// Calls a function at the start of each of its threads.
    #[must_use]
    pub fn with_thread_start(mut self, start: fn()) -> Self {
        self.threads.start = Some(start);
        self
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Switches to another scene, usually an edited copy, and keeps what the edit does not affect. Strength and colour
    /// of a light affect nothing: they scale its maps.
    ///
    /// # Errors
    /// As [`Self::new`]; the baker then keeps its scene.
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()> {
        match SceneChange::between(&self.scene, &scene) {
            Some(change) => self.edit(scene, &change),
            None => {
                let threads = self.threads.clone();
                *self = Self {
                    threads,
                    ..Self::new(scene)?
                };
            }
        }
        Ok(())
    }

    fn edit(&mut self, scene: Arc<Scene>, change: &SceneChange) {
        // The hierarchy and the charts of unchanged shapes are carried over.
        self.tracer = self
            .tracer
            .take()
            .map(|tracer| Arc::new(tracer.edited(scene.clone())));
        let sizes = std::mem::replace(&mut self.sizes, ChartCache::new(scene.clone()));
        self.sizes = sizes.edited(scene.clone(), &change.shapes);

        // Each cache is dropped after the kinds of change that it depends on.
        let is_other = change.moves_paths() || !change.shares.is_empty();
        if change.moves_shadows {
            self.direct.clear();
            self.sizes.forget_borders(None);
        }
        if is_other {
            self.indirect.clear();
            self.lights.statistics = None;
        }
        if change.moves_paths() || !change.lights.is_empty() {
            self.visibility = None;
        }

        // Light whose paths never came near the change keeps its maps.
        let changed = change.boxes(&self.scene, &scene);
        for state in self.lights.iter_mut() {
            let is_beyond = |changed: &Vec<_>| state.is_beyond(changed, &self.scene);
            if is_other && !changed.as_ref().is_some_and(is_beyond) {
                state.forget_maps();
            }
        }

        // Lights that moved or shine otherwise lose everything.
        for &light in &change.lights {
            self.lights.forget(light);
            self.direct.forget(light);
            self.sizes.forget_borders(Some(light));
        }
        self.scene = scene;
    }

    /// The scene with its hierarchy, built on first use.
    pub fn tracer(&mut self) -> Arc<Tracer> {
        self.tracer
            .get_or_insert_with(|| Arc::new(Tracer::new(self.scene.clone())))
            .clone()
    }

    /// The effects that the scene needs under these settings.
    ///
    /// # Errors
    /// Settings outside their ranges.
    pub fn plan(&mut self, settings: &BakeSettings) -> Result<EffectPlan> {
        Ok(self.estimate(settings)?.plan)
    }

    /// The plan, and the work of a bake.
    ///
    /// # Errors
    /// Settings outside their ranges.
    pub fn estimate(&mut self, settings: &BakeSettings) -> Result<BakeEstimate> {
        settings.validate()?;
        let visibility = self.visibility(settings);
        let plan = plan::decide(&self.scene, settings, &visibility.reaches);
        let mut estimate = BakeEstimate {
            plan,
            rays: 0,
            item_buffer_cells: 0,
        };
        if estimate.plan.is_on(Effect::LightPass) {
            for light in &visibility.lights {
                let size = light.launch.lattice_size(settings.density_per_sr, light.reach_m);
                estimate.rays += light.item_buffer.lattice_cells(light.launch.face_count(), size);
                estimate.item_buffer_cells += light.item_buffer.marked_cells();
            }
        }
        Ok(estimate)
    }

    /// Bakes. A cancelled bake returns what it has, marked partial.
    ///
    /// # Errors
    /// Settings outside their ranges; threads that cannot be started.
    pub fn bake(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
    ) -> Result<Bake> {
        self.bake_on_threads(settings, progress, control, None)
    }

    /// Bakes like [`Self::bake`], and passes complete maps of rising quality to `level` on the way. The final maps are
    /// returned, not passed.
    ///
    /// # Errors
    /// As [`Self::bake`].
    pub fn bake_levels(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: &mut (dyn FnMut(Bake) + Send),
    ) -> Result<Bake> {
        self.bake_on_threads(settings, progress, control, Some(level))
    }

    fn bake_on_threads(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: Option<&mut LevelCallback>,
    ) -> Result<Bake> {
        settings.validate()?;
        self.threads
            .of(settings)?
            .install(|| self.bake_here(settings, progress, control, level, &mut ShardRole::Alone))
    }

    fn visibility(&mut self, settings: &BakeSettings) -> Arc<LightVisibility> {
        if !plan::wants_caustics(settings) {
            // No caustic layer requested: skip the item buffers.
            return Arc::default();
        }
        let wanted = visibility_key(settings);
        match &self.visibility {
            Some((known, visibility)) if *known == wanted => visibility.clone(),
            _ => {
                let (kind, culling, sizes) = wanted;
                let visibility = Arc::new(LightVisibility::take(&self.tracer(), kind, culling, sizes));
                self.visibility = Some((wanted, visibility.clone()));
                visibility
            }
        }
    }

    /// Prepares a bake.
    fn prepare<'a>(
        &mut self,
        settings: &'a BakeSettings,
        progress: &'a dyn Progress,
        control: &'a Control,
        (clock, began): (&mut Clock, Instant),
    ) -> PreparedBake<'a> {
        progress.advance(Stage::Build, 0, 1);
        let tracer = clock.time(|clock| &mut clock.build, || self.tracer());
        progress.advance(Stage::Plan, 0, 1);
        let known = self.visibility.as_ref().map(|(_, known)| Arc::clone(known));
        let visibility = clock.time(|clock| &mut clock.plan, || self.visibility(settings));
        let is_new = known.is_none_or(|known| !Arc::ptr_eq(&known, &visibility));
        PreparedBake {
            plan: plan::decide(&self.scene, settings, &visibility.reaches),
            item_buffer_tests: if is_new { visibility.tests() } else { 0 },
            tracer,
            visibility,
            settings,
            progress,
            control,
            began,
        }
    }

    /// Shows direct and indirect light before item buffers are built, unless maps were shown before.
    fn first_look(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        (level, clock): (&mut Option<&mut LevelCallback>, &mut Clock),
    ) -> Option<FirstLook> {
        let is_new = self.lights.is_empty() && self.direct.is_empty();
        let level = level.as_mut().filter(|_| is_new)?;
        progress.advance(Stage::Build, 0, 1);
        let tracer = clock.time(|clock| &mut clock.build, || self.tracer());
        let plan = plan::decide(&self.scene, settings, &[]);
        let finish = MapAssembler {
            scene: &self.scene,
            sizes: &self.sizes,
            settings,
            plan: &plan,
            direct: DirectDetail::of(&plan, settings),
        };
        let mut look = FirstLook::default();
        let maps = look.maps(&finish, &tracer, &[], progress, control);
        let mut result = finish.result(maps, &[], &CausticOutcome::default());
        // The plan is not known before item buffers are built.
        result.plan = EffectPlan::default();
        if !result.maps.is_empty() {
            level(result);
        }
        Some(look)
    }

    fn bake_here(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: Option<&mut LevelCallback>,
        role: &mut ShardRole,
    ) -> Result<Bake> {
        // The first bake of a scene shows direct and indirect light before item buffers are built.
        let (whole, began) = (Stopwatch::start(), Instant::now());
        let mut clock = Clock::default();
        let mut level = level;
        let first_look = self.first_look(settings, progress, control, (&mut level, &mut clock));
        let ground = self.prepare(settings, progress, control, (&mut clock, began));

        // Shadow borders of direct light are sought before caustics fix the sizes of their maps, which hold both.
        let finish = MapAssembler {
            scene: &self.scene,
            sizes: &self.sizes,
            settings,
            plan: &ground.plan,
            direct: DirectDetail::of(&ground.plan, settings),
        };
        self.direct.begin(settings);
        let mut lamps = DirectWork::default();
        if ground.plan.is_on(Effect::Direct) {
            lamps.look_for_borders(&ground.tracer, &self.sizes, settings, control);
        }

        // The caustic layer, level by level; each is shown with the other layers as far as they are known.
        let mut showing = Showing {
            for_direct: &limited(control, finish.direct.limit_s(settings), began),
            finish: &finish,
            bake: &ground,
            watch: &whole,
            level,
            direct: &mut self.direct,
            indirect: &mut self.indirect,
            lamps,
            is_first: true,
            first_look,
            glance: None,
        };
        let lights = &mut self.lights;
        let mut outcome = ground.bake(&self.sizes, lights, &mut clock, role, Some(&mut showing))?;

        // Charts of lit maps are those of their levels. Maps of direct and indirect light alone join them.
        let finished: Vec<CompletedLevel> = outcome
            .finished
            .iter()
            .filter_map(|&light| Some((light, lights.finest(light)?)))
            .collect();
        let (charts, memory_warning) = finish.charts(&finished);
        outcome.warnings.extend(memory_warning);
        showing.complete_direct(&charts, &mut outcome);

        // The flux of lights at unit strength becomes irradiance at their own strengths.
        let watch = Stopwatch::start();
        let mut maps = finish.maps(&finished, &charts, showing.direct);
        clock.deposit.add(watch.elapsed());

        // Indirect light is gathered from the finished layers.
        let mut outcome = showing.with_direct(&outcome);
        if ground.plan.is_on(Effect::Indirect) {
            showing.gather_indirect(&mut maps, &finished, &mut outcome, &mut clock);
        }

        // Intermediate maps went to the callback; the finished ones are returned, with the cost of all stages.
        Ok(showing.assembled(maps, &finished, &outcome, &mut clock))
    }
}

/// Cancellation by the user, or by a time limit since the bake began [s].
fn limited(control: &Control, limit_s: Option<f64>, began: Instant) -> Control {
    match limit_s {
        Some(limit_s) => control.with_deadline(began + Duration::from_secs_f64(limit_s)),
        None => control.without_deadline(),
    }
}

/// Thread pool of the last bake, kept for the next one.
#[derive(Clone, Debug, Default)]
struct Threads {
    /// With the number of threads that was asked for.
    pool: Option<(usize, Arc<ThreadPool>)>,
    /// What each thread does first.
    start: Option<fn()>,
}

impl Threads {
    /// A pool of as many threads as the settings ask for.
    fn of(&mut self, settings: &BakeSettings) -> Result<Arc<ThreadPool>> {
        match &self.pool {
            Some((count, pool)) if *count == settings.threads => Ok(Arc::clone(pool)),
            _ => {
                let start = self.start;
                let builder = ThreadPoolBuilder::new()
                    .num_threads(settings.threads)
                    .start_handler(move |_| {
                        if let Some(start) = start {
                            start();
                        }
                    });
                let pool = builder.build().map_err(|error| {
                    Error::failure("--threads", error.to_string(), "ask for fewer threads")
                })?;
                let pool = Arc::new(pool);
                self.pool = Some((settings.threads, Arc::clone(&pool)));
                Ok(pool)
            }
        }
    }
}

/// What every bake starts from: the prepared scene and the plan.
struct PreparedBake<'a> {
    tracer: Arc<Tracer>,
    visibility: Arc<LightVisibility>,
    plan: EffectPlan,
    /// Tests of the item buffers, if this bake built them.
    item_buffer_tests: u64,
    settings: &'a BakeSettings,
    progress: &'a dyn Progress,
    control: &'a Control,
    /// Start of the bake.
    began: Instant,
}

impl PreparedBake<'_> {
    /// Bakes the caustic layer, if the plan has one.
    fn bake(
        &self,
        sizes: &ChartCache,
        lights: &mut LightStates,
        clock: &mut Clock,
        role: &mut ShardRole,
        showing: Option<&mut Showing>,
    ) -> Result<CausticOutcome> {
        if !self.plan.is_on(Effect::LightPass) {
            return Ok(CausticOutcome::default());
        }
        let smooth = (!self.plan.is_on(Effect::Bumps)).then(|| self.tracer.without_bumps());
        let seen = smooth.as_ref().unwrap_or(&self.tracer);
        let layer = CausticLayer {
            tracer: seen,
            spectra: &Spectra::new(seen, &self.visibility, &self.plan, self.settings)?,
            visibility: &self.visibility,
            settings: self.settings,
            sizes,
            plan: &self.plan,
            progress: self.progress,
            control: self.control,
            began: self.began,
        };
        layer.bake(lights, (clock, role), showing)
    }
}

/// Records times, and the cost of the item buffers, light by light.
fn account(result: &mut Bake, finish: &MapAssembler, visibility: &LightVisibility, clock: &Clock) {
    (result.timings_s, result.cpu_s) = clock.timings();
    let lights = finish.scene.lights.iter().zip(&visibility.item_buffers);
    let item_buffers = lights.map(|(light, stats)| ItemBufferReport {
        light: light.name.clone(),
        cells: stats.cells,
        hidden_cells: stats.hidden_cells,
        tests: stats.tests,
        cpu_ms: 1e3 * stats.seconds.cpu,
    });
    result.item_buffers = item_buffers.collect();
}
