//! One picture: the device against the CPU, both against a closed form, and the perceptual difference of pictures.

use glam::DAffine3;
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::scene::{Environment, Glow, Object, TextureRef};

use crate::gpu::rig::{AS_CPU, Rig, or_skip, unlike};
use crate::prelude::*;
use support::flip::mean_flip;
use support::floors::{diffuse, floor_map, floor_scene, four_colours, lambert, texture_reference};
use support::scenes::{seen, under_sky, view};

/// A textured floor with a lit corner of known radiance, which glows elsewhere by an image of other coordinates, a
/// glowing wall with colours at its corners, a mirror ball and a glass ball under a sky;
/// whatever has a colour has three distinct channels.
fn exhibit() -> (Scene, Vec<IlluminationMap>) {
    let mut pattern = four_colours();
    (pattern.wrap, pattern.is_nearest) = ([Wrap::MirroredRepeat, Wrap::Repeat], true);
    pattern.rgba.reverse();
    let glow = TextureRef {
        texture: 1,
        uv_set: 1,
        uv_transform: DMat3::from_scale_angle_translation(dvec2(1.5, 1.5), 0.0, dvec2(0.0, -0.6)),
    };
    let mut scene = floor_scene(Material {
        base_colour_texture: Some(texture_reference()),
        emitted_radiance: rgb(0.0, 0.4, 0.2),
        emission_texture: Some(glow.clone()),
        ..diffuse(rgb(0.8, 0.6, 0.3))
    });
    let mesh = scene.objects[0].mesh_in_scene_mut();
    let swapped = |uv: &DVec2| dvec2(uv.y, uv.x);
    mesh.uv1 = mesh.uv0.as_ref().map(|uvs| uvs.iter().map(swapped).collect());
    let of_floor = Glow::new((&*mesh).into(), &glow, &pattern).expect("it glows");
    scene.glows.insert(0, of_floor.into());
    scene.textures.extend([four_colours(), pattern].map(Arc::new));
    let mirror = with(parts::mirror(), |it| it.base_colour = rgb(0.9, 0.7, 0.5));
    let mut glass = parts::dielectric("glass", 1.5);
    glass.base_colour = rgb(1.0, 0.8, 0.6);
    let glowing = Material {
        emitted_radiance: rgb(0.3, 0.9, 0.6),
        ..diffuse(LinearSrgb::WHITE)
    };
    let ball = |x: f64| shapes::sphere(dvec3(x, 0.2, 0.35), 0.18, 4);
    let mut wall = shapes::rectangle(dvec3(0.5, 0.3, -0.1), DVec3::X * 0.4, DVec3::Y * 0.2);
    wall.colours = Some(vec![[1.0, 0.0, 0.3], [0.2, 1.0, 0.1], [0.0, 0.4, 1.0], [0.6; 3]]);
    parts::add(&mut scene, "mirror", ball(0.25), mirror);
    parts::add(&mut scene, "glass", ball(0.75), glass);
    parts::add(&mut scene, "wall", wall, glowing);
    let sky = vec![[0.1, 0.2, 0.4], [0.4, 0.2, 0.1], [0.3, 0.1, 0.2], [0.1, 0.3, 0.2]];
    let scene = under_sky(scene, Environment::new(2, 2, sky), 1.5);
    let texel = |index: usize| {
        let at = index as f32 / 64.0;
        [3.0 - at, 1.0 + at, 0.5 + 0.5 * at]
    };
    let mut texels: Vec<[f32; 3]> = (0..64).map(texel).collect();
    for corner in [54, 55, 62, 63] {
        texels[corner] = [3.0, 2.0, 1.0];
    }
    let of_wall = floor_map(3, 1, 1, vec![[2.0, 3.0, 4.0]]);
    (scene, vec![floor_map(0, 8, 8, texels), of_wall])
}

#[test]
fn device_shows_what_the_cpu_shows() {
    let (scene, maps) = exhibit();
    let (eye, target) = (dvec3(0.6, 0.8, 1.9), dvec3(0.5, 0.15, 0.45));
    let view = view(eye, target, 0.75, [96, 64]);
    let tracer = Tracer::new(Arc::new(scene.clone()));
    let by_cpu = seen(&tracer, &maps, &view, &Default::default()).0;
    // The lower right corner of the floor: white texel, evenly lit.
    let camera = &view.camera;
    let off = dvec3(0.9, 0.0, 0.9) - camera.position;
    let half = (0.5 * camera.vertical_fov_rad).tan() * off.dot(camera.forward);
    let column = 48.0 + 32.0 * off.dot(camera.right()) / half;
    let row = 32.0 - 32.0 * off.dot(camera.up) / half;
    let corner = row as usize * 96 + column as usize;
    let expected = [lambert(0.8, 3.0), lambert(0.6, 2.0), lambert(0.3, 1.0)];
    let assert_known = |picture: &Picture, tolerance: f64| {
        for (found, expected) in picture.radiance[corner].into_iter().zip(expected) {
            near(f64::from(found) / expected, 1.0, tolerance, "corner");
        }
    };
    assert_known(&by_cpu, 1e-6);
    let mut rig = or_skip!(Rig::at(AS_CPU, &scene, &maps));
    let by_gpu = rig.picture(&view);
    assert_known(&by_gpu, 2e-3);
    // Chains that end at a ball's outline may differ.
    assert!(unlike(&by_cpu, &by_gpu) < 0.01, "{}", unlike(&by_cpu, &by_gpu));
    let swapped = |[a, b, c]: [usize; 3]| {
        let mut picture = by_gpu.clone();
        for pixel in &mut picture.radiance {
            *pixel = [pixel[a], pixel[b], pixel[c]];
        }
        unlike(&by_cpu, &picture)
    };
    for order in [[1, 0, 2], [2, 1, 0], [0, 2, 1]] {
        assert!(swapped(order) > 0.1, "{order:?}");
    }

    // As a window shows it: bytes in the order of the format, rounded at another place.
    let bytes = display_rgba8(&by_gpu, 0.0, view.tone_map);
    let apart = |pair: (&u8, &u8)| pair.0.abs_diff(*pair.1);
    let most = rig.drawn(&view).iter().zip(&bytes).map(apart).max();
    assert!(most <= Some(1), "{most:?}");
}

