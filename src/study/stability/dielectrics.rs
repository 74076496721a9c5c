//! Glass and water: every angle, every index, and bodies in bodies.

use glam::DVec3;

use super::laws::{against_theory, apart, deposited_w, emitted_w, estimates, luminance, map_of, off};
use super::scenes::{at, from_lamp, glass_ball, lamp, sun, thoroughly, under_slab};
use super::{Bench, Case, Group};
use crate::error::Result;
use crate::optics::fresnel::dielectric_reflectance;
use crate::optics::refraction::{cos_transmitted, refract};
use crate::optics::wavelength::VISIBLE;
use crate::optics::{LinearSrgb, Nanometres, glass};
use crate::scene::builtin::{parts, shapes};
use crate::scene::{Material, Scene, Volume, contact};
use crate::session::BakeResult;
use crate::settings::{BakeSettings, LayerKind};

/// Cases of glass.
pub const CASES: &[Case] = &[
    Case::quick("normal-incidence", Group::Optics, normal_incidence),
    Case::quick("every-angle", Group::Optics, every_angle),
    Case::quick("grazing-sun", Group::Optics, grazing_sun),
    Case::quick("critical-angle", Group::Optics, critical_angle),
    Case::quick("index-1", Group::Optics, index_one),
    Case::quick("index-from-below-1-to-10", Group::Optics, any_index),
    Case::quick("slab-of-a-micrometre", Group::Optics, thin_slab),
    Case::quick("axes-and-signed-zeros", Group::Optics, axes),
    Case::quick("glass-in-the-same-glass", Group::Optics, nested_alike),
    Case::quick("touching-glass", Group::Optics, touching),
    Case::quick("overlapping-glass", Group::Optics, overlapping),
    Case::quick("open-glass", Group::Optics, open_volume),
    Case::quick("lamp-in-clear-glass", Group::Optics, lamp_in_glass),
    Case::quick("lamp-in-tinted-glass", Group::Optics, lamp_in_tinted_glass),
    Case::quick("lamp-in-nested-glass", Group::Optics, lamp_in_nested_glass),
    Case::quick("dispersion-beyond-its-formula", Group::Optics, ends_of_formulas),
];

/// Share of light that passes a slab of both its surfaces' reflectance `single` at last.
fn slab_transmittance(single: f64) -> f64 {
    (1.0 - single) / (1.0 + single)
}

fn normal_reflectance(ior: f64) -> f64 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

/// A sun straight down on a slab: every path meets it along its normal.
fn normal_incidence(bench: &mut Bench) -> Result<()> {
    let mut scene = under_slab(1.5);
    sun(&mut scene, DVec3::NEG_Y);
    let result = bench.bake(&scene, &thoroughly(100.0, 32))?;
    let expected = slab_transmittance(normal_reflectance(1.5));
    let off = against_theory(&result, &scene, "floor", |_| expected);
    bench.law("E is (1 − R)/(1 + R)", off, 1e-6);
    Ok(())
}

/// Angles [rad] crowded at 0, at 90 degrees and at a given one.
fn angles(critical_rad: f64) -> impl Iterator<Item = f64> {
    let quarter = std::f64::consts::FRAC_PI_2;
    let near = (0..16).flat_map(move |digit| {
        let step = 10.0_f64.powi(-digit);
        [step, quarter - step, critical_rad - step, critical_rad + step]
    });
    near.chain((0..1000).map(move |step| quarter * f64::from(step) / 1000.0))
        .filter(move |angle| (0.0..quarter).contains(angle))
}

/// Fresnel's equations from both sides of an interface (Stokes: both reflect the same share).
fn every_angle(bench: &mut Bench) -> Result<()> {
    for eta in [1.0, 1.0 + 1e-6, 1.0 - 1e-6, 0.7, 1.0 / 1.5, 1.333, 1.5, 3.0, 10.0] {
        let critical_rad = if eta < 1.0 { f64::asin(eta) } else { 1.0 };
        for angle in angles(critical_rad) {
            let cosine = angle.cos();
            let there = dielectric_reflectance(cosine, eta);
            bench.law("R is a share", (there - 0.5).abs(), 0.5);
            let Some(beyond) = cos_transmitted(cosine, eta) else {
                continue;
            };
            let back = dielectric_reflectance(beyond, 1.0 / eta);
            // Next to the critical angle of a weak interface a rounding of cosines moves R by its root, over the cosine.
            bench.law("R is the same from both sides", (there - back).abs(), 1e-4);
            let incident = DVec3::new(angle.sin(), -cosine, 0.0);
            if let Some(direction) = refract(incident, DVec3::Y, eta) {
                bench.law("directions are unit", (direction.length() - 1.0).abs(), 1e-14);
                bench.law(
                    "Snell: sines by their indices",
                    (direction.x * eta - angle.sin()).abs(),
                    1e-8,
                );
            }
        }
    }
    Ok(())
}

