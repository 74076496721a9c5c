//! A thread around a bake: requests in, progress and maps of rising quality out; the window never waits for it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::background::Wake;
use crate::effect::{Effect, EffectSwitch};
use crate::error::Result;
use crate::illumination::difference::{Difference, difference};
use crate::progress::{Control, Progress, Stage};
use crate::scene::Scene;
use crate::session::{BakeResult, BakeSession, StopReason};
use crate::settings::BakeSettings;

/// What the worker bakes with.
pub trait Baker {
    /// See [`BakeSession::set_scene`].
    ///
    /// # Errors
    /// As the session's.
    fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()>;

    /// See [`BakeSession::bake_levels`].
    ///
    /// # Errors
    /// As the session's.
    fn bake_levels(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: &mut (dyn FnMut(BakeResult) + Send),
    ) -> Result<BakeResult>;
}

impl Baker for BakeSession {
    fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()> {
        Self::set_scene(self, scene)
    }

    fn bake_levels(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: &mut (dyn FnMut(BakeResult) + Send),
    ) -> Result<BakeResult> {
        Self::bake_levels(self, settings, progress, control, level)
    }
}

/// Where the bake stands.
#[derive(Clone, Debug, PartialEq)]
pub enum BakeState {
    /// Nothing was asked for yet.
    Idle,
    /// At work, or about to be.
    Baking {
        /// What it is doing.
        stage: Stage,
        /// Of this stage, [0, 1].
        fraction: f64,
        /// When it was asked for.
        since: Instant,
    },
    /// At work on what an effect is worth; the maps belong to the settings last asked for.
    Comparing {
        /// What is left out.
        effect: Effect,
        /// What it is doing.
        stage: Stage,
        /// Of this stage, [0, 1].
        fraction: f64,
    },
    /// The maps belong to the settings last asked for.
    Done,
    /// Stopped by the user; the maps are those of an earlier bake.
    Cancelled,
    /// One sentence: what failed, where, what to do.
    Failed(String),
}

impl BakeState {
    /// Whether a bake is running or about to.
    pub fn is_baking(&self) -> bool {
        matches!(self, Self::Baking { .. })
    }

    /// Whether anything is running or about to that can be stopped.
    pub fn is_working(&self) -> bool {
        matches!(self, Self::Baking { .. } | Self::Comparing { .. })
    }
}

/// What a bake is asked for.
#[derive(Clone, Debug)]
pub struct BakeRequest {
    /// What is lit.
    pub scene: Arc<Scene>,
    /// How it is baked.
    pub settings: BakeSettings,
}

impl BakeRequest {
    /// A request for what is baked of these settings: how the eye's chains are switched is none of a bake's.
    pub fn new(scene: Arc<Scene>, mut settings: BakeSettings) -> Self {
        settings.effects.set(Effect::Chains, EffectSwitch::Auto);
        Self { scene, settings }
    }

    /// Whether both ask for the very same: this scene and these settings.
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.scene, &other.scene) && self.settings == other.settings
    }

    /// Whether both ask for the same maps but for how accurate they are.
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

/// Whole maps on the way to what was asked for, or those themselves.
#[derive(Clone, Debug)]
pub struct BakedLevel {
    /// Number of the request that it answers, as [`Worker::request`] gave it.
    pub serial: u64,
    /// The request; `threads` as asked, before a core was set aside.
    pub request: BakeRequest,
    /// Counted from 1 within its request.
    pub level: u32,
    /// Whether the bake is done with it.
    pub is_final: bool,
    /// Maps and accounts.
    pub result: BakeResult,
    /// From the request to these maps, wall clock [s].
    pub seconds: f64,
}

/// What the light of a scene owes to an effect.
#[derive(Clone, Debug)]
pub struct Worth {
    /// The effect that was left out.
    pub effect: Effect,
    /// The bake with it.
    pub with: Arc<BakedLevel>,
    /// That bake minus the one without, or one sentence on what failed.
    pub difference: std::result::Result<Difference, String>,
}

/// Threads that leave one core to the window where none are asked for (`asked` = 0), at least 1.
pub fn baking_threads(asked: usize, cores: usize) -> usize {
    if asked == 0 {
        cores.saturating_sub(1).max(1)
    } else {
        asked
    }
}

