//! Plate 9: the polygons of a complex object in its caustic.

use std::sync::Arc;

use glam::DVec3;

use super::{Bench, floor, percent, pictures, verdict, wavefront};
use crate::error::Result;
use crate::scene::builtin::{parts, shapes};
use crate::scene::{Mesh, Scene};
use crate::study::page::{Cell, Curve, Page, Plot, Table};
use crate::study::references::Reference;
use crate::units::Flux;

/// Quads around and along the knot's tube: the second has about as many triangles as the paper's object (3,958).
const MESHES: [(u32, u32); 3] = [(11, 45), (22, 90), (44, 180)];
const FINEST: (u32, u32) = (88, 360);

/// [1/sr].
const DENSITY_PER_SR: f64 = 3e3;
const QUICK_PER_SR: f64 = 500.0;

/// Radii of the knot [m]: of the ring that it winds around, of its winding, of its tube.
const RADII_M: [f64; 3] = [0.32, 0.13, 0.075];

/// Its centre [m].
const CENTRE: DVec3 = DVec3::new(0.0, 0.55, 0.0);

/// Errors of this and more are seen as a regular pattern.
const SEEN: f64 = 0.05;

const COLUMNS: [(&str, &str); 5] = [
    ("triangles", "triangles"),
    ("rays", "rays"),
    ("cpu_s", "CPU s"),
    ("relative_rmse", "error of the mesh"),
    ("ard", "ARD"),
];

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let settings = bench.at(
        wavefront(if bench.quick { QUICK_PER_SR } else { DENSITY_PER_SR }),
        bench.side(),
    );
    let finest = if bench.quick { MESHES[2] } else { FINEST };
    let truth_scene = Arc::new(knot(finest));
    let truth = bench.bake(&truth_scene, &settings)?;
    let mut maps: Vec<_> = floor(&truth_scene, &truth.maps).into_iter().collect();
    let truth = Reference::of_bake(truth.maps, "the finest mesh".into());
    let mut table = Table::new(&COLUMNS);
    let (mut points, mut plates) = (Vec::new(), Vec::new());
    for &mesh in bench.some(&MESHES, 2) {
        let scene = Arc::new(knot(mesh));
        let measured = bench.measure(&scene, &settings, &truth)?;
        let triangles = 2 * u64::from(mesh.0) * u64::from(mesh.1);
        points.push((triangles as f64, measured.agreement.relative_rmse));
        table.rows.push(vec![
            triangles.into(),
            measured.rays(),
            measured.cpu_s().into(),
            measured.rmse(),
            Cell::Share(measured.agreement.average_relative_difference),
        ]);
        maps.extend(floor(&scene, &measured.result.maps));
        if plates.is_empty() && mesh == MESHES[1] {
            let caption = format!("A glass knot of {triangles} triangles.");
            let camera = scene.cameras[0].clone();
            plates.push(pictures::view(bench, ("plate9", caption), &scene, &measured.result.maps, camera)?.0);
        }
    }
    let caption = "Maps of the floor: of the finest mesh, then from the coarsest mesh on.".into();
    plates.push(pictures::sheet(
        "complex",
        caption,
        &maps,
        (maps.len().clamp(1, 3), 256),
    ));
    Ok(Page {
        title: "Plate 9: a complex object".into(),
        settings: format!(
            "A trefoil knot of glass (n = 1.5) over a floor, meshes of rising fineness, maps of {0} × {0} texels, wavefront; against \
             the same with {1} triangles, so that the error is that of the mesh.",
            bench.side(),
            2 * finest.0 * finest.1
        ),
        table,
        plots: vec![Plot {
            name: "complex",
            title: "error of the mesh".into(),
            x: "triangles",
            y: "relative RMSE",
            is_share: true,
            curves: vec![Curve {
                name: "glass knot".into(),
                points: points.clone(),
            }],
        }],
        pictures: plates,
        findings: vec![finding(&points)],
    })
}

fn finding(points: &[(f64, f64)]) -> String {
    let like_paper = points.get(1).copied().unwrap_or((0.0, f64::NAN));
    format!(
        "With {} triangles, about as many as the paper's object, the mesh alone makes an error of {}. The paper sees regular artefacts \
         of the dataset's resolution at that number; this {}. Smooth normals do not help where facets move the light; more triangles \
         do.",
        like_paper.0,
        percent(like_paper.1),
        verdict(like_paper.1 > SEEN)
    )
}

/// A trefoil of glass over a floor.
fn knot((around, along): (u32, u32)) -> Scene {
    let mut scene = parts::reference_scene(1.0);
    scene.name = "knot".into();
    parts::add(
        &mut scene,
        "knot",
        tube(around, along),
        parts::dielectric("glass", 1.5),
    );
    let lamp = DVec3::new(0.4, 2.4, 0.3);
    scene.lights.push(parts::point_light("light", lamp, Flux(100.0)));
    scene
}

/// Middle of the tube, t in [0, 1].
fn line(t: f64) -> DVec3 {
    let angle = std::f64::consts::TAU * t;
    let [ring, winding, _] = RADII_M;
    let reach = ring + winding * (3.0 * angle).cos();
    let flat = DVec3::new(
        reach * (2.0 * angle).cos(),
        winding * (3.0 * angle).sin(),
        reach * (2.0 * angle).sin(),
    );
    CENTRE + flat
}

fn tube(around: u32, along: u32) -> Mesh {
    let radius_m = RADII_M[2];
    shapes::sheet(along, around, |u, v| {
        let (u, v) = (u.fract(), v.fract());
        let middle = line(u);
        let ahead = (line(u + 1e-5) - line(u - 1e-5)).normalize();
        let outward = (middle - CENTRE).normalize();
        let side = ahead.cross(outward).normalize();
        let up = side.cross(ahead);
        let (sine, cosine) = (std::f64::consts::TAU * v).sin_cos();
        let normal = up * cosine + side * sine;
        (middle + radius_m * normal, normal)
    })
}
