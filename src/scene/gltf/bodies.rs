//! Bodies of glass: which objects bound one, alone or with others, and which are open. Files split a body wherever the
//! material changes, and some are wound inwards.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use glam::DVec3;

use super::context::LoadContext;
use crate::geometry::sampling::even_point;
use crate::geometry::triangle::ShearedRay;
use crate::geometry::{Ray, TriangleBvh};
use crate::scene::watertight::{has_extent, is_closed, volume_m3};
use crate::scene::{Material, Mesh, Object};

/// Distance of vertices that are one, in their coordinates [1]: a few roundings to single precision.
const WELD: f64 = 1.0 / (1 << 20) as f64;

/// Samples of an open sheet, and rays below each, that tell whether something holds what is below it.
const SAMPLES: u32 = 16;

/// Smallest vertical component of the mean normal of a level sheet.
const LEVEL: f64 = 0.7;

/// Highest index of water and other liquids that stand in the open; window glass has a higher one.
const MOST_LIQUID_IOR: f64 = 1.4;

/// Turns meshes that are wound inwards, and gives each object of a body that several bound its [`Object::body`].
/// Returns whether each object bounds a body. `materials`: those of the file.
pub fn find(objects: &mut [Object], materials: &[Material], load: &mut LoadContext) -> Vec<bool> {
    let material = |object: &Object| &materials[object.material];
    let mut closed = HashMap::new();
    let mut closes = |object: &Object| {
        let mesh = object.mesh();
        *closed.entry(Arc::as_ptr(mesh)).or_insert_with(|| is_closed(mesh))
    };
    let mut turned = Turned::default();
    let mut bounds_body = vec![false; objects.len()];
    let mut open = Vec::new();
    for index in 0..objects.len() {
        let object = &objects[index];
        if !material(object).transmits() {
            if !material(object).double_sided && is_against_normals(object.mesh()) {
                turned.turn(&mut objects[index]);
                let what = "was wound against its normals; its front is now where these point";
                load.warn(
                    node(&objects[index]),
                    what,
                    "turn its faces, or recompute its normals",
                );
            }
            continue;
        }
        if !closes(object) {
            open.push(index);
            continue;
        }
        let volume_m3 = volume_m3(object.in_scene());
        bounds_body[index] = has_extent(object.in_scene(), volume_m3);
        if bounds_body[index] && volume_m3 < 0.0 {
            turned.turn(&mut objects[index]);
            warn_of_turn(&objects[index], load);
        }
    }
    if open.is_empty() {
        return bounds_body;
    }
    let is_near = |object: &Object| {
        let overlaps =
            |(a, b): (DVec3, DVec3), (low, high): (DVec3, DVec3)| a.cmple(high).all() && b.cmpge(low).all();
        let own = object.bounds();
        open.iter().any(|&open| {
            own.zip(objects[open].bounds())
                .is_some_and(|(a, b)| overlaps(a, b))
        })
    };
    let opaque = |index: &usize| {
        let object = &objects[*index];
        !material(object).transmits() && is_near(object) && !closes(object)
    };
    let opaque: Vec<usize> = (0..objects.len()).filter(opaque).collect();
    let pieces = Pieces::new(objects, &open, &opaque);
    for body in pieces.bodies(objects, materials) {
        let states_volume = |index: &&usize| material(&objects[**index]).volume.is_some();
        let glass = || body.signs.keys().filter(|index| open.contains(index));
        let first = glass().find(states_volume).or(glass().next()).copied();
        let is_shared = glass().count() > 1;
        let members: Vec<usize> = glass().copied().collect();
        for index in members {
            bounds_body[index] = true;
            objects[index].body = first.filter(|_| is_shared);
            if body.signs[&index] < 0 {
                turned.turn(&mut objects[index]);
                warn_of_turn(&objects[index], load);
            }
        }
    }
    let mut held = Held::default();
    for index in open {
        let object = &objects[index];
        let own = material(object);
        if bounds_body[index] || own.volume.is_none() || own.is_solid_by_shape {
            continue;
        }
        bounds_body[index] = own.waves.is_some() || held.is_water(index, objects, materials);
        if !bounds_body[index] {
            load.warn(
                node(object),
                "states a volume but bounds none, since its mesh is open; it was read as a thin pane",
                "close its mesh, or let what holds the liquid surround it on all sides",
            );
        }
    }
    bounds_body
}

