//! Surfaces that meet. Where surfaces of two objects coincide to within the rounding of their coordinates, rays cannot
//! tell which one comes first. On loading, one of them is set apart by more than any rounding, so that all rays meet
//! both in the order of the media:
//! - A solid reaches into what it touches. Light goes from glass straight into the table or the liquid that touches it,
//!   without a gap of air.
//! - Of surfaces that face the same way, the smaller one covers the other, as a rug covers a floor.
//! - Sheets back to back are met each on its own side.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::watertight::is_closed;
use super::{Mesh, Object, Scene};
use crate::error::Warning;
use crate::geometry::enclosure::Bounds;
use crate::geometry::{TriangleBvh, bits, bvh};

/// Largest distance of surfaces that meet, in their coordinates [1]: a few roundings to single precision, in which
/// files keep positions.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

/// Coordinates count up to this many times those of the other, smaller triangle: a table does not meet what hovers over
/// it because the floor of its triangles is wide.
const MAX_RATIO: f64 = 16.0;

/// Step by which surfaces are set apart, in largest distances.
const STEP: f64 = 8.0;

/// Step in radii of the scene, which single precision on the device tells apart, and its limit in sizes of the object.
const DEVICE_STEP: f64 = 1.0 / (1 << 19) as f64;
const MAX_STEP: f64 = 1e-4;

/// Smallest cosine between the normals of surfaces that coincide.
const PARALLEL: f64 = 0.9999;

/// Most factors by which a vertex of several faces moves farther than each face does.
const MAX_REACH: f64 = 4.0;

/// Most objects that a warning names.
const MAX_NAMED: usize = 4;

/// A triangle in the scene.
#[derive(Clone, Copy, Debug)]
struct Face {
    object: usize,
    triangle: usize,
    corners: [DVec3; 3],
    /// Unit.
    normal: DVec3,
}

/// Two faces, by index, that coincide in more than a line.
#[derive(Clone, Copy, Debug)]
struct Contact {
    faces: [usize; 2],
    /// Whether both face the same way.
    is_same_side: bool,
    /// Largest distance at which they count as coincident [m].
    tolerance_m: f64,
}

/// Movements of vertices [m], by body and place.
type Steps = HashMap<(usize, [u64; 3]), Vec<DVec3>>;

/// Sets apart all surfaces that meet, but for objects that both stand as `before`, where that was done. Returns a
/// warning of those that cover others.
pub fn set_apart(scene: &mut Scene, before: Option<&Scene>) -> Option<Warning> {
    let faces = faces(scene, before);
    let contacts = contacts(&faces);
    if contacts.is_empty() {
        return None;
    }
    let movements = Movements::of(scene, &faces, &contacts);
    let steps = movements.steps(scene, &faces);
    let moved: Vec<(usize, Mesh)> = (0..scene.objects.len())
        .filter_map(|object| Some((object, moved(scene, object, &steps)?)))
        .collect();
    let warning = movements.warning(scene);
    for (object, mesh) in moved {
        scene.objects[object].reshape(Arc::new(mesh));
    }
    warning
}

/// All triangles within the bounding box of another object, one of the two not standing as `before`.
fn faces(scene: &Scene, before: Option<&Scene>) -> Vec<Face> {
    // Two objects that both stand as before were set apart then.
    let is_new = |object: usize| {
        let was = before.and_then(|before| before.objects.get(object));
        was.is_none_or(|was| !scene.objects[object].stands_as(was))
    };
    let is_new: Vec<bool> = (0..scene.objects.len()).map(is_new).collect();
    let boxes = scene
        .objects
        .iter()
        .map(|object| object.bounds().unwrap_or_default());
    let boxes: Vec<Bounds> = boxes.collect();
    // Instances at one place are as one: thousands of them would meet in millions of pairs.
    let mut seen = HashSet::new();
    let is_first = |(object, (low, high)): (&Object, &Bounds)| {
        let mesh = object.in_scene();
        let first = (mesh.triangle_count() > 0).then(|| mesh.corners(0).map(bits));
        seen.insert((mesh.triangle_count(), first, bits(*low), bits(*high)))
    };
    let is_first: Vec<bool> = scene.objects.iter().zip(&boxes).map(is_first).collect();

    // The boxes of objects stand in the hierarchy as degenerate triangles along their diagonals.
    let corners: Vec<[DVec3; 3]> = boxes.iter().map(|&(low, high)| [low, high, high]).collect();
    let near = TriangleBvh::build(&corners);

    // Most objects and triangles are ruled out by their boxes, before anything is compared face by face.
    let of_object = |object: usize| {
        let is_near = |&(low, high): &Bounds| {
            !all_within(&near, (low, high), |slot| {
                let other = near.triangle(slot) as usize;
                let may_meet = other != object && (is_new[object] || is_new[other]);
                !(may_meet && overlap(boxes[other], (low, high)))
            })
        };
        let mut faces = Vec::new();
        if !is_first[object] || !is_near(&widened(boxes[object])) {
            return faces;
        }
        let mesh = scene.objects[object].in_scene();
        for triangle in 0..mesh.triangle_count() {
            let corners = mesh.corners(triangle);
            let normal = mesh.face_normal(triangle);
            if normal != DVec3::ZERO && is_near(&widened(bounds(&corners))) {
                faces.push(Face {
                    object,
                    triangle,
                    corners,
                    normal,
                });
            }
        }
        faces
    };

    // Faces stay in the order of objects, whatever the threads: the same ones move each time.
    (0..boxes.len())
        .into_par_iter()
        .flat_map_iter(of_object)
        .collect()
}

