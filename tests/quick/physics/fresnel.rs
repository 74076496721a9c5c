//! Fresnel's equations, metals and thin walls.

use nephroid::optics::fresnel::{dielectric_reflectance, metal_reflectance, thin_wall_reflectance};
use nephroid::optics::refraction::cos_transmitted;

use crate::prelude::*;

/// Reflectance by the sine and tangent forms of Fresnel's equations (Born and Wolf 1.5, eq. 21a), an independent way
/// to the same numbers wherever neither angle is 0.
fn by_sines_and_tangents(theta_i: f64, eta: f64) -> f64 {
    let theta_t = (theta_i.sin() / eta).asin();
    let rs = (theta_i - theta_t).sin() / (theta_i + theta_t).sin();
    let rp = (theta_i - theta_t).tan() / (theta_i + theta_t).tan();
    0.5 * (rs * rs + rp * rp)
}

#[test]
fn weak_interfaces_and_none() {
    for step in 0..=1000 {
        assert_eq!(dielectric_reflectance(f64::from(step) / 1000.0, 1.0), 0.0);
        assert_eq!(thin_wall_reflectance(f64::from(step) / 1000.0, 1.0), 0.0);
    }
    // For |η − 1| = ε ≪ cos²θ: R ≈ (ε/2)² (1/cos⁴θ + (1 − tan²θ)²)/2 · …: here at normal incidence and at 45°, where
    // Rp vanishes to this order (Rp = Rs²) and Rs = (ε/(2 cos²θ))² = ε².
    for eta in [1.0 + 1e-6, 1.0 - 1e-6] {
        let square = (eta - 1.0) * (eta - 1.0);
        near(
            dielectric_reflectance(1.0, eta) / (square / 4.0),
            1.0,
            1e-5,
            "head on",
        );
        near(
            dielectric_reflectance(45f64.to_radians().cos(), eta) / (0.5 * square),
            1.0,
            1e-5,
            "45°",
        );
    }
}

proptest! {
    #![proptest_config(support::law(4096))]

    #[test]
    fn agrees_with_sines_and_tangents(theta_i in 0.01..1.56f64, eta in 1.05..3.0f64) {
        near(dielectric_reflectance(theta_i.cos(), eta), by_sines_and_tangents(theta_i, eta), 1e-12, eta);
    }

    /// A share is a share, and the flux that goes on makes up the rest: T from the transmitted amplitudes, not from
    /// 1 − R.
    #[test]
    fn energy_is_conserved(cos_i in 0.0001..1.0f64, eta in 0.3..3.0f64) {
        let r = dielectric_reflectance(cos_i, eta);
        prop_assert!((0.0..=1.0).contains(&r));
        let t = cos_transmitted(cos_i, eta).map_or(0.0, |cos_t| {
            let ts = 2.0 * cos_i / (cos_i + eta * cos_t);
            let tp = 2.0 * cos_i / (eta * cos_i + cos_t);
            eta * cos_t / cos_i * 0.5 * (ts * ts + tp * tp)
        });
        near(r + t, 1.0, 1e-12, (r, t));
    }

    #[test]
    fn always_a_share(cos_i in prop_oneof![Just(0.0), Just(1.0), Just(1.0 + 1e-15), -1e-15..1.0f64],
                      eta in prop_oneof![Just(1.0), Just(1.0 + f64::EPSILON), Just(1.0 - f64::EPSILON), 0.01..100.0f64]) {
        for r in [dielectric_reflectance(cos_i, eta), thin_wall_reflectance(cos_i, eta)] {
            prop_assert!((0.0..=1.0).contains(&r), "{r}");
        }
    }

    /// R + T²R + T²R³ + … comes back, T² + T²R² + … goes through.
    #[test]
    fn thin_wall_is_the_sum_of_its_orders(cos_i in 0.05..1.0f64, eta in 1.01..3.0f64) {
        let r = dielectric_reflectance(cos_i, eta);
        let t = 1.0 - r;
        let (mut back, mut through, mut inside) = (r, 0.0, t);
        for order in 0..2000 {
            if order % 2 == 0 { through += inside * t } else { back += inside * t }
            inside *= r;
        }
        let wall = thin_wall_reflectance(cos_i, eta);
        near([wall, 1.0 - wall], [back, through], 1e-12, eta);
    }

    /// Schlick's metal: f0 straight on, everything at grazing incidence, in between rising with the angle.
    #[test]
    fn metals(f0 in 0.0..1.0f64, cos_a in 0.0..1.0f64, cos_b in 0.0..1.0f64) {
        let at = |cosine: f64| metal_reflectance(cosine, rgb(f0, 1.0, 0.0));
        prop_assert_eq!(at(1.0).r, f0);
        near(at(0.0).r, 1.0, 1e-15, f0);
        prop_assert_eq!(at(cos_a).g, 1.0);
        let (low, high) = (cos_a.min(cos_b), cos_a.max(cos_b));
        prop_assert!(at(low).r >= at(high).r && at(low).b >= at(high).b);
        near(at(cos_a).b, (1.0 - cos_a).powi(5), 1e-15, cos_a);
    }
}
