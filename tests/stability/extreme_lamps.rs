//! Lamps with extent that are hardly any: whole bakes stay finite and say nothing untrue.

use std::sync::Arc;

use glam::DVec3;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Environment, Light, LightKind, LightSize, PanelShape, Scene};
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::units::Radiance;

/// A floor with a ball of glass above it, and one lamp.
fn scene(kind: LightKind) -> Scene {
    let mut scene = parts::reference_scene(0.6);
    let ball = shapes::sphere(DVec3::new(0.0, 0.4, 0.0), 0.2, 2);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    scene.lights.push(Light {
        name: "lamp".into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind,
        size: LightSize::None,
    });
    scene
}

fn under(width: usize, height: usize, radiance: f32, scale: f64) -> Scene {
    let mut scene = scene(LightKind::Environment { scale });
    let pixels = vec![[radiance; 3]; width * height];
    scene.environment = Some(Arc::new(Environment::new(width, height, pixels).expect("sound")));
    scene
}

/// A bake of direct light; every number in it is finite and none is negative.
fn baked(scene: Scene) -> BakeResult {
    let settings = BakeSettings {
        density_per_sr: 300.0,
        max_error: None,
        layers: vec![LayerKind::Direct],
        map_resolution: MapResolution::Fixed {
            width: 16,
            height: 16,
        },
        ..BakeSettings::default()
    };
    let mut session = BakeSession::new(Arc::new(scene)).expect("it is sound");
    let result = session
        .bake(&settings, &(), &Default::default())
        .expect("it bakes");
    for map in &result.maps {
        for layer in &map.layers {
            let mut channels = layer.irradiance.iter().flatten();
            assert!(channels.all(|e| e.is_finite() && *e >= 0.0), "{:?}", layer.kind);
        }
    }
    result
}

/// Largest E of the direct layer of the floor [W/m²].
fn brightest(result: &BakeResult) -> f32 {
    let floor = result.maps.iter().find(|map| map.chart.object() == 0);
    let layer = floor.and_then(|map| map.layer(LayerKind::Direct));
    let channels = layer
        .into_iter()
        .flat_map(|layer| layer.irradiance.iter().flatten());
    channels.fold(0.0, |largest, e| largest.max(*e))
}

#[test]
fn skies_of_one_pixel_black_ones_and_blinding_ones() {
    let even = brightest(&baked(under(1, 1, 2.0, 1.0)));
    assert!((5.0..14.0).contains(&even), "about 2π on both sides: {even}");
    let blinding = brightest(&baked(under(1, 1, 2e30, 1.0)));
    assert!((blinding / even / 1e30 - 1.0).abs() < 1e-3, "{blinding}");
    assert_eq!(brightest(&baked(under(2, 1, 0.0, 1.0))), 0.0);
    let dim = brightest(&baked(under(1, 1, 2.0, 1e-20)));
    assert!((dim / even / 1e-20 - 1.0).abs() < 1e-3, "{dim}");
    // An environment that was not read lights nothing.
    assert_eq!(
        brightest(&baked(scene(LightKind::Environment { scale: 1.0 }))),
        0.0
    );
}

#[test]
fn panels_without_area_and_blinding_ones() {
    let panel = |half_m: f64, radiance: f64| LightKind::Panel {
        centre: DVec3::Y,
        across: DVec3::X * half_m,
        down: DVec3::Z * half_m,
        shape: PanelShape::Rectangle,
        radiance: Radiance(radiance),
    };
    assert_eq!(brightest(&baked(scene(panel(0.0, 1.0)))), 0.0);
    let large = brightest(&baked(scene(panel(0.5, 1.0))));
    let blinding = brightest(&baked(scene(panel(0.5, 1e30))));
    assert!(
        large > 0.1 && (blinding / large / 1e30 - 1.0).abs() < 1e-3,
        "{blinding}"
    );
    // So small that its area is hardly a number.
    assert!(brightest(&baked(scene(panel(1e-150, 1.0)))) < 1e-30);
}

/// The floor glows itself; a sheet lies on it; the ball of glass glows.
#[test]
fn what_glows_may_be_anything_in_the_scene() {
    let glowing = |object: usize| LightKind::Surface {
        object,
        radiance: Radiance(1.0),
    };
    assert_eq!(
        brightest(&baked(scene(glowing(0)))),
        0.0,
        "flat, it does not light itself"
    );
    assert!(
        brightest(&baked(scene(glowing(1)))) > 0.1,
        "the ball lights the floor"
    );
    let mut lying = scene(glowing(2));
    let sheet = shapes::floor([-0.3, 0.3], [-0.3, 0.3], 0.0);
    parts::add(
        &mut lying,
        "sheet",
        sheet,
        parts::matte("sheet", LinearSrgb::WHITE),
    );
    assert!(f64::from(brightest(&baked(lying))) <= 2.0 * std::f64::consts::PI);
    // An object that does not exist is no light.
    assert_eq!(brightest(&baked(scene(glowing(7)))), 0.0);
}
