//! Which coordinates a map follows, that they give every point its own place, and the area of the surface under each texel.

use nephroid::illumination::gutter::fill_gutter;
use nephroid::illumination::lookup::bilinear;
use nephroid::illumination::parametrisation::coverage::{for_each_texel_in_row, rows};
use nephroid::illumination::{Parametrisation, UvSet, parametrise};

use crate::prelude::*;
use support::meshes::{cuboid, floor, grid, joined, moved, quad, sphere};

fn of(mesh: &Mesh) -> Parametrisation {
    parametrise(3, mesh).expect("the mesh has area")
}

fn without_uv(mut mesh: Mesh) -> Mesh {
    (mesh.uv0, mesh.uv1) = (None, None);
    mesh
}

/// The first set, changed by the number of its vertex.
fn with_uv(mut mesh: Mesh, change: impl Fn(usize, DVec2) -> DVec2) -> Mesh {
    let set = mesh.uv0.take().expect("it has coordinates");
    mesh.uv0 = Some((0..).zip(set).map(|(vertex, uv)| change(vertex, uv)).collect());
    mesh
}

fn uv_at(mesh: &Mesh, map: &Parametrisation, vertex: u32) -> DVec2 {
    let corners = mesh.triangles.as_flattened().iter();
    let mut corners = corners.zip(map.corner_uvs.as_flattened());
    *corners
        .find(|(corner, _)| **corner == vertex)
        .expect("it is used")
        .1
}

/// Twice the signed area of a triangle of the map.
fn turn([a, b, c]: &[DVec2; 3]) -> f64 {
    (*b - *a).perp_dot(*c - *a)
}

/// The largest number of triangles over any of many points of the map, by brute force.
fn deepest_overlap(map: &Parametrisation) -> usize {
    let inside = |[a, b, c]: [DVec2; 3], p: DVec2| {
        let sides = [[a, b, p], [b, c, p], [c, a, p]].map(|side| turn(&side));
        sides.iter().all(|side| *side > 1e-9) || sides.iter().all(|side| *side < -1e-9)
    };
    let over = |i: i32| {
        let i = f64::from(i);
        let p = dvec2((i + 0.5) / 2e4, (i * 0.618_033_988_749_895).fract());
        let triangles = map.corner_uvs.iter();
        triangles.filter(|triangle| inside(**triangle, p)).count()
    };
    (0..20_000).map(over).max().expect("there are points")
}

fn covered(map: &Parametrisation) -> f64 {
    let triangles = map.corner_uvs.iter();
    triangles.map(|triangle| 0.5 * turn(triangle).abs()).sum()
}

/// A ramp that winds around its axis three times: seen along the axis it covers itself.
fn winding_ramp() -> Mesh {
    grid(240, 4, |s, t| {
        let (phi, r) = (s * 3.0 * TAU, 1.0 + t);
        dvec3(r * phi.cos(), 0.6 * s, r * phi.sin())
    })
}

fn torus() -> Mesh {
    grid(96, 48, |s, t| {
        let (phi, theta) = (s * TAU, t * TAU);
        let r = 1.0 + 0.35 * theta.cos();
        dvec3(r * phi.cos(), 0.35 * theta.sin(), r * phi.sin())
    })
}

#[test]
fn a_covering_first_set_is_taken() {
    let mesh = floor(1.0, 0.0);
    let map = of(&mesh);
    assert_eq!((map.uv_set, map.object), (UvSet::TexCoord0, 3));
    // u runs with x, v with z.
    let corners = [0, 1, 3].map(|vertex| uv_at(&mesh, &map, vertex));
    assert_eq!(corners, [DVec2::ZERO, DVec2::X, DVec2::Y]);
    let chart = map.chart(8, 4);
    assert_eq!(chart.texel_areas_m2.len(), 1);
    near(chart.texel_area_m2(31), 4.0 / 32.0, 1e-15, "area");

    // Neither a rotation nor an exporter's single precision spoils it.
    let rotation = DMat3::from_axis_angle(dvec3(0.3, -0.5, 0.8).normalize(), 1.1);
    let mut mesh = moved(floor(2.0, 0.0), rotation, dvec3(5.0, -3.0, 11.0));
    for position in &mut mesh.positions {
        *position = position.as_vec3().as_dvec3();
    }
    let map = of(&mesh);
    assert_eq!(map.uv_set, UvSet::TexCoord0);
    assert_eq!(map.chart(64, 64).texel_areas_m2.len(), 1);
}

