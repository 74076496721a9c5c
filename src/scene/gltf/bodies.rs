//! Bodies of glass: which objects bound one, alone or with others, and which are open. Files split a body wherever the
//! material changes, and some are wound inwards.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc;

use glam::DVec3;

use super::context::LoadContext;
use crate::geometry::sampling::even_point;
use crate::geometry::triangle::ShearedRay;
use crate::geometry::{DisjointSets, Ray, TriangleBvh, bits, numbered};
use crate::scene::watertight::{has_extent, is_closed, volume_m3};
use crate::scene::{InScene, Material, Mesh, Object};

/// Distance of vertices that are one, in their coordinates [1]: a few roundings to single precision.
const WELD: f64 = 1.0 / (1 << 20) as f64;

/// Samples of an open sheet, and rays below each, that tell whether something holds what is below it.
const SAMPLES: u32 = 16;

/// Smallest cosine between the normals of triangles of one plane, whose vertices are rounded to single precision.
const FLAT: f64 = 1.0 - 1e-9;

/// Smallest vertical component of the mean normal of a level sheet: a tilt of 45°.
const LEVEL: f64 = 0.7;

/// Highest index of water and other liquids that stand in the open; window glass has a higher one.
const MOST_LIQUID_IOR: f64 = 1.4;

/// Turns meshes that are wound inwards, leaves out faces that a body has twice, and gives each object of a body that
/// several bound its [`Object::body`]. Returns whether each object bounds a body. `materials`: those of the file.
pub fn find(objects: &mut [Object], materials: &[Material], load: &mut LoadContext) -> Vec<bool> {
    let material = |object: &Object| &materials[object.material];

    // Instances share a mesh, which is tested for closedness once.
    let mut closed = HashMap::new();
    let mut closes = |object: &Object| {
        let mesh = object.mesh();
        *closed.entry(Arc::as_ptr(mesh)).or_insert_with(|| is_closed(mesh))
    };

    // Objects that bound a body by themselves come first; only open ones are pieced together with others.
    let (mut turned, mut singled) = (Remade::default(), Remade::default());
    let mut bounds_body = vec![false; objects.len()];
    let mut open = Vec::new();
    for index in 0..objects.len() {
        let object = &objects[index];
        if !material(object).transmits() {
            // Opaque surfaces only need a front. Normals that all oppose the winding say that it is the other side.
            if !material(object).double_sided && is_against_normals(object.mesh()) {
                turned.invert(&mut objects[index]);
                let what = "was wound against its normals; its front is now where these point";
                load.warn(
                    node(&objects[index]),
                    what,
                    "turn its faces, or recompute its normals",
                );
            }
            continue;
        }

        // Where a mesh has both sides of every face, the two enclose a volume of 0; one of them alone may bound a body.
        let mut volume_m3 = body_volume_m3(object.in_scene(), closes(object));
        if volume_m3.is_none() && singled.remake(&mut objects[index], single) {
            load.warn(
                node(&objects[index]),
                "bounds a body by faces that it has twice; the second ones were left out",
                "write every face once",
            );
            volume_m3 = body_volume_m3(objects[index].in_scene(), true);
        }
        let Some(volume_m3) = volume_m3 else {
            // A closed mesh without a volume is a sheet with two sides, which bounds nothing with others.
            if !closes(&objects[index]) {
                open.push(index);
            }
            continue;
        };

        // Faces that look inwards enclose a negative volume; light would refract at them as if it left the body.
        bounds_body[index] = true;
        if volume_m3 < 0.0 {
            turned.invert(&mut objects[index]);
            warn_of_turn(&objects[index], load);
        }
    }

    // Opaque surfaces may close a body of glass at its border; those far from all open pieces cannot.
    if open.is_empty() {
        return bounds_body;
    }
    let open_boxes: Vec<(DVec3, DVec3)> = open.iter().filter_map(|&index| objects[index].bounds()).collect();
    let is_near = |object: &Object| {
        let own = object.bounds();
        own.is_some_and(|(low, high)| {
            open_boxes
                .iter()
                .any(|&(a, b)| a.cmple(high).all() && b.cmpge(low).all())
        })
    };
    let opaque = |index: &usize| {
        let object = &objects[*index];
        !material(object).transmits() && is_near(object) && !closes(object)
    };
    let opaque: Vec<usize> = (0..objects.len()).filter(opaque).collect();

    // One piece stands for its whole body, so that light that enters by one piece may leave by another. A piece whose
    // material states an interior is preferred: the body absorbs as that says.
    let pieces = Pieces::new(objects, &open, &opaque);
    for body in pieces.bodies(objects, materials) {
        let states_volume = |index: &&usize| material(&objects[**index]).volume.is_some();
        let glass = || body.signs.keys().filter(|index| pieces.glass.contains(index));
        let first = glass().find(states_volume).or(glass().next()).copied();
        let is_shared = glass().count() > 1;
        let members: Vec<usize> = glass().copied().collect();
        for index in members {
            bounds_body[index] = true;
            objects[index].body = first.filter(|_| is_shared);
            if body.signs[&index] < 0 {
                turned.invert(&mut objects[index]);
                warn_of_turn(&objects[index], load);
            }
        }
    }

    // What stays open and states a volume is the surface of a liquid or a pane.
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

/// Changed copies of meshes, shared as the meshes were.
#[derive(Default)]
struct Remade {
    /// With the meshes themselves, so that their addresses stay their own.
    known: HashMap<*const Mesh, (Arc<Mesh>, Option<Arc<Mesh>>)>,
}

impl Remade {
    /// Gives an object the changed mesh, if it is to be changed. Returns whether it was.
    fn remake(&mut self, object: &mut Object, change: impl FnOnce(&Mesh) -> Option<Mesh>) -> bool {
        let mesh = Arc::clone(object.mesh());
        let (_, changed) = self.known.entry(Arc::as_ptr(&mesh)).or_insert_with(|| {
            let changed = change(&mesh).map(Arc::new);
            (mesh, changed)
        });
        if let Some(changed) = changed {
            object.reshape(Arc::clone(changed));
        }
        changed.is_some()
    }

    fn invert(&mut self, object: &mut Object) {
        self.remake(object, |mesh| Some(inverted(mesh)));
    }
}

/// The mesh wound the other way, its normals on the side that its faces point to.
fn inverted(mesh: &Mesh) -> Mesh {
    let mut turned = Mesh::clone(mesh);
    for [_, b, c] in &mut turned.triangles {
        std::mem::swap(b, c);
    }
    if agreement(mesh).0 > 0.0 {
        turned.normals.iter_mut().for_each(|normal| *normal = -*normal);
    }
    turned
}

/// The mesh with the first of all facets that have the same outline, if it then bounds a body: some programs write both
/// sides of a face, and cut each into triangles in its own way.
fn single(mesh: &Mesh) -> Option<Mesh> {
    // Positions tell vertices apart, since normals and texture coordinates split those of one corner.
    let ids = numbered(mesh.positions.iter().copied().map(bits));
    let corners = |triangle: usize| mesh.triangles[triangle].map(|vertex| ids[vertex as usize]);

    // Triangles of the same three corners are one, whichever way they are wound.
    let mut known = HashSet::new();
    let mut kept: Vec<usize> = (0..mesh.triangles.len()).collect();
    kept.retain(|&triangle| {
        let mut corners = corners(triangle);
        corners.sort_unstable();
        known.insert(corners)
    });

    // Two sides of a facet may be cut into different triangles; their outlines have the same edges.
    let mut outlines = HashSet::new();
    let mut first = Vec::new();
    for facet in facets(mesh, &kept, corners) {
        let mut outline = Border::new();
        for &triangle in &facet {
            add_edges(&mut outline, corners(triangle));
        }
        outline.retain(|_, net| *net != 0);
        if outlines.insert(outline.into_keys().collect::<Vec<Edge>>()) {
            first.extend(facet);
        }
    }

    // A two-sided sheet has such faces as well; it keeps them, since the rest bounds no body.
    if first.len() == mesh.triangles.len() {
        return None;
    }
    first.sort_unstable();
    let single = Mesh {
        triangles: first
            .into_iter()
            .map(|triangle| mesh.triangles[triangle])
            .collect(),
        ..mesh.clone()
    };
    body_volume_m3(InScene::from(&single), is_closed(&single))?;
    Some(single)
}

/// Groups of triangles that continue each other in one plane.
fn facets(mesh: &Mesh, triangles: &[usize], corners: impl Fn(usize) -> [u32; 3]) -> Vec<Vec<usize>> {
    let mut sets = DisjointSets::new(triangles.len());
    let mut at: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
    for (index, &triangle) in triangles.iter().enumerate() {
        let [a, b, c] = corners(triangle);
        let normal = mesh.face_normal(triangle);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            for &other in at.get(&(to, from)).into_iter().flatten() {
                if mesh.face_normal(triangles[other]).dot(normal) > FLAT {
                    sets.join(index, other);
                }
            }
            at.entry((from, to)).or_default().push(index);
        }
    }
    sets.grouped(triangles.iter().copied())
}