fn node(object: &Object) -> String {
    format!("node `{}`", object.name)
}

fn warn_of_turn(object: &Object, load: &mut LoadContext) {
    let what = "was inside out: its faces were turned outwards";
    load.warn(node(object), what, "turn its faces in the program that wrote it");
}

/// Sum over triangles of the winding's normal times those of the vertices, by area, and of their absolute values.
fn agreement(mesh: &Mesh) -> (f64, f64) {
    (0..mesh.triangles.len()).fold((0.0, 0.0), |(sum, all), triangle| {
        let [a, b, c] = mesh.corners(triangle);
        let normals = mesh
            .corner_normals(triangle)
            .map(|normal| normal.normalize_or_zero());
        let agreed = (b - a).cross(c - a).dot(normals.iter().sum());
        (sum + agreed, all + agreed.abs())
    })
}

fn is_against_normals(mesh: &Mesh) -> bool {
    let (sum, all) = agreement(mesh);
    all > 0.0 && sum == -all
}

/// Turned copies of meshes, shared as the meshes were.
#[derive(Default)]
struct Turned {
    known: HashMap<*const Mesh, (Arc<Mesh>, Arc<Mesh>)>,
}

impl Turned {
    fn turn(&mut self, object: &mut Object) {
        let mesh = Arc::clone(object.mesh());
        // The mesh is kept, so that its address stays its own.
        let (_, turned) = self.known.entry(Arc::as_ptr(&mesh)).or_insert_with(|| {
            let mut turned = Mesh::clone(&mesh);
            let points_along = agreement(&mesh).0 > 0.0;
            turned
                .triangles
                .iter_mut()
                .for_each(|[_, b, c]| std::mem::swap(b, c));
            if points_along {
                turned.normals.iter_mut().for_each(|normal| *normal = -*normal);
            }
            (mesh, Arc::new(turned))
        });
        object.reshape(Arc::clone(turned));
    }
}

/// Net traversals of each edge, from its lower to its higher vertex; edges traversed both ways are left out.
type Border = BTreeMap<(u32, u32), i32>;

/// Open meshes with their borders, in common vertices.
struct Pieces {
    /// By object.
    borders: BTreeMap<usize, Border>,
    glass: Vec<usize>,
}

/// A closed surface of several objects: for each, 1, or −1 where its mesh has to be turned.
struct Body {
    signs: BTreeMap<usize, i32>,
}

impl Pieces {
    fn new(objects: &[Object], glass: &[usize], opaque: &[usize]) -> Self {
        let mut weld = Weld::default();
        let mut border = |&object: &usize| {
            let mesh = objects[object].in_scene();
            let ids: Vec<u32> = mesh.positions().map(|place| weld.id(place)).collect();
            let mut border = Border::new();
            for [a, b, c] in mesh
                .triangles()
                .map(|vertices| vertices.map(|vertex| ids[vertex as usize]))
            {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    *border.entry((from.min(to), from.max(to))).or_default() +=
                        (to > from) as i32 - (to < from) as i32;
                }
            }
            border.retain(|_, net| *net != 0);
            (object, border)
        };
        Self {
            borders: glass.iter().chain(opaque).map(&mut border).collect(),
            glass: glass.to_vec(),
        }
    }

    /// Closed bodies of glass, or of glass and the opaque surfaces at its borders.
    fn bodies(&self, objects: &[Object], materials: &[Material]) -> Vec<Body> {
        let ior = |object: usize| materials[objects[object].material].ior;
        let glass = |near: usize, far: usize| self.glass.contains(&far) && ior(near) == ior(far);
        let any = |near: usize, far: usize| !self.glass.contains(&far) || ior(near) == ior(far);
        let mut bodies: Vec<Body> = Vec::new();
        for &first in &self.glass {
            if bodies.iter().any(|body| body.signs.contains_key(&first)) {
                continue;
            }
            let closed = self.grown(first, glass).or_else(|| self.grown(first, any));
            let Some(mut body) = closed else {
                continue;
            };
            let volumes = body
                .signs
                .iter()
                .map(|(&object, &sign)| f64::from(sign) * volume_m3(objects[object].in_scene()));
            if volumes.sum::<f64>() < 0.0 {
                body.signs.values_mut().for_each(|sign| *sign = -*sign);
            }
            bodies.push(body);
        }
        bodies
    }

    /// All pieces that border on one, directly or by others, if they close.
    fn grown(&self, first: usize, may_join: impl Fn(usize, usize) -> bool) -> Option<Body> {
        let mut signs = BTreeMap::from([(first, 1)]);
        let mut waiting = vec![first];
        while let Some(piece) = waiting.pop() {
            for (&other, border) in &self.borders {
                if signs.contains_key(&other) || !may_join(first, other) {
                    continue;
                }
                let own = &self.borders[&piece];
                let common = border.iter().find_map(|(edge, net)| Some(net * own.get(edge)?));
                if let Some(product) = common {
                    signs.insert(other, -signs[&piece] * product.signum());
                    waiting.push(other);
                }
            }
        }
        let mut left = Border::new();
        for (object, sign) in &signs {
            for (edge, net) in &self.borders[object] {
                *left.entry(*edge).or_default() += sign * net;
            }
        }
        left.values().all(|net| *net == 0).then_some(Body { signs })
    }
}

