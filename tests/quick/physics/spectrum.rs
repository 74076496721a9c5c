//! Lamps, their colours, and the wavelengths to follow.

use nephroid::optics::spectrum::csv::read_lamp;
use nephroid::optics::spectrum::temperature::{correlated_temperature, white_of_kelvin};
use nephroid::optics::spectrum::xyz::{IDENTITY, to_display_gamut, transformed, white_balance};
use nephroid::optics::spectrum::{Spectrum, WavelengthSampler, Xyz, illuminant, illuminants, xyz_bar};
use nephroid::optics::wavelength::VISIBLE;

use super::primaries;
use crate::prelude::*;

fn lamp(name: &str) -> Spectrum {
    illuminant(name).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn all_lamps() -> impl Iterator<Item = (String, Spectrum)> {
    let numbered = ["blackbody:2700", "blackbody:25000", "line:589.3", "laser:532"];
    illuminants::names()
        .chain(numbered)
        .map(|name| (name.to_owned(), lamp(name)))
}

#[test]
fn observer_is_that_of_1931() {
    // CIE 018:2019: peaks, and the sums of its columns.
    assert_eq!(xyz_bar(Nanometres(555.0)), [0.5120501, 1.0, 0.005749999]);
    assert_eq!(xyz_bar(Nanometres(360.0)), [0.0001299, 0.000003917, 0.0006061]);
    assert_eq!(xyz_bar(Nanometres(830.0)), [0.000001251141, 0.00000045181, 0.0]);
    let mut sums = [0.0; 3];
    for nm in 360..=830 {
        for (sum, value) in sums.iter_mut().zip(xyz_bar(Nanometres(f64::from(nm)))) {
            *sum += value;
        }
    }
    near(sums, [106.865469, 106.856917, 106.892251], 1e-6, "sums");
    for outside in [0.0, 359.999, 830.001, f64::NAN, f64::INFINITY] {
        assert_eq!(xyz_bar(Nanometres(outside)), [0.0; 3]);
    }
    let [below, between, above] = [600.0, 600.25, 601.0].map(|nm| xyz_bar(Nanometres(nm))[0]);
    near(between, 0.75 * below + 0.25 * above, 1e-15, "between");
}

/// CIE 15:2018: chromaticities and correlated temperatures [K]; those of fluorescent lamps are rounded to tens.
#[test]
fn lamps_are_as_cie_publishes() {
    for (name, x, y, kelvin, tolerance) in [
        ("D65", 0.3127, 0.3290, 6504.0, 3.0),
        ("A", 0.4476, 0.4074, 2856.0, 1.0),
        ("D50", 0.3457, 0.3585, 5003.0, 3.0),
        ("fl2", 0.3721, 0.3751, 4230.0, 10.0),
        ("FL7", 0.3129, 0.3292, 6500.0, 10.0),
        ("FL11", 0.3805, 0.3769, 4000.0, 10.0),
        ("LED-B1", 0.4560, 0.4078, 2733.0, 2.0),
        ("LED-B2", 0.4357, 0.4012, 2998.0, 2.0),
        ("ledb3", 0.3756, 0.3723, 4103.0, 2.0),
        ("LED-B4", 0.3422, 0.3502, 5109.0, 2.0),
        ("LED-B5", 0.3118, 0.3236, 6598.0, 2.0),
        ("LED-BH1", 0.4474, 0.4066, 2851.0, 2.0),
        ("LED RGB1", 0.4557, 0.4211, 2840.0, 2.0),
        ("LED-V1", 0.4548, 0.4044, 2724.0, 2.0),
        ("LED-V2", 0.3781, 0.3775, 4070.0, 2.0),
    ] {
        let colour = lamp(name).xyz();
        near(colour.chromaticity().expect("lamps shine"), [x, y], 1e-4, name);
        let found = correlated_temperature(colour).expect("near the black body");
        near(found.kelvin, kelvin, tolerance, name);
    }
    near(
        lamp("E").xyz().chromaticity().expect("shines"),
        [1.0 / 3.0; 2],
        1e-4,
        "E",
    );
    // A black body is as hot as itself.
    for (kelvin, tolerance) in [(2700.0, 0.1), (500.0, 0.1), (25_000.0, 1.0)] {
        let body = lamp(&format!("blackbody:{kelvin}"));
        let found = correlated_temperature(body.xyz()).expect("it is one");
        near(found.kelvin, kelvin, tolerance, "black body");
    }
    for none in [lamp("line:532").xyz(), Xyz::default()] {
        assert_eq!(correlated_temperature(none), None);
    }
}

#[test]
fn every_lamp_is_one_luminous_equivalent_watt() {
    for (name, lamp) in all_lamps() {
        near(lamp.xyz().y, 1.0, 1e-12, &name);
        near(lamp.luminous_flux_lm(), 683.0, 1e-9, &name);
        // The eye makes most of 555 nm.
        assert!(lamp.radiant() > 1.0 - 1e-9, "{name}: {} W", lamp.radiant());
        let bright = lamp.to_luminous_equivalent(1000.0 / 683.0).expect("a lamp");
        near(bright.luminous_flux_lm(), 1000.0, 1e-9, &name);
        near(bright.radiant() / lamp.radiant(), 1000.0 / 683.0, 1e-9, &name);
    }
    // A triangle 1 nm to each side: the efficiency falls by 0.02 % within it. That of sodium light is 683 ȳ(589.3).
    for (nm, tolerance) in [(555.0, 1e-4), (589.3, 1e-3)] {
        let line = lamp(&format!("line:{nm}"));
        let expected = 683.0 * xyz_bar(Nanometres(nm))[1];
        near(
            line.luminous_flux_lm() / line.radiant() / expected,
            1.0,
            tolerance,
            nm,
        );
    }
    // In any unit.
    let lamp = |scale: f64| {
        let rows = [(400.0, 0.25), (550.0, 1.0), (700.0, 0.5)];
        let rows = rows.map(|(nm, value)| (Nanometres(nm), value * scale)).to_vec();
        let lamp = Spectrum::new(rows).expect("a table").to_luminous_equivalent(2.0);
        lamp.expect("a lamp")
    };
    let usual = lamp(1.0);
    for scale in [1e-305, 1e-30, 1e30, 1e305, 1.7e308] {
        let scaled = lamp(scale);
        near(scaled.xyz().y, 2.0, 1e-12, scale);
        for nm in [400.0, 475.0, 550.0, 700.0].map(Nanometres) {
            assert_close(scaled.at(nm), usual.at(nm), 1e-12, "shape");
        }
    }
}

#[test]
fn parts_of_a_spectrum_add_up_to_it() {
    for (name, lamp) in all_lamps() {
        let whole = lamp.xyz();
        for count in [1, 4, 7, 13] {
            let bands = WavelengthSampler::for_lamp(&lamp).expect("a lamp").bands(count);
            let sum = bands.iter().map(|band| lamp.xyz_within(band.range.clone()));
            let sum = sum.fold(Xyz::default(), |a, b| a + b);
            for (sum, whole) in <[f64; 3]>::from(sum).into_iter().zip(<[f64; 3]>::from(whole)) {
                near(sum, whole, 1e-12 * whole.max(1.0), &name);
            }
        }
    }
}

#[test]
fn integrals_of_products_are_exact() {
    let [at, to] = [(400.3, 0.3), (410.7, 10.7)].map(|(nm, value)| (Nanometres(nm), value));
    // Light λ − 400 from 400.3 to 410.7 nm, seen through a factor λ²: a cubic, whose integral is known.
    let light = Spectrum::new(vec![at, to]).expect("a spectrum");
    let found = light.integral_times(VISIBLE, |Nanometres(nm)| [nm * nm])[0];
    let integral = |x: f64| x.powi(4) / 4.0 - 400.0 * x.powi(3) / 3.0;
    near(found / (integral(410.7) - integral(400.3)), 1.0, 1e-9, "integral");
    assert_eq!([400.2, 410.7].map(|nm| light.at(Nanometres(nm))), [0.0, 10.7]);
    near(light.at(Nanometres(405.0)), 5.0, 1e-12, "between");
    let part = light.integral_times(Nanometres(402.0)..=Nanometres(403.5), |_| [1.0])[0];
    near(part, 1.5 * 2.75, 1e-10, "part");
    // Infrared is not visible flux.
    let rows = [300.0, 2500.0].map(|nm| (Nanometres(nm), 1.0));
    let wide = Spectrum::new(rows.into()).expect("a spectrum");
    near(wide.radiant(), 470.0, 1e-9, "radiant");
    near(
        wide.xyz().chromaticity().expect("white"),
        [1.0 / 3.0; 2],
        1e-4,
        "white",
    );
}

#[test]
fn srgb_and_xyz_are_each_others_inverse() {
    // IEC 61966-2-1: where the primaries and white lie.
    let places = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];
    for (colour, place) in primaries().into_iter().chain([LinearSrgb::WHITE]).zip(places) {
        near(
            Xyz::from(colour).chromaticity().expect("a colour"),
            place,
            1e-12,
            colour,
        );
    }
    near(Xyz::from(LinearSrgb::WHITE).y, 1.0, 1e-15, "white");
    proptest!(support::law(4096), |(colour in prop::array::uniform3(-1.0..2.0))| {
        let colour = LinearSrgb::from(colour);
        let xyz = Xyz::from(colour);
        near(xyz.y, colour.luminance(), 1e-12, colour);
        near(xyz.to_linear_srgb(), colour, 1e-12, colour);
        near(xyz.to_linear_srgb().luminance(), xyz.y, 1e-12, colour);
    });
}

