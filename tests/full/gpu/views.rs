//! Floors of which every pixel is known: what surfaces show instead of their light, and exposure, tone mapping and encoding
//! as on the CPU.

use nephroid::eye_pass::renderer::{Inspected, MapStyle};
use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::eye_pass::{ToneMap, WhiteBalance};
use nephroid::illumination::false_colours::ColourScale;
use strum::VariantArray;

use crate::gpu::rig::{FORMAT, Rig, gpu, or_skip};
use support::floors::{diffuse, floor_map, floor_scene, from_above};
use support::prelude::*;
use support::scenes::middles;

/// Pixels and texels across.
const SIDE: usize = 16;
/// A step of 8-bit display values, and half of one for half floats.
const CODE: f64 = 1.5 / 255.0;

/// Display values of a view of the floor.
fn shown(scene: &Scene, maps: &[IlluminationMap], style: MapStyle, side: usize) -> Option<Vec<[f64; 3]>> {
    let mut rig = Rig::new(scene, maps)?;
    rig.renderer.set_map_style(style);
    let picture = rig.picture(&from_above(side as u32));
    let display = |rgb: &[f32; 3]| rgb.map(|linear| LinearSrgb::encode_channel(f64::from(linear)));
    Some(picture.radiance.iter().map(display).collect())
}

fn inspected(what: Inspected) -> MapStyle {
    inspected_on(what, ColourScale::default())
}

fn inspected_on(what: Inspected, scale: ColourScale) -> MapStyle {
    MapStyle::Inspected { what, scale }
}

fn scale(low: f64, high: f64, is_logarithmic: bool) -> ColourScale {
    ColourScale {
        low,
        high,
        is_logarithmic,
    }
}

fn grey_floor() -> Scene {
    floor_scene(diffuse(LinearSrgb::grey(0.3)))
}

fn even(width: usize, height: usize) -> Vec<IlluminationMap> {
    vec![floor_map(0, width, height, vec![[1.0; 3]; width * height])]
}

fn is_near(found: [f64; 3], expected: [f64; 3]) -> bool {
    found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= CODE)
}

#[track_caller]
fn assert_near(found: &[[f64; 3]], expected: impl Iterator<Item = [f64; 3]>) {
    for (found, expected) in found.iter().zip(expected) {
        assert!(is_near(*found, expected), "{found:?}, not {expected:?}");
    }
}

#[test]
fn irradiance_has_the_colour_of_the_scale() {
    // From 2⁻⁸ to 2⁷ W/m², of changing hue.
    let texels = ramp(SIDE as u32, -8.0, 1.0);
    let maps = [floor_map(0, SIDE, SIDE, texels.clone())];
    for is_logarithmic in [false, true] {
        let scale = scale(0.01, 20.0, is_logarithmic);
        let style = inspected_on(Inspected::Irradiance, scale);
        let found = or_skip!(shown(&grey_floor(), &maps, style, SIDE));
        let luminance = |rgb: &[f32; 3]| LinearSrgb::from(rgb.map(f64::from)).luminance();
        assert_near(&found, texels.iter().map(|rgb| scale.colour(luminance(rgb))));
        assert!(!is_near(found[0], found[SIDE - 1]), "there are colours");
    }
}

#[test]
fn normals_are_those_of_the_mesh() {
    for normal in [DVec3::Y, dvec3(0.6, 0.8, 0.0), dvec3(-0.48, 0.6, -0.64)] {
        let mut scene = grey_floor();
        scene.objects[0].mesh_in_scene_mut().normals = vec![normal; 4];
        // Surfaces have them with and without maps.
        let found = or_skip!(shown(&scene, &[], inspected(Inspected::Normals), SIDE));
        assert_near(&found, std::iter::repeat((0.5 * normal + 0.5).to_array()));
    }
}

#[test]
fn coordinates_run_as_the_floors_do() {
    for what in [Inspected::Uv, Inspected::MapUv] {
        let found = or_skip!(shown(&grey_floor(), &even(4, 4), inspected(what), SIDE));
        assert_near(&found, middles(SIDE).map(|uv| [uv.x, uv.y, 0.0]));
    }
}

