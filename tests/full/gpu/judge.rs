//! Whether an answer in single precision is right: the exact answer for a ray next to the one that was asked for.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nephroid::eye_pass::renderer::ProbedHit;
use nephroid::geometry::Ray;
use nephroid::scene::Scene;
use nephroid::transport::Tracer;
use rayon::prelude::*;

pub type Answer = Option<ProbedHit>;
/// A triangle and the distance to it in local units.
type Met = Option<(usize, f64)>;
type Corners = [DVec3; 3];

/// How far beside the asked ray the answered one may lie, in units in which the scene's radius is 1/2 to 1. With
/// u = 2⁻²⁴, rays that start within 1.2 radii and so at most 2.2 units to go: rounding the origin moves it by u, the
/// corners by u/2, their difference by 2u, and the direction turns by √3·u over 2.2 units; shear, product and
/// difference round to another 8u. Each along both axes of the plane across the ray's main axis: 2⁻¹⁹ = 32u.
const EPSILON: f64 = 1.0 / (1 << 19) as f64;

/// What is said of an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Nothing on both.
    Missed,
    /// The same triangle.
    Met,
    /// Another triangle that a ray beside the asked one meets.
    Beside,
    /// None of these.
    Wrong,
}

/// Tells right from wrong answers.
pub struct Judge {
    tracer: Tracer,
    /// Of the first triangle of each object.
    firsts: Vec<usize>,
    /// In local units.
    corners: Vec<Corners>,
    centre: DVec3,
    scale: f64,
}

/// A ray in local units, and what lies across it.
struct Across {
    origin: DVec3,
    direction: DVec3,
    axes: [DVec3; 2],
}

impl Across {
    fn flat(&self, corners: &Corners) -> [DVec2; 3] {
        let flat = |off: DVec3| DVec2::new(off.dot(self.axes[0]), off.dot(self.axes[1]));
        corners.map(|corner| flat(corner - self.origin))
    }

    /// From the ray to a triangle; 0 where it goes through.
    fn aside(&self, corners: &Corners) -> f64 {
        let flat = self.flat(corners);
        let sides = [0, 1, 2].map(|i| flat[i].perp_dot(flat[(i + 1) % 3]));
        if sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0) {
            return 0.0;
        }
        let to_edge = |i: usize| {
            let (from, along) = (flat[i], flat[(i + 1) % 3] - flat[i]);
            let share = -from.dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
            (from + along * share.clamp(0.0, 1.0)).length()
        };
        to_edge(0).min(to_edge(1)).min(to_edge(2))
    }

    /// Where along the ray a triangle begins and ends.
    fn reach(&self, corners: &Corners) -> (f64, f64) {
        let [a, b, c] = corners.map(|corner| (corner - self.origin).dot(self.direction));
        (a.min(b).min(c), a.max(b).max(c))
    }

    /// Bound of the error of the distance to a triangle: every corner, and with it every share, moves by EPSILON.
    fn distance_bound(&self, corners: &Corners) -> f64 {
        let (low, high) = self.reach(corners);
        let [a, b, c] = self.flat(corners);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let narrow = (b - a).perp_dot(c - a).abs() / longest.max(f64::MIN_POSITIVE);
        EPSILON + (high - low) * (3.0 * EPSILON / narrow.max(f64::MIN_POSITIVE)).min(1.0)
    }
}

impl Judge {
    pub fn new(scene: Arc<Scene>) -> Self {
        let tracer = Tracer::new(scene.clone());
        let (centre, scale) = (tracer.frame().centre, tracer.frame().scale);
        let (mut firsts, mut corners) = (Vec::new(), Vec::new());
        for object in &scene.objects {
            firsts.push(corners.len());
            let mesh = object.mesh_in_scene();
            let local = |triangle| mesh.corners(triangle).map(|corner| (corner - centre) * scale);
            corners.extend((0..mesh.triangles.len()).map(local));
        }
        Self {
            tracer,
            firsts,
            corners,
            centre,
            scale,
        }
    }

    pub fn bounding_sphere(&self) -> (DVec3, f64) {
        let (low, high) = self.tracer.scene().bounds().expect("it has triangles");
        let centre = low * 0.5 + high * 0.5;
        (centre, (high - centre).length())
    }

