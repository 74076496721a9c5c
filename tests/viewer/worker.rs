//! The baking thread, with bakers that are made for the test.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use nephroid::error::{Error, Result};
use nephroid::plan::EffectPlan;
use nephroid::progress::{Control, Progress, Stage};
use nephroid::scene::Scene;
use nephroid::session::{BakeCounts, BakeResult, StopReason, Timings};
use nephroid::settings::BakeSettings;
use nephroid::viewer::worker::{BakeRequest, BakeState, BakedLevel, Baker, Worker, baking_threads};

/// Far longer than anything here takes; only a failing test waits for it.
const PATIENCE: Duration = Duration::from_secs(20);

pub fn result(rays: u64, partial: bool) -> BakeResult {
    BakeResult {
        maps: Vec::new(),
        light_layers: Vec::new(),
        band_layers: Vec::new(),
        plan: EffectPlan::default(),
        effects: Vec::new(),
        course: Vec::new(),
        forecast: None,
        item_buffers: Vec::new(),
        ledgers: Vec::new(),
        counts: BakeCounts {
            rays,
            ..BakeCounts::default()
        },
        timings_s: Timings::default(),
        cpu_s: Timings::default(),
        stop_reason: if partial {
            StopReason::Cancelled
        } else {
            StopReason::Density
        },
        estimated_relative_rmse: None,
        partial,
        warnings: Vec::new(),
    }
}

fn settings(density_per_sr: f64) -> BakeSettings {
    BakeSettings {
        density_per_sr,
        ..BakeSettings::splat()
    }
}

/// A request on a scene that says nothing.
pub fn asked(density_per_sr: f64) -> BakeRequest {
    BakeRequest {
        scene: Arc::new(Scene::default()),
        settings: settings(density_per_sr),
    }
}

/// Works by a script: the density tells it what to do.
struct Scripted {
    scene: Arc<Scene>,
    started: Arc<AtomicUsize>,
    alive: Arc<AtomicUsize>,
    gate: Arc<Mutex<Receiver<()>>>,
}

/// Bakes at once.
pub const AT_ONCE: f64 = 1000.0;
/// Bakes until it is cancelled.
pub const ENDLESS: f64 = 2000.0;
pub const PANICKING: f64 = 3000.0;
pub const PANICKING_BELOW: f64 = 3500.0;
pub const FAILING: f64 = 4000.0;
/// Ignores cancelling and ends when the gate opens.
pub const STUBBORN: f64 = 5000.0;
/// Hands out levels of 1 and 2 rays, the second once the gate opened, and is done when it opens again. Ignores
/// cancelling.
const IN_LEVELS: f64 = 6000.0;
/// Answers with as many rays as its scene's name has letters.
const NAMED: f64 = 7000.0;

impl Baker for Scripted {
    fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()> {
        self.scene = scene;
        Ok(())
    }

