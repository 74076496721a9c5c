//! What the picture shows in place of light, on which scale, at which exposure, and what it is compared with; maps as flat
//! pictures, and what they show in false colours.

use nephroid::illumination::difference::SignedMap;
use nephroid::illumination::difference_colours;
use nephroid::optics::spectrum::{Hue, Xyz, dominant, xyz_bar};
use nephroid::viewer::comparison_view::SavedMaps;
use nephroid::viewer::exposure::AutoExposure;
use nephroid::viewer::false_colours::{
    RANGE_NM, difference_maps, error_colour, error_maps, has_errors, wavelength_colour, wavelength_maps,
};
use nephroid::viewer::flat_map::{MapCrop, ShownPixels, show};
use nephroid::viewer::views::{IrradianceUnit, MapSurvey, ScaleChoice};

use super::fixtures::map;
use super::headless::Gesture::{Check, Choose, Radio};
use super::*;

/// Two texels over 1 and 3 m².
fn two_texels(object: usize, irradiance: [[f32; 3]; 2]) -> IlluminationMap {
    caustic(chart(object, 2, 1, vec![1.0, 3.0]), irradiance.to_vec())
}

fn survey(peak_w_m2: f64, faults: usize) -> MapSurvey {
    MapSurvey {
        peak_w_m2,
        faults,
        ..MapSurvey::default()
    }
}

fn panel() -> Headless {
    Headless::new(BakeSettings::splat())
}

#[test]
fn survey_tells_peak_density_and_faults() {
    let good = two_texels(0, [[4.0; 3], [2.0, 0.0, 0.0]]);
    let bad = two_texels(1, [[f32::NAN, 9.0, 9.0], [0.0, f32::INFINITY, 0.0]]);
    for (maps, faults) in [(vec![good.clone()], 0), (vec![good, bad], 2)] {
        let survey = MapSurvey::of(&maps);
        assert_eq!(survey.faults, faults);
        // Faults are no light.
        near(survey.peak_w_m2, 4.0, 1e-6, "peak");
        // Two texels on 4 m².
        let density = survey.texels_per_m.expect("there is a map");
        near(density, [0.5_f64.sqrt(); 2], 1e-12, "density");
    }
}

#[test]
fn scale_follows_the_maps_until_typed() {
    let survey = survey(43.0, 0);
    let mut choice = ScaleChoice::default();
    let scale = survey.scale(Quantity::Irradiance, &choice);
    assert!(scale.is_logarithmic && scale.high == 50.0 && (scale.low - 0.005).abs() < 1e-12);
    let dark = MapSurvey::default().scale(Quantity::Irradiance, &choice);
    assert!(dark.low > 0.0 && dark.high > dark.low);
    choice.is_logarithmic = false;
    for (is_automatic, ends) in [(true, [0.0, 50.0]), (false, [0.5, 2.0])] {
        (choice.is_automatic, choice.typed_w_m2) = (is_automatic, [0.5, 2.0]);
        let scale = survey.scale(Quantity::Irradiance, &choice);
        assert_eq!([scale.low, scale.high], ends);
    }
}

#[test]
fn irradiance_has_a_unit_and_counts_faults() {
    let mut panel = panel();
    panel.model.survey = survey(2.0, 0);
    assert!(!panel.says("From, to"), "it belongs to the irradiance");
    panel.make(Choose("View", "irradiance"));
    assert_eq!(panel.model.choices.display.quantity, Quantity::Irradiance);
    panel.assert_says(&[" to 2 W/m²"]);
    panel.make(Radio("lx"));
    assert_eq!(panel.model.choices.display.scale.unit, IrradianceUnit::Lux);
    // 683 times 2.
    panel.assert_says(&[" to 1366 lx"]);
    panel.make(Check("auto"));
    assert!(!panel.model.choices.display.scale.is_automatic && !panel.says("magenta."));
    panel.tell(|model| model.survey = survey(0.0, 3));
    panel.assert_says(&["3 texels without a finite value"]);
}

#[test]
fn reference_tells_its_relative_rmse() {
    let panel = panel();
    let before = [two_texels(0, [[2.0; 3], [2.0; 3]])];
    let mut reference = SavedMaps::kept(panel.model.scene(), &before).expect("there are maps");
    reference.compare(&before);
    assert_eq!(reference.relative_rmse, Ok(0.0));
    // Off by 1 W/m² on a quarter of the area: √(1/4) over a mean of 2.
    reference.compare(&[two_texels(0, [[3.0; 3], [2.0; 3]])]);
    near(
        reference.relative_rmse.clone().expect("it is lit"),
        0.25,
        1e-6,
        "RMSE",
    );
    says(reference.in_words(), " 25 %");
    assert!(SavedMaps::kept(panel.model.scene(), &[]).is_err());
}

