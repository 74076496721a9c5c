//! Map sizes, and what is not baked.

use glam::DVec3;
use nephroid::plan::Effect;
use nephroid::progress::Control;
use nephroid::scene::builtin::parts;
use nephroid::session::{BakeResult, BakeSession, StopReason};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::units::Flux;

use crate::tools::{at, bake, builtin_scene, energy_fault, map_of, settings};

#[test]
fn automatic_maps_grow_with_the_density() {
    let scene = builtin_scene("ring");
    let mut last = 0;
    for density in [1e3, 1.6e4, 2.56e5] {
        let settings = BakeSettings {
            map_resolution: MapResolution::Auto,
            ..settings(density, 0)
        };
        let result = bake(scene.clone(), &settings);
        let map = map_of(&result, &scene, "floor");
        assert!(
            map.width() > last,
            "density {density}: {} after {last} texels",
            map.width()
        );
        assert_eq!(map.width(), map.height(), "the floor is square");
        // No coarser than the footprints: a texel for every ray, about.
        assert!((map.width() * map.height()) as u64 >= result.counts.splats / 4);
        assert_eq!(energy_fault(&result), None);
        last = map.width();
    }
}

#[test]
fn without_light_or_anything_specular_nothing_is_traced_or_allocated() {
    let mut dark = builtin_scene("ring");
    dark.lights.clear();
    let mut dull = builtin_scene("ring");
    dull.objects.retain(|object| object.name == "floor");
    let mut nowhere = builtin_scene("ring");
    nowhere.objects.retain(|object| object.name != "floor");
    for (case, scene) in [("dark", dark), ("dull", dull), ("nowhere", nowhere)] {
        let result = bake(scene, &settings(1e4, 64));
        assert_eq!(result.counts.rays, 0, "{case}");
        assert_eq!(result.counts.segments, 0, "{case}");
        assert!(result.maps.is_empty(), "{case}");
        assert_eq!(result.stop_reason, StopReason::NothingToDo, "{case}");
        assert!(!result.plan.is_on(Effect::LightPass), "{case}");
    }
}

#[test]
fn whole_pictures_come_before_the_last_one_each_finer_than_the_one_before() {
    let scene = std::sync::Arc::new(builtin_scene("ring"));
    let settings = BakeSettings {
        map_resolution: MapResolution::Auto,
        density_per_sr: 1e5,
        ..BakeSettings::default()
    };
    let mut session = BakeSession::new(scene.clone()).expect("a session");
    let mut levels = Vec::new();
    let last = session
        .bake_levels(&settings, &(), &Control::default(), &mut |level| {
            levels.push(level)
        })
        .expect("a bake");
    assert!(levels.len() >= 3, "{} levels", levels.len());
    let flux = |result: &BakeResult| {
        let map = map_of(result, &scene, "floor");
        map.flux_w(LayerKind::Caustic).luminance()
    };
    for level in &levels {
        assert!(
            (flux(level) / flux(&last) - 1.0).abs() < 0.01,
            "{} W",
            flux(level)
        );
    }
    levels.push(last);
    assert!(
        levels[0].counts.rays * 8 < levels[levels.len() - 1].counts.rays,
        "the first one is coarse"
    );
    let errors: Vec<f64> = levels
        .iter()
        .filter_map(|level| level.estimated_relative_rmse)
        .collect();
    assert_eq!(
        errors.len(),
        levels.len() - 1,
        "all but the first have an estimate"
    );
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
}

#[test]
fn maps_made_coarser_for_memory_say_so() {
    let scene = builtin_scene("ring");
    let with = |memory_bytes| {
        let settings = BakeSettings {
            map_resolution: MapResolution::Auto,
            memory_bytes,
            ..settings(1e5, 0)
        };
        bake(scene.clone(), &settings)
    };
    let (ample, scarce) = (with(4 << 30), with(1 << 20));
    assert_eq!(ample.warnings, []);
    assert!(map_of(&scarce, &scene, "floor").width() < map_of(&ample, &scene, "floor").width());
    assert_eq!(energy_fault(&scarce), None);
    let [warning] = &scarce.warnings[..] else {
        panic!("{:?}", scarce.warnings)
    };
    assert_eq!(warning.location, "--memory");
    assert!(warning.remedy.contains("--memory"), "{warning}");
}

#[test]
fn each_light_has_its_part_of_each_layer_where_that_is_asked_for() {
    let mut scene = builtin_scene("mirror");
    let second = parts::point_light("second lamp", DVec3::new(0.1, 1.0, -0.2), Flux(30.0));
    scene.lights.push(second);
    let settings = BakeSettings {
        per_light: true,
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..at(5_000.0, 32)
    };
    let result = bake(scene.clone(), &settings);
    let map = map_of(&result, &scene, "floor");
    for layer in &map.layers {
        let parts: Vec<_> = result
            .light_layers
            .iter()
            .filter(|part| part.receiver == map.chart.receiver && part.kind == layer.kind)
            .collect();
        assert_eq!(parts.iter().map(|part| part.light).collect::<Vec<_>>(), [0, 1]);
        for (texel, whole) in layer.irradiance.iter().enumerate() {
            let sum: f32 = parts.iter().map(|part| part.irradiance[texel][1]).sum();
            assert!(
                (sum - whole[1]).abs() <= 1e-5 * whole[1].max(1e-3),
                "{:?} {texel}",
                layer.kind
            );
        }
    }
    assert!(bake(scene.clone(), &at(5_000.0, 32)).light_layers.is_empty());

    let folder = tempfile::tempdir().expect("a folder");
    let target = nephroid::export::map_folder::MapFolder::open(folder.path(), false).expect("a place");
    let manifest = target.write(&scene, &settings, &result).expect("written");
    let entry = manifest
        .maps
        .iter()
        .find(|entry| entry.surface == "floor")
        .expect("the floor");
    let names: Vec<&str> = entry.lights.iter().map(|part| part.channels.as_str()).collect();
    assert_eq!(
        names,
        [
            "caustic.light",
            "caustic.second-lamp",
            "direct.light",
            "direct.second-lamp"
        ]
    );
    let bytes = std::fs::read(folder.path().join(&entry.file)).expect("a file");
    let image = nephroid::export::exr::decode(&bytes, "map").expect("an image");
    let channel = |name: &str| {
        let found = image.channels.iter().find(|channel| channel.name == name);
        &found.unwrap_or_else(|| panic!("no {name}")).values
    };
    let part = result
        .light_layers
        .iter()
        .find(|part| part.light == 1 && part.receiver == map.chart.receiver);
    let expected: Vec<f32> = part
        .expect("a part")
        .irradiance
        .iter()
        .map(|rgb| rgb[1])
        .collect();
    assert_eq!(channel("caustic.second-lamp.G"), &expected);
}
