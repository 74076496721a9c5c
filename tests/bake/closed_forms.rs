//! What falls on a mirror, what is given up and what comes to a floor under water, where a closed form says it.

use glam::{DVec2, DVec3};
use nephroid::optics::LinearSrgb;
use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, LightKind, LightSize, Mesh, Scene, Volume};
use nephroid::session::BakeResult;
use nephroid::settings::{BakeSettings, ItemBufferKind, LayerKind};
use nephroid::units::{Flux, Irradiance, RadiantIntensity};

use crate::tools::{at, bake, energy_fault, map_of, settings};

/// Half sides of the mirrors [m].
const HALF_X: f64 = 0.6;
const HALF_Z: f64 = 0.5;

/// Settings of both estimators, whose maps nobody looks at.
fn both(wavefront_per_sr: f64, splat_per_sr: f64) -> [BakeSettings; 2] {
    [at(wavefront_per_sr, 16), settings(splat_per_sr, 16)]
}

fn sound(scene: &Scene, settings: &BakeSettings) -> BakeResult {
    let result = bake(scene.clone(), settings);
    assert_eq!(energy_fault(&result), None);
    result
}

/// A mirror at the origin that faces up, with a wall to take what it sends on.
fn over_a_mirror(light: Light) -> Scene {
    let mut scene = Scene::default();
    let mirror = shapes::floor([-HALF_X, HALF_X], [-HALF_Z, HALF_Z], 0.0);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    let wall = shapes::rectangle(DVec3::new(3.0, 2.0, 0.0), DVec3::Z * 2.0, DVec3::Y * 2.0);
    parts::add(
        &mut scene,
        "wall",
        wall,
        parts::matte("wall", LinearSrgb::grey(0.5)),
    );
    scene.lights.push(light);
    scene
}

fn lamp(kind: LightKind) -> Light {
    Light {
        name: "lamp".into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind,
        size: LightSize::None,
    }
}

/// Solid angle [sr] of the mirror as seen from a place above it.
fn mirror_solid_angle_sr(place: DVec3) -> f64 {
    let corner = |x: f64, z: f64| {
        let (x, z) = (x - place.x, z - place.z);
        (x * z).atan2(place.y * (place.y * place.y + x * x + z * z).sqrt())
    };
    corner(HALF_X, HALF_Z) - corner(-HALF_X, HALF_Z) - corner(HALF_X, -HALF_Z) + corner(-HALF_X, -HALF_Z)
}

#[test]
fn a_mirror_gets_what_lamps_send_into_its_solid_angle() {
    let place = DVec3::new(0.1, 0.8, -0.2);
    let (inner, outer) = (0.12_f64, 0.3_f64);
    let cone_sr = std::f64::consts::TAU * (1.0 - inner.cos() + (inner.cos() - outer.cos()) / 3.0);
    let sun = DVec3::new(1.0, -1.0, 0.2).normalize();
    let lamps = [
        (
            LightKind::Point {
                position: place,
                intensity: RadiantIntensity(3.0),
            },
            3.0 * mirror_solid_angle_sr(place),
        ),
        // The whole of its cone, whose edge falls off as the square of a ramp in the cosine.
        (
            LightKind::Spot {
                position: place,
                direction: DVec3::new(0.1, -1.0, 0.1).normalize(),
                intensity: RadiantIntensity(3.0),
                inner_cone_rad: inner,
                outer_cone_rad: outer,
            },
            3.0 * cone_sr,
        ),
        (
            LightKind::Sun {
                direction: sun,
                normal_irradiance: Irradiance(3.0),
            },
            3.0 * 4.0 * HALF_X * HALF_Z * -sun.y,
        ),
    ];
    for (kind, expected_w) in lamps {
        let scene = over_a_mirror(lamp(kind));
        for item_buffer in [ItemBufferKind::Equal, ItemBufferKind::Cube] {
            for settings in both(4_000.0, 640_000.0) {
                let settings = BakeSettings {
                    item_buffer,
                    ..settings
                };
                let emitted_w = sound(&scene, &settings).ledgers[0].energy_w.emitted;
                let off = emitted_w / expected_w - 1.0;
                println!("{kind:?}, {:?}: {:.4} % off", settings.estimator, 100.0 * off);
                assert!(
                    off.abs() < 0.003,
                    "{kind:?}: {emitted_w} W for {expected_w} W, {settings:?}"
                );
            }
        }
    }
}

