//! Handles in the picture: what a gaze points at, how far a pull moves, and where nodes stand afterwards.

use std::sync::Arc;

use egui::accesskit::Role;
use egui::{Rect, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use glam::{DQuat, DVec3};
use nephroid::geometry::Ray;
use nephroid::scene::{Camera, Edit, Scene};
use nephroid::settings::BakeSettings;
use nephroid::viewer::gizmo::{Gizmo, Handle, Held, light_at};
use nephroid::viewer::lens::Lens;
use nephroid::viewer::panel::Placed;
use nephroid::viewer::placement::Placement;

use super::headless::Headless;
use super::panel::scene;

const SIZE: (f32, f32) = (800.0, 600.0);

fn camera() -> Camera {
    Camera::look_at("eye", DVec3::new(2.0, 3.0, 6.0), DVec3::new(0.1, 0.8, -0.2), 0.9)
}

fn lens(camera: &Camera) -> Lens<'_> {
    Lens {
        camera,
        picture: Rect::from_min_size(pos2(0.0, 0.0), SIZE.into()),
    }
}

fn gaze_at(point: DVec3) -> Ray {
    let origin = camera().position;
    let direction = (point - origin).normalize();
    Ray { origin, direction }
}

#[test]
fn a_gaze_through_a_place_of_the_picture_meets_what_is_seen_there() {
    let camera = camera();
    let lens = lens(&camera);
    for point in [
        DVec3::ZERO,
        DVec3::new(-1.0, 0.3, 0.5),
        DVec3::new(1.5, 2.0, -3.0),
    ] {
        let gaze = lens.gaze(lens.place(point));
        let along = (point - gaze.origin).dot(gaze.direction);
        let off = (gaze.origin + gaze.direction * along).distance(point);
        // Places are 32-bit numbers.
        assert!(off < 1e-4, "{point}: {off}");
        assert!(lens.is_before(point) && !lens.is_before(gaze.origin - camera.forward));
    }
}

#[test]
fn handles_tell_how_far_along_or_around_a_gaze_points() {
    let origin = DVec3::new(0.2, 0.7, -0.4);
    for (handle, axis) in [
        (Handle::X, DVec3::X),
        (Handle::Y, DVec3::Y),
        (Handle::Z, DVec3::Z),
    ] {
        for along_m in [-1.5, 0.0, 0.25, 2.0] {
            let reached = handle.reach(origin, &gaze_at(origin + axis * along_m));
            assert!(
                reached.is_some_and(|reached| (reached - along_m).abs() < 1e-9),
                "{handle:?} {along_m}: {reached:?}"
            );
        }
        let along_it = Ray {
            origin: origin - axis,
            direction: axis,
        };
        assert_eq!(handle.reach(origin, &along_it), None);
    }
    for angle in [-2.0_f64, 0.0, 0.5, 3.0] {
        let point = origin + DQuat::from_rotation_y(angle) * DVec3::Z;
        let reached = Handle::Turn.reach(origin, &gaze_at(point));
        assert!(
            reached.is_some_and(|reached| (reached - angle).abs() < 1e-9),
            "{angle}: {reached:?}"
        );
    }
    let level = Ray {
        origin: DVec3::new(5.0, 0.7, 0.0),
        direction: DVec3::NEG_X,
    };
    assert_eq!(Handle::Turn.reach(origin, &level), None);
}

/// Two parts of one node, of which none lies in the node's middle.
fn two_parts() -> Scene {
    let mut scene = scene();
    let ball = scene.objects.iter().position(|object| object.name == "ball");
    let ball = ball.expect("there is a ball");
    let Edit::ObjectMesh { mesh, .. } =
        Edit::object_at(ball, &scene.objects[ball].mesh, DVec3::new(2.0, 0.5, 0.0))
    else {
        panic!("it is a mesh")
    };
    let mut other = scene.objects[ball].clone();
    other.mesh = mesh;
    scene.objects.push(other);
    scene
}

