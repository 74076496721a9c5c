//! Meshes that no modeller would make, and places where they should not lie.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::laws::{against_theory, apart, deposited_w, emitted_w, estimates, off, solid_angle_sr};
use super::scenes::{at, lamp, mirror_mesh, random, room, sun, upright_mirror, upright_theory, with_upright};
use super::{Bench, Case, Effort, Group};
use crate::error::Result;
use crate::optics::LinearSrgb;
use crate::scene::builtin::{parts, shapes};
use crate::scene::{Mesh, Scene};
use crate::settings::BakeSettings;

/// Cases of geometry.
pub const CASES: &[Case] = &[
    Case::quick("triangles-without-area", Group::Geometry, without_area),
    Case::quick("needles", Group::Geometry, needles),
    Case::quick("duplicate-triangles", Group::Geometry, duplicates),
    Case::quick("t-junctions", Group::Geometry, t_junctions),
    Case::quick("flipped-winding", Group::Geometry, flipped),
    Case::quick("glass-inside-out", Group::Geometry, glass_inside_out),
    Case::quick("a-thousand-coplanar-layers", Group::Geometry, coplanar_layers),
    Case::quick("receiver-on-the-caster", Group::Geometry, receiver_on_caster),
    Case::quick("receiver-edge-on", Group::Geometry, receiver_edge_on),
    Case::quick("caster-smaller-than-a-cell", Group::Geometry, tiny_casters),
    Case::quick(
        "casters-at-edges-and-corners-of-the-cube",
        Group::Geometry,
        at_cube_corners,
    ),
    Case::quick("uv-of-zero-area", Group::Geometry, flat_uvs),
    Case::quick("uv-skewed-and-far", Group::Geometry, skewed_uvs),
    Case::quick("a-million-triangles", Group::Geometry, a_million_triangles),
    Case::long("ten-million-triangles", Group::Geometry, ten_million_triangles),
];

const SETTINGS: fn() -> BakeSettings = || at(1e3, 32);

/// The floor before an upright mirror that is another mesh of the same shape.
fn mirror_of(bench: &mut Bench, mirror: Mesh, bound: f64) -> Result<()> {
    let scene = with_upright(mirror);
    let result = bench.bake(&scene, &SETTINGS())?;
    let off = against_theory(&result, &scene, "floor", upright_theory);
    bench.law("E is that of the mirrored lamp", off, bound);
    Ok(())
}

/// Corners that coincide, and corners in one line.
fn without_area(bench: &mut Bench) -> Result<()> {
    let whole = bench.bake(&upright_mirror(), &SETTINGS())?;
    let mut mesh = mirror_mesh();
    let middle = mesh.positions.len() as u32;
    mesh.positions.push(0.5 * (mesh.positions[0] + mesh.positions[2]));
    mesh.normals.push(mesh.normals[0]);
    mesh.uv0 = None;
    mesh.triangles
        .extend([[0, 0, 0], [0, 1, 1], [0, middle, 2], [2, middle, 0]]);
    let mut scene = with_upright(mesh);
    let mut floor = (*scene.objects[0].mesh).clone();
    floor.triangles.push([1, 1, 2]);
    scene.objects[0].mesh = Arc::new(floor);
    let result = bench.bake(&scene, &SETTINGS())?;
    bench.law("map as without them", apart(&result, &whole), 1e-6);
    Ok(())
}

/// A fan around a corner: triangles a ten-thousandth as wide as they are long.
fn needles(bench: &mut Bench) -> Result<()> {
    let [a, b, c, d] = [0, 1, 2, 3].map(|corner| mirror_mesh().positions[corner]);
    let mut mesh = Mesh::default();
    let count = 2_000;
    for needle in 0..count {
        let at = |step: u32| {
            let along = 2.0 * f64::from(step) / f64::from(count);
            if along <= 1.0 {
                b.lerp(c, along)
            } else {
                c.lerp(d, along - 1.0)
            }
        };
        shapes::append(&mut mesh, &shapes::facet([a, at(needle), at(needle + 1)]));
    }
    mirror_of(bench, mesh, 5e-3)
}

/// Every triangle of the mirror and of the floor twice.
fn duplicates(bench: &mut Bench) -> Result<()> {
    let mut mesh = mirror_mesh();
    mesh.triangles.extend(mesh.triangles.clone());
    mirror_of(bench, mesh, 5e-3)?;
    let whole = bench.bake(&upright_mirror(), &SETTINGS())?;
    let mut scene = upright_mirror();
    let mut floor = (*scene.objects[0].mesh).clone();
    floor.triangles.extend(floor.triangles.clone());
    scene.objects[0].mesh = Arc::new(floor);
    let result = bench.bake(&scene, &SETTINGS())?;
    bench.law(
        "watts of a floor of doubled triangles",
        off(deposited_w(&result), deposited_w(&whole)),
        1e-3,
    );
    Ok(())
}

