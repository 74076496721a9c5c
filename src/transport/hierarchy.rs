//! The hierarchy of a scene: one over the triangles of most objects, and for each mesh with many instances one in
//! object space, below a hierarchy over these instances. An object that is moved becomes an instance, so no triangle
//! hierarchy is rebuilt.
//!
//! An instance's triangles are found by the mesh's hierarchy and met as placed in the scene, so that every hit is the
//! one that a copy of the mesh would give, to the last bit.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::smoothing::smoothing_groups;
use super::tracer::RayHit;
use crate::geometry::bvh::{self, FAR_RADII, Frame, NO_SLOT};
use crate::geometry::triangle::ShearedRay;
use crate::geometry::{Ray, TriangleBvh};
use crate::scene::mesh::Placement;
use crate::scene::{Mesh, Object, Scene, instances};

/// Rounding of a hit's distance, relative to it and the scene's size.
const SAME: f64 = 1.0 / (1_u64 << 44) as f64;

/// Largest cosine between the normals of triangles that lie back to back.
const BACK_TO_BACK: f64 = -1.0 + 1e-9;

#[derive(Debug)]
pub(super) struct Hierarchy {
    pub(super) copied: Arc<Copied>,
    /// Objects that were moved since they were copied, ascending. Hits on their stale copies are skipped.
    pub(super) moved: Vec<usize>,
    /// Meshes that instances share.
    pub(super) meshes: Vec<Arc<SharedMesh>>,
    /// Ascending by object.
    pub(super) instances: Vec<Instance>,
    /// Over the instances' bounding boxes.
    pub(super) above: TriangleBvh,
    max_copied: usize,
    /// Frame of the single-precision coordinates on devices.
    pub(super) frame: Frame,
}

/// Triangles of all objects that are not instances, in scene coordinates.
#[derive(Debug)]
pub(super) struct Copied {
    objects: Vec<usize>,
    pub(super) bvh: TriangleBvh,
    /// Object and triangle within it, by the hierarchy's triangle index.
    pub(super) triangles: Vec<(u32, u32)>,
}

/// A mesh that instances share, with its hierarchy in object space.
#[derive(Debug)]
pub(super) struct SharedMesh {
    mesh: Arc<Mesh>,
    pub(super) bvh: TriangleBvh,
    /// Smoothing group of each triangle.
    pub(super) groups: Arc<Vec<u32>>,
}

/// An object whose triangles are not copied.
#[derive(Debug)]
pub(super) struct Instance {
    pub(super) object: u32,
    /// Index into [`Hierarchy::meshes`].
    pub(super) mesh: usize,
    pub(super) shared: Arc<SharedMesh>,
    pub(super) placement: Option<Placement>,
    object_from_world: DAffine3,
    pub(super) bounds: (DVec3, DVec3),
}

/// A triangle: its slot in the hierarchy of an instance's mesh, or in that of the copied triangles.
pub(super) type Found<'a> = (Option<&'a Instance>, u32);

impl Hierarchy {
    /// `max_copied`: see [`instances::MAX_COPIED`].
    pub(super) fn new(scene: &Scene, max_copied: usize) -> Self {
        let is_instance = instances::find(&scene.objects, max_copied);
        let copied = Arc::new(Copied::new(scene, &is_instance));
        let none = Self {
            frame: *copied.bvh.frame(),
            copied,
            moved: Vec::new(),
            meshes: Vec::new(),
            instances: Vec::new(),
            above: TriangleBvh::build(&[]),
            max_copied,
        };
        none.with_instances(scene, &is_instance)
    }

    /// Hierarchy of the edited scene. Rebuilds only what changed if every object is the same or can become an instance.
    pub(super) fn edited(&self, was: &Scene, is: &Scene) -> Self {
        let objects = || was.objects.iter().zip(&is.objects);
        let can_move = |(was, is): (&Object, &Object)| {
            was.stands_as(is) || (Arc::ptr_eq(was.mesh(), is.mesh()) && is.can_share())
        };
        if !objects().all(can_move) {
            return Self::new(is, self.max_copied);
        }
        let is_instance = objects()
            .enumerate()
            .map(|(object, (was, is))| self.shared(object).is_some() || !was.stands_as(is));
        let is_instance: Vec<bool> = is_instance.collect();
        self.with_instances(is, &is_instance)
    }