fn bounds([a, b, c]: &[DVec3; 3]) -> Bounds {
    (a.min(*b).min(*c), a.max(*b).max(*c))
}

/// A box with a margin of the largest distance of surfaces that meet.
fn widened((low, high): Bounds) -> Bounds {
    let margin = DVec3::splat(4.0 * ROUNDING * low.abs().max(high.abs()).max_element());
    (low - margin, high + margin)
}

fn overlap(a: Bounds, b: Bounds) -> bool {
    a.0.cmple(b.1).all() && a.1.cmpge(b.0).all()
}

/// Whether `holds` for all slots whose boxes may overlap a box; stops at the first for which it does not.
fn all_within(tree: &TriangleBvh, within: Bounds, mut holds: impl FnMut(u32) -> bool) -> bool {
    let mut waiting: Vec<bvh::Node> = tree.root().into_iter().collect();
    while let Some(node) = waiting.pop() {
        if !overlap(node.bounds(), within) {
            continue;
        }
        if !node.slots().all(&mut holds) {
            return false;
        }
        waiting.extend(node.children().into_iter().flatten());
    }
    true
}

fn contacts(faces: &[Face]) -> Vec<Contact> {
    let corners: Vec<[DVec3; 3]> = faces.iter().map(|face| face.corners).collect();
    let tree = TriangleBvh::build(&corners);
    let of_face = |index: usize| {
        let mut found = Vec::new();
        all_within(&tree, widened(bounds(&corners[index])), |slot| {
            let other = tree.triangle(slot) as usize;
            if other > index && faces[other].object != faces[index].object {
                found.extend(contact(faces, [index, other]));
            }
            true
        });
        found.sort_unstable_by_key(|contact: &Contact| contact.faces);
        found
    };
    (0..faces.len()).into_par_iter().flat_map_iter(of_face).collect()
}

/// The contact of two faces, if they lie in one plane and overlap.
fn contact(faces: &[Face], pair: [usize; 2]) -> Option<Contact> {
    let [a, b] = pair.map(|face| &faces[face]);
    let cosine = a.normal.dot(b.normal);
    if cosine.abs() < PARALLEL {
        return None;
    }
    let largest = |face: &Face| {
        face.corners
            .iter()
            .fold(DVec3::ZERO, |most, corner| most.max(corner.abs()))
    };
    let [of_a, of_b] = [a, b].map(largest);
    let (size_a, size_b) = (of_a.max_element(), of_b.max_element());
    let around = size_a.max(size_b).min(MAX_RATIO * size_a.min(size_b));
    let tolerance_m = ROUNDING * (around + a.normal.abs().dot(of_a) + b.normal.abs().dot(of_b));
    let lies_in = |face: &Face, plane: &Face| {
        let off = |corner: &DVec3| (*corner - plane.corners[0]).dot(plane.normal).abs();
        face.corners.iter().all(|corner| off(corner) <= tolerance_m)
    };
    ((lies_in(a, b) || lies_in(b, a)) && share_area(a, b, tolerance_m)).then_some(Contact {
        faces: pair,
        is_same_side: cosine > 0.0,
        tolerance_m,
    })
}

/// Whether two triangles of one plane overlap by more than a distance along every direction.
fn share_area(a: &Face, b: &Face, least_m: f64) -> bool {
    let (x, y) = a.normal.any_orthonormal_pair();
    let origin = a.corners[0];
    let flat = |face: &Face| {
        let corners = face.corners.map(|corner| corner - origin);
        corners.map(|corner| DVec2::new(corner.dot(x), corner.dot(y)))
    };
    let both = [flat(a), flat(b)];
    let axes = both.iter().flat_map(|[a, b, c]| [*b - *a, *c - *b, *a - *c]);
    let range = |corners: &[DVec2; 3], axis: DVec2| {
        let [a, b, c] = corners.map(|corner| corner.dot(axis));
        (a.min(b).min(c), a.max(b).max(c))
    };
    axes.map(|edge| edge.perp().normalize_or_zero()).all(|axis| {
        let [one, other] = both.each_ref().map(|corners| range(corners, axis));
        one.1.min(other.1) - one.0.max(other.0) > least_m
    })
}

/// Which faces move along their normals, and why.
#[derive(Debug, Default)]
struct Movements {
    /// Distance [m], by face; negative against its normal.
    of_faces: BTreeMap<usize, f64>,
    /// Objects that each sheet covers.
    covered: BTreeMap<usize, BTreeSet<usize>>,
}

