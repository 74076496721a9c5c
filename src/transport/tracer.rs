//! Finds the next hit in a scene.

use std::cell::RefCell;
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use rayon::prelude::*;

use super::bend;
use super::hierarchy::{self, Hierarchy, SceneNode};
use super::interaction::DiffuseResponse;
use super::normal_texture;
use super::sharp_edges::sharp_edges;
use super::smoothing::smoothing_groups;
use super::traversed::TraversedCells;
use crate::geometry::{Ray, bvh::NO_SLOT, ray};
use crate::optics::spectrum::Spectrum;
use crate::optics::{LinearSrgb, Nanometres};
use crate::scene::{
    Adjacency, AlphaMask, Material, Mixture, NormalMap, Scene, SurfaceKind, TextureRef, instances,
};

/// Number of the largest opaque triangles.
const MAX_HIDERS: usize = 1 << 16;

/// A scene with its hierarchies and shape data. Edited copies share what the edits leave unchanged.
#[derive(Clone, Debug)]
pub struct Tracer {
    scene: Arc<Scene>,
    hierarchy: Arc<Hierarchy>,
    /// By object.
    shapes: Vec<Arc<Shape>>,
    /// By object; `None` where it is not specular.
    groups: Vec<Option<Groups>>,
    /// Whether waves and textures perturb normals.
    has_bumps: bool,
    /// Whether any material has an alpha mask.
    has_masks: bool,
    /// Whether any material has partial coverage.
    has_partial: bool,
    /// See [`Self::largest_opaque`].
    largest_opaque: Arc<OnceLock<Vec<(usize, usize)>>>,
    /// Wavelength of all light; `None` for RGB.
    wavelength: Option<Nanometres>,
    /// Where its rays go, if that is wanted.
    traversed: Option<Arc<TraversedCells>>,
}

/// Shape data of an object, computed on first use.
#[derive(Debug, Default)]
struct Shape {
    adjacency: OnceLock<Adjacency>,
    edges: OnceLock<Vec<[DVec3; 2]>>,
}

/// Smoothing group of each triangle of a specular object.
type Groups = Arc<Vec<u32>>;

/// Shape of an object, and what is known of a specular one.
type KnownShape = (Arc<Shape>, Option<Groups>);

/// Where a ray hit a surface, without derived data: the compact form to store.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Index into `Scene::objects`.
    pub object: u32,
    /// Index into the object's triangles.
    pub triangle: u32,
    pub barycentric: [f64; 3],
    /// From the ray's origin [m].
    pub distance_m: f64,
}

/// A surface point hit by a ray.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceHit {
    /// Index into `Scene::objects`.
    pub object: usize,
    /// Index into the object's triangles.
    pub triangle: usize,
    pub barycentric: [f64; 3],
    /// From the ray's origin [m].
    pub distance_m: f64,
    /// [m].
    pub point: DVec3,
    /// Bound on the rounding error of `point` per axis [m].
    pub point_error: DVec3,
    /// Unit, by the triangle's winding: outwards.
    pub geometric_normal: DVec3,
    /// Unit, interpolated from the vertices: the normal of the smooth surface that the mesh approximates.
    pub interpolated_normal: DVec3,
    /// Unit, the normal for scattering: interpolated, and perturbed by the bumps of a specular surface.
    pub shading_normal: DVec3,
    /// Slot in the hierarchy of copied triangles, for [`Tracer::next_hit`].
    pub slot: u32,
}

impl SurfaceHit {
    /// A ray that leaves this point in a unit direction, offset so that it does not hit the surface again.
    #[inline(always)]
    pub fn spawn(&self, direction: DVec3) -> Ray {
        Ray {
            origin: ray::offset_origin(self.point, self.point_error, self.geometric_normal, direction),
            direction,
        }
    }
}

impl Tracer {
    /// Builds the hierarchies over all triangles of a scene.
    pub fn new(scene: Arc<Scene>) -> Self {
        Self::sharing(scene, instances::MAX_COPIED)
    }

    /// `max_copied`: see [`instances::MAX_COPIED`].
    pub(super) fn sharing(scene: Arc<Scene>, max_copied: usize) -> Self {
        let hierarchy = Arc::new(Hierarchy::new(&scene, max_copied));
        Self::assemble(scene, hierarchy, true, |_| None)
    }

