//! Which specular surfaces a light can reach, and from which of them its light can go on to a diffuse surface. Works on
//! bounding boxes and is conservative.

use glam::DVec3;

use super::sealed_regions::Compartments;
use crate::geometry::enclosure::Bounds;
use crate::scene::{InScene, Light, LightKind, Material, Scene, SurfaceKind};

/// With more specular objects than this, all that share a compartment are assumed to send light to each other.
const MAX_RELAYS: usize = 512;

/// Maximum number of triangle-box tests per object; beyond, it is assumed to reach everything.
const MAX_TESTS: usize = 1 << 22;

/// Rounding tolerance of tests with planes and boxes, relative to the size of the scene.
const TOLERANCE: f64 = 1e-9;

/// Which objects may send light to which.
#[derive(Debug)]
pub struct SceneReach<'a> {
    scene: &'a Scene,
    compartments: Compartments,
    bounds: Vec<Option<Bounds>>,
    specular: Vec<usize>,
    receivers: Vec<usize>,
    tolerance_m: f64,
    /// Specular objects whose light may end on a receiver, wherever it comes from.
    is_useful: Vec<bool>,
}

impl<'a> SceneReach<'a> {
    pub fn of(scene: &'a Scene) -> Self {
        let of_kind = |wanted: fn(&Material) -> bool| -> Vec<usize> {
            (0..scene.objects.len())
                .filter(|&object| wanted(scene.material_of(object)))
                .collect()
        };
        let size_m = scene.bounds().map_or(0.0, |(low, high)| {
            (high - low).length() + low.abs().max(high.abs()).max_element()
        });
        let mut reach = Self {
            scene,
            compartments: Compartments::of(scene),
            bounds: scene.objects.iter().map(|object| object.bounds()).collect(),
            specular: of_kind(Material::is_specular),
            receivers: of_kind(|material| material.surface.is_receiver()),
            tolerance_m: TOLERANCE * size_m,
            is_useful: vec![false; scene.objects.len()],
        };
        reach.find_useful();
        reach
    }

    /// Specular objects, in ascending order, that a light may hit first and whose light may end on a receiver.
    pub fn casters(&self, light: usize) -> Vec<usize> {
        let source = &self.scene.lights[light];
        // If opaque bodies seal the light from every receiver, no path leads to one.
        if !self
            .receivers
            .iter()
            .any(|&receiver| self.compartments.light_meets(light, receiver))
        {
            return Vec::new();
        }
        let goes_on = |&object: &usize| {
            self.compartments.light_meets(light, object)
                && (self.sends_to_any(object, Some(source), &self.receivers)
                    || self
                        .specular
                        .iter()
                        .any(|&next| self.is_useful[next] && self.sends(object, Some(source), next)))
        };
        self.specular.iter().copied().filter(goes_on).collect()
    }

    /// Specular objects that no opaque body seals from a light, whether or not their light may end on a receiver.
    pub fn unsealed(&self, light: usize) -> Vec<usize> {
        let meets = |&object: &usize| self.compartments.light_meets(light, object);
        self.specular.iter().copied().filter(meets).collect()
    }

    /// All specular objects that light from a light may reach, including those that it sees, in ascending order. Each
    /// comes with the object that sends light there, or `None` if the light sees it directly.
    pub fn reached(&self, light: usize, seen: &[usize]) -> Vec<(usize, Option<usize>)> {
        let source = &self.scene.lights[light];
        let mut by_way_of: Vec<Option<Option<usize>>> = vec![None; self.scene.objects.len()];
        let mut waiting: Vec<(usize, Option<&Light>)> = Vec::new();
        for &object in seen {
            by_way_of[object] = Some(None);
            waiting.push((object, Some(source)));
        }
        while let Some((from, lit_by)) = waiting.pop() {
            for &to in &self.specular {
                if by_way_of[to].is_none() && self.sends(from, lit_by, to) {
                    by_way_of[to] = Some(Some(from));
                    waiting.push((to, None));
                }
            }
            // Light that a mirror reflects onto itself arrives from another side.
            if lit_by.is_some() && self.sends(from, lit_by, from) {
                waiting.push((from, None));
            }
        }
        let found = by_way_of.iter().enumerate();
        found
            .filter_map(|(object, way)| Some((object, (*way)?)))
            .collect()
    }

