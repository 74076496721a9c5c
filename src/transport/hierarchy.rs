//! What finds the triangles of a scene: one hierarchy over those of most objects, and for each mesh with many instances one
//! in its own coordinates, below a hierarchy over these objects.
//!
//! An instance's triangles are found by the mesh's hierarchy and met as placed in the scene, so that every hit is the one
//! that a copy of the mesh would give, to the last bit.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::curvature::TrianglesAround;
use super::smoothing::smoothing_groups;
use super::tracer::HitPlace;
use crate::geometry::triangle::ShearedRay;
use crate::geometry::{BoxBvh, PackedBvh, Ray, TriangleBvh, bvh};
use crate::scene::mesh::Placement;
use crate::scene::{Mesh, Object, Scene, instances};

/// Rays that start farther from an instance than this many of its radii are advanced before they are brought into its
/// coordinates.
const FAR_RADII: f64 = 4.0;

/// The hierarchies of a scene.
#[derive(Debug)]
pub(super) struct Hierarchy {
    copied: Arc<Copied>,
    instances: Vec<Instance>,
    /// Over the instances' boxes.
    above: BoxBvh,
    most_copied: usize,
}

/// All objects but instances.
#[derive(Debug)]
struct Copied {
    objects: Vec<usize>,
    bvh: TriangleBvh,
    /// Object and triangle within it, by the hierarchy's triangle index.
    triangles: Vec<(u32, u32)>,
}

/// A mesh of many instances.
#[derive(Debug)]
pub(super) struct SharedMesh {
    mesh: Arc<Mesh>,
    bvh: TriangleBvh,
    pub(super) around: Arc<TrianglesAround>,
    /// Smoothing group of each triangle.
    pub(super) groups: Arc<Vec<u32>>,
}

/// An object whose mesh is not copied.
#[derive(Debug)]
struct Instance {
    object: u32,
    shared: Arc<SharedMesh>,
    placement: Option<Placement>,
    object_from_world: DAffine3,
    bounds: (DVec3, DVec3),
}

/// What a ray met, and the corners of that triangle in the scene [m].
pub(super) type Met = (HitPlace, [DVec3; 3]);

impl Hierarchy {
    /// Of a scene; `before`: of the same objects at other places. `most_copied`: see [`instances::MOST_COPIED`].
    pub(super) fn new(scene: &Scene, most_copied: usize, before: Option<(&Self, &Scene)>) -> Self {
        let is_instance = instances::find(&scene.objects, most_copied);
        let objects = 0..scene.objects.len();
        let copied: Vec<usize> = objects.clone().filter(|&object| !is_instance[object]).collect();
        let stands = |was: &Scene, object: &usize| scene.objects[*object].stands_as(&was.objects[*object]);
        let known = before.filter(|(known, was)| {
            known.copied.objects == copied && copied.iter().all(|object| stands(was, object))
        });
        let copied = match known {
            Some((known, _)) => Arc::clone(&known.copied),
            None => Arc::new(Copied::new(scene, copied)),
        };
        let mut meshes: HashMap<*const Mesh, Arc<SharedMesh>> = HashMap::new();
        for instance in before.iter().flat_map(|(known, _)| &known.instances) {
            meshes.insert(Arc::as_ptr(&instance.shared.mesh), Arc::clone(&instance.shared));
        }
        let instance = |object: usize| {
            let mesh = scene.objects[object].mesh();
            let shared = meshes.entry(Arc::as_ptr(mesh));
            let shared = shared.or_insert_with(|| Arc::new(SharedMesh::new(mesh)));
            Instance::new(object, &scene.objects[object], Arc::clone(shared))
        };
        let instances: Vec<Instance> = objects
            .filter(|&object| is_instance[object])
            .map(instance)
            .collect();
        let boxes = instances.iter().map(|instance| instance.bounds.into());
        let boxes: Vec<[DVec3; 2]> = boxes.collect();
        Self {
            copied,
            instances,
            above: BoxBvh::build(&boxes),
            most_copied,
        }
    }

    /// Of the same objects, edited.
    pub(super) fn edited(&self, was: &Scene, is: &Scene) -> Self {
        Self::new(is, self.most_copied, Some((self, was)))
    }