    /// `known` gives the shape of an object that is the same as before.
    fn assemble(
        scene: Arc<Scene>,
        hierarchy: Arc<Hierarchy>,
        has_bumps: bool,
        known: impl Fn(usize) -> Option<KnownShape> + Sync,
    ) -> Self {
        let shape = |object: usize| {
            let (shape, groups) = known(object).unwrap_or_default();
            let is_specular = scene.material_of(object).surface.is_specular();
            let groups = groups.filter(|_| is_specular);
            (
                shape,
                groups.or_else(|| Self::groups_of(&scene, &hierarchy, object)),
            )
        };
        let (shapes, groups) = (0..scene.objects.len()).into_par_iter().map(shape).unzip();
        Self {
            has_masks: is_any(&scene, |material| material.alpha_mask.is_some()),
            has_partial: is_any(&scene, |material| material.coverage.is_some()),
            shapes,
            scene,
            hierarchy,
            groups,
            has_bumps,
            largest_opaque: Arc::default(),
            wavelength: None,
            traversed: None,
        }
    }

    /// Tracer of an edited copy of the scene, for light of all wavelengths; rebuilds only what the edits changed.
    #[must_use]
    pub fn edited(&self, scene: Arc<Scene>) -> Self {
        let is_same = |object: usize| {
            let [was, is] = [&self.scene, &scene].map(|scene| &scene.objects[object]);
            was.stands_as(is)
        };
        let count = scene.objects.len();
        if count != self.scene.objects.len() {
            return Self::new(scene);
        }
        let is_known: Vec<bool> = (0..count).map(is_same).collect();
        let hierarchy = if is_known.iter().all(|is_known| *is_known) {
            Arc::clone(&self.hierarchy)
        } else {
            Arc::new(self.hierarchy.edited(&self.scene, &scene))
        };
        let known = |object: usize| (Arc::clone(&self.shapes[object]), self.groups[object].clone());
        Self::assemble(scene, hierarchy, self.has_bumps, |object| {
            is_known[object].then(|| known(object))
        })
    }

    /// The same scene with the unperturbed normals of its meshes.
    #[must_use]
    pub fn without_bumps(&self) -> Self {
        Self {
            has_bumps: false,
            ..self.clone()
        }
    }

    /// The same scene for rays whose way is noted.
    #[must_use]
    pub fn noting(&self, traversed: &Arc<TraversedCells>) -> Self {
        Self {
            traversed: Some(Arc::clone(traversed)),
            ..self.clone()
        }
    }

    fn note_ray(&self, ray: &Ray, distance_m: f64) {
        if let Some(traversed) = &self.traversed {
            traversed.add_ray(ray, distance_m);
        }
    }

    /// The same scene [as the eye sees it](Scene::as_seen).
    #[must_use]
    pub fn as_seen(&self) -> Self {
        Self {
            scene: Arc::new(self.scene.as_seen()),
            ..self.clone()
        }
    }

    /// The same scene without its clear bodies: rays pass straight through them.
    #[must_use]
    pub fn without_clear_bodies(&self) -> Self {
        let mut scene = Scene::clone(&self.scene);
        let is_clear = |material: &&mut Material| material.surface.is_clear();
        for material in scene.materials.iter_mut().filter(is_clear) {
            material.alpha_mask = Some(AlphaMask::NOWHERE);
        }
        self.edited(Arc::new(scene))
    }

    /// The same scene with the refractive indices of one wavelength. Colours are unchanged.
    #[must_use]
    pub fn with_indices_at(&self, wavelength: Nanometres) -> Self {
        let mut scene = Scene::clone(&self.scene);
        for material in &mut scene.materials {
            material.ior = material.index_at(wavelength);
        }
        self.edited(Arc::new(scene))
    }

    /// The same scene for a lamp that is traced at some of its wavelengths with RGB throughput: metals of a known
    /// substance have the factor of [`Metal::factor_under`](crate::optics::Metal::factor_under).
    #[must_use]
    pub fn with_metals_under(&self, lamp: &Spectrum) -> Self {
        let mut scene = Scene::clone(&self.scene);
        for material in &mut scene.materials {
            if let Some(metal) = material.metal {
                material.base_colour = metal.factor_under(lamp);
            }
        }
        self.edited(Arc::new(scene))
    }

