//! Bodies within bodies: water that overlaps its glass, with a ball in it.

use std::f64::consts::TAU;

use glam::DVec3;
use nephroid::illumination::compare::relative_rmse;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Mesh, Scene};
use nephroid::settings::BakeSettings;
use nephroid::study::agreement::caustic_luminance;
use nephroid::units::Flux;

use crate::brute_force::brute;
use crate::tools::{at, bake, energy_fault, map_of, settings};

/// A closed body of revolution around the y axis: each straight piece of its profile (radius, height) [m] has normals of
/// its own, to the right of the way along it.
fn lathe(profile: &[(f64, f64)], segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for pair in profile.windows(2) {
        let [(r0, y0), (r1, y1)] = [pair[0], pair[1]];
        let first = mesh.positions.len() as u32;
        for segment in 0..=segments {
            let (sine, cosine) = (TAU * f64::from(segment % segments) / f64::from(segments)).sin_cos();
            let outwards = DVec3::new(cosine, 0.0, sine);
            let normal = (outwards * (y1 - y0) - DVec3::Y * (r1 - r0)).normalize();
            for (r, y) in [(r0, y0), (r1, y1)] {
                mesh.positions.push(outwards * r + DVec3::Y * y);
                mesh.normals.push(normal);
            }
        }
        for segment in 0..segments {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| first + 2 * segment + corner);
            for triangle in [[a, b, c], [c, b, d]] {
                let [p, q, r] = triangle.map(|vertex| mesh.positions[vertex as usize]);
                let face = (q - p).cross(r - p);
                if face.length() > 1e-12 {
                    let is_turned = face.dot(mesh.normals[triangle[0] as usize]) < 0.0;
                    let [p, q, r] = triangle;
                    mesh.triangles.push(if is_turned { [p, r, q] } else { triangle });
                }
            }
        }
    }
    mesh
}

/// A glass of water with a ball in it; the water reaches so far into the glass [m].
fn glass_of_water(overlap_m: f64) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    let cup = [
        (0.0, 0.20),
        (0.30, 0.20),
        (0.30, 0.80),
        (0.26, 0.80),
        (0.26, 0.24),
        (0.0, 0.24),
    ];
    let side = 0.26 + overlap_m;
    let water = [
        (0.0, 0.24 - overlap_m),
        (side, 0.24 - overlap_m),
        (side, 0.65),
        (0.0, 0.65),
    ];
    parts::add(
        &mut scene,
        "glass",
        lathe(&cup, 256),
        parts::dielectric("glass", 1.5),
    );
    parts::add(
        &mut scene,
        "water",
        lathe(&water, 256),
        parts::dielectric("water", 1.333),
    );
    let ball = shapes::sphere(DVec3::new(0.05, 0.42, -0.02), 0.1, 5);
    parts::add(&mut scene, "ball", ball, parts::dielectric("ball", 1.6));
    let lamp = DVec3::new(0.25, 2.2, 0.15);
    scene.lights.push(parts::point_light("lamp", lamp, Flux(100.0)));
    scene
}

#[test]
fn water_in_a_glass_is_as_brute_force_has_it() {
    let scene = glass_of_water(0.002);
    let target = 0.03;
    let settings_here = BakeSettings {
        max_error: Some(target),
        density_per_sr: BakeSettings::starting_density_per_sr(target),
        ..at(1.0, 48)
    };
    let result = bake(scene.clone(), &settings_here);
    assert_eq!(energy_fault(&result), None);
    let reference = brute(&scene, &settings(1.0, 48), 230_000);
    let map = map_of(&reference, &scene, "floor");
    let noise = map.estimated_relative_rmse.expect("a noise");
    let ours = caustic_luminance(map_of(&result, &scene, "floor"));
    let rmse = relative_rmse(&ours, &caustic_luminance(map)).expect("light");
    let off = (rmse * rmse - noise * noise).max(0.0).sqrt();
    println!(
        "water in a glass: off by {off:.4} (noise {noise:.4}), estimated {:?}, {} rays",
        result.estimated_relative_rmse, result.counts.rays
    );
    let deposited = [&result, &reference].map(|result| result.ledgers[0].energy_w.deposited);
    assert!((deposited[0] / deposited[1] - 1.0).abs() < 0.01, "{deposited:?}");
    assert!(off < 0.04, "off by {off}");
}