/// A sun low above a sheet of water: what enters is (1 − R) of what falls on it.
fn grazing_sun(bench: &mut Bench) -> Result<()> {
    for (elevation_deg, density_per_sr) in [(10.0_f64, 1e4), (1.0, 1e5)] {
        let mut scene = parts::reference_scene(0.5);
        let water = shapes::floor([-3.0, 3.0], [-3.0, 3.0], 0.5);
        parts::add(&mut scene, "water", water, parts::dielectric("water", 1.333));
        let (sine, cosine) = elevation_deg.to_radians().sin_cos();
        sun(&mut scene, DVec3::new(cosine, -sine, 0.0));
        let result = bench.bake(&scene, &at(density_per_sr, 32))?;
        let expected = sine * (1.0 - dielectric_reflectance(sine, 1.333));
        let off = against_theory(&result, &scene, "floor", |_| expected);
        bench.law("E is (1 − R) sin h", off, 1e-6);
    }
    Ok(())
}

/// A sun in water at the angle where nothing gets out any more, less or plus a ten-millionth.
fn critical_angle(bench: &mut Bench) -> Result<()> {
    let ior = 1.5_f64;
    let critical_rad = (1.0 / ior).asin();
    for (step_rad, gets_out) in [(-1e-7, true), (1e-7, false)] {
        let angle_rad = critical_rad + step_rad;
        // Seen from below, an open sheet with its normals up is the surface of what the sun comes through.
        let mut scene = Scene::default();
        let ceiling = shapes::floor([-50.0, 50.0], [-0.5, 0.5], 0.01);
        parts::add(
            &mut scene,
            "floor",
            ceiling,
            parts::matte("ceiling", LinearSrgb::WHITE),
        );
        let sheet = shapes::floor([-0.5, 0.5], [-0.5, 0.5], 0.0);
        parts::add(&mut scene, "sheet", sheet, parts::dielectric("glass", ior));
        sun(&mut scene, DVec3::new(angle_rad.sin(), angle_rad.cos(), 0.0));
        let result = bench.bake(&scene, &at(1e6, 32))?;
        let share = deposited_w(&result) / emitted_w(&result);
        let expected = 1.0 - dielectric_reflectance(angle_rad.cos(), 1.0 / ior);
        if gets_out {
            bench.law("below it, 1 − R gets out", off(share, expected), 1e-6);
        } else {
            bench.law("above it, nothing does", share, 0.0);
        }
    }
    Ok(())
}

/// Glass of the index of air, or nearly so, is not there.
fn index_one(bench: &mut Bench) -> Result<()> {
    let lamp_at = DVec3::new(0.1, 1.5, 0.05);
    for ior in [1.0, 1.0 + 1e-6, 1.0 - 1e-6] {
        let mut scene = under_slab(ior);
        lamp(&mut scene, lamp_at);
        let result = bench.bake(&scene, &at(2e3, 32))?;
        let off = against_theory(&result, &scene, "floor", |point| from_lamp(point, lamp_at));
        bench.law("E is that of the lamp alone", off, 1e-3);
    }
    Ok(())
}

fn any_index(bench: &mut Bench) -> Result<()> {
    for ior in [0.7, 1.0 - 1e-3, 1.0 + 1e-3, 3.0, 10.0] {
        let mut scene = under_slab(ior);
        sun(&mut scene, DVec3::NEG_Y);
        let result = bench.bake(&scene, &thoroughly(100.0, 16))?;
        let expected = slab_transmittance(normal_reflectance(ior));
        bench.law(
            "E is (1 − R)/(1 + R)",
            against_theory(&result, &scene, "floor", |_| expected),
            1e-6,
        );
    }
    Ok(())
}

/// Both surfaces of a film lie a micrometre apart: neither is lost.
fn thin_slab(bench: &mut Bench) -> Result<()> {
    for thickness_m in [1e-3, 1e-6, 1e-9] {
        let mut scene = parts::reference_scene(0.5);
        let slab = shapes::cuboid(
            DVec3::new(-3.0, 0.5, -3.0),
            DVec3::new(3.0, 0.5 + thickness_m, 3.0),
        );
        parts::add(&mut scene, "slab", slab, parts::dielectric("glass", 1.5));
        sun(&mut scene, DVec3::NEG_Y);
        let result = bench.bake(&scene, &thoroughly(100.0, 16))?;
        let expected = slab_transmittance(normal_reflectance(1.5));
        bench.law(
            "E is (1 − R)/(1 + R)",
            against_theory(&result, &scene, "floor", |_| expected),
            1e-6,
        );
    }
    Ok(())
}

