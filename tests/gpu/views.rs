//! Surfaces shown by something else than their light, on floors of which every pixel is known.

use std::sync::Arc;

use glam::DVec3;
use nephroid::eye_pass::renderer::{Inspected, MapStyle, Renderer, render_offscreen};
use nephroid::gpu::Gpu;
use nephroid::illumination::IlluminationMap;
use nephroid::illumination::false_colours::ColourScale;
use nephroid::optics::LinearSrgb;
use nephroid::scene::Scene;
use nephroid::settings::LayerKind;

use crate::device::gpu;
use crate::scenes::{diffuse, floor_map, floor_scene, from_above};

/// Pixels and texels across.
const SIZE: u32 = 16;
/// A step of 8-bit display values, and half of one for half floats.
const CODE: f64 = 1.5 / 255.0;

/// Display values of a view of the floor.
fn shown(gpu: &Gpu, scene: &Scene, maps: &[IlluminationMap], style: MapStyle, size: u32) -> Vec<[f64; 3]> {
    let mut renderer =
        Renderer::new(gpu, scene, wgpu::TextureFormat::Rgba8Unorm, 1).expect("the scene is uploaded");
    renderer.set_map_style(style);
    renderer.set_maps(gpu, scene, maps).expect("the maps fit");
    let picture = renderer.radiance(gpu, &from_above(size)).expect("it draws");
    assert_eq!(gpu.take_error(), None);
    let display = |rgb: &[f32; 3]| rgb.map(|linear| LinearSrgb::encode_channel(f64::from(linear)));
    picture.radiance.iter().map(display).collect()
}

fn inspected(what: Inspected, scale: ColourScale) -> MapStyle {
    MapStyle::Inspected { what, scale }
}

fn is_near(found: [f64; 3], expected: [f64; 3]) -> bool {
    found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= CODE)
}

/// From 2⁻⁸ to 2⁷ W/m², of changing hue.
fn ramp() -> Vec<[f32; 3]> {
    let texel = |index: u32| {
        let level = (f64::from(index % SIZE) - 8.0).exp2();
        let hue = f64::from(index / SIZE) / f64::from(SIZE);
        [level, level * hue, level * (1.0 - hue)].map(|channel| channel as f32)
    };
    (0..SIZE * SIZE).map(texel).collect()
}

#[test]
fn irradiance_has_the_colour_of_the_scale() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::grey(0.3)));
    let maps = [floor_map(0, SIZE as usize, SIZE as usize, ramp())];
    for is_logarithmic in [false, true] {
        let scale = ColourScale {
            low: 0.01,
            high: 20.0,
            is_logarithmic,
        };
        let found = shown(&gpu, &scene, &maps, inspected(Inspected::Irradiance, scale), SIZE);
        for (found, rgb) in found.iter().zip(ramp()) {
            let luminance = LinearSrgb::from(rgb.map(f64::from)).luminance();
            let expected = scale.colour(luminance);
            assert!(
                is_near(*found, expected),
                "{luminance} W/m²: {found:?}, not {expected:?}"
            );
        }
        assert!(
            !is_near(found[0], found[usize::try_from(SIZE).expect("small") - 1]),
            "there are colours"
        );
    }
}

#[test]
fn normals_are_those_of_the_mesh() {
    let Some(gpu) = gpu() else { return };
    for normal in [DVec3::Y, DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.48, 0.6, -0.64)] {
        let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
        let mesh = Arc::make_mut(&mut scene.objects[0].mesh);
        mesh.normals = vec![normal; 4];
        // Surfaces have them with and without maps.
        let style = inspected(Inspected::Normals, ColourScale::default());
        for found in shown(&gpu, &scene, &[], style, SIZE) {
            let expected = (0.5 * normal + 0.5).to_array();
            assert!(is_near(found, expected), "{normal}: {found:?}");
        }
    }
}

#[test]
fn coordinates_run_as_the_floors_do() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    let maps = [floor_map(0, 4, 4, vec![[1.0; 3]; 16])];
    for what in [Inspected::Uv, Inspected::MapUv] {
        let found = shown(&gpu, &scene, &maps, inspected(what, ColourScale::default()), SIZE);
        for (index, found) in (0..).zip(found) {
            let at = |step: u32| (f64::from(step) + 0.5) / f64::from(SIZE);
            let expected = [at(index % SIZE), at(index / SIZE), 0.0];
            assert!(is_near(found, expected), "{what:?}: {found:?}, not {expected:?}");
        }
    }
}

