//! What is uploaded when maps or the scene change, and that the picture is that of a fresh upload.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use nephroid::eye_pass::renderer::{MapStyle, Uploaded};
use nephroid::eye_pass::{Picture, View};
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Edit, EditState, Environment, LightKind, MaterialEdit, Motion, Scene};

use crate::gpu::rig::{Rig, or_skip};
use support::floors::{diffuse, floor_map, floor_scene, from_above, lambert};
use support::scenes::{bits, light};

/// 150 × 100 texels: tiles of 64, the last ones smaller.
const SIZE: [usize; 2] = [150, 100];

fn ramp() -> Vec<[f32; 3]> {
    let texel = |index: usize| [1.0 + index as f32, 0.5 * index as f32, 3.0];
    (0..SIZE[0] * SIZE[1]).map(texel).collect()
}

fn map(irradiance: Vec<[f32; 3]>) -> IlluminationMap {
    floor_map(0, SIZE[0], SIZE[1], irradiance)
}

fn white_floor() -> Scene {
    floor_scene(diffuse(LinearSrgb::WHITE))
}

/// Tiles on all levels of a map, of those that are asked for by their level and the texels that they store, and their
/// bytes: 64 texels each way and one more, which may be a repeated one; levels are halved down to 16 texels.
fn tiles(mut size: [usize; 2], counts: impl Fn(usize, [&Range<usize>; 2]) -> bool) -> Uploaded {
    let mut sum = Uploaded::default();
    for level in 0.. {
        let starts = |side: usize| {
            let starts = (0..side).step_by(64);
            starts.map(move |start| start..side.min(start + 64) + 1)
        };
        for rows in starts(size[1]) {
            for columns in starts(size[0]) {
                if counts(level, [&columns, &rows]) {
                    sum.tiles += 1;
                    sum.tile_bytes += 8 * (columns.len() * rows.len()) as u64;
                }
            }
        }
        if size.iter().all(|side| *side <= 16) {
            break;
        }
        size = size.map(|side| side.div_ceil(2));
    }
    sum
}

/// Fails unless these tiles were uploaded.
#[track_caller]
fn assert_tiles(uploaded: Uploaded, expected: Uploaded) {
    let tiles = |of: Uploaded| (of.tiles, of.tile_bytes);
    assert_eq!(tiles(uploaded), tiles(expected));
}

#[track_caller]
fn assert_as_fresh(rig: &mut Rig, view: &View) {
    let (shown, fresh) = (rig.picture(view), rig.fresh(view));
    assert!(bits(&shown) == bits(&fresh));
    assert!(fresh.radiance.iter().any(|rgb| rgb[0] > 0.0));
}

#[test]
fn only_tiles_that_differ_are_uploaded() {
    let scene = floor_scene(diffuse(LinearSrgb::new(0.8, 0.5, 0.2)));
    let mut rig = or_skip!(Rig::new(&scene, &[]));
    let mut irradiance = ramp();
    assert_tiles(rig.set_maps(&[map(irradiance.clone())]), tiles(SIZE, |_, _| true));
    let again = rig.set_maps(&[map(irradiance.clone())]);
    assert_eq!(again, Uploaded::default(), "nothing changed");
    // Each lies in the corner of a tile, next to others.
    for (column, row) in [(64, 63), (63, 64), (149, 99), (64, 64), (70, 70)] {
        // Enough to show on the coarsest level.
        irradiance[row * SIZE[0] + column][1] += 5000.0;
        let expected = tiles(SIZE, |level, [columns, rows]| {
            columns.contains(&(column >> level)) && rows.contains(&(row >> level))
        });
        // A tile, its neighbours and one of each coarser level.
        assert!(expected.tiles <= 8);
        assert_tiles(rig.set_maps(&[map(irradiance.clone())]), expected);
        assert_as_fresh(&mut rig, &from_above(256));
    }
}

#[test]
fn peak_that_outgrows_its_scale_is_uploaded_anew() {
    let mut irradiance = ramp();
    let mut rig = or_skip!(Rig::new(&white_floor(), &[map(irradiance.clone())]));
    irradiance[7] = [1e6; 3];
    let uploaded = rig.set_maps(&[map(irradiance.clone())]);
    assert_eq!(uploaded.tiles, tiles(SIZE, |_, _| true).tiles);
    assert_as_fresh(&mut rig, &from_above(256));
    for factor in [1e-3, 1e-9, 0.0] {
        let dim = irradiance.iter().map(|rgb| rgb.map(|channel| channel * factor));
        rig.set_maps(&[map(dim.collect())]);
        let (shown, fresh) = (rig.picture(&from_above(64)), rig.fresh(&from_above(64)));
        assert_eq!(shown, fresh, "factor {factor}");
    }
}

