//! Mirrors: foci, folds, halls without end, and light that hardly touches.

use std::f64::consts::PI;

use glam::DVec3;

use super::laws::{
    against_theory, deposited_w, emitted_w, estimates, luminance, map_of, off, solid_angle_sr,
};
use super::scenes::{ONE_W_PER_SR, at, from_lamp, lamp, sun, upright_mirror};
use super::{Bench, Case, Effort, Group};
use crate::error::Result;
use crate::geometry::Ray;
use crate::illumination::compare::Grid;
use crate::optics::LinearSrgb;
use crate::scene::builtin::{self, parts, shapes};
use crate::scene::{Material, Scene};
use crate::session::BakeResult;
use crate::settings::{BakeSettings, Estimator, LayerKind};
use crate::transport::{MediumStack, Tracer};

/// Cases of mirrors.
pub const CASES: &[Case] = &[
    Case::quick("focus-paraboloid", Group::Optics, focus_of_paraboloid),
    Case::quick("focus-ellipsoid", Group::Optics, focus_of_ellipsoid),
    Case::quick("fold-on-a-texel-border", Group::Optics, fold_on_a_texel_border),
    Case::quick("fold-and-cusp", Group::Optics, fold_and_cusp),
    Case::quick("hall-of-mirrors", Group::Optics, hall_of_mirrors),
    Case::quick("mirror-box", Group::Optics, mirror_box),
    Case::quick("mirror-box-10000-bounces", Group::Optics, ten_thousand_bounces),
    Case::quick("mirror-box-with-glass", Group::Optics, mirror_box_with_glass),
    Case::quick("facing-convex-mirrors", Group::Optics, facing_convex_mirrors),
    Case::quick("rays-parallel-to-the-receiver", Group::Optics, even_scatter),
    Case::quick("light-in-the-receivers-plane", Group::Optics, light_in_the_plane),
    Case::quick("sun-parallel-to-the-receiver", Group::Optics, parallel_sun),
    Case::quick("lamp-on-a-mirror", Group::Optics, lamp_on_a_mirror),
    Case::quick("lamp-on-a-vertex", Group::Optics, lamp_on_a_vertex),
    Case::quick("lamp-in-a-closed-mirror", Group::Optics, lamp_in_a_closed_mirror),
    Case::quick("hair-before-a-mirror", Group::Optics, hair),
    Case::quick("pinhole-before-a-mirror", Group::Optics, pinhole),
    Case::quick(
        "normals-behind-their-facets",
        Group::Optics,
        normals_behind_facets,
    ),
    Case::quick("rough-lobe-below-the-horizon", Group::Optics, rough_at_grazing),
];

/// Share of the light of a map that lies beyond its middle texel; 1 where there is no map.
fn beyond_the_middle(bench: &BakeResult, scene: &Scene, whole_w: f64) -> f64 {
    let Some(map) = map_of(bench, scene, "floor") else {
        return 1.0;
    };
    let middle = map.height() / 2 * map.width() + map.width() / 2;
    let e = luminance(Some(map), LayerKind::Caustic)[middle];
    (1.0 - e * map.chart.texel_area_m2(middle) / whole_w).abs()
}

/// z² + x² = 4f(y + f): a sun from above meets in one point of the floor's lower side.
pub fn paraboloid() -> Scene {
    let mut scene = parts::reference_scene(0.5);
    let mirror = shapes::sheet(64, 64, |u, v| {
        let (x, z) = (0.8 * (u - 0.5) + 1.0, 0.8 * (v - 0.5));
        let normal = DVec3::new(-0.5 * x, 1.0, -0.5 * z).normalize();
        (DVec3::new(x, 0.25 * (x * x + z * z) - 1.0, z), normal)
    });
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    sun(&mut scene, DVec3::NEG_Y);
    scene
}

fn focus_of_paraboloid(bench: &mut Bench) -> Result<()> {
    let scene = paraboloid();
    let result = bench.bake(&scene, &at(400.0, 33))?;
    bench.law(
        "what arrives is E times the aperture",
        off(deposited_w(&result), 0.64),
        1e-3,
    );
    bench.law(
        "all of it lies in the texel of the focus",
        beyond_the_middle(&result, &scene, 0.64),
        1e-3,
    );
    Ok(())
}

