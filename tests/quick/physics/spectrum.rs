//! Lamps, their colours, and the wavelengths to follow.

use nephroid::optics::spectrum::csv::read_lamp;
use nephroid::optics::spectrum::temperature::{correlated_temperature, white_of_kelvin};
use nephroid::optics::spectrum::xyz::{to_display_gamut, transformed, white_balance};
use nephroid::optics::spectrum::{
    Spectrum, SpectrumError, WavelengthSampler, Xyz, illuminant, illuminants, xyz_bar,
};
use nephroid::optics::wavelength::VISIBLE;
use nephroid::optics::{LinearSrgb, Nanometres};
use proptest::prelude::*;

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
fn the_observer_is_the_one_of_1931() {
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
    for (sum, published) in sums.iter().zip([106.865469, 106.856917, 106.892251]) {
        assert!((sum - published).abs() < 1e-6, "{sum} for {published}");
    }
    for outside in [0.0, 359.999, 830.001, f64::NAN, f64::INFINITY] {
        assert_eq!(xyz_bar(Nanometres(outside)), [0.0; 3]);
    }
    let [below, between, above] = [600.0, 600.25, 601.0].map(|nm| xyz_bar(Nanometres(nm))[0]);
    assert!((between - (0.75 * below + 0.25 * above)).abs() < 1e-15);
}

#[test]
fn lamps_have_the_chromaticities_that_cie_publishes() {
    // CIE 15:2018.
    for (name, [x, y]) in [
        ("E", [1.0 / 3.0, 1.0 / 3.0]),
        ("D65", [0.3127, 0.3290]),
        ("A", [0.4476, 0.4074]),
        ("D50", [0.3457, 0.3585]),
        ("fl2", [0.3721, 0.3751]),
        ("FL7", [0.3129, 0.3292]),
        ("FL11", [0.3805, 0.3769]),
        ("LED-B1", [0.4560, 0.4078]),
        ("LED-B2", [0.4357, 0.4012]),
        ("ledb3", [0.3756, 0.3723]),
        ("LED-B4", [0.3422, 0.3502]),
        ("LED-B5", [0.3118, 0.3236]),
        ("LED-BH1", [0.4474, 0.4066]),
        ("LED RGB1", [0.4557, 0.4211]),
        ("LED-V1", [0.4548, 0.4044]),
        ("LED-V2", [0.3781, 0.3775]),
    ] {
        let [found_x, found_y] = lamp(name).xyz().chromaticity().expect("lamps shine");
        assert!(
            (found_x - x).abs() < 1e-4 && (found_y - y).abs() < 1e-4,
            "{name}: {found_x} {found_y}"
        );
    }
}

#[test]
fn light_at_555_nm_gives_683_lumens_per_watt() {
    let line = lamp("line:555");
    // A triangle 1 nm to each side: the efficiency falls by 0.02 % within it.
    assert!((line.luminous_flux_lm() / line.radiant() / 683.0 - 1.0).abs() < 1e-4);
    // The spectral luminous efficacy of sodium light, 683 ȳ(589.3).
    let sodium = lamp("line:589.3");
    let expected = 683.0 * xyz_bar(Nanometres(589.3))[1];
    assert!((sodium.luminous_flux_lm() / sodium.radiant() / expected - 1.0).abs() < 1e-3);
}

#[test]
fn every_named_lamp_is_one_luminous_equivalent_watt() {
    for (name, lamp) in all_lamps() {
        assert!((lamp.xyz().y - 1.0).abs() < 1e-12, "{name}");
        assert!((lamp.luminous_flux_lm() - 683.0).abs() < 1e-9, "{name}");
        // The eye makes most of 555 nm.
        assert!(lamp.radiant() > 1.0 - 1e-9, "{name}: {} W", lamp.radiant());
        let bright = lamp.to_luminous_equivalent(1000.0 / 683.0).expect("a lamp");
        assert!((bright.luminous_flux_lm() - 1000.0).abs() < 1e-9, "{name}");
        assert!(
            (bright.radiant() / lamp.radiant() - 1000.0 / 683.0).abs() < 1e-9,
            "{name}"
        );
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
                assert!(
                    (sum - whole).abs() < 1e-12 * whole.max(1.0),
                    "{name}: {sum} for {whole}"
                );
            }
        }
    }
}

