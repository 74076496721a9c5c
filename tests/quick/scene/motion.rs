//! Scenes that move: running waves, water that they lift, and keyframes of files.

use nephroid::scene::waves::gravity_period_s;

use crate::prelude::*;

fn running(wavelength_m: f64, period_s: f64) -> Waves {
    let wave = Wave {
        amplitude_m: 0.01,
        wavelength_m,
        direction: dvec3(0.6, 0.0, 0.8),
        phase_rad: 0.4,
        period_s,
    };
    Waves::new(vec![wave]).expect("a gentle wave")
}

#[test]
fn crests_move_by_a_wavelength_in_a_period() {
    let waves = running(0.7, 1.3);
    for step in 0..20 {
        let time_s = 0.31 * f64::from(step);
        let point = dvec3(0.2, 0.0, -0.7) * f64::from(step);
        let way = dvec3(0.6, 0.0, 0.8) * (0.7 * time_s / 1.3);
        near(
            waves.after(time_s).height_m(point + way),
            waves.height_m(point),
            1e-12,
            time_s,
        );
    }
    let standing = running(0.7, 0.0);
    assert!(!standing.is_moving() && standing.after(3.0) == standing);
}

#[test]
fn gravity_moves_long_waves_faster() {
    // Deep: a wave of 1.56 m takes a second, and one four times as long twice that.
    near(gravity_period_s(1.56077, f64::INFINITY), 1.0, 1e-4, "deep");
    near(
        gravity_period_s(4.0, f64::INFINITY) / gravity_period_s(1.0, f64::INFINITY),
        2.0,
        1e-12,
        "deep",
    );
    // Shallow: the speed is √(g·h).
    let speed = 100.0 / gravity_period_s(100.0, 0.1);
    near(speed, (9.80665_f64 * 0.1).sqrt(), 1e-4, "shallow");
}

#[test]
fn periods_of_a_loop_divide_it() {
    for (period_s, fitted_s) in [(1.3, 4.0 / 3.0), (0.5, 0.5), (9.0, 4.0), (2.9, 4.0)] {
        let looped = running(0.7, period_s).looped(4.0);
        near(looped.list()[0].period_s, fitted_s, 1e-12, period_s);
    }
}

#[test]
fn water_is_lifted_where_its_waves_are() {
    let rest = built_in("pool");
    let moved = rest.at(0.37);
    assert!(!Arc::ptr_eq(
        rest.objects[1].mesh_in_scene(),
        moved.objects[1].mesh_in_scene()
    ));
    assert!(
        moved.objects[0].stands_as(&rest.objects[0]),
        "the floor is the same"
    );
    let waves = moved.materials[moved.objects[1].material]
        .waves
        .as_ref()
        .expect("it has waves");
    for position in &moved.objects[1].mesh_in_scene().positions {
        near(position.y, 1.0 + waves.height_m(*position), 1e-12, position);
    }
    assert_eq!(rest.at(0.0).content_hash(), rest.content_hash());
    // A loop ends as it begins.
    let looped = rest.looped(2.0);
    let (first, last) = (looped.at(0.0), looped.at(2.0));
    for (a, b) in first.objects[1]
        .mesh_in_scene()
        .positions
        .iter()
        .zip(&last.objects[1].mesh_in_scene().positions)
    {
        near(*a, *b, 1e-12, "loop");
    }
    // Flatter waves lift it less.
    let flat = MaterialEdit::Waves(Some(running(0.7, 1.0)));
    let edited = Edit::Material(rest.objects[1].material, flat).apply(&rest);
    let edited = edited.expect("it has waves");
    let highest = |scene: &Scene| {
        scene.objects[1]
            .mesh_in_scene()
            .bounds()
            .expect("has vertices")
            .1
            .y
    };
    assert!(highest(&edited) < 1.0101 && highest(&rest) > 1.04);
}

#[test]
fn a_file_says_that_waves_lift_a_mesh() {
    let with = |waves: Value| {
        let mut file = Glb::triangle().with_material(json!({ "extras": waves }));
        file.json["nodes"][0]["extras"] = json!({ "nephroid_swells": true });
        file.scene()
    };
    let wave = json!({ "amplitude_m": 0.1, "wavelength_m": 1.7, "direction": [1, 0], "phase_rad": 0.3, "period_s": 2 });
    let rest = with(json!({ "nephroid_waves": [wave] }));
    warns_not(&rest);
    for time_s in [0.0, 0.7] {
        let moment = rest.at(time_s);
        let phase = |x: f64| 2.0 * PI * x / 1.7 + 0.3 - PI * time_s;
        for (x, position) in [0.0, 1.0, 0.0]
            .into_iter()
            .zip(&moment.objects[0].mesh_in_scene().positions)
        {
            near(position.z, 0.1 * phase(x).cos(), 1e-7, time_s);
        }
    }
    let still = with(json!({}));
    assert_warned(&still, &["tri", "nephroid_swells", "stays still"]);
    assert!(still.swells.is_empty());
}