    /// The nearest place in front of a ray's origin where something is there; of places at the same distance, that of the
    /// first object and triangle.
    #[inline]
    pub(super) fn closest(
        &self,
        ray: &Ray,
        is_there: impl Fn(usize, usize, [f64; 3]) -> bool,
    ) -> Option<Met> {
        let Copied { bvh, triangles, .. } = &*self.copied;
        let hit = bvh.closest_hit_where(ray, |triangle, barycentric| {
            let (object, triangle) = triangles[triangle as usize];
            is_there(object as usize, triangle as usize, barycentric)
        });
        let met = hit.map(|hit| {
            let (object, triangle) = triangles[hit.triangle as usize];
            let place = HitPlace {
                object,
                triangle,
                barycentric: hit.barycentric,
                distance_m: hit.distance_m,
            };
            // They lie where the search just was, those of the mesh do not.
            (place, *bvh.corners(hit.slot))
        });
        if self.instances.is_empty() {
            return met;
        }
        self.closest_instance(ray, met, is_there)
    }

    fn closest_instance(
        &self,
        ray: &Ray,
        mut best: Option<Met>,
        is_there: impl Fn(usize, usize, [f64; 3]) -> bool,
    ) -> Option<Met> {
        let sheared = ShearedRay::new(ray);
        let end_m = |best: &Option<Met>| best.map_or(f64::INFINITY, |(hit, _)| hit.distance_m);
        self.above.search(ray, end_m(&best), |index| {
            let instance = &self.instances[index as usize];
            instance.search(ray, end_m(&best), |triangle, corners| {
                if let Some((distance_m, barycentric)) = sheared.intersect(&corners) {
                    let (object, first) = (instance.object, (distance_m, instance.object, triangle));
                    let is_nearer =
                        best.is_none_or(|(hit, _)| first < (hit.distance_m, hit.object, hit.triangle));
                    if is_nearer && is_there(object as usize, triangle as usize, barycentric) {
                        let place = HitPlace {
                            object,
                            triangle,
                            barycentric,
                            distance_m,
                        };
                        best = Some((place, corners));
                    }
                }
                Some(end_m(&best))
            });
            Some(end_m(&best))
        });
        best
    }

    /// Whether anything lies on a ray before `distance_m` (exclusive).
    pub(super) fn is_blocked(
        &self,
        ray: &Ray,
        distance_m: f64,
        is_there: impl Fn(usize, usize, [f64; 3]) -> bool,
    ) -> bool {
        let Copied { bvh, triangles, .. } = &*self.copied;
        let by_copied = bvh.is_blocked_where(ray, distance_m, |triangle, barycentric| {
            let (object, triangle) = triangles[triangle as usize];
            is_there(object as usize, triangle as usize, barycentric)
        });
        if by_copied || self.instances.is_empty() {
            return by_copied;
        }
        let sheared = ShearedRay::new(ray);
        let mut is_blocked = false;
        self.above.search(ray, distance_m, |index| {
            let instance = &self.instances[index as usize];
            instance.search(ray, distance_m, |triangle, corners| {
                is_blocked = sheared.intersect(&corners).is_some_and(|(hit_m, barycentric)| {
                    hit_m < distance_m && is_there(instance.object as usize, triangle as usize, barycentric)
                });
                (!is_blocked).then_some(distance_m)
            });
            (!is_blocked).then_some(distance_m)
        });
        is_blocked
    }

    /// What all instances of an object's mesh share; `None` where the object is none.
    pub(super) fn shared(&self, object: usize) -> Option<&SharedMesh> {
        let found = self
            .instances
            .binary_search_by_key(&object, |instance| instance.object as usize);
        Some(&self.instances[found.ok()?].shared)
    }

    /// The nodes around all triangles.
    pub(super) fn roots(&self) -> Vec<SceneNode<'_>> {
        let copied = self.copied.bvh.root().map(|node| SceneNode {
            node,
            owner: Owner::Copied(&self.copied.triangles),
        });
        let instances = self.instances.iter().filter_map(|instance| {
            Some(SceneNode {
                node: instance.shared.bvh.root()?,
                owner: Owner::Instance(instance),
            })
        });
        copied.into_iter().chain(instances).collect()
    }

    /// One hierarchy over all triangles, as devices have it; they are counted object by object.
    pub(super) fn packed(&self, scene: &Scene) -> PackedBvh {
        if self.instances.is_empty() {
            return self.copied.bvh.packed();
        }
        let corners = scene.objects.iter().flat_map(|object| {
            let mesh = object.in_scene();
            (0..mesh.triangle_count()).map(move |triangle| mesh.corners(triangle))
        });
        PackedBvh::build(&corners.collect::<Vec<_>>())
    }
}

