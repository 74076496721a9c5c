//! Maps in tiles: how much memory they save and what that costs; direct light beside caustics, and levels on the way.

use nephroid::bake::{BYTES_PER_TEXEL, Baker};
use nephroid::settings::{ErrorMetric, Preset};

use crate::bake::common::{
    CAUSTIC_AND_DIRECT, all_bits, assert_same, automatic, edit, estimate, rmse, session, sized, torus,
    with_layers,
};
use support::prelude::*;
use support::tools::{bake, builtin_scene, caustic, energy_fault, map_of, set, to};

fn auto(target: f64) -> BakeSettings {
    automatic(to(target, 1))
}

/// A tilted torus of glass of 9,216 triangles over a floor that is large beside its caustic.
fn torus_over_a_wide_floor() -> Scene {
    let mut scene = parts::reference_scene(4.0);
    let tilt = DQuat::from_rotation_x(0.5) * DQuat::from_rotation_z(0.3);
    let torus = torus(DVec3::Y * 0.6, tilt, 0.5);
    parts::add(&mut scene, "torus", torus, parts::dielectric("glass", 1.5));
    let lamp = parts::point_light("lamp", dvec3(0.5, 2.0, 0.3), Flux(100.0));
    scene.lights.push(lamp);
    scene
}

/// Memory of all maps, and that of maps with all texels as fine [bytes].
fn memory(result: &Bake) -> (u64, u64) {
    let texels = |count: fn(&IlluminationMap) -> usize| result.maps.iter().map(count).sum::<usize>() as u64;
    let (taken, dense) = (
        texels(|map| map.chart.texel_count()),
        texels(|map| map.width() * map.height()),
    );
    (taken * BYTES_PER_TEXEL, dense * BYTES_PER_TEXEL)
}

/// The floor's caustic, all of it as fine.
fn dense_floor(scene: &Scene, result: &Bake) -> Vec<f64> {
    caustic(&map_of(result, scene, "floor").dense())
}

fn floor_size(scene: &Scene, result: &Bake) -> (usize, usize) {
    let map = map_of(result, scene, "floor");
    (map.width(), map.height())
}

#[test]
fn a_small_caustic_looks_the_same_in_tiles() {
    let scene = torus_over_a_wide_floor();
    assert!(scene.triangle_count() >= 4_000);
    let sparse = bake(scene.clone(), &auto(0.1));
    let (taken, dense_bytes) = memory(&sparse);
    assert!(taken * 10 <= dense_bytes, "{taken} of {dense_bytes} bytes");
    assert_eq!(energy_fault(&sparse), None);
    let dense = bake(scene.clone(), &sized(auto(0.1), floor_size(&scene, &sparse)));
    assert!(map_of(&dense, &scene, "floor").chart.layout.is_none());
    let [in_tiles, whole] = [&sparse, &dense].map(|result| dense_floor(&scene, result));
    let (off, noise) = (rmse(&in_tiles, &whole), estimate(&sparse).hypot(estimate(&dense)));
    assert!(off < 1.5 * noise, "{off} beside {noise}");
    // Where light is finest nothing is lost.
    let [peak, whole_peak] = [in_tiles, whole].map(|values| values.into_iter().fold(0.0, f64::max));
    assert!(
        (peak / whole_peak - 1.0).abs() < noise,
        "{peak} beside {whole_peak}"
    );
}

#[test]
fn a_tenth_of_the_memory_costs_what_it_says() {
    let scene = builtin_scene("ball");
    let ample = auto(0.1);
    let requested = bake(scene.clone(), &ample);
    assert_eq!(requested.warnings, []);
    let size = floor_size(&scene, &requested);
    let (taken, dense) = memory(&requested);
    let truth = dense_floor(&scene, &bake(scene.clone(), &sized(auto(0.03), size)));
    for (case, settings, memory_bytes) in [
        ("automatic", ample.clone(), taken / 10),
        ("fixed", sized(ample.clone(), size), dense / 10),
        ("fixed, a hundredth", sized(ample.clone(), size), dense / 100),
    ] {
        let scarce = set(settings, |s| s.memory_bytes = memory_bytes);
        let result = bake(scene.clone(), &scarce);
        let (taken, _) = memory(&result);
        // A texel takes four to six times as much while it is made, and a quarter is for squares.
        let fits = memory_bytes / 16..=memory_bytes;
        assert!(fits.contains(&taken), "{case}: {taken} of {memory_bytes} bytes");
        let [warning] = &result.warnings[..] else {
            panic!("{case}: {:?}", result.warnings)
        };
        assert_eq!(warning.location, "--memory");
        assert!(warning.remedy.contains("--memory"), "{warning}");
        assert!(warning.to_string().contains("MiB"), "{warning}");
        assert_eq!(energy_fault(&result), None);
        let off = rmse(&dense_floor(&scene, &result), &truth);
        let ratio = off / estimate(&result);
        assert!((0.5..2.0).contains(&ratio), "{case}: {ratio} of the estimate");
    }
}

