//! The helpers of these and other tests, with wrong input that they have to notice.

use std::sync::Arc;

use glam::DVec3;
use nephroid::export::FloatImage;
use nephroid::scene::{LightKind, Scene};

use crate::support::evidence::{keep_bytes, keep_images};
use crate::support::sound::scene_fault;
use crate::support::{assert_close, reference_map};
use crate::tools::builtin_scene;

#[test]
fn every_broken_promise_of_a_scene_is_noticed() {
    let _alone = crate::watch::alone();
    let sound = builtin_scene("showroom");
    assert_eq!(scene_fault(&sound), None);
    type Break = fn(&mut Scene);
    let breaks: [(&str, Break); 12] = [
        ("position", |s| {
            Arc::make_mut(&mut s.objects[0].mesh).positions[0].x = f64::NAN
        }),
        ("normal", |s| {
            Arc::make_mut(&mut s.objects[0].mesh).normals[0] *= 1.001
        }),
        ("normals", |s| {
            Arc::make_mut(&mut s.objects[0].mesh).normals.truncate(1)
        }),
        ("vertex", |s| {
            Arc::make_mut(&mut s.objects[0].mesh).triangles[0][1] = u32::MAX
        }),
        ("triangle", |s| {
            Arc::make_mut(&mut s.objects[0].mesh).triangles.clear()
        }),
        ("material", |s| s.objects[0].material = 9999),
        ("index", |s| s.materials[0].ior = 0.5),
        ("share", |s| s.materials[0].roughness = f64::NAN),
        ("colour", |s| s.materials[0].base_colour.g = 1.5),
        ("strength", |s| s.lights[0].colour.r = f64::INFINITY),
        ("place", |s| {
            s.lights[0].kind = s.lights[0].kind.moved(DVec3::splat(f64::INFINITY))
        }),
        ("camera", |s| s.cameras[0].forward = DVec3::ZERO),
    ];
    let has_place = |s: &Scene| s.lights[0].kind.position().is_some();
    for (what, damage) in breaks {
        let mut scene = sound.clone();
        if what == "place" && !has_place(&scene) {
            scene.lights[0].kind = LightKind::Point {
                position: DVec3::ZERO,
                intensity: nephroid::units::RadiantIntensity(1.0),
            };
        }
        damage(&mut scene);
        assert!(scene_fault(&scene).is_some(), "a wrong {what} passes");
    }
}

#[test]
fn evidence_is_image_reference_and_difference() {
    let _alone = crate::watch::alone();
    let (image, reference) = (vec![[3.0, 2.0, 1.0]; 6], vec![[1.0, 2.0, 3.0]; 6]);
    let told = keep_images("helpers", &image, &reference, 3);
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("evidence");
    assert!(
        told.contains(&folder.join("helpers").display().to_string()),
        "{told}"
    );
    for (part, expected) in [("image", 3.0), ("reference", 1.0), ("difference", 2.0)] {
        let file = FloatImage::read(&folder.join(format!("helpers-{part}.exr"))).expect("it was written");
        assert_eq!((file.width, file.height), (3, 2));
        assert_eq!(file.channel("R"), Some(&[expected; 6][..]), "{part}");
    }
    keep_bytes("helpers.bin", b"input");
    assert_eq!(
        std::fs::read(folder.join("helpers.bin")).expect("it was written"),
        b"input"
    );
    let other_sizes = || keep_images("helpers", &image, &reference[..5], 3);
    assert!(std::panic::catch_unwind(other_sizes).is_err());
}

#[test]
fn closeness_is_relative_and_absolute_at_zero() {
    let _alone = crate::watch::alone();
    assert_close(1.0005, 1.0, 1e-3, "within");
    assert_close(1e-4, 0.0, 1e-3, "within");
    for (actual, expected) in [
        (1.002, 1.0),
        (2e-3, 0.0),
        (f64::NAN, 1.0),
        (1.0, f64::NAN),
        (-1.0, 1.0),
    ] {
        let close = || assert_close(actual, expected, 1e-3, "apart");
        assert!(
            std::panic::catch_unwind(close).is_err(),
            "{actual} passes for {expected}"
        );
    }
}

#[test]
fn a_reference_that_is_not_there_is_no_reference() {
    let _alone = crate::watch::alone();
    assert_eq!(reference_map("S1").len(), 256 * 256);
    assert!(std::panic::catch_unwind(|| reference_map("S99")).is_err());
}