#[test]
fn another_size_and_no_map_take_new_textures() {
    let mut rig = or_skip!(Rig::new(&white_floor(), &[map(ramp())]));
    let uploaded = rig.set_maps(&[floor_map(0, 64, 65, vec![[2.0; 3]; 64 * 65])]);
    assert_tiles(uploaded, tiles([64, 65], |_, _| true));
    assert_as_fresh(&mut rig, &from_above(32));
    // Larger than any texture of the device: tiles hold it all the same.
    rig.set_maps(&[floor_map(0, 1 << 20, 1, vec![[5.0; 3]; 1 << 20])]);
    let sent = f64::from(rig.picture(&from_above(4)).radiance[5][0]);
    assert!((sent / lambert(1.0, 5.0) - 1.0).abs() < 1e-3, "{sent}");
    // One that does not belong to the scene leaves the old in place.
    let of_another = floor_map(1, 1, 1, vec![[5.0; 3]]);
    assert!(rig.renderer.set_maps(rig.gpu, &rig.scene, &[of_another]).is_err());
    assert_as_fresh(&mut rig, &from_above(4));
    assert_eq!(rig.set_maps(&[]).tiles, 0);
    let dark = rig.picture(&from_above(4));
    assert!(dark.radiance.iter().all(|rgb| *rgb == [0.0; 3]));
}

/// A lit floor under a glass ball and a sky, with a glowing box beside.
fn room() -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.5)));
    let ball = shapes::sphere(DVec3::new(0.4, 0.3, 0.4), 0.2, 3);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let cuboid = shapes::cuboid(DVec3::new(0.7, 0.0, 0.7), DVec3::new(0.9, 0.2, 0.9));
    let grey = parts::matte("box", LinearSrgb::grey(0.5));
    parts::add(&mut scene, "box", cuboid, grey);
    scene.materials[2].emitted_radiance = LinearSrgb::grey(30.0);
    let sky = Environment::new(1, 1, vec![[20.0, 10.0, 5.0]]).expect("sound");
    scene.environment = Some(Arc::new(sky));
    scene.lights = vec![light(LightKind::Environment { scale: 1.0 })];
    (scene, vec![map(ramp())])
}

#[test]
fn edited_scene_shows_as_a_new_one() {
    let (mut scene, maps) = room();
    let mut rig = or_skip!(Rig::new(&scene, &maps));
    let way = DVec3::new(-0.1, 0.05, 0.02);
    let moved = |object, yaw_rad| Edit::Place(object, Motion::turned(yaw_rad, way));
    let ior = Edit::Material(1, MaterialEdit::Ior(1.2));
    let tint = Edit::Material(1, MaterialEdit::BaseColour(LinearSrgb::new(1.0, 0.5, 0.2)));
    // All objects are written at once.
    let uniform = 128 * scene.objects.len() as u64;
    let ball = 32 * scene.objects[1].mesh_in_scene().positions.len() as u64;
    let turned = moved(2, 0.3);
    for (edit, most_bytes) in [
        (ior, uniform),
        (tint, uniform),
        (moved(1, 0.0), ball),
        (turned, 36 * 32),
    ] {
        scene = edit.apply(&scene).expect("it is in range");
        let mut uploaded = rig.set_scene(&scene);
        let bytes = uploaded.other_bytes;
        assert!(bytes > 0 && bytes <= most_bytes, "{edit:?} {bytes} {most_bytes}");
        uploaded += rig.set_maps(&maps);
        assert_eq!(uploaded.tiles, 0, "{edit:?}");
        assert_as_fresh(&mut rig, &from_above(128));
    }
    // The sky as strong as its light says.
    let before = rig.picture(&from_above(64));
    scene.lights[0].kind = LightKind::Environment { scale: 8.0 };
    scene.lights[0].colour = LinearSrgb::new(0.5, 1.0, 1.0);
    rig.set_scene(&scene);
    assert!(bits(&rig.picture(&from_above(64))) != bits(&before));
    assert_as_fresh(&mut rig, &from_above(64));
}

#[test]
fn glass_that_turns_matte_keeps_maps_in_place() {
    let (scene, maps) = room();
    let mut rig = or_skip!(Rig::new(&scene, &maps));
    let rough = Edit::Material(1, MaterialEdit::Roughness(0.9));
    let matte = rough.apply(&scene).expect("it is in range");
    let again = EditState::of(&scene).set(&matte);
    // Scenes of other objects are taken over whole.
    let alone = floor_scene(diffuse(LinearSrgb::new(0.3, 0.6, 0.9)));
    let mut other = alone.clone();
    *other.objects[0].mesh_in_scene_mut() = shapes::floor([0.0, 0.5], [0.0, 1.0], 0.0);
    for edited in [matte, again, alone, other] {
        rig.set_scene(&edited);
        rig.set_maps(&maps);
        assert_as_fresh(&mut rig, &from_above(128));
    }
}

#[test]
fn maps_as_they_are_show_their_values() {
    let (mut scene, _) = room();
    scene.materials[0].base_colour = LinearSrgb::new(0.1, 0.5, 0.9);
    scene.materials[0].emitted_radiance = LinearSrgb::WHITE;
    let value = [0.25, 0.5, 0.75];
    let mut rig = or_skip!(Rig::new(&scene, &[floor_map(0, 2, 2, vec![value; 4])]));
    let at = |picture: &Picture, x: usize, y: usize| picture.radiance[y * 64 + x];
    rig.renderer.set_map_style(MapStyle::AsItIs);
    let shown = rig.picture(&from_above(64));
    // Under the glass ball, which is left out.
    assert_eq!(at(&shown, 26, 26), value);
    assert_eq!(at(&shown, 5, 60), value, "beside everything");
    assert_eq!(at(&shown, 51, 51), [0.0; 3], "a box without a map, that glows");
    rig.renderer.set_map_style(MapStyle::Lit);
    assert_as_fresh(&mut rig, &from_above(64));
    assert_ne!(at(&rig.picture(&from_above(64)), 26, 26), value);
}