    fn bake_levels(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: &mut (dyn FnMut(BakeResult) + Send),
    ) -> Result<BakeResult> {
        let wait = || {
            let opened = self.gate.lock().expect("one thread").recv_timeout(PATIENCE);
            opened.expect("the test opens the gate");
        };
        self.started.fetch_add(1, Ordering::SeqCst);
        let rays = settings.density_per_sr as u64;
        match settings.density_per_sr {
            ENDLESS => {
                progress.advance(Stage::Caustic, 1, 4);
                while !control.is_cancelled() {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Ok(result(rays, true))
            }
            PANICKING => panic!("the script says so"),
            // In a thread of its own pool, as a bake's.
            PANICKING_BELOW => std::thread::scope(|scope| {
                let thread = scope.spawn(|| panic!("a thread of the bake gave up"));
                match thread.join() {
                    Ok(()) => Ok(result(rays, false)),
                    Err(payload) => std::panic::resume_unwind(payload),
                }
            }),
            FAILING => Err(Error::failure("floor", "it is too large", "make it smaller")),
            STUBBORN => {
                wait();
                Ok(result(rays, false))
            }
            IN_LEVELS => {
                level(result(1, false));
                wait();
                level(result(2, false));
                wait();
                Ok(result(rays, false))
            }
            NAMED => Ok(result(self.scene.name.len() as u64, false)),
            _ => Ok(result(rays, false)),
        }
    }
}

impl Drop for Scripted {
    fn drop(&mut self) {
        self.alive.fetch_sub(1, Ordering::SeqCst);
    }
}

pub struct Bench {
    pub worker: Worker,
    pub started: Arc<AtomicUsize>,
    /// Bakers that exist.
    pub alive: Arc<AtomicUsize>,
    pub made: Arc<AtomicUsize>,
    pub woken: Arc<AtomicUsize>,
    pub gate: Sender<()>,
}

pub fn bench() -> Bench {
    let counter = || Arc::new(AtomicUsize::new(0));
    let (started, alive, made, woken) = (counter(), counter(), counter(), counter());
    let (gate, opened) = channel();
    let opened = Arc::new(Mutex::new(opened));
    let of_baker = (Arc::clone(&started), Arc::clone(&alive), Arc::clone(&made));
    let of_wake = Arc::clone(&woken);
    let worker = Worker::spawn(
        move |scene| {
            of_baker.2.fetch_add(1, Ordering::SeqCst);
            of_baker.1.fetch_add(1, Ordering::SeqCst);
            Ok(Scripted {
                scene,
                started: Arc::clone(&of_baker.0),
                alive: Arc::clone(&of_baker.1),
                gate: Arc::clone(&opened),
            })
        },
        move || {
            of_wake.fetch_add(1, Ordering::SeqCst);
        },
    );
    Bench {
        worker: worker.expect("threads are to be had"),
        started,
        alive,
        made,
        woken,
        gate,
    }
}

pub fn wait_for(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < PATIENCE, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn settled(worker: &Worker) -> BakeState {
    wait_for("the bake to settle", || !worker.state().is_baking());
    worker.state()
}

fn rays(finished: Option<BakedLevel>) -> u64 {
    finished.expect("there are maps").result.counts.rays
}

#[test]
fn a_request_is_answered() {
    let bench = bench();
    assert_eq!(bench.worker.state(), BakeState::Idle);
    assert!(bench.worker.take_level().is_none());
    bench.worker.request(asked(AT_ONCE));
    assert_eq!(settled(&bench.worker), BakeState::Done);
    let finished = bench.worker.take_level().expect("there are maps");
    assert_eq!(
        finished.request.settings,
        settings(AT_ONCE),
        "as asked, its threads too"
    );
    assert!(finished.seconds >= 0.0 && finished.is_final && finished.level == 1);
    assert!(bench.worker.take_level().is_none(), "only once");
    wait_for("the window to be woken", || {
        bench.woken.load(Ordering::SeqCst) >= 1
    });
}

#[test]
fn progress_is_seen_while_it_bakes() {
    let bench = bench();
    bench.worker.request(asked(ENDLESS));
    wait_for("progress", || {
        matches!(bench.worker.state(), BakeState::Baking { stage: Stage::Caustic, fraction, .. }
            if (fraction - 0.25).abs() < 1e-6)
    });
    assert!(bench.woken.load(Ordering::SeqCst) >= 1);
    bench.worker.cancel();
    assert_eq!(settled(&bench.worker), BakeState::Cancelled);
    assert!(bench.worker.take_level().is_none(), "unfinished maps are dropped");
}

#[test]
fn a_new_request_cancels_the_running_one_and_the_last_wins() {
    let bench = bench();
    bench.worker.request(asked(ENDLESS));
    wait_for("the start", || bench.started.load(Ordering::SeqCst) == 1);
    for request in 0..1000 {
        bench.worker.request(asked(if request % 2 == 0 {
            ENDLESS
        } else {
            10_000.0 + f64::from(request)
        }));
        assert!(bench.worker.state().is_baking());
    }
    bench.worker.request(asked(77.0));
    assert_eq!(settled(&bench.worker), BakeState::Done);
    assert_eq!(rays(bench.worker.take_level()), 77);
    assert!(bench.worker.take_level().is_none());
    assert_eq!(
        bench.made.load(Ordering::SeqCst),
        1,
        "one session serves all requests"
    );
}

/// Waits for the next maps.
fn next(worker: &Worker) -> BakedLevel {
    let mut level = None;
    wait_for("maps", || {
        level = worker.take_level();
        level.is_some()
    });
    level.expect("it was waited for")
}

#[test]
fn levels_are_handed_out_at_once_and_the_last_is_marked() {
    let bench = bench();
    let serial = bench.worker.request(asked(IN_LEVELS));
    for (level, rays) in [(1, 1), (2, 2), (3, IN_LEVELS as u64)] {
        let baked = next(&bench.worker);
        assert_eq!((baked.serial, baked.level), (serial, level));
        assert_eq!((baked.result.counts.rays, baked.is_final), (rays, level == 3));
        if level < 3 {
            assert!(bench.worker.state().is_baking(), "not done before the last level");
            bench.gate.send(()).expect("the baker listens");
        }
    }
    assert_eq!(settled(&bench.worker), BakeState::Done);
}

#[test]
fn of_levels_that_nobody_took_the_newest_is_kept() {
    let bench = bench();
    bench.worker.request(asked(IN_LEVELS));
    bench.gate.send(()).expect("the baker listens");
    bench.gate.send(()).expect("the baker listens");
    assert_eq!(settled(&bench.worker), BakeState::Done);
    assert_eq!(rays(bench.worker.take_level()), IN_LEVELS as u64);
    assert!(bench.worker.take_level().is_none());
}

#[test]
fn levels_of_a_replaced_or_cancelled_bake_are_dropped() {
    let bench = bench();
    let first = bench.worker.request(asked(IN_LEVELS));
    assert_eq!(next(&bench.worker).serial, first);
    let second = bench.worker.request(asked(STUBBORN));
    // The second level and the end of the first bake, which does not listen.
    bench.gate.send(()).expect("the baker listens");
    bench.gate.send(()).expect("the baker listens");
    wait_for("the second bake", || bench.started.load(Ordering::SeqCst) == 2);
    assert!(bench.worker.take_level().is_none());
    bench.gate.send(()).expect("the baker listens");
    let baked = next(&bench.worker);
    assert_eq!((baked.serial, baked.is_final), (second, true));

    bench.worker.request(asked(IN_LEVELS));
    assert_eq!(next(&bench.worker).level, 1);
    bench.worker.cancel();
    bench.gate.send(()).expect("the baker listens");
    bench.gate.send(()).expect("the baker listens");
    settled(&bench.worker);
    let last = bench.worker.take_level();
    assert!(
        last.is_none_or(|last| last.is_final && last.level == 2),
        "its second level is dropped; that it was complete all the same may be shown"
    );
}

#[test]
fn each_request_brings_its_scene() {
    let bench = bench();
    for name in ["four", "seven77", "four"] {
        let scene = Scene {
            name: name.into(),
            ..Scene::default()
        };
        bench.worker.request(BakeRequest {
            scene: Arc::new(scene),
            settings: settings(NAMED),
        });
        assert_eq!(settled(&bench.worker), BakeState::Done);
        let baked = bench.worker.take_level().expect("there are maps");
        assert_eq!(baked.result.counts.rays, name.len() as u64);
        assert_eq!(baked.request.scene.name, name);
    }
    assert_eq!(bench.made.load(Ordering::SeqCst), 1, "one session for all scenes");
}

#[test]
fn earlier_maps_stay_until_newer_ones_are_complete() {
    let bench = bench();
    bench.worker.request(asked(AT_ONCE));
    settled(&bench.worker);
    bench.worker.request(asked(ENDLESS));
    wait_for("the start", || bench.started.load(Ordering::SeqCst) == 2);
    bench.worker.cancel();
    settled(&bench.worker);
    assert_eq!(rays(bench.worker.take_level()), AT_ONCE as u64);
}

#[test]
fn a_bake_that_ends_too_late_does_not_pass_for_the_one_that_was_cancelled() {
    let bench = bench();
    bench.worker.request(asked(STUBBORN));
    wait_for("the start", || bench.started.load(Ordering::SeqCst) == 1);
    bench.worker.request(asked(AT_ONCE));
    bench.worker.cancel();
    bench.gate.send(()).expect("the baker listens");
    assert_eq!(
        settled(&bench.worker),
        BakeState::Cancelled,
        "what was asked last was never baked"
    );
    assert!(
        bench.worker.take_level().is_none(),
        "and what it replaced is not shown"
    );
}

#[test]
fn cancelling_without_a_bake_changes_nothing() {
    let bench = bench();
    bench.worker.cancel();
    assert_eq!(bench.worker.state(), BakeState::Idle);
    bench.worker.request(asked(AT_ONCE));
    assert_eq!(settled(&bench.worker), BakeState::Done);
    bench.worker.cancel();
    assert_eq!(bench.worker.state(), BakeState::Done);
}

#[test]
fn failures_and_panics_become_sentences_and_the_next_bake_works() {
    let bench = bench();
    bench.worker.request(asked(FAILING));
    assert_eq!(
        settled(&bench.worker),
        BakeState::Failed("floor: it is too large; make it smaller".into())
    );
    bench.worker.request(asked(PANICKING));
    let BakeState::Failed(sentence) = settled(&bench.worker) else {
        panic!("it did not fail")
    };
    assert!(sentence.contains("the script says so"), "{sentence}");
    bench.worker.request(asked(AT_ONCE));
    assert_eq!(settled(&bench.worker), BakeState::Done);
    assert_eq!(
        bench.made.load(Ordering::SeqCst),
        2,
        "a fresh session after the panic"
    );
}

#[test]
fn maps_of_an_earlier_bake_are_kept_when_a_later_one_panics() {
    for (panicking, sentence) in [
        (PANICKING, "the script says so"),
        (PANICKING_BELOW, "a thread of the bake gave up"),
    ] {
        let bench = bench();
        bench.worker.request(asked(AT_ONCE));
        settled(&bench.worker);
        bench.worker.request(asked(panicking));
        let BakeState::Failed(told) = settled(&bench.worker) else {
            panic!("it did not fail")
        };
        assert!(told.contains(sentence) && !told.contains('\n'), "{told}");
        assert_eq!(rays(bench.worker.take_level()), AT_ONCE as u64);
        assert!(
            bench.worker.take_level().is_none(),
            "nothing of the bake that panicked"
        );
        bench.worker.request(asked(88.0));
        assert_eq!(settled(&bench.worker), BakeState::Done);
        assert_eq!(rays(bench.worker.take_level()), 88);
    }
}

#[test]
fn dropping_it_ends_the_bake_and_the_thread() {
    let Bench {
        worker,
        started,
        alive,
        ..
    } = bench();
    worker.request(asked(ENDLESS));
    wait_for("the start", || started.load(Ordering::SeqCst) == 1);
    worker.request(asked(ENDLESS));
    let start = Instant::now();
    drop(worker);
    assert!(start.elapsed() < PATIENCE);
    // The thread owned the baker: it is gone with it.
    assert_eq!(alive.load(Ordering::SeqCst), 0);
}

#[test]
fn many_workers_leave_no_thread_behind() {
    let alive: Vec<_> = (0..20)
        .map(|_| {
            let Bench {
                worker, alive, made, ..
            } = bench();
            worker.request(asked(AT_ONCE));
            wait_for("its session", || made.load(Ordering::SeqCst) == 1);
            alive
        })
        .collect();
    assert!(alive.iter().all(|count| count.load(Ordering::SeqCst) == 0));
}

#[test]
fn one_core_is_left_to_the_window() {
    assert_eq!([1, 2, 8].map(|cores| baking_threads(0, cores)), [1, 1, 7]);
    assert_eq!(baking_threads(5, 2), 5, "what the user asks for is honoured");
}
