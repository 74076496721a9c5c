//! What is uploaded when maps or the scene change, and that the picture is that of a fresh upload.

use std::ops::Range;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use nephroid::eye_pass::renderer::{EyeQuality, MapStyle, Renderer, Uploaded, render_offscreen};
use nephroid::eye_pass::{Picture, View};
use nephroid::gpu::Gpu;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Edit, Scene};

use crate::device::gpu;
use crate::scenes::{diffuse, floor_map, floor_scene, from_above};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

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
fn tiles_and_bytes(size: [usize; 2], counts: impl Fn(usize, &[Range<usize>; 2]) -> bool) -> (u64, u64) {
    let (mut tiles, mut bytes) = (0, 0);
    let (mut size, mut level) = (size, 0);
    loop {
        let starts = |side: usize| {
            (0..side)
                .step_by(64)
                .map(move |start| start..side.min(start + 64) + 1)
        };
        for rows in starts(size[1]) {
            for columns in starts(size[0]) {
                let texels = columns.len() * rows.len();
                if counts(level, &[columns, rows.clone()]) {
                    tiles += 1;
                    bytes += 8 * texels as u64;
                }
            }
        }
        if size.iter().all(|side| *side <= 16) {
            return (tiles, bytes);
        }
        size = size.map(|side| side.div_ceil(2));
        level += 1;
    }
}

fn renderer(gpu: &Gpu, scene: &Scene, maps: &[IlluminationMap]) -> (Renderer, Uploaded) {
    let mut renderer = Renderer::new(gpu, scene, FORMAT, 1).expect("the scene is uploaded");
    renderer.set_quality(EyeQuality::STILL);
    let uploaded = renderer.set_maps(gpu, scene, maps).expect("the maps fit");
    (renderer, uploaded)
}

#[track_caller]
fn assert_as_fresh(gpu: &Gpu, renderer: &mut Renderer, scene: &Scene, maps: &[IlluminationMap], view: &View) {
    let shown = renderer.radiance(gpu, view).expect("it renders");
    let fresh = render_offscreen(gpu, scene, maps, view).expect("it renders");
    let bits = |picture: &Picture| -> Vec<u32> {
        let channels = picture.radiance.iter().flatten();
        channels.map(|channel| channel.to_bits()).collect()
    };
    assert!(bits(&shown) == bits(&fresh));
    assert!(
        fresh.radiance.iter().any(|rgb| rgb[0] > 0.0),
        "it shows something"
    );
}

#[test]
fn only_tiles_that_differ_are_uploaded() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::new(0.8, 0.5, 0.2)));
    let mut irradiance = ramp();
    let (mut renderer, first) = renderer(&gpu, &scene, &[map(irradiance.clone())]);
    assert_eq!(
        (first.tiles, first.tile_bytes),
        tiles_and_bytes(SIZE, |_, _| true)
    );

    let again = renderer.set_maps(&gpu, &scene, &[map(irradiance.clone())]);
    assert_eq!(
        again.expect("the maps fit"),
        Uploaded::default(),
        "nothing changed"
    );

    // Each lies in the corner of a tile, next to others.
    for (column, row) in [(64, 63), (63, 64), (149, 99), (64, 64), (70, 70)] {
        // Enough to show on the coarsest level.
        irradiance[row * SIZE[0] + column][1] += 5000.0;
        let maps = [map(irradiance.clone())];
        let uploaded = renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
        let holds = |level: usize, [columns, rows]: &[Range<usize>; 2]| {
            columns.contains(&(column >> level)) && rows.contains(&(row >> level))
        };
        let expected = tiles_and_bytes(SIZE, holds);
        assert_eq!(
            (uploaded.tiles, uploaded.tile_bytes),
            expected,
            "texel {column}, {row}"
        );
        assert!(
            expected.0 <= 4 + 4,
            "a tile and its neighbours, and one of each coarser level"
        );
        assert_as_fresh(&gpu, &mut renderer, &scene, &maps, &from_above(256));
    }
}

#[test]
fn a_peak_that_outgrows_or_leaves_its_scale_is_uploaded_anew() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mut irradiance = ramp();
    let (mut renderer, _) = renderer(&gpu, &scene, &[map(irradiance.clone())]);
    irradiance[7] = [1e6; 3];
    let maps = [map(irradiance.clone())];
    let uploaded = renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
    assert_eq!(uploaded.tiles, tiles_and_bytes(SIZE, |_, _| true).0);
    assert_as_fresh(&gpu, &mut renderer, &scene, &maps, &from_above(256));

    for factor in [1e-3, 1e-9, 0.0] {
        let dim = irradiance.iter().map(|rgb| rgb.map(|channel| channel * factor));
        let maps = [map(dim.collect())];
        renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
        let shown = renderer.radiance(&gpu, &from_above(64)).expect("it renders");
        let fresh = render_offscreen(&gpu, &scene, &maps, &from_above(64)).expect("it renders");
        assert_eq!(shown.radiance, fresh.radiance, "factor {factor}");
    }
}

#[test]
fn another_size_and_no_map_take_new_textures() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let (mut renderer, _) = renderer(&gpu, &scene, &[map(ramp())]);
    let maps = [floor_map(0, 64, 65, vec![[2.0; 3]; 64 * 65])];
    let uploaded = renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
    assert_eq!(
        (uploaded.tiles, uploaded.tile_bytes),
        tiles_and_bytes([64, 65], |_, _| true)
    );
    assert_as_fresh(&gpu, &mut renderer, &scene, &maps, &from_above(32));
    let uploaded = renderer.set_maps(&gpu, &scene, &[]).expect("no map fits");
    assert_eq!(uploaded.tiles, 0);
    let dark = renderer.radiance(&gpu, &from_above(4)).expect("it renders");
    assert!(dark.radiance.iter().all(|rgb| *rgb == [0.0; 3]));
}

