//! Maps in tiles: how much memory they save, what that costs, and that a bake never fails for want of memory.

use std::sync::Arc;

use nephroid::illumination::IlluminationMap;
use nephroid::illumination::tiles::COARSEST;
use nephroid::scene::Scene;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::session::{BYTES_PER_TEXEL, BakeResult};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};

use crate::hard_scenes;
use crate::tools::{at, bake, bits, builtin_scene, caustic, energy_fault, map_of};

fn automatic(density_per_sr: f64) -> BakeSettings {
    BakeSettings {
        map_resolution: MapResolution::Auto,
        ..at(density_per_sr, 1)
    }
}

/// A torus of 16,384 triangles over a floor that is large beside its caustic.
fn torus_over_a_wide_floor() -> Scene {
    let mut scene = hard_scenes::torus(parts::dielectric("glass", 1.5));
    let floor = scene.objects.iter_mut().find(|object| object.name == "floor");
    let floor = floor.expect("a floor");
    floor.mesh = Arc::new(shapes::floor([-4.0, 4.0], [-4.0, 4.0], 0.0));
    scene
}

/// Memory of all maps, and that of maps with all texels as fine [bytes].
fn memory(result: &BakeResult) -> (u64, u64) {
    let taken = |map: &IlluminationMap| map.chart.texel_count() as u64 * BYTES_PER_TEXEL;
    let dense = |map: &IlluminationMap| (map.width() * map.height()) as u64 * BYTES_PER_TEXEL;
    (
        result.maps.iter().map(taken).sum(),
        result.maps.iter().map(dense).sum(),
    )
}

/// Relative RMSE of the floor's caustic against a map of the same size.
fn difference(scene: &Scene, result: &BakeResult, reference: &BakeResult) -> f64 {
    let [a, b] = [result, reference].map(|result| map_of(result, scene, "floor").dense());
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    let (a, b) = (caustic(&a), caustic(&b));
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / b.len() as f64).sqrt() / (b.iter().sum::<f64>() / b.len() as f64)
}

/// Tiles of each level of the floor's map, from fine to coarse.
fn levels(scene: &Scene, result: &BakeResult) -> Vec<usize> {
    let layout = map_of(result, scene, "floor").chart.layout.as_ref();
    let levels: Vec<u8> = layout.map_or(vec![], |layout| layout.tiles().map(|tile| tile.level).collect());
    let count = |level: u8| levels.iter().filter(|&&own| own == level).count();
    (0..=COARSEST).map(count).collect()
}

fn fixed(settings: &BakeSettings, size: (usize, usize)) -> BakeSettings {
    BakeSettings {
        map_resolution: MapResolution::Fixed {
            width: size.0,
            height: size.1,
        },
        ..settings.clone()
    }
}

fn floor_size(scene: &Scene, result: &BakeResult) -> (usize, usize) {
    let map = map_of(result, scene, "floor");
    (map.width(), map.height())
}

#[test]
fn a_glass_balls_map_takes_a_tenth_of_a_dense_one() {
    let scene = builtin_scene("ball");
    let result = bake(scene.clone(), &automatic(2.5e4));
    let (taken, dense) = memory(&result);
    let (taken_mib, dense_mib) = (taken >> 20, dense >> 20);
    let levels = levels(&scene, &result);
    println!("ball: {taken_mib} MiB in tiles of levels {levels:?}, {dense_mib} MiB dense");
    assert!(taken * 10 <= dense, "{taken_mib} of {dense_mib} MiB");
    assert_eq!(result.warnings, []);
    assert_eq!(energy_fault(&result), None);
}

#[test]
fn a_small_caustic_of_a_complex_caster_takes_a_tenth_and_shows_the_same() {
    let scene = torus_over_a_wide_floor();
    assert!(scene.triangle_count() >= 4_000);
    let settings = automatic(2e3);
    let sparse = bake(scene.clone(), &settings);
    let (taken, dense_bytes) = memory(&sparse);
    println!(
        "torus: {} kB in tiles of levels {:?}, {} kB dense",
        taken / 1000,
        levels(&scene, &sparse),
        dense_bytes / 1000
    );
    assert!(taken * 10 <= dense_bytes, "{taken} of {dense_bytes} bytes");
    let dense = bake(scene.clone(), &fixed(&settings, floor_size(&scene, &sparse)));
    assert!(map_of(&dense, &scene, "floor").chart.layout.is_none());
    let (off, error) = (
        difference(&scene, &sparse, &dense),
        dense.estimated_relative_rmse.expect("an estimate"),
    );
    println!("torus: off by {off:.4} of the mean, error {error:.4}");
    assert!(off < 0.5 * error, "{off} beside {error}");
    assert_eq!(energy_fault(&sparse), None);
    // Where light is finest nothing is lost at all.
    let peak = |result: &BakeResult| {
        let values = caustic(&map_of(result, &scene, "floor").dense());
        values.into_iter().fold(0.0, f64::max)
    };
    assert!((peak(&sparse) / peak(&dense) - 1.0).abs() < 1e-6);
}

