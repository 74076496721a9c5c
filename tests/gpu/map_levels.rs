//! Illumination maps on the device: no seam between tiles, no light of other places in what is seen coarsely, and less
//! detail where memory is short.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nephroid::eye_pass::renderer::{EyeQuality, Renderer};
use nephroid::eye_pass::{Picture, View};
use nephroid::gpu::Gpu;
use nephroid::illumination::lookup::bilinear;
use nephroid::illumination::{Chart, IlluminationMap};
use nephroid::optics::LinearSrgb;
use nephroid::scene::{Camera, Scene};

use crate::device::gpu;
use crate::scenes::{diffuse, floor, floor_map, floor_scene, from_above, lambert};

/// Bytes of a tile on the device.
const TILE: u64 = 65 * 65 * 8;

fn renderer(gpu: &Gpu, scene: &Scene, maps: &[IlluminationMap], quality: EyeQuality) -> Renderer {
    let mut renderer = Renderer::new(gpu, scene, wgpu::TextureFormat::Rgba8Unorm, 1).expect("it is uploaded");
    renderer.set_quality(quality);
    renderer.set_maps(gpu, scene, maps).expect("the maps fit");
    renderer
}

const FINEST: EyeQuality = EyeQuality {
    minifies: false,
    ..EyeQuality::STILL
};

fn red(picture: &Picture) -> impl Iterator<Item = f64> {
    picture.radiance.iter().map(|rgb| f64::from(rgb[0]))
}

#[test]
fn look_ups_go_on_over_the_borders_of_tiles() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    // Three tiles across and down, the last ones of a single texel; nothing repeats.
    let size = 129;
    let texel = |index: usize| [(((index * 7919) % 1009) as f32 / 1009.0).powi(2); 3];
    let irradiance: Vec<[f32; 3]> = (0..size * size).map(texel).collect();
    let maps = [floor_map(0, size, size, irradiance.clone())];
    // Several pixels for each texel around the borders.
    let pixels = 1000;
    let picture = renderer(&gpu, &scene, &maps, FINEST)
        .radiance(&gpu, &from_above(pixels))
        .expect("it renders");
    let at = |index: usize| (index as f64 + 0.5) / f64::from(pixels);
    let mut worst = 0.0_f64;
    for (index, found) in red(&picture).enumerate() {
        let uv = DVec2::new(at(index % pixels as usize), at(index / pixels as usize));
        let expected = lambert(1.0, bilinear(&irradiance, size, size, uv).r);
        worst = worst.max((found - expected).abs());
    }
    // Steps between neighbouring texels are up to 0.3; rasterised coordinates are off by some 1e-6 of the floor.
    assert!(worst < 5e-4, "{worst}");
}

/// The floor's map as two halves that only the map puts side by side: the left half bright, the right half black.
fn two_halves(size: usize, gutter: usize) -> (Scene, [IlluminationMap; 1]) {
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    // Two floors, far apart, in one object: each in its half of the map, with a gutter between.
    let (left, right) = (floor("left", 0, 0.0), floor("right", 0, 0.0));
    let mesh = Arc::make_mut(&mut scene.objects[0].mesh);
    *mesh = (*left.mesh).clone();
    let far = right.mesh.positions.iter().map(|corner| *corner + DVec3::X * 3.0);
    mesh.positions.extend(far);
    mesh.normals.extend([DVec3::Y; 4]);
    mesh.uv0 = None;
    mesh.triangles.extend(
        right
            .mesh
            .triangles
            .iter()
            .map(|triangle| triangle.map(|corner| corner + 4)),
    );
    let half = size / 2;
    let width = (half - gutter / 2) as f64 / size as f64;
    let corners = |triangle: &[u32; 3]| {
        triangle.map(|corner| {
            let place = mesh.positions[corner as usize];
            let start = if corner < 4 { 0.0 } else { 1.0 - width };
            DVec2::new(start + place.x.rem_euclid(3.0) * width, place.z)
        })
    };
    let is_left = |column: usize| column < half - gutter / 2;
    let is_right = |column: usize| column >= half + gutter / 2;
    let columns = || (0..size * size).map(|texel| texel % size);
    let area = 1.0 / (half * size) as f64;
    let chart = Chart {
        corner_uvs: mesh.triangles.iter().map(corners).collect(),
        layout: None,
        texel_areas_m2: columns()
            .map(|column| {
                if is_left(column) || is_right(column) {
                    area
                } else {
                    0.0
                }
            })
            .collect(),
        ..(*floor_map(0, size, size, Vec::new()).chart).clone()
    };
    // The gutter holds its neighbour's value, as baked maps do.
    let irradiance = columns()
        .map(|column| [if column < half { 1.0 } else { 0.0 }; 3])
        .collect();
    let mut map = floor_map(0, size, size, irradiance);
    map.chart = Arc::new(chart);
    (scene, [map])
}