    /// Replaces the instances. A copied object that becomes an instance counts as moved.
    fn with_instances(&self, scene: &Scene, is_instance: &[bool]) -> Self {
        // Hierarchies of known meshes are kept. A new one is built once, for all instances of its mesh.
        let known = self.meshes.iter();
        let known: HashMap<_, _> = known.map(|shared| (Arc::as_ptr(&shared.mesh), shared)).collect();
        let (mut meshes, mut places) = (Vec::new(), HashMap::new());
        let mut instance = |object: usize| {
            let stands = &scene.objects[object];
            let mesh = stands.mesh();
            let place = *places.entry(Arc::as_ptr(mesh)).or_insert_with(|| {
                let known = known.get(&Arc::as_ptr(mesh)).map(|known| Arc::clone(known));
                meshes.push(known.unwrap_or_else(|| Arc::new(SharedMesh::new(mesh))));
                meshes.len() - 1
            });
            Instance {
                object: object as u32,
                mesh: place,
                shared: Arc::clone(&meshes[place]),
                placement: stands.placement().cloned(),
                object_from_world: stands.world_from_object().inverse(),
                bounds: stands.bounds().unwrap_or_default(),
            }
        };
        let objects = (0..is_instance.len()).filter(|&object| is_instance[object]);
        let instances: Vec<Instance> = objects.map(&mut instance).collect();

        // Copies of moved objects stay in the triangle hierarchy and are skipped: that is cheaper than to build it
        // anew.
        let copied = self.copied.objects.iter().copied();
        let moved = copied.filter(|&object| is_instance[object]).collect();

        // The frame encloses all objects, so that devices use one set of single-precision coordinates.
        let bounds = scene.objects.iter().filter_map(Object::bounds);
        let corners: Vec<DVec3> = bounds.flat_map(|(low, high)| [low, high]).collect();
        let frame = Frame::around(corners.iter());
        let boxes: Vec<(DVec3, DVec3)> = instances.iter().map(|instance| instance.bounds).collect();
        Self {
            copied: Arc::clone(&self.copied),
            moved,
            meshes,
            above: TriangleBvh::over_boxes(&boxes, frame),
            instances,
            max_copied: self.max_copied,
            frame,
        }
    }

    /// Whether an object was moved, so that its copied triangles are stale.
    pub(super) fn is_moved(&self, object: usize) -> bool {
        self.moved.binary_search(&object).is_ok()
    }

    /// Closest hit for which `is_there` holds; among hits at the same distance, that of the lowest object and triangle.
    /// Of two faces of an object that lie back to back, the one that faces the ray. Never the copied triangle in the
    /// slot that the ray `left`.
    #[inline]
    pub(super) fn closest(
        &self,
        ray: &Ray,
        left: u32,
        is_there: impl Fn(usize, usize, [f64; 3]) -> bool,
    ) -> Option<(RayHit, Found<'_>)> {
        // Hits within rounding of the nearest stay candidates, since faces back to back lie at the same distance.
        let sheared = ShearedRay::new(ray);
        let mut best: Option<(RayHit, Found)> = None;
        let mut limit_m = f64::INFINITY;
        self.search(ray, left, limit_m, |corners, found| {
            let hit = sheared.intersect(corners);
            let Some((distance_m, barycentric)) = hit.filter(|(distance_m, _)| *distance_m <= limit_m) else {
                return Some(f64::INFINITY);
            };

            // Ties go to the face that looks at the ray, or else to the lowest object and triangle, never to the order
            // of traversal.
            let (object, triangle) = self.triangle(found);
            let is_first = |(hit, known): &(RayHit, Found)| {
                let is_before =
                    || (distance_m, object, triangle) < (hit.distance_m, hit.object, hit.triangle);
                let is_near = (distance_m - hit.distance_m).abs() <= self.same_m(distance_m);
                let known = (is_near && hit.object == object).then(|| self.corners(*known));
                let facing = known.and_then(|known| which_faces(ray.direction, corners, &known));
                facing.unwrap_or_else(is_before)
            };

            // The alpha mask costs a look-up in a texture, and is tested only for a hit that would win.
            let is_nearer = best.as_ref().is_none_or(is_first);
            let is_there = || is_there(object as usize, triangle as usize, barycentric);
            if !is_nearer || self.is_stale((object, found)) || !is_there() {
                return Some(f64::INFINITY);
            }
            let hit = RayHit {
                object,
                triangle,
                barycentric,
                distance_m,
            };
            best = Some((hit, found));
            limit_m = distance_m + self.same_m(distance_m);
            Some(limit_m)
        });
        best
    }

