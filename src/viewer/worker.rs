//! The baking thread: requests in, progress and maps of rising quality out. The window never waits for it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::background::{Wake, no_thread};
use crate::bake::{Bake, Baker, StopReason};
use crate::effect::{Effect, EffectSwitch};
use crate::error::Result;
use crate::illumination::difference::{Difference, difference};
use crate::progress::{Control, Progress, Stage};
use crate::scene::Scene;
use crate::settings::BakeSettings;

/// Interface of [`Baker`] that the worker uses; tests replace it.
pub trait LevelBaker {
    /// See [`Baker::set_scene`].
    ///
    /// # Errors
    /// As [`Baker::set_scene`].
    fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()>;

    /// See [`Baker::bake_levels`].
    ///
    /// # Errors
    /// As [`Baker::bake_levels`].
    fn bake_levels(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: &mut (dyn FnMut(Bake) + Send),
    ) -> Result<Bake>;
}

impl LevelBaker for Baker {
    fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()> {
        Self::set_scene(self, scene)
    }

    fn bake_levels(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: &mut (dyn FnMut(Bake) + Send),
    ) -> Result<Bake> {
        Self::bake_levels(self, settings, progress, control, level)
    }
}

#[derive(Clone, Debug, Default, PartialEq)]
pub enum BakeState {
    /// No bake was requested yet.
    #[default]
    Idle,
    /// A bake is running or about to start.
    Baking {
        stage: Stage,
        /// Completed fraction of the stage, [0, 1].
        fraction: f64,
        /// When the bake was requested.
        since: Instant,
    },
    /// The contribution of an effect is being computed; the maps match the last request.
    Comparing {
        /// The effect that is left out.
        effect: Effect,
        stage: Stage,
        /// Completed fraction of the stage, [0, 1].
        fraction: f64,
    },
    /// The maps match the last request.
    Done,
    /// Stopped by the user; the maps are those of an earlier bake.
    Cancelled,
    /// One sentence: what failed, where, what to do.
    Failed(String),
}

impl BakeState {
    /// Whether a bake is running or about to start.
    pub fn is_baking(&self) -> bool {
        matches!(self, Self::Baking { .. })
    }

    /// Whether anything is running, or about to start, that can be cancelled.
    pub fn is_working(&self) -> bool {
        matches!(self, Self::Baking { .. } | Self::Comparing { .. })
    }
}

/// What to bake.
#[derive(Clone, Debug)]
pub struct BakeRequest {
    pub scene: Arc<Scene>,
    pub settings: BakeSettings,
}

impl BakeRequest {
    /// A request with the settings that affect the bake: the switch for the eye's chains is reset.
    pub fn new(scene: Arc<Scene>, mut settings: BakeSettings) -> Self {
        settings.effects.set(Effect::Chains, EffectSwitch::Auto);
        Self { scene, settings }
    }

    /// Whether both request the same scene and the same settings.
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.scene, &other.scene) && self.settings == other.settings
    }

    /// Whether both request the same maps except for their accuracy.
    pub fn differs_in_accuracy_only(&self, other: &Self) -> bool {
        let accuracy_of_other = BakeSettings {
            density_per_sr: other.settings.density_per_sr,
            max_error: other.settings.max_error,
            max_time_s: other.settings.max_time_s,
            threads: other.settings.threads,
            memory_bytes: other.settings.memory_bytes,
            ..self.settings.clone()
        };
        Arc::ptr_eq(&self.scene, &other.scene) && accuracy_of_other == other.settings
    }
}

/// Complete maps of a level of the requested bake.
#[derive(Clone, Debug)]
pub struct BakedLevel {
    /// Number of the request, as returned by [`Worker::request`].
    pub serial: u64,
    pub request: BakeRequest,
    /// Counted from 1 within the request.
    pub level: u32,
    /// Whether these are the last maps of the bake.
    pub is_final: bool,
    pub result: Bake,
    /// Wall-clock time from the request to these maps [s].
    pub seconds: f64,
}

