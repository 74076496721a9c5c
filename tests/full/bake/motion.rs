//! Light that moves: where the closed form has it, without flicker, and baked again only where something moves.

use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};
use nephroid::bake::Bake;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::edit::Edit;
use nephroid::scene::{Material, Motion, Scene, Wave, Waves};
use nephroid::settings::BakeSettings;
use nephroid::units::Flux;
use serde_json::{Value, json};
use support::glb::Glb;

use crate::bake::common::{
    CAUSTIC_AND_DIRECT, assert_fresh, floor, rmse, run, session, towards, with_layers,
};
use support::tools::{at, bake, builtin_scene, caustic, map_of, photons, set, settings};

/// Seconds from one moment to the next.
const STEP_S: f64 = 0.04;

/// A ball of glass and a sheet of running water with a lamp above each, and a screen between them.
fn ball_and_water() -> Scene {
    let mut scene = parts::reference_scene(2.0);
    let ball = shapes::sphere(DVec3::new(-0.9, 0.5, 0.0), 0.3, 3);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let wave = Wave::on_water(0.01, [9.0, 4.0], 0.3, 0.5);
    let water = Material {
        waves: Waves::new(vec![wave]).ok(),
        ..parts::dielectric("water", 1.333)
    };
    let sheet = shapes::floor([0.5, 1.3], [-0.4, 0.4], 0.5);
    parts::add(&mut scene, "water", sheet, water);
    let screen = shapes::rectangle(DVec3::Y, DVec3::Z * 2.0, DVec3::Y);
    parts::add(
        &mut scene,
        "screen",
        screen,
        parts::matte("screen", LinearSrgb::grey(0.5)),
    );
    for (name, x) in [("over ball", -0.9), ("over water", 0.9)] {
        let place = DVec3::new(x, 1.9, 0.0);
        let lamp = parts::beam(name, place, DVec3::NEG_Y, 0.2, Flux(10.0));
        scene.lights.push(lamp);
    }
    scene
}

/// A scene with one of its lamps alone.
fn lit_by(scene: &Scene, lamp: usize) -> Scene {
    let mut scene = scene.clone();
    scene.lights = vec![scene.lights[lamp].clone()];
    scene
}

/// Of patches, photons, splats, and patches towards an error.
fn all_ways() -> [BakeSettings; 4] {
    [
        at(2e4, 48),
        photons(4e4, 48),
        settings(2e4, 48),
        towards(0.08, 48),
    ]
}

#[test]
fn a_lamp_that_sees_nothing_moving_keeps_its_maps() {
    let scene = ball_and_water();
    for settings in all_ways() {
        let mut session = session(&scene);
        run(&mut session, &settings);
        for step in 1..4 {
            let moment = scene.at(STEP_S * f64::from(step));
            session
                .set_scene(Arc::new(moment.clone()))
                .expect("a sound scene");
            let what = format!("{:?}, step {step}", settings.estimator);
            let (now, fresh) = assert_fresh(&mut session, &settings, &what);
            let [still, moving] = [0, 1].map(|lamp| bake(lit_by(&moment, lamp), &settings).counts.rays);
            assert!(still > 0 && moving > 0);
            if settings.max_error.is_none() {
                assert_eq!(fresh.counts.rays, still + moving, "{what}");
                assert_eq!(now.counts.rays, moving, "{what}");
            }
            assert!(now.counts.rays < fresh.counts.rays, "{what}");
            println!("{what}: {} of {} rays", now.counts.rays, fresh.counts.rays);
        }
    }
}

/// A ball that is carried about, past the screen and into the light of the other lamp.
#[test]
fn what_comes_into_the_light_of_a_lamp_is_seen() {
    let scene = ball_and_water();
    let places = [
        (0.05, 0.0, 0.02),
        (1.75, 0.4, 0.1),
        (1.8, 0.45, 0.1),
        (0.0, 0.0, 0.0),
        (1.8, -0.35, 0.0),
    ];
    let mut kept = 0;
    for settings in [at(3e3, 32), photons(6e3, 32), towards(0.2, 32)] {
        let mut session = session(&scene);
        run(&mut session, &settings);
        for (x, y, z) in places {
            let motion = Motion::turned(x, DVec3::new(x, y, z));
            let moved = Edit::Place(1, motion).apply(&scene).expect("a sound edit");
            session.set_scene(Arc::new(moved)).expect("a sound scene");
            let what = format!("{:?}, ball moved by {x} {y} {z}", settings.estimator);
            let (now, fresh) = assert_fresh(&mut session, &settings, &what);
            kept += usize::from(now.counts.rays < fresh.counts.rays);
        }
    }
    assert!((3..15).contains(&kept), "kept something {kept} times of 15");
    println!("kept something {kept} times of 15");
}