/// Many lamps around a ball of glass, all alike.
fn lamps_around_a_ball(count: usize) -> Scene {
    let mut scene = builtin_scene("ball");
    let lamp = |index: usize| {
        let place = DQuat::from_rotation_y(index as f64 * TAU / count as f64) * dvec3(0.6, 2.5, 0.0);
        parts::point_light(&format!("lamp{index}"), place, Flux(100.0))
    };
    scene.lights = (0..count).map(lamp).collect();
    scene
}

/// Every lamp keeps maps of its own, and the limit is for all of them together.
#[test]
fn many_lamps_keep_to_the_memory() {
    let scene = lamps_around_a_ball(12);
    let settings = automatic(to(0.1, 1));
    let held = |result: &Bake| {
        result
            .course
            .iter()
            .map(|point| point.bytes)
            .max()
            .expect("a level")
    };
    let ample = bake(scene.clone(), &settings);
    assert_eq!(ample.warnings, []);
    let memory_bytes = held(&ample) / 4;
    let scarce = bake(scene, &set(settings, |s| s.memory_bytes = memory_bytes));
    let held = held(&scarce);
    assert!(held <= memory_bytes, "{held} of {memory_bytes} bytes");
    let [warning] = &scarce.warnings[..] else {
        panic!("{:?}", scarce.warnings)
    };
    assert_eq!(warning.location, "--memory");
    assert_eq!(energy_fault(&scarce), None);
}

/// Where there is no room for direct light lamp by lamp, it is added up at once, to the same bits.
#[test]
fn lamps_that_are_not_kept_add_up_alike() {
    let scene = lamps_around_a_ball(4);
    let fixed = sized(auto(0.1), (64, 64));
    for settings in [fixed, auto(0.1)] {
        let settings = with_layers(&[LayerKind::Direct], settings);
        let kept = bake(scene.clone(), &settings);
        let texels: usize = kept.maps.iter().map(|map| map.chart.texel_count()).sum();
        let scarce = set(settings, |s| s.memory_bytes = 100 * texels as u64);
        let added_up = bake(scene.clone(), &scarce);
        assert_eq!(added_up.warnings, kept.warnings);
        assert_eq!(all_bits(&added_up), all_bits(&kept));
    }
}

/// Neither threads change a bit of maps in tiles, nor tiles the direct light, but for what larger texels leave out.
#[test]
fn tiles_keep_bits_and_direct_light() {
    let scene = torus_over_a_wide_floor();
    let settings = with_layers(&CAUSTIC_AND_DIRECT, auto(0.1));
    let [one, three] = [1, 3].map(|threads| {
        let settings = set(settings.clone(), |s| s.threads = threads);
        bake(scene.clone(), &settings)
    });
    assert_same(&one, &three, "three threads");
    let dense = bake(scene.clone(), &sized(settings, floor_size(&scene, &one)));
    let [a, b] = [&one, &dense].map(|result| map_of(result, &scene, "floor"));
    assert!(a.chart.layout.is_some() && b.chart.layout.is_none());
    let [in_tiles, whole] = [a, b].map(|map| map.flux_w(LayerKind::Direct).luminance());
    assert!(
        (in_tiles / whole - 1.0).abs() < 2e-3,
        "{in_tiles} W, dense {whole} W"
    );
}

/// A ball of glass on a table in the sun, and the ground that stretches around it.
fn ball_in_the_sun(ground_m: Option<f64>) -> Scene {
    let mut scene = parts::reference_scene(0.5);
    let ball = shapes::sphere(DVec3::Y * 0.08, 0.06, 5);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    if let Some(side_m) = ground_m {
        let extent = [-0.5 * side_m, 0.5 * side_m];
        let ground = shapes::floor(extent, extent, -0.7);
        parts::add(
            &mut scene,
            "ground",
            ground,
            parts::matte("soil", LinearSrgb::grey(0.3)),
        );
    }
    let direction = dvec3(0.3, -1.0, 0.2).normalize();
    scene.lights.push(parts::sun("sun", direction, Irradiance(1.0)));
    scene
}

