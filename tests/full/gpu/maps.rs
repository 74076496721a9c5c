//! Illumination maps on the device: what is seen coarsely, less detail where memory is short, and what is uploaded when maps
//! or the scene change, with the picture that of a fresh upload.

use std::ops::Range;

use nephroid::eye_pass::renderer::{MapStyle, Uploaded};
use nephroid::illumination::Chart;
use nephroid::scene::Environment;

use crate::gpu::rig::{AS_CPU, Rig, or_skip};
use support::floors::{diffuse, floor, floor_map, floor_scene, from_above, lambert};
use support::prelude::*;
use support::scenes::{bits, map_of, under_sky};

/// Bytes of a tile on the device.
const TILE: u64 = 65 * 65 * 8;

fn red(picture: &Picture) -> impl Iterator<Item = f64> {
    picture.radiance.iter().map(|rgb| f64::from(rgb[0]))
}

/// The mean, and the mean distance from it.
fn mean_and_spread(picture: &Picture) -> (f64, f64) {
    let count = picture.radiance.len() as f64;
    let mean = red(picture).sum::<f64>() / count;
    let spread = red(picture).map(|value| (value - mean).abs()).sum::<f64>();
    (mean, spread / count)
}

/// A check of single texels.
fn check(side: usize) -> IlluminationMap {
    let texel = |index: usize| [((index / side + index % side + 1) % 2) as f32; 3];
    floor_map(0, side, side, (0..side * side).map(texel).collect())
}

fn white_floor() -> Scene {
    floor_scene(diffuse(LinearSrgb::WHITE))
}

/// A floor's map as two halves that only the map puts side by side, with a gutter of four texels between: the left half
/// bright, the right half, which lies 3 m farther, black.
fn two_halves(size: usize) -> (Scene, IlluminationMap) {
    let mut scene = white_floor();
    let right = floor("right", 0, 0.0);
    let right = right.mesh_in_scene();
    let mesh = scene.objects[0].mesh_in_scene_mut();
    let far = right.positions.iter().map(|corner| *corner + DVec3::X * 3.0);
    mesh.positions.extend(far);
    mesh.normals.extend([DVec3::Y; 4]);
    mesh.uv0 = None;
    let triangles = right.triangles.iter();
    mesh.triangles
        .extend(triangles.map(|corners| corners.map(|corner| corner + 4)));
    let half = size / 2;
    let width = (half - 2) as f64 / size as f64;
    let uv = |corner: u32| {
        let place = mesh.positions[corner as usize];
        let start = if corner < 4 { 0.0 } else { 1.0 - width };
        dvec2(start + place.x.rem_euclid(3.0) * width, place.z)
    };
    let columns = || (0..size * size).map(|texel| texel % size);
    let is_surface = |column: usize| !(half - 2..half + 2).contains(&column);
    let area = |column| f64::from(u8::from(is_surface(column))) / (half * size) as f64;
    let chart = Chart {
        corner_uvs: mesh.triangles.iter().map(|corners| corners.map(uv)).collect(),
        texel_areas_m2: columns().map(area).collect(),
        ..(*floor_map(0, size, size, Vec::new()).chart).clone()
    };
    // The gutter holds its neighbour's value, as baked maps do.
    let light = |column| [if column < half { 1.0 } else { 0.0 }; 3];
    (scene, map_of(chart, columns().map(light).collect()))
}

#[test]
fn coarse_levels_hold_no_light_of_other_places() {
    let (scene, map) = two_halves(128);
    let mut rig = or_skip!(Rig::new(&scene, &[map]));
    for pixels in [512, 64, 16, 8] {
        for (x, expected) in [(0.5, lambert(1.0, 1.0)), (3.5, 0.0)] {
            let mut view = from_above(pixels);
            view.camera.position.x = x;
            for found in red(&rig.picture(&view)) {
                let off = (found - expected).abs() / lambert(1.0, 1.0);
                assert!(off <= 1e-3, "{pixels} pixels at {x}: {found}");
            }
        }
    }
}

