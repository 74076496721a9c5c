//! Mirrors: foci, folds, halls without end, and light that hardly touches.

use support::laws::law::*;
use support::laws::scenes::*;
use support::laws::{Baked, Table};
use support::prelude::*;
use support::tools::{builtin_scene, photons, set, settings, to};

pub fn fill(t: &mut Table) {
    t.case("focus-paraboloid")
        .bake(paraboloid(), 0.02, 33)
        .watts(0.64, 1e-3)
        .measure("light beyond the texel of the focus", 1e-3, |bake| {
            beyond_the_middle(bake, 0.64)
        });
    t.case("focus-on-a-corner-of-texels")
        .bake(paraboloid(), 0.01, 64)
        .watts(0.64, 1e-3);
    let place = dvec3(0.8, 0.5, 0.0);
    let seen_sr = solid_angle_sr(&ellipsoid(place), place);
    t.case("focus-ellipsoid")
        .bake(floor(0.5).mirror(ellipsoid(place)).lamp(place), 0.01, 33)
        .watts(seen_sr, 1e-3)
        .measure("light beyond the texel of the focus", 1e-3, move |bake| {
            beyond_the_middle(bake, seen_sr)
        });
    t.case("fold-on-a-texel-border")
        .bake(fold_on_a_texel_border(), 0.01, 64)
        .e("1/√x beside the fold", 0.03, beside_the_fold)
        .measure("light on the dark side, of all", 1e-3, dark_side)
        .bake(fold_on_a_texel_border(), 0.01, 32)
        .averages_to_coarser();
    for name in ["nephroid", "ring"] {
        t.case(format!("fold-and-cusp-of-the-{name}"))
            .bake(builtin_scene(name), 0.01, 64)
            .bake(builtin_scene(name), 0.01, 32)
            .averages_to_coarser();
    }
    t.case("hall-of-mirrors")
        .bake_with(hall().lamp(HALL_LAMP), depth(40, to(0.01, 32)))
        .e("that of all mirrored lamps", 0.01, all_mirrored);
    for (name, reflectance) in [("mirror-box", 1.0), ("dim-mirror-box", 0.9)] {
        let to_the_end = set(depth(10_000, settings(40.0, 16)), |s| {
            s.branch_threshold = Some(0.0)
        });
        let splats = t.case(name).bake_with(box_of_mirrors(reflectance), to_the_end);
        splats.share("escapes", 0.0, |energy| energy.escaped);
        if reflectance == 1.0 {
            splats
                .share("absorbed by perfect mirrors", 0.0, |energy| energy.absorbed)
                .share("missing after 10,000 bounces but for closed paths", 0.01, |e| {
                    e.emitted - e.deposited
                });
        }
        t.case(format!("{name}-by-bundles"))
            .bake_with(box_of_mirrors(reflectance), depth(6, to(0.2, 16)))
            .share("escapes", 1e-3, |energy| energy.escaped);
    }
    let above_a_thousandth = set(depth(1000, settings(20.0, 16)), |s| {
        s.branch_threshold = Some(1e-3)
    });
    t.case("mirror-box-with-glass")
        .bake_with(
            box_of_mirrors(1.0).glass(1.5, ball_in_the_box(2)),
            above_a_thousandth,
        )
        .share("escapes", 0.0, |energy| energy.escaped)
        .ledger("branches end, and are booked", 0.0, |energy| {
            no(energy.truncated.threshold > 0.0)
        })
        // Branches share the light: those above the threshold are no more than one over it at any depth.
        .measure("segments a ray, of depth over threshold", 1.0, |bake| {
            bake.result.counts.segments as f64 / bake.result.counts.rays as f64 / (1000.0 / 1e-3)
        });
    t.case("mirror-box-with-glass-by-bundles")
        .bake_with(hall_with_a_ball(), depth(24, to(0.2, 64)))
        .share("escapes", 1e-3, |energy| energy.escaped)
        .ledger("light arrives, and the rest is given up", 0.0, |energy| {
            no(energy.deposited > 0.0 && energy.truncated.depth + energy.truncated.threshold > 0.0)
        });
    let ball = |side: f64| shapes::sphere(dvec3(0.5 * side, 0.5, 0.0), 0.4, 4);
    t.case("facing-convex-mirrors")
        .bake(
            floor(0.5)
                .mirror(ball(-1.0))
                .mirror(ball(1.0))
                .lamp(dvec3(0.0, 0.5, 0.01)),
            0.03,
            32,
        )
        .share("given up", 0.01, |energy| energy.truncated.total().abs())
        .ledger("light arrives and light escapes", 0.0, |e| {
            no(e.deposited > 0.0 && e.escaped > 0.0)
        });
    // A mirror ball sends a sun's light evenly into all directions, those parallel to the floor among them.
    let wide = shapes::floor([-30.0, 30.0], [-30.0, 30.0], -3.0);
    let ball = shapes::sphere(DVec3::ZERO, 0.05, 5);
    t.case("rays-parallel-to-the-receiver")
        .bake(
            Scene::default().diffuse("floor", wide).mirror(ball).sun(DVec3::X),
            0.005,
            32,
        )
        .sent(PI * 0.0025, 2e-3)
        .e("that of an even lamp of E r²/4", 0.05, |point| {
            0.25 * 0.0025 * from_lamp(point, DVec3::ZERO)
        });
    let unlit = || floor(0.5).mirror(upright());
    for height in [0.0, 1e-12, -1e-12] {
        t.case("light-in-the-receivers-plane")
            .bake(unlit().lamp(dvec3(-0.4, height, 0.1)), 0.02, 32)
            .arrives_of_sent(1e-9);
    }
    t.case("sun-parallel-to-the-receiver")
        .bake(unlit().sun(DVec3::X), 0.02, 32)
        .arrives(1e-12);
    // Rays towards the mirror have no way before them: they are met at no distance, or not at all.
    t.case("lamp-on-a-mirror")
        .bake(unlit().lamp(dvec3(0.6, 0.75, 0.1)), 0.02, 32)
        .arrives(2.0 * PI);
    let near = dvec3(0.6 - 1e-9, 0.75, 0.1);
    t.case("lamp-a-nanometre-before-a-mirror")
        .bake(unlit().lamp(near), 0.01, 32)
        .e_of_lamp("that of the lamp", 0.01, near);
    let closed = shapes::sphere(DVec3::Y, 0.3, 3);
    t.case("lamp-in-a-closed-mirror")
        .bake(floor(0.5).mirror(closed).lamp(dvec3(0.05, 1.0, 0.02)), 0.05, 32)
        .arrives(0.0)
        .measure("rays", 0.0, |bake| bake.result.counts.rays as f64);
    for material in [parts::dielectric("glass", 1.5), parts::mirror()] {
        let block = shapes::cuboid(dvec3(0.1, 0.2, 0.1), dvec3(0.4, 0.6, 0.4));
        let scene = floor(0.5).with("block", block, material.clone());
        t.case(format!("lamp-at-a-corner-of-{}", material.name))
            .bake(scene.lamp(dvec3(0.1, 0.6, 0.1)), 0.02, 16)
            .arrives(4.0 * PI);
        t.case(format!("normals-behind-facets-of-{}", material.name))
            .bake(normals_behind_facets(material), 0.02, 16)
            .arrives_of_sent(1.0);
    }
    // Far thinner than a cell, a hair is found or it is missed: its shadow is right to its own width.
    t.case("hair-before-a-mirror")
        .bake(blocked(&[]), 0.01, 32)
        .watts(0.5_f64.sqrt(), 1e-6)
        .bake(
            blocked(&[shapes::floor([0.1001, 0.1002], [0.9, 2.1], 0.5)]),
            0.03,
            32,
        )
        .compare(
            "shadow of the hair, of all light, less its width",
            1.0001e-4,
            |shaded, open| ((deposited_w(open) - deposited_w(shaded)) / 0.5_f64.sqrt() - 1e-4).abs(),
        );
    t.case("pinhole-before-a-mirror")
        .bake(blocked(&plates_around_a_hole()), 0.005, 32)
        .watts(4e-6 * 0.5_f64.sqrt(), 0.15);
    t.case("rough-lobe-below-the-horizon")
        .bake_with(rough_at_grazing(), photons(1e4, 16))
        .must("light reaches the wall", |bake| deposited_w(bake) > 0.0)
        .measure("goes through to the floor, W", 1e-9, |bake| {
            floor_map(bake).map_or(0.0, |map| map.flux_w(LayerKind::Caustic).luminance())
        });
}