/// A coarse half beside a fine one, whose corners lie on an edge of the other.
fn t_junctions(bench: &mut Bench) -> Result<()> {
    let mut mesh = shapes::rectangle(DVec3::new(0.6, 0.75, -0.5), DVec3::Z * 0.5, DVec3::Y * 0.75);
    mesh.uv0 = None;
    let fine = shapes::sheet(7, 7, |u, v| (DVec3::new(0.6, 1.5 * v, u), DVec3::NEG_X));
    shapes::append(&mut mesh, &fine);
    mirror_of(bench, mesh, 5e-3)
}

/// A mirror reflects on both sides, whichever is called the front.
fn flipped(bench: &mut Bench) -> Result<()> {
    let mut mesh = mirror_mesh();
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    mirror_of(bench, mesh.clone(), 5e-3)?;
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    mirror_of(bench, mesh.clone(), 5e-3)?;
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    mirror_of(bench, mesh, 5e-3)
}

/// A solid of glass whose triangles are all turned: light goes through it and none is made or lost.
fn glass_inside_out(bench: &mut Bench) -> Result<()> {
    let mut scene = super::scenes::under_slab(1.5);
    let mut slab = (*scene.objects[1].mesh).clone();
    slab.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    scene.objects[1].mesh = Arc::new(slab);
    sun(&mut scene, DVec3::NEG_Y);
    let result = bench.bake(&scene, &super::scenes::thoroughly(100.0, 16))?;
    let single: f64 = 0.04;
    let expected = (1.0 - single) / (1.0 + single);
    let off = against_theory(&result, &scene, "floor", |_| expected);
    bench.law("E is (1 − R)/(1 + R), as of a solid", off, 1e-6);
    Ok(())
}

/// A thousand mirrors in one plane, or a hundred at the quick effort, are one.
fn coplanar_layers(bench: &mut Bench) -> Result<()> {
    let layers = if bench.effort == Effort::Long { 1000 } else { 100 };
    let one = bench.bake(&upright_mirror(), &SETTINGS())?;
    let mut scene = upright_mirror();
    let mirror = scene.objects[1].clone();
    scene.objects.extend(std::iter::repeat_n(mirror, layers - 1));
    let many = bench.bake(&scene, &SETTINGS())?;
    bench.law(
        "map as of one mirror, over both estimated errors",
        apart(&many, &one) / estimates(&many, &one),
        1.0,
    );
    Ok(())
}

/// A floor on which a mirror lies, in one plane with it.
fn receiver_on_caster(bench: &mut Bench) -> Result<()> {
    let mut scene = parts::reference_scene(0.5);
    let sheet = shapes::floor([-0.3, 0.3], [-0.3, 0.3], 0.0);
    parts::add(&mut scene, "mirror", sheet, parts::mirror());
    let wall = shapes::rectangle(DVec3::new(0.8, 0.5, 0.0), DVec3::Z * 0.6, DVec3::Y * 0.6);
    parts::add(&mut scene, "wall", wall, parts::matte("wall", LinearSrgb::WHITE));
    lamp(&mut scene, DVec3::new(-0.2, 0.8, 0.1));
    let result = bench.bake(&scene, &SETTINGS())?;
    // Either is met, never both: the mirror sends at most what falls on it.
    let falls_sr = solid_angle_sr(&scene.objects[1].mesh, DVec3::new(-0.2, 0.8, 0.1));
    bench.law(
        "no more arrives than falls on the mirror",
        deposited_w(&result) / falls_sr,
        1.0,
    );
    Ok(())
}

/// A floor that the mirrored light runs along.
fn receiver_edge_on(bench: &mut Bench) -> Result<()> {
    for tilt_rad in [0.0, 1e-9, 1e-4, 0.1] {
        let mut scene = Scene::default();
        let (sine, cosine) = f64::sin_cos(tilt_rad);
        let along = DVec3::new(cosine, sine, 0.0);
        let receiver = shapes::rectangle(DVec3::new(-1.0, 0.5, 0.0), along * 0.4, DVec3::Z * 0.4);
        parts::add(
            &mut scene,
            "floor",
            receiver,
            parts::matte("matte", LinearSrgb::WHITE),
        );
        let mirror = shapes::rectangle(DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.5, 0.5, 0.0), DVec3::Z);
        parts::add(&mut scene, "mirror", mirror, parts::mirror());
        sun(&mut scene, DVec3::NEG_Y);
        let result = bench.bake(&scene, &SETTINGS())?;
        let expected = 0.64 * sine;
        let off = (deposited_w(&result) - expected).abs() / emitted_w(&result);
        bench.law(
            "what arrives is E sin of the tilt, of all that the mirror sends",
            off,
            1e-4,
        );
    }
    Ok(())
}