#[test]
fn a_node_stands_where_it_was_put_and_comes_back_bit_for_bit() {
    let loaded = two_parts();
    let ball = 1;
    let there = Placement {
        yaw_rad: 0.7,
        offset_m: DVec3::new(0.25, -0.5, 1.0),
    };
    let (moved, inverse) = there.edit(ball, &loaded).apply(&loaded).expect("it can be moved");
    let last = loaded.objects.len() - 1;
    // Balls of 0.5 m around 0.8 m, and 2 m and 0.5 m further: their box is from −0.5 to 2.5 and from 0.3 to 1.8.
    let pivot = DVec3::new(1.0, 1.05, 0.0);
    assert!((there.middle_m(ball, &loaded) - pivot - there.offset_m).length() < 0.02);
    let pivot = there.middle_m(ball, &loaded) - there.offset_m;
    let turn = DQuat::from_rotation_y(0.7);
    for part in [ball, last] {
        let pairs = loaded.objects[part]
            .mesh
            .positions
            .iter()
            .zip(&moved.objects[part].mesh.positions);
        for (was, is) in pairs {
            let expected = turn * (*was - pivot) + pivot + there.offset_m;
            assert!(
                is.distance(expected) < 1e-12,
                "{was} came to {is}, not {expected}"
            );
        }
        let found = Placement::of(part, &loaded, &moved).expect("it is a turn and a way");
        assert!((found.yaw_rad - there.yaw_rad).abs() < 1e-8, "{found:?}");
        assert!(found.offset_m.distance(there.offset_m) < 1e-8, "{found:?}");
    }
    let floor = |scene: &Scene| Arc::clone(&scene.objects[0].mesh);
    assert!(Arc::ptr_eq(&floor(&loaded), &floor(&moved)), "nothing else moves");
    let back = inverse.apply(&moved).expect("it comes back").0;
    let home = Placement::default()
        .edit(ball, &loaded)
        .apply(&moved)
        .expect("it goes home")
        .0;
    for scene in [back, home] {
        assert_eq!(scene.objects[last].mesh, loaded.objects[last].mesh);
    }
    let tilted = Edit::ObjectMoved {
        object: ball,
        rotation: DQuat::from_rotation_x(0.5),
        translation: DVec3::ZERO,
    };
    let tilted = tilted.apply(&loaded).expect("it can be tilted").0;
    assert_eq!(
        Placement::of(ball, &loaded, &tilted),
        None,
        "no turn about the vertical"
    );
}

struct Desk {
    gizmo: Gizmo,
    held: Option<Held>,
    scene: Scene,
    loaded: Scene,
    edits: Vec<Edit>,
}

/// Pulls a handle by some points of the picture; the edits it asks for, applied one after the other.
fn pull(held: Held, handle: &str, by: egui::Vec2) -> Desk {
    let loaded = scene();
    let desk = Desk {
        gizmo: Gizmo::default(),
        held: Some(held),
        scene: loaded.clone(),
        loaded,
        edits: Vec::new(),
    };
    let mut harness = Harness::builder().with_size(SIZE).build_ui_state(
        |ui, desk: &mut Desk| {
            let camera = camera();
            let pulled = desk
                .gizmo
                .show(ui, &lens(&camera), desk.held, (&desk.scene, &desk.loaded));
            if let Some(edit) = pulled {
                desk.scene = edit.apply(&desk.scene).expect("it can be moved").0;
                desk.edits.push(edit);
            }
        },
        desk,
    );
    harness.run_steps(2);
    let at = harness
        .get_by_role_and_label(Role::Slider, handle)
        .rect()
        .center();
    harness.hover_at(at);
    harness.run_steps(1);
    assert!(
        harness.state().gizmo.is_hot(),
        "clicks are not for what is behind it"
    );
    harness.drag_at(at);
    harness.run_steps(1);
    for share in [0.4, 0.7, 1.0] {
        harness.hover_at(at + by * share);
        harness.run_steps(1);
    }
    harness.drop_at(at + by);
    harness.run_steps(2);
    let state = harness.state_mut();
    Desk {
        gizmo: state.gizmo.clone(),
        held: state.held,
        scene: state.scene.clone(),
        loaded: state.loaded.clone(),
        edits: std::mem::take(&mut state.edits),
    }
}