fn depth(max_depth: u32, settings: BakeSettings) -> BakeSettings {
    set(settings, |s| s.max_depth = Some(max_depth))
}

/// Share of the light that is missing in the middle texel of the floor.
fn beyond_the_middle(bake: &Baked, whole_w: f64) -> f64 {
    let map = floor_map(bake).expect("a lit floor");
    let middle = map.height() / 2 * map.width() + map.width() / 2;
    let e = luminance(map, LayerKind::Caustic)[middle];
    (1.0 - e * map.chart.texel_area_m2(middle) / whole_w).abs()
}

/// z² + x² = 4f(y + f): a sun from above meets in one point of the floor's lower side.
pub fn paraboloid() -> Scene {
    let mirror = shapes::sheet(64, 64, |u, v| {
        let (x, z) = (0.8 * (u - 0.5) + 1.0, 0.8 * (v - 0.5));
        let normal = dvec3(-0.5 * x, 1.0, -0.5 * z).normalize();
        (dvec3(x, 0.25 * (x * x + z * z) - 1.0, z), normal)
    });
    floor(0.5).mirror(mirror).sun(DVec3::NEG_Y)
}

/// A part of an ellipsoid with one focus at a lamp, the other in the floor's middle, and half an axis of 1 m.
fn ellipsoid(lamp_at: DVec3) -> Mesh {
    let half_distance_m = 0.5 * lamp_at.length();
    shapes::sheet(48, 48, |u, v| {
        let direction = dvec3(0.6 * (u - 0.5) + 0.3, 1.0, 0.6 * (v - 0.5)).normalize();
        let cosine = direction.dot(-lamp_at.normalize());
        let reach = (1.0 - half_distance_m * half_distance_m) / (1.0 - half_distance_m * cosine);
        let point = lamp_at + direction * reach;
        (point, (-direction - point.normalize()).normalize())
    })
}