/// A sun along each axis, both ways, with zeros of both signs, on a slab and a wall across it.
fn axes(bench: &mut Bench) -> Result<()> {
    for axis in 0..3 {
        for (sign, zero) in [(1.0, 0.0), (-1.0, 0.0), (1.0, -0.0), (-1.0, -0.0)] {
            let mut direction = DVec3::splat(zero);
            direction[axis] = sign;
            let (mut across, mut down) = (DVec3::ZERO, DVec3::ZERO);
            (across[(axis + 1) % 3], down[(axis + 2) % 3]) = (1.0, 1.0);
            let mut scene = Scene::default();
            let wall = shapes::rectangle(direction, across * 0.5, down * 0.5);
            parts::add(&mut scene, "floor", wall, parts::matte("wall", LinearSrgb::WHITE));
            let (low, high) = (
                direction * 0.1 - (across + down),
                direction * 0.3 + (across + down),
            );
            let slab = shapes::cuboid(low.min(high), low.max(high));
            parts::add(&mut scene, "slab", slab, parts::dielectric("glass", 1.5));
            sun(&mut scene, direction);
            let result = bench.bake(&scene, &thoroughly(100.0, 8))?;
            let expected = slab_transmittance(normal_reflectance(1.5));
            let worst = luminance(map_of(&result, &scene, "floor"), LayerKind::Caustic)
                .iter()
                .fold(0.0_f64, |worst, e| worst.max(off(*e, expected)));
            bench.law("E is (1 − R)/(1 + R)", worst, 1e-6);
            bench.law(
                "the wall is lit",
                f64::from(u8::from(result.maps.is_empty())),
                0.0,
            );
        }
    }
    Ok(())
}

/// A ball of glass in a ball of the same glass is not there.
fn nested_alike(bench: &mut Bench) -> Result<()> {
    let alone = glass_ball(4);
    let mut nested = alone.clone();
    let inner = shapes::sphere(DVec3::new(0.05, 0.52, 0.0), 0.15, 3);
    parts::add(&mut nested, "inner", inner, parts::dielectric("glass", 1.5));
    let (a, b) = (
        bench.bake(&alone, &at(4e3, 32))?,
        bench.bake(&nested, &at(4e3, 32))?,
    );
    bench.law("watts as without it", off(deposited_w(&b), deposited_w(&a)), 2e-3);
    bench.law(
        "map as without it, less both errors",
        (apart(&b, &a) - estimates(&a, &b)).max(0.0),
        0.0,
    );
    Ok(())
}

/// Slabs that touch in a face of both, that overlap, or that are one.
fn slabs(borders: &[[f64; 2]]) -> Scene {
    let mut scene = parts::reference_scene(0.5);
    for [low, high] in borders {
        let slab = shapes::cuboid(DVec3::new(-3.0, *low, -3.0), DVec3::new(3.0, *high, 3.0));
        parts::add(&mut scene, "slab", slab, parts::dielectric("glass", 1.5));
    }
    sun(&mut scene, DVec3::new(0.1, -1.0, 0.05));
    scene
}

fn as_one(bench: &mut Bench, borders: &[[f64; 2]]) -> Result<f64> {
    let settings = BakeSettings {
        branch_threshold: Some(1e-4),
        ..at(1e3, 16)
    };
    let one = bench.bake(&slabs(&[[0.3, 0.7]]), &settings)?;
    let several = bench.bake(&slabs(borders), &settings)?;
    Ok(apart(&several, &one))
}

/// Two slabs of one glass with a common face: light passes a gap that is not there, of which a warning tells.
fn touching(bench: &mut Bench) -> Result<()> {
    let scene = slabs(&[[0.3, 0.5], [0.5, 0.7]]);
    let found = contact::touching(&scene);
    bench.must(
        "the common face is found",
        found.get(&(1, 2)).is_some_and(|faces| *faces > 0),
    );
    let apart = slabs(&[[0.3, 0.5], [0.5 + 1e-6, 0.7]]);
    bench.must(
        "a gap of a micrometre is none",
        contact::touching(&apart).is_empty(),
    );
    let off = as_one(bench, &[[0.3, 0.5], [0.5, 0.7]])?;
    bench.law("map as of one slab, a limit of the method", off, 0.2);
    Ok(())
}

fn overlapping(bench: &mut Bench) -> Result<()> {
    let off = as_one(bench, &[[0.3, 0.55], [0.45, 0.7]])?;
    bench.law("map as of one slab", off, 1e-6);
    let off = as_one(bench, &[[0.3, 0.5 + 1e-9], [0.5, 0.7]])?;
    bench.law("map as of one slab, overlapping by a nanometre", off, 1e-6);
    Ok(())
}