/// Seen from so far that a pixel covers many texels, a check is grey; at its finest it is not, and would crawl.
#[test]
fn coarse_levels_are_the_mean_by_area() {
    let mut rig = or_skip!(Rig::new(&white_floor(), &[check(512)]));
    let (mean, off) = mean_and_spread(&rig.picture(&from_above(61)));
    let grey = lambert(1.0, 0.5);
    assert!(
        (mean / grey - 1.0).abs() < 1e-3 && off < 1e-3 * grey,
        "{mean} ± {off}"
    );
    rig.renderer.set_quality(AS_CPU);
    assert!(mean_and_spread(&rig.picture(&from_above(61))).1 > 0.1 * grey);
}

/// Half floats overflow if the scale of a picture leaves out the map of the last object.
#[test]
fn maps_of_all_objects_set_the_scale() {
    let mut scene = white_floor();
    scene.objects.push(floor("bright", 0, 0.1));
    let irradiance_w_m2 = 1e9_f32;
    let mut rig = or_skip!(Rig::new(
        &scene,
        &[floor_map(1, 1, 1, vec![[irradiance_w_m2; 3]])]
    ));
    let expected = lambert(1.0, f64::from(irradiance_w_m2));
    for found in red(&rig.picture(&from_above(8))) {
        assert!((found / expected - 1.0).abs() <= 1e-3, "{found} {expected}");
    }
}

/// What a mirror reflects of a check is the greyer the rougher it is: but for the grain of 64 microfacets.
#[test]
fn roughness_blurs_what_is_reflected() {
    let contrast = |roughness: f64| {
        let mut scene = white_floor();
        scene.materials.push(Material {
            surface: SurfaceKind::Mirror,
            base_colour: LinearSrgb::WHITE,
            metallic: 1.0,
            roughness,
            ..Default::default()
        });
        scene.objects.push(floor("mirror", 1, 1.0));
        // From between the two, up to the mirror.
        let camera = Camera {
            position: DVec3::splat(0.5),
            forward: DVec3::Y,
            up: DVec3::Z,
            vertical_fov_rad: 0.1,
            ..from_above(1).camera
        };
        // What the lobe sees beside the floor is as bright.
        let view = View {
            camera,
            background: LinearSrgb::grey(lambert(1.0, 0.5)),
            ..from_above(101)
        };
        let picture = Rig::new(&scene, &[check(64)])?.picture(&view);
        let (mean, spread) = mean_and_spread(&picture);
        assert!((mean / lambert(1.0, 0.5) - 1.0).abs() < 0.05, "{mean}");
        Some(spread / mean)
    };
    let [Some(smooth), Some(coated), Some(rough)] = [0.0, 0.07, 0.3].map(contrast) else {
        return;
    };
    assert!(smooth > 0.2 && rough < smooth / 8.0, "{smooth} {rough}");
    assert!((0.1..0.9).contains(&(coated / smooth)), "{coated} {smooth}");
}

