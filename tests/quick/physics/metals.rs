//! Metals: Fresnel's equations with a complex index, and the colours of four of them.

use nephroid::optics::conductor::{conductor_reflectance, conductor_reflectance_sp};
use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::optics::{LinearSrgb, Metal, Nanometres};
use proptest::prelude::*;

fn metal(name: &str) -> &'static Metal {
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
fn metals_reflect_as_fresnels_equations_say() {
    proptest!(support::law(4096), |(cos in 0.001..1.0, n in 0.02..4.0, k in 0.0..9.0)| {
        let found = conductor_reflectance_sp(cos, n, k);
        for (found, expected) in found.into_iter().zip(by_complex_numbers(cos, n, k)) {
            prop_assert!((found - expected).abs() < 1e-12, "{} for {}", found, expected);
            prop_assert!((0.0..=1.0).contains(&found));
        }
        // s always reflects more than p.
        prop_assert!(found[0] >= found[1] - 1e-15);
    });
}

#[test]
fn without_absorption_a_metal_is_a_dielectric() {
    proptest!(support::law(4096), |(cos in 0.0..1.0, eta in 0.3..3.0)| {
        let found = conductor_reflectance(cos, eta, 0.0);
        prop_assert!((found - dielectric_reflectance(cos, eta)).abs() < 1e-12);
    });
    assert_eq!(
        conductor_reflectance(0.5, 1.0, 0.0),
        dielectric_reflectance(0.5, 1.0)
    );
}

#[test]
fn polarisations_agree_head_on_and_both_reflect_all_at_grazing() {
    proptest!(support::law(4096), |(n in 0.02..4.0, k in 0.1..9.0)| {
        let [s, p] = conductor_reflectance_sp(1.0, n, k);
        let expected = ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
        prop_assert!((s - p).abs() < 1e-12 && (s - expected).abs() < 1e-12);
        for grazing in conductor_reflectance_sp(0.0, n, k) {
            prop_assert!((grazing - 1.0).abs() < 1e-12);
        }
    });
}

#[test]
fn p_polarised_light_has_a_least_reflectance_between() {
    for metal in Metal::all() {
        let (n, k) = metal.index(Nanometres(650.0));
        let p = |degrees: u32| conductor_reflectance_sp(f64::from(degrees).to_radians().cos(), n, k)[1];
        let least = (0..=90).min_by(|a, b| p(*a).total_cmp(&p(*b))).expect("angles");
        // A pseudo-Brewster angle: steep, and the reflectance there is not 0.
        assert!((60..90).contains(&least), "{}: {least}°", metal.name());
        assert!(p(least) > 0.5 && p(least) < p(0), "{}", metal.name());
        let s: Vec<f64> = (0..=90)
            .map(|angle| f64::from(angle).to_radians().cos())
            .collect();
        let s: Vec<f64> = s
            .into_iter()
            .map(|cos| conductor_reflectance_sp(cos, n, k)[0])
            .collect();
        assert!(
            s.is_sorted(),
            "{}: s-polarised light reflects more and more",
            metal.name()
        );
    }
}

#[test]
fn metals_reflect_as_much_as_was_measured() {
    // G. Hass, in American Institute of Physics Handbook, 3rd edition (1972), 6g: evaporated films, per cent. Gold and copper are
    // compared away from their edges, where a few nanometres matter.
    for (name, wavelengths, tolerance) in [
        (
            "aluminium",
            &[
                (400.0, 92.5),
                (500.0, 91.8),
                (550.0, 91.5),
                (600.0, 91.1),
                (700.0, 89.7),
            ][..],
            1.5,
        ),
        (
            "silver",
            &[
                (400.0, 95.6),
                (500.0, 97.9),
                (550.0, 98.3),
                (600.0, 98.6),
                (700.0, 98.9),
            ],
            1.5,
        ),
        (
            "gold",
            &[
                (400.0, 38.7),
                (450.0, 38.7),
                (500.0, 47.7),
                (600.0, 91.9),
                (700.0, 97.0),
            ],
            2.5,
        ),
        (
            "copper",
            &[
                (400.0, 47.5),
                (450.0, 55.2),
                (500.0, 60.0),
                (650.0, 96.6),
                (700.0, 97.5),
            ],
            3.5,
        ),
    ] {
        for (nm, expected) in wavelengths.iter().copied() {
            let found = 100.0 * metal(name).reflectance(1.0, Nanometres(nm));
            assert!(
                (found - expected).abs() < tolerance,
                "{name} at {nm}: {found} for {expected}"
            );
        }
    }
}

#[test]
fn tables_cover_the_visible_and_are_read_as_they_stand() {
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
    let colour = |name: &str| metal(name).reflectance_srgb(1.0);
    for name in ["gold", "copper"] {
        let LinearSrgb { r, g, b } = colour(name);
        println!("{name}: {r:.3} {g:.3} {b:.3}");
        assert!(r > g && g > b && b > 0.0, "{name}");
    }
    // Gold is yellow, copper is red.
    assert!(colour("gold").g > 1.5 * colour("gold").b);
    assert!(colour("copper").r > 1.25 * colour("copper").g);
    for name in ["silver", "aluminum"] {
        let LinearSrgb { r, g, b } = colour(name);
        println!("{name}: {r:.3} {g:.3} {b:.3}");
        assert!((r / b - 1.0).abs() < 0.05 && g > 0.9);
    }
    // At grazing incidence every mirror is white.
    for metal in Metal::all() {
        let grazing = metal.reflectance_srgb(0.0) - LinearSrgb::WHITE;
        assert!(grazing.map(f64::abs).max_channel() < 1e-12);
    }
}

#[test]
fn unknown_metals_are_answered_with_those_there_are() {
    let error = Metal::by_name("golt").expect_err("no metal");
    assert_eq!(error.known.split(',').next(), Some("Gold"));
    assert!(error.at("--metal").what.contains("no metal is named `golt`"));
}
