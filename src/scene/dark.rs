//! Lamps that light nothing, and surfaces that only show their unlit side: scenes that come out black without an error.

use glam::DVec3;

use super::watertight::volume_m3;
use super::{LightKind, Scene};
use crate::error::Warning;
use crate::geometry::enclosure::{Bounds, winding_number};
use crate::geometry::triangle::ShearedRay;
use crate::geometry::{Ray, TriangleBvh};

/// Most triangles of a surface from which it is tried what their fronts face.
const SAMPLES: usize = 64;

/// Distance of the origins of rays to lights from the surface, in sizes of the scene: beyond rounding.
const RAISED: f64 = 1e-9;

/// One warning for each lamp within an opaque body, and for each surface of which only the back is lit but not drawn.
pub fn warnings(scene: &Scene) -> Vec<Warning> {
    // Bulbs modelled as closed, opaque bodies keep the light of their lamp.
    let enclosed = scene.lights.iter().filter_map(|light| {
        let body = enclosing(scene, light.kind.position()?)?;
        Some(Warning::new(
            format!("light `{}`", light.name),
            format!(
                "is within `{}`, which is opaque, so that it lights nothing outside",
                scene.objects[body].name
            ),
            "move it out, or let the material transmit light",
        ))
    });
    let mut all: Vec<Warning> = enclosed.collect();

    // Normals rule out nearly all surfaces; only what is left is worth a hierarchy and rays.
    let turned_away: Vec<usize> = (0..scene.objects.len())
        .filter(|&object| faces_no_light(scene, object))
        .collect();
    if turned_away.is_empty() {
        return all;
    }
    let objects = scene.objects.iter().map(|object| object.in_scene());
    let corners =
        objects.flat_map(|mesh| (0..mesh.triangle_count()).map(move |triangle| mesh.corners(triangle)));
    let tree = TriangleBvh::build(&corners.collect::<Vec<_>>());

    // A front that faces nothing while light reaches the back was turned the wrong way.
    let shows_its_dark_side = |object: &usize| {
        let mut places = sampled(scene, *object).into_iter();
        places
            .clone()
            .all(|(place, normal)| is_free(&tree, raised(scene, place, normal), normal, f64::INFINITY))
            && places.any(|(place, normal)| is_lit(scene, &tree, place, -normal))
    };
    for object in turned_away.into_iter().filter(shows_its_dark_side) {
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
                || scene
                    .cameras
                    .iter()
                    .any(|camera| is_within((camera.position, camera.position)))
        };
        let is_inside = || {
            let mesh = object.in_scene();
            let triangles = (0..mesh.triangle_count()).map(|triangle| mesh.corners(triangle));
            volume_m3(mesh) > 0.0 && winding_number(triangles, place).abs() > 0.5
        };
        is_within((place, place))
            && scene.material_of(index).is_opaque()
            && object.is_closed()
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
            _ => light
                .kind
                .position()
                .is_some_and(|place| normal.dot(place - corner) < 0.0),
        })
    };
    is_sheet && !scene.lights.is_empty() && (0..mesh.triangle_count()).all(is_behind)
}

/// Points of a surface, with its normals there.
fn sampled(scene: &Scene, object: usize) -> Vec<(DVec3, DVec3)> {
    let mesh = scene.objects[object].in_scene();
    let step = mesh.triangle_count().div_ceil(SAMPLES).max(1);
    let triangles = (0..mesh.triangle_count()).step_by(step);
    let middle = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle);
        ((a + b + c) / 3.0, mesh.face_normal(triangle))
    };
    let all = triangles.map(middle);
    all.filter(|(_, normal)| *normal != DVec3::ZERO).collect()
}

fn raised(scene: &Scene, place: DVec3, normal: DVec3) -> DVec3 {
    let (low, high) = scene.bounds().unwrap_or_default();
    place + normal * (RAISED * (high - low).length())
}

/// Whether any light shines on a side of a point, through nothing.
fn is_lit(scene: &Scene, tree: &TriangleBvh, place: DVec3, normal: DVec3) -> bool {
    let raised = raised(scene, place, normal);
    scene.lights.iter().any(|light| {
        let (towards, distance_m) = match (&light.kind, light.kind.position()) {
            (LightKind::Sun { direction, .. }, _) => (-*direction, f64::INFINITY),
            (_, Some(position)) => ((position - raised).normalize_or_zero(), position.distance(raised)),
            (_, None) => return false,
        };
        towards.dot(normal) > 0.0 && is_free(tree, raised, towards, distance_m)
    })
}

/// Whether a ray meets nothing before a distance.
fn is_free(tree: &TriangleBvh, origin: DVec3, direction: DVec3, distance_m: f64) -> bool {
    let ray = Ray { origin, direction };
    let sheared = ShearedRay::new(&ray);
    let mut is_free = true;
    tree.search(&ray, distance_m, |slot| {
        let hit = sheared.intersect(tree.corners(slot));
        is_free = hit.is_none_or(|(hit_m, _)| hit_m >= distance_m);
        is_free.then_some(f64::INFINITY)
    });
    is_free
}