#[test]
fn a_light_follows_the_pulled_handle_along_its_axis_alone() {
    let before = scene().lights[0].kind.position().expect("it has a place");
    let desk = pull(Held::Light(0), "Move x", vec2(60.0, 0.0));
    assert!(desk.edits.len() >= 3, "{:?}", desk.edits);
    let after = desk.scene.lights[0].kind.position().expect("it has a place");
    assert!(
        after.x > before.x && after.y == before.y && after.z == before.z,
        "{after}"
    );
    // As far as the mouse went along the axis in the picture.
    let camera = camera();
    let (from, to) = (lens(&camera).place(before), lens(&camera).place(after));
    let axis = (lens(&camera).place(before + DVec3::X) - from).normalized();
    let along = (to - from).dot(axis);
    assert!((along - vec2(60.0, 0.0).dot(axis)).abs() < 8.0, "{along} points");
    // Another, whose upper handle is within the picture.
    let desk = pull(Held::Light(2), "Move y", vec2(0.0, -40.0));
    let height = |scene: &Scene| scene.lights[2].kind.position().map(|position| position.y);
    assert!(height(&desk.scene) > height(&desk.loaded), "{:?}", desk.edits);
}

#[test]
fn an_object_is_turned_about_its_own_vertical() {
    let desk = pull(Held::Object(1), "Turn", vec2(-50.0, 10.0));
    let found = Placement::of(1, &desk.loaded, &desk.scene).expect("it is a turn");
    assert!(
        found.yaw_rad.abs() > 0.1 && found.offset_m == DVec3::ZERO,
        "{found:?}"
    );
    let desk = pull(Held::Object(1), "Move z", vec2(-20.0, 30.0));
    let found = Placement::of(1, &desk.loaded, &desk.scene).expect("it was moved");
    assert!(found.offset_m.z > 0.05 && found.yaw_rad == 0.0, "{found:?}");
    assert_eq!(found.offset_m.with_z(0.0), DVec3::ZERO);
}

#[test]
fn lights_are_found_where_they_are_seen() {
    let (scene, camera) = (scene(), camera());
    let lens = lens(&camera);
    let spot = scene.lights.len() - 1;
    let position = scene.lights[spot].kind.position().expect("it has a place");
    let at = lens.place(position);
    assert_eq!(light_at(&lens, &scene, at + vec2(4.0, 3.0)), Some(spot));
    assert_eq!(light_at(&lens, &scene, at + vec2(40.0, 3.0)), None);
}

fn panel_of_ball() -> Headless {
    let mut panel = Headless::with_scene(scene(), BakeSettings::splat(), (1280.0, 1800.0));
    press(&mut panel, Role::DisclosureTriangle, "Scene");
    let list = Headless::rect_of(panel.labelled(Role::ComboBox, "Object")).center();
    panel.click(list);
    press(&mut panel, Role::Button, "ball");
    panel
}

fn press(panel: &mut Headless, role: Role, name: &str) {
    let centre = Headless::rect_of(panel.named(role, name)).center();
    panel.click(centre);
}