/// A body of glass with a face missing.
fn open_volume(bench: &mut Bench) -> Result<()> {
    for missing in 0..12 {
        let mut scene = parts::reference_scene(0.5);
        let mut block = shapes::cuboid(DVec3::new(-0.3, 0.2, -0.3), DVec3::new(0.3, 0.6, 0.3));
        block.triangles.remove(missing);
        parts::add(&mut scene, "block", block, parts::dielectric("glass", 1.5));
        lamp(&mut scene, DVec3::new(0.1, 1.5, 0.05));
        let result = bench.bake(&scene, &at(60.0, 16))?;
        bench.law(
            "no more arrives than was sent",
            deposited_w(&result) / emitted_w(&result),
            1.0,
        );
    }
    Ok(())
}

fn around_lamp(materials: &[(f64, Material)]) -> (Scene, DVec3) {
    let lamp_at = DVec3::new(0.0, 1.0, 0.0);
    let mut scene = parts::reference_scene(0.5);
    for (radius_m, material) in materials {
        parts::add(
            &mut scene,
            "ball",
            shapes::sphere(lamp_at, *radius_m, 5),
            material.clone(),
        );
    }
    lamp(&mut scene, lamp_at);
    (scene, lamp_at)
}

/// What stays inside after one reflection comes out after another: clear glass around a lamp takes nothing.
fn lamp_in_glass(bench: &mut Bench) -> Result<()> {
    let (scene, lamp_at) = around_lamp(&[(0.3, parts::dielectric("glass", 1.5))]);
    let result = bench.bake(&scene, &thoroughly(1e3, 32))?;
    let off = against_theory(&result, &scene, "floor", |point| from_lamp(point, lamp_at));
    bench.law("E is that of the lamp alone", off, 0.01);
    Ok(())
}

/// Glass that lets a share through every metre.
fn tinted(ior: f64, share_per_m: f64) -> Material {
    Material {
        volume: Some(Volume {
            attenuation_distance_m: 1.0,
            attenuation_colour: LinearSrgb::grey(share_per_m),
        }),
        ..parts::dielectric("tinted", ior)
    }
}

/// The first part of the way lies in the glass that the lamp is in.
fn lamp_in_tinted_glass(bench: &mut Bench) -> Result<()> {
    let (scene, lamp_at) = around_lamp(&[(0.3, tinted(1.5, 0.01))]);
    let result = bench.bake(&scene, &thoroughly(1e3, 32))?;
    // By orders of reflection: (1 − R)·a·Σ(R a²)ⁿ, a over one radius.
    let (single, across) = (normal_reflectance(1.5), 0.01_f64.powf(0.3));
    let share = (1.0 - single) * across / (1.0 - single * across * across);
    let off = against_theory(&result, &scene, "floor", |point| {
        share * from_lamp(point, lamp_at)
    });
    bench.law("E is that of the lamp, by Beer and Lambert", off, 0.01);
    Ok(())
}

/// A lamp in a ball of glass in a ball of the same glass.
fn lamp_in_nested_glass(bench: &mut Bench) -> Result<()> {
    let settings = thoroughly(1e3, 32);
    let (scene, lamp_at) = around_lamp(&[(0.15, tinted(1.5, 0.01)), (0.3, tinted(1.5, 0.01))]);
    let result: BakeResult = bench.bake(&scene, &settings)?;
    let (single, across) = (normal_reflectance(1.5), 0.01_f64.powf(0.3));
    let share = (1.0 - single) * across / (1.0 - single * across * across);
    let off = against_theory(&result, &scene, "floor", |point| {
        share * from_lamp(point, lamp_at)
    });
    bench.law("E as of one ball", off, 0.01);
    Ok(())
}

/// Every glass of the catalogue beyond both ends of what its formula was made for.
fn ends_of_formulas(bench: &mut Bench) -> Result<()> {
    for glass in glass::catalogue::all() {
        let (first, last) = (VISIBLE.start().0, VISIBLE.end().0);
        for step in 0..=100 {
            let nm = 0.25 * first + (4.0 * last - 0.25 * first) * f64::from(step) / 100.0;
            let index = glass.dispersion.index(Nanometres(nm));
            let slope = glass.dispersion.slope_per_nm(Nanometres(nm));
            bench.must(
                "indices are finite and at least 1",
                index.is_finite() && index >= 1.0,
            );
            bench.must("slopes are finite", slope.is_finite());
            if (first..=last).contains(&nm) {
                bench.law("visible light meets 1 to 10", (index - 5.5).abs(), 4.5);
            }
        }
        let ends = [VISIBLE.start(), VISIBLE.end()].map(|nm| glass.dispersion.index(*nm));
        bench.must("blue is bent more than red", ends[0] >= ends[1]);
    }
    Ok(())
}