/// A solid that comes to stand on a floor.
#[test]
fn surfaces_that_come_to_meet_are_set_apart() {
    let mut file = Glb::tetrahedron();
    let positions = file.push_floats(&[-9.0, 0.0, 9.0, 9.0, 0.0, 9.0, 0.0, 0.0, -9.0], 3);
    let floor = file.push_mesh(json!({ "attributes": { "POSITION": positions } }));
    file.push_root(json!({ "name": "floor", "mesh": floor }));
    // Three corners down.
    let down = DQuat::from_rotation_arc(dvec3(1.0, 1.0, 1.0).normalize(), DVec3::Y).as_quat();
    file.json["nodes"][0]["rotation"] = json!(down.to_array());
    let material = json!({ "extensions": {
        "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_volume": { "thicknessFactor": 1.0 }
    } });
    let mut file = file.with_material(material);
    let height = 1.0 / 3.0_f32.sqrt();
    let times = file.push_floats(&[0.0, 1.0], 1);
    let places = file.push_floats(&[0.0, 2.0, 0.0, 0.0, height, 0.0], 3);
    file.push(
        "animations",
        json!({
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
            "samplers": [{ "input": times, "output": places }],
        }),
    );
    let rest = file.scene();
    let lowest = |time_s: f64| rest.at(time_s).objects[0].bounds().expect("has vertices").0.y;
    near(lowest(0.5), 0.5 * (2.0 - f64::from(height)), 1e-6, "above it");
    // A solid reaches into what it stands on, by more than roundings to single precision.
    let met = lowest(1.0);
    assert!((-1e-4..-1e-7).contains(&met), "{met}");
}

/// A triangle that turns about y and below it a lamp and a camera, 2 m away along x.
fn turning() -> Glb {
    let mut file = Glb::triangle().with_light("lamp", json!({ "type": "point", "intensity": 683.0 }));
    file.push(
        "cameras",
        json!({ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } }),
    );
    let camera = file.push(
        "nodes",
        json!({ "name": "eye", "camera": 0, "translation": [2, 0, 0] }),
    );
    file.json["nodes"][1]["translation"] = json!([2, 0, 0]);
    file.json["nodes"][0]["children"] = json!([1, camera]);
    file.json["scenes"][0]["nodes"] = json!([0]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let times = file.push_floats(&[0.0, 2.0], 1);
    let turns = file.push_floats(&[0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half], 4);
    file.push(
        "animations",
        json!({
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "rotation" } }],
            "samplers": [{ "input": times, "output": turns }],
        }),
    );
    file
}

#[test]
fn keyframes_move_objects_lights_and_cameras() {
    let rest = turning().scene();
    warns_not(&rest);
    let clip = rest.clip.as_ref().expect("it has keyframes");
    near(clip.duration_s, 2.0, 1e-12, "duration");
    for (time_s, turn) in [(0.0, 0.0), (1.0, PI / 4.0), (2.0, PI / 2.0), (3.0, PI / 4.0)] {
        let scene = rest.at(time_s);
        let turned = |point: DVec3| DQuat::from_rotation_y(turn) * point;
        near(
            scene.objects[0].mesh_in_scene().positions[1],
            turned(DVec3::X),
            1e-7,
            time_s,
        );
        let lamp = scene.lights[0].kind.position().expect("a point");
        near(lamp, turned(2.0 * DVec3::X), 1e-6, time_s);
        near(scene.cameras[0].position, turned(2.0 * DVec3::X), 1e-6, time_s);
        near(scene.cameras[0].forward, turned(DVec3::NEG_Z), 1e-7, time_s);
        assert!(scene.cameras[0].is_sound());
    }
    // A light that was taken out before it leaves the others theirs.
    let other = Light::new("other", rest.lights[0].kind);
    let edited = Edit::AddLight(Arc::new(other)).apply(&rest).expect("one more");
    let edited = Edit::RemoveLight(0).apply(&edited).expect("one less");
    near(
        edited.at(2.0).lights[0].kind.position().expect("a point"),
        2.0 * DVec3::X,
        1e-9,
        "no keyframes are the new light's",
    );
}

#[test]
fn keyframes_that_cannot_be_are_named_and_left_out() {
    let faulty = |change: &dyn Fn(&mut Glb), named: &str| {
        let mut file = turning();
        change(&mut file);
        let scene = file.scene();
        let told: Vec<String> = scene.warnings.iter().map(ToString::to_string).collect();
        assert!(told.iter().any(|told| told.contains(named)), "{named}: {told:?}");
        assert!(scene.clip.is_none(), "{named}");
    };
    let channel = |key: &'static str, value: Value| {
        move |file: &mut Glb| file.json["animations"][0]["channels"][0]["target"][key] = value.clone()
    };
    faulty(&channel("path", json!("weights")), "weights of morph targets");
    faulty(&channel("path", json!("colour")), "moves `colour`");
    faulty(&channel("node", json!(77)), "node 77, which does not exist");
    faulty(
        &|file| file.json["animations"][0]["samplers"][0]["interpolation"] = json!("SPIRAL"),
        "an interpolation that glTF does not know",
    );
    faulty(
        &|file| file.json["animations"][0]["samplers"][0]["interpolation"] = json!("CUBICSPLINE"),
        "another number of values than of times",
    );
    faulty(
        &|file| {
            let times = file.push_floats(&[2.0, 2.0], 1);
            file.json["animations"][0]["samplers"][0]["input"] = json!(times);
        },
        "times that do not ascend",
    );
    faulty(
        &|file| file.json["animations"][0]["channels"] = json!("none"),
        "not as glTF has it",
    );
}
