//! The baking thread, with bakers made for the test.

use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};

use nephroid::bake::Baker;
use nephroid::error::{Error, Result};
use nephroid::progress::Progress;
use nephroid::viewer::background::Wake;
use nephroid::viewer::worker::{BakeRequest, LevelBaker, Worker};

use super::headless::nothing;
use super::*;

fn result(rays: u64, partial: bool) -> Bake {
    let mut result = Bake { partial, ..nothing() };
    result.counts.rays = rays;
    result.stop_reason = if partial {
        StopReason::Cancelled
    } else {
        StopReason::Density
    };
    result
}

pub fn asked(density_per_sr: f64) -> BakeRequest {
    BakeRequest {
        scene: Arc::new(Scene::default()),
        settings: with(BakeSettings::splat(), |it| it.density_per_sr = density_per_sr),
    }
}

/// Works by a script: the density tells it what to do.
struct Scripted {
    scene: Arc<Scene>,
    started: Arc<AtomicUsize>,
    alive: Arc<AtomicUsize>,
    gate: Arc<Mutex<Receiver<()>>>,
}

/// Bakes at once, as any density that stands for nothing else.
pub const AT_ONCE: f64 = 1000.0;
/// Bakes until it is cancelled.
pub const ENDLESS: f64 = 2000.0;
pub const PANICKING: f64 = 3000.0;
const PANICKING_BELOW: f64 = 3500.0;
pub const FAILING: f64 = 4000.0;
/// Ignores cancelling and ends when the gate opens.
pub const STUBBORN: f64 = 5000.0;
/// Hands out levels of 1 and 2 rays, the second once the gate opened, and is done when it opens again. Ignores
/// cancelling.
const IN_LEVELS: f64 = 6000.0;
impl LevelBaker for Scripted {
    fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()> {
        self.scene = scene;
        Ok(())
    }

    fn bake_levels(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
        level: &mut (dyn FnMut(Bake) + Send),
    ) -> Result<Bake> {
        let wait = || {
            let gate = self.gate.lock().expect("one thread");
            let opened = gate.recv_timeout(Duration::from_secs(20));
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
                return Ok(result(rays, true));
            }
            PANICKING => panic!("the script says so"),
            // In a thread of its own pool, as a bake's.
            PANICKING_BELOW => std::thread::scope(|scope| {
                let thread = scope.spawn(|| panic!("a thread of the bake gave up"));
                thread
                    .join()
                    .unwrap_or_else(|payload| std::panic::resume_unwind(payload));
            }),
            FAILING => return Err(Error::failure("floor", "it is too large", "make it smaller")),
            STUBBORN => wait(),
            IN_LEVELS => {
                level(result(1, false));
                wait();
                level(result(2, false));
                wait();
            }
            _ => {}
        }
        Ok(result(rays, false))
    }
}

impl Drop for Scripted {
    fn drop(&mut self) {
        self.alive.fetch_sub(1, Ordering::SeqCst);
    }
}

pub struct Bench {
    pub worker: Worker,
    started: Arc<AtomicUsize>,
    pub alive: Arc<AtomicUsize>,
    pub made: Arc<AtomicUsize>,
    woken: Arc<AtomicUsize>,
    gate: Sender<()>,
}

pub fn bench() -> Bench {
    let [started, alive, made, woken] = [0; 4].map(|_| Arc::new(AtomicUsize::new(0)));
    let (gate, opened) = channel();
    let opened = Arc::new(Mutex::new(opened));
    let of_baker = (Arc::clone(&started), Arc::clone(&alive), Arc::clone(&made));
    let of_wake = Arc::clone(&woken);
    let make = move |scene| {
        of_baker.2.fetch_add(1, Ordering::SeqCst);
        of_baker.1.fetch_add(1, Ordering::SeqCst);
        Ok(Scripted {
            scene,
            started: Arc::clone(&of_baker.0),
            alive: Arc::clone(&of_baker.1),
            gate: Arc::clone(&opened),
        })
    };
    let wake = move || {
        of_wake.fetch_add(1, Ordering::SeqCst);
    };
    Bench {
        worker: Worker::spawn(make, &Wake::new(wake)).expect("threads are to be had"),
        started,
        alive,
        made,
        woken,
        gate,
    }
}

