//! Meshes that no modeller would make, and places where they should not lie.

use support::laws::law::*;
use support::laws::scenes::*;
use support::laws::{Table, is_long};
use support::prelude::*;

pub fn fill(t: &mut Table) {
    let mut doubled = upright();
    twice(&mut doubled);
    let [mut back, mut behind, mut opposite] = [0; 3].map(|_| upright());
    for mesh in [&mut back, &mut behind] {
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    for mesh in [&mut behind, &mut opposite] {
        mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    }
    // What stands for the upright mirror: E is that of the mirrored lamp all the same.
    let mirrors = [
        ("needles", needles()),
        ("duplicate-triangles", doubled),
        ("t-junctions", t_junctions()),
        ("triangles-of-the-back", back),
        ("mirror-from-behind", behind),
        ("normals-of-the-back", opposite),
        ("a-million-triangles", fine_mirror(1000, 500)),
    ];
    let long = is_long().then(|| ("ten-million-triangles", fine_mirror(2500, 2000)));
    for (name, mesh) in mirrors.into_iter().chain(long) {
        t.case(name)
            .bake(before(mesh), 0.01, 32)
            .e_of_lamp("that of the mirrored lamp", 5e-3, MIRRORED_LAMP);
    }
    t.case("triangles-without-area")
        .bake(before(upright()), 0.01, 32)
        .bake(with_flat_triangles(), 0.01, 32)
        .as_first("map as without them", 1e-6, 1.0);
    t.case("floor-of-doubled-triangles")
        .bake(before(upright()), 0.01, 32)
        .bake(before(upright()).reshaped(0, twice), 0.01, 32)
        .watts_as_first("watts as of single ones", 1e-3);
    let mut layered = before(upright());
    let layer = layered.objects[1].clone();
    layered
        .objects
        .extend(vec![layer; if is_long() { 999 } else { 99 }]);
    t.case("coplanar-layers")
        .bake(before(upright()), 0.01, 32)
        .bake(layered, 0.01, 32)
        .as_first_within_errors();
    // Either is met, never both: the mirror sends at most what falls on it.
    let place = dvec3(-0.2, 0.8, 0.1);
    let sheet = shapes::floor([-0.3, 0.3], [-0.3, 0.3], 0.0);
    let falls_w = solid_angle_sr(&sheet, place);
    let wall = shapes::rectangle(dvec3(0.8, 0.5, 0.0), DVec3::Z * 0.6, DVec3::Y * 0.6);
    t.case("receiver-on-the-caster")
        .bake(
            floor(0.5).mirror(sheet).diffuse("wall", wall).lamp(place),
            0.03,
            32,
        )
        .arrives(falls_w);
    for tilt_rad in [0.0, 1e-9, 1e-4, 0.1] {
        t.case("receiver-edge-on")
            .bake(tilted_receiver(tilt_rad), 0.01, 32)
            .share("arrives beside E sin of the tilt", 1e-4, move |energy| {
                (energy.deposited - 0.64 * tilt_rad.sin()).abs()
            });
    }
    let mut random = random(5);
    for _ in 0..if is_long() { 200 } else { 6 } {
        let towards = dvec3(random() - 0.5, random() - 0.5, random() - 0.5);
        lone_mirror(
            t,
            "caster-smaller-than-a-cell",
            towards,
            1e-4 * 100.0_f64.powf(random()),
        );
    }
    for corner in [
        [1, 0, 0],
        [0, -1, 0],
        [1, 1, 0],
        [-1, 0, 1],
        [1, 1, 1],
        [-1, -1, -1],
    ] {
        let towards = DVec3::from_array(corner.map(f64::from));
        lone_mirror(t, "casters-at-corners-of-the-cube", towards, 0.05);
    }
    let v = DVec2::new;
    let plain = [v(0.0, 0.0), v(1.0, 0.0), v(1.0, 1.0), v(0.0, 1.0)];
    let [far, tiny, huge] =
        [(1.0, 1e6), (1e-6, 0.0), (1e6, -1e9)].map(|(s, offset)| plain.map(|uv| uv * s + offset));
    for (name, uvs) in [
        ("uv-of-zero-area", [DVec2::ZERO; 4]),
        (
            "uv-of-zero-area",
            [v(0.0, 0.0), v(1.0, 0.0), v(1.0, 0.0), v(0.0, 0.0)],
        ),
        (
            "uv-of-zero-area",
            [v(0.0, 0.0), v(1.0, 1.0), v(1.0, 1.0), v(0.0, 0.0)],
        ),
        ("uv-skewed-and-far", far),
        ("uv-skewed-and-far", tiny),
        ("uv-skewed-and-far", huge),
        // A thousand times as far across as along, sheared.
        (
            "uv-skewed-and-far",
            [v(0.0, 0.0), v(0.999, 0.998), v(1.0, 1.0), v(0.001, 0.002)],
        ),
    ] {
        t.case(name)
            .bake(before(upright()), 0.01, 32)
            .bake(
                before(upright()).reshaped(0, |mesh| mesh.uv0 = Some(uvs.to_vec())),
                0.03,
                32,
            )
            .watts_as_first("watts as with plain coordinates", 1e-6);
    }
}

fn twice(mesh: &mut Mesh) {
    mesh.triangles.extend(mesh.triangles.clone());
}

/// The mirror and its floor with corners that coincide, and corners in one line.
fn with_flat_triangles() -> Scene {
    let mut mesh = upright();
    let middle = mesh.positions.len() as u32;
    mesh.positions.push(0.5 * (mesh.positions[0] + mesh.positions[2]));
    mesh.normals.push(mesh.normals[0]);
    mesh.uv0 = None;
    mesh.triangles
        .extend([[0, 0, 0], [0, 1, 1], [0, middle, 2], [2, middle, 0]]);
    before(mesh).reshaped(0, |floor| floor.triangles.push([1, 1, 2]))
}

/// A fan around a corner: triangles a ten-thousandth as wide as they are long.
fn needles() -> Mesh {
    let corners = upright().positions;
    let at = |step: u32| match f64::from(step) / 1000.0 {
        along if along <= 1.0 => corners[1].lerp(corners[2], along),
        along => corners[2].lerp(corners[3], along - 1.0),
    };
    let mut mesh = Mesh::default();
    for needle in 0..2000 {
        shapes::append(
            &mut mesh,
            &shapes::facet([corners[0], at(needle), at(needle + 1)]),
        );
    }
    mesh
}

/// A coarse half beside a fine one, whose corners lie on an edge of the other.
fn t_junctions() -> Mesh {
    let mut mesh = shapes::rectangle(dvec3(0.6, 0.75, -0.5), DVec3::Z * 0.5, DVec3::Y * 0.75);
    mesh.uv0 = None;
    let fine = shapes::sheet(7, 7, |u, v| (dvec3(0.6, 1.5 * v, u), DVec3::NEG_X));
    shapes::append(&mut mesh, &fine);
    mesh
}

fn fine_mirror(columns: u32, rows: u32) -> Mesh {
    shapes::sheet(columns, rows, |u, v| {
        (dvec3(0.6, 1.5 * v, 2.0 * u - 1.0), DVec3::NEG_X)
    })
}

/// A receiver that the mirrored light runs along.
fn tilted_receiver(tilt_rad: f64) -> Scene {
    let along = dvec3(tilt_rad.cos(), tilt_rad.sin(), 0.0);
    let receiver = shapes::rectangle(dvec3(-1.0, 0.5, 0.0), along * 0.4, DVec3::Z * 0.4);
    let mirror = shapes::rectangle(dvec3(0.0, 0.5, 0.0), dvec3(0.5, 0.5, 0.0), DVec3::Z);
    Scene::default()
        .diffuse("floor", receiver)
        .mirror(mirror)
        .sun(DVec3::NEG_Y)
}

/// A square mirror across a direction, 1 m from a lamp in a room.
fn lone_mirror(t: &mut Table, name: &str, towards: DVec3, half_m: f64) {
    let (x, y) = towards.normalize().any_orthonormal_pair();
    let mirror = shapes::rectangle(towards.normalize(), x * half_m, y * half_m);
    let seen_sr = solid_angle_sr(&mirror, DVec3::ZERO);
    t.case(name)
        .bake(room(2.5).mirror(mirror).lamp(DVec3::ZERO), 0.01, 16)
        .measure("I times the solid angle arrives", 0.01, move |bake| {
            off(deposited_w(bake), seen_sr)
        });
}
