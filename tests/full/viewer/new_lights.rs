//! Lights that the window adds to built-in scenes.

use std::sync::Arc;

use glam::DVec3;
use nephroid::geometry::Ray;
use nephroid::scene::{Light, LightKind, builtin};
use nephroid::transport::Tracer;
use nephroid::viewer::new_light::{Aim, NewLight};

use super::fixtures::{added, edited};

#[test]
fn new_lights_have_room_and_suit_the_exposure() {
    for name in ["ring", "ball", "pool", "showroom"] {
        let scene = Arc::new(builtin::build(name).expect("it is built in"));
        let tracer = Tracer::new(Arc::clone(&scene));
        let (low, high) = scene.bounds().expect("there are surfaces");
        let radius_m = 0.5 * (high - low).length();
        let middle = 0.5 * (low + high);
        for from in [
            DVec3::new(1.0, 1.2, 1.5),
            DVec3::new(-2.0, 0.7, 0.1),
            DVec3::Y * 2.0,
        ] {
            let gaze = Ray {
                origin: middle + from * radius_m,
                direction: -from.normalize(),
            };
            let aim = Aim::of(&tracer, &gaze, middle);
            for stops in [0.0, -3.0] {
                for kind in NewLight::ALL {
                    let light = kind.make((&tracer, radius_m), &aim, stops, &scene);
                    let lit = edited(&scene, &[added(light.clone())]);
                    assert_eq!(lit.lights.len(), scene.lights.len() + 1);
                    assert!(scene.lights.iter().all(|other| other.name != light.name));
                    suits(&tracer, &light, &aim, 4.0 * f64::exp2(-stops));
                }
            }
        }
    }
}

/// Nothing stands between a light and what it is for, which faces it, and its irradiance across the way is that.
fn suits(tracer: &Tracer, light: &Light, aim: &Aim, irradiance_w_m2: f64) {
    let strength = light.kind.strength();
    if let LightKind::Sun { direction, .. } = light.kind {
        assert_eq!(strength, irradiance_w_m2);
        assert!(direction.is_normalized() && direction.y < 0.0);
        return;
    }
    let position = light.kind.position().expect("it has a place");
    let way = aim.point - position;
    assert!(way.dot(aim.normal) < 0.0, "{light:?} is behind {aim:?}");
    let ray = Ray {
        origin: position,
        direction: way.normalize(),
    };
    let met = tracer.closest_place(&ray).expect("it is aimed at a surface");
    let share = met.distance_m / way.length();
    assert!((share - 1.0).abs() < 1e-3, "{light:?} is hidden from {aim:?}");
    let per_m2 = way.length_squared().recip();
    let found = match light.kind {
        // Of a panel that is small against its distance: radiance times solid angle.
        LightKind::Panel { across, down, .. } => {
            let normal = across.cross(down);
            assert!(normal.normalize().dot(way.normalize()) > 0.999);
            strength * 4.0 * normal.length() * per_m2
        }
        _ => strength * per_m2,
    };
    assert!((found / irradiance_w_m2 - 1.0).abs() < 1e-9, "{found} W/m²");
    if let LightKind::Spot { direction, .. } = light.kind {
        assert!(direction.dot(way.normalize()) > 1.0 - 1e-9);
    }
}