/// A flat mirror whose normals send what falls on x to x² of a ceiling: the fold at 0 is a border of texels and of
/// cells, and E there is 1/√x.
fn fold_on_a_texel_border() -> Scene {
    let mirror = shapes::sheet(256, 1, |u, v| {
        let x = u - 0.5;
        let turn = 0.5 * (x * x - x).atan();
        (dvec3(x, 0.0, 0.5 + v), dvec3(turn.sin(), turn.cos(), 0.0))
    });
    let ceiling = shapes::floor([-0.25, 0.25], [-0.25, 0.25], 1.0);
    Scene::default()
        .diffuse("floor", ceiling)
        .mirror(mirror)
        .sun(dvec3(0.0, -1.0, -1.0))
}

/// The mean of E over a quarter of a texel: 1/√x has a pole, its integral has none.
fn beside_the_fold(point: DVec3) -> f64 {
    let half_m = 0.5 * 0.5 / 64.0 / 4.0;
    let root = |x: f64| 2.0 * x.max(0.0).sqrt();
    0.5_f64.sqrt() * (root(point.x + half_m) - root(point.x - half_m)) / (2.0 * half_m)
}

/// Light on the columns with x below 0, of all that there is.
fn dark_side(bake: &Baked) -> f64 {
    let map = floor_map(bake).expect("a lit floor");
    let values = luminance(map, LayerKind::Caustic);
    let is_dark = |texel: usize| texel % map.width() < map.width() / 2;
    let dark = values.iter().enumerate().filter(|(texel, _)| is_dark(*texel));
    dark.map(|(_, e)| e).sum::<f64>() / values.iter().sum::<f64>()
}

/// Two parallel mirrors above a floor.
fn hall() -> Scene {
    let wall = |x: f64| shapes::rectangle(dvec3(x, 1.0, 0.0), DVec3::Z * 3.0, DVec3::Y * 1.0);
    floor(0.5).mirror(wall(-0.5)).mirror(wall(0.5))
}