impl Copied {
    fn new(scene: &Scene, objects: Vec<usize>) -> Self {
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
            around: Arc::new(TrianglesAround::of(mesh)),
            // Normals have any length in a file; these are unit.
            groups: Arc::new(smoothing_groups(&mesh.placed(&DAffine3::IDENTITY))),
            mesh: Arc::clone(mesh),
        }
    }
}

impl Instance {
    fn new(object: usize, stands: &Object, shared: Arc<SharedMesh>) -> Self {
        Self {
            object: object as u32,
            shared,
            placement: stands.placement().cloned(),
            object_from_world: stands.world_from_object().inverse(),
            bounds: stands.bounds().unwrap_or_default(),
        }
    }

    /// Hands out all triangles that a ray may meet before `end_m`, with their corners in the scene, as
    /// [`TriangleBvh::search`] does.
    #[inline]
    fn search(&self, ray: &Ray, end_m: f64, mut meet: impl FnMut(u32, [DVec3; 3]) -> Option<f64>) {
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
            meet(bvh.triangle(slot), self.placed(bvh.corners(slot))).map(local_m)
        });
    }

    fn placed(&self, corners: &[DVec3; 3]) -> [DVec3; 3] {
        match &self.placement {
            Some(placement) => placement.corners(corners),
            None => *corners,
        }
    }
}

/// A node of a hierarchy of the scene, for searches other than along rays.
#[derive(Clone, Copy, Debug)]
pub struct SceneNode<'a> {
    node: bvh::Node<'a>,
    owner: Owner<'a>,
}

