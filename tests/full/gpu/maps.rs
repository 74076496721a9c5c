//! Illumination maps on the device: what is seen coarsely, and less detail where memory is short.

use glam::{DVec2, DVec3};

use nephroid::eye_pass::{Picture, View};
use nephroid::illumination::{Chart, IlluminationMap};
use nephroid::optics::LinearSrgb;
use nephroid::scene::{Camera, Material, Scene, SurfaceKind};

use crate::gpu::rig::{AS_CPU, Rig, or_skip};
use support::floors::{diffuse, floor, floor_map, floor_scene, from_above, lambert};
use support::scenes::map_of;

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
        DVec2::new(start + place.x.rem_euclid(3.0) * width, place.z)
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

/// What a mirror reflects of a check is the greyer the rougher it is: by a wider footprint.
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
        let view = View {
            camera,
            ..from_above(101)
        };
        let picture = Rig::new(&scene, &[check(64)])?.picture(&view);
        let (mean, spread) = mean_and_spread(&picture);
        assert!((mean / lambert(1.0, 0.5) - 1.0).abs() < 0.05, "{mean}");
        Some(spread / mean)
    };
    let [Some(smooth), Some(polished), Some(rough)] = [0.0, 0.07, 0.3].map(contrast) else {
        return;
    };
    assert!(smooth > 0.2 && rough < 0.01 * smooth, "{smooth} {rough}");
    assert!((0.1..0.9).contains(&(polished / smooth)), "{polished} {smooth}");
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