    /// Bound on the rounding of a distance [m].
    fn same_m(&self, distance_m: f64) -> f64 {
        SAME * (distance_m + 1.0 / self.frame.scale)
    }

    /// Whether anything lies on a ray before `distance_m` (exclusive).
    pub(super) fn is_blocked(
        &self,
        ray: &Ray,
        distance_m: f64,
        is_there: impl Fn(usize, usize, [f64; 3]) -> bool,
    ) -> bool {
        let sheared = ShearedRay::new(ray);
        let mut is_blocked = false;
        self.search(ray, NO_SLOT, distance_m, |corners, found| {
            let hit = sheared.intersect(corners);
            is_blocked = hit.is_some_and(|(hit_m, barycentric)| {
                let (object, triangle) = self.triangle(found);
                hit_m < distance_m
                    && !self.is_stale((object, found))
                    && is_there(object as usize, triangle as usize, barycentric)
            });
            (!is_blocked).then_some(f64::INFINITY)
        });
        is_blocked
    }

    /// Calls `meet` for every triangle that a ray may hit before `end_m`, with its corners in the scene, as
    /// [`TriangleBvh::search`] does.
    #[inline(always)]
    fn search<'a>(
        &'a self,
        ray: &Ray,
        left: u32,
        mut end_m: f64,
        mut meet: impl FnMut(&[DVec3; 3], Found<'a>) -> Option<f64>,
    ) {
        let bvh = &self.copied.bvh;
        bvh.search_from(ray, left, end_m, |slot| {
            let met_m = meet(bvh.corners(slot), (None, slot));
            end_m = end_m.min(met_m.unwrap_or(0.0));
            met_m
        });
        if !self.instances.is_empty() && end_m > 0.0 {
            self.search_instances(ray, end_m, &mut meet);
        }
    }

    // Not inlined: scenes without instances stay fast.
    #[inline(never)]
    fn search_instances<'a>(
        &'a self,
        ray: &Ray,
        mut end_m: f64,
        meet: &mut dyn FnMut(&[DVec3; 3], Found<'a>) -> Option<f64>,
    ) {
        self.above.search(ray, end_m, |place| {
            let instance = &self.instances[self.above.triangle(place) as usize];
            instance.search(ray, end_m, |corners, slot| {
                let met_m = meet(corners, (Some(instance), slot));
                end_m = end_m.min(met_m.unwrap_or(0.0));
                met_m
            });
            (end_m > 0.0).then_some(end_m)
        });
    }

    /// Object and triangle within it.
    fn triangle(&self, (instance, slot): Found) -> (u32, u32) {
        let Copied { bvh, triangles, .. } = &*self.copied;
        match instance {
            Some(instance) => (instance.object, instance.shared.bvh.triangle(slot)),
            None => triangles[bvh.triangle(slot) as usize],
        }
    }

    /// Whether a triangle belongs to the stale copy of a moved object.
    fn is_stale(&self, (object, (instance, _)): (u32, Found)) -> bool {
        instance.is_none() && self.is_moved(object as usize)
    }

    /// Corners in the scene [m].
    pub(super) fn corners(&self, (instance, slot): Found) -> [DVec3; 3] {
        match instance {
            Some(instance) => instance.placed(instance.shared.bvh.corners(slot)),
            None => *self.copied.bvh.corners(slot),
        }
    }

    /// Data that all instances of an object's mesh share; `None` where the object is not an instance.
    pub(super) fn shared(&self, object: usize) -> Option<&SharedMesh> {
        let found = self
            .instances
            .binary_search_by_key(&object, |instance| instance.object as usize);
        Some(&self.instances[found.ok()?].shared)
    }

    /// Root nodes that together hold all triangles.
    pub(super) fn roots(&self) -> Vec<SceneNode<'_>> {
        let roots = self.instances.iter().map(Some);
        let roots = std::iter::once(None).chain(roots).filter_map(|instance| {
            let bvh = instance.map_or(&self.copied.bvh, |instance| &instance.shared.bvh);
            Some(SceneNode {
                hierarchy: self,
                instance,
                node: bvh.root()?,
            })
        });
        roots.collect()
    }
}

