//! The wavefront estimator where its geometry degenerates: every watt booked, every texel finite and not negative.

use std::sync::Arc;

use glam::DVec3;
use nephroid::progress::Control;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{LightKind, Scene};
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::units::{Flux, Irradiance};

fn bake(scene: &Scene, density_per_sr: f64, max_depth: u32) -> BakeResult {
    let settings = BakeSettings {
        density_per_sr,
        max_depth,
        map_resolution: MapResolution::Fixed {
            width: 64,
            height: 64,
        },
        ..BakeSettings::default()
    };
    let mut session = BakeSession::new(Arc::new(scene.clone())).expect("a session");
    let result = session.bake(&settings, &(), &Control::default()).expect("a bake");
    for ledger in &result.ledgers {
        let imbalance = ledger.energy_w.relative_imbalance();
        assert!(imbalance < 1e-6, "{}: {ledger:?}", scene.name);
        assert!(
            ledger.energy_w.truncated.non_finite == 0.0,
            "{}: {ledger:?}",
            scene.name
        );
    }
    let held: f64 = result
        .maps
        .iter()
        .map(|map| map.flux_w(LayerKind::Caustic).luminance())
        .sum();
    let deposited: f64 = result
        .ledgers
        .iter()
        .map(|ledger| ledger.energy_w.deposited)
        .sum();
    assert!(
        (held - deposited).abs() <= 1e-6 * deposited,
        "{}: {held} W held",
        scene.name
    );
    for map in &result.maps {
        let layer = map.layer(LayerKind::Caustic).expect("a caustic layer");
        assert!(
            layer
                .irradiance
                .iter()
                .flatten()
                .all(|e| e.is_finite() && *e >= 0.0),
            "{}: a texel is negative or not finite",
            scene.name
        );
    }
    result
}

fn lamp(scene: &mut Scene, position: DVec3) {
    scene
        .lights
        .push(parts::point_light("light", position, Flux(100.0)));
}

/// A slab that covers the whole floor as the lamp sees it.
fn wide_slab(ior: f64) -> Scene {
    let mut scene = parts::reference_scene(0.5);
    scene.name = format!("slab of {ior}");
    let slab = shapes::cuboid(DVec3::new(-3.0, 0.5, -3.0), DVec3::new(3.0, 0.7, 3.0));
    parts::add(&mut scene, "slab", slab, parts::dielectric("glass", ior));
    lamp(&mut scene, DVec3::new(0.1, 1.5, 0.05));
    scene
}

#[test]
fn glass_without_an_interface_changes_nothing() {
    // E = I·cos θ/r² = I·h/(x² + h² + z²)^(3/2), as if nothing were there.
    let result = bake(&wide_slab(1.0), 2e3, 16);
    let layer = result.maps[0].layer(LayerKind::Caustic).expect("a caustic layer");
    let intensity = 100.0 / (4.0 * std::f64::consts::PI);
    let mut squares = 0.0;
    for (texel, e) in layer.irradiance.iter().enumerate() {
        let place = |index: usize| (index as f64 + 0.5) / 64.0 - 0.5;
        let (x, z) = (place(texel % 64) - 0.1, place(texel / 64) - 0.05);
        let expected = intensity * 1.5 / (x * x + 1.5 * 1.5 + z * z).powf(1.5);
        squares += (f64::from(e[1]) / expected - 1.0).powi(2);
    }
    let off = (squares / 4096.0).sqrt();
    assert!(off < 0.005, "off by {off}");
}

#[test]
fn weak_strong_and_inverted_interfaces_book_every_watt() {
    for ior in [1.0 + 1e-6, 1.0 - 1e-6, 0.7, 3.0, 10.0] {
        let result = bake(&wide_slab(ior), 1e3, 16);
        assert!(result.ledgers[0].energy_w.deposited > 0.0, "{ior}");
    }
}

#[test]
fn a_closed_hall_of_mirrors_ends_at_its_depth() {
    let mut scene = parts::reference_scene(0.4);
    scene.name = "hall".into();
    let hall = shapes::cuboid(DVec3::new(-0.5, -0.1, -0.5), DVec3::new(0.5, 1.0, 0.5));
    parts::add(&mut scene, "hall", hall, parts::mirror());
    let ball = shapes::sphere(DVec3::new(0.1, 0.5, 0.0), 0.2, 3);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    lamp(&mut scene, DVec3::new(-0.2, 0.8, 0.1));
    let result = bake(&scene, 100.0, 24);
    let energy = result.ledgers[0].energy_w;
    // What rays between the traced ones cannot say is given up and booked; out of the hall goes nothing.
    assert!(energy.escaped < 1e-3 * energy.emitted, "{energy:?}");
    assert!(energy.deposited > 0.0);
    assert!(
        energy.truncated.depth + energy.truncated.threshold > 0.0,
        "{energy:?}"
    );
}

#[test]
fn a_sun_into_the_focus_of_a_paraboloid_on_the_floor_stays_finite() {
    // z² + x² = 4f·(y_apex − y) opens downwards: all light meets in one point of the floor.
    let mut scene = parts::reference_scene(0.5);
    scene.name = "focus".into();
    let focal_m = 1.0;
    let mirror = shapes::sheet(64, 64, |u, v| {
        let (x, z) = (0.8 * (u - 0.5) + 0.9, 0.8 * (v - 0.5));
        let y = (x * x + z * z) / (4.0 * focal_m) - focal_m;
        let normal = DVec3::new(-x / (2.0 * focal_m), 1.0, -z / (2.0 * focal_m)).normalize();
        (DVec3::new(x, y, z), normal)
    });
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    scene
        .lights
        .push(parts::sun("sun", DVec3::NEG_Y, Irradiance(1.0)));
    let result = bake(&scene, 1e3, 16);
    assert!(result.ledgers[0].energy_w.emitted > 0.0);
}

#[test]
fn a_lamp_in_the_plane_of_its_receiver_and_on_the_mirror_stays_finite() {
    let mut scene = parts::reference_scene(1.0);
    scene.name = "edge-on".into();
    let mirror = shapes::rectangle(
        DVec3::new(0.0, 0.4, 0.0),
        DVec3::new(0.0, 0.4, 0.0),
        DVec3::new(0.0, 0.0, 0.5),
    );
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    for position in [
        DVec3::new(0.5, 0.0, 0.1),
        DVec3::new(0.0, 0.4, 0.1),
        DVec3::new(0.3, 1e-12, 0.0),
    ] {
        let mut lit = scene.clone();
        lamp(&mut lit, position);
        bake(&lit, 500.0, 16);
    }
    // Parallel to the receiver.
    let mut lit = scene;
    lit.lights
        .push(parts::sun("sun", DVec3::new(-1.0, 0.0, 0.0), Irradiance(1.0)));
    assert!(matches!(lit.lights[0].kind, LightKind::Sun { .. }));
    bake(&lit, 500.0, 16);
}