/// A lamp in one focus of an ellipsoid, the floor's middle in the other.
fn focus_of_ellipsoid(bench: &mut Bench) -> Result<()> {
    let (lamp_at, half_axis_m) = (DVec3::new(0.8, 0.5, 0.0), 1.0);
    let half_distance_m = 0.5 * lamp_at.length();
    let mirror = shapes::sheet(48, 48, |u, v| {
        let direction = DVec3::new(0.6 * (u - 0.5) + 0.3, 1.0, 0.6 * (v - 0.5)).normalize();
        let cosine = direction.dot(-lamp_at.normalize());
        let reach = (half_axis_m * half_axis_m - half_distance_m * half_distance_m)
            / (half_axis_m - half_distance_m * cosine);
        let point = lamp_at + direction * reach;
        (point, (-direction - point.normalize()).normalize())
    });
    let mut scene = parts::reference_scene(0.5);
    let watts = solid_angle_sr(&mirror, lamp_at);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    lamp(&mut scene, lamp_at);
    let result = bench.bake(&scene, &at(2e3, 33))?;
    bench.law(
        "what arrives is I times the solid angle",
        off(deposited_w(&result), watts),
        1e-3,
    );
    bench.law(
        "all of it lies in the texel of the focus",
        beyond_the_middle(&result, &scene, watts),
        1e-3,
    );
    Ok(())
}

/// A flat mirror whose normals send what falls on x to x² of a ceiling: the fold at 0 is a border of texels and of
/// cells, and E there is 1/√x.
fn fold_on_a_texel_border(bench: &mut Bench) -> Result<()> {
    let mut scene = Scene::default();
    let ceiling = shapes::floor([-0.25, 0.25], [-0.25, 0.25], 1.0);
    parts::add(
        &mut scene,
        "floor",
        ceiling,
        parts::matte("ceiling", LinearSrgb::WHITE),
    );
    let mirror = shapes::sheet(256, 1, |u, v| {
        let x = u - 0.5;
        let turn = 0.5 * (x * x - x).atan();
        (
            DVec3::new(x, 0.0, 0.5 + v),
            DVec3::new(turn.sin(), turn.cos(), 0.0),
        )
    });
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    sun(&mut scene, DVec3::new(0.0, -1.0, -1.0));
    let theory = |e: DVec3| {
        // The mean over a quarter of a texel: 1/√x has a pole, its integral has none.
        let half_m = 0.5 * 0.5 / 64.0 / 4.0;
        let root = |x: f64| 2.0 * x.max(0.0).sqrt();
        0.5_f64.sqrt() * (root(e.x + half_m) - root(e.x - half_m)) / (2.0 * half_m)
    };
    let fine = bench.bake(&scene, &at(4e3, 64))?;
    let coarse = bench.bake(&scene, &at(4e3, 32))?;
    bench.law(
        "E is 1/√x beside the fold",
        against_theory(&fine, &scene, "floor", theory),
        0.03,
    );
    bench.law("no light on the dark side", dark_side(&fine, &scene), 1e-3);
    let off = pooled(&fine, &coarse, &scene) / estimates(&fine, &coarse);
    bench.law(
        "texels in fours make the coarser map, over both estimated errors",
        off,
        1.0,
    );
    Ok(())
}

/// Light on the columns with x below 0, of all that there is.
fn dark_side(result: &BakeResult, scene: &Scene) -> f64 {
    let map = map_of(result, scene, "floor");
    let width = map.map_or(1, |map| map.width());
    let values = luminance(map, LayerKind::Caustic);
    let all: f64 = values.iter().sum();
    let dark = values
        .iter()
        .enumerate()
        .filter(|(texel, _)| texel % width < width / 2);
    dark.map(|(_, e)| e).sum::<f64>() / all
}

/// Relative RMSE between a floor's map, its texels pooled in fours, and the same of half the size.
fn pooled(fine: &BakeResult, coarse: &BakeResult, scene: &Scene) -> f64 {
    let grid = |result: &BakeResult| {
        let map = map_of(result, scene, "floor")?;
        Some(Grid {
            width: map.width(),
            height: map.height(),
            values: luminance(Some(map), LayerKind::Caustic),
        })
    };
    let compared = grid(fine).zip(grid(coarse)).and_then(|(fine, coarse)| {
        let pooled = fine.box_averaged(2, 2)?;
        crate::illumination::compare::relative_rmse(&pooled.values, &coarse.values)
    });
    compared.unwrap_or(f64::INFINITY)
}