#[test]
fn sets_that_give_no_place_are_refused() {
    let scaled = |scale: f64| with_uv(floor(1.0, 0.0), |_, uv| uv * scale);
    let corner = |corner: usize, to: DVec2| {
        let change = move |vertex, uv| if vertex == corner { to } else { uv };
        with_uv(floor(1.0, 0.0), change)
    };
    let other = quad(DVec3::X * 3.0, DVec3::X, DVec3::Z);
    let two = || joined(floor(1.0, 0.0), other.clone());
    let beside = |overlap: f64| {
        let start = move |vertex: usize| if vertex < 4 { 0.0 } else { 0.5 - overlap };
        let change = |vertex, uv: DVec2| dvec2(0.5 * uv.x + start(vertex), uv.y);
        with_uv(two(), change)
    };
    for (what, mesh, is_taken) in [
        ("beyond the unit square", scaled(2.0), false),
        ("a hundredth of the map", scaled(0.1), false),
        ("half of the map", scaled(0.7), true),
        ("two quads on one place", two(), false),
        ("two quads side by side", beside(0.0), true),
        ("a strip of a fiftieth lies double", beside(0.02), false),
        ("no number", corner(2, dvec2(f64::NAN, 1.0)), false),
        ("a flat triangle", corner(3, DVec2::splat(0.5)), false),
    ] {
        let found = of(&mesh).uv_set;
        assert_eq!(found == UvSet::TexCoord0, is_taken, "{what}: {found:?}");
    }
}

#[test]
fn a_covering_second_set_comes_first() {
    let mut mesh = floor(1.0, 0.0);
    mesh.uv1 = mesh.uv0.clone();
    mesh = with_uv(mesh, |_, uv| uv * 0.5);
    assert_eq!(of(&mesh).uv_set, UvSet::TexCoord1);
    // Covering and planar comes first.
    std::mem::swap(&mut mesh.uv0, &mut mesh.uv1);
    assert_eq!(of(&mesh).uv_set, UvSet::TexCoord0);
}

#[test]
fn generated_floors_and_walls_are_upright() {
    // A wall that faces +z, seen from there: u to the right (+x), v down.
    let wall = without_uv(quad(DVec3::Y * 2.0, DVec3::X * 3.0, DVec3::NEG_Y * 2.0));
    assert!(wall.face_normal(0).distance(DVec3::Z) < 1e-15);
    for (mesh, aspect) in [(without_uv(floor(1.0, 0.0)), 1.0), (wall, 1.5)] {
        let map = of(&mesh);
        assert_eq!(map.uv_set, UvSet::Generated);
        for (vertex, uv) in (0..).zip([DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]) {
            near(uv_at(&mesh, &map, vertex), uv, 1e-12, vertex);
        }
        near(map.suggested_aspect, aspect, 1e-12, "aspect");
    }
}

#[test]
fn generated_maps_of_squares_are_full() {
    for step in 0..24 {
        let axis = dvec3(0.2, 1.0, f64::from(step) - 12.0).normalize();
        let rotation = DMat3::from_axis_angle(axis, 0.37 * f64::from(step));
        let square = moved(floor(0.7, 0.0), rotation, dvec3(1.0, 2.0, 3.0));
        let map = of(&without_uv(square));
        near(covered(&map), 1.0, 1e-9, step);
        assert_eq!(map.chart(32, 32).texel_areas_m2.len(), 1, "step {step}");
        let mut turns = map.corner_uvs.iter().map(turn);
        assert!(turns.all(|turn| turn < 0.0), "step {step}: v runs down");
    }
}