/// Contribution of an effect to the light of a scene.
#[derive(Clone, Debug)]
pub struct EffectDifference {
    pub effect: Effect,
    /// The bake that includes the effect.
    pub with: Arc<BakedLevel>,
    /// That bake minus the one without the effect, or one sentence on what failed.
    pub difference: std::result::Result<Difference, String>,
}

/// How long to wait for a cancelled bake to end.
const ENDS_WITHIN: Duration = Duration::from_millis(300);

/// Handle of the baking thread. Dropping it cancels the bake and waits briefly for the thread to end.
#[derive(Debug)]
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread. It calls `make_baker` with the scene of the first request, and again after a bake that
    /// panicked. Wakes the window when there is news, but not for mere progress.
    ///
    /// # Errors
    /// The system cannot create a thread.
    pub fn spawn<B: LevelBaker>(
        make_baker: impl Fn(Arc<Scene>) -> Result<B> + Send + 'static,
        wake: &Wake,
    ) -> Result<Self> {
        let shared = Arc::new(Shared {
            slot: Mutex::default(),
            news: Condvar::new(),
            wake: wake.clone(),
        });
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("baker".into())
            .spawn(move || serve(&of_thread, &make_baker))
            .map_err(|error| no_thread("baker", &error))?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Requests a bake, replaces pending requests and cancels what is running: none of its results are handed out any
    /// more. Returns the number of the request; numbers increase.
    pub fn request(&self, asked: BakeRequest) -> u64 {
        let mut slot = self.shared.lock();
        slot.serial += 1;
        let serial = slot.serial;
        self.shared.put(&mut slot, asked, BakePurpose::Maps { serial });
        serial
    }

    /// Starts to compute the contribution of an effect to a bake: the same is baked without it, by a [`Baker`] of its
    /// own. Replaces another comparison; any later request cancels it. Returns false while maps are being baked.
    pub fn compare(&self, effect: Effect, with: Arc<BakedLevel>) -> bool {
        let mut slot = self.shared.lock();
        if [&slot.waiting, &slot.running]
            .into_iter()
            .flatten()
            .any(|job| job.is_for_maps())
        {
            return false;
        }
        let mut asked = with.request.clone();
        asked.settings.effects.set(effect, EffectSwitch::Off);
        self.shared
            .put(&mut slot, asked, BakePurpose::EffectDifference { effect, with });
        true
    }

    /// Pauses the running bake for this time.
    pub fn hold(&self, time: Duration) {
        if let Some(running) = &self.shared.lock().running {
            running.control.hold(time);
        }
    }

    /// Tells the running bake not to hand out levels for this time.
    pub fn look_away(&self, time: Duration) {
        if let Some(running) = &self.shared.lock().running {
            running.control.look_away(time);
        }
    }

    /// Cancels what is running and what is waiting; unfinished maps are dropped.
    pub fn cancel(&self) {
        let mut slot = self.shared.lock();
        slot.cancel_running();
        let waiting = slot.waiting.take();
        if waiting.is_some_and(|job| job.is_for_maps()) && slot.running.is_none() {
            slot.settled = BakeState::Cancelled;
        }
    }

    pub fn state(&self) -> BakeState {
        let slot = self.shared.lock();
        let job = slot.waiting.as_ref().or(slot.running.as_ref());
        job.map_or_else(|| slot.settled.clone(), |job| job.state())
    }

    /// Takes the result of the last comparison; `None` if there is none or another request has come since.
    pub fn take_worth(&self) -> Option<EffectDifference> {
        self.shared.lock().worth.take()
    }

    /// Takes the newest complete maps; older ones are dropped.
    pub fn take_level(&self) -> Option<BakedLevel> {
        self.shared.lock().newest.take()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        let mut slot = self.shared.lock();
        slot.quit = true;
        slot.waiting = None;
        slot.cancel_running();
        drop(slot);
        self.shared.news.notify_all();
        let asked = Instant::now();
        let Some(thread) = self.thread.take() else { return };
        while !thread.is_finished() && asked.elapsed() < ENDS_WITHIN {
            std::thread::sleep(Duration::from_millis(2));
        }
        if thread.is_finished() && thread.join().is_err() {
            log::error!("the baking thread panicked");
        }
    }
}