const HALL_LAMP: DVec3 = dvec3(0.1, 1.0, 0.0);

fn all_mirrored(point: DVec3) -> f64 {
    let image = |n: i32| {
        let x = f64::from(n) + if n % 2 == 0 { HALL_LAMP.x } else { -HALL_LAMP.x };
        from_lamp(point, HALL_LAMP.with_x(x))
    };
    (1..2000).map(|n| image(n) + image(-n)).sum()
}

/// A box of mirrors around a lamp and a small floor.
fn box_of_mirrors(reflectance: f64) -> Scene {
    let silver = Material {
        base_colour: LinearSrgb::grey(reflectance),
        ..parts::mirror()
    };
    let hall = shapes::cuboid(dvec3(-0.5, -0.2, -0.5), dvec3(0.5, 1.0, 0.5));
    floor(0.1).with("hall", hall, silver).lamp(BOX_LAMP)
}

const BOX_LAMP: DVec3 = dvec3(-0.2, 0.7, 0.1);

fn ball_in_the_box(levels: u32) -> Mesh {
    shapes::sphere(dvec3(0.1, 0.5, 0.0), 0.2, levels)
}

fn hall_with_a_ball() -> Scene {
    let hall = shapes::cuboid(dvec3(-0.5, -0.1, -0.5), dvec3(0.5, 1.0, 0.5));
    floor(0.4)
        .mirror(hall)
        .glass(1.5, ball_in_the_box(3))
        .lamp(dvec3(-0.2, 0.8, 0.1))
}

/// A sun on a flat mirror that lights a ceiling, with something opaque in its way.
fn blocked(blockers: &[Mesh]) -> Scene {
    let ceiling = shapes::floor([-0.6, 0.6], [-0.6, 0.6], 1.0);
    let mirror = shapes::floor([-0.5, 0.5], [0.5, 1.5], 0.0);
    let open = Scene::default()
        .diffuse("floor", ceiling)
        .mirror(mirror)
        .sun(dvec3(0.0, -1.0, -1.0));
    let black = || parts::matte("black", LinearSrgb::BLACK);
    blockers
        .iter()
        .fold(open, |scene, mesh| scene.with("blocker", mesh.clone(), black()))
}

/// Four plates that leave a hole of 2 × 2 mm open.
fn plates_around_a_hole() -> [Mesh; 4] {
    let (x, z) = ([0.012, 0.014], [2.216, 2.218]);
    let plate = |x, z| shapes::floor(x, z, 1.2);
    [
        plate([-2.0, x[0]], [-2.0, 5.0]),
        plate([x[1], 2.0], [-2.0, 5.0]),
        plate(x, [-2.0, z[0]]),
        plate(x, [z[1], 5.0]),
    ]
}

/// Vertex normals that point away from the light that the facet sees.
fn normals_behind_facets(material: Material) -> Scene {
    let mut random = random(3);
    let mut sheet = shapes::sheet(6, 6, |u, v| (dvec3(u - 0.5, 0.6, v - 0.5), DVec3::Y));
    for normal in &mut sheet.normals {
        *normal = dvec3(random() - 0.5, 0.4 * (random() - 0.5), random() - 0.5).normalize();
    }
    let lamps = floor(0.5)
        .with("sheet", sheet, material)
        .lamp(dvec3(0.1, 1.5, 0.2));
    lamps.lamp(dvec3(0.1, 0.2, 0.2))
}

/// A rough mirror under a sun a degree above it: some of its micro-facets would send light through it.
fn rough_at_grazing() -> Scene {
    let rough = Material {
        roughness: 0.5,
        ..parts::mirror()
    };
    let wall = shapes::rectangle(dvec3(0.8, 0.5, 0.0), DVec3::Z * 0.6, DVec3::Y * 0.6);
    let (sine, cosine) = 1.0_f64.to_radians().sin_cos();
    let sheet = shapes::floor([-0.5, 0.5], [-0.5, 0.5], 0.3);
    floor(0.5)
        .with("sheet", sheet, rough)
        .diffuse("wall", wall)
        .sun(dvec3(cosine, -sine, 0.0))
}
