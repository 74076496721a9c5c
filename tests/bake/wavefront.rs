//! The wavefront estimator against an independent solver, against itself, and by its counters.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use nephroid::illumination::compare::{average_relative_difference, relative_rmse};
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{BakeSettings, MapResolution, Sigma};

use crate::hard_scenes;
use crate::support::{self, assert_close};
use crate::tools::{at, bake, bits, builtin_scene, caustic, energy_fault, map_of, transformed};

fn towards(target: f64, density_per_sr: f64) -> BakeSettings {
    BakeSettings {
        max_error: Some(target),
        ..at(density_per_sr, 256)
    }
}

/// Built-in and reference, density [1/sr], largest relative RMSE and mean relative difference, watts on the floor.
const REFERENCES: [(&str, &str, f64, f64, f64, f64); 7] = [
    ("ring", "S1", 1e4, 0.01, 0.01, 6.992_461),
    ("ball", "S2", 1.5e5, 0.02, 0.05, 1.090_823),
    ("pool", "S3", 1e4, 0.012, 0.01, 3.770_999),
    ("mirror", "S5", 1e5, 0.01, 0.01, 1.286_660),
    ("slab", "S6", 5e3, 0.01, 0.01, 6.490_964),
    ("paraboloid", "S7", 3e4, 0.01, 0.01, 0.502_656),
    ("nephroid", "S8", 1.2e5, 0.01, 0.01, 0.966_650),
];

fn errors(result: &BakeResult, scene: &Scene, reference: &str, scale: f64) -> (f64, f64) {
    let image: Vec<f64> = caustic(map_of(result, scene, "floor"))
        .iter()
        .map(|e| e / scale)
        .collect();
    let expected = support::reference_map(reference);
    (
        relative_rmse(&image, &expected).expect("a reference with light"),
        average_relative_difference(&image, &expected).expect("a reference with light"),
    )
}

#[test]
fn few_rays_agree_with_the_independent_solver() {
    for (name, reference, density, largest, largest_mean, floor_w) in REFERENCES {
        let scene = builtin_scene(name);
        let result = bake(scene.clone(), &at(density, 256));
        let (rmse, ard) = errors(&result, &scene, reference, 1.0);
        println!(
            "{name}: {} rays, relative RMSE {:.3} %, ARD {:.3} %",
            result.counts.rays,
            100.0 * rmse,
            100.0 * ard
        );
        assert!(rmse <= largest, "{name}: relative RMSE {:.3} %", 100.0 * rmse);
        assert!(ard <= largest_mean, "{name}: ARD {:.3} %", 100.0 * ard);
        assert_eq!(energy_fault(&result), None, "{name}");
        let deposited = result.ledgers[0].energy_w.deposited;
        assert_close(deposited, floor_w, 0.001, &format!("{name}: watts on the floor"));
        assert!(
            result.counts.rays < 250_000,
            "{name}: {} rays",
            result.counts.rays
        );
        assert!(result.counts.receiver_queries > 0 && result.counts.cells > 0);
    }
}

#[test]
fn more_rays_find_what_the_mesh_itself_shows() {
    // Errors of the meshes themselves (of the solver's own files; a little is left for the deposit).
    for (name, reference, density, mesh) in [
        ("ring", "S1", 1e5, 0.0014),
        ("pool", "S3", 1e5, 0.007),
        ("paraboloid", "S7", 3e5, 0.0014),
    ] {
        let scene = builtin_scene(name);
        let coarse = errors(
            &bake(scene.clone(), &at(density / 10.0, 256)),
            &scene,
            reference,
            1.0,
        )
        .0;
        let fine = errors(&bake(scene.clone(), &at(density, 256)), &scene, reference, 1.0).0;
        println!("{name}: {:.3} % falls to {:.3} %", 100.0 * coarse, 100.0 * fine);
        assert!(
            fine <= 1.3 * mesh || fine < 0.5 * coarse,
            "{name}: {:.3} % only falls to {:.3} %",
            100.0 * coarse,
            100.0 * fine
        );
    }
}

#[test]
fn turned_scaled_and_moved_scenes_agree_alike() {
    let rotation = DMat3::from_axis_angle(DVec3::new(0.3, -0.8, 0.52).normalize(), 1.234);
    let scale = 3.7;
    for (name, reference, density, largest, is_lamp) in [
        ("ring", "S1", 1e4, 0.01, true),
        ("ball", "S2", 1.5e5, 0.02, true),
        ("pool", "S3", 1e4, 0.012, false),
    ] {
        let scene = transformed(builtin_scene(name), rotation, scale, DVec3::new(5.0, -3.0, 11.0));
        // A lamp's irradiance falls with the square of the size, a sun's does not.
        let irradiance = if is_lamp { 1.0 / (scale * scale) } else { 1.0 };
        let result = bake(scene.clone(), &at(density, 256));
        let (rmse, _) = errors(&result, &scene, reference, irradiance);
        println!("{name} moved: relative RMSE {:.3} %", 100.0 * rmse);
        assert!(rmse <= largest, "{name}: relative RMSE {:.3} %", 100.0 * rmse);
        assert_eq!(energy_fault(&result), None, "{name}");
    }
}

#[test]
fn a_floor_in_two_pieces_holds_the_same_light() {
    for (name, density) in [("ring", 1e4), ("pool", 1e4)] {
        let whole = builtin_scene(name);
        let cut = hard_scenes::with_cut_floor(whole.clone());
        let (a, b) = (bake(whole, &at(density, 128)), bake(cut, &at(density, 128)));
        assert_eq!(energy_fault(&b), None, "{name}");
        assert!(b.maps.len() == 2, "{name}: {} maps", b.maps.len());
        let deposited = |result: &BakeResult| result.ledgers[0].energy_w.deposited;
        assert_close(deposited(&b), deposited(&a), 5e-4, name);
    }
}

