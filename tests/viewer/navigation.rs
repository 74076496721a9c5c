//! The fly camera, without a window.

use glam::{DVec2, DVec3};
use nephroid::scene::{Camera, Material, Mesh, Object, Scene};
use nephroid::viewer::navigation::{HeldKeys, Navigator};

/// A scene whose box is a cube of that side around a centre.
fn cube(side_m: f64, centre: DVec3, cameras: Vec<Camera>) -> Scene {
    let corner = |sign: f64| centre + DVec3::splat(0.5 * sign * side_m);
    let mesh = Mesh {
        positions: vec![corner(-1.0), corner(1.0), centre],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    Scene {
        objects: vec![Object {
            name: "cube".into(),
            node: 0,
            primitive: 0,
            material: 0,
            mesh: mesh.into(),
        }],
        materials: vec![Material::default()],
        cameras,
        ..Scene::default()
    }
}

fn forward() -> HeldKeys {
    HeldKeys {
        forward: true,
        ..HeldKeys::default()
    }
}

#[test]
fn a_flight_ends_at_the_same_place_at_every_frame_rate() {
    let scene = cube(2.0, DVec3::ZERO, Vec::new());
    let fly = |frames_per_s: usize| {
        let mut navigator = Navigator::new(&scene, None);
        for (keys, seconds) in [
            (forward(), 1.0),
            (
                HeldKeys {
                    right: true,
                    run: true,
                    ..HeldKeys::default()
                },
                0.5,
            ),
        ] {
            navigator.keys = keys;
            let frames = (frames_per_s as f64 * seconds) as usize;
            for _ in 0..frames {
                navigator.advance(seconds / frames as f64);
            }
        }
        navigator.camera().position
    };
    let slow = fly(4);
    assert!(
        (slow - Navigator::new(&scene, None).camera().position).length() > 0.1,
        "it flew"
    );
    for frames_per_s in [30, 60, 1000] {
        assert!(
            (fly(frames_per_s) - slow).length() < 1e-9,
            "{frames_per_s} frames/s"
        );
    }
}

#[test]
fn a_larger_scene_is_flown_through_in_the_same_time() {
    let distance = |side_m: f64| {
        let mut navigator = Navigator::new(&cube(side_m, DVec3::ZERO, Vec::new()), None);
        let start = navigator.camera().position;
        navigator.keys = forward();
        navigator.advance(1.0);
        (navigator.camera().position - start).length() / side_m
    };
    let (small, large) = (distance(0.01), distance(1000.0));
    assert!(
        small > 0.0 && (small / large - 1.0).abs() < 1e-9,
        "{small} {large}"
    );
}

#[test]
fn released_keys_come_to_rest_smoothly() {
    let mut navigator = Navigator::new(&cube(2.0, DVec3::ZERO, Vec::new()), None);
    assert!(!navigator.is_moving());
    navigator.keys = forward();
    navigator.advance(0.5);
    navigator.keys = HeldKeys::default();
    assert!(navigator.is_moving(), "it glides on");
    let mut steps = Vec::new();
    let mut before = navigator.camera().position;
    while navigator.is_moving() {
        navigator.advance(1.0 / 60.0);
        steps.push((navigator.camera().position - before).length());
        before = navigator.camera().position;
        assert!(steps.len() < 200, "it never rests");
    }
    assert!(
        steps.windows(2).all(|pair| pair[1] < pair[0]),
        "each step is shorter: {steps:?}"
    );
    assert!(steps.len() > 5, "it does not stop at once");
}

#[test]
fn opposite_keys_cancel_and_diagonals_are_no_faster() {
    let scene = cube(2.0, DVec3::ZERO, Vec::new());
    let flown = |keys: HeldKeys| {
        let mut navigator = Navigator::new(&scene, None);
        let start = navigator.camera().position;
        navigator.keys = keys;
        navigator.advance(1.0);
        (navigator.camera().position - start).length()
    };
    let straight = flown(forward());
    assert_eq!(
        flown(HeldKeys {
            forward: true,
            backward: true,
            ..HeldKeys::default()
        }),
        0.0
    );
    let diagonal = flown(HeldKeys {
        forward: true,
        right: true,
        ..HeldKeys::default()
    });
    assert!((diagonal / straight - 1.0).abs() < 1e-9, "{diagonal} {straight}");
    let running = flown(HeldKeys {
        run: true,
        ..forward()
    });
    assert!(running > 3.0 * straight);
}

#[test]
fn the_gaze_never_tips_over() {
    let mut navigator = Navigator::new(&cube(2.0, DVec3::ZERO, Vec::new()), None);
    let heading = navigator.camera().right();
    for step in [-1e5, 1e5] {
        navigator.look(DVec2::new(0.0, step));
        let camera = navigator.camera();
        assert!(
            (camera.forward.y.abs() - 1.0).abs() < 1e-12,
            "looks straight up or down: {}",
            camera.forward
        );
        assert!(
            (camera.forward.y + step.signum()).abs() < 1e-12,
            "mouse down looks down"
        );
        assert!(camera.up.y > -1e-12, "never upside down");
        assert!((camera.right() - heading).length() < 1e-9, "the heading stays");
        assert!(camera.forward.dot(camera.up).abs() < 1e-12);
    }
    navigator.look(DVec2::new(0.0, -1e5));
    navigator.look(DVec2::new(100.0, 628.0));
    assert!(navigator.camera().right().dot(heading) < 1.0 - 1e-3, "turned");
}

#[test]
fn a_turn_to_the_right_looks_to_the_right() {
    let mut navigator = Navigator::new(&cube(2.0, DVec3::ZERO, Vec::new()), None);
    let before = navigator.camera();
    navigator.look(DVec2::new(40.0, 0.0));
    assert!(navigator.camera().forward.dot(before.right()) > 0.05);
}

#[test]
fn twenty_notches_up_and_down_restore_the_speed() {
    let mut navigator = Navigator::new(&cube(2.0, DVec3::ZERO, Vec::new()), None);
    let speed = navigator.speed_m_per_s();
    navigator.wheel(1.0);
    assert!((navigator.speed_m_per_s() / speed - 1.05).abs() < 1e-12);
    navigator.wheel(19.0);
    navigator.wheel(-20.0);
    assert!((navigator.speed_m_per_s() / speed - 1.0).abs() < 1e-12);
    navigator.wheel(1e9);
    assert!(navigator.speed_m_per_s().is_finite());
    navigator.wheel(-1e9);
    assert!(navigator.speed_m_per_s() > 0.0);
}

#[test]
fn the_files_cameras_are_shown_exactly_and_in_turn() {
    let level = Camera::look_at("level", DVec3::new(3.0, 1.0, 2.0), DVec3::ZERO, 0.7);
    let down = Camera {
        up: DVec3::new(0.6, 0.0, -0.8),
        ..Camera::look_at("down", DVec3::new(0.0, 4.0, 0.0), DVec3::ZERO, 1.1)
    };
    let (sin, cos) = 0.3_f64.sin_cos();
    let tilted = Camera {
        up: level.up * cos + level.right() * sin,
        name: "tilted".into(),
        ..level.clone()
    };
    let cameras = vec![level, down, tilted];
    let mut navigator = Navigator::new(&cube(2.0, DVec3::ZERO, cameras.clone()), Some("down"));
    for expected in [&cameras[1], &cameras[2], &cameras[0], &cameras[1]] {
        let shown = navigator.camera();
        assert!(
            (shown.position - expected.position).length() < 1e-12,
            "{}",
            expected.name
        );
        assert!(
            (shown.forward - expected.forward).length() < 1e-9,
            "{}: {shown:?}",
            expected.name
        );
        assert!(
            (shown.up - expected.up).length() < 1e-9,
            "{}: {shown:?}",
            expected.name
        );
        assert!((shown.vertical_fov_rad - expected.vertical_fov_rad).abs() < 1e-12);
        assert!(navigator.next_camera().is_some());
    }
    let mut without = Navigator::new(&cube(2.0, DVec3::ZERO, Vec::new()), None);
    assert!(without.next_camera().is_none());
}

#[test]
fn framing_shows_the_whole_box_and_fills_the_picture() {
    for (aspect, centre) in [(1.8, DVec3::ZERO), (0.5, DVec3::new(100.0, -3.0, 7.0))] {
        let scene = cube(2.0, centre, Vec::new());
        let mut navigator = Navigator::new(&scene, None);
        navigator.keys = forward();
        navigator.advance(3.0);
        navigator.look(DVec2::new(500.0, 200.0));
        navigator.frame(aspect);
        check_framed(&navigator, aspect, (centre, 1.0));
        // A part of it that is far smaller.
        let part = centre + DVec3::new(0.9, -0.3, 0.5);
        for half in [0.3, 1e-4] {
            navigator.frame_ball(part, half * 3.0_f64.sqrt(), aspect);
            check_framed(&navigator, aspect, (part, half));
        }
    }
}

/// Whether a cube of that half width fills the picture and is all in it.
fn check_framed(navigator: &Navigator, aspect: f64, (centre, half): (DVec3, f64)) {
    let camera = navigator.camera_for(aspect);
    let tan = (0.5 * camera.vertical_fov_rad).tan();
    let mut largest: f64 = 0.0;
    for corner in 0..8 {
        let sign = |bit: u32| if corner >> bit & 1 == 0 { -half } else { half };
        let d = centre + DVec3::new(sign(0), sign(1), sign(2)) - camera.position;
        let depth = d.dot(camera.forward);
        let x = d.dot(camera.right()) / depth / (tan * aspect);
        let y = d.dot(camera.up) / depth / tan;
        assert!(
            depth > camera.near_m && x.abs() <= 1.0 && y.abs() <= 1.0,
            "{x} {y}"
        );
        largest = largest.max(x.abs()).max(y.abs());
    }
    assert!(largest > 0.4, "the box is lost in the picture: {largest}");
}

#[test]
fn an_empty_scene_has_a_camera_too() {
    let camera = Navigator::new(&Scene::default(), Some("no such camera")).camera();
    assert!(camera.position.is_finite() && camera.near_m > 0.0);
}

#[test]
fn a_narrow_picture_shows_all_that_a_wide_one_does() {
    let navigator = Navigator::new(&cube(2.0, DVec3::ZERO, Vec::new()), None);
    let half_width = |aspect: f64| aspect * (0.5 * navigator.camera_for(aspect).vertical_fov_rad).tan();
    let wide = half_width(16.0 / 9.0);
    for aspect in [1.0, 1.3, 1.7] {
        assert!((half_width(aspect) / wide - 1.0).abs() < 1e-12, "{aspect}");
    }
    let composed = navigator.camera().vertical_fov_rad;
    assert!(
        (navigator.camera_for(2.5).vertical_fov_rad - composed).abs() < 1e-12,
        "wider ones show more"
    );
    assert!(
        navigator.camera_for(1e-4).vertical_fov_rad < 3.0,
        "no picture is so narrow as to show everything"
    );
}