/// How long a bake is waited for that was asked to stop.
const ENDS_WITHIN: Duration = Duration::from_millis(300);

/// Handle of the thread; dropping it cancels the bake, and waits a moment for the thread's end.
#[derive(Debug)]
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread. `make_baker` is called there with the scene of the first request, and again after a bake
    /// that panicked. `wake` is called from any thread when there is news, but not for mere progress.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn spawn<B: Baker>(
        make_baker: impl Fn(Arc<Scene>) -> Result<B> + Send + 'static,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self> {
        let shared = Arc::new(Shared::new(Wake(Arc::new(wake))));
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("baker".into())
            .spawn(move || serve(&of_thread, &make_baker))
            .map_err(|error| {
                crate::error::Error::failure(
                    "baker",
                    format!("the system gives no thread: {error}"),
                    "close other programs and start again",
                )
            })?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Asks for a bake, replaces what was asked before, and stops what is running: nothing of that is handed out from
    /// now on. Returns the request's number; later ones are higher.
    pub fn request(&self, asked: BakeRequest) -> u64 {
        let mut slot = self.shared.lock();
        slot.cancel_running();
        slot.serial += 1;
        slot.worth = None;
        let serial = slot.serial;
        slot.request = Some(Request {
            asked,
            since: Instant::now(),
            task: Task::Bake { serial },
        });
        self.shared.news.notify_all();
        serial
    }

    /// Asks what an effect is worth to a bake: the same is baked without it, by a session of its own. Replaces another
    /// comparison, and gives way to every later request. Tells whether it is taken on: not while maps are baked.
    pub fn compare(&self, effect: Effect, with: Arc<BakedLevel>) -> bool {
        let mut slot = self.shared.lock();
        let bakes = |task: Option<&Task>| task.is_some_and(|task| matches!(task, Task::Bake { .. }));
        if bakes(slot.request.as_ref().map(|request| &request.task))
            || bakes(slot.running.as_ref().map(|running| &running.task))
        {
            return false;
        }
        slot.cancel_running();
        slot.worth = None;
        let mut asked = with.request.clone();
        asked.settings.effects.set(effect, EffectSwitch::Off);
        slot.request = Some(Request {
            asked,
            since: Instant::now(),
            task: Task::Comparison { effect, with },
        });
        self.shared.news.notify_all();
        true
    }

    /// Lets what is running wait for so long.
    pub fn hold(&self, time: Duration) {
        if let Some(running) = &self.shared.lock().running {
            running.control.hold(time);
        }
    }

    /// Tells what is running that nobody looks at its levels for so long.
    pub fn look_away(&self, time: Duration) {
        if let Some(running) = &self.shared.lock().running {
            running.control.look_away(time);
        }
    }

    /// Stops what is running and forgets what is waiting; unfinished maps are dropped.
    pub fn cancel(&self) {
        let mut slot = self.shared.lock();
        slot.cancel_running();
        let waiting = slot.request.take();
        let is_bake = waiting.is_some_and(|request| matches!(request.task, Task::Bake { .. }));
        if is_bake && slot.running.is_none() {
            slot.settled = BakeState::Cancelled;
        }
    }

    /// Where the bake stands now.
    pub fn state(&self) -> BakeState {
        let slot = self.shared.lock();
        match (&slot.request, &slot.running) {
            (Some(request), _) => request.task.state((Stage::Build, 0.0), request.since),
            (None, Some(running)) => running.task.state(running.meter.read(), running.since),
            (None, None) => slot.settled.clone(),
        }
    }

    /// What the last comparison found, unless that was taken or something else was asked for since.
    pub fn take_worth(&self) -> Option<Worth> {
        self.shared.lock().worth.take()
    }

    /// The newest whole maps that were not taken yet. Older ones that nobody took are gone.
    pub fn take_level(&self) -> Option<BakedLevel> {
        self.shared.lock().newest.take()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        let mut slot = self.shared.lock();
        slot.quit = true;
        slot.request = None;
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

/// What is to be done with the maps.
#[derive(Clone)]
enum Task {
    /// Handed out under this number.
    Bake { serial: u64 },
    /// Held against others.
    Comparison { effect: Effect, with: Arc<BakedLevel> },
}

impl Task {
    fn state(&self, (stage, fraction): (Stage, f64), since: Instant) -> BakeState {
        match *self {
            Self::Bake { .. } => BakeState::Baking {
                stage,
                fraction,
                since,
            },
            Self::Comparison { effect, .. } => BakeState::Comparing {
                effect,
                stage,
                fraction,
            },
        }
    }
}

struct Request {
    asked: BakeRequest,
    since: Instant,
    task: Task,
}

struct Running {
    task: Task,
    control: Arc<Control>,
    meter: Arc<Meter>,
    since: Instant,
}

/// What both threads look at, under one lock.
struct Slot {
    /// Of the newest request for maps, waiting or not.
    serial: u64,
    request: Option<Request>,
    running: Option<Running>,
    /// The state while nothing is asked for or running.
    settled: BakeState,
    newest: Option<BakedLevel>,
    worth: Option<Worth>,
    quit: bool,
}

impl Slot {
    fn cancel_running(&self) {
        if let Some(running) = &self.running {
            running.control.cancel();
        }
    }
}

struct Shared {
    slot: Mutex<Slot>,
    news: Condvar,
    wake: Wake,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shared").finish_non_exhaustive()
    }
}