#[test]
fn integrals_of_products_of_tables_are_exact() {
    // Light λ − 400 from 400.3 to 410.7 nm, seen through a factor λ²: a cubic, whose integral is known.
    let light = Spectrum::new(vec![(Nanometres(400.3), 0.3), (Nanometres(410.7), 10.7)]).expect("a spectrum");
    let found = light.integral_times(VISIBLE, |Nanometres(nm)| [nm * nm])[0];
    let integral = |x: f64| x.powi(4) / 4.0 - 400.0 * x.powi(3) / 3.0;
    let expected = integral(410.7) - integral(400.3);
    assert!((found / expected - 1.0).abs() < 1e-9, "{found} for {expected}");
    assert_eq!(light.at(Nanometres(400.2)), 0.0);
    assert_eq!(light.at(Nanometres(410.7)), 10.7);
    assert!((light.at(Nanometres(405.0)) - 5.0).abs() < 1e-12);
    let part = light.integral_times(Nanometres(402.0)..=Nanometres(403.5), |_| [1.0])[0];
    assert!((part - 1.5 * 2.75).abs() < 1e-10);
}

#[test]
fn infrared_of_a_table_is_not_visible_flux() {
    let rows = [(300.0, 1.0), (2500.0, 1.0)].map(|(nm, value)| (Nanometres(nm), value));
    let wide = Spectrum::new(rows.into()).expect("a spectrum");
    assert!((wide.radiant() - 470.0).abs() < 1e-9);
    let [x, y] = wide.xyz().chromaticity().expect("white");
    assert!((x - 1.0 / 3.0).abs() < 1e-4 && (y - 1.0 / 3.0).abs() < 1e-4);
}

#[test]
fn srgb_and_xyz_are_each_others_inverse() {
    for (colour, xyz) in [
        (LinearSrgb::new(1.0, 0.0, 0.0), [0.64, 0.33]),
        (LinearSrgb::new(0.0, 1.0, 0.0), [0.30, 0.60]),
        (LinearSrgb::new(0.0, 0.0, 1.0), [0.15, 0.06]),
        (LinearSrgb::WHITE, [0.3127, 0.3290]),
    ] {
        // IEC 61966-2-1: where the primaries and white lie.
        let [x, y] = Xyz::from(colour).chromaticity().expect("a colour");
        assert!(
            (x - xyz[0]).abs() < 1e-12 && (y - xyz[1]).abs() < 1e-12,
            "{colour:?}: {x} {y}"
        );
    }
    assert!((Xyz::from(LinearSrgb::WHITE).y - 1.0).abs() < 1e-15);
    proptest!(support::law(4096), |(r in -1.0..2.0, g in -1.0..2.0, b in -1.0..2.0)| {
        let colour = LinearSrgb::new(r, g, b);
        let xyz = Xyz::from(colour);
        prop_assert!((xyz.y - colour.luminance()).abs() < 1e-12);
        let back = xyz.to_linear_srgb() - colour;
        prop_assert!(back.map(f64::abs).max_channel() < 1e-12, "{back:?}");
        prop_assert!((xyz.to_linear_srgb().luminance() - xyz.y).abs() < 1e-12);
    });
}

#[test]
fn spectral_colours_keep_their_negative_channels() {
    let cyan = lamp("line:500").xyz().to_linear_srgb();
    assert!(cyan.r < -0.1 && cyan.g > 0.0, "{cyan:?}");
    let shown = to_display_gamut(cyan);
    assert!(shown.r >= 0.0 && shown.g >= 0.0 && shown.b >= 0.0);
    assert!((shown.luminance() - cyan.luminance()).abs() < 1e-12);
    // Green leads the channels of 500 nm before and after.
    assert!(shown.g > shown.b && shown.b > shown.r, "{shown:?}");
    let inside = LinearSrgb::new(0.2, 5.0, 0.0);
    assert_eq!(to_display_gamut(inside), inside);
    assert_eq!(
        to_display_gamut(LinearSrgb::new(-1.0, 0.1, 0.1)),
        LinearSrgb::BLACK
    );
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
        let balanced = transformed(&matrix, colour.to_linear_srgb());
        for channel in balanced.to_array() {
            assert!((channel - 1.0).abs() < 1e-9, "{name}: {balanced:?}");
        }
    }
    let same = white_balance(Xyz::from(LinearSrgb::WHITE)).expect("white");
    for (i, row) in same.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            assert!((value - if i == j { 1.0 } else { 0.0 }).abs() < 1e-12);
        }
    }
    assert!(white_balance(Xyz::default()).is_none());
}

