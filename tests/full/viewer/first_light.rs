//! What the window shows first, and how it ends meanwhile.

use serde_json::Value;

use support::desktop::{Screen, Viewer};

const GALLERY: &str = "builtin:gallery --preset draft --layers caustic,direct,indirect";

/// Direct and indirect light come before any caustic, and the exposure that suits them stays.
#[test]
fn the_room_is_lit_before_its_caustics() {
    let Some(screen) = Screen::start() else {
        return;
    };
    let mut viewer = Viewer::open(&screen, GALLERY);
    let first = viewer.wait_for("level", |_| true);
    assert_eq!((&first["rays"], &first["shown"]), (&0.into(), &true.into()));
    let stops = |event: Value| event["exposure_stops"].as_f64().expect("a number");
    let exposed = stops(viewer.wait_for("exposure", |_| true));
    viewer.wait_for("level", |level| level["rays"].as_u64() > Some(0));
    let moved = stops(viewer.wait_for("exposure", |_| true)) - exposed;
    assert!(moved.abs() <= 0.5, "{moved} stops");
    viewer.close();
}

/// Whether it is asked to close or its window is taken away, whatever it is at.
#[test]
fn it_ends_quietly_while_it_bakes() {
    let Some(screen) = Screen::start() else {
        return;
    };
    for what_comes_first in ["upload", "level", "exposure"] {
        for end in [Viewer::close, Viewer::destroy] {
            let mut viewer = Viewer::open(&screen, GALLERY);
            viewer.wait_for(what_comes_first, |_| true);
            end(viewer);
        }
    }
}