/// Waves of clear water change nothing of light that meets nothing specular.
#[test]
fn direct_light_is_not_traced_again_for_waves() {
    let scene = ball_and_water();
    let settings = with_layers(&CAUSTIC_AND_DIRECT, at(2e3, 32));
    let mut session = session(&scene);
    assert!(run(&mut session, &settings).counts.shadow_rays > 0);
    session
        .set_scene(Arc::new(scene.at(STEP_S)))
        .expect("a sound scene");
    let (now, _) = assert_fresh(&mut session, &settings, "waves");
    assert_eq!(now.counts.shadow_rays, 0);
}

/// Frames have the same seed: what differs between two moments that are next to each other is the light, not its noise.
#[test]
fn noise_stands_still_from_frame_to_frame() {
    let pool = builtin_scene("pool");
    let settings = photons(3e3, 48);
    let of = |time_s: f64, seed: u64| {
        let settings = set(settings.clone(), |s| s.seed = seed);
        let moment = pool.at(time_s);
        floor(&bake(moment.clone(), &settings), &moment)
    };
    let frames = [0.5, 0.5 + 1e-5].map(|time_s| of(time_s, 0));
    let [flicker, noise] = [&frames[1], &of(0.5, 1)].map(|other| rmse(other, &frames[0]));
    assert!(noise > 0.05, "nothing to see: {noise}");
    assert!(flicker < 0.05 * noise, "flicker {flicker}, noise {noise}");
    println!("flicker {flicker:.5}, noise {noise:.4}");
}

/// Adds an animation of a node's translation or rotation, linear between keyframes.
fn animate(file: &mut Glb, node: usize, path: &str, times_s: &[f32], values: &[f32]) {
    let times = file.push_floats(times_s, 1);
    let values = file.push_floats(values, values.len() / times_s.len());
    file.push(
        "animations",
        json!({
            "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
            "samplers": [{ "input": times, "output": values }],
        }),
    );
}

/// Adds a node with a mesh of flat triangles.
fn add_mesh(file: &mut Glb, name: &str, triangles: &[[f32; 9]], material: Value) -> usize {
    let positions = file.push_floats(&triangles.concat(), 3);
    let material = file.push("materials", material);
    let mesh = file.push_mesh(json!({ "attributes": { "POSITION": positions }, "material": material }));
    file.push_root(json!({ "name": name, "mesh": mesh }))
}

/// Two triangles of a rectangle over x and z, seen from above, or from below.
fn level(half_m: f32, y: f32, is_up: bool) -> [[f32; 9]; 2] {
    let corner = |x: f32, z: f32| [x * half_m, y, z * half_m];
    let [a, b, c, d] = [
        corner(-1.0, -1.0),
        corner(-1.0, 1.0),
        corner(1.0, 1.0),
        corner(1.0, -1.0),
    ];
    let triangle = |a: [f32; 3], b: [f32; 3], c: [f32; 3]| -> [f32; 9] {
        let corners = if is_up { [a, b, c] } else { [a, c, b] };
        corners.concat().try_into().expect("three corners")
    };
    [triangle(a, b, c), triangle(a, c, d)]
}

fn matte() -> Value {
    json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 } })
}

/// Where the middles of a flat map's texels are [m], and the light on each [W/m²].
fn lit_places(result: &Bake, scene: &Scene) -> Vec<(DVec3, f64)> {
    let map = map_of(result, scene, "floor");
    let corners = scene.objects[map.chart.object()].mesh_in_scene().corners(0);
    let rows = map.chart.texel_from_world(0, corners).expect("a flat floor");
    let size = DVec2::new(map.width() as f64, map.height() as f64);
    let first = map.chart.corner_uvs[0][0] * size;
    let place = |index: usize| {
        let texel = DVec2::new((index % map.width()) as f64, (index / map.width()) as f64) + 0.5 - first;
        let steps = rows.map(|row| row / row.length_squared());
        corners[0] + steps[0] * texel.x + steps[1] * texel.y
    };
    let light = caustic(map).into_iter().enumerate();
    light.map(|(index, light)| (place(index), light)).collect()
}

