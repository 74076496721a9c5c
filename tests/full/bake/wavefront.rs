//! The wavefront estimator against an independent solver, and by its counters; and real files made by others
//! (`../shared/scenes`, where it is there), baked without a fault.

use glam::{DMat3, DVec3};
use nephroid::bake::Bake;
use nephroid::effect::Effect;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{LoadOptions, Scene};

use crate::bake::common::{floor, rmse, towards};
use support::references::references;
use support::tools::{at, bake, builtin_scene, energy_fault, map_of, photons, set, settings, transformed};
use support::{assert_close, hard_scenes, or_skip, project_file, reference_map, shared_or_skip};

/// The others are in the quick tests.
#[test]
fn few_rays_agree_with_the_solver() {
    let references = references();
    let large = ["ball", "pool", "paraboloid"];
    for reference in references
        .iter()
        .filter(|reference| large.contains(&reference.builtin))
    {
        let scene = builtin_scene(reference.builtin);
        let result = bake(scene.clone(), &at(reference.by_wavefronts.0, 256));
        reference.check_wavefronts(&result, &scene);
        if reference.builtin == "ball" {
            let texel_m = map_of(&result, &scene, "floor").chart.texel_area_m2(0).sqrt();
            check_far_field(&floor(&result, &scene), texel_m);
        }
    }
}

/// As a lamp's irradiance falls with the square of the size, and a sun's does not.
#[test]
fn splats_of_moved_scenes_agree() {
    let rotation = DMat3::from_axis_angle(DVec3::new(0.3, -0.8, 0.52).normalize(), 1.234);
    let size = 3.7;
    let references = references();
    let plain = ["mirror", "slab", "nephroid"];
    for reference in references.iter().filter(|it| plain.contains(&it.builtin)) {
        let scene = transformed(builtin_scene(reference.builtin), rotation, size, DVec3::ZERO);
        let (density, most) = reference.by_splats.expect("held to it");
        let result = bake(scene.clone(), &settings(density, 256));
        reference.check(&result, &scene, size, (most, 0.005));
    }
}

#[test]
fn the_solvers_files_agree_with_its_maps() {
    for reference in references()
        .iter()
        .filter(|reference| reference.by_splats.is_some())
    {
        let Some(path) = shared_or_skip(&format!("oracle/{}.glb", reference.file)) else {
            continue;
        };
        let path = path.to_str().expect("a readable path");
        let scene = Scene::load(path, &LoadOptions::default()).expect("a valid file");
        let (density, most) = reference.by_wavefronts;
        reference.check(
            &bake(scene.clone(), &at(density, 256)),
            &scene,
            1.0,
            (most, 0.005),
        );
    }
}

/// Rings around the ball's axis that lie wholly on its map, against the solver's profile.
fn check_far_field(image: &[f64], texel_m: f64) {
    let profile = std::fs::read_to_string(project_file("assets/reference/S2_profile.csv"));
    let profile = profile.expect("a readable profile");
    let numbers = |line: &str| -> Vec<f64> {
        let numbers = line.split(',').map(|x| x.parse().expect("a number"));
        numbers.collect()
    };
    let rows: Vec<Vec<f64>> = profile.lines().skip(1).map(numbers).collect();
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
                if (inner..outer).contains(&r) {
                    flux += e;
                    area += 1.0;
                }
            }
        }
        let (mut expected, mut whole) = (0.0, 0.0);
        for row in &rows {
            let (low, high) = (row[0].max(inner), row[1].min(outer));
            if high > low {
                expected += row[2] * (high * high - low * low);
                whole += high * high - low * low;
            }
        }
        let what = format!("ring {inner:.2} to {outer:.2} m");
        assert_close(flux / area, expected / whole, 0.05, &what);
    }
}

/// Errors of the meshes themselves (of the solver's own files; a little is left for the deposit).
#[test]
fn more_rays_find_the_meshs_own_error() {
    for (name, reference, density, mesh) in [
        ("ring", "S1", 1e5, 0.0014),
        ("pool", "S3", 1e5, 0.007),
        ("paraboloid", "S7", 3e5, 0.0014),
    ] {
        let scene = builtin_scene(name);
        let [coarse, fine] = [density / 10.0, density].map(|density| {
            let result = bake(scene.clone(), &at(density, 256));
            rmse(&floor(&result, &scene), &reference_map(reference))
        });
        assert!(
            fine <= 1.3 * mesh || fine < 0.5 * coarse,
            "{name}: {coarse} only falls to {fine}"
        );
    }
}

#[test]
fn what_refinement_leaves_open_shrinks() {
    let [coarse, fine] = [1e3, 3e4].map(|density| {
        let result = bake(builtin_scene("ball"), &at(density, 64));
        let energy = result.ledgers[0].energy_w;
        energy.truncated.quadrature.abs() / energy.emitted
    });
    assert!(
        fine < 2e-3 && fine < coarse,
        "{coarse} of the emitted flux, then {fine}"
    );
}