#[test]
fn maps_beyond_the_budget_lose_what_is_needed_least() {
    let mut scene = white_floor();
    let mut far = floor("far", 0, 0.0);
    let mesh = far.mesh_in_scene_mut();
    mesh.positions.iter_mut().for_each(|corner| corner.x += 40.0);
    scene.objects.push(far);
    let ramp = |texel: usize| [1.0 + (texel % 256) as f32 / 256.0; 3];
    let map = |object| floor_map(object, 256, 256, (0..256 * 256).map(ramp).collect());
    // 16 tiles, 4, 1, 1 and 1 of each map.
    let mut rig = or_skip!(Rig::new(&scene, &[map(0), map(1)]));
    let mut within = |tiles: u64| {
        rig.renderer.set_map_budget(tiles * TILE);
        let picture = rig.picture(&from_above(300));
        let counts = rig.renderer.counts();
        (picture, counts.map_bytes / TILE, counts.coarse_maps)
    };
    let (whole, tiles, coarse) = within(1 << 16);
    assert_eq!((tiles, coarse), (46, 0));
    // The far one gives its finest level up: what is near looks the same.
    let near = within(40);
    assert!(near == (whole.clone(), 30, 1));
    // Both do, and the picture is coarser but as bright.
    let (blurred, tiles, coarse) = within(20);
    assert!(tiles <= 20 && coarse == 2, "{tiles} tiles");
    assert!(blurred != whole);
    let ratio = red(&blurred).sum::<f64>() / red(&whole).sum::<f64>();
    assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
    // Next to nothing keeps the coarsest levels; all comes back with the memory.
    let (_, tiles, coarse) = within(0);
    assert_eq!((tiles, coarse), (2, 2));
    assert!(within(1 << 16) == (whole, 46, 0));
    // Maps that come while memory is short are cut as well.
    rig.renderer.set_map_budget(4 * TILE);
    rig.set_maps(&[map(0), map(1)]);
    rig.picture(&from_above(300));
    assert!(rig.renderer.counts().map_bytes <= 4 * TILE);
}

#[test]
fn tiles_without_light_take_no_memory() {
    let mut irradiance = vec![[0.0; 3]; 1024 * 1024];
    irradiance[1024 * 700 + 500] = [1.0; 3];
    let map = floor_map(0, 1024, 1024, irradiance);
    let rig = or_skip!(Rig::new(&white_floor(), &[map]));
    let tiles = rig.renderer.counts().map_bytes / TILE;
    // One on each of 1024, 512, …, 16 texels, but for neighbours that store the lit texel too.
    assert!((7..=14).contains(&tiles), "{tiles} tiles");
}

/// 150 × 100 texels: tiles of 64, the last ones smaller.
const SIZE: [usize; 2] = [150, 100];

fn ramp() -> Vec<[f32; 3]> {
    let texel = |index: usize| [1.0 + index as f32, 0.5 * index as f32, 3.0];
    (0..SIZE[0] * SIZE[1]).map(texel).collect()
}

fn map(irradiance: Vec<[f32; 3]>) -> IlluminationMap {
    floor_map(0, SIZE[0], SIZE[1], irradiance)
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
    let scene = floor_scene(diffuse(rgb(0.8, 0.5, 0.2)));
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
    let ball = shapes::sphere(dvec3(0.4, 0.3, 0.4), 0.2, 3);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let cuboid = shapes::cuboid(dvec3(0.7, 0.0, 0.7), dvec3(0.9, 0.2, 0.9));
    let grey = parts::matte("box", LinearSrgb::grey(0.5));
    parts::add(&mut scene, "box", cuboid, grey);
    scene.materials[2].emitted_radiance = LinearSrgb::grey(30.0);
    let sky = Environment::new(1, 1, vec![[20.0, 10.0, 5.0]]);
    (under_sky(scene, sky, 1.0), vec![map(ramp())])
}

#[test]
fn edited_scene_shows_as_a_new_one() {
    let (mut scene, maps) = room();
    let mut rig = or_skip!(Rig::new(&scene, &maps));
    let way = dvec3(-0.1, 0.05, 0.02);
    let moved = |object, yaw_rad| Edit::Place(object, Motion::turned(yaw_rad, way));
    let ior = Edit::Material(1, MaterialEdit::Ior(1.2));
    let tint = Edit::Material(1, MaterialEdit::BaseColour(rgb(1.0, 0.5, 0.2)));
    // All objects are written at once.
    let uniform = 160 * scene.objects.len() as u64;
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
    scene.lights[0].colour = rgb(0.5, 1.0, 1.0);
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
    let alone = floor_scene(diffuse(rgb(0.3, 0.6, 0.9)));
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
    scene.materials[0].base_colour = rgb(0.1, 0.5, 0.9);
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
