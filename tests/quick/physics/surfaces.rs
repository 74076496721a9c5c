//! What becomes of light at a floor: interfaces within other bodies, coat, micro-facets; how lamps fall off, and how
//! units multiply.

use nephroid::light_pass::emitter::EmitterKind;
use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::transport::microfacets::Facet;
use nephroid::transport::{EffectSet, Event, Interaction, SurfaceHit};

use crate::prelude::*;
use support::scenes::middles;

/// A floor of a material within a body of water, object 1.
fn in_water(material: Material, normal: DVec3) -> Tracer {
    let mut scene = Scene::default();
    let mut floor = shapes::floor([-1.0, 1.0], [-1.0, 1.0], 0.0);
    floor.normals.fill(normal);
    parts::add(&mut scene, "floor", floor, material);
    let water = shapes::cuboid(DVec3::splat(-5.0), DVec3::splat(5.0));
    parts::add(&mut scene, "water", water, parts::dielectric("water", 1.333));
    Tracer::new(Arc::new(scene))
}

fn hit(tracer: &Tracer, direction: DVec3) -> SurfaceHit {
    let origin = -direction * 0.5 + DVec3::Z * 0.1;
    let hit = tracer.closest_hit(&Ray { origin, direction }).expect("the floor");
    assert_eq!(hit.object, 0);
    hit
}

fn met(material: Material, direction: DVec3, media: &MediumStack) -> Interaction {
    let tracer = in_water(material, DVec3::Y);
    tracer.interact(&hit(&tracer, direction), direction, media)
}

fn smooth(surface: SurfaceKind, coat: f64) -> Material {
    Material {
        surface,
        coat,
        roughness: 0.0,
        ior: 1.5,
        ..Material::default()
    }
}

#[test]
fn coat_reflects_where_it_covers() {
    for coat in [0.0, 0.3, 1.0] {
        for tangent in [0.0, 0.5, 2.0, 20.0] {
            let direction = dvec3(tangent, -1.0, 0.0).normalize();
            let shares = met(
                smooth(SurfaceKind::Coated, coat),
                direction,
                &MediumStack::default(),
            );
            let back = shares.reflection.map_or(0.0, |branch| branch.share.g);
            near(
                back,
                coat * dielectric_reflectance(-direction.y, 1.5),
                1e-12,
                coat,
            );
            near(back + shares.deposit.g, 1.0, 1e-12, "the rest is deposited");
        }
    }
}

/// A mixture shares light out as its classes do, by their shares of the surface.
#[test]
fn mixtures_are_the_sum_of_their_classes() {
    let direction = dvec3(0.7, -1.0, 0.2).normalize();
    let of = |surface: SurfaceKind, metallic: f64, transmission: f64, coverage: Option<f64>| {
        let material = Material {
            metallic,
            transmission,
            coverage,
            ..smooth(surface, 1.0)
        };
        let met = met(material, direction, &MediumStack::default());
        let share = |branch: Option<nephroid::transport::Branch>| {
            branch.map_or(LinearSrgb::BLACK, |branch| branch.share)
        };
        [
            share(met.reflection),
            share(met.transmission),
            met.deposit,
            met.absorbed,
        ]
    };
    let alone = |surface| of(surface, 0.0, 0.0, None);
    let [metal, clear, body] = [SurfaceKind::Mirror, SurfaceKind::ThinWall, SurfaceKind::Coated].map(alone);
    let passed = [
        LinearSrgb::BLACK,
        LinearSrgb::WHITE,
        LinearSrgb::BLACK,
        LinearSrgb::BLACK,
    ];
    for (metallic, transmission, coverage) in [
        (0.25, 0.5, None),
        (1.0, 0.5, None),
        (0.0, 0.0, Some(0.3)),
        (0.5, 0.0, Some(0.8)),
    ] {
        let mixed = of(SurfaceKind::Varied, metallic, transmission, coverage);
        let there = coverage.unwrap_or(1.0);
        let through = there * (1.0 - metallic) * transmission;
        let rest = there * (1.0 - metallic) * (1.0 - transmission);
        let mut sum = LinearSrgb::BLACK;
        for part in 0..4 {
            let expected = metal[part] * (there * metallic)
                + clear[part] * through
                + body[part] * rest
                + passed[part] * (1.0 - there);
            near(mixed[part], expected, 1e-12, (metallic, transmission, part));
            sum += mixed[part];
        }
        near(sum, LinearSrgb::WHITE, 1e-12, "all of the light");
    }
}

