//! Which coordinates a map follows, and that they give every point its own place.

use glam::{DMat3, DVec2, DVec3};
use nephroid::illumination::gutter::fill_gutter;
use nephroid::illumination::lookup::bilinear;
use nephroid::illumination::parametrisation::DEFAULT_NOMINAL_SIDE;
use nephroid::illumination::parametrisation::coverage::{for_each_texel_in_row, rows};
use nephroid::illumination::{Parametrisation, UvSet, parametrise};
use nephroid::scene::Mesh;

use crate::meshes::{cuboid, floor, grid, joined, moved, quad, sphere};

fn of(mesh: &Mesh) -> Parametrisation {
    parametrise(3, mesh, DEFAULT_NOMINAL_SIDE).expect("the mesh has area")
}

fn without_uv(mut mesh: Mesh) -> Mesh {
    (mesh.uv0, mesh.uv1) = (None, None);
    mesh
}

/// Map coordinates of a point of the mesh, by search over its triangles.
fn uv_at(mesh: &Mesh, map: &Parametrisation, vertex: usize) -> DVec2 {
    for (triangle, uvs) in mesh.triangles.iter().zip(&map.corner_uvs) {
        if let Some(corner) = triangle.iter().position(|&index| index as usize == vertex) {
            return uvs[corner];
        }
    }
    panic!("vertex {vertex} belongs to no triangle");
}

/// The largest number of triangles over any of many points of the map, by brute force.
fn deepest_overlap(map: &Parametrisation) -> usize {
    let points = 20_000;
    let inside = |[a, b, c]: [DVec2; 3], p: DVec2| {
        let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(p - from));
        sides.iter().all(|side| *side > 1e-9) || sides.iter().all(|side| *side < -1e-9)
    };
    (0..points)
        .map(|i| {
            let p = DVec2::new(
                (f64::from(i) + 0.5) / f64::from(points),
                (f64::from(i) * 0.618_033_988_749_895).fract(),
            );
            map.corner_uvs
                .iter()
                .filter(|triangle| inside(**triangle, p))
                .count()
        })
        .max()
        .expect("there are points")
}

/// Share of the unit square that is covered.
fn covered(map: &Parametrisation) -> f64 {
    map.corner_uvs
        .iter()
        .map(|[a, b, c]| 0.5 * (*b - *a).perp_dot(*c - *a).abs())
        .sum()
}

/// A ramp that winds around its axis three times: seen along the axis it covers itself.
fn winding_ramp() -> Mesh {
    grid(240, 4, |s, t| {
        let (phi, r) = (s * 3.0 * std::f64::consts::TAU, 1.0 + t);
        DVec3::new(r * phi.cos(), 0.6 * s, r * phi.sin())
    })
}

fn torus() -> Mesh {
    grid(96, 48, |s, t| {
        let (phi, theta) = (s * std::f64::consts::TAU, t * std::f64::consts::TAU);
        let r = 1.0 + 0.35 * theta.cos();
        DVec3::new(r * phi.cos(), 0.35 * theta.sin(), r * phi.sin())
    })
}

#[test]
fn a_covering_first_set_is_taken_as_it_is() {
    let mesh = floor(1.0, 0.0);
    let map = of(&mesh);
    assert_eq!((map.uv_set, map.object), (UvSet::TexCoord0, 3));
    // u runs with x, v with z.
    assert_eq!(uv_at(&mesh, &map, 0), DVec2::ZERO);
    assert_eq!(uv_at(&mesh, &map, 1), DVec2::X);
    assert_eq!(uv_at(&mesh, &map, 3), DVec2::Y);
    let chart = map.chart(8, 4);
    assert_eq!(chart.texel_areas_m2.len(), 1);
    assert!((chart.texel_area_m2(31) - 4.0 / 32.0).abs() < 1e-15);
}

