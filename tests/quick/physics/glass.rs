//! Refractive index by wavelength: formulas, glass numbers, the catalogue.

use nephroid::optics::glass::{Dispersion, Glass, catalogue};
use nephroid::optics::wavelength::{C_LINE, D_LINE, F_LINE, VISIBLE};

use super::visible;
use crate::prelude::*;

/// The glass of the prism in the references.
const FLINT: &str = "635577";
const HERZBERGER: &str = "herzberger:1.5,-0.001,0.008,0.0001";

fn glass(text: &str) -> Glass {
    Glass::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[test]
fn glasses_are_those_of_their_data_sheets() {
    // SCHOTT AG, optical glass data sheets, 2017-01-20.
    for (name, n_d, v_d) in [
        ("N-BK7", 1.51680, 64.17),
        ("N-K5", 1.52249, 59.48),
        ("K7", 1.51112, 60.41),
        ("N-FK51A", 1.48656, 84.47),
        ("N-PK52A", 1.49700, 81.61),
        ("N-BAK1", 1.57250, 57.55),
        ("N-BAK4", 1.56883, 55.98),
        ("N-SK2", 1.60738, 56.65),
        ("N-SK16", 1.62041, 60.32),
        ("N-LAK8", 1.71300, 53.83),
        ("N-LAK22", 1.65113, 55.89),
        ("N-LAF2", 1.74397, 44.85),
        ("N-LASF9", 1.85025, 32.17),
        ("N-LASF31A", 1.88300, 40.76),
        ("N-LASF44", 1.80420, 46.50),
        ("N-BAF10", 1.67003, 47.11),
        ("LLF1", 1.54814, 45.75),
        ("LF5", 1.58144, 40.85),
        ("F2", 1.62004, 36.37),
        ("N-F2", 1.62005, 36.43),
        ("F5", 1.60342, 38.03),
        ("N-SF2", 1.64769, 33.82),
        ("SF5", 1.67270, 32.21),
        ("N-SF5", 1.67271, 32.25),
        ("SF10", 1.72825, 28.41),
        ("N-SF10", 1.72828, 28.53),
        ("SF11", 1.78472, 25.76),
        ("N-SF11", 1.78472, 25.68),
        ("SF6", 1.80518, 25.43),
        ("N-SF6", 1.80518, 25.36),
        ("SF57", 1.84666, 23.83),
        ("N-SF57", 1.84666, 23.78),
        ("N-SF66", 1.92286, 20.88),
    ] {
        let dispersion = glass(name).dispersion;
        // To the last digit that is printed.
        near(dispersion.n_d(), n_d, 1e-5, name);
        near(dispersion.abbe_number(), v_d, 1e-2, name);
    }
}

#[test]
fn other_materials_are_as_measured() {
    let sodium = Nanometres(589.3);
    for (name, line, expected, tolerance) in [
        // Corning 7980 data sheet (2014), 22 °C; V_d below.
        ("fused silica", D_LINE, 1.45846, 2e-5),
        // CRC Handbook of Chemistry and Physics, 95th edition (2014): water at 20 °C by the formula of IAPWS, crystals.
        ("water", Nanometres(589.0), 1.33336, 1e-4),
        ("water", Nanometres(404.41), 1.34315, 1e-4),
        ("diamond", sodium, 2.4173, 5e-4),
        ("sapphire", sodium, 1.768, 5e-4),
        ("quartz", sodium, 1.5443, 1e-4),
        ("CaF2", D_LINE, 1.4338, 1e-4),
        ("MgF2", sodium, 1.378, 5e-4),
        ("ice", sodium, 1.309, 5e-3),
        // Plastics differ from batch to batch (M. Bass, ed., Handbook of Optics II, 1995, chapter 34).
        ("PMMA", D_LINE, 1.4918, 1e-3),
        ("polycarbonate", D_LINE, 1.5855, 1e-3),
        ("polystyrene", D_LINE, 1.5905, 2e-3),
        ("cubic zirconia", sodium, 2.16, 5e-3),
        ("window glass", D_LINE, 1.523, 1e-3),
    ] {
        near(glass(name).dispersion.index(line), expected, tolerance, name);
    }
    near(glass("silica").dispersion.abbe_number(), 67.82, 0.02, "silica");
    near(glass("acrylic").dispersion.abbe_number(), 57.4, 2.0, "acrylic");
}

#[test]
fn every_glass_bends_blue_more_than_red() {
    let mut count = 0;
    for glass in catalogue::all() {
        count += 1;
        let indices: Vec<f64> = visible().map(|line| glass.dispersion.index(line)).collect();
        assert!(indices.windows(2).all(|pair| pair[0] > pair[1]), "{}", glass.name);
        assert!(indices.iter().all(|n| *n > 1.25 && *n < 2.6), "{}", glass.name);
        assert!(glass.dispersion.is_dispersive());
        assert!(!glass.dispersion.falls_below_one(&VISIBLE));
        assert!(!glass.source.is_empty());
        // All were measured where the eye is most sensitive.
        assert!(glass.is_within(Nanometres(450.0)) && glass.is_within(Nanometres(750.0)));
    }
    assert!(count >= 30);
}

#[test]
fn slopes_are_those_of_the_index() {
    let formulas = ["523588", "cauchy:1.5,0.004,0.0001", HERZBERGER];
    let written = formulas.into_iter().map(glass);
    for glass in written.chain(catalogue::all().cloned()) {
        for Nanometres(nm) in visible() {
            let index = |nm: f64| glass.dispersion.index(Nanometres(nm));
            let expected = (index(nm + 0.01) - index(nm - 0.01)) / 0.02;
            let found = glass.dispersion.slope_per_nm(Nanometres(nm));
            near(found / expected, 1.0, 1e-5, (&glass.name, nm));
        }
    }
    assert_eq!(Dispersion::Constant(1.5).slope_per_nm(D_LINE), 0.0);
}

#[test]
fn glass_numbers_are_index_and_abbe_number() {
    for (number, n_d, v_d) in [
        ("523588", 1.523, 58.8),
        (FLINT, 1.635, 57.7),
        ("999999", 1.999, 99.9),
    ] {
        let dispersion = glass(number).dispersion;
        near(dispersion.n_d(), n_d, 1e-15, number);
        near(dispersion.abbe_number() / v_d, 1.0, 1e-12, number);
    }
    for wrong in ["52358", "5235881", "523000", "0"] {
        let refused = Glass::parse(wrong).expect_err(wrong);
        assert!(
            refused.what.ends_with("is not a glass number of six digits"),
            "{refused}"
        );
    }
}

/// KHR_materials_dispersion: n(λ) = max(n_d + (n_d − 1)·dispersion/20·(523655/λ² − 1.5168), 1), λ in nm.
#[test]
fn gltf_dispersion_follows_its_extension() {
    proptest!(support::law(4096), |(ior in 1.0..3.0, dispersion in 0.0..1.0, nm in 360.0..830.0)| {
        let found = Dispersion::from_gltf(ior, dispersion).index(Nanometres(nm));
        let text = (ior + (ior - 1.0) * dispersion / 20.0 * (523_655.0 / (nm * nm) - 1.5168)).max(1.0);
        // Its rounded constants leave 5e-5 of the dispersion's factor.
        near(found, text, 1e-4 * (ior - 1.0) * dispersion / 20.0 + 1e-15, nm);
    });
    assert_eq!(Dispersion::from_gltf(1.5, 0.0), Dispersion::Constant(1.5));
    assert_eq!(Dispersion::Constant(1.5).abbe_number(), f64::INFINITY);
    assert!(!Dispersion::Constant(1.5).is_dispersive());
}

#[test]
fn prism_has_the_indices_of_its_reference() {
    let index = |nm: f64| glass(FLINT).dispersion.index(Nanometres(nm));
    // Rows of the reference's table, which has eleven decimals.
    for (nm, expected) in [
        (400.0, 1.65432513458),
        (440.0, 1.64807402401),
        (486.13, 1.64269270861),
        (530.0, 1.63882277458),
        (587.56, 1.635),
        (656.27, 1.63168750931),
        (700.0, 1.6300679096),
    ] {
        near(index(nm) / expected, 1.0, 1e-10, nm);
    }
}

#[test]
fn formulas_are_what_their_authors_wrote() {
    let at_500 = |text: &str| glass(text).dispersion.index(Nanometres(500.0));
    assert_eq!(at_500("cauchy:1.5,0.004"), 1.5 + 0.004 / 0.25);
    let third = 1.5 + (0.004 + 0.0005 / 0.25) / 0.25;
    assert_eq!(at_500("Cauchy: 1.5, 0.004, 0.0005"), third);
    let bk7 = "sellmeier:1.03961212,0.231792344,1.01046945,0.00600069867,0.0200179144,103.560653";
    let [bk7, known] = [bk7, "N-BK7"].map(|text| glass(text).dispersion);
    assert!(visible().all(|line| bk7.index(line) == known.index(line)));
    let l: f64 = 1.0 / (0.25 - 0.168 * 0.168);
    let herzberger = 1.5 - 0.001 * 0.25 + 0.008 * l + 0.0001 * l * l;
    near(at_500(HERZBERGER), herzberger, 1e-15, "Herzberger");
    let abbe = glass("abbe:1.523,58.8").dispersion;
    assert_eq!(abbe, glass("523588").dispersion);
    near(
        abbe.index(F_LINE) - abbe.index(C_LINE),
        0.523 / 58.8,
        1e-15,
        "spread",
    );
}

#[test]
fn no_index_is_below_one_or_infinite() {
    let steep = Dispersion::Abbe { n_d: 1.01, v_d: 0.1 };
    assert!(steep.falls_below_one(&VISIBLE));
    // A resonance where nobody sees, and λ² exactly on it.
    let resonant = Dispersion::Sellmeier {
        constant: 0.0,
        b: [1.0, 0.0, 0.0, 0.0],
        c_um2: [0.25, 0.0, 0.0, 0.0],
    };
    let refused = resonant.checked().expect_err("it has one");
    assert_eq!(refused.what, "the index is infinite at 500.0 nm");
    for dispersion in [steep, resonant] {
        for nm in (1..3000).map(f64::from) {
            let index = dispersion.index(Nanometres(nm));
            assert!(
                index.is_finite() && index >= 1.0,
                "{dispersion:?} at {nm}: {index}"
            );
            assert!(dispersion.slope_per_nm(Nanometres(nm)).is_finite());
        }
    }
    assert_eq!(resonant.index(Nanometres(500.0)), 1.0);
}

#[test]
fn formulas_beyond_their_range_are_warned_of() {
    let only = |name: &str| {
        let [warning] = &glass(name).warnings(&VISIBLE, "gem")[..] else {
            panic!("one warning");
        };
        warning.what.clone()
    };
    says(only("diamond"), "Diamond | 226 to 760 nm");
    says(only("abbe:1.01,0.1"), "below 1");
    assert!(glass("N-BK7").warnings(&VISIBLE, "window").is_empty());
    let diamond = glass("diamond");
    assert!(diamond.is_within(Nanometres(700.0)) && !diamond.is_within(Nanometres(800.0)));
    let within = Nanometres(400.0)..=Nanometres(700.0);
    assert!(diamond.warnings(&within, "gem").is_empty());
}

#[test]
fn glasses_are_found_by_name() {
    for (name, found) in [
        ("nbk7", "N-BK7"),
        ("BK7", "N-BK7"),
        (" n bk 7 ", "N-BK7"),
        ("FUSED SILICA", "Fused silica"),
        ("Pmma", "Acrylic"),
        ("soda lime", "Soda-lime glass"),
    ] {
        assert_eq!(glass(name).name, found);
    }
    for (name, meant) in [
        ("BK8", "BK7"),
        ("BAF10", "N-BAF10"),
        ("fused silca", "Fused silica"),
    ] {
        says(Glass::parse(name).expect_err("no such glass"), meant);
    }
    let mut names: Vec<_> = catalogue::all().map(|glass| glass.name.to_lowercase()).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), catalogue::all().count());
    for known in catalogue::all() {
        assert_eq!(&glass(&known.name), known);
    }
}