#[test]
fn light_of_a_temperature_has_its_published_chromaticity() {
    // CIE 15:2018, tables of the D illuminants, and illuminant A by its temperature.
    for (kelvin, x, y) in [
        (2856.0, 0.4476, 0.4074),
        (5003.0, 0.3457, 0.3585),
        (5503.0, 0.3324, 0.3474),
        (6504.0, 0.3127, 0.3290),
        (7504.0, 0.2990, 0.3149),
    ] {
        let white = white_of_kelvin(kelvin);
        let [found_x, found_y] = white.chromaticity().expect("light");
        assert!(
            (found_x - x).abs() < 3e-4 && (found_y - y).abs() < 3e-4,
            "{kelvin}: {found_x} {found_y}"
        );
        assert!((white.y - 1.0).abs() < 1e-12);
    }
}

#[test]
fn correlated_temperatures_are_those_published() {
    // CIE 15:2018, which rounds the fluorescent lamps' to tens; a black body is as hot as itself.
    for (name, kelvin, tolerance) in [
        ("A", 2856.0, 1.0),
        ("D65", 6504.0, 3.0),
        ("D50", 5003.0, 3.0),
        ("FL2", 4230.0, 10.0),
        ("FL7", 6500.0, 10.0),
        ("FL11", 4000.0, 10.0),
        ("LED-B1", 2733.0, 2.0),
        ("LED-B2", 2998.0, 2.0),
        ("LED-B3", 4103.0, 2.0),
        ("LED-B4", 5109.0, 2.0),
        ("LED-B5", 6598.0, 2.0),
        ("LED-BH1", 2851.0, 2.0),
        ("LED-RGB1", 2840.0, 2.0),
        ("LED-V1", 2724.0, 2.0),
        ("LED-V2", 4070.0, 2.0),
        ("blackbody:2700", 2700.0, 0.1),
        ("blackbody:500", 500.0, 0.1),
        ("blackbody:25000", 25_000.0, 1.0),
    ] {
        let found = correlated_temperature(lamp(name).xyz()).unwrap_or_else(|| panic!("{name} has none"));
        assert!((found.kelvin - kelvin).abs() < tolerance, "{name}: {found:?}");
    }
    assert_eq!(correlated_temperature(lamp("line:532").xyz()), None);
    assert_eq!(correlated_temperature(Xyz::default()), None);
}

#[test]
fn wavelengths_come_as_often_as_they_matter() {
    for (name, lamp) in all_lamps() {
        let sampler = WavelengthSampler::for_lamp(&lamp).expect("a lamp");
        let mut luminous = 0.0;
        let mut before = 0.0;
        const COUNT: u32 = 20_000;
        for i in 0..COUNT {
            let u = (f64::from(i) + 0.5) / f64::from(COUNT);
            let (wavelength, density) = sampler.sample(u);
            assert!(
                VISIBLE.contains(&wavelength) && wavelength.0 >= before,
                "{name}: {wavelength:?}"
            );
            assert!((sampler.cumulative(wavelength) - u).abs() < 1e-9, "{name} at {u}");
            assert!(
                (sampler.density_per_nm(wavelength) / density - 1.0).abs() < 1e-6,
                "{name} at {u}"
            );
            luminous += lamp.at(wavelength) * xyz_bar(wavelength)[1] / density / f64::from(COUNT);
            before = wavelength.0;
        }
        // The estimate by these samples is the flux itself.
        assert!((luminous - 1.0).abs() < 1e-3, "{name}: {luminous}");
    }
    // For equal energy the density is that of the colour-matching functions, half of it luminous efficiency.
    let sampler = WavelengthSampler::equal_energy();
    let weight = |nm: f64| {
        let [x, y, z] = xyz_bar(Nanometres(nm));
        x + 2.0 * y + z
    };
    let at_555 = sampler.density_per_nm(Nanometres(555.0)) / weight(555.0);
    for nm in [361.0, 400.0, 445.0, 500.0, 650.0, 820.0] {
        let ratio = sampler.density_per_nm(Nanometres(nm)) / weight(nm) / at_555;
        assert!((ratio - 1.0).abs() < 1e-12, "{nm}: {ratio}");
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
            assert!((to - from - 1.0 / count as f64).abs() < 1e-9, "{count}: {index}");
            if let Some(next) = bands.get(index + 1) {
                assert_eq!(band.range.end(), next.range.start());
            }
        }
        assert!((bands[0].range.start().0 - 360.0).abs() < 1e-3);
        assert!((bands[count - 1].range.end().0 - 830.0).abs() < 1e-3);
    }
}