/// A single-precision exporter's rounding does not spoil it; nor does a rotation.
#[test]
fn a_rotated_and_rounded_floor_keeps_its_first_set() {
    let rotation = DMat3::from_axis_angle(DVec3::new(0.3, -0.5, 0.8).normalize(), 1.1);
    let mut mesh = moved(floor(2.0, 0.0), rotation, DVec3::new(5.0, -3.0, 11.0));
    for position in &mut mesh.positions {
        *position = position.as_vec3().as_dvec3();
    }
    let map = of(&mesh);
    assert_eq!(map.uv_set, UvSet::TexCoord0);
    assert_eq!(map.chart(64, 64).texel_areas_m2.len(), 1);
}

#[test]
fn sets_that_share_places_are_refused() {
    let tiled = |scale: f64| {
        let mut mesh = floor(1.0, 0.0);
        mesh.uv0 = mesh.uv0.map(|set| set.into_iter().map(|uv| uv * scale).collect());
        mesh
    };
    assert_eq!(of(&tiled(2.0)).uv_set, UvSet::Generated, "beyond the unit square");
    assert_eq!(of(&tiled(0.1)).uv_set, UvSet::Generated, "a hundredth of the map");
    assert_eq!(
        of(&tiled(0.7)).uv_set,
        UvSet::TexCoord0,
        "half of the map is enough"
    );

    let mut twice = joined(
        floor(1.0, 0.0),
        quad(DVec3::new(3.0, 0.0, 0.0), DVec3::X, DVec3::Z),
    );
    assert_eq!(of(&twice).uv_set, UvSet::Generated, "two quads on one place");
    // Side by side they are fine.
    twice.uv0 = twice.uv0.map(|set| {
        set.into_iter()
            .enumerate()
            .map(|(vertex, uv)| DVec2::new(0.5 * uv.x + if vertex < 4 { 0.0 } else { 0.5 }, uv.y))
            .collect()
    });
    assert_eq!(of(&twice).uv_set, UvSet::TexCoord0);
    // A strip of a fiftieth that lies double is found.
    twice.uv0 = twice.uv0.map(|set| {
        set.into_iter()
            .enumerate()
            .map(|(vertex, uv)| {
                if vertex < 4 {
                    uv
                } else {
                    uv - DVec2::new(0.02, 0.0)
                }
            })
            .collect()
    });
    assert_eq!(of(&twice).uv_set, UvSet::Generated);
}

#[test]
fn numbers_that_are_none_and_triangles_without_a_place_are_refused() {
    let mut mesh = floor(1.0, 0.0);
    if let Some(set) = &mut mesh.uv0 {
        set[2].x = f64::NAN;
    }
    assert_eq!(of(&mesh).uv_set, UvSet::Generated);
    let mut mesh = floor(1.0, 0.0);
    if let Some(set) = &mut mesh.uv0 {
        set[3] = DVec2::new(0.5, 0.5);
    }
    assert_eq!(
        of(&mesh).uv_set,
        UvSet::Generated,
        "one triangle lies on a line of the map"
    );
}

#[test]
fn the_second_set_comes_before_a_first_one_that_does_not_cover() {
    let mut mesh = floor(1.0, 0.0);
    let half = |set: &Vec<DVec2>| set.iter().map(|uv| *uv * 0.5).collect::<Vec<_>>();
    mesh.uv1 = mesh.uv0.clone();
    mesh.uv0 = mesh.uv0.as_ref().map(half);
    assert_eq!(of(&mesh).uv_set, UvSet::TexCoord1);
    std::mem::swap(&mut mesh.uv0, &mut mesh.uv1);
    assert_eq!(
        of(&mesh).uv_set,
        UvSet::TexCoord0,
        "covering and planar comes first"
    );
}