#[test]
fn texels_are_squares_counted_by_the_metre() {
    // 8 by 4 texels on a square metre.
    let scale = scale(1.0, 100.0, true);
    let style = inspected_on(Inspected::TexelDensity, scale);
    let found = or_skip!(shown(&grey_floor(), &even(8, 4), style, SIDE));
    assert_near(&found, std::iter::repeat(scale.colour(32.0_f64.sqrt())));
    let squares = shown(&grey_floor(), &even(8, 4), inspected(Inspected::Texels), 8 * SIDE);
    let squares = squares.expect("there is a device");
    // Each is seen by 16 by 32 pixels.
    let of_texel = |column: usize, row: usize| squares[(row * 32 + 3) * 128 + column * 16 + 3][0];
    for (column, row) in (0..7).flat_map(|column| (0..3).map(move |row| (column, row))) {
        let here = of_texel(column, row);
        assert!((here - of_texel(column + 1, row + 1)).abs() < CODE);
        assert!((here - of_texel(column + 1, row)).abs() > 0.2);
        assert!((here - of_texel(column, row + 1)).abs() > 0.2);
    }
}

#[test]
fn what_is_no_number_is_magenta() {
    use Inspected::{Irradiance, MapUv, TexelDensity, Texels};
    let of_maps = |what| inspected_on(what, scale(0.1, 10.0, true));
    let styles = [Irradiance, Texels, TexelDensity, MapUv].map(of_maps);
    for fault in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut texels = vec![[1.0; 3]; SIDE * SIDE];
        let middle = SIDE / 2 * SIDE + SIDE / 2;
        texels[middle][1] = fault;
        let maps = [floor_map(0, SIDE, SIDE, texels)];
        for style in styles.into_iter().chain([MapStyle::Lit, MapStyle::AsItIs]) {
            let found = or_skip!(shown(&grey_floor(), &maps, style, SIDE));
            let is_magenta = |pixel: &usize| is_near(found[*pixel], [1.0, 0.0, 1.0]);
            let magenta: Vec<usize> = (0..found.len()).filter(is_magenta).collect();
            assert_eq!(magenta, [middle], "{fault} in {style:?}");
        }
    }
}

const SIZE: u32 = 64;

/// From black over white to far beyond, of changing hue, by the exponent of the first column [W/m²].
fn ramp(side: u32, first: f64, step: f64) -> Vec<[f32; 3]> {
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
    for &tone_map in ToneMap::VARIANTS {
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

/// A frame, or the mean of several, shows other exposures and tone maps without being drawn anew; another view, or an
/// exposure that half floats may not hold, is left alone.
#[test]
fn exposure_needs_no_new_frame() {
    let (scene, maps) = lit();
    let mut rig = or_skip!(Rig::new(&scene, &maps));
    let shown = |exposure_stops: f64, tone_map: ToneMap| View {
        exposure_stops,
        tone_map,
        ..from_above(SIZE)
    };
    let first = shown(-1.0, ToneMap::Soft);
    assert_eq!(rig.exposed(&first), None, "nothing was drawn");
    rig.drawn(&first);
    for samples in [1, 3] {
        let radiance = rig.renderer.shown_radiance(rig.gpu, &first);
        let radiance = radiance.expect("it is read back");
        for (exposure_stops, tone_map) in [(-1.0, ToneMap::AgX), (2.5, ToneMap::None), (-4.0, ToneMap::Soft)]
        {
            let found = rig.exposed(&shown(exposure_stops, tone_map));
            let expected = display_rgba8(&radiance, exposure_stops, tone_map);
            let (most, mean) = apart(&found.expect("it is the same frame"), &expected);
            assert!(
                most <= 1 && mean < 0.1,
                "{samples}, {tone_map:?}: {most}, mean {mean}"
            );
        }
        if samples == 1 {
            rig.refined(&shown(0.5, ToneMap::Soft));
            rig.refined(&shown(0.0, ToneMap::Soft));
            assert_eq!(rig.renderer.counts().samples, 3, "exposures share a mean");
        }
    }
    assert_eq!(rig.exposed(&shown(3.5, ToneMap::Soft)), None, "too far from -1");
    let mut other = shown(-1.0, ToneMap::Soft);
    other.camera.position.y *= 1.5;
    assert_eq!(rig.exposed(&other), None, "another view");
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
        rig.renderer.set_white_balance(&matrix);
        let most = apart(&rig.drawn(&view), &expected).0;
        assert!(most <= 1, "{white}: {most}");
        assert!(apart(&as_it_is, &expected).0 > 8, "{white}");
    }
}