impl Bench {
    pub fn ask(&self, density_per_sr: f64) -> u64 {
        self.worker.request(asked(density_per_sr))
    }

    pub fn open_gate(&self) {
        self.gate.send(()).expect("the baker listens");
    }

    fn begun(&self, count: usize) {
        wait_for("the start", || self.started.load(Ordering::SeqCst) == count);
    }

    pub fn settled(&self) -> BakeState {
        wait_for("the bake to settle", || !self.worker.state().is_working());
        self.worker.state()
    }

    /// Asks, waits, and takes the rays of the maps.
    pub fn answer(&self, density_per_sr: f64) -> Option<u64> {
        self.ask(density_per_sr);
        assert_eq!(self.settled(), BakeState::Done);
        self.take()
    }

    /// The rays of the newest maps, which are then gone.
    fn take(&self) -> Option<u64> {
        let level = self.worker.take_level();
        assert!(level.is_none() || self.worker.take_level().is_none(), "only once");
        level.map(|level| level.result.counts.rays)
    }

    fn next(&self) -> BakedLevel {
        let mut level = None;
        wait_for("maps", || {
            level = self.worker.take_level();
            level.is_some()
        });
        level.expect("it was waited for")
    }
}

#[test]
fn a_request_is_answered() {
    let bench = bench();
    assert_eq!(bench.worker.state(), BakeState::Idle);
    assert_eq!(bench.take(), None);
    bench.worker.cancel();
    // There is nothing to cancel.
    assert_eq!(bench.worker.state(), BakeState::Idle);
    bench.ask(AT_ONCE);
    assert_eq!(bench.settled(), BakeState::Done);
    let level = bench.worker.take_level().expect("there are maps");
    assert_eq!(level.request.settings, asked(AT_ONCE).settings, "its threads too");
    assert!(level.seconds >= 0.0 && level.is_final && level.level == 1);
    assert_eq!(bench.take(), None, "only once");
    bench.worker.cancel();
    assert_eq!(bench.worker.state(), BakeState::Done);
    wait_for("the window to be woken", || {
        bench.woken.load(Ordering::SeqCst) >= 1
    });
}

#[test]
fn progress_is_seen_while_it_bakes() {
    let bench = bench();
    bench.ask(ENDLESS);
    wait_for("progress", || {
        matches!(bench.worker.state(), BakeState::Baking { stage: Stage::Caustic, fraction, .. }
            if (fraction - 0.25).abs() < 1e-6)
    });
    assert!(bench.woken.load(Ordering::SeqCst) >= 1);
    bench.worker.cancel();
    assert_eq!(bench.settled(), BakeState::Cancelled);
    assert_eq!(bench.take(), None, "unfinished maps are dropped");
    // Maps stay until newer ones are complete.
    bench.ask(AT_ONCE);
    bench.settled();
    bench.ask(ENDLESS);
    bench.begun(3);
    bench.worker.cancel();
    bench.settled();
    assert_eq!(bench.take(), Some(AT_ONCE as u64));
}

#[test]
fn last_of_many_requests_wins() {
    let bench = bench();
    bench.ask(ENDLESS);
    bench.begun(1);
    for request in 0..500 {
        bench.ask(ENDLESS);
        assert!(bench.worker.state().is_baking());
        bench.ask(10_000.0 + f64::from(request));
        // It may have been answered already.
        let state = bench.worker.state();
        assert!(state.is_baking() || state == BakeState::Done, "{state:?}");
    }
    assert_eq!(bench.answer(77.0), Some(77));
    assert_eq!(bench.made.load(Ordering::SeqCst), 1, "one session serves all");
}