#[test]
fn generated_floors_and_walls_are_upright() {
    let mesh = without_uv(floor(1.0, 0.0));
    let map = of(&mesh);
    assert_eq!(map.uv_set, UvSet::Generated);
    let expected = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
    for (vertex, uv) in expected.iter().enumerate() {
        assert!(
            uv_at(&mesh, &map, vertex).distance(*uv) < 1e-12,
            "floor, vertex {vertex}"
        );
    }
    // A wall that faces +z, seen from there: u to the right (+x), v down.
    let mesh = without_uv(quad(
        DVec3::new(0.0, 2.0, 0.0),
        DVec3::X * 3.0,
        DVec3::NEG_Y * 2.0,
    ));
    assert!(mesh.face_normal(0).distance(DVec3::Z) < 1e-15);
    let map = of(&mesh);
    for (vertex, uv) in expected.iter().enumerate() {
        assert!(
            uv_at(&mesh, &map, vertex).distance(*uv) < 1e-12,
            "wall, vertex {vertex}"
        );
    }
    assert!((map.suggested_aspect - 1.5).abs() < 1e-12);
}

/// Whatever way a square lies, the generated map is full, and not mirrored.
#[test]
fn a_generated_map_of_a_rotated_square_is_full() {
    for step in 0..24 {
        let axis = DVec3::new(0.2, 1.0, f64::from(step) - 12.0).normalize();
        let rotation = DMat3::from_axis_angle(axis, 0.37 * f64::from(step));
        let mesh = without_uv(moved(floor(0.7, 0.0), rotation, DVec3::new(1.0, 2.0, 3.0)));
        let map = of(&mesh);
        assert!(
            (covered(&map) - 1.0).abs() < 1e-9,
            "step {step}: {}",
            covered(&map)
        );
        assert_eq!(map.chart(32, 32).texel_areas_m2.len(), 1, "step {step}");
        for [a, b, c] in &map.corner_uvs {
            assert!(
                (*b - *a).perp_dot(*c - *a) < 0.0,
                "step {step}: mirrored, v runs downwards"
            );
        }
    }
}

#[test]
fn bent_surfaces_get_a_place_for_every_point() {
    let two_sided = joined(
        floor(1.0, 0.0),
        quad(DVec3::new(-1.0, 0.0, 1.0), DVec3::X * 2.0, DVec3::NEG_Z * 2.0),
    );
    let meshes = [
        ("ball", sphere(DVec3::ZERO, 1.0, 48, 24)),
        ("torus", torus()),
        ("box", cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0))),
        ("winding ramp", winding_ramp()),
        ("sheet with two sides", without_uv(two_sided)),
    ];
    for (name, mesh) in meshes {
        let map = of(&mesh);
        assert_eq!(map.uv_set, UvSet::Generated, "{name}");
        assert_eq!(deepest_overlap(&map), 1, "{name}");
        assert!(
            covered(&map) > 0.35,
            "{name}: only {} of the map is used",
            covered(&map)
        );
        for uv in map.corner_uvs.iter().flatten() {
            assert!(uv.min_element() >= 0.0 && uv.max_element() <= 1.0, "{name}: {uv}");
        }
    }
}

/// One scale for all, as far as a bent chart can be flat.
#[test]
fn texels_are_alike_all_over_a_bent_surface() {
    for (name, mesh, least) in [
        ("box", cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)), 1.0 - 1e-5),
        ("ball", sphere(DVec3::ZERO, 1.0, 48, 24), 0.766),
    ] {
        let map = of(&mesh);
        let density: Vec<f64> = (0..mesh.triangles.len())
            .filter(|&triangle| map.triangle_area_m2(triangle) > 0.0)
            .map(|triangle| {
                let [a, b, c] = map.corner_uvs[triangle];
                0.5 * (b - a).perp_dot(c - a).abs() / map.triangle_area_m2(triangle)
            })
            .collect();
        let (low, high) = density.iter().fold((f64::INFINITY, 0.0f64), |(low, high), d| {
            (low.min(*d), high.max(*d))
        });
        assert!(low / high >= least, "{name}: {}", low / high);
    }
}

/// Faces of a box keep two texels apart at the nominal size.
#[test]
fn pieces_keep_their_gutter() {
    let mesh = cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0));
    let map = parametrise(0, &mesh, 128).expect("the box has area");
    let boxes: Vec<(DVec2, DVec2)> = map
        .corner_uvs
        .chunks(2)
        .map(|face| {
            face.iter()
                .flatten()
                .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), uv| {
                    (low.min(*uv), high.max(*uv))
                })
        })
        .collect();
    for (index, a) in boxes.iter().enumerate() {
        for b in &boxes[index + 1..] {
            let gap = (a.0 - b.1).max(b.0 - a.1).max_element() * 128.0;
            assert!(gap >= 2.0 - 1e-9, "{gap} texels");
        }
    }
}