/// A lit floor under a glass ball, with a matte box beside.
fn room() -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.5)));
    let ball = shapes::sphere(DVec3::new(0.4, 0.3, 0.4), 0.2, 3);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let cuboid = shapes::cuboid(DVec3::new(0.7, 0.0, 0.7), DVec3::new(0.9, 0.2, 0.9));
    parts::add(
        &mut scene,
        "box",
        cuboid,
        parts::matte("box", LinearSrgb::grey(0.5)),
    );
    scene.materials[2].emitted_radiance = LinearSrgb::grey(30.0);
    (scene, vec![map(ramp())])
}

#[test]
fn an_edited_scene_shows_as_if_it_were_new_and_uploads_what_differs() {
    let Some(gpu) = gpu() else { return };
    let (mut scene, maps) = room();
    let (mut renderer, _) = renderer(&gpu, &scene, &maps);
    let moved = |object, rotation| Edit::ObjectMoved {
        object,
        rotation,
        translation: DVec3::new(-0.1, 0.05, 0.02),
    };
    let corners = |object: usize| 32 * scene.objects[object].mesh.positions.len() as u64;
    // All objects are written at once.
    let uniform = 80 * scene.objects.len() as u64;
    let ball_corners = corners(1);
    let edits = [
        (
            Edit::MaterialIor {
                material: 1,
                ior: 1.2,
            },
            uniform,
        ),
        (
            Edit::MaterialTint {
                material: 1,
                base_colour: LinearSrgb::new(1.0, 0.5, 0.2),
            },
            uniform,
        ),
        (moved(1, DQuat::IDENTITY), ball_corners),
        (moved(2, DQuat::from_rotation_y(0.3)), 36 * 32),
    ];
    for (edit, most_bytes) in edits {
        scene = edit.apply(&scene).expect("it is in range").0;
        let mut uploaded = renderer.set_scene(&gpu, &scene).expect("it is uploaded");
        assert!(
            uploaded.other_bytes > 0 && uploaded.other_bytes <= most_bytes,
            "{edit:?}: {uploaded:?} instead of {most_bytes} bytes"
        );
        let same_maps = renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
        uploaded += same_maps;
        assert_eq!(uploaded.tiles, 0, "{edit:?}");
        assert_as_fresh(&gpu, &mut renderer, &scene, &maps, &from_above(128));
    }
}

#[test]
fn glass_that_turns_matte_gets_corners_of_its_own_and_maps_stay_in_place() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = room();
    let (mut renderer, _) = renderer(&gpu, &scene, &maps);
    let rough = Edit::MaterialRoughness {
        material: 1,
        roughness: 0.9,
    };
    let (matte, smooth) = rough.apply(&scene).expect("it is in range");
    let (again, _) = smooth.apply(&matte).expect("it is in range");
    for edited in [matte, again] {
        renderer.set_scene(&gpu, &edited).expect("it is uploaded");
        renderer.set_maps(&gpu, &edited, &maps).expect("the maps fit");
        assert_as_fresh(&gpu, &mut renderer, &edited, &maps, &from_above(128));
    }
}

#[test]
fn a_scene_of_other_objects_is_taken_over_whole() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = room();
    let (mut renderer, _) = renderer(&gpu, &scene, &maps);
    let alone = floor_scene(diffuse(LinearSrgb::new(0.3, 0.6, 0.9)));
    renderer.set_scene(&gpu, &alone).expect("it is uploaded");
    renderer.set_maps(&gpu, &alone, &maps).expect("the maps fit");
    assert_as_fresh(&gpu, &mut renderer, &alone, &maps, &from_above(64));
    let mut other = alone;
    other.objects[0].mesh = Arc::new(shapes::floor([0.0, 0.5], [0.0, 1.0], 0.0));
    renderer.set_scene(&gpu, &other).expect("it is uploaded");
    renderer.set_maps(&gpu, &other, &maps).expect("the maps fit");
    assert_as_fresh(&gpu, &mut renderer, &other, &maps, &from_above(64));
}

#[test]
fn maps_as_they_are_show_their_values_whatever_the_surface() {
    let Some(gpu) = gpu() else { return };
    let (mut scene, _) = room();
    scene.materials[0].base_colour = LinearSrgb::new(0.1, 0.5, 0.9);
    scene.materials[0].emitted_radiance = LinearSrgb::WHITE;
    let value = [0.25, 0.5, 0.75];
    let maps = [floor_map(0, 2, 2, vec![value; 4])];
    let (mut renderer, _) = renderer(&gpu, &scene, &maps);
    let from_above = from_above(64);
    let at = |picture: &Picture, x: usize, y: usize| picture.radiance[y * 64 + x];
    renderer.set_map_style(MapStyle::AsItIs);
    let shown = renderer.radiance(&gpu, &from_above).expect("it renders");
    assert_eq!(
        at(&shown, 26, 26),
        value,
        "under the glass ball, which is left out"
    );
    assert_eq!(at(&shown, 5, 60), value, "beside everything");
    assert_eq!(at(&shown, 51, 51), [0.0; 3], "a box without a map, that glows");
    renderer.set_map_style(MapStyle::Lit);
    let lit = renderer.radiance(&gpu, &from_above).expect("it renders");
    let fresh = render_offscreen(&gpu, &scene, &maps, &from_above).expect("it renders");
    assert_eq!(lit.radiance, fresh.radiance);
    assert_ne!(at(&lit, 26, 26), value);
}