#[derive(Debug)]
enum BakePurpose {
    /// For the window, under this request number.
    Maps { serial: u64 },
    /// For a comparison with the bake `with`.
    EffectDifference { effect: Effect, with: Arc<BakedLevel> },
}

/// One bake, waiting or running.
#[derive(Debug)]
struct Job {
    asked: BakeRequest,
    since: Instant,
    purpose: BakePurpose,
    control: Control,
    /// Current stage and its completed fraction.
    progress: Mutex<(Stage, f64)>,
}

impl Job {
    fn is_for_maps(&self) -> bool {
        matches!(self.purpose, BakePurpose::Maps { .. })
    }

    fn state(&self) -> BakeState {
        let (stage, fraction) = *self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        match self.purpose {
            BakePurpose::Maps { .. } => BakeState::Baking {
                stage,
                fraction,
                since: self.since,
            },
            BakePurpose::EffectDifference { effect, .. } => BakeState::Comparing {
                effect,
                stage,
                fraction,
            },
        }
    }
}

impl Progress for Job {
    fn advance(&self, stage: Stage, done: u64, total: u64) {
        let fraction = (done as f64 / total.max(1) as f64).clamp(0.0, 1.0);
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = (stage, fraction);
    }
}

/// State shared by both threads, under one lock.
#[derive(Debug, Default)]
struct Slot {
    /// Number of the newest request for maps.
    serial: u64,
    waiting: Option<Arc<Job>>,
    running: Option<Arc<Job>>,
    /// The state while no job is waiting or running.
    settled: BakeState,
    newest: Option<BakedLevel>,
    worth: Option<EffectDifference>,
    quit: bool,
}

impl Slot {
    fn cancel_running(&self) {
        if let Some(running) = &self.running {
            running.control.cancel();
        }
    }
}

#[derive(Debug)]
struct Shared {
    slot: Mutex<Slot>,
    news: Condvar,
    wake: Wake,
}

impl Shared {
    /// No code that can panic runs under the lock, so a poisoned lock still holds a valid slot.
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Replaces all jobs by a new one.
    fn put(&self, slot: &mut Slot, asked: BakeRequest, purpose: BakePurpose) {
        slot.cancel_running();
        slot.worth = None;
        slot.waiting = Some(Arc::new(Job {
            asked,
            since: Instant::now(),
            purpose,
            control: Control::default(),
            progress: Mutex::new((Stage::Build, 0.0)),
        }));
        self.news.notify_all();
    }

