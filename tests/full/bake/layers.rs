//! Map sizes, levels on the way, and layers light by light.

use nephroid::export::exr::decode;
use nephroid::export::map_folder::MapFolder;
use nephroid::progress::Control;
use nephroid::scene::builtin::parts;
use nephroid::session::BakeResult;
use nephroid::settings::LayerKind;
use nephroid::units::Flux;

use glam::DVec3;

use crate::bake::common::{CAUSTIC_AND_DIRECT, automatic, session, with_layers};
use support::tools::{at, bake, builtin_scene, energy_fault, map_of, set, settings};

#[test]
fn automatic_maps_grow_with_the_density() {
    let scene = builtin_scene("ring");
    let mut last = 0;
    for density in [1e3, 1.6e4, 2.56e5] {
        let result = bake(scene.clone(), &automatic(settings(density, 0)));
        let map = map_of(&result, &scene, "floor");
        assert!(map.width() > last, "{} after {last} texels", map.width());
        assert_eq!(map.width(), map.height(), "the floor is square");
        // No coarser than the footprints: a texel for every ray, about.
        assert!((map.width() * map.height()) as u64 >= result.counts.splats / 4);
        assert_eq!(energy_fault(&result), None);
        last = map.width();
    }
}

#[test]
fn whole_pictures_come_before_the_last() {
    let scene = builtin_scene("ring");
    let mut levels = Vec::new();
    let last = session(&scene)
        .bake_levels(&automatic(at(1e5, 0)), &(), &Control::default(), &mut |level| {
            levels.push(level)
        })
        .expect("a bake");
    assert!(levels.len() >= 3, "{} levels", levels.len());
    let flux = |result: &BakeResult| {
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
    assert_eq!(
        errors.len(),
        levels.len() - 1,
        "all but the first have an estimate"
    );
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
}

#[test]
fn each_light_has_its_part_of_each_layer() {
    let mut scene = builtin_scene("mirror");
    let second = parts::point_light("second lamp", DVec3::new(0.1, 1.0, -0.2), Flux(30.0));
    scene.lights.push(second);
    let settings = set(with_layers(&CAUSTIC_AND_DIRECT, at(5_000.0, 32)), |s| {
        s.per_light = true
    });
    let result = bake(scene.clone(), &settings);
    let map = map_of(&result, &scene, "floor");
    let part = |light: usize, kind: LayerKind| {
        let mut parts = result.light_layers.iter();
        let found =
            parts.find(|part| (part.light, part.receiver, part.kind) == (light, map.chart.receiver, kind));
        &found.expect("a part").irradiance
    };
    for layer in &map.layers {
        let [first, second] = [0, 1].map(|light| part(light, layer.kind));
        for (texel, whole) in layer.irradiance.iter().enumerate() {
            let sum = first[texel][1] + second[texel][1];
            let off = (sum - whole[1]).abs();
            assert!(off <= 1e-5 * whole[1].max(1e-3), "{:?} {texel}", layer.kind);
        }
    }
    assert!(bake(scene.clone(), &at(5_000.0, 32)).light_layers.is_empty());

    let folder = tempfile::tempdir().expect("a folder");
    let target = MapFolder::open(folder.path(), false).expect("a place");
    let manifest = target.write(&scene, &settings, &result).expect("written");
    let mut entries = manifest.maps.iter();
    let entry = entries.find(|entry| entry.surface == "floor").expect("the floor");
    let names: Vec<&str> = entry.lights.iter().map(|part| part.channels.as_str()).collect();
    let expected = [
        "caustic.light",
        "caustic.second-lamp",
        "direct.light",
        "direct.second-lamp",
    ];
    assert_eq!(names, expected);
    let bytes = std::fs::read(folder.path().join(&entry.file)).expect("a file");
    let image = decode(&bytes, "map").expect("an image");
    let green: Vec<f32> = part(1, LayerKind::Caustic).iter().map(|rgb| rgb[1]).collect();
    assert_eq!(
        image.channel("caustic.second-lamp.G").expect("its channel"),
        &green[..]
    );
}
