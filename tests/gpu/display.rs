//! Exposure, tone mapping and encoding: the device against the processor.

use nephroid::eye_pass::renderer::Renderer;
use nephroid::eye_pass::tone_mapping::{auto_exposure_stops, display_rgba8};
use nephroid::eye_pass::{Picture, ToneMap, View, WhiteBalance};
use nephroid::gpu::{Gpu, readback};
use nephroid::optics::LinearSrgb;
use nephroid::optics::spectrum::xyz::{IDENTITY, Matrix3};
use nephroid::scene::Scene;

use crate::device::gpu;
use crate::scenes::{diffuse, floor_map, floor_scene, from_above};

const SIZE: u32 = 64;

/// A floor with a ramp from black over white to far beyond, of changing hue.
fn ramp() -> (Scene, Vec<nephroid::illumination::IlluminationMap>) {
    let texels = (0..SIZE * SIZE).map(|index| {
        let level = (f64::from(index % SIZE) / 4.0 - 8.0).exp2();
        let hue = f64::from(index / SIZE) / f64::from(SIZE);
        [level, level * hue, level * (1.0 - hue)].map(|channel| channel as f32)
    });
    let maps = vec![floor_map(0, SIZE as usize, SIZE as usize, texels.collect())];
    (floor_scene(diffuse(LinearSrgb::WHITE)), maps)
}

fn shown(gpu: &Gpu, format: wgpu::TextureFormat, view: &View, white_balance: &Matrix3) -> Vec<u8> {
    let (scene, maps) = ramp();
    let mut renderer = Renderer::new(gpu, &scene, format, 1).expect("the scene is uploaded");
    renderer.set_white_balance(gpu, white_balance);
    renderer.set_maps(gpu, &scene, &maps).expect("the maps fit");
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: SIZE,
            height: SIZE,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let target = texture.create_view(&Default::default());
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.draw(gpu, &mut encoder, &target, view).expect("it draws");
    gpu.queue.submit([encoder.finish()]);
    readback::read_texture(gpu, &texture).expect("it can be read")
}

#[test]
fn device_and_processor_show_the_same_on_every_kind_of_target() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = ramp();
    let mut brightest_seen = 0;
    for tone_map in ToneMap::ALL {
        for exposure_stops in [-3.0, 0.0, 2.5] {
            let view = View {
                exposure_stops,
                tone_map,
                ..from_above(SIZE)
            };
            let picture = nephroid::eye_pass::renderer::render_offscreen(&gpu, &scene, &maps, &view)
                .expect("it renders");
            let expected = display_rgba8(&picture, exposure_stops, tone_map);
            for format in [
                wgpu::TextureFormat::Rgba8Unorm,
                wgpu::TextureFormat::Rgba8UnormSrgb,
            ] {
                let found = shown(&gpu, format, &view, &IDENTITY);
                assert_eq!(found.len(), expected.len());
                let differences: Vec<u8> = found.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b)).collect();
                let sum: f64 = differences.iter().map(|difference| f64::from(*difference)).sum();
                let mean = sum / differences.len() as f64;
                let largest = differences.iter().copied().max().unwrap_or(0);
                // The two round at different places: half floats before, bytes after. Never more than one code.
                assert!(
                    largest <= 1 && mean < 0.1,
                    "{tone_map:?} {format:?}: {largest}, mean {mean}"
                );
            }
            brightest_seen = brightest_seen.max(expected.chunks(4).map(|rgba| rgba[0]).max().unwrap_or(0));
        }
    }
    assert!(brightest_seen >= 250, "the ramp reaches white: {brightest_seen}");
}

#[test]
fn device_and_processor_balance_white_alike() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = ramp();
    let view = View {
        tone_map: ToneMap::AgX,
        ..from_above(SIZE)
    };
    let picture =
        nephroid::eye_pass::renderer::render_offscreen(&gpu, &scene, &maps, &view).expect("it renders");
    let as_it_is = display_rgba8(&picture, 0.0, ToneMap::AgX);
    for white in ["2856", "9000K", "0.38,0.42"] {
        let white: WhiteBalance = white.parse().expect("a white");
        let matrix = white.matrix(&scene);
        let expected = display_rgba8(&picture.clone().white_balanced(&matrix), 0.0, ToneMap::AgX);
        let found = shown(&gpu, wgpu::TextureFormat::Rgba8Unorm, &view, &matrix);
        let apart = |shown: &[u8]| {
            let pairs = shown.iter().zip(&expected);
            pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
        };
        assert!(apart(&found) <= 1, "{white}: {}", apart(&found));
        assert!(apart(&as_it_is) > 8, "{white}: {}", apart(&as_it_is));
    }
}

#[test]
fn a_minimised_window_draws_nothing_and_then_goes_on() {
    let Some(gpu) = gpu() else { return };
    let (scene, maps) = ramp();
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let mut renderer = Renderer::new(&gpu, &scene, format, 4).expect("the scene is uploaded");
    renderer.set_maps(&gpu, &scene, &maps).expect("the maps fit");
    for (width, height) in [(8, 8), (0, 0), (8, 0), (5, 9)] {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: width.max(1),
                height: height.max(1),
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let view = View {
            width,
            height,
            ..from_above(1)
        };
        renderer
            .draw(
                &gpu,
                &mut encoder,
                &texture.create_view(&Default::default()),
                &view,
            )
            .expect("it draws");
        gpu.queue.submit([encoder.finish()]);
        gpu.wait().expect("no fault");
    }
}

#[test]
fn neutral_tone_mapping_is_the_identity_on_middle_tones_and_never_reaches_beyond_white() {
    // Below the shoulder the curve only takes off 0.04, the reflection of the dielectrics that it was made for.
    for value in [0.1, 0.3, 0.7] {
        let display = ToneMap::Neutral.apply(LinearSrgb::new(value, value, 0.1));
        assert!((display.r - (value - 0.04)).abs() < 1e-12, "{value}: {display:?}");
    }
    let mut last = -1.0;
    for step in 0..200 {
        let display = ToneMap::Neutral
            .apply(LinearSrgb::grey((f64::from(step) / 8.0 - 10.0).exp2()))
            .r;
        assert!(
            display > last && display <= 1.0,
            "rises with every step: {display} after {last}"
        );
        last = display;
    }
}

#[test]
fn auto_exposure_brings_a_lit_picture_to_middle_grey_and_is_blind_to_black() {
    let picture = |radiance: Vec<[f32; 3]>| Picture {
        width: radiance.len() as u32,
        height: 1,
        radiance,
    };
    let lit = vec![[0.045; 3]; 10];
    let mut with_black = lit.clone();
    with_black.extend([[0.0; 3]; 90]);
    for radiance in [lit, with_black] {
        // 0.18 / 0.045 = 4: two stops.
        assert!((auto_exposure_stops(&picture(radiance)) - 2.0).abs() < 1e-6);
    }
    assert_eq!(auto_exposure_stops(&picture(vec![[0.0; 3]; 4])), 0.0);
    assert_eq!(auto_exposure_stops(&picture(Vec::new())), 0.0);

    // A quarter of the picture is 64 times as bright as the rest: it stays below white. A lone lamp does not count.
    let mut bright = vec![[1.0; 3]; 75];
    bright.extend([[64.0; 3]; 25]);
    assert!((auto_exposure_stops(&picture(bright)) + 6.0).abs() < 1e-6);
    let mut lamp = vec![[0.18; 3]; 999];
    lamp.push([10.0; 3]);
    assert!(auto_exposure_stops(&picture(lamp)).abs() < 0.01);
}
