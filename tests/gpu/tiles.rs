//! Maps in tiles on the device: the picture that the CPU sees, in the memory that the tiles ask for.

use std::sync::Arc;

use glam::DVec2;
use nephroid::eye_pass::renderer::{EyeQuality, Renderer};
use nephroid::gpu::Gpu;
use nephroid::illumination::lookup::in_chart;
use nephroid::illumination::tiles::{self, COARSEST, TileLayout};
use nephroid::illumination::{Chart, IlluminationMap};
use nephroid::optics::LinearSrgb;

use crate::device::gpu;
use crate::scenes::{diffuse, floor_map, floor_scene, from_above, lambert};

const SIDE: usize = 512;

fn renderer(gpu: &Gpu, maps: &[IlluminationMap]) -> Renderer {
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let mut renderer =
        Renderer::new(gpu, &scene, wgpu::TextureFormat::Rgba8Unorm, 1).expect("it is uploaded");
    renderer.set_quality(EyeQuality {
        minifies: false,
        ..EyeQuality::STILL
    });
    renderer.set_maps(gpu, &scene, maps).expect("the maps fit");
    renderer
}

fn smooth(uv: DVec2) -> f32 {
    (1.0 + 0.5 * (4.0 * uv.x).cos() * (3.0 * uv.y).sin()) as f32
}

/// Fine around one tile, coarser from tile to tile.
fn map() -> IlluminationMap {
    let (columns, rows) = tiles::tile_counts(SIDE, SIDE);
    let mut levels = vec![COARSEST; columns * rows];
    levels[2 * columns + 2] = 0;
    tiles::balance(&mut levels, columns);
    let layout = TileLayout::new((SIDE, SIDE), &levels, &levels);
    let dense = floor_map(0, SIDE, SIDE, Vec::new());
    let (mut values, mut areas) = (Vec::new(), Vec::new());
    for tile in layout.tiles() {
        let side = f64::from(1_u32 << tile.level);
        let origin = DVec2::new(tile.origin.0 as f64, tile.origin.1 as f64);
        for index in 0..tile.texels.len() {
            let texel = DVec2::new((index % tile.size.0) as f64, (index / tile.size.0) as f64);
            values.push([smooth((origin + (texel + 0.5) * side) / SIDE as f64); 3]);
            areas.push(side * side / (SIDE * SIDE) as f64);
        }
    }
    let chart = Chart {
        texel_areas_m2: areas,
        layout: Some(Arc::new(layout)),
        ..Chart::clone(&dense.chart)
    };
    let mut map = floor_map(0, SIDE, SIDE, values);
    map.chart = Arc::new(chart);
    map
}

#[test]
fn maps_in_tiles_look_as_the_cpu_sees_them() {
    let Some(gpu) = gpu() else { return };
    let maps = [map()];
    let pixels = 2 * SIDE;
    let mut renderer = renderer(&gpu, &maps);
    let picture = renderer
        .radiance(&gpu, &from_above(pixels as u32))
        .expect("it renders");
    let values = &maps[0].layers[0].irradiance;
    let (mut worst, mut sum) = (0.0_f64, 0.0);
    for (pixel, found) in picture.radiance.iter().enumerate() {
        let uv = DVec2::new((pixel % pixels) as f64 + 0.5, (pixel / pixels) as f64 + 0.5) / pixels as f64;
        let expected = lambert(1.0, in_chart(&maps[0].chart, values, uv).r);
        let off = (f64::from(found[0]) / expected - 1.0).abs();
        worst = worst.max(off);
        sum += off;
    }
    let mean = sum / picture.radiance.len() as f64;
    // Beside coarser tiles the CPU looks at their texels as they are, the device between them.
    assert!(worst < 0.08 && mean < 2e-3, "worst {worst}, mean {mean}");
    assert_eq!(gpu.take_error(), None);
}

#[test]
fn tiles_take_the_memory_of_their_levels() {
    let Some(gpu) = gpu() else { return };
    let tiled = map();
    let dense = tiled.dense().into_owned();
    let bytes = |map: &IlluminationMap| renderer(&gpu, std::slice::from_ref(map)).counts().map_bytes;
    let (tiled, dense) = (bytes(&tiled), bytes(&dense));
    assert!(tiled > 0 && 4 * tiled < dense, "{tiled} of {dense} bytes");
}