#[test]
fn what_is_seen_coarsely_holds_no_light_of_another_place() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = two_halves(128, 4);
    for pixels in [512, 64, 16, 8] {
        for (place, expected) in [(0.5, lambert(1.0, 1.0)), (3.5, 0.0)] {
            let above = from_above(pixels);
            let camera = Camera {
                position: DVec3::new(place, 1.0, 0.5),
                ..above.camera.clone()
            };
            let view = View { camera, ..above };
            let picture = renderer(&gpu, &scene, &maps, EyeQuality::STILL)
                .radiance(&gpu, &view)
                .expect("it renders");
            for found in red(&picture) {
                assert!(
                    (found - expected).abs() <= 1e-3 * lambert(1.0, 1.0),
                    "{pixels} pixels at {place}: {found} instead of {expected}"
                );
            }
        }
    }
}

/// A check of single texels, seen from so far that a pixel covers many of them, is grey; at its finest it is not.
#[test]
fn what_is_seen_coarsely_is_the_mean_by_area() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let check = (0..512 * 512).map(|texel| {
        [if (texel / 512 + texel % 512) % 2 == 0 {
            1.0
        } else {
            0.0
        }; 3]
    });
    let maps = [floor_map(0, 512, 512, check.collect())];
    let spread = |quality: EyeQuality| {
        let picture = renderer(&gpu, &scene, &maps, quality)
            .radiance(&gpu, &from_above(61))
            .expect("it renders");
        let mean = red(&picture).sum::<f64>() / picture.radiance.len() as f64;
        let variance = red(&picture).map(|value| (value - mean).powi(2)).sum::<f64>();
        (mean, (variance / picture.radiance.len() as f64).sqrt())
    };
    let grey = lambert(1.0, 0.5);
    let (mean, off) = spread(EyeQuality::STILL);
    assert!(
        (mean / grey - 1.0).abs() < 1e-3 && off < 1e-3 * grey,
        "{mean} ± {off}"
    );
    let (_, off) = spread(FINEST);
    assert!(
        off > 0.1 * grey,
        "±{off}: this pattern crawls where it is not averaged"
    );
}

#[test]
fn maps_beyond_the_budget_lose_the_detail_that_is_needed_least() {
    let Some(gpu) = gpu() else { return };
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mut far = floor("far", 0, 0.0);
    let mesh = Arc::make_mut(&mut far.mesh);
    mesh.positions.iter_mut().for_each(|corner| corner.x += 40.0);
    scene.objects.push(far);
    let ramp = |texel: usize| [1.0 + (texel % 256) as f32 / 256.0; 3];
    let map = |object| floor_map(object, 256, 256, (0..256 * 256).map(ramp).collect());
    let maps = [map(0), map(1)];
    // 16 tiles, 4, 1, 1 and 1 of each map.
    let mut renderer = renderer(&gpu, &scene, &maps, EyeQuality::STILL);
    let shown = |renderer: &mut Renderer| renderer.radiance(&gpu, &from_above(300)).expect("it renders");
    let whole = shown(&mut renderer);
    let counts = |renderer: &Renderer| (renderer.counts().map_bytes / TILE, renderer.counts().coarse_maps);
    assert_eq!(counts(&renderer), (46, 0));

    // The far one gives its finest level up: what is near looks the same.
    renderer.set_map_budget(40 * TILE);
    assert!(shown(&mut renderer).radiance == whole.radiance);
    assert_eq!(counts(&renderer), (30, 1));

    // Both do, and the picture is coarser but as bright.
    renderer.set_map_budget(20 * TILE);
    let coarse = shown(&mut renderer);
    let (tiles, coarse_maps) = counts(&renderer);
    assert!(tiles <= 20 && coarse_maps == 2, "{tiles} tiles");
    assert!(coarse.radiance != whole.radiance);
    let ratio = red(&coarse).sum::<f64>() / red(&whole).sum::<f64>();
    assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");

    // Next to nothing keeps the coarsest levels; all comes back with the memory.
    renderer.set_map_budget(0);
    shown(&mut renderer);
    assert_eq!(counts(&renderer), (2, 2));
    renderer.set_map_budget(1 << 30);
    assert!(shown(&mut renderer).radiance == whole.radiance);
    assert_eq!(counts(&renderer), (46, 0));
    // Maps that come while memory is short are cut as well.
    renderer.set_map_budget(4 * TILE);
    renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
    shown(&mut renderer);
    assert!(counts(&renderer).0 <= 4);
    assert_eq!(gpu.take_error(), None);
}

#[test]
fn tiles_without_light_take_no_memory() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mut irradiance = vec![[0.0; 3]; 1024 * 1024];
    irradiance[1024 * 700 + 500] = [1.0; 3];
    let maps = [floor_map(0, 1024, 1024, irradiance)];
    let renderer = renderer(&gpu, &scene, &maps, EyeQuality::STILL);
    let tiles = renderer.counts().map_bytes / TILE;
    // One on each of 1024, 512, …, 16 texels, but for neighbours that store the lit texel too.
    assert!((7..=14).contains(&tiles), "{tiles} tiles");
}