/// A lamp that is carried along under a mirror shines on the floor from its image above that.
#[test]
fn the_light_of_a_lamp_with_keyframes_is_where_its_image_is() {
    let (mirror_m, lamp_m) = (2.0, 1.0);
    let mut file = Glb::empty().with_light("lamp", json!({ "type": "point", "intensity": 683.0 }));
    add_mesh(&mut file, "floor", &level(1.0, 0.0, true), matte());
    let polished = json!({ "pbrMetallicRoughness": { "metallicFactor": 1, "roughnessFactor": 0 } });
    add_mesh(&mut file, "mirror", &level(2.0, mirror_m as f32, false), polished);
    let carried = [-0.4, lamp_m as f32, 0.1, 0.4, lamp_m as f32, -0.3];
    animate(&mut file, 0, "translation", &[0.0, 2.0], &carried);
    let rest = file.scene();
    let settings = at(1e4, 48);
    let mut session = session(&rest);
    let mut before: Option<Vec<f64>> = None;
    for time_s in [0.0, 0.5, 1.0, 1.7] {
        let moment = rest.at(time_s);
        session
            .set_scene(Arc::new(moment.clone()))
            .expect("a sound scene");
        let (now, _) = assert_fresh(&mut session, &settings, &format!("{time_s} s"));
        let image = DVec3::new(0.4 * (time_s - 1.0), 2.0 * mirror_m - lamp_m, 0.1 - 0.2 * time_s);
        let (places, light): (Vec<DVec3>, Vec<f64>) = lit_places(&now, &moment).into_iter().unzip();
        let expected = |place: &DVec3| image.y / place.distance(image).powi(3);
        let expected: Vec<f64> = places.iter().map(expected).collect();
        let off = rmse(&light, &expected);
        assert!(off < 2e-3, "{off} off at {time_s} s");
        let moved = before.replace(expected).map(|before| rmse(&light, &before));
        assert!(
            moved.is_none_or(|moved| moved > 0.02),
            "it hardly moved: {moved:?}"
        );
        println!("{time_s} s: {off:.5} off, {moved:?} from the moment before");
    }
}

/// A wedge that turns under the sun throws its light aside, to where its thick side is.
#[test]
fn the_light_of_a_turning_prism_goes_round() {
    let (half, above, slope) = (0.1_f32, 1.2_f32, 0.3_f64);
    let sun = json!({ "type": "directional", "intensity": 683.0 });
    let mut file = Glb::empty().with_light("sun", sun);
    let down = std::f32::consts::FRAC_1_SQRT_2;
    file.json["nodes"][0]["rotation"] = json!([-down, 0, 0, down]);
    add_mesh(&mut file, "floor", &level(0.5, 0.0, true), matte());
    let rise = half * slope.tan() as f32;
    // Below and above, around; as high as 1 m below in the middle.
    let corner = |x: f32, z: f32, y: f32| [x * half, y, z * half];
    let around = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    let low = around.map(|(x, z)| corner(x, z, 1.0 + x * rise));
    let high = around.map(|(x, z)| corner(x, z, above));
    let mut faces = vec![
        [high[0], high[1], high[2], high[3]],
        [low[3], low[2], low[1], low[0]],
    ];
    faces.extend((0..4).map(|side| {
        let next = (side + 1) % 4;
        [low[side], low[next], high[next], high[side]]
    }));
    let halves = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    let triangles: Vec<[f32; 9]> = halves
        .map(|corners| corners.concat().try_into().expect("three corners"))
        .collect();
    let glass = json!({
        "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0 },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": { "thicknessFactor": 0.2 },
            "KHR_materials_ior": { "ior": 1.5 },
        },
    });
    let prism = add_mesh(&mut file, "prism", &triangles, glass);
    animate(
        &mut file,
        prism,
        "rotation",
        &[0.0, 2.0],
        &[0.0, 0.0, 0.0, 1.0, 0.0, down, 0.0, down],
    );
    let rest = file.scene();
    // In and out, and nothing within.
    let settings = set(at(4e5, 96), |s| s.max_depth = Some(2));
    let aside_m = ((1.5 * slope.sin()).asin() - slope).tan();
    let mut session = session(&rest);
    for time_s in [0.0, 0.4, 1.0, 2.0] {
        let moment = rest.at(time_s);
        session
            .set_scene(Arc::new(moment.clone()))
            .expect("a sound scene");
        let (now, _) = assert_fresh(&mut session, &settings, &format!("{time_s} s"));
        let places = lit_places(&now, &moment);
        let all: f64 = places.iter().map(|(_, light)| light).sum();
        let middle = places.iter().map(|(place, light)| *place * *light).sum::<DVec3>() / all;
        let turn = DQuat::from_rotation_y(FRAC_PI_4 * time_s);
        let off_m = middle.distance(turn * DVec3::NEG_X * aside_m);
        assert!(off_m < 1e-3, "{off_m} m off at {time_s} s");
        println!(
            "{time_s} s: {:.3} mm off, {:.1} mm aside",
            1e3 * off_m,
            1e3 * aside_m
        );
    }
}