#[test]
fn a_tenth_of_the_memory_gives_coarser_maps_a_warning_and_the_error_that_it_costs() {
    let scene = builtin_scene("ball");
    let ample = automatic(6e3);
    let wished = bake(scene.clone(), &ample);
    let size = floor_size(&scene, &wished);
    let dense_bytes = (size.0 * size.1) as u64 * BYTES_PER_TEXEL;
    let truth = bake(scene.clone(), &fixed(&automatic(2.4e4), size));
    for (case, settings, need) in [
        ("automatic", ample.clone(), memory(&wished).0),
        ("fixed", fixed(&ample, size), dense_bytes),
        ("fixed, a hundredth", fixed(&ample, size), dense_bytes / 10),
    ] {
        let scarce = BakeSettings {
            memory_bytes: need / 10,
            ..settings
        };
        let result = bake(scene.clone(), &scarce);
        let (taken, _) = memory(&result);
        println!(
            "{case}: levels {:?}, {taken} of {need} bytes",
            levels(&scene, &result)
        );
        assert!(taken <= need / 10, "{case}: {taken} bytes");
        assert!(taken > need / 40, "{case}: only {taken} bytes");
        let [warning] = &result.warnings[..] else {
            panic!("{case}: {:?}", result.warnings)
        };
        assert_eq!(warning.location, "--memory");
        assert!(warning.to_string().contains("MiB"), "{warning}");
        assert_eq!(energy_fault(&result), None);
        let (off, stated) = (
            difference(&scene, &result, &truth),
            result.estimated_relative_rmse.expect("an estimate"),
        );
        let with_ample = wished.estimated_relative_rmse.expect("an estimate");
        println!("{case}: off by {off:.4}, stated {stated:.4}, with ample memory {with_ample:.4}");
        assert!((0.5..2.0).contains(&(off / stated)), "{case}: {stated} for {off}");
    }
}

#[test]
fn however_little_memory_a_bake_ends_with_maps() {
    for (name, layers) in [
        ("mirror", vec![LayerKind::Caustic]),
        ("showroom", vec![LayerKind::Caustic, LayerKind::Direct]),
    ] {
        let settings = BakeSettings {
            memory_bytes: 20_000,
            layers,
            ..at(1e3, 512)
        };
        let result = bake(builtin_scene(name), &settings);
        assert!(!result.maps.is_empty(), "{name}");
        assert_eq!(energy_fault(&result), None, "{name}");
        assert!(
            result
                .warnings
                .iter()
                .any(|warning| warning.location == "--memory"),
            "{name}: {:?}",
            result.warnings
        );
    }
}

#[test]
fn threads_change_no_bit_of_maps_in_tiles() {
    let scene = torus_over_a_wide_floor();
    let with = |threads| {
        let settings = BakeSettings {
            threads,
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..automatic(500.0)
        };
        bake(scene.clone(), &settings)
    };
    let (one, three) = (with(1), with(3));
    assert!(map_of(&one, &scene, "floor").chart.layout.is_some());
    assert_eq!(one.ledgers, three.ledgers);
    for (a, b) in one.maps.iter().zip(&three.maps) {
        assert!(bits(a) == bits(b));
        assert_eq!(a.chart.layout, b.chart.layout);
    }
}

/// Direct light on a map in tiles is that of a dense map, but for what larger texels leave out.
#[test]
fn direct_light_comes_to_tiles() {
    let scene = torus_over_a_wide_floor();
    let settings = BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..automatic(500.0)
    };
    let sparse = bake(scene.clone(), &settings);
    let dense = bake(scene.clone(), &fixed(&settings, floor_size(&scene, &sparse)));
    let [a, b] = [&sparse, &dense].map(|result| map_of(result, &scene, "floor"));
    assert!(a.chart.layout.is_some() && b.chart.layout.is_none());
    let [flux_a, flux_b] = [a, b].map(|map| map.flux_w(LayerKind::Direct).luminance());
    assert!(
        (flux_a / flux_b - 1.0).abs() < 2e-3,
        "{flux_a} W, dense {flux_b} W"
    );
}

/// Texels of automatic maps for a target.
fn texels_for(name: &str, target: f64, layers: Vec<LayerKind>) -> usize {
    let settings = BakeSettings {
        max_error: Some(target),
        density_per_sr: BakeSettings::starting_density_per_sr(target),
        map_resolution: MapResolution::Auto,
        layers,
        ..BakeSettings::default()
    };
    let result = bake(builtin_scene(name), &settings);
    result.maps.iter().map(|map| map.chart.texel_count()).sum()
}

#[test]
fn drafts_have_coarser_maps_than_previews() {
    for name in ["ball", "pool"] {
        let [draft, preview] = [0.1, 0.03].map(|target| texels_for(name, target, vec![LayerKind::Caustic]));
        println!("{name}: {draft} texels for a draft, {preview} for a preview");
        assert!(2 * draft < preview, "{name}: {draft} of {preview} texels");
    }
}

#[test]
fn maps_of_a_coarse_caustic_show_direct_light_as_finely_as_maps_without_one() {
    let [both, direct] = [
        vec![LayerKind::Caustic, LayerKind::Direct],
        vec![LayerKind::Direct],
    ]
    .map(|layers| texels_for("mirror", 0.9, layers));
    println!("{both} texels with the caustic, {direct} without");
    assert!(both >= direct, "{both} texels with the caustic, {direct} without");
}