/// A texel's display codes, to the rounding of one code.
fn assert_shows(map: &IlluminationMap, texel: usize, codes: [u8; 3]) {
    let found = map.total()[texel].map(f64::from);
    near(found, codes.map(LinearSrgb::decode_channel), 0.01, texel);
}

#[test]
fn errors_show_relative_to_the_mean() {
    // Texels of 4 and 2 W/m² over 1 and 3 m²: the mean is 2.5 W/m².
    let without = caustic(chart(0, 2, 1, vec![1.0, 3.0]), vec![[4.0; 3], [2.0; 3]]);
    let with = with(without.clone(), |it| it.error = Some(vec![0.25, 0.025]));
    assert!(!has_errors(std::slice::from_ref(&without)));
    let maps = [without, with];
    assert!(has_errors(&maps));
    let shown = error_maps(&maps);
    assert_eq!(shown.len(), 1, "a map without an error is left out");
    assert!(Arc::ptr_eq(&shown[0].chart, &maps[1].chart));
    for (texel, relative) in [(0, 0.1), (1, 0.01)] {
        assert_shows(&shown[0], texel, error_colour(relative));
    }
}

#[test]
fn differences_show_relative_to_the_mean() {
    let chart = chart(0, 3, 1, vec![1.0]);
    let shown = |mean_w_m2| {
        let (chart, irradiance) = (Arc::clone(&chart), vec![1.0, -0.1, 0.0]);
        let maps = vec![SignedMap {
            chart,
            irradiance,
            mean_w_m2,
        }];
        let (with_w, without_w, relative_rmse) = (6.0, 5.1, Some(0.3));
        difference_maps(&Difference {
            maps,
            with_w,
            without_w,
            relative_rmse,
        })
    };
    assert!(Arc::ptr_eq(&shown(2.0)[0].chart, &chart));
    for (texel, relative) in [0.5, -0.05, 0.0].into_iter().enumerate() {
        assert_shows(&shown(2.0)[0], texel, difference_colours::colour(relative));
    }
    // Without light nothing has a relative size.
    let none = difference_colours::colour(0.0).map(|code| LinearSrgb::decode_channel(code) as f32);
    assert_eq!(shown(0.0)[0].total(), [none; 3]);
}

/// Single wavelengths are their own, however much white is mixed in. Of the primaries: Lindbloom, "RGB Working Space
/// Information".
#[test]
fn dominant_wavelengths_are_those_published() {
    let pure = |nm| Xyz::from(xyz_bar(Nanometres(nm))).to_linear_srgb();
    let mut rows = vec![
        (LinearSrgb::from([1.0, 0.0, 0.0]), 611.4, 0.3),
        (LinearSrgb::from([0.0, 1.0, 0.0]), 549.1, 0.3),
        (LinearSrgb::from([0.0, 0.0, 1.0]), 464.2, 0.3),
    ];
    for nm in (400..=690).step_by(10).map(f64::from) {
        let bright = pure(nm) * pure(nm).luminance().recip();
        rows.extend([0.0, 0.1, 1.0].map(|white| (bright + LinearSrgb::WHITE * white, nm, 0.1)));
    }
    for (colour, nm, tolerance) in rows {
        let Some(Hue::Spectral(found)) = dominant(colour) else {
            panic!("{colour:?}")
        };
        near(found.0, nm, tolerance, colour);
    }
    assert_eq!(dominant(LinearSrgb::from([1.0, 0.0, 1.0])), Some(Hue::Purple));
    assert_eq!(dominant(LinearSrgb::WHITE * 7.0), Some(Hue::White));
    assert_eq!(dominant(LinearSrgb::BLACK), None);
}

