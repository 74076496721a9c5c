//! Hands that know nothing: seeded random keys, clicks, drags, turns of the wheel and sizes of the window, while it bakes
//! and while it rests. `NEPHROID_MUTATIONS=3` and more make it a whole minute.

use std::time::{Duration, Instant};

use serde_json::Value;

use super::desktop::{SIZE, Screen, Viewer};

/// Of one part; there are at most three.
const PART: Duration = Duration::from_secs(20);
const MOST_PARTS: u32 = 3;
/// Deeds between two looks at the clock.
const DEEDS: usize = 12;
const SEED: u64 = 0x6e65_7068_726f_6964;

/// Everything that the window has a meaning for, and some that it has none for.
const KEYS: [&str; 46] = [
    "w",
    "a",
    "s",
    "d",
    "q",
    "e",
    "c",
    "f",
    "r",
    "h",
    "v",
    "m",
    "p",
    "k",
    "g",
    "1",
    "2",
    "9",
    "ctrl+1",
    "ctrl+2",
    "ctrl+z",
    "ctrl+y",
    "ctrl+shift+z",
    "Escape",
    "Tab",
    "shift+Tab",
    "space",
    "Return",
    "Up",
    "Down",
    "Left",
    "Right",
    "Page_Down",
    "Home",
    "BackSpace",
    "Delete",
    "0",
    "5",
    "minus",
    "period",
    "F1",
    "F12",
    "x",
    "question",
    "shift+w",
    "alt+a",
];
const HELD: [&str; 8] = ["w", "a", "s", "d", "q", "e", "shift", "ctrl"];

/// Marsaglia's xorshift64* (J. Stat. Softw. 8, 14, 2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11
    }

    fn below(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    fn one_of<'a>(&mut self, all: &[&'a str]) -> &'a str {
        all[self.below(all.len() as u64) as usize]
    }

    /// Somewhere in the window: as often over the panel as over the picture [pixels].
    fn place(&mut self) -> (u64, u64) {
        let (width, height) = (u64::from(SIZE.0), u64::from(SIZE.1));
        let x = if self.below(2) == 0 {
            self.below(360)
        } else {
            self.below(width)
        };
        (x, self.below(height))
    }
}

/// Something to do, for xdotool, and how many events that makes at least.
fn deed(random: &mut Random, window: &str) -> (String, usize) {
    let (x, y) = random.place();
    match random.below(20) {
        0..=5 => (format!("key {} ", random.one_of(&KEYS)), 2),
        6 | 7 => {
            let key = random.one_of(&HELD);
            let sign = ["keydown", "keyup"][random.below(2) as usize];
            (format!("{sign} {key} "), 1)
        }
        8..=12 => (format!("mousemove {x} {y} click 1 "), 3),
        13 => (format!("mousemove {x} {y} click 3 "), 3),
        14 | 15 => {
            let wheel = 4 + random.below(2);
            (
                format!("mousemove {x} {y} click --repeat 3 --delay 5 {wheel} "),
                7,
            )
        }
        16..=18 => {
            let button = if random.below(3) == 0 { 3 } else { 1 };
            let (to_x, to_y) = (random.below(u64::from(SIZE.0)), y + random.below(9));
            let way = format!(
                "mousemove {} {to_y} sleep 0.02 mousemove {to_x} {to_y}",
                (x + to_x) / 2
            );
            (
                format!("mousemove {x} {y} mousedown {button} sleep 0.02 {way} sleep 0.02 mouseup {button} "),
                5,
            )
        }
        _ => {
            let (width, height) = (300 + random.below(1000), 200 + random.below(600));
            (format!("windowsize {window} {width} {height} "), 1)
        }
    }
}

fn parts() -> u32 {
    let asked = std::env::var("NEPHROID_MUTATIONS").ok();
    let asked = asked.map_or(1.0, |times| {
        times.parse::<f64>().expect("NEPHROID_MUTATIONS is a factor")
    });
    (asked as u32).clamp(1, MOST_PARTS)
}

