//! Soft caustics, and bodies within bodies: against brute force, against their limits, and against the law of energy.

use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};

use crate::bake::common::{off_brute_force, session};
use support::hard_scenes::{roughened, under_square_lamp};
use support::prelude::*;
use support::tools::{bake, energy_fault, photons, set, settings, to};

/// All that leaves it arrives somewhere: a closed white room.
#[test]
fn a_rough_white_mirror_loses_nothing() {
    let mut scene = roughened("mirror", 0.6);
    let walls = shapes::cuboid(dvec3(-1.0, -0.001, -1.0), dvec3(1.0, 2.0, 1.0));
    let white = parts::matte("walls", LinearSrgb::WHITE);
    parts::add(&mut scene, "walls", walls, white);
    let result = bake(scene, &photons(1e6, 16));
    let energy = result.ledgers[0].energy_w;
    assert_eq!(energy_fault(&result), None);
    let truncated = energy.truncated.total();
    let lost = energy.emitted - energy.deposited - truncated - energy.sampling;
    assert!(lost.abs() < 1e-9 * energy.emitted, "{energy:?}");
    assert!(truncated.abs() < 1e-3 * energy.emitted, "{energy:?}");
    assert_eq!(energy.absorbed, 0.0);
}

#[test]
fn soft_light_is_refused_by_splats() {
    for (scene, cause) in [
        (roughened("mirror", 0.2), "is rough"),
        (under_square_lamp("ring", 0.2), "has a size"),
    ] {
        let refused = session(&scene).bake(&settings(2_000.0, 16), &(), &Control::default());
        let error = refused.expect_err(cause).to_string();
        let has = |part: &str| error.contains(part);
        assert!(has(cause) && has("--estimator auto or photon"), "{error}");
        let named = if cause == "is rough" {
            Effect::Roughness
        } else {
            Effect::AreaLights
        };
        let off = set(to(0.03, 16), |s| {
            s.effects = EffectSwitches::default().with(named, EffectSwitch::Off);
        });
        assert_eq!(energy_fault(&bake(scene, &off)), None, "{cause}");
    }
}

/// A closed body of revolution around the y axis: each straight piece of its profile (radius, height) [m] has normals of
/// its own, to the right of the way along it.
fn lathe(profile: &[(f64, f64)], segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for pair in profile.windows(2) {
        let [(r0, y0), (r1, y1)] = [pair[0], pair[1]];
        let first = mesh.positions.len() as u32;
        for segment in 0..=segments {
            let (sine, cosine) = (TAU * f64::from(segment % segments) / f64::from(segments)).sin_cos();
            let outwards = dvec3(cosine, 0.0, sine);
            let normal = (outwards * (y1 - y0) - DVec3::Y * (r1 - r0)).normalize();
            for (r, y) in [(r0, y0), (r1, y1)] {
                mesh.positions.push(outwards * r + DVec3::Y * y);
                mesh.normals.push(normal);
            }
        }
        for segment in 0..segments {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| first + 2 * segment + corner);
            // None of the triangles that an end on the axis leaves without area.
            if r0 > 0.0 {
                mesh.triangles.push([a, b, c]);
            }
            if r1 > 0.0 {
                mesh.triangles.push([c, b, d]);
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
    let ball = shapes::sphere(dvec3(0.05, 0.42, -0.02), 0.1, 5);
    for (name, mesh, ior) in [
        ("glass", lathe(&cup, 256), 1.5),
        ("water", lathe(&water, 256), 1.333),
        ("ball", ball, 1.6),
    ] {
        parts::add(&mut scene, name, mesh, parts::dielectric(name, ior));
    }
    let lamp = dvec3(0.25, 2.2, 0.15);
    scene.lights.push(parts::point_light("lamp", lamp, Flux(100.0)));
    scene
}

#[test]
fn water_in_a_glass_as_by_brute_force() {
    let scene = glass_of_water(0.002);
    let result = bake(scene.clone(), &to(0.03, 48));
    assert_eq!(energy_fault(&result), None);
    let (off, deposited_w) = off_brute_force(&result, &scene, 230_000, 0.2);
    assert!(
        (deposited_w[0] / deposited_w[1] - 1.0).abs() < 0.01,
        "{deposited_w:?}"
    );
    assert!(off < 0.04, "off by {off}");
}