/// Whether the first of two triangles that lie back to back faces a ray; `None` where they do not.
fn which_faces(direction: DVec3, first: &[DVec3; 3], second: &[DVec3; 3]) -> Option<bool> {
    let [first, second] = [first, second].map(|[a, b, c]| (*b - *a).cross(*c - *a).normalize_or_zero());
    (first.dot(second) < BACK_TO_BACK).then(|| first.dot(direction) < 0.0)
}

impl Copied {
    fn new(scene: &Scene, is_instance: &[bool]) -> Self {
        let objects = (0..scene.objects.len()).filter(|&object| !is_instance[object]);
        let objects: Vec<usize> = objects.collect();
        let mut corners = Vec::new();
        let mut triangles = Vec::new();
        for &object in &objects {
            let mesh = scene.objects[object].mesh_in_scene();
            for triangle in 0..mesh.triangles.len() {
                corners.push(mesh.corners(triangle));
                triangles.push((object as u32, triangle as u32));
            }
        }
        Self {
            objects,
            bvh: TriangleBvh::build(&corners),
            triangles,
        }
    }
}

impl SharedMesh {
    fn new(mesh: &Arc<Mesh>) -> Self {
        let corners: Vec<[DVec3; 3]> = (0..mesh.triangles.len())
            .map(|triangle| mesh.corners(triangle))
            .collect();
        Self {
            bvh: TriangleBvh::build(&corners),
            // Placing normalises the normals, which may have any length in a file.
            groups: Arc::new(smoothing_groups(&mesh.placed(&DAffine3::IDENTITY))),
            mesh: Arc::clone(mesh),
        }
    }
}

impl Instance {
    /// Calls `meet` for every triangle that a ray may hit before `end_m`, with its corners in the scene, as
    /// [`TriangleBvh::search`] does.
    #[inline]
    fn search(&self, ray: &Ray, end_m: f64, mut meet: impl FnMut(&[DVec3; 3], u32) -> Option<f64>) {
        let (low, high) = self.bounds;
        let towards_m = (low * 0.5 + high * 0.5 - ray.origin).dot(ray.direction);
        let advanced_m = (towards_m - FAR_RADII * 0.5 * (high - low).length()).max(0.0);
        let direction = self.object_from_world.transform_vector3(ray.direction);
        let scale = direction.length();
        let local = Ray {
            origin: self.object_from_world.transform_point3(ray.at(advanced_m)),
            direction: direction / scale,
        };
        let local_m = |distance_m: f64| ((distance_m - advanced_m) * scale).max(0.0);
        let bvh = &self.shared.bvh;
        bvh.search(&local, local_m(end_m), |slot| {
            meet(&self.placed(bvh.corners(slot)), slot).map(local_m)
        });
    }

    pub(super) fn placed(&self, corners: &[DVec3; 3]) -> [DVec3; 3] {
        match &self.placement {
            Some(placement) => placement.corners(corners),
            None => *corners,
        }
    }
}

/// A node of one of the scene's hierarchies, for traversals other than along rays.
#[derive(Clone, Copy, Debug)]
pub struct SceneNode<'a> {
    hierarchy: &'a Hierarchy,
    instance: Option<&'a Instance>,
    node: bvh::Node<'a>,
}

