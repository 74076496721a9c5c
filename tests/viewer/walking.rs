//! On foot and in orbit, without a window: among boxes whose surfaces are known exactly.

use glam::{DVec2, DVec3};
use nephroid::scene::{Camera, Scene};
use nephroid::viewer::navigation::{BOOKMARKS, HeldKeys, Navigator, Travel};
use nephroid::viewer::solid::Solid;
use nephroid::viewer::walking::{EYE_M, SPEED_M_PER_S};

/// Axis-aligned boxes, from low to high corner [m].
struct Boxes(Vec<[DVec3; 2]>);

impl Solid for Boxes {
    fn meets(&self, from: DVec3, direction: DVec3, within_m: f64) -> Option<(f64, DVec3)> {
        let of_box = |[low, high]: &[DVec3; 2]| {
            let (mut near, mut far, mut normal) = (f64::NEG_INFINITY, f64::INFINITY, DVec3::ZERO);
            for axis in 0..3 {
                let inverse = 1.0 / direction[axis];
                let (a, b) = (
                    (low[axis] - from[axis]) * inverse,
                    (high[axis] - from[axis]) * inverse,
                );
                if a.min(b) > near {
                    near = a.min(b);
                    normal = DVec3::AXES[axis] * -direction[axis].signum();
                }
                far = far.min(a.max(b));
            }
            (near > 0.0 && near < far).then_some((near, normal))
        };
        let found = self
            .0
            .iter()
            .filter_map(of_box)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        found.filter(|(distance_m, _)| *distance_m < within_m)
    }
}

/// A floor with its top at 0, 20 m wide.
fn floor() -> [DVec3; 2] {
    [DVec3::new(-10.0, -1.0, -10.0), DVec3::new(10.0, 0.0, 10.0)]
}

fn at(position: DVec3, forward: DVec3) -> Navigator {
    let scene = Scene {
        cameras: vec![Camera::look_at("eye", position, position + forward, 1.0)],
        ..Scene::default()
    };
    Navigator::new(&scene, None)
}

fn walker(position: DVec3, forward: DVec3, solid: &Boxes) -> Navigator {
    let mut navigator = at(position, forward);
    navigator.set_travel(Travel::Walk, Some(solid));
    navigator
}

const FORWARD: HeldKeys = HeldKeys {
    forward: true,
    backward: false,
    left: false,
    right: false,
    up: false,
    down: false,
    run: false,
    creep: false,
};

/// Some seconds, in so many frames.
fn pass(navigator: &mut Navigator, solid: &Boxes, seconds: f64, frames: usize) {
    for _ in 0..frames {
        navigator.advance_among(seconds / frames as f64, solid);
    }
}

fn eye(navigator: &Navigator) -> DVec3 {
    navigator.camera().position
}

#[test]
fn eyes_come_to_rest_above_the_ground_and_walk_at_their_height() {
    let ground = Boxes(vec![floor()]);
    let mut navigator = walker(DVec3::new(0.0, 5.0, 4.0), DVec3::new(0.0, -0.7, -1.0), &ground);
    // 3.4 m take 0.83 s.
    pass(&mut navigator, &ground, 0.5, 30);
    let fallen_m = 5.0 - eye(&navigator).y;
    assert!(
        (fallen_m - 0.5 * 9.81 * 0.25).abs() < 0.05,
        "{fallen_m} m in 0.5 s"
    );
    pass(&mut navigator, &ground, 2.0, 120);
    assert!((eye(&navigator).y - EYE_M).abs() < 1e-3, "{}", eye(&navigator));
    assert!(!navigator.is_moving(), "it rests");
    navigator.keys = FORWARD;
    pass(&mut navigator, &ground, 2.0, 60);
    let walked = eye(&navigator) - DVec3::new(0.0, EYE_M, 4.0);
    assert!(
        (walked.z + 2.0 * SPEED_M_PER_S).abs() < 0.15,
        "{walked}: along the ground, wherever it looks"
    );
    assert!(walked.x.abs() < 1e-9 && walked.y.abs() < 1e-3, "{walked}");
}