#[test]
fn the_rainbow_has_seven_colours_in_order() {
    let bands = WavelengthSampler::equal_energy().rainbow_seven();
    let places: Vec<f64> = bands.iter().map(|band| band.place.0).collect();
    println!("rainbow: {places:.1?}");
    assert_eq!(bands.len(), 7);
    assert!(places.is_sorted());
    let colour = |index: usize| {
        let Nanometres(nm) = bands[index].place;
        lamp(&format!("line:{nm}")).xyz().to_linear_srgb()
    };
    // Which channel leads: violet to blue, green, then yellow's equal parts, orange and red.
    assert!(
        [0, 1, 2]
            .into_iter()
            .all(|i| colour(i).b > colour(i).r.max(colour(i).g))
    );
    assert!(colour(3).g > colour(3).r.max(colour(3).b));
    assert!([5, 6].into_iter().all(|i| colour(i).r > 2.0 * colour(i).g.abs()));
    assert!((colour(4).r / colour(4).g).ln().abs() < 1.0, "{:?}", colour(4));
    // A red laser has but one of them.
    let laser = WavelengthSampler::for_lamp(&lamp("laser:650")).expect("a lamp");
    assert_eq!(laser.rainbow_seven().len(), 1);
}

#[test]
fn names_are_found_in_any_case_and_misspelt_ones_are_answered() {
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
    let message = |name: &str| illuminant(name).expect_err("no such lamp").to_string();
    assert!(
        message("D56").contains("D65") && message("D56").contains("D50"),
        "{}",
        message("D56")
    );
    assert!(message("fl12").contains("FL11"), "{}", message("fl12"));
    for wrong in ["", "candle", "candle:3", "lamp:"] {
        assert!(
            matches!(illuminant(wrong), Err(SpectrumError::UnknownName { .. })),
            "{wrong}"
        );
    }
    for wrong in [
        "blackbody:499",
        "blackbody:25001",
        "blackbody:NaN",
        "blackbody:",
        "line:360",
        "line:x",
    ] {
        assert!(
            matches!(illuminant(wrong), Err(SpectrumError::OutOfRange { .. })),
            "{wrong}"
        );
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
fn each_fault_of_a_csv_file_names_its_line() {
    for (text, expected) in [
        (
            "400,1\nfive hundred,2\n",
            "line 2: `five hundred,2` is no wavelength and value",
        ),
        (
            "nm,W\nnm,W\n400,1\n500,1\n",
            "line 2: `nm,W` is no wavelength and value",
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
        ("400,0\n700,0\n", "it has no light between 360 and 830 nm"),
        ("300,1\n350,0\n700,0\n", "it has no light between 360 and 830 nm"),
    ] {
        let error = read_lamp(text).expect_err(text);
        assert_eq!(error.to_string(), expected);
        assert!(!error.remedy().is_empty());
        let error = error.at("lamp.csv");
        assert_eq!(error.location, "lamp.csv");
    }
}

#[test]
fn lamps_in_any_unit_are_as_bright_as_asked() {
    let lamp = |scale: f64| {
        let rows = [(400.0, 0.25), (550.0, 1.0), (700.0, 0.5)];
        Spectrum::new(rows.map(|(nm, value)| (Nanometres(nm), value * scale)).to_vec()).expect("a table")
    };
    let usual = lamp(1.0).to_luminous_equivalent(2.0).expect("a lamp");
    for scale in [1e-305, 1e-30, 1e30, 1e305, 1.7e308] {
        let scaled = lamp(scale).to_luminous_equivalent(2.0).expect("a lamp");
        assert!(
            (scaled.xyz().y - 2.0).abs() < 1e-12,
            "{scale:e}: {}",
            scaled.xyz().y
        );
        for nm in [400.0, 475.0, 550.0, 700.0] {
            let [value, expected] = [&scaled, &usual].map(|lamp| lamp.at(Nanometres(nm)));
            assert!(
                (value - expected).abs() <= 1e-12 * expected,
                "{scale:e}: {value} and {expected}"
            );
        }
    }
}