    /// The same scene at one wavelength: metals of a known substance have their reflectance there, equal in all
    /// channels. Other colours are unchanged: [`ColourBasis`](crate::optics::ColourBasis) has their values at the
    /// wavelength.
    #[must_use]
    pub fn at_wavelength(&self, wavelength: Nanometres) -> Self {
        Self {
            wavelength: Some(wavelength),
            ..self.with_indices_at(wavelength)
        }
    }

    /// Wavelength of the traced light; `None` for RGB.
    pub fn wavelength(&self) -> Option<Nanometres> {
        self.wavelength
    }

    /// The largest triangles of opaque surfaces and their objects, (object, triangle), largest first: the best ones to
    /// hide something behind. At most 2¹⁶.
    pub fn largest_opaque(&self) -> &[(usize, usize)] {
        self.largest_opaque.get_or_init(|| {
            let mut all: Vec<(f64, usize, usize)> = Vec::new();
            for (index, object) in self.scene.objects.iter().enumerate() {
                if self.scene.material_of(index).is_opaque() {
                    let mesh = object.in_scene();
                    let area = |triangle| (mesh.triangle_area_m2(triangle), index, triangle);
                    all.par_extend((0..mesh.triangle_count()).into_par_iter().map(area));
                }
            }
            let order = |a: &(f64, usize, usize), b: &(f64, usize, usize)| {
                b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2)))
            };
            if all.len() > MAX_HIDERS {
                all.select_nth_unstable_by(MAX_HIDERS, order);
                all.truncate(MAX_HIDERS);
            }
            all.par_sort_unstable_by(order);
            all.into_iter()
                .map(|(_, object, triangle)| (object, triangle))
                .collect()
        })
    }

    /// Whether anything perturbs the normals of an object.
    fn is_bumpy(&self, object: usize) -> bool {
        self.has_bumps && self.scene.material_of(object).has_bumps()
    }

    fn groups_of(scene: &Scene, hierarchy: &Hierarchy, object: usize) -> Option<Groups> {
        if !scene.material_of(object).surface.is_specular() {
            return None;
        }
        Some(match hierarchy.shared(object) {
            Some(shared) => Arc::clone(&shared.groups),
            None => Arc::new(smoothing_groups(scene.objects[object].mesh_in_scene())),
        })
    }

    /// End points of each sharp edge of an object [m]; empty where there are too many.
    pub fn sharp_edges(&self, object: usize) -> &[[DVec3; 2]] {
        let edges = &self.shapes[object].edges;
        edges.get_or_init(|| sharp_edges(self.scene.objects[object].in_scene()))
    }

    /// Smoothing group of a triangle within its object; 0 where the object is not specular.
    pub fn smoothing_group(&self, object: usize, triangle: usize) -> u32 {
        let groups = self.groups[object].as_ref();
        groups.map_or(0, |groups| groups[triangle])
    }

    pub fn adjacency(&self, object: usize) -> &Adjacency {
        let adjacency = &self.shapes[object].adjacency;
        adjacency.get_or_init(|| Adjacency::of(self.scene.objects[object].in_scene()))
    }

    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Root nodes that together hold all triangles.
    pub fn roots(&self) -> Vec<SceneNode<'_>> {
        self.hierarchy.roots()
    }

    pub(super) fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }

    /// Closest surface in front of the ray's origin.
    #[inline(always)]
    pub fn closest_hit(&self, ray: &Ray) -> Option<SurfaceHit> {
        self.next_hit(ray, NO_SLOT)
    }

    /// The same for a ray that leaves the hit with this slot: a triangle is flat, so that it cannot be met again.
    #[inline(always)]
    pub fn next_hit(&self, ray: &Ray, left: u32) -> Option<SurfaceHit> {
        let (place, found) = self.closest(ray, left)?;
        let slot = if found.0.is_none() { found.1 } else { NO_SLOT };
        Some(self.surface_with(&place, &self.hierarchy.corners(found), slot))
    }

    /// Closest hit in front of the ray's origin, without surface data.
    pub fn intersect(&self, ray: &Ray) -> Option<RayHit> {
        Some(self.closest(ray, NO_SLOT)?.0)
    }

    fn closest(&self, ray: &Ray, left: u32) -> Option<(RayHit, hierarchy::Found<'_>)> {
        let closest = if self.has_masks {
            self.hierarchy.closest(ray, left, |object, triangle, at| {
                self.is_there(object, triangle, at)
            })
        } else {
            self.hierarchy.closest(ray, left, |_, _, _| true)
        };
        self.note_ray(ray, closest.map_or(f64::INFINITY, |(place, _)| place.distance_m));
        closest
    }

    /// Surface data of a hit.
    pub fn surface_at(&self, hit: &RayHit) -> SurfaceHit {
        let mesh = self.scene.objects[hit.object as usize].in_scene();
        self.surface_with(hit, &mesh.corners(hit.triangle as usize), NO_SLOT)
    }

    #[inline(always)]
    fn surface_with(&self, hit: &RayHit, corners: &[DVec3; 3], slot: u32) -> SurfaceHit {
        let (object, triangle) = (hit.object as usize, hit.triangle as usize);
        let mesh = self.scene.objects[object].in_scene();

        // The point lies on the triangle, not on the ray, and its rounding error is bounded: rays that leave are offset
        // by it.
        let (point, point_error) = ray::point_with_error(corners, hit.barycentric);
        let [a, b, c] = *corners;
        let geometric_normal = (b - a).cross(c - a).normalize_or_zero();

        // Vertex normals that cancel have no direction; the flat normal stands in.
        let [a, b, c] = mesh.corner_normals(triangle);
        let [wa, wb, wc] = hit.barycentric;
        let interpolated_normal = (a * wa + b * wb + c * wc)
            .try_normalize()
            .unwrap_or(geometric_normal);
        let flat = SurfaceHit {
            object,
            triangle,
            barycentric: hit.barycentric,
            distance_m: hit.distance_m,
            point,
            point_error,
            geometric_normal,
            interpolated_normal,
            shading_normal: interpolated_normal,
            slot,
        };
        if !self.is_bumpy(object) {
            return flat;
        }
        // The gradient borrows a copy of the hit, so that the usual one needs no address and is built in place.
        let gradient = self.bump_gradient(&{ flat });
        SurfaceHit {
            shading_normal: bend::bent(interpolated_normal, gradient),
            ..flat
        }
    }

    /// Height gradient that perturbs the normal at a hit on a bumpy object [1].
    fn bump_gradient(&self, hit: &SurfaceHit) -> DVec3 {
        let waves = self.scene.material_of(hit.object).bending_waves();
        let of_waves = waves.map(|waves| waves.gradient(hit.point));
        let of_texture = self.texture_gradient(hit);
        of_waves.unwrap_or_default() + of_texture.unwrap_or_default()
    }

    fn texture_gradient(&self, hit: &SurfaceHit) -> Option<DVec3> {
        self.gradient_of(self.scene.material_of(hit.object).bending_map()?, hit)
    }

    /// Unit normal by which pictures shade diffuse light; `None` without a normal map.
    pub fn relief_normal(&self, hit: &SurfaceHit) -> Option<DVec3> {
        let material = self.scene.material_of(hit.object);
        let map = material.relief()?;
        if material.surface.is_specular() {
            return Some(hit.shading_normal);
        }
        Some(bend::bent(hit.interpolated_normal, self.gradient_of(map, hit)?))
    }

    fn gradient_of(&self, map: &NormalMap, hit: &SurfaceHit) -> Option<DVec3> {
        let mesh = self.scene.objects[hit.object].in_scene();
        let place = (hit.triangle, hit.barycentric);
        normal_texture::gradient((&self.scene, mesh), map, place, hit.interpolated_normal)
    }

    /// Divergence of the normals at a hit per length [1/m], half the sum of the curvatures: > 0 where the surface is
    /// convex. Normal maps, whose curvature depends on their resolution, are left out.
    pub fn curvature(&self, hit: &SurfaceHit) -> f64 {
        let mesh = self.scene.objects[hit.object].in_scene();
        let (places, normals) = (mesh.corners(hit.triangle), mesh.corner_normals(hit.triangle));
        let bend = |from: usize, to: usize| {
            let edge = places[to] - places[from];
            (normals[to] - normals[from]).dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE)
        };
        let of_mesh = (bend(0, 1) + bend(1, 2) + bend(2, 0)) / 3.0;
        let waves = self.scene.material_of(hit.object).bending_waves();
        let of_waves = waves
            .filter(|_| self.is_bumpy(hit.object))
            .map(|waves| waves.laplacian(hit.point, hit.interpolated_normal));
        of_mesh - 0.5 * of_waves.unwrap_or_default()
    }

    /// Whether any surface lies on the ray before `distance_m`.
    pub fn is_blocked(&self, ray: &Ray, distance_m: f64) -> bool {
        self.note_ray(ray, distance_m);
        if self.has_masks {
            let is_there = |object: usize, triangle: usize, at| self.is_there(object, triangle, at);
            self.hierarchy.is_blocked(ray, distance_m, is_there)
        } else {
            self.hierarchy.is_blocked(ray, distance_m, |_, _, _| true)
        }
    }

    /// Visibility along a shadow ray up to `distance_m`: the product of the uncovered fractions of all surfaces on it.
    pub fn passing_share(&self, ray: &Ray, distance_m: f64) -> f64 {
        if !self.has_partial {
            return f64::from(u8::from(!self.is_blocked(ray, distance_m)));
        }
        self.note_ray(ray, distance_m);
        let holes = RefCell::new(Vec::new());
        let is_blocked = self
            .hierarchy
            .is_blocked(ray, distance_m, |object, triangle, at| {
                if !self.is_there(object, triangle, at) {
                    return false;
                }
                if self.scene.material_of(object).coverage.is_none() {
                    return true;
                }
                let hole = self.mixture(object, (triangle, at), true).hole;
                holes.borrow_mut().push(hole);
                hole == 0.0
            });
        if is_blocked {
            return 0.0;
        }
        // Sorted, so that the product does not depend on the order of traversal.
        let mut holes = holes.into_inner();
        holes.sort_unstable_by(f64::total_cmp);
        holes.iter().product()
    }

    /// Whether the surface exists at a point of a triangle or is cut out by its alpha mask.
    fn is_there(&self, object: usize, triangle: usize, barycentric: [f64; 3]) -> bool {
        let material = self.scene.material_of(object);
        let Some(mask) = &material.alpha_mask else {
            return true;
        };
        let image = material.base_colour_texture.as_ref();
        mask.is_there(
            image.and_then(|image| self.scene.placed_texture(image, (object, triangle), barycentric)),
        )
    }

    /// Mixture of surface classes at a point of a triangle; by the material's factors alone without `textures`.
    pub(super) fn mixture(
        &self,
        object: usize,
        (triangle, barycentric): (usize, [f64; 3]),
        textures: bool,
    ) -> Mixture {
        let material = self.scene.material_of(object);
        let placed = |image: &TextureRef| self.scene.placed_texture(image, (object, triangle), barycentric);
        let variation = material.variation.as_ref().filter(|_| textures);
        let factors = variation.and_then(|variation| placed(&variation.image));
        let colour = material.base_colour_texture.as_ref();
        let alpha = colour.filter(|_| material.coverage.is_some()).and_then(placed);
        material.mixture(
            factors.map_or(LinearSrgb::WHITE, |(texture, uv)| texture.sample(uv)),
            alpha.map_or(1.0, |(texture, uv)| texture.alpha(uv)),
        )
    }

    /// Response of the diffuse component at a point of a triangle.
    pub fn diffuse_response(&self, object: usize, triangle: usize, barycentric: [f64; 3]) -> DiffuseResponse {
        let material = self.scene.material_of(object);
        let (share, coat) = match material.surface {
            SurfaceKind::Coated => (1.0, material.coat),
            SurfaceKind::Varied => {
                let mixture = self.mixture(object, (triangle, barycentric), true);
                (mixture.body, mixture.coat)
            }
            _ => (1.0, 0.0),
        };
        DiffuseResponse {
            share,
            coat,
            ior: material.ior,
        }
    }

    /// Base colour at a hit, including texture and vertex colours.
    pub fn base_colour(&self, hit: &SurfaceHit) -> LinearSrgb {
        self.scene.material_of(hit.object).base_colour * self.texture_colour(hit)
    }

    /// Factor of texture and vertex colours on the base colour at a hit: white without either.
    pub(super) fn texture_colour(&self, hit: &SurfaceHit) -> LinearSrgb {
        let image = self.scene.material_of(hit.object).base_colour_texture.as_ref();
        let place = (hit.object, hit.triangle);
        let placed = image.and_then(|image| self.scene.placed_texture(image, place, hit.barycentric));
        let mesh = self.scene.objects[hit.object].in_scene();
        let of_vertices = mesh.colour(hit.triangle, hit.barycentric);
        placed.map_or(of_vertices, |(texture, uv)| of_vertices * texture.sample(uv))
    }
}

fn is_any(scene: &Scene, is: impl Fn(&Material) -> bool) -> bool {
    (0..scene.objects.len()).any(|object| is(scene.material_of(object)))
}