#[test]
fn a_wall_stops_the_walk_at_every_frame_rate_and_lets_it_slide() {
    let wall = [DVec3::new(-10.0, 0.0, -3.2), DVec3::new(10.0, 3.0, -3.0)];
    let room = Boxes(vec![floor(), wall]);
    for frames in [8, 60, 2000] {
        for run in [false, true] {
            let mut navigator = walker(DVec3::new(0.0, EYE_M, 0.0), DVec3::NEG_Z, &room);
            navigator.keys = HeldKeys { run, ..FORWARD };
            pass(&mut navigator, &room, 4.0, frames);
            let z = eye(&navigator).z;
            assert!((-2.76..-2.7).contains(&z), "{frames} frames, running {run}: {z}");
            // Flying goes through.
            navigator.set_travel(Travel::Fly, None);
            pass(&mut navigator, &room, 4.0, frames);
            assert!(eye(&navigator).z < -3.2);
        }
    }
    // Slantwise it slides along.
    let mut navigator = walker(DVec3::new(0.0, EYE_M, -2.0), DVec3::new(1.0, 0.0, -1.0), &room);
    navigator.keys = FORWARD;
    pass(&mut navigator, &room, 4.0, 240);
    let end = eye(&navigator);
    assert!(end.z > -2.76 && end.x > 3.0, "{end}");
}

#[test]
fn past_a_corner_it_goes_straight_on_at_every_frame_rate() {
    // The front of a cupboard is slid along to its corner; the end of the room is behind it.
    let cupboard = [DVec3::new(-2.0, 0.0, -1.4), DVec3::new(0.1, 2.0, -1.0)];
    let end = [DVec3::new(-10.0, 0.0, -9.0), DVec3::new(10.0, 3.0, -8.0)];
    let room = Boxes(vec![floor(), cupboard, end]);
    let mut places = Vec::new();
    for frames in [2, 14, 168, 1400] {
        let mut navigator = walker(DVec3::new(0.0, EYE_M, 1.0), DVec3::new(0.2, 0.0, -1.0), &room);
        navigator.keys = HeldKeys { run: true, ..FORWARD };
        pass(&mut navigator, &room, 1.4, frames);
        let past = eye(&navigator);
        assert!((-8.0..-1.4).contains(&past.z), "{frames} frames: {past}");
        places.push(past);
    }
    for place in &places {
        assert!(place.distance(places[3]) < 0.1, "{places:?}");
    }
}

#[test]
fn being_pushed_off_a_wall_gives_no_speed_however_short_the_frame() {
    let wall = [DVec3::new(-10.0, 0.0, -3.2), DVec3::new(10.0, 3.0, -3.0)];
    let room = Boxes(vec![floor(), wall]);
    for frame_s in [1e-7, 1e-5, 1e-3, 0.1] {
        // Nearer than anyone gets on foot: who came flying.
        let mut navigator = walker(DVec3::new(0.0, EYE_M, -2.9), DVec3::new(1.0, 0.0, -1.0), &room);
        navigator.keys = FORWARD;
        for _ in 0..40 {
            navigator.advance_among(frame_s, &room);
        }
        navigator.keys = HeldKeys::default();
        pass(&mut navigator, &room, 1.0, 60);
        let end = eye(&navigator);
        assert!((-3.0..-2.7).contains(&end.z), "frames of {frame_s} s: {end}");
        assert!(
            end.x < 40.0 * frame_s * SPEED_M_PER_S + 0.2,
            "frames of {frame_s} s: {end}"
        );
    }
}

#[test]
fn steps_are_climbed_and_tables_are_not() {
    let step = [DVec3::new(-10.0, 0.0, -10.0), DVec3::new(10.0, 0.3, -2.0)];
    let table = [DVec3::new(-10.0, 0.0, -10.0), DVec3::new(10.0, 0.9, -5.0)];
    let stairs = Boxes(vec![floor(), step, table]);
    let mut navigator = walker(DVec3::new(0.0, EYE_M, 0.0), DVec3::NEG_Z, &stairs);
    navigator.keys = FORWARD;
    pass(&mut navigator, &stairs, 6.0, 360);
    let up = eye(&navigator);
    assert!((up.y - (EYE_M + 0.3)).abs() < 1e-2, "{up}: on the step");
    assert!((-4.76..-4.7).contains(&up.z), "{up}: before the table");
    navigator.keys = HeldKeys {
        backward: true,
        ..HeldKeys::default()
    };
    pass(&mut navigator, &stairs, 5.0, 300);
    assert!(
        (eye(&navigator).y - EYE_M).abs() < 1e-2,
        "down again: {}",
        eye(&navigator)
    );
}