#[test]
fn faults_say_what_is_wrong() {
    for (text, expected) in [
        ("", "no glass is named ``"),
        ("sellmayer:1", "no formula is named `sellmayer`"),
        (
            "cauchy:1.5",
            "`1.5` are not constants for cauchy, which takes A, B and perhaps C",
        ),
        ("cauchy:1.5,x", "`1.5,x` are not constants for cauchy"),
        (
            "sellmeier:1,2,3",
            "`1,2,3` are not constants for sellmeier, which takes B1, B2, B3",
        ),
        ("herzberger:", "`` are not constants for herzberger"),
        ("abbe:1.5,0", "0 cannot be a constant of abbe"),
        ("abbe:1.5,-3", "-3 cannot be a constant of abbe"),
        ("abbe:NaN,50", "NaN cannot be a constant of abbe"),
        ("cauchy:1.5,inf", "inf cannot be a constant of cauchy"),
        ("cauchy:1.5,4000", "the index at 587.56 nm is 11588"),
        ("cauchy:0.5,0.001", "the index at 587.56 nm is 0.50"),
        ("sellmeier:1,0,0,0.36,0,0", "the index is infinite at 600.0 nm"),
        ("12345", "`12345` is not a glass number of six digits"),
    ] {
        let error = Glass::parse(text).expect_err(text);
        assert!(error.what.starts_with(expected), "{text}: {error}");
        let reported = error.at("--glass");
        assert!(!reported.remedy.is_empty() && reported.location == "--glass");
    }
}