/// Volume of a mesh that is closed and bounds a body [m³].
fn body_volume_m3(mesh: InScene, is_closed: bool) -> Option<f64> {
    let volume_m3 = is_closed.then(|| volume_m3(mesh))?;
    has_extent(mesh, volume_m3).then_some(volume_m3)
}

/// An edge by its vertices, the lower one first.
type Edge = (u32, u32);

/// Net traversals of each edge, from its lower to its higher vertex; edges traversed both ways are left out.
type Border = BTreeMap<Edge, i32>;

fn add_edges(border: &mut Border, [a, b, c]: [u32; 3]) {
    for (from, to) in [(a, b), (b, c), (c, a)] {
        *border.entry((from.min(to), from.max(to))).or_default() += (to > from) as i32 - (to < from) as i32;
    }
}

/// Open meshes with their borders, in common vertices.
struct Pieces {
    /// By object.
    borders: BTreeMap<usize, Border>,
    /// Objects whose borders have an edge.
    at_edge: HashMap<Edge, Vec<usize>>,
    glass: BTreeSet<usize>,
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
            for vertices in mesh.triangles() {
                add_edges(&mut border, vertices.map(|vertex| ids[vertex as usize]));
            }
            border.retain(|_, net| *net != 0);
            (object, border)
        };
        let borders: BTreeMap<usize, Border> = glass.iter().chain(opaque).map(&mut border).collect();
        let mut at_edge: HashMap<Edge, Vec<usize>> = HashMap::new();
        for (&object, border) in &borders {
            for &edge in border.keys() {
                at_edge.entry(edge).or_default().push(object);
            }
        }
        Self {
            borders,
            at_edge,
            glass: glass.iter().copied().collect(),
        }
    }

    /// Closed bodies of glass, or of glass and the opaque surfaces at its borders.
    fn bodies(&self, objects: &[Object], materials: &[Material]) -> Vec<Body> {
        let ior = |object: usize| materials[objects[object].material].ior;
        let glass = |near: usize, far: usize| self.glass.contains(&far) && ior(near) == ior(far);
        let any = |near: usize, far: usize| !self.glass.contains(&far) || ior(near) == ior(far);
        let mut bodies: Vec<Body> = Vec::new();
        let mut in_body = BTreeSet::new();
        for &first in &self.glass {
            if in_body.contains(&first) {
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
            in_body.extend(body.signs.keys().copied());
            bodies.push(body);
        }
        bodies
    }

    /// All pieces that border on one, directly or by others, if they close.
    fn grown(&self, first: usize, may_join: impl Fn(usize, usize) -> bool) -> Option<Body> {
        let mut signs = BTreeMap::from([(first, 1)]);
        let mut waiting = vec![first];
        while let Some(piece) = waiting.pop() {
            for (edge, net) in &self.borders[&piece] {
                for &other in &self.at_edge[edge] {
                    if signs.contains_key(&other) || !may_join(first, other) {
                        continue;
                    }
                    let product = net * self.borders[&other][edge];
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
        // Liquids lie level, which the area-weighted mean of the normals tells.
        let (mesh, material) = (objects[index].in_scene(), &materials[objects[index].material]);
        let count = mesh.triangle_count();
        let area = |triangle: usize| mesh.face_normal(triangle) * mesh.triangle_area_m2(triangle);
        let up: DVec3 = (0..count).map(area).sum();

        // Index and sides decide most sheets: two-sided ones of a high index are panes, one-sided liquids are water.
        let is_liquid = material.ior <= MOST_LIQUID_IOR;
        if (material.double_sided && !is_liquid) || up.y < LEVEL * mesh.area_m2() {
            return false;
        }
        if is_liquid && !material.double_sided {
            return true;
        }

        // All else is water if it has something below it in all directions, as in a vessel.
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

        // Rays fill the lower hemisphere, uniform in solid angle, down from a degree below the horizontal.
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