#[test]
fn who_comes_flying_low_is_lifted_to_standing_height() {
    let ground = Boxes(vec![floor()]);
    let mut navigator = walker(DVec3::new(0.0, 0.3, 0.0), DVec3::NEG_Z, &ground);
    pass(&mut navigator, &ground, 2.0, 120);
    assert!((eye(&navigator).y - EYE_M).abs() < 1e-3, "{}", eye(&navigator));
}

#[test]
fn nobody_falls_out_of_the_world() {
    let nothing = Boxes(Vec::new());
    let start = DVec3::new(1.0, 2.0, 3.0);
    let mut navigator = walker(start, DVec3::NEG_Z, &nothing);
    pass(&mut navigator, &nothing, 10.0, 100);
    assert_eq!(eye(&navigator), start);
    assert!(!navigator.is_moving());
}

#[test]
fn an_orbit_keeps_its_distance_and_what_it_looks_at() {
    let ground = Boxes(vec![floor()]);
    let start = DVec3::new(0.0, 2.0, 4.0);
    let pivot = DVec3::new(0.0, 0.0, 0.0);
    let mut navigator = at(start, pivot - start);
    navigator.set_travel(Travel::Orbit, Some(&ground));
    let distance_m = start.distance(pivot);
    for counts in [
        DVec2::new(300.0, 0.0),
        DVec2::new(-1000.0, 40.0),
        DVec2::new(77.0, -200.0),
    ] {
        navigator.look(counts);
        let camera = navigator.camera();
        assert!((camera.position.distance(pivot) - distance_m).abs() < 1e-9);
        assert!(((pivot - camera.position).normalize() - camera.forward).length() < 1e-9);
    }
    // Ten notches nearer, as the wheel says.
    navigator.wheel(10.0);
    let camera = navigator.camera();
    let expected_m = distance_m * 1.05_f64.powi(-10);
    assert!((camera.position.distance(pivot) - expected_m).abs() < 1e-9);
    assert!(((pivot - camera.position).normalize() - camera.forward).length() < 1e-9);
    // However long W is held, it does not go through.
    navigator.keys = FORWARD;
    pass(&mut navigator, &ground, 100.0, 100);
    let camera = navigator.camera();
    assert!((pivot - camera.position).dot(camera.forward) > 0.0);
    assert!(camera.position.is_finite());
}

#[test]
fn views_are_kept_and_come_back() {
    let mut navigator = at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, -0.5, -2.0));
    assert!(!navigator.go_to_bookmark(0), "none is kept yet");
    assert!(navigator.set_bookmark(0));
    assert!(!navigator.set_bookmark(BOOKMARKS));
    let kept = navigator.camera();
    navigator.keys = FORWARD;
    navigator.advance(1.0);
    navigator.look(DVec2::new(100.0, 20.0));
    navigator.stop();
    assert!(navigator.camera().position.distance(kept.position) > 0.1);
    assert!(navigator.go_to_bookmark(0));
    let back = navigator.camera();
    assert!(back.position.distance(kept.position) < 1e-12 && back.forward.distance(kept.forward) < 1e-12);
    assert!((back.vertical_fov_rad - kept.vertical_fov_rad).abs() < 1e-12);
}

#[test]
fn care_is_slower_and_haste_is_faster() {
    let path_m = |keys: HeldKeys| {
        let mut navigator = at(DVec3::ZERO, DVec3::NEG_Z);
        navigator.keys = keys;
        navigator.advance(10.0);
        navigator.camera().position.length()
    };
    let plain_m = path_m(FORWARD);
    let creep = HeldKeys {
        creep: true,
        ..FORWARD
    };
    let run = HeldKeys { run: true, ..FORWARD };
    assert!((path_m(creep) / plain_m - 0.25).abs() < 1e-9);
    assert!((path_m(run) / plain_m - 4.0).abs() < 1e-9);
}
