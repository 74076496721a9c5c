//! Mirror law and Snell's law.

use nephroid::optics::refraction::{cos_transmitted, reflect, refract};

use crate::prelude::*;

/// Unit vectors from cylinder coordinates: uniform over the sphere.
fn unit() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0f64, 0.0..TAU).prop_map(|(z, phi)| {
        let r = (1.0 - z * z).sqrt();
        dvec3(r * phi.cos(), r * phi.sin(), z)
    })
}

fn incidence() -> impl Strategy<Value = (DVec3, DVec3)> {
    (unit(), unit())
        .prop_map(|(incident, normal)| (incident, -normal * incident.dot(normal).signum()))
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
        near(out.length(), 1.0, 1e-14, "unit");
        near(out.dot(normal), -incident.dot(normal), 1e-14, "angle");
        near(out.cross(normal), incident.cross(normal), 1e-14, "plane");
        near(out, reflect(incident, -normal), 1e-15, "other normal");
        near(reflect(out, normal), incident, 1e-14, "twice");
    }

    /// sin θt = sin θi / η, in the plane of incidence, on the other side; otherwise the reflection is total and
    /// sin θi > η says so. The cosine agrees with the vector.
    #[test]
    fn snells_law((incident, normal) in incidence(), eta in 0.3..3.0f64) {
        let sin_i = incident.cross(normal).length();
        let (out, cos_t) = (refract(incident, normal, eta), cos_transmitted(-incident.dot(normal), eta));
        prop_assert_eq!(out.is_some(), cos_t.is_some());
        if let (Some(out), Some(cos_t)) = (out, cos_t) {
            near(out.length(), 1.0, 1e-14, "unit");
            prop_assert!(out.dot(normal) <= 0.0);
            // Vector form: n_i (d_i × n) = n_t (d_t × n); holds both the ratio of sines and the common plane.
            near(out.cross(normal) * eta, incident.cross(normal), 1e-14, "sines and plane");
            near(cos_t, -out.dot(normal), 1e-14, "cosine");
        } else {
            prop_assert!(sin_i >= eta * (1.0 - 1e-14));
        }
        prop_assert!(out.is_some() || sin_i >= eta * (1.0 - 1e-14));
        near(refract(incident, normal, 1.0).expect("no interface"), incident, 1e-15, "equal indices");
    }
}

/// cos²θt = (η² − 1 + cos²θi)/η².
#[test]
fn grazing_on_a_weak_interface_keeps_digits() {
    let (eta, cos_i) = (1.0 + 1e-12, 1e-6_f64);
    // To first order η² − 1 = 2e-12, in which the representable η counts.
    let expected = (2.0 * (eta - 1.0) + cos_i * cos_i).sqrt();
    let cos_t = cos_transmitted(cos_i, eta).expect("into the denser medium always");
    near(cos_t / expected, 1.0, 1e-11, cos_t);
}
