//! Smooth interfaces within other bodies, and of bodies that were never entered.

use std::sync::Arc;

use glam::DVec3;
use nephroid::geometry::Ray;
use nephroid::optics::fresnel::{dielectric_reflectance, thin_wall_reflectance};
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Material, Scene, SurfaceKind};
use nephroid::transport::{Interaction, MediumStack, Tracer};

/// What becomes of light along a unit direction at a floor of a material, within other bodies: object 1 is water.
fn at_a_floor(material: Material, direction: DVec3, media: &MediumStack) -> Interaction {
    let mut scene = Scene::default();
    let floor = shapes::floor([-1.0, 1.0], [-1.0, 1.0], 0.0);
    parts::add(&mut scene, "floor", floor, material);
    let water = shapes::cuboid(DVec3::splat(-5.0), DVec3::splat(5.0));
    parts::add(&mut scene, "water", water, parts::dielectric("water", 1.333));
    let tracer = Tracer::new(Arc::new(scene));
    let origin = -direction * 0.5 + DVec3::new(0.0, 0.0, 0.1);
    let hit = tracer.closest_hit(&Ray { origin, direction }).expect("the floor");
    assert_eq!(hit.object, 0);
    tracer.interact(&hit, direction, media)
}

/// Polish and panes reflect by their contrast with what is around them.
#[test]
fn interfaces_under_water_reflect_by_their_contrast_with_it() {
    let direction = DVec3::new(0.4, -1.0, 0.2).normalize();
    let within = MediumStack::default().entered(1);
    let eta = 1.5 / 1.333;
    for (surface, expected) in [
        (SurfaceKind::Mixed, dielectric_reflectance(-direction.y, eta)),
        (SurfaceKind::ThinWall, thin_wall_reflectance(-direction.y, eta)),
    ] {
        let material = Material {
            surface,
            roughness: 0.0,
            ior: 1.5,
            ..Material::default()
        };
        let shares = at_a_floor(material, direction, &within);
        let back = shares.reflection.expect("it reflects").share.g;
        assert!((back - expected).abs() < 1e-12, "{back} {expected}");
    }
}

/// An open sheet met from behind: light leaves it as it leaves glass, though it never entered any.
#[test]
fn a_body_that_was_never_entered_is_left_by_its_index() {
    for sine in [0.0_f64, 0.3, 0.6, 0.7] {
        let direction = DVec3::new(sine, (1.0 - sine * sine).sqrt(), 0.0);
        let shares = at_a_floor(
            parts::dielectric("glass", 1.5),
            direction,
            &MediumStack::default(),
        );
        match shares.transmission {
            Some(through) => {
                let expected = 1.5 * sine;
                assert!((through.ray.direction.x - expected).abs() < 1e-12, "{through:?}");
                assert!((through.ior_ratio - 1.5).abs() < 1e-12, "{through:?}");
            }
            None => assert!(sine > 1.0 / 1.5, "{sine} is below the critical angle"),
        }
        assert_eq!(shares.transmission.is_none(), sine > 1.0 / 1.5, "{sine}");
    }
}

/// The medium is the body that was entered last and not left, whichever is left first.
#[test]
fn bodies_are_left_in_any_order() {
    let stack = |objects: std::ops::Range<usize>| objects.fold(MediumStack::default(), MediumStack::entered);
    let overlapping = stack(1..4);
    assert_eq!(overlapping.left(1).objects(), [2, 3]);
    assert_eq!(overlapping.left(2).objects(), [1, 3]);
    assert_eq!(overlapping.left(3).top(), Some(2));
    assert_eq!(overlapping.left(7), overlapping, "it was never entered");
    // A body that overlaps itself is left once for each time that it was entered, the last time first.
    let twice = stack(1..3).entered(1);
    assert_eq!(twice.left(1).objects(), [1, 2]);
    assert_eq!(twice.left(1).left(1).objects(), [2]);
    // Eight are known; one more is no body at all.
    let full = stack(0..8);
    assert_eq!(full.objects().len(), 8);
    assert_eq!(full.entered(8), full);
    assert_eq!(full.left(8), full);
}
