//! Spot fall-off and the lawful products of units.

use nephroid::light_pass::emitter::EmitterKind;

use crate::prelude::*;

fn spot(inner_cone_rad: f64, outer_cone_rad: f64) -> EmitterKind {
    EmitterKind::Spot {
        position: DVec3::ZERO,
        direction: DVec3::NEG_Y,
        inner_cone_rad,
        outer_cone_rad,
    }
}

/// Unit direction at `angle` from the spot's axis.
fn off_axis(angle: f64) -> DVec3 {
    dvec3(angle.sin(), -angle.cos(), 0.0)
}

#[test]
fn lights_have_their_falloff() {
    let (soft, hard) = (spot(0.3, 0.5), spot(0.4, 0.4));
    let point = EmitterKind::Point {
        position: DVec3::ZERO,
    };
    let sun = EmitterKind::Parallel {
        direction: DVec3::NEG_Y,
    };
    for (light, angle, expected) in [
        (&soft, 0.0, 1.0),
        (&soft, 0.299, 1.0),
        (&soft, 0.501, 0.0),
        (&soft, PI, 0.0),
        (&hard, 0.399_999, 1.0),
        (&hard, 0.400_001, 0.0),
        (&point, 0.0, 1.0),
        (&point, 3.0, 1.0),
        (&sun, 1.0, 1.0),
        (&sun, 3.0, 1.0),
    ] {
        assert_eq!(light.falloff(off_axis(angle)), expected, "{light:?} at {angle}");
    }
    // Half-way in the cosine a quarter is left: the square of 1/2.
    let cosine = 0.5 * (0.3f64.cos() + 0.5f64.cos());
    near(soft.falloff(off_axis(cosine.acos())), 0.25, 1e-12, "half-way");
}

proptest! {
    #![proptest_config(support::law(4096))]

    #[test]
    fn falloff_falls(outer in 0.05..1.57f64, share in 0.0..1.0f64, a in 0.0..3.1f64, b in 0.0..3.1f64) {
        let light = spot(outer * share, outer);
        let (near, far) = (light.falloff(off_axis(a.min(b))), light.falloff(off_axis(a.max(b))));
        prop_assert!((0.0..=1.0).contains(&near) && (0.0..=1.0).contains(&far));
        prop_assert!(near >= far);
    }
}