#[test]
fn bent_surfaces_give_every_point_a_place() {
    let back = quad(dvec3(-1.0, 0.0, 1.0), DVec3::X * 2.0, DVec3::NEG_Z * 2.0);
    for (name, mesh) in [
        ("ball", sphere(DVec3::ZERO, 1.0, 48, 24)),
        ("torus", torus()),
        ("box", cuboid(DVec3::ZERO, dvec3(1.0, 2.0, 3.0))),
        ("winding ramp", winding_ramp()),
        ("sheet with two sides", without_uv(joined(floor(1.0, 0.0), back))),
    ] {
        let map = of(&mesh);
        assert_eq!(
            (map.uv_set, deepest_overlap(&map)),
            (UvSet::Generated, 1),
            "{name}"
        );
        assert!(covered(&map) > 0.35, "{name} {}", covered(&map));
        for uv in map.corner_uvs.iter().flatten() {
            assert!(uv.min_element() >= 0.0 && uv.max_element() <= 1.0, "{name}: {uv}");
        }
    }
}

/// One scale for all, as far as a bent chart can be flat.
#[test]
fn texels_are_alike_all_over_a_surface() {
    for (name, mesh, least) in [
        ("box", cuboid(DVec3::ZERO, dvec3(1.0, 2.0, 3.0)), 1.0 - 1e-5),
        ("ball", sphere(DVec3::ZERO, 1.0, 48, 24), 0.766),
    ] {
        let map = of(&mesh);
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for (triangle, uvs) in map.corner_uvs.iter().enumerate() {
            let area_m2 = map.triangle_area_m2(triangle);
            if area_m2 > 0.0 {
                let density = turn(uvs).abs() / area_m2;
                (low, high) = (low.min(density), high.max(density));
            }
        }
        assert!(low / high >= least, "{name}: {}", low / high);
    }
}

#[test]
fn pieces_keep_their_gutter() {
    let mesh = cuboid(DVec3::ZERO, dvec3(1.0, 2.0, 3.0));
    let map = parametrise(0, &mesh).expect("the box has area");
    let bounds = |face: &[[DVec2; 3]]| {
        let corners = || face.iter().flatten().copied();
        let low = corners().fold(DVec2::INFINITY, DVec2::min);
        (low, corners().fold(DVec2::NEG_INFINITY, DVec2::max))
    };
    let boxes: Vec<(DVec2, DVec2)> = map.corner_uvs.chunks(2).map(bounds).collect();
    for (index, a) in boxes.iter().enumerate() {
        for b in &boxes[index + 1..] {
            let gap = (a.0 - b.1).max(b.0 - a.1).max_element() * 128.0;
            assert!(gap >= 2.0 - 1e-9, "{gap} texels");
        }
    }
}

