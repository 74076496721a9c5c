//! Waves on normals: the gradient of a height, its change, and the normal of the surface of that height.

use glam::DVec3;
use nephroid::scene::{Wave, Waves, builtin};
use nephroid::transport::bend;

fn waves() -> Waves {
    let wave = |amplitude_m, wavelength_m, direction: DVec3, phase_rad| Wave {
        amplitude_m,
        wavelength_m,
        direction: direction.normalize(),
        phase_rad,
    };
    Waves::new(vec![
        wave(0.02, 0.7, DVec3::X, 1.0),
        wave(0.01, 0.9, DVec3::new(0.2, 0.5, -1.0), 2.0),
        wave(0.003, 0.1, DVec3::Z, 0.0),
    ])
    .expect("gentle waves")
}

#[test]
fn gradient_and_its_change_are_the_derivatives_of_the_height() {
    let waves = waves();
    let step = 1e-5;
    for place in 0..50 {
        let point = DVec3::new(0.37, -0.21, 0.53) * f64::from(place);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let (before, after) = (point - axis * step, point + axis * step);
            let slope = (waves.height_m(after) - waves.height_m(before)) / (2.0 * step);
            assert!((slope - waves.gradient(point).dot(axis)).abs() < 1e-7);
            let change = (waves.gradient(after) - waves.gradient(before)) / (2.0 * step);
            assert!(change.distance(waves.gradient_change(point, axis)) < 1e-5);
        }
    }
}

#[test]
fn a_bent_normal_is_that_of_the_displaced_surface() {
    let displaced = builtin::build("pool").expect("the pool");
    let bumped = builtin::build("pool-bump").expect("the pool as a quad");
    let waves = bumped.materials[1].waves.as_ref().expect("it has waves");
    let mesh = &displaced.objects[1].mesh;
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals).step_by(97) {
        let height_m = position.y - 1.0;
        assert!((waves.height_m(*position) - height_m).abs() < 1e-12);
        let bent = bend::bent(DVec3::Y, waves.gradient(*position));
        assert!(bent.distance(*normal) < 1e-12, "{bent} instead of {normal}");
    }
}

#[test]
fn the_change_of_a_bent_normal_is_its_derivative_on_curved_surfaces_too() {
    let waves = waves();
    // The unit sphere: n = P.
    let normal_at = |point: DVec3| bend::bent(point.normalize(), waves.gradient(point));
    for place in 0..40 {
        let angle = f64::from(place) * 0.7;
        let point = DVec3::new(angle.cos(), 0.3 * angle.sin(), angle.sin()).normalize();
        let along = point.cross(DVec3::new(0.3, 1.0, 0.2)).normalize();
        let step = 1e-6;
        let change = (normal_at(point + along * step) - normal_at(point - along * step)) / (2.0 * step);
        let exact = bend::bent_change(
            point,
            waves.gradient(point),
            along,
            waves.gradient_change(point, along),
        );
        assert!(
            change.distance(exact) < 1e-6 * exact.length().max(1.0),
            "{change} {exact}"
        );
    }
}

#[test]
fn waves_that_cannot_be_are_refused() {
    let good = waves().list()[0];
    let steep = Wave {
        amplitude_m: 0.2,
        ..good
    };
    let endless = Wave {
        wavelength_m: 0.0,
        ..good
    };
    let nowhere = Wave {
        direction: DVec3::ZERO,
        ..good
    };
    for (list, word) in [
        (vec![], "0 waves"),
        (vec![good; 9], "9 waves"),
        (vec![steep], "steeper"),
        (vec![good, endless], "wave 1"),
        (vec![nowhere], "wave 0"),
        (
            vec![Wave {
                phase_rad: f64::NAN,
                ..good
            }],
            "wave 0",
        ),
    ] {
        let why = Waves::new(list).expect_err("cannot be");
        assert!(why.contains(word), "{why}");
    }
}
