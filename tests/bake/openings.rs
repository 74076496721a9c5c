//! Slits and pinholes far narrower than a lattice cell: the light that goes through them is all there is.

use glam::DVec3;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Mesh, Scene};
use nephroid::units::{Flux, Irradiance};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::tools::{at, bake, energy_fault};

const DENSITY_PER_SR: f64 = 25_000.0;

/// From the lamp to the plate with the opening [m].
const AWAY_M: f64 = 1.0;

/// A plate with an opening whose border is a convex polygon.
struct Plate {
    /// Corners of the opening [m].
    border: Vec<DVec3>,
}

impl Plate {
    /// Around a point, tilted; the opening as wide as a share of a lattice cell, and so many times longer.
    fn random(random: &mut impl FnMut() -> f64) -> Self {
        let cell_m = AWAY_M / DENSITY_PER_SR.sqrt();
        let width_m = cell_m * 0.005 * 300.0_f64.powf(random());
        let length_m = width_m
            * if random() < 0.5 {
                1.0
            } else {
                1.0 + 30.0 * random()
            };
        let sides = 3 + (random() * 10.0) as usize;
        let centre = DVec3::new(0.05 * random() - 0.02, 1.0, 0.05 * random() - 0.02);
        let (sine, cosine) = (std::f64::consts::TAU * random()).sin_cos();
        let tilt = random() * 0.7;
        let across = DVec3::new(cosine, 0.0, sine);
        let along = DVec3::new(-sine * tilt.cos(), tilt.sin(), cosine * tilt.cos());
        let corner = |side: usize| {
            let (s, c) = (std::f64::consts::TAU * (side as f64 / sides as f64)).sin_cos();
            centre + across * (0.5 * width_m * c) + along * (0.5 * length_m * s)
        };
        Self {
            border: (0..sides).map(corner).collect(),
        }
    }

    /// From the opening to where nothing passes it any more.
    fn mesh(&self) -> Mesh {
        let count = self.border.len();
        let centre = self.border.iter().sum::<DVec3>() / count as f64;
        let reach = self.border.iter().map(|corner| corner.distance(centre));
        let scale = 0.6 / reach.fold(f64::INFINITY, f64::min);
        shapes::sheet(count as u32, 1, |u, v| {
            let corner = self.border[(u * count as f64).round() as usize % count];
            let far = 1.0 + (scale - 1.0) * v;
            (centre + (corner - centre) * far, DVec3::Y)
        })
    }

    /// Solid angle of the opening from a point [sr], over triangles by van Oosterom and Strackee 1983.
    fn seen_sr(&self, from: DVec3) -> f64 {
        let of = |[a, b, c]: [DVec3; 3]| {
            let [la, lb, lc] = [a, b, c].map(DVec3::length);
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * a.dot(b.cross(c)).atan2(below).abs()
        };
        self.triangles().map(|t| of(t.map(|p| p - from))).sum()
    }

    /// Area of the opening across a direction [m²].
    fn seen_m2(&self, direction: DVec3) -> f64 {
        let of = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).dot(direction).abs();
        self.triangles().map(of).sum()
    }

    fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let pairs = self.border[1..].windows(2);
        pairs.map(|pair| [self.border[0], pair[0], pair[1]])
    }

    /// A mirror behind it, that its shadow covers whole.
    fn scene(&self) -> Scene {
        let mut scene = parts::reference_scene(0.5);
        let mirror = shapes::rectangle(
            DVec3::new(0.0, 0.7, 0.0),
            DVec3::Z * 0.15,
            DVec3::new(0.15, 0.02, 0.0),
        );
        parts::add(&mut scene, "mirror", mirror, parts::mirror());
        let black = parts::matte("plate", LinearSrgb::BLACK);
        parts::add(&mut scene, "plate", self.mesh(), black);
        scene
    }
}

#[test]
fn what_goes_through_a_narrow_opening_is_all_found() {
    let mut generator = Pcg64Mcg::seed_from_u64(5);
    let mut random = move || (generator.next_u64() >> 11) as f64 * (-53_f64).exp2();
    let mut faults = Vec::new();
    for index in 0..40 {
        let plate = Plate::random(&mut random);
        let mut scene = plate.scene();
        let expected_w = if index % 2 == 0 {
            let lamp = DVec3::new(0.013, 1.0 + AWAY_M, 0.007);
            let power = Flux(4.0 * std::f64::consts::PI);
            scene.lights.push(parts::point_light("lamp", lamp, power));
            plate.seen_sr(lamp)
        } else {
            let direction = DVec3::new(0.01, -1.0, 0.03).normalize();
            scene.lights.push(parts::sun("sun", direction, Irradiance(1.0)));
            plate.seen_m2(direction)
        };
        let result = bake(scene, &at(DENSITY_PER_SR, 32));
        assert_eq!(energy_fault(&result), None);
        let ratio = result.ledgers[0].energy_w.emitted / expected_w;
        if (ratio - 1.0).abs() > 0.02 {
            faults.push((index, plate.border.len(), expected_w, ratio));
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}
