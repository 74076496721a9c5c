//! Rough surfaces: where their micro-facets point, and that none of them loses light.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use nephroid::geometry::Ray;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Material, Scene};
use nephroid::transport::microfacets::Facet;
use nephroid::transport::{EffectSet, Event, MediumStack, Tracer};

/// An even grid over the unit square.
fn grid(side: u32) -> impl Iterator<Item = DVec2> {
    let place = move |index: u32| (f64::from(index) + 0.5) / f64::from(side);
    (0..side * side).map(move |index| DVec2::new(place(index % side), place(index / side)))
}

/// Where the program's tangents break, as those of any field on a sphere do somewhere.
const POLE: DVec3 = DVec3::new(
    -0.362_357_181_989_727_66,
    -0.815_303_659_476_887_2,
    0.451_638_368_060_176_6,
);

/// Seen head on, no direction along the surface is preferred, also within rounding of the tangents' pole.
#[test]
fn micro_normals_lie_around_the_normal_without_a_side() {
    let ulps = |index: i32| f64::from(index % 3 - 1) * f64::EPSILON;
    let near_the_pole = (0..27).map(|index| POLE + DVec3::new(ulps(index), ulps(index / 3), ulps(index / 9)));
    let others = [DVec3::Y, -POLE, DVec3::new(0.3, -0.2, 0.7).normalize()];
    for normal in near_the_pole.chain(others) {
        let (x, y) = normal.any_orthonormal_pair();
        let (mut mean, mut squares, mut product) = (DVec2::ZERO, DVec2::ZERO, 0.0);
        for point in grid(32) {
            let micro = Facet { alpha: 0.3, point }.normal(-normal, normal);
            assert!((micro.length() - 1.0).abs() < 1e-9, "{micro} about {normal}");
            assert!(micro.dot(normal) > 0.0, "{micro} about {normal}");
            let along = DVec2::new(micro.dot(x), micro.dot(y));
            mean += along;
            squares += along * along;
            product += along.x * along.y;
        }
        let size = squares.element_sum();
        assert!(mean.length() < 1e-9 * size, "{normal}: {mean}");
        assert!((squares.x - squares.y).abs() < 1e-6 * size, "{normal}: {squares}");
        assert!(product.abs() < 1e-6 * size, "{normal}: {product}");
    }
}

fn over_a_leaning_floor(material: Material, normal: DVec3) -> Tracer {
    let mut scene = Scene::default();
    let mut floor = shapes::floor([-1.0, 1.0], [-1.0, 1.0], 0.0);
    floor.normals.fill(normal);
    parts::add(&mut scene, "floor", floor, material);
    Tracer::new(Arc::new(scene))
}

/// From below as well, beyond the critical angle of some facets or of all.
#[test]
fn clear_rough_glass_absorbs_nothing_and_sends_on_to_the_right_sides() {
    let rough = Material {
        roughness: 0.5,
        ..parts::dielectric("glass", 1.5)
    };
    // Vertex normals that lean: sides are those of the triangle.
    let tracer = over_a_leaning_floor(rough, DVec3::new(0.4, 1.0, 0.1).normalize());
    let mut total = 0;
    for angle in 0..30 {
        let polar = f64::from(angle) * (TAU / 120.0) + 0.01;
        for up in [false, true] {
            let direction = DVec3::new(polar.sin(), if up { polar.cos() } else { -polar.cos() }, 0.0);
            let origin = -direction * 0.5 + DVec3::new(0.0, 0.0, 0.1);
            let hit = tracer.closest_hit(&Ray { origin, direction }).expect("the floor");
            assert_eq!(hit.object, 0);
            let inside = MediumStack::default().entered(0);
            let media = if up { inside } else { MediumStack::default() };
            for point in grid(8) {
                let shares =
                    tracer.interact_with(EffectSet::EVERYTHING, &hit, direction, &media, Some(point));
                let back = shares.reflection.expect("some is sent back");
                let through = shares.transmission.map_or(0.0, |branch| {
                    assert!(branch.ray.direction.y * direction.y > 0.0, "{branch:?}");
                    branch.share.g
                });
                assert!(back.ray.direction.y * direction.y < 0.0, "{back:?}");
                assert_eq!(shares.absorbed.g, 0.0);
                assert!((back.share.g + through - 1.0).abs() < 1e-12, "{shares:?}");
                total += usize::from(back.event == Event::TotalInternalReflection);
            }
        }
    }
    assert!(total > 100, "{total} facets reflect totally");
}