impl Movements {
    fn of(scene: &Scene, faces: &[Face], contacts: &[Contact]) -> Self {
        // On the device, coordinates are rounded in proportion to the radius of the scene.
        let mut all = Self::default();
        let (low, high) = scene.bounds().unwrap_or_default();
        let device_m = DEVICE_STEP * 0.5 * (high - low).length();
        let is_solid = |face: usize| scene.material_of(faces[face].object).is_solid();

        // Objects may meet in thousands of triangles; area and closedness are found once.
        let mut areas_m2 = HashMap::new();
        let mut closed = HashMap::new();
        for contact in contacts {
            let [first, second] = contact.faces;
            let mut area = |face: usize| {
                let object = faces[face].object;
                *areas_m2
                    .entry(object)
                    .or_insert_with(|| scene.objects[object].in_scene().area_m2())
            };
            let smaller = usize::from(area(second) <= area(first));
            let (smaller, larger) = (contact.faces[smaller], contact.faces[1 - smaller]);
            let mut is_closed = |face: usize| {
                let mesh = scene.objects[faces[face].object].mesh();
                *closed.entry(Arc::as_ptr(mesh)).or_insert_with(|| is_closed(mesh))
            };

            // A solid reaches into what it touches; of two alike, the smaller one moves.
            let mover = match (is_solid(first), is_solid(second)) {
                (true, false) => first,
                (false, true) => second,
                (true, true) => smaller,
                // Where closed bodies stand on something, nobody sees either face.
                (false, false) if !contact.is_same_side && (is_closed(first) || is_closed(second)) => {
                    continue;
                }
                (false, false) => smaller,
            };

            // The step exceeds the rounding of the contact, and that of the device unless that deforms a small object.
            let object = faces[mover].object;
            let (low, high) = scene.objects[object].bounds().unwrap_or_default();
            let step_m = (STEP * contact.tolerance_m).max(device_m.min(MAX_STEP * (high - low).length()));

            // Of solids that face the same way, one lies within the other and withdraws from the common face.
            let is_within = contact.is_same_side && is_solid(first) && is_solid(second);
            let known = all.of_faces.entry(mover).or_default();
            *known = if is_within { -step_m } else { known.max(step_m) };
            if contact.is_same_side && !is_solid(mover) {
                all.covered
                    .entry(object)
                    .or_default()
                    .insert(faces[larger].object);
            }
        }
        all
    }

    fn warning(&self, scene: &Scene) -> Option<Warning> {
        let name = |object: &usize| format!("`{}`", scene.objects[*object].name);
        let (_, below) = self.covered.first_key_value()?;
        let mut names: Vec<String> = self.covered.keys().take(MAX_NAMED).map(name).collect();
        if self.covered.len() > MAX_NAMED {
            names.push(format!("{} more", self.covered.len() - MAX_NAMED));
        }
        let under: Vec<String> = below.first().iter().map(|object| name(object)).collect();
        Some(Warning::new(
            format!("nodes {}", names.join(", ")),
            format!(
                "cover larger surfaces that lie in the same plane and face the same way, the first one {}",
                under.concat()
            ),
            "raise what is to be seen a little",
        ))
    }

    /// Steps of all vertices at the corners of the faces.
    fn steps(&self, scene: &Scene, faces: &[Face]) -> Steps {
        let mut steps = Steps::new();
        for (&face, &distance_m) in &self.of_faces {
            let Face {
                object,
                triangle,
                normal,
                ..
            } = faces[face];
            // Above everything that it covers.
            let layers = self.covered.get(&object).map_or(1, BTreeSet::len);
            let step = normal * (distance_m * layers as f64);
            for corner in scene.objects[object].in_scene().corners(triangle) {
                let key = (scene.body_of(object), bits(corner));
                steps.entry(key).or_default().push(step);
            }
        }
        steps
    }
}

/// The mesh of an object with its vertices moved; `None` if none of them is.
fn moved(scene: &Scene, object: usize, steps: &Steps) -> Option<Mesh> {
    let found = &scene.objects[object];
    let body = scene.body_of(object);
    let inverse = found.world_from_object().matrix3.inverse();
    let mut mesh: Option<Mesh> = None;
    for (vertex, place) in found.in_scene().positions().enumerate() {
        let step = steps.get(&(body, bits(place))).map(|steps| reach(steps));
        if let Some(step) = step.map(|step| inverse * step).filter(|step| step.is_finite()) {
            mesh.get_or_insert_with(|| Mesh::clone(found.mesh())).positions[vertex] += step;
        }
    }
    mesh
}

/// The shortest step, about, that takes a vertex as far along each of several steps as that step goes.
fn reach(steps: &[DVec3]) -> DVec3 {
    let mut distinct: Vec<DVec3> = Vec::new();
    for &step in steps {
        let is_known = |known: &DVec3| known.dot(step) > (1.0 - 1e-9) * known.length() * step.length();
        if !distinct.iter().any(is_known) {
            distinct.push(step);
        }
    }
    let sum: DVec3 = distinct.iter().sum();
    let least = distinct.iter().map(|step| sum.dot(*step) / step.length_squared());
    let least = least.fold(f64::INFINITY, f64::min);
    sum / least.max(distinct.len() as f64 / MAX_REACH)
}