#[test]
fn no_area_no_map_and_always_the_same() {
    let point = Mesh {
        positions: vec![DVec3::ONE; 3],
        normals: vec![DVec3::Y; 3],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    assert!(parametrise(0, &point).is_none());
    assert!(parametrise(0, &Mesh::default()).is_none());
    assert_eq!(of(&torus()).corner_uvs, of(&torus()).corner_uvs);
}

/// At a seam either side reads what the surface has there, gutters included: a field that is even in space is even
/// across.
#[test]
fn gutters_continue_the_surface_at_seams() {
    let mesh = without_uv(sphere(DVec3::ZERO, 1.0, 48, 24));
    let chart = of(&mesh).chart(512, 512);
    let field = |triangle: usize, weights: DVec3| {
        let [a, b, c] = mesh.corners(triangle);
        let point = a * weights.x + b * weights.y + c * weights.z;
        3.0 + point.dot(dvec3(1.0, 0.7, -0.5))
    };
    // The mean over the part of a triangle in a texel is the value at the middle of that part.
    let mut sums = vec![(0.0, 0.0); 512 * 512];
    for (triangle, [a, b, c]) in chart.corner_uvs.iter().enumerate() {
        let corners = [a, b, c].map(|uv| *uv * 512.0);
        for row in rows(corners, 512) {
            for_each_texel_in_row(corners, row, 512, |column, part| {
                let at = part.centroid() / 512.0;
                let whole = turn(&[*a, *b, *c]);
                let (v, w) = (turn(&[*a, at, *c]) / whole, turn(&[*a, *b, at]) / whole);
                let sum = &mut sums[row * 512 + column];
                sum.0 += part.area() * field(triangle, dvec3(1.0 - v - w, v, w));
                sum.1 += part.area();
            });
        }
    }
    let mean = |&(sum, area): &(f64, f64)| [if area > 0.0 { (sum / area) as f32 } else { 0.0 }; 3];
    let mut values: Vec<[f32; 3]> = sums.iter().map(mean).collect();
    fill_gutter(&chart, &mut values);
    let texel_m = (2.0 * TAU / chart.texel_areas_m2.len() as f64).sqrt();
    let (mut worst, mut squares, mut looks) = (0.0_f64, 0.0, 0.0);
    let with_area = |triangle: &usize| mesh.face_normal(*triangle) != DVec3::ZERO;
    for triangle in (0..mesh.triangles.len()).filter(with_area) {
        let uvs = chart.corner_uvs[triangle];
        // Along all edges, those at seams among them.
        for (corner, t) in (0..3).flat_map(|corner| [0.2, 0.5, 0.8].map(|t| (corner, t))) {
            let mut weights = DVec3::ZERO;
            weights[corner] = 1.0 - t;
            weights[(corner + 1) % 3] = t;
            let uv = uvs[0] * weights.x + uvs[1] * weights.y + uvs[2] * weights.z;
            let off = (bilinear(&values, 512, 512, uv).g - field(triangle, weights)).abs() / texel_m;
            worst = worst.max(off);
            squares += off * off;
            looks += 1.0;
        }
    }
    let rms = (squares / looks).sqrt();
    assert!(!chart.beyond.is_empty(), "it has seams");
    assert!(worst < 1.0 && rms < 0.1, "{worst} at most, {rms} rms");
}

fn disc() -> Mesh {
    grid(5, 40, |s, t| dvec3(s * (t * TAU).cos(), 0.0, s * (t * TAU).sin()))
}

fn l_shape() -> Mesh {
    let across = quad(DVec3::ZERO, DVec3::X * 3.0, DVec3::Z);
    let mut mesh = joined(across, quad(DVec3::Z, DVec3::X, DVec3::Z * 2.0));
    mesh.uv0 = None;
    mesh
}

fn areas(mesh: &Mesh, width: usize, height: usize) -> Vec<f64> {
    let map = parametrise(0, mesh).expect("the mesh has area");
    assert_close(map.area_m2(), mesh.area_m2(), 1e-12, "the map's area");
    let chart = map.chart(width, height);
    (0..width * height)
        .map(|texel| chart.texel_area_m2(texel))
        .collect()
}

/// Every square metre is under some texel, at any map size, also one with more columns than rows.
#[test]
fn texel_areas_sum_to_the_mesh_area() {
    let tilt = DMat3::from_axis_angle(dvec3(1.0, 2.0, -1.0).normalize(), 0.9);
    for (name, mesh) in [
        ("floor", floor(1.0, 0.0)),
        ("tilted L", moved(l_shape(), tilt, DVec3::ONE)),
        ("disc", disc()),
        ("ball", sphere(DVec3::ZERO, 2.0, 64, 32)),
        ("box", cuboid(DVec3::ZERO, dvec3(0.1, 2.0, 7.0))),
    ] {
        for (width, height) in [(1, 1), (7, 3), (64, 64), (256, 100)] {
            let sum = areas(&mesh, width, height).iter().sum();
            assert_close(sum, mesh.area_m2(), 1e-9, name);
        }
    }
}

/// An L of 3 × 3 with a 2 × 2 corner missing: those texels of a 3 × 3 map are empty, the others hold 1 m² each.
#[test]
fn texels_beside_the_surface_are_empty() {
    let areas = areas(&l_shape(), 3, 3);
    let expected = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    for (area, expected) in areas.iter().zip(expected) {
        near(*area, expected, 1e-12, &areas);
    }
    assert_eq!(areas[8], 0.0, "exactly none");
}

#[test]
fn texels_follow_the_local_scale() {
    let first = quad(DVec3::ZERO, DVec3::X, DVec3::Z);
    let mut mesh = joined(first, quad(DVec3::X, DVec3::X * 3.0, DVec3::Z));
    let half =
        |start: f64| [(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (0.0, 1.0)].map(|(u, v)| dvec2(start + u, v));
    mesh.uv0 = Some([half(0.0), half(0.5)].concat());
    let row = [0.25, 0.25, 0.75, 0.75];
    for (area, expected) in areas(&mesh, 4, 2).iter().zip([row, row].concat()) {
        near(*area, expected, 1e-12, "area");
    }
}