#[test]
fn glass_is_chosen_by_name_and_parts_wavelengths_by_a_number() {
    let mut panel = panel_of_ball();
    let list = Headless::rect_of(panel.labelled(Role::ComboBox, "Glass")).center();
    panel.click(list);
    press(&mut panel, Role::Button, "N-BK7");
    let edit = panel.wishes.edit.take().expect("it was chosen");
    // SCHOTT's data sheet of N-BK7: n_d = 1.51680, V_d = 64.17.
    let edited = edit.apply(&panel.scene).expect("it can be had").0;
    let material = &edited.materials[edited.objects[1].material];
    assert!((material.ior - 1.5168).abs() < 1e-5, "{}", material.ior);
    panel.scene = Arc::new(edited);
    panel.settle();
    assert!(panel.says("N-BK7") && panel.says("0.312"), "{:#?}", panel.texts());

    let numbers = panel.nodes().filter(|node| node.role() == Role::SpinButton);
    let number = numbers
        .into_iter()
        .find(|node| node.value().is_some_and(|text| text.starts_with("0.312")));
    let centre = Headless::rect_of(number.expect("the number of the slider")).center();
    panel.click(centre);
    panel.type_text("0.5");
    let edit = panel.wishes.edit.take().expect("it was typed");
    let edited = edit.apply(&panel.scene).expect("it can be had").0;
    let material = &edited.materials[edited.objects[1].material];
    let glass = material.glass.as_ref().expect("it has one");
    let abbe = glass.dispersion.abbe_number();
    assert!((abbe - 40.0).abs() < 1e-6, "20 over 0.5 is {abbe}");
    assert!((material.ior - 1.5168).abs() < 1e-5, "the index stays");
    panel.scene = Arc::new(edited);
    panel.settle();
    assert!(
        panel.says("by numbers") && panel.says("0.500"),
        "{:#?}",
        panel.texts()
    );
    press(&mut panel, Role::Button, "Reset Glass");
    let edit = panel.wishes.edit.take().expect("it is as in the file");
    let edited = edit.apply(&panel.scene).expect("it can be had").0;
    assert_eq!(edited.materials[edited.objects[1].material].glass, None);
}

#[test]
fn a_light_is_given_a_spectrum_by_name_and_its_own_again() {
    let mut panel = panel_of_ball();
    let list = Headless::rect_of(panel.labelled(Role::ComboBox, "Spectrum")).center();
    panel.click(list);
    press(&mut panel, Role::Button, "A");
    let edit = panel.wishes.edit.take().expect("it was chosen");
    let edited = edit.apply(&panel.scene).expect("it can be had").0;
    let light = &edited.lights[0];
    let spectrum = light.spectrum.as_ref().expect("it has one");
    assert_eq!(spectrum.name(), Some("A"));
    // Incandescent light is reddish, and as bright as before.
    assert!(light.colour.r > 1.0 && light.colour.b < 0.5, "{:?}", light.colour);
    assert!(
        (light.colour.luminance() - 1.0).abs() < 1e-3,
        "{:?}",
        light.colour
    );
    panel.scene = Arc::new(edited);
    panel.settle();
    press(&mut panel, Role::Button, "Reset Spectrum");
    let edit = panel.wishes.edit.take().expect("it is as in the file");
    let edited = edit.apply(&panel.scene).expect("it can be had").0;
    assert_eq!(edited.lights[0], panel.loaded.lights[0]);
}

#[test]
fn the_mouse_holds_one_thing_at_a_time() {
    let mut panel = panel_of_ball();
    assert_eq!(panel.panel.held(), None);
    press(&mut panel, Role::Button, "Move object");
    assert_eq!(panel.panel.held(), Some(Held::Object(1)));
    press(&mut panel, Role::Button, "Place light");
    assert_eq!(
        (panel.panel.held(), panel.panel.placed_light()),
        (Some(Held::Light(0)), Some(Placed::At(0)))
    );
    press(&mut panel, Role::Button, "Move light");
    assert_eq!(
        (panel.panel.held(), panel.panel.placed_light()),
        (Some(Held::Light(0)), None)
    );
    press(&mut panel, Role::Button, "Move light");
    assert_eq!(panel.panel.held(), None);
    let field = Headless::rect_of(panel.labelled(Role::SpinButton, "Turn [°]")).center();
    panel.click(field);
    panel.type_text("90");
    let edit = panel.wishes.edit.take().expect("it was typed");
    let edited = edit.apply(&panel.scene).expect("it can be turned").0;
    let found = Placement::of(1, &panel.loaded, &edited).expect("it is a turn");
    assert!(
        (found.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-8,
        "{found:?}"
    );
}