#[test]
fn spectral_colours_keep_their_negative_channels() {
    let cyan = lamp("line:500").xyz().to_linear_srgb();
    assert!(cyan.r < -0.1 && cyan.g > 0.0, "{cyan:?}");
    let shown = to_display_gamut(cyan);
    assert!(shown.r >= 0.0 && shown.g >= 0.0 && shown.b >= 0.0);
    near(shown.luminance(), cyan.luminance(), 1e-12, cyan);
    // Green leads the channels of 500 nm before and after.
    assert!(shown.g > shown.b && shown.b > shown.r, "{shown:?}");
    let inside = rgb(0.2, 5.0, 0.0);
    assert_eq!(to_display_gamut(inside), inside);
    assert_eq!(to_display_gamut(rgb(-1.0, 0.1, 0.1)), LinearSrgb::BLACK);
}

#[test]
fn white_balance_makes_a_lamp_white() {
    for (name, lamp) in all_lamps() {
        let colour = lamp.xyz();
        let Some(matrix) = white_balance(colour) else {
            // Single wavelengths at the ends give some cones nothing.
            assert!(name.contains(':'), "{name}");
            continue;
        };
        near(
            transformed(&matrix, colour.to_linear_srgb()),
            LinearSrgb::WHITE,
            1e-9,
            &name,
        );
    }
    let same = white_balance(Xyz::from(LinearSrgb::WHITE)).expect("white");
    for (row, expected) in same.into_iter().zip(IDENTITY) {
        near(row, expected, 1e-12, "white is white");
    }
    assert!(white_balance(Xyz::default()).is_none());
    // CIE 15:2018, tables of the D illuminants, and illuminant A by its temperature.
    for (kelvin, x, y) in [
        (2856.0, 0.4476, 0.4074),
        (5003.0, 0.3457, 0.3585),
        (5503.0, 0.3324, 0.3474),
        (6504.0, 0.3127, 0.3290),
        (7504.0, 0.2990, 0.3149),
    ] {
        let white = white_of_kelvin(kelvin);
        near(white.chromaticity().expect("light"), [x, y], 3e-4, kelvin);
        near(white.y, 1.0, 1e-12, kelvin);
    }
}

