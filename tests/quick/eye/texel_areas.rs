//! The area of the surface under each texel.

use std::f64::consts::TAU;

use nephroid::illumination::parametrisation::coverage::Polygon;
use nephroid::illumination::parametrise;

use crate::prelude::*;
use support::meshes::{cuboid, floor, grid, joined, moved, quad, sphere};

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
    let map = parametrise(0, mesh, 256).expect("the mesh has area");
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

proptest! {
    #![proptest_config(support::law(2048))]

    /// Cut into cells, a triangle keeps its area; no cell holds more than its own.
    #[test]
    fn cells_add_up(corners in prop::array::uniform3((0.0..6.0f64, 0.0..5.0f64))) {
        let triangle = Polygon::triangle(corners.map(|(x, y)| dvec2(x, y)));
        let mut sum = 0.0;
        for (row, column) in (0..5u8).flat_map(|row| (0..6u8).map(move |column| (row, column))) {
            let low = dvec2(column.into(), row.into());
            let part = triangle.clipped(1, low.y, low.y + 1.0).clipped(0, low.x, low.x + 1.0);
            prop_assert!(part.area() <= 1.0 + 1e-12);
            sum += part.area();
            let off = part.centroid() - low;
            let is_inside = off.min_element() >= -1e-9 && off.max_element() <= 1.0 + 1e-9;
            prop_assert!(part.area() == 0.0 || is_inside);
        }
        prop_assert!((sum - triangle.area()).abs() < 1e-12);
    }
}
