//! Bundles against an independent solver, and by their counters; and real files made by others
//! (`../shared/scenes`, where it is there), baked without a fault.

use nephroid::effect::Effect;

use crate::bake::common::floor;
use support::prelude::*;
use support::references::references;
use support::sound::scene_fault;
use support::tools::{bake, energy_fault, map_of, photons};
use support::{or_skip, project_file, shared_or_skip};

/// The others are in the quick tests.
#[test]
fn few_rays_agree_with_the_solver() {
    let references = references();
    let large = ["ball", "pool", "paraboloid"];
    for reference in references
        .iter()
        .filter(|reference| large.contains(&reference.builtin))
    {
        let (scene, result) = reference.check_bundles();
        if reference.builtin == "ball" {
            let texel_m = map_of(&result, &scene, "floor").chart.texel_area_m2(0).sqrt();
            check_far_field(&floor(&result, &scene), texel_m);
        }
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

/// The first texel that holds no light there can be: not finite, or negative. Light of one wavelength lies outside sRGB, so
/// that a channel may be negative where wavelengths part; its luminance may not, but for what single precision rounds off.
fn impossible_texel(map: &IlluminationMap, wavelengths_part: bool) -> Option<[f32; 3]> {
    let fits = |&[r, g, b]: &[f32; 3]| {
        let light = rgb(f64::from(r), f64::from(g), f64::from(b));
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
        assert!(
            scene_fault(&scene).is_none() && scene.triangle_count() > 0,
            "{name}"
        );
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
