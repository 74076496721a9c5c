//! Metals: Fresnel's equations with a complex index, and the colours of four of them.

use nephroid::optics::Metal;
use nephroid::optics::conductor::{conductor_reflectance, conductor_reflectance_sp};
use nephroid::optics::fresnel::dielectric_reflectance;

use crate::prelude::*;

pub fn metal(name: &str) -> &'static Metal {
    Metal::by_name(name).unwrap_or_else(|error| panic!("{error}"))
}

/// Reflectances by complex division, as the equations are printed.
fn by_complex_numbers(cos: f64, n: f64, k: f64) -> [f64; 2] {
    type Complex = (f64, f64);
    let times = |a: Complex, b: Complex| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let square = times((n, k), (n, k));
    let (re, im) = (square.0 - 1.0 + cos * cos, square.1);
    let (size, angle) = (re.hypot(im).sqrt(), 0.5 * im.atan2(re));
    let w = (size * angle.cos(), size * angle.sin());
    let of = |first: Complex| {
        let from = (first.0 - w.0).hypot(first.1 - w.1);
        let to = (first.0 + w.0).hypot(first.1 + w.1);
        (from / to).powi(2)
    };
    [of((cos, 0.0)), of(times(square, (cos, 0.0)))]
}

#[test]
fn metals_reflect_as_fresnel_says() {
    proptest!(support::law(4096), |(cos in 0.001..1.0, n in 0.02..4.0, k in 0.0..9.0)| {
        let found = conductor_reflectance_sp(cos, n, k);
        near(found, by_complex_numbers(cos, n, k), 1e-12, (cos, n, k));
        prop_assert!(found.iter().all(|share| (0.0..=1.0).contains(share)));
        // s always reflects more than p.
        prop_assert!(found[0] >= found[1] - 1e-15);
    });
    proptest!(support::law(4096), |(n in 0.02..4.0f64, k in 0.1..9.0f64)| {
        let expected = ((n - 1.0f64).powi(2) + k * k) / ((n + 1.0f64).powi(2) + k * k);
        let head_on = conductor_reflectance_sp(1.0, n, k);
        near(head_on[0], head_on[1], 1e-12, "polarisations");
        near(head_on[0], expected, 1e-12, "head on");
        near(conductor_reflectance_sp(0.0, n, k), [1.0; 2], 1e-12, "grazing");
    });
}

#[test]
fn unabsorbing_metal_is_a_dielectric() {
    proptest!(support::law(4096), |(cos in 0.0..1.0, eta in 0.3..3.0)| {
        near(conductor_reflectance(cos, eta, 0.0), dielectric_reflectance(cos, eta), 1e-12, (cos, eta));
    });
    assert_eq!(
        conductor_reflectance(0.5, 1.0, 0.0),
        dielectric_reflectance(0.5, 1.0)
    );
}

#[test]
fn p_polarised_light_has_a_least_reflectance() {
    for metal in Metal::all() {
        let (n, k) = metal.index(Nanometres(650.0));
        let at = |degrees: u32| conductor_reflectance_sp(f64::from(degrees).to_radians().cos(), n, k);
        let p = |degrees: u32| at(degrees)[1];
        let least = (0..=90).min_by(|a, b| p(*a).total_cmp(&p(*b))).expect("angles");
        // A pseudo-Brewster angle: steep, and the reflectance there is not 0.
        assert!((60..90).contains(&least), "{}: {least}°", metal.name());
        assert!(p(least) > 0.5 && p(least) < p(0), "{}", metal.name());
        let s = (0..=90).map(|degrees| at(degrees)[0]);
        assert!(
            s.is_sorted(),
            "{}: s-polarised light reflects more and more",
            metal.name()
        );
    }
}

#[test]
fn metals_reflect_as_measured() {
    // G. Hass, in American Institute of Physics Handbook, 3rd edition (1972), 6g: evaporated films, per cent, at these
    // wavelengths (0: not compared). Gold and copper are compared away from their edges, where a few nanometres matter.
    let wavelengths = [400.0, 450.0, 500.0, 550.0, 600.0, 650.0, 700.0];
    for (name, measured, tolerance) in [
        ("aluminium", [92.5, 0.0, 91.8, 91.5, 91.1, 0.0, 89.7], 1.5),
        ("silver", [95.6, 0.0, 97.9, 98.3, 98.6, 0.0, 98.9], 1.5),
        ("gold", [38.7, 38.7, 47.7, 0.0, 91.9, 0.0, 97.0], 2.5),
        ("copper", [47.5, 55.2, 60.0, 0.0, 0.0, 96.6, 97.5], 3.5),
    ] {
        let compared = wavelengths.into_iter().zip(measured);
        for (nm, expected) in compared.filter(|(_, measured)| *measured > 0.0) {
            let found = 100.0 * metal(name).reflectance(1.0, Nanometres(nm));
            near(found, expected, tolerance, (name, nm));
        }
    }
}

#[test]
fn tables_cover_the_visible() {
    // Johnson and Christy 1972 at 2.26 eV (548.6 nm) and 1.88 eV (659.5 nm).
    assert_eq!(metal("gold").index(Nanometres(548.6)), (0.43, 2.455));
    assert_eq!(metal("SILVER").index(Nanometres(659.5)), (0.05, 4.483));
    assert_eq!(metal("copper").index(Nanometres(548.6)), (1.02, 2.577));
    for metal in Metal::all() {
        for nm in (3600..=8300).map(|tenth| f64::from(tenth) / 10.0) {
            let [(n, k), (next_n, next_k)] = [nm, nm + 0.1].map(|nm| metal.index(Nanometres(nm)));
            assert!(n > 0.0 && k > 1.0, "{} at {nm}", metal.name());
            // No table ends within the visible: a straight piece goes on, or bends little.
            assert!((n - next_n).abs() < 0.02 && (k - next_k).abs() < 0.05);
            assert!((n, k) != (next_n, next_k), "{} at {nm}", metal.name());
        }
    }
}

#[test]
fn metals_have_their_colours() {
    let [gold, copper, silver, aluminium] =
        ["gold", "copper", "silver", "aluminum"].map(|name| metal(name).reflectance_srgb(1.0));
    for LinearSrgb { r, g, b } in [gold, copper] {
        assert!(r > g && g > b && b > 0.0, "{r} {g} {b}");
    }
    assert!(gold.g > 1.5 * gold.b, "gold is yellow");
    assert!(copper.r > 1.25 * copper.g, "copper is red");
    for LinearSrgb { r, g, b } in [silver, aluminium] {
        assert!((r / b - 1.0).abs() < 0.05 && g > 0.9, "{r} {g} {b}");
    }
    for metal in Metal::all() {
        near(
            metal.reflectance_srgb(0.0),
            LinearSrgb::WHITE,
            1e-12,
            "at grazing incidence",
        );
    }
    let error = Metal::by_name("golt").expect_err("no metal");
    assert!(error.what.contains("are Gold,"), "{error}");
    says(error.at("--metal"), "no metal is named `golt`");
}