/// The sun's rays start before everything that may stop them.
#[test]
fn a_plate_before_a_mirror_takes_its_share_of_the_sun() {
    let sun = LightKind::Sun {
        direction: DVec3::new(1.0, -1.0, 0.0).normalize(),
        normal_irradiance: Irradiance(1.0),
    };
    let mut scene = over_a_mirror(lamp(sun));
    // Half a metre up its shadow lies half a metre farther: on the mirror's half of x < 0.
    let plate = shapes::floor([-2.0, -0.5], [-1.0, 1.0], 0.5);
    parts::add(
        &mut scene,
        "plate",
        plate,
        parts::matte("plate", LinearSrgb::grey(0.5)),
    );
    for settings in both(4_000.0, 2_560_000.0) {
        let emitted_w = sound(&scene, &settings).ledgers[0].energy_w.emitted;
        let expected_w = 2.0 * HALF_X * HALF_Z * 0.5_f64.sqrt();
        assert!(
            (emitted_w / expected_w - 1.0).abs() < 0.005,
            "{emitted_w} W for {expected_w} W, {settings:?}"
        );
    }
}

/// A floor of 1 × 1 m below a slab of glass, both under an upright sun.
fn under_a_slab() -> Scene {
    let mut scene = parts::reference_scene(0.5);
    let slab = shapes::cuboid(DVec3::new(-1.0, 0.5, -1.0), DVec3::new(1.0, 0.7, 1.0));
    parts::add(&mut scene, "slab", slab, parts::dielectric("glass", 1.5));
    scene
        .lights
        .push(parts::sun("sun", DVec3::NEG_Y, Irradiance(1.0)));
    scene
}

#[test]
fn what_is_given_up_is_booked_by_its_cause() {
    let scene = under_a_slab();
    let r = dielectric_reflectance(1.0, 1.5);
    // At most two surfaces: what the lower one sends back up ends. Or branches below a twentieth do, at either surface.
    let (by_depth, by_threshold) = ((2, None), (16, Some(0.05)));
    for ((max_depth, branch_threshold), depth, threshold) in [
        (by_depth, (1.0 - r) * r, 0.0),
        (by_threshold, 0.0, r + (1.0 - r) * r),
    ] {
        for settings in both(1_000.0, 10_000.0) {
            let settings = BakeSettings {
                max_depth,
                branch_threshold,
                ..settings
            };
            let energy_w = sound(&scene, &settings).ledgers[0].energy_w;
            let shares =
                [energy_w.truncated.depth, energy_w.truncated.threshold].map(|w| w / energy_w.emitted);
            for (share, expected) in shares.into_iter().zip([depth, threshold]) {
                assert!(
                    (share - expected).abs() <= 1e-3 * expected,
                    "{shares:?}, {energy_w:?}, {settings:?}"
                );
            }
        }
    }
}

/// Light that is given up is missing from the maps, and they know it.
#[test]
fn what_is_given_up_is_part_of_the_estimated_error() {
    let scene = under_a_slab();
    for settings in both(4_000.0, 40_000.0) {
        let all_w = sound(&scene, &settings).ledgers[0].energy_w.deposited;
        let settings = BakeSettings {
            branch_threshold: Some(0.05),
            ..settings
        };
        let result = sound(&scene, &settings);
        let energy_w = &result.ledgers[0].energy_w;
        let missing = 1.0 - energy_w.deposited / all_w;
        let share = energy_w.truncated.total() / energy_w.emitted;
        assert!(missing > 1e-3 && share > 0.07, "{missing}, {share}");
        let estimated = result.estimated_relative_rmse.expect("an estimate");
        assert!(
            estimated >= missing && estimated >= share,
            "an error of {estimated} though {missing} of the light is missing and {share} is given up, {settings:?}"
        );
    }
}

/// Share of red, green and blue light that 0.7 m of this water leave.
const WATER_COLOUR: LinearSrgb = LinearSrgb::new(0.3, 0.5, 0.8);
const WATER: f64 = 1.333;