    pub fn all(&self, rays: &[Ray], answers: &[Answer]) -> Vec<Verdict> {
        assert_eq!(rays.len(), answers.len());
        let pairs = rays.par_iter().zip(answers);
        pairs.map(|(ray, answer)| self.verdict(ray, answer)).collect()
    }

    /// The CPU's answer.
    fn exact(&self, ray: &Ray) -> Met {
        let hit = self.tracer.closest_place(ray)?;
        let triangle = self.firsts[hit.object as usize] + hit.triangle as usize;
        Some((triangle, hit.distance_m * self.scale))
    }

    fn verdict(&self, ray: &Ray, answer: &Answer) -> Verdict {
        let x = ray.direction.any_orthonormal_vector();
        let across = Across {
            origin: (ray.origin - self.centre) * self.scale,
            direction: ray.direction,
            axes: [x, ray.direction.cross(x)],
        };
        let exact = self.exact(ray);
        let found = answer.map(|hit| (hit.triangle as usize, hit.distance_m * self.scale));
        let is_right = match (exact, found) {
            (None, None) => return Verdict::Missed,
            (Some((a, exact)), Some((b, found))) if a == b => {
                let is_near = (found - exact).abs() <= across.distance_bound(&self.corners[a]);
                return if is_near { Verdict::Met } else { Verdict::Wrong };
            }
            _ => self.is_shared(&across, exact, found) || self.is_beside(ray, &across, exact, found),
        };
        if is_right { Verdict::Beside } else { Verdict::Wrong }
    }

    /// Another triangle at the same distance, the ray passing both.
    fn is_shared(&self, across: &Across, exact: Met, found: Met) -> bool {
        let (Some((a, exact)), Some((b, found))) = (exact, found) else {
            return false;
        };
        let (a, b) = (&self.corners[a], &self.corners[b]);
        let bound = across.distance_bound(a) + across.distance_bound(b);
        across.aside(a).max(across.aside(b)) <= EPSILON && (exact - found).abs() <= bound
    }

    /// One of the answers is of a triangle that the other one went past.
    fn is_beside(&self, ray: &Ray, across: &Across, exact: Met, found: Met) -> bool {
        let reached = |met: Met| met.map_or(f64::INFINITY, |met| met.1);
        if let Some((triangle, distance)) = found
            && distance < reached(exact)
        {
            // The CPU sees past it: without a gap, for it leaves none.
            let corners = &self.corners[triangle];
            let (low, high) = across.reach(corners);
            let is_at = (low - EPSILON..=high + EPSILON).contains(&distance);
            return across.aside(corners) <= EPSILON && is_at;
        }
        let Some((passed, _)) = exact else {
            return false;
        };
        // The device went past it: so must a ray beside this one on the CPU, and meet what the device met.
        let is_like = |beside: Met, passed: f64| match (beside, found) {
            (None, None) => true,
            (Some((a, _)), Some((b, _))) if a == b => true,
            (Some((_, at)), Some((b, distance))) => {
                (passed + at - distance).abs() <= across.distance_bound(&self.corners[b])
            }
            _ => false,
        };
        let rings = [(16, 0.05), (64, 0.2), (256, 0.5), (512, 1.0)];
        let mut offsets = rings.into_iter().flat_map(|(steps, share)| {
            let turn = std::f64::consts::TAU / f64::from(steps);
            (0..steps).map(move |step| DVec2::from_angle(turn * f64::from(step)) * share * EPSILON)
        });
        let sees_as_the_device = |offset: DVec2| {
            let moved = (across.axes[0] * offset.x + across.axes[1] * offset.y) / self.scale;
            let origin = ray.origin + moved;
            is_like(self.exact(&Ray { origin, ..*ray }), 0.0)
        };
        if offsets.any(sees_as_the_device) {
            return true;
        }
        // Around the origin it may have been behind: then the device met what comes next.
        let Some(hit) = self.tracer.closest_hit(ray) else {
            return false;
        };
        let corners = &self.corners[passed];
        let distance = hit.distance_m * self.scale;
        let is_around = distance <= across.distance_bound(corners) && across.reach(corners).0 <= EPSILON;
        is_around && is_like(self.exact(&hit.spawn(ray.direction)), distance)
    }
}