/// Whose triangles they are.
#[derive(Clone, Copy, Debug)]
enum Owner<'a> {
    Copied(&'a [(u32, u32)]),
    Instance(&'a Instance),
}

impl<'a> SceneNode<'a> {
    /// A box around all triangles of the node, a little too large, as minimum and maximum corner [m].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let (low, high) = self.node.bounds();
        let Owner::Instance(Instance {
            placement: Some(placement),
            ..
        }) = self.owner
        else {
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

    /// The two nodes that share out its triangles; `None` for a leaf.
    pub fn children(&self) -> Option<[Self; 2]> {
        let owner = self.owner;
        Some(self.node.children()?.map(|node| Self { node, owner }))
    }

    /// Object and corners of each triangle of a leaf; nothing for other nodes.
    pub fn triangles(&self) -> impl Iterator<Item = (usize, [DVec3; 3])> + use<'a> {
        let owner = self.owner;
        self.node.triangles().map(move |(triangle, corners)| match owner {
            Owner::Copied(triangles) => (triangles[triangle as usize].0 as usize, *corners),
            Owner::Instance(instance) => (instance.object as usize, instance.placed(corners)),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DMat3, DVec3};

    use super::Hierarchy;
    use crate::geometry::Ray;
    use crate::scene::builtin::shapes;
    use crate::scene::{Edit, Material, Motion, Object, Scene, SurfaceKind};
    use crate::transport::Tracer;

    /// Even numbers of [0, 1), the same ones every time.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        }

        /// Of the box from −1 to 1.
        fn vector(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
        }
    }

    /// Balls of one mesh, turned, stretched, mirrored, and two at the very same place, over a floor.
    fn balls() -> Scene {
        let mut numbers = Numbers(1);
        let mesh = Arc::new(shapes::sphere(DVec3::new(0.3, -0.2, 0.1), 1.0, 2));
        let mut objects = Vec::new();
        for node in 0..24 {
            let mut ball = Object::new(format!("ball{node}"), (node, 0), 0, Arc::clone(&mesh));
            let sign = if node % 3 == 0 { -1.0 } else { 1.0 };
            let linear = DMat3::from_diagonal(DVec3::new(0.4 * sign, 0.5, 0.3))
                + DMat3::from_cols(numbers.vector(), numbers.vector(), numbers.vector()) * 0.1;
            match node {
                0 => {}
                1 | 2 => ball.place(DAffine3::from_translation(DVec3::new(2.0, 0.1, 0.7))),
                _ => ball.place(DAffine3 {
                    matrix3: linear,
                    translation: numbers.vector() * DVec3::new(4.0, 1.0, 4.0),
                }),
            }
            objects.push(ball);
        }
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

    /// Rays from anywhere to anywhere, and to vertices and middles of edges.
    fn rays(scene: &Scene) -> Vec<Ray> {
        let mut numbers = Numbers(2);
        let ray = |index: usize| {
            let origin = numbers.vector() * if index.is_multiple_of(7) { 1e4 } else { 5.0 };
            let mesh = scene.objects[index % scene.objects.len()].copy_in_scene();
            let [a, b, _] = mesh.corners((numbers.next() * mesh.triangles.len() as f64) as usize);
            let target = match index % 3 {
                0 => a,
                1 => a * 0.5 + b * 0.5,
                _ => numbers.vector() * DVec3::new(5.0, 2.0, 5.0),
            };
            let direction = (target - origin).normalize();
            Ray { origin, direction }
        };
        (0..20_000).map(ray).collect()
    }

    /// Fails unless both find the same, to the last bit.
    fn compare(copied: &Tracer, shared: &Tracer) {
        let mut hits = 0;
        for ray in rays(copied.scene()) {
            let [was, is] = [copied, shared].map(|tracer| tracer.closest_hit(&ray));
            assert_eq!(format!("{was:?}"), format!("{is:?}"), "{ray:?}");
            let distance_m = was.map_or(7.0, |hit| hit.distance_m);
            for distance_m in [distance_m, distance_m.next_up(), 2.0 * distance_m] {
                let [was, is] = [copied, shared].map(|tracer| tracer.is_blocked(&ray, distance_m));
                assert_eq!(was, is, "{ray:?}");
            }
            let Some(hit) = was else { continue };
            hits += 1;
            let (object, triangle) = (hit.object, hit.triangle);
            let turn = |tracer: &Tracer| {
                let mesh = tracer.scene().objects[object].in_scene();
                let field = tracer.normal_field(object)?;
                Some(field.turn(mesh, triangle, hit.barycentric, ray.direction))
            };
            assert_eq!(turn(copied), turn(shared));
            let group = |tracer: &Tracer| tracer.smoothing_group(object, triangle);
            assert_eq!(group(copied), group(shared));
        }
        assert!(hits > 10_000, "{hits}");
    }

    fn hierarchy(scene: &Scene) -> Hierarchy {
        Hierarchy::new(scene, 0, None)
    }

    #[test]
    fn instances_are_met_as_copies_are() {
        let scene = Arc::new(balls());
        let copied = Tracer::sharing(Arc::clone(&scene), usize::MAX);
        // Not by the copies that the other one made.
        let shared = Tracer::sharing(Arc::new(balls()), 0);
        compare(&copied, &shared);
        let edit = Edit::Place(7, Motion::turned(0.4, DVec3::new(0.3, 0.2, -0.1)));
        let moved = Arc::new(edit.apply(shared.scene()).expect("it can be moved"));
        compare(&copied.edited(Arc::clone(&moved)), &shared.edited(moved));
    }

    #[test]
    fn moving_an_instance_builds_nothing_of_the_others() {
        let scene = balls();
        let before = hierarchy(&scene);
        assert_eq!(before.instances.len(), 24);
        let mut moved = scene.clone();
        moved.objects[9].place(DAffine3::from_translation(DVec3::Y));
        let after = before.edited(&scene, &moved);
        assert!(Arc::ptr_eq(&before.copied, &after.copied));
        let meshes = [&before, &after].map(|hierarchy| &hierarchy.instances[0].shared);
        assert!(Arc::ptr_eq(meshes[0], meshes[1]));
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
        let all = found(&Hierarchy::new(&scene, usize::MAX, None));
        assert_eq!(all.len(), scene.triangle_count());
        assert_eq!(all, found(&hierarchy(&scene)));
        let [a, b] = [usize::MAX, 0].map(|most| Hierarchy::new(&scene, most, None).packed(&scene));
        assert_eq!(a.triangles.len(), b.triangles.len());
    }
}