#[test]
fn texels_are_squares_and_counted_by_the_metre() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::WHITE));
    // 8 by 4 texels on a square metre; each is seen by 2 by 4 pixels.
    let maps = [floor_map(0, 8, 4, vec![[1.0; 3]; 32])];
    let scale = ColourScale {
        low: 1.0,
        high: 100.0,
        is_logarithmic: true,
    };
    let found = shown(
        &gpu,
        &scene,
        &maps,
        inspected(Inspected::TexelDensity, scale),
        SIZE,
    );
    let expected = scale.colour(32.0_f64.sqrt());
    for found in found {
        assert!(is_near(found, expected), "{found:?}, not {expected:?}");
    }
    let style = inspected(Inspected::Texels, ColourScale::default());
    let pixels = 8 * SIZE;
    let found = shown(&gpu, &scene, &maps, style, pixels);
    let of_texel = |column: u32, row: u32| {
        let (x, y) = (column * pixels / 8 + 3, row * pixels / 4 + 3);
        found[(y * pixels + x) as usize][0]
    };
    for (column, row) in (0..7).flat_map(|column| (0..3).map(move |row| (column, row))) {
        let here = of_texel(column, row);
        assert!((here - of_texel(column + 1, row + 1)).abs() < CODE);
        assert!((here - of_texel(column + 1, row)).abs() > 0.2);
        assert!((here - of_texel(column, row + 1)).abs() > 0.2);
    }
}

#[test]
fn what_is_no_number_is_magenta_in_every_view_of_maps() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::grey(0.4)));
    let scale = ColourScale {
        low: 0.1,
        high: 10.0,
        is_logarithmic: true,
    };
    let styles = [
        MapStyle::Lit,
        MapStyle::AsItIs,
        inspected(Inspected::Irradiance, scale),
        inspected(Inspected::Texels, scale),
        inspected(Inspected::TexelDensity, scale),
        inspected(Inspected::MapUv, scale),
    ];
    for fault in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut texels = vec![[1.0, 1.0, 1.0]; (SIZE * SIZE) as usize];
        let middle = (SIZE / 2 * SIZE + SIZE / 2) as usize;
        texels[middle][1] = fault;
        let maps = [floor_map(0, SIZE as usize, SIZE as usize, texels)];
        for style in styles {
            let found = shown(&gpu, &scene, &maps, style, SIZE);
            assert!(
                is_near(found[middle], [1.0, 0.0, 1.0]),
                "{fault} in {style:?}: {:?}",
                found[middle]
            );
            let magenta = found.iter().filter(|found| is_near(**found, [1.0, 0.0, 1.0]));
            assert_eq!(magenta.count(), 1, "{fault} in {style:?}: and nowhere else");
        }
    }
}

#[test]
fn layers_alone_add_to_the_final_light() {
    let Some(gpu) = gpu() else { return };
    let scene = floor_scene(diffuse(LinearSrgb::new(0.8, 0.5, 0.2)));
    let mut whole = floor_map(0, SIZE as usize, SIZE as usize, ramp());
    for (kind, factor) in [(LayerKind::Direct, 0.3_f32), (LayerKind::Indirect, 1.7)] {
        let mut layer = whole.layers[0].clone();
        layer.kind = kind;
        layer.irradiance.reverse();
        for rgb in &mut layer.irradiance {
            *rgb = rgb.map(|channel| channel * factor);
        }
        whole.layers.push(layer);
    }
    let view = from_above(SIZE);
    let radiance = |map: &IlluminationMap| {
        let picture = render_offscreen(&gpu, &scene, std::slice::from_ref(map), &view);
        picture.expect("it draws").radiance
    };
    let all = radiance(&whole);
    let mut sum = vec![[0.0_f32; 3]; all.len()];
    for kind in LayerKind::ALL {
        let alone = IlluminationMap {
            layers: vec![whole.layer(kind).expect("it is there").clone()],
            ..whole.clone()
        };
        for (sum, rgb) in sum.iter_mut().zip(radiance(&alone)) {
            for (sum, channel) in sum.iter_mut().zip(rgb) {
                *sum += channel;
            }
        }
    }
    let peak = all.iter().flatten().fold(0.0_f32, |a, b| a.max(*b));
    assert!(peak > 1.0);
    for (all, sum) in all.iter().zip(&sum) {
        for (all, sum) in all.iter().zip(sum) {
            // Half floats: 2⁻¹¹ of each.
            assert!((all - sum).abs() <= 2e-3 * all + 1e-6 * peak, "{all} {sum}");
        }
    }
}
