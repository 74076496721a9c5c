//! Map sizes, levels on the way, and layers light by light.

use nephroid::progress::Control;
use nephroid::session::BakeResult;
use nephroid::settings::LayerKind;

use crate::bake::common::{automatic, session};
use support::tools::{at, bake, builtin_scene, energy_fault, map_of, settings};

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