#[test]
fn wavelengths_come_as_they_matter() {
    for (name, lamp) in all_lamps() {
        let sampler = WavelengthSampler::for_lamp(&lamp).expect("a lamp");
        let (mut luminous, mut before) = (0.0, 0.0);
        const COUNT: u32 = 20_000;
        for i in 0..COUNT {
            let u = (f64::from(i) + 0.5) / f64::from(COUNT);
            let (wavelength, density) = sampler.sample(u);
            let is_next = VISIBLE.contains(&wavelength) && wavelength.0 >= before;
            assert!(is_next, "{name}: {wavelength:?}");
            near(sampler.cumulative(wavelength), u, 1e-9, &name);
            near(sampler.density_per_nm(wavelength) / density, 1.0, 1e-6, &name);
            luminous += lamp.at(wavelength) * xyz_bar(wavelength)[1] / density / f64::from(COUNT);
            before = wavelength.0;
        }
        // The estimate by these samples is the flux itself.
        near(luminous, 1.0, 1e-3, &name);
    }
    // For equal energy the density is that of the colour-matching functions, half of it luminous efficiency.
    let sampler = WavelengthSampler::equal_energy();
    let weight = |nm: f64| {
        let [x, y, z] = xyz_bar(Nanometres(nm));
        x + 2.0 * y + z
    };
    let at_555 = sampler.density_per_nm(Nanometres(555.0)) / weight(555.0);
    for nm in [361.0, 400.0, 445.0, 500.0, 650.0, 820.0] {
        near(
            sampler.density_per_nm(Nanometres(nm)) / weight(nm) / at_555,
            1.0,
            1e-12,
            nm,
        );
    }
    assert_eq!(sampler.density_per_nm(Nanometres(359.0)), 0.0);
}

#[test]
fn bands_meet_and_weigh_the_same() {
    let sampler = WavelengthSampler::equal_energy();
    for count in [1, 4, 7, 13, 300] {
        let bands = sampler.bands(count);
        assert_eq!(bands.len(), count);
        let share = |wavelength: &Nanometres| sampler.cumulative(*wavelength);
        for (index, band) in bands.iter().enumerate() {
            assert!(band.range.contains(&band.place));
            let (from, to) = (share(band.range.start()), share(band.range.end()));
            near(to - from, 1.0 / count as f64, 1e-9, (count, index));
            if let Some(next) = bands.get(index + 1) {
                assert_eq!(band.range.end(), next.range.start());
            }
        }
        let ends = [bands[0].range.start().0, bands[count - 1].range.end().0];
        near(ends, [360.0, 830.0], 1e-3, count);
    }
}

