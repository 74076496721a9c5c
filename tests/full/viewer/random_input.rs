//! Hands that know nothing: seeded random keys, clicks, drags, turns of the wheel and sizes of the window, while it bakes
//! and while it rests. `NEPHROID_MUTATIONS=3` and more make it a whole minute.

use std::time::{Duration, Instant};

use crate::damage::mutate::{Damage, effort};
use serde_json::Value;
use support::desktop::{SIZE, Screen, Viewer};

/// Of one part; there are at most three.
const PART: Duration = Duration::from_secs(20);
const MOST_PARTS: usize = 3;
/// Deeds between two looks at the clock.
const DEEDS: usize = 12;

/// Everything that the window has a meaning for, and some that it has none for.
const KEYS: &str = "w a s d q e c f r h v m p k g 1 2 9 ctrl+1 ctrl+2 ctrl+z ctrl+y ctrl+shift+z Escape Tab shift+Tab space \
    Return Up Down Left Right Page_Down Home BackSpace Delete 0 5 minus period F1 F12 x question shift+w alt+a";
const HELD: [&str; 8] = ["w", "a", "s", "d", "q", "e", "shift", "ctrl"];

/// Something to do, for xdotool.
fn deed(random: &mut Damage, window: &str) -> String {
    let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
    // As often over the panel as over the picture.
    let x = if random.below(2) == 0 {
        random.below(360)
    } else {
        random.below(width)
    };
    let y = random.below(height);
    match random.below(20) {
        0..=5 => format!("key {} ", random.one_of(&KEYS.split(' ').collect::<Vec<_>>())),
        6 | 7 => format!(
            "{} {} ",
            random.one_of(&["keydown", "keyup"]),
            random.one_of(&HELD)
        ),
        8..=12 => format!("mousemove {x} {y} click 1 "),
        13 => format!("mousemove {x} {y} click 3 "),
        14 | 15 => format!(
            "mousemove {x} {y} click --repeat 3 --delay 5 {} ",
            4 + random.below(2)
        ),
        16..=18 => {
            let button = random.one_of(&[1, 1, 3]);
            let (to_x, to_y) = (random.below(width), y + random.below(9));
            let way = format!(
                "mousemove {} {to_y} sleep 0.02 mousemove {to_x} {to_y}",
                (x + to_x) / 2
            );
            format!("mousemove {x} {y} mousedown {button} sleep 0.02 {way} sleep 0.02 mouseup {button} ")
        }
        _ => format!(
            "windowsize {window} {} {} ",
            300 + random.below(1000),
            200 + random.below(600)
        ),
    }
}

#[test]
fn random_input_breaks_nothing() {
    let Some(screen) = Screen::start() else {
        return;
    };
    let mut viewer = Viewer::open(&screen, "builtin:ring --map-resolution 128 --max-error 0.05%");
    let mut random = Damage::to("hands", 0);
    let start = Instant::now();
    while start.elapsed() < PART * effort().clamp(1, MOST_PARTS) as u32 {
        let deeds: String = (0..DEEDS).map(|_| deed(&mut random, viewer.place().1)).collect();
        viewer.hasty_hands(&deeds);
        assert!(viewer.runs(), "it ended: {}", viewer.stderr());
    }
    // Everything is let go, and whatever is baked now is stopped.
    let let_go: String = HELD.iter().map(|key| format!("keyup {key} ")).collect();
    let size = format!("windowsize {} {} {}", viewer.place().1, SIZE.0, SIZE.1);
    viewer.hands(&format!("{let_go} mouseup 1 mouseup 3 {size}"));
    viewer.forget();
    viewer.hands("mousemove 900 300 key Escape");
    viewer.hands("key Escape");
    for bad in ["fault", "device_lost"] {
        assert!(viewer.all(bad).is_empty(), "{:?}", viewer.all(bad));
    }
    let (stderr, log) = viewer.close();
    for bad in ["alidation", "overflow"] {
        assert!(!stderr.contains(bad), "{stderr}");
    }
    tell_waits(&log);
}

/// How long events waited while it baked: percentiles in order, of some events.
fn tell_waits(log: &[Value]) {
    let told = log.iter().rfind(|event| event["event"] == "latency");
    let waits = &told.expect("it is told at the end")["while_baking"];
    assert!(waits["count"].as_u64() > Some(20), "{waits}");
    let ms = ["p50_ms", "p95_ms", "p99_ms", "max_ms"].map(|name| waits[name].as_f64().expect("a number"));
    assert!(ms.is_sorted() && ms[0] > 0.0, "{waits}");
    println!("events while it baked waited {ms:?} ms: half, 95 %, 99 %, all of them");
}

/// Both bakes would take minutes: whoever waited for one would see it done.
#[test]
fn long_bake_leaves_room_for_input_and_ends() {
    let Some(screen) = Screen::start() else {
        return;
    };
    let long = "builtin:ring --density 3e7";
    let mut viewer = Viewer::open(&screen, &format!("{long} --estimator splat --layers caustic"));
    for step in 0..40 {
        // To and fro between the panel and the picture; every eighth time the camera is set back to where it is.
        let (x, y) = if step % 2 == 0 {
            (100, 200 + 5 * step)
        } else {
            (700 + 5 * step, 300)
        };
        let key = if step % 8 == 7 { "key c" } else { "" };
        viewer.hasty_hands(&format!("mousemove {x} {y} {key} sleep 0.1"));
    }
    // It closes while it reads and while it bakes.
    viewer.open_sections(&["Scene"]);
    viewer.type_into("TextInput", "File", "builtin:showroom");
    viewer.wait_for("opening", |_| true);
    let (_, log) = viewer.close();
    assert!(
        log.iter().all(|event| event["event"] != "done"),
        "it baked all the time"
    );
    tell_waits(&log);

    // So it does by a signal. The bake begins before the window is there.
    let viewer = Viewer::open(&screen, long);
    assert_eq!(viewer.signal("TERM").code(), Some(143));
}
