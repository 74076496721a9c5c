//! The area of the surface under each texel.

use glam::{DMat3, DVec2, DVec3};
use nephroid::illumination::parametrisation::coverage::Polygon;
use nephroid::illumination::parametrise;
use nephroid::scene::Mesh;
use proptest::prelude::*;

use crate::meshes::{cuboid, floor, grid, joined, moved, quad, sphere};

fn disc() -> Mesh {
    grid(5, 40, |s, t| {
        let phi = t * std::f64::consts::TAU;
        DVec3::new(s * phi.cos(), 0.0, s * phi.sin())
    })
}

fn l_shape() -> Mesh {
    let mut mesh = joined(
        quad(DVec3::ZERO, DVec3::X * 3.0, DVec3::Z),
        quad(DVec3::Z, DVec3::X, DVec3::Z * 2.0),
    );
    mesh.uv0 = None;
    mesh
}

/// Every square metre is under some texel, at any map size, also one with more columns than rows.
#[test]
fn texel_areas_sum_to_the_mesh_area() {
    let tilt = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.9);
    let meshes = [
        ("floor", floor(1.0, 0.0)),
        ("tilted L", moved(l_shape(), tilt, DVec3::ONE)),
        ("disc", disc()),
        ("ball", sphere(DVec3::ZERO, 2.0, 64, 32)),
        ("box", cuboid(DVec3::ZERO, DVec3::new(0.1, 2.0, 7.0))),
    ];
    for (name, mesh) in meshes {
        let map = parametrise(0, &mesh, 256).expect("the mesh has area");
        assert!((map.area_m2() / mesh.area_m2() - 1.0).abs() < 1e-12);
        for (width, height) in [(1, 1), (7, 3), (64, 64), (256, 100)] {
            let chart = map.chart(width, height);
            let sum: f64 = (0..width * height).map(|texel| chart.texel_area_m2(texel)).sum();
            assert!(
                (sum / mesh.area_m2() - 1.0).abs() < 1e-9,
                "{name} at {width}×{height}: {sum} for {}",
                mesh.area_m2()
            );
        }
    }
}

/// An L of 3 × 3 with a 2 × 2 corner missing: those texels of a 3 × 3 map are empty, the others hold 1 m² each.
#[test]
fn texels_beside_the_surface_are_empty() {
    let chart = parametrise(0, &l_shape(), 64)
        .expect("the L has area")
        .chart(3, 3);
    let areas: Vec<f64> = (0..9).map(|texel| chart.texel_area_m2(texel)).collect();
    let expected = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    for (texel, (area, expected)) in areas.iter().zip(expected).enumerate() {
        assert!((area - expected).abs() < 1e-12, "texel {texel}: {areas:?}");
    }
    assert_eq!(areas[8], 0.0, "exactly none");
}

/// A set that squeezes one half of a floor: there a texel holds more surface.
#[test]
fn texels_follow_the_local_scale() {
    let mut mesh = joined(
        quad(DVec3::ZERO, DVec3::X, DVec3::Z),
        quad(DVec3::X, DVec3::X * 3.0, DVec3::Z),
    );
    let uv = |u: f64, v: f64| DVec2::new(u, v);
    mesh.uv0 = Some(vec![
        uv(0.0, 0.0),
        uv(0.5, 0.0),
        uv(0.5, 1.0),
        uv(0.0, 1.0),
        uv(0.5, 0.0),
        uv(1.0, 0.0),
        uv(1.0, 1.0),
        uv(0.5, 1.0),
    ]);
    let chart = parametrise(0, &mesh, 64).expect("the floor has area").chart(4, 2);
    let expected = [0.25, 0.25, 0.75, 0.75, 0.25, 0.25, 0.75, 0.75];
    for (texel, expected) in expected.iter().enumerate() {
        assert!((chart.texel_area_m2(texel) - expected).abs() < 1e-12);
    }
}

proptest! {
    #![proptest_config(crate::law())]

    /// Cut into cells, a triangle keeps its area; no cell holds more than its own.
    #[test]
    fn cells_add_up(corners in prop::array::uniform3((0.0..6.0f64, 0.0..5.0f64))) {
        let triangle = Polygon::triangle(corners.map(|(x, y)| DVec2::new(x, y)));
        let mut sum = 0.0;
        for row in 0..5u8 {
            for column in 0..6u8 {
                let (x, y) = (f64::from(column), f64::from(row));
                let part = triangle.clipped(1, y, y + 1.0).clipped(0, x, x + 1.0);
                prop_assert!(part.area() <= 1.0 + 1e-12);
                sum += part.area();
                let c = part.centroid();
                prop_assert!(part.area() == 0.0 || (c.x >= x - 1e-9 && c.x <= x + 1.0 + 1e-9 && c.y >= y - 1e-9 && c.y <= y + 1.0 + 1e-9));
            }
        }
        prop_assert!((sum - triangle.area()).abs() < 1e-12);
    }
}