/// Given up below the threshold, over what arrived.
fn left_out(result: &Bake) -> f64 {
    let energy = &result.ledgers[0].energy_w;
    energy.truncated.threshold / energy.deposited
}

/// Branches too weak to matter are not traced: how weak follows the target, and their watts are booked.
#[test]
fn a_tighter_target_follows_weaker_branches() {
    let targets = [0.1, 0.03, 0.01];
    let shares = targets.map(|target| {
        let result = bake(builtin_scene("ball"), &towards(target, 64));
        assert_eq!(energy_fault(&result), None);
        let share = left_out(&result);
        assert!(share > 0.0, "something is always too weak");
        assert!(share < 0.1 * target, "{share} at a target of {target}");
        share
    });
    assert!(shares.windows(2).all(|pair| pair[1] < pair[0]), "{shares:?}");
    // Rays of splats are always the same, their segments are not.
    let splats = targets.map(|target| {
        let settings = set(settings(4_000.0, 64), |s| {
            s.branch_threshold = Some(towards(target, 64).path_threshold())
        });
        let result = bake(builtin_scene("ball"), &settings);
        (result.counts.rays, result.counts.segments, left_out(&result))
    });
    for pair in splats.windows(2) {
        assert_eq!(pair[0].0, pair[1].0);
        assert!(pair[0].1 < pair[1].1 && pair[0].2 > pair[1].2, "{splats:?}");
    }
}

#[test]
fn a_named_threshold_is_taken_as_it_is() {
    let named = set(towards(0.01, 64), |s| s.branch_threshold = Some(0.02));
    assert_eq!(named.path_threshold().to_bits(), 0.02_f64.to_bits());
    assert!(towards(0.1, 64).path_threshold() > towards(0.01, 64).path_threshold());
}

#[test]
fn a_floor_of_two_objects_takes_the_same_light() {
    for name in ["ring", "pool"] {
        let whole = builtin_scene(name);
        let cut = hard_scenes::with_cut_floor(whole.clone());
        let [whole, cut] = [whole, cut].map(|scene| bake(scene, &at(1e4, 128)));
        assert_eq!(energy_fault(&cut), None, "{name}");
        assert_eq!(cut.maps.len(), 2, "{name}");
        let deposited = |result: &Bake| result.ledgers[0].energy_w.deposited;
        assert_close(deposited(&cut), deposited(&whole), 5e-4, name);
    }
}

/// The first texel that holds no light there can be: not finite, or negative. Light of one wavelength lies outside sRGB, so
/// that a channel may be negative where wavelengths part; its luminance may not, but for what single precision rounds off.
fn impossible_texel(map: &IlluminationMap, wavelengths_part: bool) -> Option<[f32; 3]> {
    let fits = |&[r, g, b]: &[f32; 3]| {
        let light = LinearSrgb::new(f64::from(r), f64::from(g), f64::from(b));
        let most = r.abs().max(g.abs()).max(b.abs());
        let is_light = if wavelengths_part {
            light.luminance() >= -f64::from(4.0 * f32::EPSILON * most)
        } else {
            r.min(g).min(b) >= 0.0
        };
        most.is_finite() && is_light
    };
    let mut texels = map.layers.iter().flat_map(|layer| &layer.irradiance);
    texels.find(|texel| !fits(texel)).copied()
}

#[test]
fn real_files_bake() {
    let folder = or_skip!(shared_or_skip("scenes"));
    let entries = std::fs::read_dir(folder).expect("a readable folder");
    let files = entries.map(|entry| entry.expect("an entry").path());
    let is_glb = |path: &std::path::PathBuf| path.extension().is_some_and(|extension| extension == "glb");
    let mut files: Vec<_> = files.filter(is_glb).collect();
    files.sort();
    assert!(files.len() >= 13, "only {} files", files.len());
    let options = LoadOptions {
        default_light: true,
        ..LoadOptions::default()
    };
    let mut lit = 0;
    for file in files {
        let scene = Scene::load(file.to_str().expect("a readable path"), &options).expect("a valid file");
        let name = scene.name.clone();
        let result = bake(scene, &photons(3e4, 64));
        assert_eq!(energy_fault(&result), None, "{name}");
        let parts = result.plan.is_on(Effect::Dispersion);
        for map in &result.maps {
            assert_eq!(impossible_texel(map, parts), None, "{name}");
        }
        let mut ledgers = result.ledgers.iter();
        lit += usize::from(ledgers.any(|ledger| ledger.energy_w.deposited > 0.0));
    }
    assert!(lit >= 4, "caustic light arrives in {lit} files only");
}