    /// Works backwards from the receivers.
    fn find_useful(&mut self) {
        if self.specular.len() > MAX_RELAYS {
            self.specular
                .iter()
                .for_each(|&object| self.is_useful[object] = true);
            return;
        }
        loop {
            let newly: Vec<usize> = self
                .specular
                .iter()
                .copied()
                .filter(|&object| !self.is_useful[object])
                .filter(|&object| {
                    self.sends_to_any(object, None, &self.receivers)
                        || self
                            .specular
                            .iter()
                            .any(|&next| self.is_useful[next] && self.sends(object, None, next))
                })
                .collect();
            if newly.is_empty() {
                return;
            }
            newly.iter().for_each(|&object| self.is_useful[object] = true);
        }
    }

    fn sends_to_any(&self, from: usize, lit_by: Option<&Light>, to: &[usize]) -> bool {
        let tests = self.scene.objects[from]
            .mesh()
            .triangles
            .len()
            .saturating_mul(to.len());
        let shares = |&to: &usize| self.compartments.share(from, to);
        if tests > MAX_TESTS {
            return to.iter().any(shares);
        }
        to.iter().any(|&to| self.sends(from, lit_by, to))
    }

    /// Whether a specular object may send light to another object: light directly from `lit_by`, or from anywhere if
    /// that is `None`.
    fn sends(&self, from: usize, lit_by: Option<&Light>, to: usize) -> bool {
        let Some(bounds) = self.bounds[to] else {
            return false;
        };
        if !self.compartments.share(from, to) {
            return false;
        }
        match self.scene.material_of(from).surface {
            SurfaceKind::Dielectric | SurfaceKind::ThinWall | SurfaceKind::Varied => true,
            SurfaceKind::Diffuse => false,
            SurfaceKind::Mirror | SurfaceKind::Coated => {
                let mesh = self.scene.objects[from].in_scene();
                self.specular.len() > MAX_RELAYS || self.reflects_into(mesh, lit_by, bounds)
            }
        }
    }

    /// Whether part of a box lies in front of any triangle of a mirror, on a side that is lit.
    fn reflects_into(&self, mesh: InScene, lit_by: Option<&Light>, bounds: Bounds) -> bool {
        (0..mesh.triangle_count()).any(|triangle| {
            let corner = mesh.corners(triangle)[0];
            let normal = mesh.face_normal(triangle);
            let lit = lit_by.map_or([true, true], |light| self.lit_sides(light, corner, normal));
            let (low, high) = heights(bounds, corner, normal);
            (lit[0] && high > self.tolerance_m) || (lit[1] && low < -self.tolerance_m)
        })
    }

    /// Whether a light may illuminate the front and the back of a plane.
    fn lit_sides(&self, light: &Light, point: DVec3, normal: DVec3) -> [bool; 2] {
        let (height, tolerance) = match light.kind {
            // A light with a size may extend beyond any plane.
            _ if light.has_extent() => return [true, true],
            LightKind::Sun { direction, .. } => (-direction.dot(normal), TOLERANCE),
            kind => match kind.position() {
                Some(position) => ((position - point).dot(normal), self.tolerance_m),
                None => return [true, true],
            },
        };
        [height >= -tolerance, height <= tolerance]
    }
}

/// Range of heights of a box above a plane [m].
fn heights((low, high): Bounds, point: DVec3, normal: DVec3) -> (f64, f64) {
    let centre = (low * 0.5 + high * 0.5 - point).dot(normal);
    let reach = ((high - low) * 0.5).dot(normal.abs());
    (centre - reach, centre + reach)
}
