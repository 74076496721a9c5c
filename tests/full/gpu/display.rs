//! Exposure, tone mapping and encoding: the device against the CPU.

use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::eye_pass::{ToneMap, View, WhiteBalance};
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::Scene;

use crate::gpu::rig::{FORMAT, Rig, gpu, or_skip};
use support::floors::{diffuse, floor_map, floor_scene, from_above};

pub const SIZE: u32 = 64;

/// From black over white to far beyond, of changing hue, by the exponent of the first column [W/m²].
pub fn ramp(side: u32, first: f64, step: f64) -> Vec<[f32; 3]> {
    let texel = |index: u32| {
        let level = (f64::from(index % side) * step + first).exp2();
        let hue = f64::from(index / side) / f64::from(side);
        [level, level * hue, level * (1.0 - hue)].map(|channel| channel as f32)
    };
    (0..side * side).map(texel).collect()
}

fn lit() -> (Scene, Vec<IlluminationMap>) {
    let maps = vec![floor_map(0, SIZE as usize, SIZE as usize, ramp(SIZE, -8.0, 0.25))];
    (floor_scene(diffuse(LinearSrgb::WHITE)), maps)
}

/// How far bytes are apart: the most and in the mean.
fn apart(a: &[u8], b: &[u8]) -> (u8, f64) {
    assert_eq!(a.len(), b.len());
    let off = || a.iter().zip(b).map(|(a, b)| a.abs_diff(*b));
    let sum: u64 = off().map(u64::from).sum();
    (off().max().unwrap_or(0), sum as f64 / a.len() as f64)
}

#[test]
fn every_target_shows_what_the_cpu_shows() {
    let (Some(gpu), (scene, maps)) = (gpu(), lit()) else {
        return;
    };
    let formats = [FORMAT, wgpu::TextureFormat::Rgba8UnormSrgb];
    let mut rigs = formats.map(|format| Rig::with_format(gpu, &scene, &maps, format, 1));
    let picture = rigs[0].picture(&from_above(SIZE));
    let mut brightest = 0;
    for tone_map in ToneMap::ALL {
        for exposure_stops in [-3.0, 0.0, 2.5] {
            let view = View {
                exposure_stops,
                tone_map,
                ..from_above(SIZE)
            };
            let expected = display_rgba8(&picture, exposure_stops, tone_map);
            for rig in &mut rigs {
                // The two round at different places: half floats before, bytes after. Never more than one code.
                let (most, mean) = apart(&rig.drawn(&view), &expected);
                assert!(most <= 1 && mean < 0.1, "{tone_map:?}: {most}, mean {mean}");
            }
            brightest = brightest.max(expected.chunks(4).map(|rgba| rgba[0]).max().unwrap_or(0));
        }
    }
    assert!(brightest >= 250, "the ramp reaches white: {brightest}");
}

#[test]
fn white_is_balanced_as_on_the_cpu() {
    let (scene, maps) = lit();
    let mut rig = or_skip!(Rig::new(&scene, &maps));
    let view = View {
        tone_map: ToneMap::AgX,
        ..from_above(SIZE)
    };
    let picture = rig.picture(&view);
    let as_it_is = display_rgba8(&picture, 0.0, ToneMap::AgX);
    for white in ["2856", "9000K", "0.38,0.42"] {
        let matrix = white.parse::<WhiteBalance>().expect("a white").matrix(&scene);
        let expected = display_rgba8(&picture.clone().white_balanced(&matrix), 0.0, ToneMap::AgX);
        rig.renderer.set_white_balance(rig.gpu, &matrix);
        let most = apart(&rig.drawn(&view), &expected).0;
        assert!(most <= 1, "{white}: {most}");
        assert!(apart(&as_it_is, &expected).0 > 8, "{white}");
    }
}