#[test]
fn the_balls_far_field_arrives() {
    let scene = builtin_scene("ball");
    let result = bake(scene.clone(), &at(1.5e5, 256));
    let map = map_of(&result, &scene, "floor");
    let image = caustic(map);
    let profile = std::fs::read_to_string(support::project_file("assets/reference/S2_profile.csv"))
        .expect("a readable profile");
    let rows: Vec<Vec<f64>> = profile
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|x| x.parse().expect("a number")).collect())
        .collect();
    // The map is 1.2 m wide; rings that lie wholly on it, corners included.
    let texel_m = map.chart.texel_area_m2(0).sqrt();
    for ring in 0..12 {
        let (inner, outer) = (0.05 * f64::from(ring), 0.05 * f64::from(ring + 1));
        let (mut flux, mut area) = (0.0, 0.0);
        const SUB: usize = 8;
        for (texel, e) in image.iter().enumerate() {
            for sub in 0..SUB * SUB {
                let place = |index: usize, part: usize| {
                    (index as f64 + (part as f64 + 0.5) / SUB as f64 - 128.0) * texel_m
                };
                let r = place(texel % 256, sub % SUB).hypot(place(texel / 256, sub / SUB));
                if r >= inner && r < outer {
                    flux += e;
                    area += 1.0;
                }
            }
        }
        let mut expected = 0.0;
        let mut whole = 0.0;
        for row in &rows {
            let (low, high) = (row[0].max(inner), row[1].min(outer));
            if high > low {
                expected += row[2] * (high * high - low * low);
                whole += high * high - low * low;
            }
        }
        let (found, expected) = (flux / area, expected / whole);
        println!("r {inner:.2} to {outer:.2} m: {found:.5} W/m², solver {expected:.5}");
        assert_close(found, expected, 0.05, &format!("ring {inner:.2} to {outer:.2} m"));
    }
}

#[test]
fn tighter_targets_take_more_rays_and_err_less() {
    for (name, reference) in [("ring", "S1"), ("ball", "S2")] {
        let scene = builtin_scene(name);
        let mut before: Option<(u64, f64)> = None;
        for target in [0.05, 0.02, 0.01] {
            let result = bake(scene.clone(), &towards(target, 40.0 / target));
            let (rmse, _) = errors(&result, &scene, reference, 1.0);
            let rays = result.counts.rays;
            println!(
                "{name}, target {target}: {rays} rays, relative RMSE {:.3} %",
                100.0 * rmse
            );
            assert_eq!(energy_fault(&result), None, "{name}");
            if let Some((fewer, larger)) = before {
                assert!(rays > fewer, "{name}: {rays} rays after {fewer}");
                assert!(rmse < larger, "{name}: {rmse} after {larger}");
            }
            before = Some((rays, rmse));
        }
    }
}

fn all_bits(result: &BakeResult) -> Vec<u32> {
    result.maps.iter().flat_map(bits).collect()
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    for name in ["ring", "ball"] {
        let with = |threads, target| {
            let settings = BakeSettings {
                threads,
                max_error: target,
                ..at(3e3, 128)
            };
            bake(builtin_scene(name), &settings)
        };
        for target in [None, Some(0.03)] {
            let one = with(1, target);
            for threads in [2, 4, 7] {
                let many = with(threads, target);
                assert_eq!(one.counts, many.counts, "{name}, {threads} threads");
                assert_eq!(one.ledgers, many.ledgers, "{name}, {threads} threads");
                assert!(
                    all_bits(&one) == all_bits(&many),
                    "{name}: {threads} threads give another map"
                );
            }
        }
    }
}

#[test]
fn traced_light_is_deposited_again_without_a_ray() {
    let scene = builtin_scene("ring");
    let mut session = BakeSession::new(Arc::new(scene.clone())).expect("a session");
    let mut run = |settings: &BakeSettings| session.bake(settings, &(), &Control::default()).expect("a bake");
    let first = run(&at(5e3, 64));
    assert!(first.counts.rays > 0);
    let others = [
        at(5e3, 192),
        BakeSettings {
            sigma: Sigma::Constant(4.0),
            ..at(5e3, 64)
        },
    ];
    for other in others {
        let again = run(&other);
        assert_eq!(again.counts.rays, 0);
        assert_eq!(again.counts.segments, 0);
        let fresh = bake(scene.clone(), &other);
        assert!(fresh.counts.rays > 0);
        assert_eq!(again.ledgers, fresh.ledgers);
        assert!(all_bits(&again) == all_bits(&fresh), "another map");
        assert!(
            all_bits(&again) != all_bits(&first),
            "the setting changes nothing"
        );
    }
    assert!(run(&at(6e3, 64)).counts.rays > 0, "another density is traced");
    let tight = BakeSettings {
        memory_bytes: 1 << 22,
        ..at(7e3, 64)
    };
    assert!(run(&tight).counts.rays > 0);
    let larger = BakeSettings {
        map_resolution: MapResolution::Fixed {
            width: 72,
            height: 72,
        },
        ..tight
    };
    assert!(run(&larger).counts.rays > 0, "what does not fit is not kept");
}

#[test]
fn what_separate_refinement_leaves_open_shrinks() {
    let open = |density| {
        let result = bake(builtin_scene("ball"), &at(density, 64));
        let energy = result.ledgers[0].energy_w;
        energy.truncated.quadrature.abs() / energy.emitted
    };
    let (coarse, fine) = (open(1e3), open(3e4));
    println!("quadrature: {coarse:.2e} of the emitted flux, then {fine:.2e}");
    assert!(
        fine < 2e-3 && fine < coarse,
        "{coarse} of the emitted flux, then {fine}"
    );
}