#[test]
fn levels_come_at_once_and_the_last_is_marked() {
    let bench = bench();
    let serial = bench.ask(IN_LEVELS);
    for (level, rays) in [(1, 1), (2, 2), (3, IN_LEVELS as u64)] {
        let baked = bench.next();
        assert_eq!((baked.serial, baked.level), (serial, level));
        assert_eq!((baked.result.counts.rays, baked.is_final), (rays, level == 3));
        if level < 3 {
            assert!(bench.worker.state().is_baking());
            bench.open_gate();
        }
    }
    assert_eq!(bench.settled(), BakeState::Done);
    // Of levels that nobody took the newest is kept.
    bench.open_gate();
    bench.open_gate();
    assert_eq!(bench.answer(IN_LEVELS), Some(IN_LEVELS as u64));
}

#[test]
fn levels_of_replaced_bakes_are_dropped() {
    let bench = bench();
    let first = bench.ask(IN_LEVELS);
    assert_eq!(bench.next().serial, first);
    let second = bench.ask(STUBBORN);
    // The second level and the end of the first bake, which does not listen.
    bench.open_gate();
    bench.open_gate();
    bench.begun(2);
    assert_eq!(bench.take(), None);
    bench.open_gate();
    let baked = bench.next();
    assert_eq!((baked.serial, baked.is_final), (second, true));

    bench.ask(IN_LEVELS);
    assert_eq!(bench.next().level, 1);
    bench.worker.cancel();
    bench.open_gate();
    bench.open_gate();
    bench.settled();
    // Its second level is dropped; that it was complete all the same may be shown.
    let last = bench.worker.take_level();
    assert!(last.is_none_or(|last| last.is_final && last.level == 2));
}

#[test]
fn a_late_bake_does_not_pass_for_the_cancelled() {
    let bench = bench();
    bench.ask(STUBBORN);
    bench.begun(1);
    bench.ask(AT_ONCE);
    bench.worker.cancel();
    bench.open_gate();
    // What was asked last was never baked.
    assert_eq!(bench.settled(), BakeState::Cancelled);
    assert_eq!(bench.take(), None, "and what it replaced is not shown");
}

#[test]
fn failures_and_panics_become_sentences() {
    for (density, sentence, sessions) in [
        (FAILING, "floor: it is too large; make it smaller", 1),
        // A fresh session after a panic.
        (PANICKING, "the script says so", 2),
        (PANICKING_BELOW, "a thread of the bake gave up", 2),
    ] {
        let bench = bench();
        bench.ask(AT_ONCE);
        bench.settled();
        bench.ask(density);
        let BakeState::Failed(told) = bench.settled() else {
            panic!("it did not fail")
        };
        says(told, sentence);
        assert_eq!(bench.take(), Some(AT_ONCE as u64), "earlier maps are kept");
        assert_eq!(bench.answer(88.0), Some(88));
        assert_eq!(bench.made.load(Ordering::SeqCst), sessions);
    }
}

#[test]
fn dropping_ends_the_bake_and_its_thread() {
    for _ in 0..20 {
        let bench = bench();
        bench.ask(ENDLESS);
        bench.begun(1);
        bench.ask(ENDLESS);
        let Bench { worker, alive, .. } = bench;
        drop(worker);
        // The thread owned the baker: it is gone with it.
        assert_eq!(alive.load(Ordering::SeqCst), 0);
    }
}

#[test]
fn each_baking_thread_starts_as_it_is_told() {
    static STARTED: AtomicUsize = AtomicUsize::new(0);
    let baker = Baker::new(Scene::default()).expect("it has no triangles");
    let mut baker = baker.with_thread_start(|| {
        STARTED.fetch_add(1, Ordering::SeqCst);
    });
    let settings = with(BakeSettings::splat(), |it| it.threads = 3);
    for _ in 0..2 {
        baker.bake(&settings, &(), &Control::default()).expect("it bakes");
        // A bake of nothing may end before all of them have started.
        wait_for("three threads", || STARTED.load(Ordering::SeqCst) >= 3);
    }
    assert_eq!(STARTED.load(Ordering::SeqCst), 3, "they are kept");
}