    /// Waits for a job and marks it as running; `None` when the thread is to end.
    fn next(&self) -> Option<Arc<Job>> {
        let mut slot = self.lock();
        while !slot.quit {
            if let Some(job) = slot.waiting.take() {
                slot.running = Some(Arc::clone(&job));
                return Some(job);
            }
            slot = self.news.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
        None
    }

    /// Hands complete maps to the window, unless a newer request has come.
    fn hand_out(&self, level: BakedLevel) {
        let mut slot = self.lock();
        if slot.serial == level.serial {
            slot.newest = Some(level);
            drop(slot);
            self.wake.wake();
        }
    }

    /// Ends the running job and updates the slot.
    fn end(&self, note: impl FnOnce(&mut Slot)) {
        let mut slot = self.lock();
        slot.running = None;
        note(&mut slot);
        drop(slot);
        self.wake.wake();
    }
}

/// Main loop of the baking thread.
fn serve<B: LevelBaker>(shared: &Shared, make_baker: &impl Fn(Arc<Scene>) -> Result<B>) {
    let mut baker = None;
    while let Some(job) = shared.next() {
        shared.wake.wake();
        match &job.purpose {
            BakePurpose::Maps { serial } => {
                let state = bake_in_levels(shared, &mut baker, make_baker, &job, *serial);
                shared.end(|slot| {
                    // The job finished before it noticed a newer request, which was itself cancelled.
                    let outdated = state == BakeState::Done && *serial != slot.serial;
                    slot.settled = if outdated { BakeState::Cancelled } else { state };
                });
            }
            BakePurpose::EffectDifference { effect, with } => {
                // The baker of the maps shown keeps its state.
                let outcome = bake(&mut None, make_baker, &job, &mut |_| ());
                // `is_cancelled` may block while the bake is paused, so it must not be called under the lock.
                let worth = worth(*effect, with, outcome).filter(|_| !job.control.is_cancelled());
                shared.end(|slot| slot.worth = worth);
            }
        }
    }
}

/// Bakes and hands out every level; returns the final state.
fn bake_in_levels<B: LevelBaker>(
    shared: &Shared,
    baker: &mut Option<B>,
    make_baker: &impl Fn(Arc<Scene>) -> Result<B>,
    job: &Job,
    serial: u64,
) -> BakeState {
    // Levels are numbered within the request; those of a request that was replaced are not handed out.
    let mut levels = 0;
    let mut hand_out = |result, is_final| {
        levels += 1;
        shared.hand_out(BakedLevel {
            serial,
            request: job.asked.clone(),
            level: levels,
            is_final,
            result,
            seconds: job.since.elapsed().as_secs_f64(),
        });
    };

    // A cancelled bake may still complete a level, which nobody waits for.
    let outcome = bake(baker, make_baker, job, &mut |result| {
        if !job.control.is_cancelled() {
            hand_out(result, false);
        }
    });
    match outcome {
        Ok(result) => {
            hand_out(result, true);
            BakeState::Done
        }
        Err(stopped) => stopped,
    }
}

/// Contribution of an effect, from the bakes with and without it; `None` if the latter was cancelled.
fn worth(
    effect: Effect,
    with: &Arc<BakedLevel>,
    without: std::result::Result<Bake, BakeState>,
) -> Option<EffectDifference> {
    let difference = match without {
        Ok(without) => difference(&with.result.maps, &without.maps).map_err(|error| error.to_string()),
        Err(BakeState::Failed(sentence)) => Err(sentence),
        Err(_) => return None,
    };
    Some(EffectDifference {
        effect,
        with: Arc::clone(with),
        difference,
    })
}

/// Runs one bake; returns the state to show if it did not finish.
fn bake<B: LevelBaker>(
    baker: &mut Option<B>,
    make_baker: &impl Fn(Arc<Scene>) -> Result<B>,
    job: &Job,
    level: &mut (dyn FnMut(Bake) + Send),
) -> std::result::Result<Bake, BakeState> {
    let (asked, control) = (&job.asked, &job.control);
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let scene = Arc::clone(&asked.scene);
        let baker = match baker {
            Some(baker) => {
                baker.set_scene(scene)?;
                baker
            }
            None => baker.insert(make_baker(scene)?),
        };
        baker.bake_levels(&asked.settings, job, control, level)
    }));
    match outcome {
        Ok(Ok(result)) if result.stop_reason != StopReason::Cancelled => Ok(result),
        Ok(Ok(_)) => Err(BakeState::Cancelled),
        Ok(Err(_)) if control.is_cancelled() => Err(BakeState::Cancelled),
        Ok(Err(error)) => Err(BakeState::Failed(error.to_string())),
        Err(panic) => {
            // Its state may be inconsistent.
            *baker = None;
            Err(BakeState::Failed(panic_sentence(panic.as_ref())))
        }
    }
}

fn panic_sentence(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".into());
    format!(
        "bake: it ended by a fault of the program ({text}); change a setting or bake again, and please report it"
    )
}
