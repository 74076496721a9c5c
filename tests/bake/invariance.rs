//! What must not change a map: threads, other things in the scene, the order of objects.

use std::sync::Arc;

use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, LightKind};
use nephroid::session::BakeSession;
use nephroid::settings::{BakeSettings, LayerKind, MapResolution, RayPlacement};
use nephroid::units::RadiantIntensity;

use crate::tools::{at, bake, bits, builtin_scene, caustic, map_of, settings};

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    for (name, rays) in [("ring", RayPlacement::Lattice), ("ball", RayPlacement::Jittered)] {
        let with = |threads| {
            let settings = BakeSettings {
                threads,
                rays,
                map_resolution: MapResolution::Auto,
                ..settings(2e4, 0)
            };
            bake(builtin_scene(name), &settings)
        };
        let one = with(1);
        for threads in [2, 4, 7] {
            let many = with(threads);
            assert_eq!(one.counts, many.counts, "{name}, {threads} threads");
            assert_eq!(one.ledgers, many.ledgers, "{name}, {threads} threads");
            assert_eq!(one.maps.len(), many.maps.len());
            for (a, b) in one.maps.iter().zip(&many.maps) {
                assert!(bits(a) == bits(b), "{name}: {threads} threads give another map");
            }
        }
    }
}

#[test]
fn lights_that_see_nothing_specular_change_no_bit() {
    let settings = settings(1e4, 64);
    let alone = builtin_scene("mirror");
    let mut with_lamps = alone.clone();
    // Below the floor, where the mirror is not.
    for lamp in 0..3 {
        with_lamps.lights.push(Light {
            name: format!("cellar {lamp}"),
            colour: LinearSrgb::WHITE,
            spectrum: None,
            kind: LightKind::Spot {
                position: glam::DVec3::new(0.1 * f64::from(lamp), -1.0, 0.0),
                direction: glam::DVec3::NEG_Y,
                intensity: RadiantIntensity(50.0),
                inner_cone_rad: 0.2,
                outer_cone_rad: 0.5,
            },
            size: nephroid::scene::LightSize::None,
        });
    }
    let (a, b) = (
        bake(alone.clone(), &settings),
        bake(with_lamps.clone(), &settings),
    );
    assert!(bits(map_of(&a, &alone, "floor")) == bits(map_of(&b, &with_lamps, "floor")));
}

#[test]
fn the_order_of_objects_changes_no_bit() {
    let settings = settings(1e4, 64);
    let scene = builtin_scene("slab");
    let mut reversed = scene.clone();
    reversed.objects.reverse();
    let (a, b) = (bake(scene.clone(), &settings), bake(reversed.clone(), &settings));
    assert!(bits(map_of(&a, &scene, "floor")) == bits(map_of(&b, &reversed, "floor")));
}

#[test]
fn two_lights_give_the_sum_of_their_maps() {
    let settings = settings(1e4, 64);
    let scene = builtin_scene("mirror");
    let mut other = scene.clone();
    other.lights[0].kind = other.lights[0].kind.moved(glam::DVec3::new(-0.2, 0.3, -0.4));
    let mut both = scene.clone();
    both.lights.extend(other.lights.clone());
    let maps: Vec<Vec<f64>> = [&scene, &other, &both]
        .map(|scene| caustic(map_of(&bake(scene.clone(), &settings), scene, "floor")))
        .to_vec();
    let mut lit = 0;
    for ((a, b), together) in maps[0].iter().zip(&maps[1]).zip(&maps[2]) {
        let sum = a + b;
        assert!(
            (together - sum).abs() <= 1e-6 * sum.max(1e-6),
            "{together} instead of {sum}"
        );
        lit += usize::from(*a > 0.0 && *b > 0.0);
    }
    assert!(
        lit > 50,
        "both lights must reach some of the same texels, only {lit} are"
    );
}

#[test]
fn power_of_two_changes_of_power_are_exact() {
    let settings = settings(1e4, 64);
    let scene = builtin_scene("mirror");
    let mut bright = scene.clone();
    let LightKind::Point { intensity, .. } = &mut bright.lights[0].kind else {
        panic!("a point light")
    };
    *intensity = *intensity * 1024.0;
    let (a, b) = (bake(scene.clone(), &settings), bake(bright.clone(), &settings));
    let (a, b) = (
        caustic(map_of(&a, &scene, "floor")),
        caustic(map_of(&b, &bright, "floor")),
    );
    assert!(a.iter().zip(&b).all(|(a, b)| a * 1024.0 == *b));
}

/// Whatever is chosen by chance is chosen by the seed: where rays start, the places of lamps, the ways between surfaces.
#[test]
fn another_seed_chooses_anew_and_the_same_one_alike() {
    let scene = builtin_scene("ring");
    let mut soft = scene.clone();
    soft.lights[0].size = nephroid::scene::LightSize::Radius { radius_m: 0.1 };
    let mut walled = scene.clone();
    let wall = shapes::rectangle(
        glam::DVec3::new(-0.4, 0.4, 0.0),
        glam::DVec3::Y * 0.4,
        glam::DVec3::Z * 0.4,
    );
    parts::add(
        &mut walled,
        "wall",
        wall,
        parts::matte("wall", LinearSrgb::grey(0.5)),
    );
    let jittered = BakeSettings {
        rays: RayPlacement::Jittered,
        ..settings(2e3, 16)
    };
    let of_few_places = BakeSettings {
        wavefronts: Some(2),
        ..at(500.0, 16)
    };
    let indirect = BakeSettings {
        layers: vec![LayerKind::Indirect],
        max_error: Some(0.3),
        ..at(500.0, 16)
    };
    for (what, scene, settings) in [
        ("rays", &scene, jittered),
        ("lamps", &soft, of_few_places),
        ("ways", &walled, indirect),
    ] {
        let mut session = BakeSession::new(Arc::new(scene.clone())).expect("a session");
        let mut with = |seed: u64| {
            let settings = BakeSettings {
                seed,
                ..settings.clone()
            };
            let result = session.bake(&settings, &(), &Control::default()).expect("a bake");
            bits(map_of(&result, scene, "floor"))
        };
        let [first, other, again] = [1, 2, 1].map(&mut with);
        assert!(first != other, "{what}: another seed gives the same map");
        assert!(first == again, "{what}: the same seed gives another map");
    }
}