impl Shared {
    fn new(wake: Wake) -> Self {
        let slot = Slot {
            serial: 0,
            request: None,
            running: None,
            settled: BakeState::Idle,
            newest: None,
            worth: None,
            quit: false,
        };
        Self {
            slot: Mutex::new(slot),
            news: Condvar::new(),
            wake,
        }
    }

    /// No code that can panic runs under the lock, so a poisoned one still holds a valid slot.
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a request and marks it as running; `None` when it is time to end.
    fn next(&self) -> Option<(Request, Arc<Control>, Arc<Meter>)> {
        let mut slot = self.lock();
        loop {
            if slot.quit {
                return None;
            }
            if let Some(request) = slot.request.take() {
                let control = Arc::new(Control::default());
                let meter = Arc::new(Meter::default());
                slot.running = Some(Running {
                    task: request.task.clone(),
                    control: Arc::clone(&control),
                    meter: Arc::clone(&meter),
                    since: request.since,
                });
                return Some((request, control, meter));
            }
            slot = self.news.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Hands whole maps to the window, unless something else was asked for in between.
    fn hand_out(&self, level: BakedLevel) {
        let mut slot = self.lock();
        if slot.serial != level.serial {
            return;
        }
        slot.newest = Some(level);
        drop(slot);
        (self.wake.0)();
    }

    /// Ends a comparison, and hands out what it found unless something else was asked for in between.
    fn end_comparison(&self, worth: Option<Worth>, control: &Control) {
        // May wait, which is not to be done under the lock.
        let is_cancelled = control.is_cancelled();
        let mut slot = self.lock();
        slot.running = None;
        if !is_cancelled {
            slot.worth = worth;
        }
        drop(slot);
        (self.wake.0)();
    }

    fn settle(&self, serial: u64, state: BakeState) {
        let mut slot = self.lock();
        slot.running = None;
        // A bake that was complete before it noticed that a newer request came, and was itself cancelled.
        let outdated = state == BakeState::Done && serial != slot.serial;
        slot.settled = if outdated { BakeState::Cancelled } else { state };
        drop(slot);
        (self.wake.0)();
    }
}

/// The thread's life.
fn serve<B: Baker>(shared: &Shared, make_baker: &impl Fn(Arc<Scene>) -> Result<B>) {
    let mut baker = None;
    while let Some((request, control, meter)) = shared.next() {
        (shared.wake.0)();
        match &request.task {
            Task::Bake { serial } => {
                let state = serve_bake(
                    shared, &mut baker, make_baker, &request, *serial, &*meter, &control,
                );
                shared.settle(*serial, state);
            }
            Task::Comparison { effect, with } => {
                // The session of the maps that are shown keeps all it has.
                let mut own = None;
                let ignore = &mut |_| ();
                let outcome = bake(&mut own, make_baker, &request.asked, &*meter, &control, ignore);
                drop(own);
                let worth = worth(*effect, with, outcome);
                shared.end_comparison(worth, &control);
            }
        }
    }
}

/// Bakes, hands out every level, and tells how it ended.
fn serve_bake<B: Baker>(
    shared: &Shared,
    baker: &mut Option<B>,
    make_baker: &impl Fn(Arc<Scene>) -> Result<B>,
    request: &Request,
    serial: u64,
    progress: &dyn Progress,
    control: &Control,
) -> BakeState {
    let mut levels = 0;
    let mut hand_out = |result, is_final| {
        levels += 1;
        shared.hand_out(BakedLevel {
            serial,
            request: request.asked.clone(),
            level: levels,
            is_final,
            result,
            seconds: request.since.elapsed().as_secs_f64(),
        });
    };
    let mut on_the_way = |result| {
        if !control.is_cancelled() {
            hand_out(result, false);
        }
    };
    let outcome = bake(
        baker,
        make_baker,
        &request.asked,
        progress,
        control,
        &mut on_the_way,
    );
    match outcome {
        Ok(result) => {
            hand_out(result, true);
            BakeState::Done
        }
        Err(stopped) => stopped,
    }
}

/// What a bake without an effect tells; `None` where it was stopped.
fn worth(
    effect: Effect,
    with: &Arc<BakedLevel>,
    without: std::result::Result<BakeResult, BakeState>,
) -> Option<Worth> {
    let difference = match without {
        Ok(without) => difference(&with.result.maps, &without.maps).map_err(|error| error.to_string()),
        Err(BakeState::Failed(sentence)) => Err(sentence),
        Err(_) => return None,
    };
    Some(Worth {
        effect,
        with: Arc::clone(with),
        difference,
    })
}

/// One bake; where it did not come to its end, the state that it leaves.
fn bake<B: Baker>(
    baker: &mut Option<B>,
    make_baker: &impl Fn(Arc<Scene>) -> Result<B>,
    asked: &BakeRequest,
    progress: &dyn Progress,
    control: &Control,
    level: &mut (dyn FnMut(BakeResult) + Send),
) -> std::result::Result<BakeResult, BakeState> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let settings = BakeSettings {
        threads: baking_threads(asked.settings.threads, cores),
        ..asked.settings.clone()
    };
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let scene = Arc::clone(&asked.scene);
        let baker = match baker {
            Some(baker) => {
                baker.set_scene(scene)?;
                baker
            }
            None => baker.insert(make_baker(scene)?),
        };
        baker.bake_levels(&settings, progress, control, level)
    }));
    match outcome {
        Ok(Ok(result)) if result.stop_reason != StopReason::Cancelled => Ok(result),
        Ok(Ok(_)) => Err(BakeState::Cancelled),
        Ok(Err(_)) if control.is_cancelled() => Err(BakeState::Cancelled),
        Ok(Err(error)) => Err(BakeState::Failed(error.to_string())),
        Err(panic) => {
            // What it left behind may be half-built.
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

/// Stage and fraction in one word, so that they are read together: stage in the upper half, fraction × 2³¹ below.
#[derive(Debug, Default)]
pub(super) struct Meter {
    packed: AtomicU64,
}

const STAGES: [Stage; 5] = [
    Stage::Build,
    Stage::Plan,
    Stage::Caustic,
    Stage::Direct,
    Stage::Indirect,
];
const WHOLE: f64 = (1_u64 << 31) as f64;

impl Meter {
    fn write(&self, stage: Stage, fraction: f64) {
        let index = STAGES
            .iter()
            .position(|candidate| *candidate == stage)
            .unwrap_or(0) as u64;
        let part = (fraction.clamp(0.0, 1.0) * WHOLE) as u64;
        self.packed.store(index << 32 | part, Ordering::Relaxed);
    }

    pub(super) fn read(&self) -> (Stage, f64) {
        let packed = self.packed.load(Ordering::Relaxed);
        (
            STAGES[(packed >> 32) as usize],
            (packed & 0xffff_ffff) as f64 / WHOLE,
        )
    }
}

impl Progress for Meter {
    fn advance(&self, stage: Stage, done: u64, total: u64) {
        self.write(stage, done as f64 / total.max(1) as f64);
    }
}