/// A floor within coloured water that reaches up to y = 1 m, under an upright sun.
fn in_coloured_water(floor: Mesh) -> Scene {
    let mut scene = Scene::default();
    parts::add(
        &mut scene,
        "floor",
        floor,
        parts::matte("floor", LinearSrgb::grey(0.5)),
    );
    let mut water = parts::dielectric("water", WATER);
    water.volume = Some(Volume {
        attenuation_distance_m: 0.7,
        attenuation_colour: WATER_COLOUR,
    });
    let body = shapes::cuboid(DVec3::new(-1.0, -0.4, -1.0), DVec3::new(1.0, 1.0, 1.0));
    parts::add(&mut scene, "water", body, water);
    scene
        .lights
        .push(parts::sun("sun", DVec3::NEG_Y, Irradiance(1.0)));
    scene
}

/// E in the middle of the floor's first and last triangle.
fn ends(scene: &Scene, settings: &BakeSettings) -> [[f32; 3]; 2] {
    let result = sound(scene, settings);
    let map = map_of(&result, scene, "floor");
    let layer = map.layer(LayerKind::Caustic).expect("a layer");
    [0, map.chart.corner_uvs.len() - 1].map(|triangle| {
        let size = DVec2::new(map.width() as f64, map.height() as f64);
        let place = map.chart.uv(triangle, [1.0 / 3.0; 3]) * size;
        layer.irradiance[map.chart.texel_at(place.x as usize, place.y as usize)]
    })
}

#[test]
fn water_takes_its_share_by_depth() {
    let flat = shapes::floor([-0.5, 0.5], [-0.5, 0.5], 0.0);
    // Its second half is a step 0.3 m high: no plane.
    let mut stepped = shapes::floor([-0.5, 0.0], [-0.5, 0.5], 0.0);
    shapes::append(&mut stepped, &shapes::floor([0.0, 0.5], [-0.5, 0.5], 0.3));
    let through = 1.0 - dielectric_reflectance(1.0, WATER);
    for (mesh, depths_m) in [(flat, [1.0, 1.0]), (stepped, [1.0, 0.7])] {
        let scene = in_coloured_water(mesh);
        for settings in [at(1_000.0, 16), settings(40_000.0, 16)] {
            for (e, depth_m) in ends(&scene, &settings).into_iter().zip(depths_m) {
                for (e, colour) in e.into_iter().zip(WATER_COLOUR.to_array()) {
                    let expected = through * colour.powf(depth_m / 0.7);
                    assert!(
                        (f64::from(e) / expected - 1.0).abs() < 0.003,
                        "{e} for {expected} at {depth_m} m, {settings:?}"
                    );
                }
            }
        }
    }
}

/// All that a lamp sends within glass meets a specular surface first; what the glass takes before that is absorbed.
#[test]
fn coloured_glass_around_a_lamp_takes_its_share_before_the_first_surface() {
    let mut scene = parts::reference_scene(2.0);
    let (radius_m, colour) = (0.5, WATER_COLOUR);
    let mut glass = parts::dielectric("glass", 1.5);
    glass.volume = Some(Volume {
        attenuation_distance_m: radius_m,
        attenuation_colour: colour,
    });
    let ball = shapes::sphere(DVec3::Y, radius_m, 4);
    parts::add(&mut scene, "ball", ball, glass);
    scene.lights.push(parts::point_light("lamp", DVec3::Y, Flux(1.0)));
    // From the middle every ray meets the glass head on, and what is sent back crosses all of it.
    let r = dielectric_reflectance(1.0, 1.5);
    let out = colour.map(|c| (1.0 - r) * c / (1.0 - r * c * c));
    for settings in both(1_000.0, 4_000.0) {
        let energy_w = sound(&scene, &settings).ledgers[0].energy_w;
        assert!((energy_w.emitted - 1.0).abs() < 1e-6, "{energy_w:?}");
        let absorbed_w = 1.0 - out.luminance();
        assert!(
            (energy_w.absorbed / absorbed_w - 1.0).abs() < 0.005,
            "{absorbed_w} W of {energy_w:?}, {settings:?}"
        );
    }
}