/// An open sheet met from behind: light leaves it as it leaves glass, though it never entered any.
#[test]
fn a_body_never_entered_is_left() {
    for sine in [0.0_f64, 0.3, 0.6, 0.7] {
        let direction = dvec3(sine, (1.0 - sine * sine).sqrt(), 0.0);
        let through = met(
            parts::dielectric("glass", 1.5),
            direction,
            &MediumStack::default(),
        )
        .transmission;
        assert_eq!(through.is_none(), sine > 1.0 / 1.5, "{sine}");
        if let Some(through) = through {
            near(through.ray.direction.x, 1.5 * sine, 1e-12, sine);
            near(through.ior_ratio, 1.5, 1e-12, sine);
        }
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
    assert_eq!((full.entered(8), full.left(8)), (full, full));
}

/// Where the program's tangents break, as those of any field on a sphere do somewhere.
const POLE: DVec3 = dvec3(
    -0.362_357_181_989_727_66,
    -0.815_303_659_476_887_2,
    0.451_638_368_060_176_6,
);

/// Seen head on, no direction along the surface is preferred, also within rounding of the tangents' pole.
#[test]
fn micro_normals_have_no_side() {
    let ulps = |index: i32| f64::from(index % 3 - 1) * f64::EPSILON;
    let near_the_pole = (0..27).map(|index| POLE + dvec3(ulps(index), ulps(index / 3), ulps(index / 9)));
    let others = [DVec3::Y, -POLE, dvec3(0.3, -0.2, 0.7).normalize()];
    for normal in near_the_pole.chain(others) {
        let (x, y) = normal.any_orthonormal_pair();
        let (mut mean, mut squares, mut product) = (DVec2::ZERO, DVec2::ZERO, 0.0);
        for point in middles(32) {
            let micro = Facet { alpha: 0.3, point }.normal(-normal, normal);
            near(micro.length(), 1.0, 1e-9, normal);
            assert!(micro.dot(normal) > 0.0, "{micro} about {normal}");
            let along = dvec2(micro.dot(x), micro.dot(y));
            mean += along;
            squares += along * along;
            product += along.x * along.y;
        }
        let size = squares.element_sum();
        near(mean, DVec2::ZERO, 1e-9 * size, normal);
        near(squares.x, squares.y, 1e-6 * size, normal);
        near(product, 0.0, 1e-6 * size, normal);
    }
}

/// From below as well, beyond the critical angle of some facets or of all.
#[test]
fn clear_rough_glass_absorbs_nothing() {
    let rough = with(parts::dielectric("glass", 1.5), |it| it.roughness = 0.5);
    // Vertex normals that lean: sides are those of the triangle.
    let tracer = in_water(rough, dvec3(0.4, 1.0, 0.1).normalize());
    let mut total = 0;
    for angle in 0..30 {
        let polar = f64::from(angle) * (TAU / 120.0) + 0.01;
        for (cosine, media) in [
            (polar.cos(), MediumStack::default().entered(0)),
            (-polar.cos(), MediumStack::default()),
        ] {
            let direction = dvec3(polar.sin(), cosine, 0.0);
            let hit = hit(&tracer, direction);
            for point in middles(8) {
                let shares =
                    tracer.interact_with(EffectSet::EVERYTHING, &hit, direction, &media, Some(point));
                let back = shares.reflection.expect("some is sent back");
                let through = shares.transmission.map_or(0.0, |branch| {
                    assert!(branch.ray.direction.y * direction.y > 0.0, "{branch:?}");
                    branch.share.g
                });
                assert!(back.ray.direction.y * direction.y < 0.0, "{back:?}");
                assert_eq!(shares.absorbed.g, 0.0);
                near(back.share.g + through, 1.0, 1e-12, shares);
                total += usize::from(back.event == Event::TotalInternalReflection);
            }
        }
    }
    assert!(total > 100, "{total} facets reflect totally");
}

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
