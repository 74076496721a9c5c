//! What must not change a map, or must change it just so.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::laws::{apart, deposited_w, estimates, map_sum, maps_apart, off, same_bits};
use super::scenes::{at, glass_ball, transformed, upright_mirror};
use super::{Bench, Case, Effort, Group};
use crate::error::Result;
use crate::illumination::IlluminationMap;
use crate::optics::LinearSrgb;
use crate::scene::builtin::{self, parts, shapes};
use crate::scene::{Light, LightKind, LightSize, PanelShape, Scene, Volume};
use crate::settings::BakeSettings;
use crate::units::Radiance;

/// Cases of symmetry and proportion.
pub const CASES: &[Case] = &[
    Case::quick("linearity", Group::Laws, linearity),
    Case::quick("rigid-motion", Group::Laws, rigid_motion),
    Case::quick("mirror-symmetry", Group::Laws, mirror_symmetry),
    Case::quick("uniform-scale", Group::Laws, uniform_scale),
    Case::quick("order-of-objects", Group::Laws, order_of_objects),
    Case::quick("sixteen-times-the-rays", Group::Laws, sixteen_times_the_rays),
];

/// What the laws are tried on.
fn scenes() -> Vec<Scene> {
    let mut scenes = vec![upright_mirror(), glass_ball(3)];
    scenes.extend(["slab", "ring"].iter().filter_map(|name| builtin::build(name)));
    scenes
}

const SETTINGS: fn() -> BakeSettings = || at(1e3, 32);

/// Two lights give the sum of their maps.
fn linearity(bench: &mut Bench) -> Result<()> {
    for scene in scenes() {
        let mut other = scene.clone();
        other.lights[0].kind = other.lights[0].kind.moved(DVec3::new(0.07, 0.11, -0.05));
        other.lights[0].colour = LinearSrgb::new(0.3, 1.0, 0.6);
        let mut both = scene.clone();
        both.lights.extend(other.lights.clone());
        let alone = [bench.bake(&scene, &SETTINGS())?, bench.bake(&other, &SETTINGS())?];
        let together = bench.bake(&both, &SETTINGS())?;
        let sums: Vec<IlluminationMap> = together.maps.iter().map(|map| map_sum(map, &alone)).collect();
        bench.law(
            "two lights give the sum of their maps",
            maps_apart(&together.maps, &sums, 1.0),
            1e-6,
        );
    }
    Ok(())
}

/// Turned and moved, a scene has the same maps, within what both say of their errors.
fn rigid_motion(bench: &mut Bench) -> Result<()> {
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    for scene in scenes() {
        let still = bench.bake(&scene, &SETTINGS())?;
        let moved = bench.bake(
            &transformed(scene.clone(), turn, 1.0, DVec3::new(3.1, -7.3, 0.9)),
            &SETTINGS(),
        )?;
        bench.law("watts", off(deposited_w(&moved), deposited_w(&still)), 0.01);
        bench.law(
            "maps, over both estimated errors",
            apart(&moved, &still) / estimates(&moved, &still),
            1.0,
        );
        // Lamps start their rays in the same directions wherever they stand.
        let shifted = bench.bake(
            &transformed(scene, DMat3::IDENTITY, 1.0, DVec3::splat(64.0)),
            &SETTINGS(),
        )?;
        bench.law(
            "maps, moved by 64 m along the axes",
            apart(&shifted, &still),
            1e-5,
        );
    }
    Ok(())
}

/// A scene seen in a mirror has its maps seen in a mirror, which lie the same way in texture coordinates.
fn mirror_symmetry(bench: &mut Bench) -> Result<()> {
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    for scene in scenes() {
        let plain = bench.bake(&scene, &SETTINGS())?;
        let mirrored = bench.bake(&transformed(scene, mirror, 1.0, DVec3::ZERO), &SETTINGS())?;
        bench.law("watts", off(deposited_w(&mirrored), deposited_w(&plain)), 5e-3);
        bench.law(
            "maps, over both estimated errors",
            apart(&mirrored, &plain) / estimates(&mirrored, &plain),
            1.0,
        );
    }
    Ok(())
}