/// Neither caustics nor shadows on a table get coarser because of what lies far away.
#[test]
fn a_wide_landscape_leaves_small_things_fine() {
    let settings = set(with_layers(&CAUSTIC_AND_DIRECT, auto(0.1)), |s| {
        s.error_metric = ErrorMetric::Visible;
    });
    let alone = ball_in_the_sun(None);
    let (width, _) = floor_size(&alone, &bake(alone.clone(), &settings));
    let scene = ball_in_the_sun(Some(400.0));
    let wide = bake(scene.clone(), &settings);
    let (wide_width, _) = floor_size(&scene, &wide);
    assert!(2 * wide_width >= width, "{wide_width} texels, alone {width}");
    let floor = map_of(&wide, &scene, "floor").dense();
    let direct = floor.layer(LayerKind::Direct).expect("direct light");
    let (dark, bright) = direct
        .irradiance
        .iter()
        .map(|e| e[1])
        .fold((f32::INFINITY, 0.0_f32), |(low, high), e| {
            (low.min(e), high.max(e))
        });
    assert!(dark < 0.01 * bright, "{dark} in the shadow, {bright} beside it");
}

/// Texels of automatic maps for a target.
fn texels_for(name: &str, target: f64, layers: &[LayerKind]) -> usize {
    let settings = automatic(with_layers(layers, to(target, 1)));
    let result = bake(builtin_scene(name), &settings);
    result.maps.iter().map(|map| map.chart.texel_count()).sum()
}

#[test]
fn a_coarse_caustic_keeps_direct_light_fine() {
    let both = texels_for("mirror", 0.9, &CAUSTIC_AND_DIRECT);
    let direct = texels_for("mirror", 0.9, &[LayerKind::Direct]);
    assert!(both >= direct, "{both} texels with the caustic, {direct} without");
}

#[test]
fn whole_pictures_come_before_the_last() {
    let scene = builtin_scene("ring");
    let mut levels = Vec::new();
    let last = session(&scene)
        .bake_levels(&automatic(to(0.002, 0)), &(), &Control::default(), &mut |level| {
            levels.push(level)
        })
        .expect("a bake");
    assert!(levels.len() >= 2, "{} levels", levels.len());
    let flux = |result: &Bake| {
        let map = map_of(result, &scene, "floor");
        map.flux_w(LayerKind::Caustic).luminance()
    };
    for level in &levels {
        let ratio = flux(level) / flux(&last);
        assert!((ratio - 1.0).abs() < 0.01, "{ratio} of the flux");
    }
    levels.push(last);
    let is_coarse = levels[0].counts.rays * 8 < levels[levels.len() - 1].counts.rays;
    assert!(is_coarse, "the first one is coarse");
    let errors = levels.iter().filter_map(|level| level.estimated_relative_rmse);
    let errors: Vec<f64> = errors.collect();
    assert_eq!(errors.len(), levels.len(), "all have an estimate");
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
}

/// Direct and indirect light come before any caustic, and stay while glass is moved.
#[test]
fn a_room_is_lit_before_its_caustics() {
    let scene = builtin_scene("gallery");
    let layers = [LayerKind::Caustic, LayerKind::Direct, LayerKind::Indirect];
    let draft = set(BakeSettings::default(), |s| {
        s.max_error = Some(Preset::Draft.max_error())
    });
    let settings = with_layers(&layers, automatic(draft));
    let mut session = session(&scene);
    let levels_of = |session: &mut Baker| {
        let mut levels = Vec::new();
        let last = session.bake_levels(&settings, &(), &Control::default(), &mut |level| {
            levels.push(level)
        });
        (levels, last.expect("a bake"))
    };
    let lit = |result: &Bake, kind| result.maps.iter().any(|map| map.flux_w(kind).luminance() > 0.0);
    let (levels, last) = levels_of(&mut session);
    let first = levels.first().expect("a level before the last");
    assert_eq!(first.counts.rays, 0);
    assert!(lit(first, LayerKind::Direct) && lit(first, LayerKind::Indirect));
    assert!(last.counts.rays > 0 && layers.iter().all(|kind| lit(&last, *kind)));

    let ball = scene.objects.iter().position(|object| object.name == "ball");
    let aside = Motion::turned(0.0, dvec3(0.05, 0.0, 0.0));
    edit(&mut session, &Edit::Place(ball.expect("a ball"), aside));
    let (levels, _) = levels_of(&mut session);
    let first = levels.first().expect("a level before the last");
    assert!(layers.iter().all(|kind| lit(first, *kind)));
}