/// Two balls of one mesh, one of them mirrored, look as copies do, wherever they are moved. Only that is sent then.
#[test]
fn what_shares_a_mesh_is_drawn_where_it_is_moved() {
    let (mut scene, maps) = exhibit();
    let mesh = Arc::new(shapes::sphere(DVec3::ZERO, 0.18, 4));
    for (index, x, sign) in [(1, 0.25, 1.0), (2, 0.75, -1.0)] {
        let before = &scene.objects[index];
        let mut ball = Object::new(&before.name, (before.node, 0), before.material, Arc::clone(&mesh));
        let (scale, turn) = (dvec3(sign, 0.9, 1.1), DQuat::from_rotation_y(0.3));
        let place = DAffine3::from_scale_rotation_translation(scale, turn, dvec3(x, 0.2, 0.35));
        ball.place(place);
        scene.objects[index] = ball;
    }
    let view = view(dvec3(0.6, 0.8, 1.9), dvec3(0.5, 0.15, 0.45), 0.75, [96, 64]);
    let mut rig = or_skip!(Rig::at(AS_CPU, &scene, &maps));
    let moves = [
        (2, 0.5, dvec3(-0.1, 0.1, 0.0)),
        (1, 0.0, dvec3(0.1, 0.0, 0.2)),
        (2, 0.1, dvec3(0.1, 0.0, 0.1)),
    ];
    for (index, yaw_rad, way) in moves {
        rig.picture(&view);
        let edit = Edit::Place(index, Motion::turned(yaw_rad, way));
        scene = edit.apply(&scene).expect("it can be moved");
        let bytes = rig.set_scene(&scene).other_bytes;
        assert!((1..=160 * scene.objects.len() as u64).contains(&bytes), "{bytes}");
        let moved = rig.picture(&view);
        let afresh = or_skip!(Rig::at(AS_CPU, &scene, &maps)).picture(&view);
        assert!(moved.radiance == afresh.radiance);
        let mut copies = scene.clone();
        for copy in &mut copies.objects {
            copy.mesh_in_scene_mut();
        }
        let copied = or_skip!(Rig::at(AS_CPU, &copies, &maps)).picture(&view);
        assert!(unlike(&moved, &copied) < 2e-3, "{}", unlike(&moved, &copied));
    }

    // Of what waves lift, the corners are sent again.
    let mirror = scene.objects[1].material;
    scene.materials[mirror].waves = Some(ripples());
    scene.swells.insert(1, Arc::clone(&mesh));
    rig.set_scene(&scene);
    for time_s in [0.3, 0.5] {
        let lifted = scene.at(time_s);
        let bytes = rig.set_scene(&lifted).other_bytes as usize;
        let corners = 48 * mesh.positions.len();
        assert!((corners..2 * corners).contains(&bytes), "{bytes}");
        let afresh = or_skip!(Rig::at(AS_CPU, &lifted, &maps)).picture(&view);
        assert!(rig.picture(&view).radiance == afresh.radiance);
    }
}

fn ripples() -> Waves {
    let wave = Wave {
        amplitude_m: 0.01,
        wavelength_m: 0.2,
        direction: DVec3::X,
        phase_rad: 0.4,
        period_s: 1.0,
    };
    Waves::new(vec![wave]).expect("a gentle wave")
}

/// Stripes, a disc and a gradient, changed by `change`.
fn sample(change: impl Fn(usize, usize, [f64; 3]) -> [f64; 3]) -> Vec<u8> {
    let pixel = |pixel: usize| {
        let (x, y) = (pixel % 48, pixel / 48);
        let stripe = if x / 6 % 2 == 0 { 200.0 } else { 60.0 };
        let is_disc = x.abs_diff(30).pow(2) + y.abs_diff(20).pow(2) < 64;
        let red = if is_disc { 250.0 } else { stripe };
        let [r, g, b] = change(x, y, [red, stripe, 5.0 * y as f64]).map(|channel| channel as u8);
        [r, g, b, u8::MAX]
    };
    (0..48 * 48).flat_map(pixel).collect()
}

/// The figures are what the authors' own code gives, in single precision.
#[test]
fn flip_figures_of_its_authors() {
    let same = sample(|_, _, colour| colour);
    assert_eq!(mean_flip(&same, &same, 48), 0.0);
    let tinted = sample(|_, _, [r, g, b]| [r, g * 0.9, b]);
    let brightened = sample(|x, y, colour| if [x, y] == [11, 31] { [255.0; 3] } else { colour });
    let inverted = sample(|_, _, colour| colour.map(|channel| 255.0 - channel));
    for (test, expected) in [
        (tinted, 0.348_323_2),
        (brightened, 0.003_162_9),
        (inverted, 0.939_610_7),
    ] {
        assert_close(mean_flip(&same, &test, 48), expected, 2e-4, "mean FLIP");
    }
}