#[test]
fn random_input_breaks_nothing() {
    let Some(screen) = Screen::start("random input") else {
        return;
    };
    let mut viewer = Viewer::open(
        &screen,
        &["builtin:ring", "--map-resolution", "128", "--max-error", "0.05%"],
    );
    let mut random = Random(SEED);
    let (start, mut events) = (Instant::now(), 0);
    while start.elapsed() < PART * parts() {
        let mut deeds = String::new();
        for _ in 0..DEEDS {
            let (deed, count) = deed(&mut random, viewer.window());
            deeds += &deed;
            events += count;
        }
        viewer.hands(&deeds);
        assert!(viewer.runs(), "it ended: {}", viewer.stderr());
    }
    // Everything is let go, and whatever is baked now is stopped.
    let let_go: String = HELD.iter().map(|key| format!("keyup {key} ")).collect();
    let size = format!("windowsize {} {} {}", viewer.window(), SIZE.0, SIZE.1);
    viewer.hands(&format!("{let_go} mouseup 1 mouseup 3 {size} sleep 0.3"));
    viewer.forget();
    viewer.hands("mousemove 900 300 key Escape sleep 0.2 key Escape");
    let faults = viewer.all("fault");
    assert!(faults.is_empty(), "{faults:?}");
    let lost = viewer.all("device_lost");
    assert!(lost.is_empty(), "{lost:?}");
    let (status, stderr, log) = viewer.close_and_read();
    assert_eq!(status.code(), Some(0), "{stderr}");
    for bad in ["panicked", "alidation", "overflow"] {
        assert!(!stderr.contains(bad), "{stderr}");
    }
    let told = log.iter().rfind(|event| event["event"] == "latency");
    let told = told.expect("it is told at the end");
    println!("{events} events in {:?}: {told}", start.elapsed());
    check(&told["while_baking"]);
}

/// Percentiles in order, of some events; how long half of them and 95 % waited at most [ms].
fn check(waits: &Value) -> (f64, f64) {
    let ms = |name: &str| {
        waits[name]
            .as_f64()
            .unwrap_or_else(|| panic!("no {name}: {waits}"))
    };
    assert!(waits["count"].as_u64() > Some(20), "{waits}");
    let ordered = ["p50_ms", "p95_ms", "p99_ms", "max_ms"].map(ms);
    assert!(ordered.is_sorted() && ordered[0] > 0.0, "{waits}");
    (ordered[0], ordered[1])
}

/// The bake would take minutes: whoever waits for it, or for a core that it does not leave, waits longer than this.
#[test]
fn input_is_answered_while_a_long_bake_runs() {
    let Some(screen) = Screen::start("input while baking") else {
        return;
    };
    let arguments = [
        "builtin:ring",
        "--estimator",
        "splat",
        "--density",
        "3e7",
        "--layers",
        "caustic",
    ];
    let viewer = Viewer::open(&screen, &arguments);
    for step in 0..40 {
        // To and fro between the panel and the picture; every eighth time the camera is set back to where it is.
        let (x, y) = if step % 2 == 0 {
            (100, 200 + 5 * step)
        } else {
            (700 + 5 * step, 300)
        };
        let key = if step % 8 == 7 { "key c" } else { "" };
        viewer.hands(&format!("mousemove {x} {y} {key} sleep 0.1"));
    }
    let (status, stderr, log) = viewer.close_and_read();
    assert_eq!(status.code(), Some(0), "{stderr}");
    let ended = log.iter().filter(|event| event["event"] == "done").count();
    assert_eq!(ended, 0, "it baked all the time");
    let told = log.iter().rfind(|event| event["event"] == "latency");
    let told = told.expect("it is told at the end");
    println!("while baking: {}", told["while_baking"]);
    let (half, most) = check(&told["while_baking"]);
    assert!(half < 1e3 && most < 4e3, "{told}");
}