/// The caustic of the coffee cup, with its fold and its cusp, and that of a ring.
fn fold_and_cusp(bench: &mut Bench) -> Result<()> {
    for name in ["nephroid", "ring"] {
        let Some(scene) = builtin::build(name) else {
            continue;
        };
        let fine = bench.bake(&scene, &at(4e3, 64))?;
        let coarse = bench.bake(&scene, &at(4e3, 32))?;
        let off = pooled(&fine, &coarse, &scene) / estimates(&fine, &coarse);
        bench.law(
            "texels in fours make the coarser map, over both estimated errors",
            off,
            1.0,
        );
    }
    Ok(())
}

/// Two parallel mirrors with a lamp between them: E is the sum over all mirrored lamps.
fn hall_of_mirrors(bench: &mut Bench) -> Result<()> {
    let mut scene = parts::reference_scene(0.5);
    for side in [-0.5, 0.5] {
        let wall = shapes::rectangle(DVec3::new(side, 1.0, 0.0), DVec3::Z * 3.0, DVec3::Y * 1.0);
        parts::add(&mut scene, "mirror", wall, parts::mirror());
    }
    let lamp_at = DVec3::new(0.1, 1.0, 0.0);
    lamp(&mut scene, lamp_at);
    let settings = BakeSettings {
        max_depth: 40,
        ..at(1e3, 32)
    };
    let result = bench.bake(&scene, &settings)?;
    let theory = |point: DVec3| {
        let image = |n: i32| {
            let x = f64::from(n) + if n % 2 == 0 { lamp_at.x } else { -lamp_at.x };
            from_lamp(point, DVec3::new(x, lamp_at.y, lamp_at.z))
        };
        (1..2000).map(|n| image(n) + image(-n)).sum()
    };
    let off = against_theory(&result, &scene, "floor", theory);
    bench.law("E is that of all mirrored lamps", off, 0.01);
    Ok(())
}

/// A box of mirrors around a lamp and a small floor.
fn box_of_mirrors(reflectance: f64) -> Scene {
    let mut scene = parts::reference_scene(0.1);
    let hall = shapes::cuboid(DVec3::new(-0.5, -0.2, -0.5), DVec3::new(0.5, 1.0, 0.5));
    let silver = Material {
        base_colour: LinearSrgb::grey(reflectance),
        ..parts::mirror()
    };
    parts::add(&mut scene, "hall", hall, silver);
    lamp(&mut scene, DVec3::new(-0.2, 0.7, 0.1));
    scene
}

/// A closed box of mirrors: nothing leaves, and what perfect mirrors do not keep, arrives.
fn mirror_box(bench: &mut Bench) -> Result<()> {
    let splats = |depth: u32| BakeSettings {
        estimator: Estimator::Splat,
        sigma: Estimator::Splat.default_sigma(),
        max_depth: depth,
        branch_threshold: Some(0.0),
        ..at(40.0, 16)
    };
    for reflectance in [1.0, 0.9] {
        let scene = box_of_mirrors(reflectance);
        let result = bench.bake(&scene, &splats(10_000))?;
        let energy = result.ledgers[0].energy_w;
        bench.law("nothing escapes", energy.escaped / energy.emitted, 0.0);
        if reflectance == 1.0 {
            bench.law(
                "perfect mirrors take nothing",
                energy.absorbed / energy.emitted,
                0.0,
            );
            // Some paths close upon themselves and never meet the floor.
            let missing = (energy.emitted - energy.deposited) / energy.emitted;
            bench.law(
                "10,000 bounces bring all to the floor but closed paths",
                missing,
                0.01,
            );
        }
        let patches = BakeSettings {
            max_depth: 6,
            ..at(20.0, 16)
        };
        let result = bench.bake(&scene, &patches)?;
        let energy = result.ledgers[0].energy_w;
        bench.law(
            "nothing escapes, by patches",
            energy.escaped / energy.emitted,
            1e-3,
        );
    }
    Ok(())
}