#[test]
fn texels_show_their_wavelength() {
    let pure = Xyz::from(xyz_bar(Nanometres(530.0))).to_linear_srgb();
    let [green, faint] = [1.0, 1e-5].map(|strength| (pure * strength).to_array().map(|c| c as f32));
    let texels = vec![green, faint, [0.5; 3], [f32::NAN; 3]];
    let shown = wavelength_maps(&[caustic(chart(0, 4, 1, vec![1.0]), texels)])[0].total();
    let expected = wavelength_colour(Nanometres(530.0)).to_array();
    near(shown[0].map(f64::from), expected, 1e-3, "530 nm");
    assert_eq!(shown[1], [0.0; 3], "dark texels are black");
    assert!(shown[2][0] > 0.0 && shown[2] == [shown[2][0]; 3], "{shown:?}");
    assert!(shown[3][0].is_nan());
    // The legend's colours can be shown, and differ along it.
    let (low, high) = RANGE_NM;
    let colour = |step| wavelength_colour(Nanometres(low + (high - low) * f64::from(step) / 12.0));
    for step in 0..=12 {
        let is_shown = |channel: f64| (0.0..=1.0 + 1e-12).contains(&channel);
        assert!(colour(step).to_array().into_iter().all(is_shown));
        assert!(!(1..10).contains(&step) || colour(step) != colour(step + 1));
    }
}

/// Brightness [0, 255] and opacity of a pixel.
fn pixel(shown: &ShownPixels, x: usize, y: usize) -> (u8, u8) {
    let at = 4 * (y * shown.size[0] + x);
    (shown.rgba[at + 1], shown.rgba[at + 3])
}

#[test]
fn a_pixel_of_many_texels_is_their_mean() {
    let part = |texels_per_pixel| MapCrop {
        left: 0.0,
        top: 0.0,
        texels_per_pixel,
    };
    // Texels of 0 and 3 W/m², and a map of their mean.
    let mut mean = map();
    for layer in &mut mean.layers {
        for pair in layer.irradiance.chunks_mut(2) {
            pair.fill([0.5 * (pair[0][0] + pair[1][0]); 3]);
        }
    }
    let stops = -3.0;
    let coarse = show(&map(), part(2.0), [2, 1], stops);
    let fine = show(&mean, part(1.0), [4, 2], stops);
    for x in 0..2 {
        let [found, expected] = [pixel(&coarse, x, 0).0, pixel(&fine, 2 * x, 0).0];
        assert!(found.abs_diff(expected) <= 1, "{found} instead of {expected}");
    }
    assert!(pixel(&coarse, 1, 0).0 > pixel(&coarse, 0, 0).0);
}

const FRAME: Duration = Duration::from_millis(50);

/// Shows so many frames from an exposure on.
fn frames(exposure: &mut AutoExposure, count: usize, from: f64) -> Vec<f64> {
    let mut shown = from;
    let frames = (0..count).map(|_| {
        shown = exposure.next(shown, FRAME);
        shown
    });
    frames.collect()
}

#[test]
fn better_maps_move_it_smoothly_and_by_half_a_stop_at_most() {
    let mut exposure = AutoExposure::new(true);
    assert!(exposure.wants(false, 0.0));
    assert_eq!(exposure.take(3.0, 0.0), 3.0);
    assert!(!exposure.wants(false, 3.0) && exposure.wants(true, 3.0));
    // Next to nothing is nothing.
    exposure.take(3.05, 3.0);
    assert!(!exposure.is_moving(3.0));
    for (suits, goal) in [(3.3, 3.3), (4.5, 3.5), (1.5, 2.5), (-1.0, -1.0)] {
        let from = exposure.goal();
        exposure.take(suits, from);
        let shown = frames(&mut exposure, 60, from);
        assert_eq!(shown.last(), Some(&goal), "{suits}");
        assert!(!exposure.is_moving(goal));
        let mut last = from;
        for stops in shown {
            assert!((goal - stops).abs() <= (goal - last).abs(), "{suits}");
            assert!((stops - last).abs() <= 0.25 * (goal - from).abs(), "{suits}");
            last = stops;
        }
    }
}

#[test]
fn somebody_elses_is_left_alone_until_it_is_asked() {
    let mut exposure = AutoExposure::new(false);
    assert!(!exposure.wants(true, 1.0));
    assert_eq!(exposure.next(1.0, FRAME), 1.0);
    exposure.ask();
    assert!(exposure.wants(false, 1.0));
    exposure.take(2.0, 1.0);
    exposure.take(2.4, 2.0);
    assert!(exposure.is_moving(2.0));
    // By hand, in the middle of its way.
    assert!(!exposure.is_moving(7.0) && !exposure.wants(true, 7.0));
    assert_eq!(exposure.next(7.0, FRAME), 7.0);
}