#[test]
fn no_area_no_map_and_the_same_every_time() {
    let point = DVec3::ONE;
    let mesh = Mesh {
        positions: vec![point; 3],
        normals: vec![DVec3::Y; 3],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    assert!(parametrise(0, &mesh, 64).is_none());
    assert!(parametrise(0, &Mesh::default(), 64).is_none());
    let mesh = torus();
    assert_eq!(of(&mesh).corner_uvs, of(&mesh).corner_uvs);
}

/// At a seam either side reads what the surface has there, gutters included: a field that is even in space is even
/// across.
#[test]
fn gutters_go_on_beyond_seams_as_the_surface_does() {
    let mesh = without_uv(sphere(DVec3::ZERO, 1.0, 48, 24));
    let chart = of(&mesh).chart(512, 512);
    let field = |point: DVec3| 3.0 + point.dot(DVec3::new(1.0, 0.7, -0.5));
    let place = |triangle: usize, weights: DVec3| {
        let [a, b, c] = mesh.corners(triangle);
        a * weights.x + b * weights.y + c * weights.z
    };
    // The mean over the part of a triangle in a texel is the value at the middle of that part.
    let size = DVec2::new(chart.width as f64, chart.height as f64);
    let mut sums = vec![(0.0, 0.0); chart.width * chart.height];
    for (triangle, uvs) in chart.corner_uvs.iter().enumerate() {
        let corners = uvs.map(|uv| uv * size);
        for row in rows(corners, chart.height) {
            for_each_texel_in_row(corners, row, chart.width, |column, part| {
                let at = part.centroid() / size;
                let sum = &mut sums[row * chart.width + column];
                sum.0 += part.area() * field(place(triangle, barycentric(*uvs, at)));
                sum.1 += part.area();
            });
        }
    }
    let mut values: Vec<[f32; 3]> = sums
        .iter()
        .map(|&(sum, area)| [if area > 0.0 { (sum / area) as f32 } else { 0.0 }; 3])
        .collect();
    fill_gutter(&chart, &mut values);
    let texel_m = (4.0 * std::f64::consts::PI / chart.texel_areas_m2.len() as f64).sqrt();
    let (mut worst, mut squares, mut looks) = (0.0_f64, 0.0, 0.0);
    let with_area = |triangle: &usize| mesh.face_normal(*triangle) != DVec3::ZERO;
    for triangle in (0..mesh.triangles.len()).filter(with_area) {
        let uvs = chart.corner_uvs[triangle];
        for corner in 0..3 {
            // Along all edges, those at seams among them.
            for t in [0.2, 0.5, 0.8] {
                let mut weights = DVec3::ZERO;
                weights[corner] = 1.0 - t;
                weights[(corner + 1) % 3] = t;
                let uv = uvs[0] * weights.x + uvs[1] * weights.y + uvs[2] * weights.z;
                let read = bilinear(&values, chart.width, chart.height, uv).g;
                let off = (read - field(place(triangle, weights))).abs() / texel_m;

                worst = worst.max(off);
                squares += off * off;
                looks += 1.0;
            }
        }
    }
    let rms = (squares / looks).sqrt();
    assert!(!chart.beyond.is_empty(), "it has seams");
    assert!(worst < 1.0 && rms < 0.1, "{worst} at most, {rms} rms");
}

/// Weights of a triangle's corners at a place of the map.
fn barycentric([a, b, c]: [DVec2; 3], at: DVec2) -> DVec3 {
    let all = (b - a).perp_dot(c - a);
    let (v, w) = ((at - a).perp_dot(c - a) / all, (b - a).perp_dot(at - a) / all);
    DVec3::new(1.0 - v - w, v, w)
}
