//! Tone mapping, exposure and white balance on the CPU.

use nephroid::eye_pass::tone_mapping::display_rgba8;
use nephroid::eye_pass::{ToneMap, WhiteBalance};
use nephroid::optics::spectrum::xyz::{IDENTITY, transformed};

use crate::prelude::*;
use support::meshes::floor;
use support::scenes::{diffuse, point_light, scene, sun};

fn picture(radiance: Vec<[f32; 3]>) -> Picture {
    Picture {
        width: radiance.len() as u32,
        height: 1,
        radiance,
    }
}

/// 0.5 of linear light is code 188, a quarter 137, one 255.
#[test]
fn bytes_keep_the_order_of_channels() {
    let shown = display_rgba8(&picture(vec![[0.5, 0.25, 1.0]]), 0.0, ToneMap::None);
    assert_eq!(shown, [188, 137, 255, 255]);
}

#[test]
fn auto_exposure_finds_middle_grey() {
    let stops = |parts: &[(f32, usize)]| {
        let radiance = parts.iter().flat_map(|&(value, count)| vec![[value; 3]; count]);
        picture(radiance.collect()).auto_exposure_stops()
    };
    for (parts, expected, tolerance) in [
        // 0.18 / 0.045 = 4: two stops, and one more, since nothing is light. Black does not count.
        (vec![(0.045, 10)], 3.0, 1e-6),
        (vec![(0.045, 10), (0.0, 90)], 3.0, 1e-6),
        // A fifth is light: 0.6 / 0.15 = 4.
        (vec![(0.045, 80), (0.15, 20)], 2.0, 1e-6),
        (vec![(0.0, 4)], 0.0, 0.0),
        (vec![], 0.0, 0.0),
        // A quarter of the picture is 64 times as bright as the rest: it stays below white. A lone lamp does not count.
        (vec![(1.0, 75), (64.0, 25)], -6.0, 1e-6),
        (vec![(0.18, 999), (10.0, 1)], 1.0, 0.01),
    ] {
        let found = stops(&parts);
        assert!((found - expected).abs() <= tolerance, "{parts:?}: {found}");
    }
}

fn of_colour(mut light: Light, colour: LinearSrgb) -> Light {
    light.colour = colour;
    light
}

fn under(lights: Vec<Light>) -> Scene {
    scene(vec![(floor(1.0, 0.0), diffuse(0.5))], lights)
}

fn assert_grey(colour: LinearSrgb, of: LinearSrgb) {
    for channel in colour.to_array() {
        assert_close(channel, of.luminance(), 1e-9, "a channel of grey");
    }
}

#[test]
fn light_of_lamps_becomes_white() {
    let (warm, cold) = (rgb(1.0, 0.6, 0.3), rgb(0.5, 0.7, 1.0));
    let lamp = |height_m: f64, colour| of_colour(point_light(DVec3::Y * height_m, 5.0), colour);
    let matrix = WhiteBalance::Lamps.matrix(&under(vec![lamp(3.0, warm)]));
    assert_grey(transformed(&matrix, warm), warm);

    // A sun counts by its irradiance, a point light by the square of its distance from the scene's middle.
    let sun = of_colour(sun(DVec3::NEG_Y, 2.0), cold);
    let matrix = WhiteBalance::Lamps.matrix(&under(vec![lamp(4.0, warm), sun]));
    let together = cold * 2.0 + warm * (5.0 / 16.0);
    assert_grey(transformed(&matrix, together), together);
}

#[test]
fn without_a_light_colours_stay() {
    let dark = under(Vec::new());
    for white in [WhiteBalance::None, WhiteBalance::Lamps] {
        assert_eq!(white.matrix(&dark), IDENTITY, "{white}");
    }
    // Daylight is white already.
    let daylight = WhiteBalance::Kelvin(6504.0).matrix(&dark);
    for (found, expected) in daylight.into_iter().zip(IDENTITY) {
        near(found, expected, 2e-3, "daylight");
    }
}

#[test]
fn whites_are_read_as_they_are_written() {
    for (text, white) in [
        ("none", WhiteBalance::None),
        ("lamps", WhiteBalance::Lamps),
        ("5003 K", WhiteBalance::Kelvin(5003.0)),
        ("0.3457,0.3585", WhiteBalance::Chromaticity([0.3457, 0.3585])),
    ] {
        assert_eq!(text.parse(), Ok(white), "{text}");
        assert_eq!(white.to_string(), text);
    }
    assert_eq!("2856".parse(), Ok(WhiteBalance::Kelvin(2856.0)));
    for wrong in [
        "", "auto", "999", "25001", "NaN", "0.5,0.5", "0,0.3", "0.3,", "-1,1",
    ] {
        says(wrong.parse::<WhiteBalance>().expect_err(wrong), "kelvin");
    }
}
