//! Bodies of glass that share a face: light cannot leave one and enter the other at the same place.

use std::collections::BTreeMap;

use glam::DVec3;

use super::Scene;
use crate::error::Warning;

/// Quantisation of planes: steps per unit of a normal's component, and per largest coordinate.
const STEPS: f64 = 1e9;

/// Largest number of warnings.
const MAX_WARNINGS: usize = 8;

/// Largest number of triangle comparisons; the search ends there.
const MAX_TESTS: usize = 1 << 22;

/// Quantised plane, the same from both sides.
type Plane = [i64; 4];

/// Triangle of a body, by its object and bounding box [m].
#[derive(Clone, Copy, Debug)]
struct Face {
    object: usize,
    /// Whether its normal is on the front of its plane.
    is_front: bool,
    low: DVec3,
    high: DVec3,
}

/// Pairs of solid dielectrics, by object index, that share parts of faces, with the number of triangles of the first
/// that lie on the second.
pub fn touching(scene: &Scene) -> BTreeMap<(usize, usize), usize> {
    let mut pairs = BTreeMap::new();
    let mut tests = 0;
    for faces in planes(scene).values() {
        for (index, face) in faces.iter().enumerate() {
            // Faces are grouped by object.
            let next = faces[index..].partition_point(|other| other.object == face.object);
            let others = &faces[index + next..];
            tests += others.len() + 1;
            if tests > MAX_TESTS {
                return pairs;
            }
            let touched = others
                .iter()
                .filter(|other| touch(face, other))
                .map(|other| other.object);
            let mut touched: Vec<usize> = touched.collect();
            touched.dedup();
            for other in touched {
                *pairs.entry((face.object, other)).or_insert(0) += 1;
            }
        }
    }
    pairs
}

/// One warning for each of the first few pairs.
pub fn warnings(scene: &Scene) -> Vec<Warning> {
    let name = |object: usize| &scene.objects[object].name;
    let warning = |((a, b), faces): ((usize, usize), usize)| {
        Warning::new(
            format!("nodes `{}` and `{}`", name(a), name(b)),
            format!("touch in {faces} triangles, where light passes a gap of air that is not there"),
            "let one body reach a little into the other",
        )
    };
    touching(scene)
        .into_iter()
        .take(MAX_WARNINGS)
        .map(warning)
        .collect()
}

/// Triangles of all solid dielectrics that are near another one, by plane; empty with fewer than two such bodies.
fn planes(scene: &Scene) -> BTreeMap<Plane, Vec<Face>> {
    let is_solid = |object: &usize| scene.material_of(*object).is_solid();
    let bodies: Vec<usize> = (0..scene.objects.len()).filter(is_solid).collect();
    let mut planes: BTreeMap<Plane, Vec<Face>> = BTreeMap::new();
    let Some((low, high)) = scene.bounds().filter(|_| bodies.len() > 1) else {
        return planes;
    };
    let size_m = low.abs().max(high.abs()).max_element();
    let bounds = |object: usize| scene.objects[object].bounds();
    for &object in &bodies {
        // Wider than the tolerance of `touch`.
        let margin = DVec3::splat(1e-6 * size_m);
        let others = bodies.iter().filter(|other| **other != object);
        let boxes =
            others.filter_map(|&other| bounds(other).map(|(low, high)| (low - margin, high + margin)));
        let is_near = |(low, high): (DVec3, DVec3), (from, to): &(DVec3, DVec3)| {
            low.cmple(*to).all() && high.cmpge(*from).all()
        };
        let near = boxes.filter(|other| bounds(object).is_some_and(|own| is_near(own, other)));
        let near: Vec<(DVec3, DVec3)> = near.collect();
        if near.is_empty() {
            continue;
        }
        let mesh = scene.objects[object].in_scene();
        for triangle in 0..mesh.triangle_count() {
            let [a, b, c] = mesh.corners(triangle);
            let normal = mesh.face_normal(triangle);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            if normal == DVec3::ZERO || !near.iter().any(|other| is_near((low, high), other)) {
                continue;
            }
            let (plane, is_front) = plane(normal, a / size_m);
            let face = Face {
                object,
                is_front,
                low,
                high,
            };
            planes.entry(plane).or_default().push(face);
        }
    }
    planes
}

/// Quantised plane of a triangle, and whether the normal is on its front; `point` in units of the scene's size.
fn plane(normal: DVec3, point: DVec3) -> (Plane, bool) {
    let numbers = [normal.x, normal.y, normal.z, normal.dot(point)];
    let numbers = numbers.map(|number| (number * STEPS).round() as i64);
    // On the front, the first non-zero number is positive.
    let is_front = numbers
        .iter()
        .find(|number| **number != 0)
        .is_none_or(|number| *number > 0);
    let plane = if is_front {
        numbers
    } else {
        numbers.map(|number| -number)
    };
    (plane, is_front)
}

/// Whether two faces of one plane face each other and their bounding boxes overlap in more than an edge.
fn touch(a: &Face, b: &Face) -> bool {
    if a.is_front == b.is_front {
        return false;
    }
    let common = (a.high.min(b.high) - a.low.max(b.low)).to_array();
    let extent = (a.high - a.low).min(b.high - b.low).to_array();
    let wide = common
        .iter()
        .zip(extent)
        .filter(|(common, extent)| **common > 1e-6 * extent && *extent > 0.0);
    wide.count() >= 2
        && common
            .iter()
            .all(|common| *common >= -1e-9 * (a.high - a.low).max_element())
}
