//! Spot fall-off and the lawful products of units.

use glam::DVec3;
use nephroid::light_pass::emitter::EmitterKind;
use nephroid::units::{Area, Irradiance, RadiantIntensity, SolidAngle};
use proptest::prelude::*;

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
    DVec3::new(angle.sin(), -angle.cos(), 0.0)
}

#[test]
fn a_spot_is_full_inside_and_dark_outside() {
    let light = spot(0.3, 0.5);
    assert_eq!(light.falloff(off_axis(0.0)), 1.0);
    assert_eq!(light.falloff(off_axis(0.299)), 1.0);
    assert_eq!(light.falloff(off_axis(0.501)), 0.0);
    assert_eq!(light.falloff(DVec3::Y), 0.0);
    // Half-way in the cosine a quarter is left: the square of 1/2.
    let cosine = 0.5 * (0.3f64.cos() + 0.5f64.cos());
    assert!((light.falloff(off_axis(cosine.acos())) - 0.25).abs() < 1e-12);
}

#[test]
fn a_hard_spot_is_a_step() {
    let light = spot(0.4, 0.4);
    assert_eq!(light.falloff(off_axis(0.399_999)), 1.0);
    assert_eq!(light.falloff(off_axis(0.400_001)), 0.0);
}

#[test]
fn points_and_suns_have_none() {
    let point = EmitterKind::Point {
        position: DVec3::ZERO,
    };
    let sun = EmitterKind::Parallel {
        direction: DVec3::NEG_Y,
    };
    for angle in [0.0, 1.0, 3.0] {
        assert_eq!(point.falloff(off_axis(angle)), 1.0);
        assert_eq!(sun.falloff(off_axis(angle)), 1.0);
    }
}

#[test]
fn a_point_light_sends_its_intensity_into_the_whole_sphere() {
    let flux = RadiantIntensity(2.0) * SolidAngle(4.0 * std::f64::consts::PI);
    assert!((flux.0 - 8.0 * std::f64::consts::PI).abs() < 1e-12);
    // On a sphere of 3 m around it that is I/r².
    let irradiance = flux / Area(4.0 * std::f64::consts::PI * 9.0);
    assert!((irradiance.0 - 2.0 / 9.0).abs() < 1e-15);
}

#[test]
fn a_white_lambert_surface_under_pi_sends_one() {
    let radiance = Irradiance(std::f64::consts::PI).diffuse_radiance(1.0);
    assert!((radiance.0 - 1.0).abs() < 1e-15);
}

proptest! {
    #![proptest_config(support::law(4096))]

    /// The fall-off is a share and falls.
    #[test]
    fn falloff_falls(outer in 0.05..1.57f64, share in 0.0..1.0f64, a in 0.0..3.1f64, b in 0.0..3.1f64) {
        let light = spot(outer * share, outer);
        let (near, far) = (light.falloff(off_axis(a.min(b))), light.falloff(off_axis(a.max(b))));
        prop_assert!((0.0..=1.0).contains(&near) && (0.0..=1.0).contains(&far));
        prop_assert!(near >= far);
    }
}
