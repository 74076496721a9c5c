//! Mirrors show the plane receivers where they are.

use glam::{DVec2, DVec3};
use nephroid::eye_pass::View;
use nephroid::eye_pass::renderer::render_offscreen;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{Camera, Material, SurfaceKind};

use crate::device::gpu;
use crate::scenes::{diffuse, floor, floor_map, floor_scene, from_above, lambert};

/// From below the mirror upwards: pixel (i, j) sees the floor behind the camera by way of the mirror.
#[test]
fn a_mirror_above_the_floor_shows_the_floors_light_at_the_right_place() {
    let Some(gpu) = gpu() else { return };
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.5)));
    let reflectance = 0.75;
    scene.materials.push(Material {
        surface: SurfaceKind::Mirror,
        base_colour: LinearSrgb::grey(reflectance),
        metallic: 1.0,
        ..Default::default()
    });
    scene.objects.push(floor("mirror", 1, 2.0));
    // A quarter of the floor is bright: x and z beyond 1/2.
    let maps = [floor_map(
        0,
        2,
        2,
        vec![[0.0; 3], [0.0; 3], [0.0; 3], [4.0, 2.0, 1.0]],
    )];
    let camera = Camera {
        position: DVec3::new(0.5, 1.0, 0.5),
        forward: DVec3::Y,
        up: DVec3::Z,
        // The mirror image of the floor, 3 m away and 1 m wide, is the whole picture.
        vertical_fov_rad: 2.0 * (0.5_f64 / 3.0).atan(),
        ..from_above(1).camera
    };
    let view = View {
        camera: camera.clone(),
        background: LinearSrgb::grey(9.0),
        ..from_above(65)
    };
    let picture = render_offscreen(&gpu, &scene, &maps, &view).expect("it renders");
    assert_eq!(gpu.take_error(), None);
    for (index, pixel) in picture.radiance.iter().enumerate() {
        let at = |index: usize| (index as f64 + 0.5) / 65.0 * 2.0 - 1.0;
        let direction = camera.direction(at(index % 65), -at(index / 65), 1.0);
        // Up to the mirror at 2 m and down to the floor: 3 m of height.
        let place = camera.position + direction * (3.0 / direction.y);
        let texel = (DVec2::new(place.x, place.z) * 2.0 - 0.5).clamp(DVec2::ZERO, DVec2::ONE);
        let cosine: f64 = direction.y;
        let metal = reflectance + (1.0 - reflectance) * (1.0 - cosine).powi(5);
        let expected = metal * lambert(0.5, 4.0 * texel.x * texel.y);
        // Samplers weigh in steps of 1/256.
        let tolerance = lambert(0.5, 4.0) / 100.0;
        assert!(
            (f64::from(pixel[0]) - expected).abs() <= tolerance,
            "{place}: {pixel:?} instead of {expected}"
        );
    }
}

#[test]
fn a_mirror_that_sees_no_receiver_shows_the_background() {
    let Some(gpu) = gpu() else { return };
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    scene.materials.push(Material {
        surface: SurfaceKind::Mirror,
        base_colour: LinearSrgb::WHITE,
        metallic: 1.0,
        ..Default::default()
    });
    scene.objects.push(floor("mirror", 1, 0.5));
    let maps = [floor_map(0, 1, 1, vec![[1.0; 3]])];
    let view = View {
        background: LinearSrgb::new(0.5, 0.25, 2.0),
        ..from_above(9)
    };
    let picture = render_offscreen(&gpu, &scene, &maps, &view).expect("it renders");
    for pixel in picture.radiance {
        for (found, expected) in pixel.iter().zip(view.background.to_array()) {
            assert!(
                (f64::from(*found) - expected).abs() <= expected / 1024.0,
                "{pixel:?}"
            );
        }
    }
}

/// What a polished floor reflects of a check is the greyer the rougher it is: by a wider footprint.
#[test]
fn roughness_blurs_what_is_reflected() {
    let Some(gpu) = gpu() else { return };
    let contrast = |roughness: f64| {
        let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
        scene.materials.push(Material {
            surface: SurfaceKind::Mirror,
            base_colour: LinearSrgb::WHITE,
            metallic: 1.0,
            roughness,
            ..Default::default()
        });
        scene.objects.push(floor("mirror", 1, 1.0));
        let check = (0..64 * 64).map(|texel| {
            [if (texel / 64 + texel % 64) % 2 == 0 {
                1.0
            } else {
                0.0
            }; 3]
        });
        let maps = [floor_map(0, 64, 64, check.collect())];
        // From between the two, up to the mirror.
        let view = View {
            camera: Camera {
                position: DVec3::new(0.5, 0.5, 0.5),
                forward: DVec3::Y,
                up: DVec3::Z,
                vertical_fov_rad: 0.1,
                ..from_above(1).camera
            },
            ..from_above(101)
        };
        let picture = render_offscreen(&gpu, &scene, &maps, &view).expect("it renders");
        let values = || picture.radiance.iter().map(|rgb| f64::from(rgb[0]));
        let mean = values().sum::<f64>() / picture.radiance.len() as f64;
        assert!(
            (mean / lambert(1.0, 0.5) - 1.0).abs() < 0.05,
            "{mean}: no light is lost"
        );
        values().map(|value| (value - mean).abs()).sum::<f64>() / picture.radiance.len() as f64 / mean
    };
    let [smooth, polished, rough] = [0.0, 0.07, 0.3].map(contrast);
    assert!(smooth > 0.2 && rough < 0.01 * smooth, "{smooth} {rough}");
    assert!(
        (0.1..0.9).contains(&(polished / smooth)),
        "{polished}, {smooth} where smooth"
    );
}
