//! Mirror law and Snell's law.

use glam::DVec3;
use nephroid::optics::refraction::{cos_transmitted, reflect, refract};
use proptest::prelude::*;

/// Unit vectors from cylinder coordinates: uniform over the sphere.
fn unit() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0f64, 0.0..std::f64::consts::TAU).prop_map(|(z, phi)| {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * phi.cos(), r * phi.sin(), z)
    })
}

/// A normal and a ray that arrives on its side.
fn incidence() -> impl Strategy<Value = (DVec3, DVec3)> {
    (unit(), unit())
        .prop_map(|(incident, normal)| {
            let towards = if incident.dot(normal) > 0.0 {
                -normal
            } else {
                normal
            };
            (incident, towards)
        })
        .prop_filter("a ray within the surface meets no side", |(incident, normal)| {
            incident.dot(*normal) < -1e-6
        })
}

proptest! {
    #![proptest_config(support::law(4096))]

    /// Equal angles, in one plane, whichever way the normal points; twice is nothing.
    #[test]
    fn mirror_law((incident, normal) in incidence()) {
        let out = reflect(incident, normal);
        prop_assert!((out.length() - 1.0).abs() < 1e-14);
        prop_assert!((out.dot(normal) + incident.dot(normal)).abs() < 1e-14);
        prop_assert!(out.cross(normal).distance(incident.cross(normal)) < 1e-14);
        prop_assert!(out.distance(reflect(incident, -normal)) < 1e-15);
        prop_assert!(reflect(out, normal).distance(incident) < 1e-14);
    }

    /// sin θt = sin θi / η, in the plane of incidence, on the other side; otherwise the reflection is total and
    /// sin θi > η says so.
    #[test]
    fn snells_law((incident, normal) in incidence(), eta in 0.3..3.0f64) {
        let sin_i = incident.cross(normal).length();
        match refract(incident, normal, eta) {
            Some(out) => {
                prop_assert!((out.length() - 1.0).abs() < 1e-14);
                prop_assert!(out.dot(normal) <= 0.0);
                // Vector form: n_i (d_i × n) = n_t (d_t × n); holds both the ratio of sines and the common plane.
                prop_assert!((out.cross(normal) * eta).distance(incident.cross(normal)) < 1e-14);
            }
            None => prop_assert!(sin_i >= eta * (1.0 - 1e-14)),
        }
        if sin_i < eta * (1.0 - 1e-14) {
            prop_assert!(refract(incident, normal, eta).is_some());
        }
    }

    /// A ray sent back along its own path leaves where it came from.
    #[test]
    fn refraction_is_reversible((incident, normal) in incidence(), eta in 0.3..3.0f64) {
        if let Some(out) = refract(incident, normal, eta) {
            // The way back ends at θi: a rounding of its sine moves its cosine by tan θi times as much.
            let condition = 1.0 / incident.dot(-normal);
            let back = refract(-out, -normal, 1.0 / eta);
            prop_assert!(back.is_some_and(|back| back.distance(-incident) < 1e-14 * (1.0 + condition)));
        }
    }

    /// No interface, no bend.
    #[test]
    fn equal_indices_do_not_bend((incident, normal) in incidence()) {
        let out = refract(incident, normal, 1.0);
        prop_assert!(out.is_some_and(|out| out.distance(incident) < 1e-15));
    }

    /// The cosine agrees with the vector.
    #[test]
    fn cosine_and_direction_agree((incident, normal) in incidence(), eta in 0.3..3.0f64) {
        let cos_t = cos_transmitted(-incident.dot(normal), eta);
        match refract(incident, normal, eta) {
            Some(out) => prop_assert!((cos_t.unwrap_or(f64::NAN) + out.dot(normal)).abs() < 1e-14),
            None => prop_assert!(cos_t.is_none()),
        }
    }
}

#[test]
fn known_angles() {
    // 45° from air into n = √2 gives 30°, by sin 45° = √2 · sin 30°.
    let incident = DVec3::new(1.0, -1.0, 0.0).normalize();
    let out = refract(incident, DVec3::Y, 2f64.sqrt()).expect("into the denser medium always");
    assert!((out.x - 0.5).abs() < 1e-15 && out.z == 0.0);
    // 3-4-5: sin θi = 0.8 into η = 4/3 gives sin θt = 0.6.
    let out =
        refract(DVec3::new(0.8, -0.6, 0.0), DVec3::Y, 4.0 / 3.0).expect("into the denser medium always");
    assert!(out.distance(DVec3::new(0.6, -0.8, 0.0)) < 1e-15);
}

#[test]
fn critical_angle_to_1e_7_rad() {
    for n in [1.000_3, 1.333, 1.5, 2.417] {
        let critical: f64 = (1.0f64 / n).asin();
        let at = |angle: f64| refract(DVec3::new(angle.sin(), -angle.cos(), 0.0), DVec3::Y, 1.0 / n);
        assert!(
            at(critical + 1e-7).is_none(),
            "n = {n}: still refracts beyond the critical angle"
        );
        let below = at(critical - 1e-7).expect("refracts below the critical angle");
        // sin θt = n sin(θc − δ) = cos δ − √(n² − 1) sin δ.
        let expected = 1e-7f64.cos() - (n * n - 1.0).sqrt() * 1e-7f64.sin();
        assert!(
            (below.x - expected).abs() < 1e-14,
            "n = {n}: {} for {expected}",
            below.x
        );
    }
}

/// A grazing ray on a weak interface keeps its digits: cos²θt = (η² − 1 + cos²θi)/η².
#[test]
fn grazing_on_a_weak_interface_keeps_its_digits() {
    let eta = 1.0 + 1e-12;
    let cos_i: f64 = 1e-6;
    // To first order η² − 1 = 2e-12, in which the representable η counts.
    let excess = 2.0 * (eta - 1.0);
    let expected = (excess + cos_i * cos_i).sqrt();
    let cos_t = cos_transmitted(cos_i, eta).expect("into the denser medium always");
    assert!((cos_t / expected - 1.0).abs() < 1e-11, "{cos_t} for {expected}");
}
