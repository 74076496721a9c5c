//! Lamps that light nothing, and surfaces that only show their unlit side: scenes that come out black without an error.

use glam::DVec3;

use super::watertight::{is_closed, volume_m3};
use super::{LightKind, Scene};
use crate::error::Warning;
use crate::geometry::enclosure::{Bounds, winding_number};
use crate::geometry::triangle::ShearedRay;
use crate::geometry::{Ray, TriangleBvh};

/// Most triangles of a surface from which it is tried what their fronts face.
const SAMPLES: usize = 64;

/// Distance of the origins of these rays from the surface, in sizes of the scene.
const RAISED: f64 = 1e-6;

/// One warning for each lamp within an opaque body, and for each surface of which only the back is lit but not drawn.
pub fn warnings(scene: &Scene) -> Vec<Warning> {
    let enclosed = scene.lights.iter().filter_map(|light| {
        let body = enclosing(scene, light.kind.position()?)?;
        Some(Warning::new(
            format!("light `{}`", light.name),
            format!("is within `{}`, which is opaque, so that it lights nothing outside", scene.objects[body].name),
            "move it out, or let the material transmit light",
        ))
    });
    let mut all: Vec<Warning> = enclosed.collect();
    let turned_away: Vec<usize> = (0..scene.objects.len())
        .filter(|&object| faces_no_light(scene, object))
        .collect();
    if turned_away.is_empty() {
        return all;
    }
    let objects = scene.objects.iter().map(|object| object.in_scene());
    let corners = objects.flat_map(|mesh| (0..mesh.triangle_count()).map(move |triangle| mesh.corners(triangle)));
    let tree = TriangleBvh::build(&corners.collect::<Vec<_>>());
    for object in turned_away.into_iter().filter(|&object| faces_nothing(scene, &tree, object)) {
        all.push(Warning::new(
            format!("node `{}`", scene.objects[object].name),
            "faces away from every light, and its back, which is lit, is not drawn",
            "turn its faces, or make its material double-sided",
        ));
    }
    all
}

fn contains(outer: Bounds, inner: Bounds) -> bool {
    outer.0.cmple(inner.0).all() && outer.1.cmpge(inner.1).all()
}

/// The opaque closed object around a place, if nothing else is within it that could be lit.
fn enclosing(scene: &Scene, place: DVec3) -> Option<usize> {
    (0..scene.objects.len()).find(|&index| {
        let object = &scene.objects[index];
        let Some(bounds) = object.bounds() else {
            return false;
        };
        let is_within = |inner: Bounds| contains(bounds, inner);
        let holds_others = || {
            let mut others = (0..scene.objects.len()).filter(|&other| other != index);
            others.any(|other| scene.objects[other].bounds().is_some_and(is_within))
                || scene.cameras.iter().any(|camera| is_within((camera.position, camera.position)))
        };
        let is_inside = || {
            let mesh = object.in_scene();
            let triangles = (0..mesh.triangle_count()).map(|triangle| mesh.corners(triangle));
            volume_m3(mesh) > 0.0 && winding_number(triangles, place).abs() > 0.5
        };
        is_within((place, place))
            && scene.material_of(index).is_opaque()
            && is_closed(object.mesh())
            && is_inside()
            && !holds_others()
    })
}

/// Whether all lights are behind all triangles of a surface of which only the front is drawn.
fn faces_no_light(scene: &Scene, object: usize) -> bool {
    let material = scene.material_of(object);
    let is_sheet = material.is_opaque() && material.surface.is_receiver() && !material.double_sided;
    let mesh = scene.objects[object].in_scene();
    let is_behind = |triangle: usize| {
        let (normal, corner) = (mesh.face_normal(triangle), mesh.corners(triangle)[0]);
        scene.lights.iter().all(|light| match light.kind {
            LightKind::Sun { direction, .. } => normal.dot(direction) > 0.0,
            _ => light.kind.position().is_some_and(|place| normal.dot(place - corner) < 0.0),
        })
    };
    is_sheet && !scene.lights.is_empty() && (0..mesh.triangle_count()).all(is_behind)
}

/// Whether rays from the front of a surface, along its normals, leave the scene.
fn faces_nothing(scene: &Scene, tree: &TriangleBvh, object: usize) -> bool {
    let mesh = scene.objects[object].in_scene();
    let (low, high) = scene.bounds().unwrap_or_default();
    let step = mesh.triangle_count().div_ceil(SAMPLES).max(1);
    (0..mesh.triangle_count()).step_by(step).all(|triangle| {
        let [a, b, c] = mesh.corners(triangle);
        let normal = mesh.face_normal(triangle);
        let ray = Ray {
            origin: (a + b + c) / 3.0 + normal * (RAISED * (high - low).length()),
            direction: normal,
        };
        let sheared = ShearedRay::new(&ray);
        let mut is_free = true;
        tree.search(&ray, f64::INFINITY, |slot| {
            is_free &= normal == DVec3::ZERO || sheared.intersect(tree.corners(slot)).is_none();
            is_free.then_some(f64::INFINITY)
        });
        is_free
    })
}
