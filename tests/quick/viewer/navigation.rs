//! The camera: flying, on foot and in orbit, among boxes whose surfaces are known exactly; and handles in the picture: what a
//! gaze points at, how far a pull moves, and where nodes stand afterwards.

use nephroid::viewer::gizmo::{Handle, light_at};
use nephroid::viewer::lens::Viewport;
use nephroid::viewer::navigation::{HeldKeys, Navigator};
use nephroid::viewer::walking::{Collider, EYE_M, SPEED_M_PER_S};

use super::fixtures::scene;
use super::*;

/// A scene whose box is a cube of that side around a centre.
fn cube(side_m: f64, centre: DVec3, cameras: Vec<Camera>) -> Scene {
    let corner = |sign: f64| centre + DVec3::splat(0.5 * sign * side_m);
    let mesh = Mesh {
        positions: vec![corner(-1.0), corner(1.0), centre],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let mut scene = with(Scene::default(), |it| it.cameras = cameras);
    parts::add(&mut scene, "cube", mesh, Material::default());
    scene
}

fn in_cube() -> Navigator {
    Navigator::new(&cube(2.0, DVec3::ZERO, Vec::new()), None)
}

fn at(position: DVec3, forward: DVec3) -> Navigator {
    let scene = Scene {
        cameras: vec![Camera::look_at("eye", position, position + forward, 1.0)],
        ..Scene::default()
    };
    Navigator::new(&scene, None)
}

/// By their letters; r runs and c creeps.
fn keys(held: &str) -> HeldKeys {
    HeldKeys {
        forward: held.contains('w'),
        backward: held.contains('s'),
        right: held.contains('d'),
        run: held.contains('r'),
        creep: held.contains('c'),
        ..HeldKeys::default()
    }
}

fn eye(navigator: &Navigator) -> DVec3 {
    navigator.camera().position
}

#[test]
fn flights_end_the_same_at_every_frame_rate() {
    let fly = |frames_per_s: f64| {
        let mut navigator = in_cube();
        for (held, seconds) in [("w", 1.0), ("dr", 0.5)] {
            navigator.keys = keys(held);
            let frames = frames_per_s * seconds;
            (0..frames as usize).for_each(|_| navigator.advance(seconds / frames));
        }
        eye(&navigator)
    };
    assert!(fly(4.0).distance(eye(&in_cube())) > 0.1, "it flew");
    for frames_per_s in [30.0, 60.0, 1000.0] {
        near(fly(frames_per_s), fly(4.0), 1e-9, frames_per_s);
    }
}

#[test]
fn speed_is_of_the_scene_and_the_keys() {
    let flown = |side_m: f64, held: &str| {
        let mut navigator = Navigator::new(&cube(side_m, DVec3::ZERO, Vec::new()), None);
        let start = eye(&navigator);
        navigator.keys = keys(held);
        navigator.advance(1.0);
        eye(&navigator).distance(start)
    };
    let straight = flown(2.0, "w");
    assert!(straight > 0.0);
    for (side_m, held, expected) in [
        // A larger scene is flown through in the same time.
        (0.01, "w", 0.005),
        (1000.0, "w", 500.0),
        // A diagonal is no faster.
        (2.0, "wd", 1.0),
        (2.0, "ws", 0.0),
        (2.0, "wr", 4.0),
        (2.0, "wc", 0.25),
    ] {
        let times = flown(side_m, held) / straight;
        assert!((times - expected).abs() <= 1e-9 * expected, "{held}: {times}");
    }
}

#[test]
fn released_keys_come_to_rest_smoothly() {
    let mut navigator = in_cube();
    assert!(!navigator.is_moving());
    navigator.keys = keys("w");
    navigator.advance(0.5);
    navigator.keys = keys("");
    let mut steps = Vec::new();
    while navigator.is_moving() {
        let before = eye(&navigator);
        navigator.advance(1.0 / 60.0);
        steps.push(eye(&navigator).distance(before));
        assert!(steps.len() < 200, "it never rests");
    }
    let is_smooth = steps.len() > 5 && steps.is_sorted_by(|a, b| a > b);
    assert!(is_smooth, "each step is shorter: {steps:?}");
}

#[test]
fn gaze_turns_and_never_tips_over() {
    let mut navigator = in_cube();
    let heading = navigator.camera().right();
    for step in [-1e5, 1e5] {
        navigator.look(dvec2(0.0, step));
        let camera = navigator.camera();
        // Straight up or down; mouse down looks down.
        near(camera.forward.y, -step.signum(), 1e-12, step);
        assert!(camera.up.y > -1e-12, "never upside down");
        near(camera.right(), heading, 1e-9, "the heading stays");
        near(camera.forward.dot(camera.up), 0.0, 1e-12, step);
    }
    navigator.look(dvec2(0.0, -1e5));
    navigator.look(dvec2(100.0, 628.0));
    assert!(navigator.camera().right().dot(heading) < 1.0 - 1e-3, "turned");
    let mut navigator = in_cube();
    navigator.look(dvec2(40.0, 0.0));
    assert!(navigator.camera().forward.dot(heading) > 0.05, "to the right");
}

#[test]
fn wheel_changes_the_speed_and_back() {
    let mut navigator = in_cube();
    let speed = navigator.speed_m_per_s();
    for (notches, times) in [(1.0, 1.05), (19.0, 1.05_f64.powi(20)), (-20.0, 1.0)] {
        navigator.wheel(notches);
        near(navigator.speed_m_per_s() / speed / times, 1.0, 1e-12, notches);
    }
    for notches in [1e9, -1e9] {
        navigator.wheel(notches);
        let speed = navigator.speed_m_per_s();
        assert!(speed.is_finite() && speed > 0.0, "{speed}");
    }
}

fn assert_view(shown: &Camera, expected: &Camera) {
    near(shown.position, expected.position, 1e-12, "position");
    near(shown.forward, expected.forward, 1e-9, "forward");
    near(shown.up, expected.up, 1e-9, "up");
    near(
        shown.vertical_fov_rad,
        expected.vertical_fov_rad,
        1e-12,
        "angle of view",
    );
}

#[test]
fn cameras_of_the_file_are_shown_in_turn() {
    let level = Camera::look_at("level", dvec3(3.0, 1.0, 2.0), DVec3::ZERO, 0.7);
    let down = Camera {
        up: dvec3(0.6, 0.0, -0.8),
        ..Camera::look_at("down", dvec3(0.0, 4.0, 0.0), DVec3::ZERO, 1.1)
    };
    let (sin, cos) = 0.3_f64.sin_cos();
    let tilted = Camera {
        up: level.up * cos + level.right() * sin,
        name: "tilted".into(),
        ..level.clone()
    };
    let cameras = vec![level, down, tilted];
    let mut navigator = Navigator::new(&cube(2.0, DVec3::ZERO, cameras.clone()), Some("down"));
    for expected in [1, 2, 0, 1] {
        assert_view(&navigator.camera(), &cameras[expected]);
        assert!(navigator.next_camera().is_some());
    }
    assert!(in_cube().next_camera().is_none());
    let empty = Navigator::new(&Scene::default(), Some("no such camera")).camera();
    assert!(empty.position.is_finite() && empty.near_m > 0.0);
}

/// A plan that is cut below the ceiling, until somebody walks there.
#[test]
fn what_a_camera_cuts_away_is_met_once_it_moves() {
    let plan = Camera {
        near_m: 3.5,
        ..Camera::look_at("plan", dvec3(0.0, 4.0, 0.0), DVec3::ZERO, 1.1)
    };
    let stand = || Navigator::new(&cube(2.0, DVec3::ZERO, vec![plan.clone()]), None);
    assert_eq!(stand().camera().near_m, 3.5);
    let mut walked = stand();
    walked.keys = keys("w");
    walked.advance(0.1);
    let mut nearer = stand();
    nearer.set_travel(NavigationMode::Orbit, None);
    nearer.wheel(1.0);
    for moved in [walked, nearer] {
        assert!(moved.camera().near_m < 0.01, "{}", moved.camera().near_m);
    }
}

/// A sky dome is no part of what is framed, nor does it make the camera fast.
#[test]
fn a_dome_around_a_scene_changes_no_view() {
    let scene = cube(2.0, DVec3::ZERO, Vec::new());
    let mut under_sky = scene.clone();
    under_sky
        .objects
        .extend(cube(40.0, DVec3::ZERO, Vec::new()).objects);
    let [alone, within] = [scene, under_sky].map(|scene| Navigator::new(&scene, None));
    assert_view(&within.camera(), &alone.camera());
    assert_eq!(within.speed_m_per_s(), alone.speed_m_per_s());
}

#[test]
fn framing_shows_the_whole_box() {
    for (aspect, centre) in [(1.8, DVec3::ZERO), (0.5, dvec3(100.0, -3.0, 7.0))] {
        let mut navigator = Navigator::new(&cube(2.0, centre, Vec::new()), None);
        navigator.keys = keys("w");
        navigator.advance(3.0);
        navigator.look(dvec2(500.0, 200.0));
        navigator.frame(aspect);
        assert_framed(&navigator, aspect, (centre, 1.0));
        // A part of it that is far smaller.
        let part = centre + dvec3(0.9, -0.3, 0.5);
        for half in [0.3, 1e-4] {
            navigator.frame_ball(part, half * 3.0_f64.sqrt(), aspect);
            assert_framed(&navigator, aspect, (part, half));
        }
    }
}

/// A cube of that half width fills the picture and is all in it.
fn assert_framed(navigator: &Navigator, aspect: f64, (centre, half): (DVec3, f64)) {
    let camera = navigator.camera_for(aspect);
    let tan = (0.5 * camera.vertical_fov_rad).tan();
    let mut largest: f64 = 0.0;
    for corner in 0..8 {
        let sign = |bit: u32| if corner >> bit & 1 == 0 { -half } else { half };
        let d = centre + dvec3(sign(0), sign(1), sign(2)) - camera.position;
        let depth = d.dot(camera.forward);
        let x = d.dot(camera.right()) / depth / (tan * aspect);
        let most = x.abs().max((d.dot(camera.up) / depth / tan).abs());
        assert!(depth > camera.near_m && most <= 1.0, "{most}");
        largest = largest.max(most);
    }
    assert!(largest > 0.4, "the box is lost in the picture: {largest}");
}

#[test]
fn narrow_pictures_show_what_wide_ones_do() {
    let navigator = in_cube();
    let fov = |aspect: f64| navigator.camera_for(aspect).vertical_fov_rad;
    let half_width = |aspect: f64| aspect * (0.5 * fov(aspect)).tan();
    for aspect in [1.0, 1.3, 1.7] {
        near(half_width(aspect) / half_width(16.0 / 9.0), 1.0, 1e-12, aspect);
    }
    let composed = navigator.camera().vertical_fov_rad;
    near(fov(2.5), composed, 1e-12, "wider ones show more");
    assert!(fov(1e-4) < 3.0, "no picture is so narrow as to show everything");
}

/// Axis-aligned boxes, from low to high corner [m].
struct Boxes(Vec<[DVec3; 2]>);

impl Collider for Boxes {
    fn meets(&self, from: DVec3, direction: DVec3, within_m: f64) -> Option<(f64, DVec3)> {
        let of_box = |[low, high]: &[DVec3; 2]| {
            let (mut near, mut far, mut normal) = (f64::NEG_INFINITY, f64::INFINITY, DVec3::ZERO);
            for axis in 0..3 {
                let at = |end: &DVec3| (end[axis] - from[axis]) / direction[axis];
                let (a, b) = (at(low), at(high));
                if a.min(b) > near {
                    near = a.min(b);
                    normal = DVec3::AXES[axis] * -direction[axis].signum();
                }
                far = far.min(a.max(b));
            }
            (near > 0.0 && near < far && near < within_m).then_some((near, normal))
        };
        let met = self.0.iter().filter_map(of_box);
        met.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// A floor with its top at 0, 20 m wide, and boxes on it from (x, z) to (x, z) with their heights [m].
fn room(boxes: &[[f64; 5]]) -> Boxes {
    let mut all = vec![[dvec3(-10.0, -1.0, -10.0), dvec3(10.0, 0.0, 10.0)]];
    let of = |[x0, z0, x1, z1, height]: &[f64; 5]| [dvec3(*x0, 0.0, *z0), dvec3(*x1, *height, *z1)];
    all.extend(boxes.iter().map(of));
    Boxes(all)
}

const WALL: [f64; 5] = [-10.0, -3.2, 10.0, -3.0, 3.0];

fn walker(position: DVec3, forward: DVec3, solid: &dyn Collider, held: &str) -> Navigator {
    let mut navigator = at(position, forward);
    navigator.set_travel(NavigationMode::Walk, Some(solid));
    navigator.keys = keys(held);
    navigator
}

fn pass(navigator: &mut Navigator, solid: &dyn Collider, seconds: f64, frames: usize) {
    for _ in 0..frames {
        navigator.advance_among(seconds / frames as f64, solid);
    }
}

#[test]
fn eyes_rest_above_the_ground_and_walk() {
    let ground = room(&[]);
    let forward = dvec3(0.0, -0.7, -1.0);
    let mut navigator = walker(dvec3(0.0, 5.0, 4.0), forward, &ground, "");
    // 3.4 m take 0.83 s.
    pass(&mut navigator, &ground, 0.5, 30);
    let fallen_m = 5.0 - eye(&navigator).y;
    near(fallen_m, 0.5 * 9.81 * 0.25, 0.05, fallen_m);
    pass(&mut navigator, &ground, 2.0, 120);
    assert!((eye(&navigator).y - EYE_M).abs() < 1e-3 && !navigator.is_moving());
    navigator.keys = keys("w");
    pass(&mut navigator, &ground, 2.0, 60);
    // Along the ground, wherever it looks.
    let walked = eye(&navigator) - dvec3(0.0, EYE_M, 4.0);
    assert!((walked.z + 2.0 * SPEED_M_PER_S).abs() < 0.15, "{walked}");
    assert!(walked.x.abs() < 1e-9 && walked.y.abs() < 1e-3, "{walked}");
    // Who comes flying low is lifted.
    let mut low = walker(DVec3::Y * 0.3, DVec3::NEG_Z, &ground, "");
    pass(&mut low, &ground, 2.0, 120);
    near(eye(&low).y, EYE_M, 1e-3, "lifted");
    // Nobody falls out of the world.
    let nothing = Boxes(Vec::new());
    let mut lost = walker(DVec3::ONE, DVec3::NEG_Z, &nothing, "");
    pass(&mut lost, &nothing, 10.0, 100);
    assert!(eye(&lost) == DVec3::ONE && !lost.is_moving());
}

#[test]
fn a_wall_stops_the_walk_and_lets_it_slide() {
    let room = room(&[WALL]);
    for frames in [8, 60, 2000] {
        for held in ["w", "wr"] {
            let mut navigator = walker(DVec3::Y * EYE_M, DVec3::NEG_Z, &room, held);
            pass(&mut navigator, &room, 4.0, frames);
            let z = eye(&navigator).z;
            assert!((-2.76..-2.7).contains(&z), "{frames} frames, {held}: {z}");
            // Flying goes through.
            navigator.set_travel(NavigationMode::Fly, None);
            pass(&mut navigator, &room, 4.0, frames);
            assert!(eye(&navigator).z < -3.2);
        }
    }
    let slantwise = dvec3(1.0, 0.0, -1.0);
    let mut navigator = walker(dvec3(0.0, EYE_M, -2.0), slantwise, &room, "w");
    pass(&mut navigator, &room, 4.0, 240);
    let end = eye(&navigator);
    assert!(end.z > -2.76 && end.x > 3.0, "{end}");
}

/// Through the exhibits and on to the wall behind them.
#[test]
fn a_walk_through_a_room_ends_at_its_wall() {
    let scene = built_in("showroom");
    let (low, _) = scene.bounds().expect("a room");
    let mut cameras = scene.cameras.iter();
    let start = cameras
        .find(|camera| camera.name == "basin")
        .expect("a camera")
        .clone();
    let room = Tracer::new(Arc::new(scene));
    let mut navigator = walker(start.position, start.forward, &room, "wr");
    pass(&mut navigator, &room, 10.0, 600);
    let end = eye(&navigator);
    near([end.y, end.z], [low.y + EYE_M, low.z + 0.25], 0.02, end);
}

#[test]
fn past_a_corner_it_goes_straight_on() {
    // The front of a cupboard is slid along to its corner; the end of the room is behind it.
    let room = room(&[[-2.0, -1.4, 0.1, -1.0, 2.0], [-10.0, -9.0, 10.0, -8.0, 3.0]]);
    let places = [2, 14, 168, 1400].map(|frames| {
        let forward = dvec3(0.2, 0.0, -1.0);
        let mut navigator = walker(dvec3(0.0, EYE_M, 1.0), forward, &room, "wr");
        pass(&mut navigator, &room, 1.4, frames);
        eye(&navigator)
    });
    for place in &places {
        assert!((-8.0..-1.4).contains(&place.z), "{places:?}");
        assert!(place.distance(places[3]) < 0.1, "{places:?}");
    }
}

#[test]
fn being_pushed_off_a_wall_gives_no_speed() {
    let room = room(&[WALL]);
    for frame_s in [1e-7, 1e-5, 1e-3, 0.1] {
        // Nearer than anyone gets on foot: who came flying.
        let forward = dvec3(1.0, 0.0, -1.0);
        let mut navigator = walker(dvec3(0.0, EYE_M, -2.9), forward, &room, "w");
        pass(&mut navigator, &room, 40.0 * frame_s, 40);
        navigator.keys = keys("");
        pass(&mut navigator, &room, 1.0, 60);
        let end = eye(&navigator);
        assert!((-3.0..-2.7).contains(&end.z), "frames of {frame_s} s: {end}");
        let most = 40.0 * frame_s * SPEED_M_PER_S + 0.2;
        assert!(end.x < most, "frames of {frame_s} s: {end}");
    }
}

#[test]
fn steps_are_climbed_and_tables_are_not() {
    let stairs = room(&[[-10.0, -10.0, 10.0, -2.0, 0.3], [-10.0, -10.0, 10.0, -5.0, 0.9]]);
    let mut navigator = walker(DVec3::Y * EYE_M, DVec3::NEG_Z, &stairs, "w");
    pass(&mut navigator, &stairs, 6.0, 360);
    let up = eye(&navigator);
    near(up.y, EYE_M + 0.3, 1e-2, "on the step");
    assert!((-4.76..-4.7).contains(&up.z), "{up}: before the table");
    navigator.keys = keys("s");
    pass(&mut navigator, &stairs, 5.0, 300);
    near(eye(&navigator).y, EYE_M, 1e-2, "down again");
}

#[test]
fn an_orbit_keeps_its_distance_and_pivot() {
    let ground = room(&[]);
    // The pivot is the origin.
    let start = dvec3(0.0, 2.0, 4.0);
    let mut navigator = at(start, -start);
    navigator.set_travel(NavigationMode::Orbit, Some(&ground));
    let assert_at = |navigator: &Navigator, distance_m: f64| {
        let camera = navigator.camera();
        near(camera.position.length(), distance_m, 1e-9, "distance");
        near(camera.position.normalize(), -camera.forward, 1e-9, "pivot");
    };
    for (x, y) in [(300.0, 0.0), (-1000.0, 40.0), (77.0, -200.0)] {
        navigator.look(dvec2(x, y));
        assert_at(&navigator, start.length());
    }
    // Ten notches nearer, as the wheel says.
    navigator.wheel(10.0);
    assert_at(&navigator, start.length() * 1.05_f64.powi(-10));
    // However long W is held, it does not go through.
    navigator.keys = keys("w");
    pass(&mut navigator, &ground, 100.0, 100);
    let camera = navigator.camera();
    assert!(camera.position.dot(camera.forward) < 0.0 && camera.position.is_finite());
}

const SIZE: (f32, f32) = (800.0, 600.0);

fn camera() -> Camera {
    Camera::look_at("eye", dvec3(2.0, 3.0, 6.0), dvec3(0.1, 0.8, -0.2), 0.9)
}

fn lens(camera: &Camera) -> Viewport<'_> {
    Viewport {
        camera,
        picture: Rect::from_min_size(pos2(0.0, 0.0), SIZE.into()),
    }
}

#[test]
fn gazes_meet_what_is_seen() {
    let camera = camera();
    let lens = lens(&camera);
    for point in [DVec3::ZERO, dvec3(-1.0, 0.3, 0.5), dvec3(1.5, 2.0, -3.0)] {
        let gaze = lens.view_ray(lens.project(point));
        let along = (point - gaze.origin).dot(gaze.direction);
        // Places are 32-bit numbers.
        near(gaze.origin + gaze.direction * along, point, 1e-4, "met");
        assert!(lens.is_before(point) && !lens.is_before(gaze.origin - camera.forward));
    }
    let scene = scene();
    let spot = 2;
    let position = scene.lights[spot].kind.position().expect("it has a place");
    let at = lens.project(position);
    assert_eq!(light_at(&lens, &scene, at + vec2(4.0, 3.0)), Some(spot));
    assert_eq!(light_at(&lens, &scene, at + vec2(40.0, 3.0)), None);
}

#[test]
fn handles_tell_distance_and_angle() {
    let ray = |origin: DVec3, to: DVec3| Ray {
        origin,
        direction: (to - origin).normalize(),
    };
    let (eye, origin) = (camera().position, dvec3(0.2, 0.7, -0.4));
    let turned = |angle| DQuat::from_rotation_y(angle) * DVec3::Z;
    let axes = [
        (Handle::X, DVec3::X),
        (Handle::Y, DVec3::Y),
        (Handle::Z, DVec3::Z),
    ];
    let along = axes.map(|(handle, axis)| [-1.5, 0.0, 0.25, 2.0].map(|m| (handle, axis * m, m)));
    let around = [-2.0, 0.0, 0.5, 3.0].map(|angle| (Handle::Turn, turned(angle), angle));
    for (handle, way, expected) in along.into_iter().flatten().chain(around) {
        let found = handle.reach(origin, &ray(eye, origin + way));
        near(found.expect("it is reached"), expected, 1e-9, handle);
    }
    // Along the axis, or level with the circle, a gaze tells nothing.
    for (handle, axis) in axes {
        assert_eq!(handle.reach(origin, &ray(origin - axis, origin)), None);
    }
    let level = dvec3(5.0, origin.y, 0.0);
    assert_eq!(Handle::Turn.reach(origin, &ray(level, level - DVec3::X)), None);
}

#[test]
fn nodes_move_and_come_back_bit_for_bit() {
    // Two parts of one node, of which none lies in the node's middle.
    let mut loaded = scene();
    let (ball, last) = (1, loaded.objects.len());
    loaded.objects.push(loaded.objects[ball].clone());
    let beside = loaded.objects[last].mesh_in_scene_mut();
    beside
        .positions
        .iter_mut()
        .for_each(|corner| *corner += dvec3(2.0, 0.5, 0.0));
    let (yaw_rad, offset_m) = (0.7, dvec3(0.25, -0.5, 1.0));
    let there = Motion::turned(yaw_rad, offset_m);
    let moved = edited(&loaded, &[Edit::Place(ball, there)]);
    // Balls of 0.5 m around 0.8 m, and 2 m and 0.5 m further: their box is from −0.5 to 2.5 and from 0.3 to 1.8.
    let pivot = loaded.pivot(ball);
    assert!(pivot.distance(dvec3(1.0, 1.05, 0.0)) < 0.02);
    assert_eq!(moved.pivot(last), pivot);
    let turn = DQuat::from_rotation_y(yaw_rad);
    for part in [ball, last] {
        let [was, is] = [&loaded, &moved].map(|scene| &scene.objects[part].mesh_in_scene().positions);
        for (was, is) in was.iter().zip(is) {
            near(*is, turn * (*was - pivot) + pivot + offset_m, 1e-12, part);
        }
        let found = moved.objects[part].motion();
        assert_eq!((found.yaw_rad(), found.translation), (Some(yaw_rad), offset_m));
    }
    let [floor, same_floor] = [&loaded, &moved].map(|scene| scene.objects[0].mesh_in_scene());
    assert!(Arc::ptr_eq(floor, same_floor), "nothing else moves");
    let undone = EditState::of(&loaded).set(&moved);
    for back in [undone, edited(&moved, &[Edit::Place(ball, Motion::default())])] {
        assert!(back.objects[last].stands_as(&loaded.objects[last]));
        assert_eq!(
            back.objects[last].mesh_in_scene(),
            loaded.objects[last].mesh_in_scene()
        );
    }
    let tilt = Motion {
        rotation: DQuat::from_rotation_x(0.5),
        translation: DVec3::ZERO,
    };
    assert_eq!(tilt.yaw_rad(), None, "no turn about the vertical");
}