/// Numbers of places; places within a few roundings of each other share one.
#[derive(Default)]
struct Weld {
    known: HashMap<[i64; 3], Vec<(DVec3, u32)>>,
    count: u32,
}

impl Weld {
    fn id(&mut self, place: DVec3) -> u32 {
        let near_m = WELD * place.abs().max_element();
        // Cells of a power of two, so that near places have cells of the same size, or are welded by none.
        let cell_m = (2.0 * near_m).max(f64::MIN_POSITIVE).log2().ceil().exp2();
        let cell = |place: DVec3| (place / cell_m).floor().to_array().map(|index| index as i64);
        let mut corners = (0..8).map(|corner: i32| {
            let side = |axis: i32| if corner >> axis & 1 == 0 { -near_m } else { near_m };
            cell(place + DVec3::new(side(0), side(1), side(2)))
        });
        let near = corners.find_map(|cell| {
            let known = self.known.get(&cell)?.iter();
            known.copied().find(|(known, _)| known.distance(place) <= near_m)
        });
        if let Some((_, id)) = near {
            return id;
        }
        self.count += 1;
        self.known
            .entry(cell(place))
            .or_default()
            .push((place, self.count));
        self.count
    }
}

/// Tells water, which something holds, from panes.
#[derive(Default)]
struct Held {
    /// All triangles.
    all: Option<TriangleBvh>,
}

impl Held {
    /// Whether an open mesh is level and has one side of a liquid, or other surfaces are below it all around.
    fn is_water(&mut self, index: usize, objects: &[Object], materials: &[Material]) -> bool {
        let (mesh, material) = (objects[index].in_scene(), &materials[objects[index].material]);
        let count = mesh.triangle_count();
        let area = |triangle: usize| mesh.face_normal(triangle) * mesh.triangle_area_m2(triangle);
        let up: DVec3 = (0..count).map(area).sum();
        let is_liquid = material.ior <= MOST_LIQUID_IOR;
        if (material.double_sided && !is_liquid) || up.y < LEVEL * mesh.area_m2() {
            return false;
        }
        if is_liquid && !material.double_sided {
            return true;
        }
        let all = self.all.get_or_insert_with(|| {
            let meshes = objects.iter().map(|object| object.in_scene());
            let corners = meshes
                .flat_map(|mesh| (0..mesh.triangle_count()).map(move |triangle| mesh.corners(triangle)));
            TriangleBvh::build(&corners.collect::<Vec<_>>())
        });
        let is_stopped = |ray: &Ray| {
            let sheared = ShearedRay::new(ray);
            let mut is_stopped = false;
            all.search(ray, f64::INFINITY, |slot| {
                is_stopped |= sheared.intersect(all.corners(slot)).is_some();
                (!is_stopped).then_some(f64::INFINITY)
            });
            is_stopped
        };
        let samples = (0..SAMPLES).flat_map(|place| (0..SAMPLES).map(move |way| (place, way)));
        samples.into_iter().all(|(place, way)| {
            let triangle = place as usize * count / SAMPLES as usize;
            let [a, b, c] = mesh.corners(triangle);
            let square = even_point(way, 0, 0);
            let down = -square.x.mul_add(0.98, 0.02);
            let across = (1.0 - down * down).sqrt();
            let (sin, cos) = (square.y * std::f64::consts::TAU).sin_cos();
            is_stopped(&Ray {
                origin: (a + b + c) / 3.0,
                direction: DVec3::new(across * cos, down, across * sin),
            })
        })
    }
}