/// One ray in a closed box of mirrors.
fn ten_thousand_bounces(bench: &mut Bench) -> Result<()> {
    let mut scene = box_of_mirrors(1.0);
    scene.objects.remove(0);
    let tracer = Tracer::new(scene.into());
    let rays = if bench.effort == Effort::Long { 1000 } else { 10 };
    let mut random = super::scenes::random(7);
    for _ in 0..rays {
        let direction = DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5).normalize();
        let mut ray = Ray {
            origin: DVec3::new(-0.2, 0.7, 0.1),
            direction,
        };
        let mut share = LinearSrgb::WHITE;
        for _ in 0..10_000 {
            let Some(hit) = tracer.closest_hit(&ray) else {
                share = LinearSrgb::BLACK;
                break;
            };
            let turned = tracer.interact(&hit, ray.direction, &MediumStack::default());
            let Some(branch) = turned.reflection else {
                share = LinearSrgb::BLACK;
                break;
            };
            share = share * branch.share;
            ray = branch.ray;
        }
        bench.law(
            "no ray leaves, none is weaker",
            (1.0 - share.max_channel()).abs(),
            0.0,
        );
        bench.law(
            "directions stay unit",
            (ray.direction.length() - 1.0).abs(),
            1e-14,
        );
        // Reflections in the six sides only change signs.
        let kept = (ray.direction.abs() - direction.abs()).abs().max_element();
        bench.law("directions but for their signs", kept, 1e-11);
    }
    Ok(())
}

/// A glass ball in a closed box of mirrors divides every ray again and again.
fn mirror_box_with_glass(bench: &mut Bench) -> Result<()> {
    let mut scene = box_of_mirrors(1.0);
    let ball = shapes::sphere(DVec3::new(0.1, 0.5, 0.0), 0.2, 2);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let settings = BakeSettings {
        estimator: Estimator::Splat,
        sigma: Estimator::Splat.default_sigma(),
        max_depth: 1000,
        branch_threshold: Some(1e-3),
        ..at(20.0, 16)
    };
    let result = bench.bake(&scene, &settings)?;
    let energy = result.ledgers[0].energy_w;
    bench.law("nothing escapes", energy.escaped / energy.emitted, 0.0);
    bench.must(
        "branches end, and what they carried is booked",
        energy.truncated.threshold > 0.0,
    );
    // Branches share the light: those above the threshold are no more than one over it at any depth.
    let segments = result.counts.segments as f64 / result.counts.rays as f64;
    bench.law(
        "segments a ray, of depth over threshold",
        segments / (1000.0 / 1e-3),
        1.0,
    );
    Ok(())
}

/// Two convex mirrors that face each other spread light like eⁿ.
fn facing_convex_mirrors(bench: &mut Bench) -> Result<()> {
    let mut scene = parts::reference_scene(0.5);
    for side in [-1.0, 1.0] {
        let ball = shapes::sphere(DVec3::new(0.5 * side, 0.5, 0.0), 0.4, 4);
        parts::add(&mut scene, "ball", ball, parts::mirror());
    }
    lamp(&mut scene, DVec3::new(0.0, 0.5, 0.01));
    let result = bench.bake(&scene, &at(1e3, 32))?;
    let energy = result.ledgers[0].energy_w;
    bench.law(
        "what is given up",
        energy.truncated.total().abs() / energy.emitted,
        0.01,
    );
    bench.must(
        "light arrives and light escapes",
        energy.deposited > 0.0 && energy.escaped > 0.0,
    );
    Ok(())
}

/// A mirror ball sends a sun's light evenly into all directions, those parallel to the floor among them.
fn even_scatter(bench: &mut Bench) -> Result<()> {
    let mut scene = Scene::default();
    let floor = shapes::floor([-30.0, 30.0], [-30.0, 30.0], -3.0);
    parts::add(
        &mut scene,
        "floor",
        floor,
        parts::matte("floor", LinearSrgb::WHITE),
    );
    let radius_m = 0.05;
    parts::add(
        &mut scene,
        "ball",
        shapes::sphere(DVec3::ZERO, radius_m, 5),
        parts::mirror(),
    );
    sun(&mut scene, DVec3::X);
    let reach_m = 40.0_f64;
    let result = bench.bake(&scene, &at(4e5 * reach_m * reach_m, 32))?;
    let intensity = 0.25 * radius_m * radius_m;
    let all = PI * radius_m * radius_m;
    bench.law(
        "the ball's cross-section is lit",
        off(emitted_w(&result), all),
        2e-3,
    );
    let theory = |point: DVec3| intensity * from_lamp(point, DVec3::ZERO);
    bench.law(
        "E is that of an even lamp of E r²/4",
        against_theory(&result, &scene, "floor", theory),
        0.05,
    );
    Ok(())
}

