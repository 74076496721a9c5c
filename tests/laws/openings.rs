//! Casters, slits and pinholes far narrower than a cell: all the light that meets them or goes through is found.

use nephroid::light_pass::item_buffer::CELLS_PER_SIDE;

use support::laws::Table;
use support::laws::law::*;
use support::laws::scenes::*;
use support::prelude::*;

/// The widest openings are 1.5 times, the narrowest 0.005 times as wide [m].
const OPENING_M: f64 = 0.0063;
const LAMP: DVec3 = dvec3(0.013, -0.021, 0.034);

pub fn fill(t: &mut Table) {
    for (seed, (least, most)) in [
        (1, (0.01, 0.03)),
        (2, (0.03, 0.1)),
        (3, (0.1, 0.3)),
        (4, (0.3, 1.0)),
    ] {
        let mirrors = tiny_mirrors(seed, (least, most));
        let seen_sr: f64 = mirrors.iter().map(|mirror| solid_angle_sr(mirror, LAMP)).sum();
        t.case(format!("1000-mirrors-of-{least}-to-{most}-cells"))
            .bake(around_the_lamp(mirrors), 0.02, 16)
            .watts(seen_sr, 0.05);
    }
    let mirrors = tiny_mirrors(11, (0.01, 1.0));
    for mirror in mirrors.iter().step_by(16) {
        let seen_sr = solid_angle_sr(mirror, LAMP);
        t.case("tiny-mirrors-one-by-one")
            .bake(around_the_lamp(vec![mirror.clone()]), 0.02, 16)
            .measure("I times the solid angle arrives", 0.05, move |bake| {
                off(deposited_w(bake), seen_sr)
            });
    }
    let mut random = random(5);
    for index in 0..40 {
        let (scene, border) = plate_with_an_opening(&mut random);
        let triangles = border[1..].windows(2).map(|pair| [border[0], pair[0], pair[1]]);
        let (lamp, sun) = (dvec3(0.013, 2.0, 0.007), dvec3(0.01, -1.0, 0.03).normalize());
        let seen = |[a, b, c]: [DVec3; 3]| match index % 2 {
            0 => solid_angle_sr(&shapes::facet([a, b, c]), lamp),
            _ => 0.5 * (b - a).cross(c - a).dot(sun).abs(),
        };
        let watts: f64 = triangles.map(seen).sum();
        t.case("narrow-openings")
            .bake(
                if index % 2 == 0 {
                    scene.lamp(lamp)
                } else {
                    scene.sun(sun)
                },
                0.02,
                32,
            )
            .measure("what the opening lets through is sent", 0.02, move |bake| {
                off(emitted_w(bake), watts)
            });
    }
}

/// A thousand square mirrors 1 m from the lamp, their widths between two shares of a cell of the item buffer, tilted by
/// up to 60 degrees.
fn tiny_mirrors(seed: u64, (least, most): (f64, f64)) -> Vec<Mesh> {
    let mut random = random(seed);
    let cell_rad = (4.0 * PI / (6.0 * (CELLS_PER_SIDE * CELLS_PER_SIDE) as f64)).sqrt();
    let mut mirror = || {
        let z = 2.0 * random() - 1.0;
        let (sine, cosine) = (TAU * random()).sin_cos();
        let towards = dvec3((1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z);
        let half_m = 0.5 * cell_rad * least * (most / least).powf(random());
        let (x, y) = towards.any_orthonormal_pair();
        let (s, c) = (TAU * random()).sin_cos();
        let (ts, tc) = (random() * 60.0_f64.to_radians()).sin_cos();
        let (across, along) = (x * c + y * s, y * c - x * s);
        shapes::rectangle(
            LAMP + towards,
            across * half_m,
            (along * tc + towards * ts) * half_m,
        )
    };
    (0..1000).map(|_| mirror()).collect()
}

/// Mirrors around a lamp in a closed room.
fn around_the_lamp(mirrors: Vec<Mesh>) -> Scene {
    mirrors.into_iter().fold(room(2.5).lamp(LAMP), Build::mirror)
}

/// A mirror below a plate whose opening is a convex polygon, its width a share of a lattice cell, tilted; with the
/// opening's border. The plate's shadow covers the mirror whole.
fn plate_with_an_opening(random: &mut impl FnMut() -> f64) -> (Scene, Vec<DVec3>) {
    let width_m = OPENING_M * 0.005 * 300.0_f64.powf(random());
    let length_m = width_m
        * if random() < 0.5 {
            1.0
        } else {
            1.0 + 30.0 * random()
        };
    let sides = 3 + (random() * 10.0) as usize;
    let centre = dvec3(0.05 * random() - 0.02, 1.0, 0.05 * random() - 0.02);
    let (sine, cosine) = (TAU * random()).sin_cos();
    let tilt = random() * 0.7;
    let across = dvec3(cosine, 0.0, sine);
    let along = dvec3(-sine * tilt.cos(), tilt.sin(), cosine * tilt.cos());
    let corner = |side: usize| {
        let (s, c) = (TAU * (side as f64 / sides as f64)).sin_cos();
        centre + across * (0.5 * width_m * c) + along * (0.5 * length_m * s)
    };
    let border: Vec<DVec3> = (0..sides).map(corner).collect();
    let middle = border.iter().sum::<DVec3>() / sides as f64;
    let reach = border.iter().map(|corner| corner.distance(middle));
    let scale = 0.6 / reach.fold(f64::INFINITY, f64::min);
    let plate = shapes::sheet(sides as u32, 1, |u, v| {
        let corner = border[(u * sides as f64).round() as usize % sides];
        (middle + (corner - middle) * (1.0 + (scale - 1.0) * v), DVec3::Y)
    });
    let mirror = shapes::rectangle(DVec3::Y * 0.7, DVec3::Z * 0.15, dvec3(0.15, 0.02, 0.0));
    let black = parts::matte("plate", LinearSrgb::BLACK);
    (floor(0.5).mirror(mirror).with("plate", plate, black), border)
}