/// A mirror above a panel that shines up, and a tinted block under a lamp.
fn soft_scene() -> Scene {
    let mut scene = parts::reference_scene(0.5);
    let ceiling = shapes::rectangle(DVec3::Y, DVec3::X * 0.5, DVec3::Z * 0.5);
    parts::add(&mut scene, "mirror", ceiling, parts::mirror());
    scene.lights.push(Light {
        name: "panel".into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind: LightKind::Panel {
            centre: DVec3::new(0.1, 0.5, 0.0),
            across: DVec3::Z * 0.1,
            down: DVec3::X * 0.1,
            shape: PanelShape::Rectangle,
            radiance: Radiance(1.0),
        },
        size: LightSize::None,
    });
    scene
}

/// E of lamps is divided by the square of the size; of suns and panels it stays. Where light divides, a few of its
/// borders are found elsewhere at another size.
fn uniform_scale(bench: &mut Bench) -> Result<()> {
    let mut tinted = glass_ball(3);
    tinted.materials[1].volume = Some(Volume {
        attenuation_distance_m: 0.3,
        attenuation_colour: LinearSrgb::new(0.5, 0.8, 0.9),
    });
    let mut sunny = glass_ball(3);
    sunny.lights.clear();
    super::scenes::sun(&mut sunny, DVec3::new(0.2, -1.0, 0.1));
    let soft = BakeSettings {
        wavefronts: Some(8),
        ..SETTINGS()
    };
    for (scene, settings, power) in [
        (upright_mirror(), SETTINGS(), -2),
        (tinted, SETTINGS(), -2),
        (sunny, SETTINGS(), 0),
        (soft_scene(), soft, 0),
    ] {
        let one = bench.bake(&scene, &settings)?;
        for scale in [0.25, 8.0] {
            let scaled = bench.bake(
                &transformed(scene.clone(), DMat3::IDENTITY, scale, DVec3::ZERO),
                &settings,
            )?;
            let off = maps_apart(&scaled.maps, &one.maps, scale.powi(power));
            bench.law("E as 1/s² of lamps, as it is of suns and panels", off, 1e-3);
        }
    }
    Ok(())
}

/// Objects, and triangles within them, in another order.
fn order_of_objects(bench: &mut Bench) -> Result<()> {
    for scene in scenes() {
        let plain = bench.bake(&scene, &SETTINGS())?;
        let mut reversed = scene.clone();
        reversed.objects.reverse();
        let mut result = bench.bake(&reversed, &SETTINGS())?;
        result.maps.reverse();
        bench.must("objects in reverse: the same bits", same_bits(&plain, &result));
        let mut turned = scene;
        for object in &mut turned.objects {
            Arc::make_mut(&mut object.mesh).triangles.reverse();
        }
        let result = bench.bake(&turned, &SETTINGS())?;
        bench.law(
            "triangles in reverse: watts",
            off(deposited_w(&result), deposited_w(&plain)),
            1e-3,
        );
    }
    Ok(())
}

/// The error at sixteen times the rays is at most half of that at one.
fn sixteen_times_the_rays(bench: &mut Bench) -> Result<()> {
    let names: &[&str] = if bench.effort == Effort::Long {
        &["ring", "ball", "pool", "slab", "nephroid"]
    } else {
        &["ring", "ball"]
    };
    for scene in names.iter().filter_map(|name| builtin::build(name)) {
        let (few, many) = (
            bench.bake(&scene, &at(500.0, 32))?,
            bench.bake(&scene, &at(8e3, 32))?,
        );
        let truth = bench.bake(&scene, &at(64e3, 32))?;
        bench.law(
            "error at 16 times the rays over that at 1",
            apart(&many, &truth) / apart(&few, &truth),
            0.5,
        );
    }
    Ok(())
}