impl<'a> SceneNode<'a> {
    /// Conservative bounding box of the node's triangles: minimum and maximum corner [m].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let (low, high) = self.node.bounds();
        let Some(placement) = self.instance.and_then(|instance| instance.placement.as_ref()) else {
            return (low, high);
        };
        let transform = placement.world_from_object();
        let centre = transform.transform_point3(low * 0.5 + high * 0.5);
        let half = (high - low) * 0.5;
        let linear = transform.matrix3;
        let reach =
            linear.x_axis.abs() * half.x + linear.y_axis.abs() * half.y + linear.z_axis.abs() * half.z;
        (centre - reach, centre + reach)
    }

    /// Child nodes; `None` for a leaf.
    pub fn children(&self) -> Option<[Self; 2]> {
        Some(self.node.children()?.map(|node| Self { node, ..*self }))
    }

    /// Whether the box may hold the stale copy of a moved object.
    pub fn may_be_stale(&self) -> bool {
        self.instance.is_none() && !self.hierarchy.moved.is_empty()
    }

    /// Object and corners of each triangle of a leaf; empty for inner nodes.
    pub fn triangles(&self) -> impl Iterator<Item = (usize, [DVec3; 3])> + use<'a> {
        let (hierarchy, instance) = (self.hierarchy, self.instance);
        self.node.slots().filter_map(move |slot| {
            let found = (instance, slot);
            let (object, _) = hierarchy.triangle(found);
            (!hierarchy.is_stale((object, found))).then(|| (object as usize, hierarchy.corners(found)))
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DMat3, DVec3};

    use super::Hierarchy;
    use crate::geometry::Ray;
    use crate::geometry::bvh::NO_SLOT;
    use crate::geometry::sampling::even_point;
    use crate::scene::builtin::shapes;
    use crate::scene::{Edit, Material, Motion, Object, Scene, SurfaceKind};
    use crate::transport::{SurfaceHit, Tracer};

    /// Reproducible vector in the box from −1 to 1.
    fn vector(index: usize, seed: u64) -> DVec3 {
        let [a, b] = [0, 1].map(|pair| even_point(index as u32, pair, seed));
        DVec3::new(a.x, a.y, b.x) * 2.0 - 1.0
    }

    /// Instances of one sphere, rotated, stretched and mirrored, two of them at the same place, over a floor.
    fn balls() -> Scene {
        let mesh = Arc::new(shapes::sphere(DVec3::new(0.3, -0.2, 0.1), 1.0, 2));
        let ball = |node: usize| {
            let mut ball = Object::new(format!("ball{node}"), (node, 0), 0, Arc::clone(&mesh));
            let sign = if node.is_multiple_of(3) { -1.0 } else { 1.0 };
            let [x, y, z] = [2, 3, 4].map(|seed| vector(node, seed) * 0.1);
            match node {
                0 => {}
                1 | 2 => ball.place(DAffine3::from_translation(DVec3::new(2.0, 0.1, 0.7))),
                _ => ball.place(DAffine3 {
                    matrix3: DMat3::from_diagonal(DVec3::new(0.4 * sign, 0.5, 0.3))
                        + DMat3::from_cols(x, y, z),
                    translation: vector(node, 5) * DVec3::new(4.0, 1.0, 4.0),
                }),
            }
            ball
        };
        let mut objects: Vec<Object> = (0..24).map(ball).collect();
        let floor = shapes::floor([-6.0, 6.0], [-6.0, 6.0], -2.0);
        objects.insert(5, Object::new("floor", (24, 0), 1, floor));
        let glass = Material {
            surface: SurfaceKind::Dielectric,
            ..Material::default()
        };
        Scene {
            objects,
            materials: vec![glass, Material::default()],
            ..Scene::default()
        }
    }

    /// Rays between arbitrary points, and to vertices and edge midpoints.
    fn rays(scene: &Scene) -> impl Iterator<Item = Ray> {
        (0..20_000).map(|index: usize| {
            let origin = vector(index, 6) * if index.is_multiple_of(7) { 1e4 } else { 5.0 };
            let mesh = scene.objects[index % scene.objects.len()].copy_in_scene();
            let [a, b, _] = mesh.corners(index % mesh.triangles.len());
            let target = match index % 3 {
                0 => a,
                1 => a * 0.5 + b * 0.5,
                _ => vector(index, 7) * DVec3::new(5.0, 2.0, 5.0),
            };
            let direction = (target - origin).normalize();
            Ray { origin, direction }
        })
    }

    /// Panics unless both tracers agree to the last bit.
    fn compare(copied: &Tracer, shared: &Tracer) {
        let mut hits = 0;
        for ray in rays(copied.scene()) {
            // Only copies have slots.
            let without_slot = |hit| SurfaceHit { slot: NO_SLOT, ..hit };
            let [was, is] = [copied, shared].map(|tracer| tracer.closest_hit(&ray).map(without_slot));
            assert_eq!(format!("{was:?}"), format!("{is:?}"), "{ray:?}");
            let distance_m = was.map_or(7.0, |hit| hit.distance_m);
            for distance_m in [distance_m, distance_m.next_up(), 2.0 * distance_m] {
                let [was, is] = [copied, shared].map(|tracer| tracer.is_blocked(&ray, distance_m));
                assert_eq!(was, is, "{ray:?}");
            }
            let Some(hit) = was else { continue };
            hits += 1;
            let (object, triangle) = (hit.object, hit.triangle);
            let group = |tracer: &Tracer| tracer.smoothing_group(object, triangle);
            assert_eq!(group(copied), group(shared));
        }
        assert!(hits > 10_000, "{hits}");
    }

    /// Whatever leaves a triangle meets the same with and without testing that one again.
    #[test]
    fn a_triangle_that_is_left_is_not_met_again() {
        let tracer = Tracer::sharing(Arc::new(balls()), usize::MAX);
        let mut hits = 0;
        for (index, ray) in rays(tracer.scene()).enumerate() {
            let Some(hit) = tracer.closest_hit(&ray) else {
                continue;
            };
            hits += 1;
            // Some along the triangle, where rounding would be seen first.
            let direction = vector(index, 8);
            let along = direction.reject_from_normalized(hit.geometric_normal);
            for direction in [direction, along] {
                let left = hit.spawn(direction.normalize());
                let [with, without] = [NO_SLOT, hit.slot].map(|slot| tracer.next_hit(&left, slot));
                assert_eq!(format!("{with:?}"), format!("{without:?}"), "{left:?}");
            }
        }
        assert!(hits > 10_000, "{hits}");
    }

    #[test]
    fn instances_are_met_as_copies_are() {
        let scene = Arc::new(balls());
        let copied = Tracer::sharing(Arc::clone(&scene), usize::MAX);
        // A scene of its own, so that it does not reuse cached copies of the first one.
        let shared = Tracer::sharing(Arc::new(balls()), 0);
        compare(&copied, &shared);
        let edit = Edit::Place(7, Motion::turned(0.4, DVec3::new(0.3, 0.2, -0.1)));
        let moved = Arc::new(edit.apply(shared.scene()).expect("it can be moved"));
        let fresh = Tracer::sharing(Arc::clone(&moved), usize::MAX);
        compare(&fresh, &copied.edited(Arc::clone(&moved)));
        compare(&fresh, &shared.edited(moved));
    }

    /// Dragging builds no triangle hierarchy, except for the mesh of a copied object when it first moves.
    #[test]
    fn a_drag_builds_no_hierarchy_of_triangles() {
        let mut scene = balls();
        for (max_copied, instances) in [(0, [24, 24, 25, 25, 25]), (usize::MAX, [1, 1, 2, 2, 3])] {
            let mut before = Hierarchy::new(&scene, max_copied);
            for (object, instances) in [9, 9, 5, 5, 7].into_iter().zip(instances) {
                let was = scene.clone();
                let place = DAffine3::from_translation(DVec3::Y) * *was.objects[object].world_from_object();
                scene.objects[object].place(place);
                let after = before.edited(&was, &scene);
                assert!(Arc::ptr_eq(&before.copied, &after.copied));
                let mut was = before.meshes.iter();
                assert!(was.all(|was| after.meshes.iter().any(|is| Arc::ptr_eq(was, is))));
                assert!(after.meshes.len() <= 2);
                assert_eq!(after.instances.len(), instances);
                before = after;
            }
        }
    }

    #[test]
    fn nodes_hold_all_triangles() {
        let scene = balls();
        let found = |hierarchy: &Hierarchy| {
            let mut found = Vec::new();
            let mut waiting = hierarchy.roots();
            while let Some(node) = waiting.pop() {
                let (low, high) = node.bounds();
                for (object, corners) in node.triangles() {
                    let is_within = |corner: &DVec3| corner.cmpge(low).all() && corner.cmple(high).all();
                    assert!(corners.iter().all(is_within));
                    found.push((object, corners.map(|corner| corner.to_array().map(f64::to_bits))));
                }
                waiting.extend(node.children().into_iter().flatten());
            }
            found.sort_unstable();
            found
        };
        let [copied, shared] = [usize::MAX, 0].map(|most| Hierarchy::new(&scene, most));
        let all = found(&copied);
        assert_eq!(all.len(), scene.triangle_count());
        assert_eq!(all, found(&shared));
        let mut moved = scene.clone();
        moved.objects[5].place(DAffine3::from_translation(DVec3::Y));
        let again = found(&Hierarchy::new(&moved, usize::MAX));
        assert_ne!(all, again);
        for hierarchy in [copied, shared] {
            assert_eq!(again, found(&hierarchy.edited(&scene, &moved)));
        }
    }
}