#[test]
fn the_rainbow_has_seven_colours_in_order() {
    let bands = WavelengthSampler::equal_energy().rainbow_seven();
    let places: Vec<f64> = bands.iter().map(|band| band.place.0).collect();
    assert!(bands.len() == 7 && places.is_sorted(), "{places:?}");
    let colour = |index: usize| {
        let Nanometres(nm) = bands[index].place;
        lamp(&format!("line:{nm}")).xyz().to_linear_srgb()
    };
    // Which channel leads: violet to blue, green, then yellow's equal parts, orange and red.
    let is_blue = |colour: LinearSrgb| colour.b > colour.r.max(colour.g);
    assert!([0, 1, 2].map(colour).into_iter().all(is_blue));
    assert!(colour(3).g > colour(3).r.max(colour(3).b));
    assert!((colour(4).r / colour(4).g).ln().abs() < 1.0, "{:?}", colour(4));
    assert!(
        [5, 6]
            .map(colour)
            .into_iter()
            .all(|red| red.r > 2.0 * red.g.abs())
    );
    // A red laser has but one of them.
    let laser = WavelengthSampler::for_lamp(&lamp("laser:650")).expect("a lamp");
    assert_eq!(laser.rainbow_seven().len(), 1);
}

#[test]
fn lamps_are_found_by_name() {
    assert_eq!(lamp(" led-b1 "), lamp("LEDB1"));
    assert_eq!(lamp("LASER: 532"), lamp("line:532"));
    // Each goes by the name that the list has, and keeps it however bright it is made.
    let called = |name: &str| {
        let twice = lamp(name).to_luminous_equivalent(2.0).expect("a lamp");
        twice.name().map(str::to_owned)
    };
    for (asked, known) in [
        (" led-b1 ", "LED-B1"),
        ("d65", "D65"),
        ("a", "A"),
        ("e", "E"),
        ("Laser: 532", "line:532"),
        ("Planck:2856.0", "blackbody:2856"),
    ] {
        assert_eq!(called(asked).as_deref(), Some(known));
    }
    assert_eq!(read_lamp("400,1\n500,2\n").expect("a lamp").name(), None);
    let refusal = |name: &str| illuminant(name).expect_err("no such lamp");
    says(refusal("D56"), "D65 | D50");
    says(refusal("fl12"), "FL11");
    for wrong in ["", "candle", "candle:3", "lamp:"] {
        says(refusal(wrong), "the nearest names are");
    }
    for wrong in "blackbody:499 blackbody:25001 blackbody:NaN blackbody: line:360 line:x".split(' ') {
        says(refusal(wrong), "is not a number from");
    }
}

#[test]
fn csv_files_are_read_as_people_write_them() {
    let plain = read_lamp("400,1\n500,2.5\n600,0\n").expect("a lamp");
    for same in [
        "wavelength_nm,value\n400,1\n500,2.5\n600,0",
        "# a lamp of mine\n\n nm ; W/nm\n400;1\n500;2.5 # peak\n600;0\n",
        "400\t1\r\n500\t2.5\r\n600\t0\r\n",
        "\u{feff}400, 1.0, spare\n5e2, 2.5, x\n600, 0, \n",
    ] {
        assert_eq!(read_lamp(same), Ok(plain.clone()), "{same}");
    }
}

#[test]
fn csv_faults_name_their_line() {
    let no_light = "it has no light between 360 and 830 nm";
    for (text, expected) in [
        (
            "400,1\nfive hundred,2\n",
            "line 2: `five hundred,2` is not a wavelength and a value",
        ),
        (
            "nm,W\nnm,W\n400,1\n500,1\n",
            "line 2: `nm,W` is not a wavelength and a value",
        ),
        ("# mine\n400,1\n500,NaN\n", "line 3: NaN is not a finite number"),
        ("400,1\n500,inf\n", "line 2: inf is not a finite number"),
        ("400,1\n500,-2\n", "line 2: -2 is negative"),
        ("400,1\n\n400,2\n", "line 3: 400 nm does not come after 400 nm"),
        ("400,1\n390,2\n", "line 2: 390 nm does not come after 400 nm"),
        ("400,1\n", "a spectrum of 1 rows says nothing between wavelengths"),
        ("", "a spectrum of 0 rows says nothing between wavelengths"),
        (
            "0.4,1\n0.7,1\n",
            "its wavelengths 0.4 to 0.7 nm lie outside of the visible 360 to 830 nm",
        ),
        ("400,0\n700,0\n", no_light),
        ("300,1\n350,0\n700,0\n", no_light),
    ] {
        let error = read_lamp(text).expect_err(text);
        assert_eq!(error.what, expected);
        assert!(!error.remedy.is_empty());
        assert_eq!(error.at("lamp.csv").location, "lamp.csv");
    }
}
