//! Handles in the picture: what a gaze points at, how far a pull moves, and where nodes stand afterwards.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use nephroid::viewer::gizmo::{Gizmo, Handle, light_at};
use nephroid::viewer::lens::Lens;

use super::fixtures::scene;
use super::*;

const SIZE: (f32, f32) = (800.0, 600.0);

fn camera() -> Camera {
    Camera::look_at("eye", dvec3(2.0, 3.0, 6.0), dvec3(0.1, 0.8, -0.2), 0.9)
}

fn lens(camera: &Camera) -> Lens<'_> {
    Lens {
        camera,
        picture: Rect::from_min_size(pos2(0.0, 0.0), SIZE.into()),
    }
}

#[test]
fn gazes_meet_what_is_seen() {
    let camera = camera();
    let lens = lens(&camera);
    for point in [DVec3::ZERO, dvec3(-1.0, 0.3, 0.5), dvec3(1.5, 2.0, -3.0)] {
        let gaze = lens.gaze(lens.place(point));
        let along = (point - gaze.origin).dot(gaze.direction);
        // Places are 32-bit numbers.
        near(gaze.origin + gaze.direction * along, point, 1e-4, "met");
        assert!(lens.is_before(point) && !lens.is_before(gaze.origin - camera.forward));
    }
    let scene = scene();
    let spot = 2;
    let position = scene.lights[spot].kind.position().expect("it has a place");
    let at = lens.place(position);
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

/// Pulls a handle by some points of the picture; the scene after each edit that asks for.
fn pull(held: Held, handle: &str, by: egui::Vec2) -> Vec<Scene> {
    let mut harness = Harness::builder().with_size(SIZE).build_ui_state(
        |ui, (gizmo, scenes): &mut (Gizmo, Vec<Scene>)| {
            let (camera, now) = (camera(), scenes[scenes.len() - 1].clone());
            let edit = gizmo.show(ui, &lens(&camera), Some(held), &now);
            scenes.extend(edit.map(|edit| edited(&now, &[edit])));
        },
        (Gizmo::default(), vec![scene()]),
    );
    harness.run_steps(2);
    let at = harness
        .get_by_role_and_label(Role::Slider, handle)
        .rect()
        .center();
    harness.hover_at(at);
    harness.run_steps(1);
    assert!(harness.state().0.is_hot(), "clicks are not for what is behind it");
    harness.drag_at(at);
    harness.run_steps(1);
    for share in [0.4, 0.7, 1.0] {
        harness.hover_at(at + by * share);
        harness.run_steps(1);
    }
    harness.drop_at(at + by);
    harness.run_steps(2);
    let scenes = harness.state().1.clone();
    assert!(scenes.len() > 3, "it moves along with the mouse");
    scenes
}

#[test]
fn lights_follow_one_axis() {
    let position = |light: usize, scene: &Scene| scene.lights[light].kind.position().expect("a place");
    let scenes = pull(Held::Light(0), "Move x", vec2(60.0, 0.0));
    let (before, after) = (position(0, &scenes[0]), position(0, &scenes[scenes.len() - 1]));
    assert!(after.x > before.x && after.with_x(before.x) == before, "{after}");
    // As far as the mouse went along the axis in the picture.
    let camera = camera();
    let place = |point: DVec3| lens(&camera).place(point);
    let axis = (place(before + DVec3::X) - place(before)).normalized();
    let along = (place(after) - place(before)).dot(axis);
    assert!((along - vec2(60.0, 0.0).dot(axis)).abs() < 8.0, "{along} points");
    // Another, whose upper handle is within the picture.
    let scenes = pull(Held::Light(2), "Move y", vec2(0.0, -40.0));
    assert!(position(2, &scenes[scenes.len() - 1]).y > position(2, &scenes[0]).y);
}

#[test]
fn objects_turn_about_their_vertical() {
    let placed = |handle: &str, by: egui::Vec2| {
        let scenes = pull(Held::Object(1), handle, by);
        *scenes[scenes.len() - 1].objects[1].motion()
    };
    let turned = placed("Turn", vec2(-50.0, 10.0));
    assert!(
        turned.yaw_rad().is_some_and(|yaw_rad| yaw_rad.abs() > 0.1),
        "{turned:?}"
    );
    assert_eq!(turned.translation, DVec3::ZERO);
    let moved = placed("Move z", vec2(-20.0, 30.0));
    assert!(
        moved.translation.z > 0.05 && moved.rotation == DQuat::IDENTITY,
        "{moved:?}"
    );
    assert_eq!(moved.translation.with_z(0.0), DVec3::ZERO);
}
