//! Map sizes, and what is not baked.

use nephroid::illumination::IlluminationMap;
use nephroid::plan::Effect;
use nephroid::progress::{Control, Progress};
use nephroid::session::{BakeSession, StopReason};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};

use crate::tools::{bake, builtin_scene, energy_fault, map_of, settings};

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

/// Keeps the first picture of a bake.
#[derive(Default)]
struct FirstPicture(std::sync::Mutex<Option<Vec<IlluminationMap>>>);

impl Progress for FirstPicture {
    fn preview(&self, maps: Vec<IlluminationMap>) {
        self.0.lock().expect("no other listener").get_or_insert(maps);
    }
}

#[test]
fn an_automatic_bake_gives_a_coarse_picture_first() {
    let scene = std::sync::Arc::new(builtin_scene("ring"));
    let first = FirstPicture::default();
    let settings = BakeSettings {
        map_resolution: MapResolution::Auto,
        ..settings(1e5, 0)
    };
    let mut session = BakeSession::new(scene.clone()).expect("a session");
    let result = session
        .bake(&settings, &first, &Control::default())
        .expect("a bake");
    let preview = first.0.into_inner().expect("no panic").expect("a first picture");
    let (coarse, fine) = (&preview[0], map_of(&result, &scene, "floor"));
    assert!(coarse.width() < fine.width());
    let flux = |map: &IlluminationMap| map.flux_w(LayerKind::Caustic).luminance();
    assert!(
        (flux(coarse) / flux(fine) - 1.0).abs() < 0.01,
        "{} W against {} W",
        flux(coarse),
        flux(fine)
    );
    assert_eq!(coarse.width(), coarse.height());
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
    assert_eq!(warning.location, "floor");
    assert!(warning.remedy.contains("--memory"), "{warning}");
}