/// Square mirrors around a lamp in a room, of so many hundredths of a cell of the item buffer.
fn tiny_casters(bench: &mut Bench) -> Result<()> {
    let mut random = random(5);
    for _ in 0..if bench.effort == Effort::Long { 200 } else { 6 } {
        let towards = DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5).normalize();
        lone_mirror(bench, towards, 1e-4 * 100.0_f64.powf(random()))?;
    }
    Ok(())
}

/// Mirrors where faces of the cube of directions meet.
fn at_cube_corners(bench: &mut Bench) -> Result<()> {
    for towards in [
        DVec3::X,
        DVec3::NEG_Y,
        DVec3::new(1.0, 1.0, 0.0),
        DVec3::new(-1.0, 0.0, 1.0),
        DVec3::ONE,
        -DVec3::ONE,
    ] {
        lone_mirror(bench, towards.normalize(), 0.05)?;
    }
    Ok(())
}

/// A square mirror across a direction, 1 m from a lamp of 1 W/sr in a room.
fn lone_mirror(bench: &mut Bench, towards: DVec3, half_m: f64) -> Result<()> {
    let mut scene = room(2.5);
    let (x, y) = towards.any_orthonormal_pair();
    let mirror = shapes::rectangle(towards, x * half_m, y * half_m);
    let seen_sr = solid_angle_sr(&mirror, DVec3::ZERO);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    lamp(&mut scene, DVec3::ZERO);
    let result = bench.bake(&scene, &at(4e3, 16))?;
    bench.law(
        "what arrives is I times the solid angle",
        off(deposited_w(&result), seen_sr),
        0.01,
    );
    Ok(())
}

/// The floor before an upright mirror with other texture coordinates, which the map may follow or not.
fn with_uvs(uvs: [DVec2; 4]) -> Scene {
    let mut scene = upright_mirror();
    let mut floor = (*scene.objects[0].mesh).clone();
    floor.uv0 = Some(uvs.to_vec());
    scene.objects[0].mesh = Arc::new(floor);
    scene
}

/// Coordinates that make no map are not followed, whatever they are: the watts stay.
fn same_watts(bench: &mut Bench, uvs: [DVec2; 4]) -> Result<()> {
    let usual = bench.bake(&upright_mirror(), &SETTINGS())?;
    let result = bench.bake(&with_uvs(uvs), &SETTINGS())?;
    bench.law(
        "watts as with plain coordinates",
        off(deposited_w(&result), deposited_w(&usual)),
        1e-6,
    );
    Ok(())
}

fn flat_uvs(bench: &mut Bench) -> Result<()> {
    let v = DVec2::new;
    same_watts(bench, [DVec2::ZERO; 4])?;
    same_watts(bench, [v(0.0, 0.0), v(1.0, 0.0), v(1.0, 0.0), v(0.0, 0.0)])?;
    same_watts(bench, [v(0.0, 0.0), v(1.0, 1.0), v(1.0, 1.0), v(0.0, 0.0)])
}

fn skewed_uvs(bench: &mut Bench) -> Result<()> {
    let v = DVec2::new;
    for (scale, offset) in [(1.0, 1e6), (1e-6, 0.0), (1e6, -1e9)] {
        let plain = [v(0.0, 0.0), v(1.0, 0.0), v(1.0, 1.0), v(0.0, 1.0)];
        same_watts(bench, plain.map(|uv| uv * scale + offset))?;
    }
    // A thousand times as far across as along, sheared.
    same_watts(
        bench,
        [v(0.0, 0.0), v(0.999, 0.998), v(1.0, 1.0), v(0.001, 0.002)],
    )
}

/// A flat mirror of that many triangles.
fn fine_mirror(bench: &mut Bench, columns: u32, rows: u32) -> Result<()> {
    let mesh = shapes::sheet(columns, rows, |u, v| {
        (DVec3::new(0.6, 1.5 * v, 2.0 * u - 1.0), DVec3::NEG_X)
    });
    mirror_of(bench, mesh, 5e-3)
}

fn a_million_triangles(bench: &mut Bench) -> Result<()> {
    fine_mirror(bench, 1000, 500)
}

fn ten_million_triangles(bench: &mut Bench) -> Result<()> {
    fine_mirror(bench, 2500, 2000)
}