/// A mirrored lamp in the very plane of the floor gives it nothing.
fn light_in_the_plane(bench: &mut Bench) -> Result<()> {
    for height in [0.0, 1e-12, -1e-12] {
        let mut scene = upright_mirror();
        scene.lights.clear();
        lamp(&mut scene, DVec3::new(-0.4, height, 0.1));
        let result = bench.bake(&scene, &at(500.0, 32))?;
        let share = deposited_w(&result) / emitted_w(&result).max(f64::MIN_POSITIVE);
        bench.law("no more of it than E allows", share, 1e-9);
    }
    Ok(())
}

/// A sun along the floor, by way of a mirror.
fn parallel_sun(bench: &mut Bench) -> Result<()> {
    let mut scene = upright_mirror();
    scene.lights.clear();
    sun(&mut scene, DVec3::X);
    let result = bench.bake(&scene, &at(500.0, 32))?;
    bench.law("the floor gets nothing", deposited_w(&result), 1e-12);
    Ok(())
}

/// A lamp on a mirror sees its one half of all directions reflected: the mirror makes it twice as bright.
fn lamp_on_a_mirror(bench: &mut Bench) -> Result<()> {
    let mut scene = upright_mirror();
    scene.lights.clear();
    lamp(&mut scene, DVec3::new(0.6, 0.75, 0.1));
    let result = bench.bake(&scene, &at(500.0, 32))?;
    // Rays towards the mirror have no way before them: they are met at no distance, or not at all.
    bench.law("no more than half the lamp", deposited_w(&result), 2.0 * PI);
    let mut near = upright_mirror();
    near.lights.clear();
    let lamp_at = DVec3::new(0.6 - 1e-9, 0.75, 0.1);
    lamp(&mut near, lamp_at);
    let result = bench.bake(&near, &at(2e3, 32))?;
    let theory = |point: DVec3| from_lamp(point, lamp_at);
    bench.law(
        "a nanometre before it, E is that of the lamp",
        against_theory(&result, &near, "floor", theory),
        0.01,
    );
    Ok(())
}

/// A lamp at a corner of a glass prism, and of a mirror.
fn lamp_on_a_vertex(bench: &mut Bench) -> Result<()> {
    for material in [parts::dielectric("glass", 1.5), parts::mirror()] {
        let mut scene = parts::reference_scene(0.5);
        let block = shapes::cuboid(DVec3::new(0.1, 0.2, 0.1), DVec3::new(0.4, 0.6, 0.4));
        parts::add(&mut scene, "block", block, material);
        lamp(&mut scene, DVec3::new(0.1, 0.6, 0.1));
        let result = bench.bake(&scene, &at(60.0, 16))?;
        bench.law(
            "no more arrives than the lamp sends",
            deposited_w(&result) / ONE_W_PER_SR.0,
            1.0,
        );
    }
    Ok(())
}

/// Light in a ball of mirrors never gets out.
fn lamp_in_a_closed_mirror(bench: &mut Bench) -> Result<()> {
    let mut scene = parts::reference_scene(0.5);
    parts::add(
        &mut scene,
        "ball",
        shapes::sphere(DVec3::Y, 0.3, 3),
        parts::mirror(),
    );
    lamp(&mut scene, DVec3::new(0.05, 1.0, 0.02));
    let result = bench.bake(&scene, &at(500.0, 32))?;
    bench.law("nothing comes out", deposited_w(&result), 0.0);
    bench.law("no ray is spent", result.counts.rays as f64, 0.0);
    Ok(())
}

/// A sun on a flat mirror that lights a ceiling, with something opaque in its way.
fn blocked(blockers: &[crate::scene::Mesh]) -> Scene {
    let mut scene = Scene::default();
    let ceiling = shapes::floor([-0.6, 0.6], [-0.6, 0.6], 1.0);
    parts::add(
        &mut scene,
        "floor",
        ceiling,
        parts::matte("ceiling", LinearSrgb::WHITE),
    );
    let mirror = shapes::floor([-0.5, 0.5], [0.5, 1.5], 0.0);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    for (index, mesh) in blockers.iter().enumerate() {
        let name = format!("blocker {index}");
        parts::add(
            &mut scene,
            &name,
            mesh.clone(),
            parts::matte("black", LinearSrgb::BLACK),
        );
    }
    sun(&mut scene, DVec3::new(0.0, -1.0, -1.0));
    scene
}

