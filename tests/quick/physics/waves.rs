//! Waves on normals: the gradient of a height, and the normal of the surface of that height.

use nephroid::scene::builtin::pool;
use nephroid::transport::bend;

use crate::prelude::*;
use support::scenes::wave;

fn waves() -> Waves {
    Waves::new(vec![
        wave(0.02, 0.7, DVec3::X, 1.0),
        wave(0.01, 0.9, dvec3(0.2, 0.5, -1.0), 2.0),
        wave(0.003, 0.1, DVec3::Z, 0.0),
    ])
    .expect("gentle waves")
}

#[test]
fn gradients_are_derivatives_of_the_height() {
    let waves = waves();
    let step = 1e-5;
    for place in 0..50 {
        let point = dvec3(0.37, -0.21, 0.53) * f64::from(place);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let (before, after) = (point - axis * step, point + axis * step);
            let slope = (waves.height_m(after) - waves.height_m(before)) / (2.0 * step);
            near(slope, waves.gradient(point).dot(axis), 1e-7, point);
        }
    }
}

#[test]
fn bent_normals_are_of_the_displaced_surface() {
    let bumped = built_in("pool-bump");
    let waves = bumped.materials[1].waves.as_ref().expect("it has waves");
    let mesh = pool::meshed(DVec3::Y, [1.5; 2], [512; 2], waves);
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals).step_by(97) {
        near(waves.height_m(*position), position.y - 1.0, 1e-12, position);
        near(
            bend::bent(DVec3::Y, waves.gradient(*position)),
            *normal,
            1e-12,
            position,
        );
    }
}

#[test]
fn waves_that_cannot_be_are_refused() {
    let good = waves().list()[0];
    let changed = |change: fn(&mut Wave)| {
        let mut wave = good;
        change(&mut wave);
        wave
    };
    for (list, word) in [
        (vec![], "0 waves"),
        (vec![good; 9], "9 waves"),
        (vec![changed(|wave| wave.amplitude_m = 0.2)], "steeper"),
        (vec![good, changed(|wave| wave.wavelength_m = 0.0)], "wave 1"),
        (vec![changed(|wave| wave.direction = DVec3::ZERO)], "wave 0"),
        (vec![changed(|wave| wave.phase_rad = f64::NAN)], "wave 0"),
    ] {
        says(Waves::new(list).expect_err("cannot be"), word);
    }
}