/// A hair a tenth of a millimetre thick: its shadow is as wide as it is.
fn hair(bench: &mut Bench) -> Result<()> {
    let open = bench.bake(&blocked(&[]), &at(4e3, 32))?;
    let hair = shapes::floor([0.1001, 0.1002], [0.9, 2.1], 0.5);
    let shaded = bench.bake(&blocked(&[hair]), &at(4e3, 32))?;
    let all = 0.5_f64.sqrt();
    bench.law("without it, all arrives", off(deposited_w(&open), all), 1e-6);
    // Far thinner than a cell, it is found or it is missed.
    let lost = (deposited_w(&open) - deposited_w(&shaded)) / all;
    bench.law(
        "its shadow is right to its own width, of all light",
        (lost - 1e-4).abs(),
        1.0001e-4,
    );
    Ok(())
}

/// A plate with a hole of two millimetres.
fn pinhole(bench: &mut Bench) -> Result<()> {
    let (middle, half) = (DVec3::new(0.013, 1.2, 2.217), 0.001);
    let plate = |x: [f64; 2], z: [f64; 2]| shapes::floor(x, z, middle.y);
    let (x, z) = (
        [middle.x - half, middle.x + half],
        [middle.z - half, middle.z + half],
    );
    let plates = [
        plate([-2.0, x[0]], [-2.0, 5.0]),
        plate([x[1], 2.0], [-2.0, 5.0]),
        plate(x, [-2.0, z[0]]),
        plate(x, [z[1], 5.0]),
    ];
    let result = bench.bake(&blocked(&plates), &at(5e7, 32))?;
    let watts = 4.0 * half * half * 0.5_f64.sqrt();
    bench.law(
        "what comes through is E times the hole",
        off(deposited_w(&result), watts),
        0.15,
    );
    Ok(())
}

/// Vertex normals that point away from the light that the facet sees.
fn normals_behind_facets(bench: &mut Bench) -> Result<()> {
    let mut random = super::scenes::random(3);
    for material in [parts::mirror(), parts::dielectric("glass", 1.5)] {
        let mut mesh = shapes::sheet(6, 6, |u, v| (DVec3::new(u - 0.5, 0.6, v - 0.5), DVec3::Y));
        for normal in &mut mesh.normals {
            *normal = DVec3::new(random() - 0.5, 0.4 * (random() - 0.5), random() - 0.5).normalize();
        }
        let mut scene = parts::reference_scene(0.5);
        parts::add(&mut scene, "sheet", mesh, material);
        lamp(&mut scene, DVec3::new(0.1, 1.5, 0.2));
        lamp(&mut scene, DVec3::new(0.1, 0.2, 0.2));
        let result = bench.bake(&scene, &at(100.0, 16))?;
        let share = deposited_w(&result) / emitted_w(&result);
        bench.law("no more arrives than was sent", share, 1.0);
    }
    Ok(())
}

/// A rough mirror under a sun a degree above it: some of its micro-facets would send light through it.
fn rough_at_grazing(bench: &mut Bench) -> Result<()> {
    let rough = Material {
        roughness: 0.5,
        ..parts::mirror()
    };
    let mut scene = parts::reference_scene(0.5);
    let sheet = shapes::floor([-0.5, 0.5], [-0.5, 0.5], 0.3);
    parts::add(&mut scene, "sheet", sheet, rough);
    scene.lights.clear();
    let (sine, cosine) = 1.0_f64.to_radians().sin_cos();
    sun(&mut scene, DVec3::new(cosine, -sine, 0.0));
    let wall = shapes::rectangle(DVec3::new(0.8, 0.5, 0.0), DVec3::Z * 0.6, DVec3::Y * 0.6);
    parts::add(&mut scene, "wall", wall, parts::matte("wall", LinearSrgb::WHITE));
    let settings = BakeSettings {
        wavefronts: Some(8),
        ..at(500.0, 16)
    };
    let result = bench.bake(&scene, &settings)?;
    bench.law(
        "nothing goes through to the floor",
        map_flux(&result, &scene),
        1e-9,
    );
    bench.must("light reaches the wall", deposited_w(&result) > 0.0);
    Ok(())
}

/// Caustic light on the floor [W].
fn map_flux(result: &BakeResult, scene: &Scene) -> f64 {
    map_of(result, scene, "floor").map_or(0.0, |map| map.flux_w(LayerKind::Caustic).luminance())
}
