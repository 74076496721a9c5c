//! Whether an answer in single precision is right: the exact answer for a ray next to the one that was asked for.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nephroid::eye_pass::renderer::ProbedHit;
use nephroid::geometry::Ray;
use nephroid::scene::Scene;
use nephroid::transport::Tracer;
use rayon::prelude::*;

pub type Answer = Option<ProbedHit>;

/// How far beside the asked ray the answered one may lie, in units in which the scene's radius is 1/2 to 1. With
/// u = 2⁻²⁴, rays that start within 1.2 radii and so at most 2.2 units to go: rounding the origin moves it by u, the
/// corners by u/2, their difference by 2u, and the direction turns by √3·u over 2.2 units; shear, product and
/// difference round to another 8u. Each along both axes of the plane across the ray's main axis: 2⁻¹⁹ = 32u.
pub const EPSILON: f64 = 1.0 / (1 << 19) as f64;

/// What is said of an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// The same triangle, or nothing on both.
    Same {
        /// Of the distance, in scene radii, and as a share of its bound.
        error: f64,
        of_bound: f64,
    },
    /// Another triangle at the same distance, the ray passing both within `aside`.
    Shared { aside: f64 },
    /// One found a triangle that the ray beside the asked one, within `aside`, misses; or the other way round.
    Silhouette { aside: f64 },
    /// The device left out a triangle around the ray's origin: within the bound of its distance it may lie behind.
    Start,
    /// None of these.
    Wrong,
}

/// Tells right from wrong answers.
pub struct Judge {
    tracer: Tracer,
    /// Of the first triangle of each object.
    firsts: Vec<usize>,
    /// In local units.
    corners: Vec<[DVec3; 3]>,
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
    fn flat(&self, corners: &[DVec3; 3]) -> [DVec2; 3] {
        corners.map(|corner| {
            let off = corner - self.origin;
            DVec2::new(off.dot(self.axes[0]), off.dot(self.axes[1]))
        })
    }

    /// From the ray to a triangle; 0 where it goes through.
    fn aside(&self, corners: &[DVec3; 3]) -> f64 {
        let flat = self.flat(corners);
        let sides = [0, 1, 2].map(|i| flat[i].perp_dot(flat[(i + 1) % 3]));
        if sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0) {
            return 0.0;
        }
        self.to_rim(corners).length()
    }

    /// From the ray to the nearest place of a triangle's edges.
    fn to_rim(&self, corners: &[DVec3; 3]) -> DVec2 {
        let flat = self.flat(corners);
        let nearest = |i: usize| {
            let (from, along) = (flat[i], flat[(i + 1) % 3] - flat[i]);
            let share = (-from.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            from + along * share
        };
        let places = [0, 1, 2].map(nearest);
        let by_length = |a: &DVec2, b: &DVec2| a.length_squared().total_cmp(&b.length_squared());
        places.into_iter().min_by(by_length).expect("three edges")
    }

    /// Where along the ray a triangle begins and ends.
    fn reach(&self, corners: &[DVec3; 3]) -> (f64, f64) {
        let along = corners.map(|corner| (corner - self.origin).dot(self.direction));
        (
            along[0].min(along[1]).min(along[2]),
            along[0].max(along[1]).max(along[2]),
        )
    }

    /// Whether a triangle lies about this far along the ray.
    fn is_at(&self, corners: &[DVec3; 3], distance: f64) -> bool {
        let (low, high) = self.reach(corners);
        (low - EPSILON..=high + EPSILON).contains(&distance)
    }

    /// Bound of the error of the distance to a triangle: every corner, and with it every share, moves by EPSILON.
    fn distance_bound(&self, corners: &[DVec3; 3]) -> f64 {
        let (low, high) = self.reach(corners);
        let extent = high - low;
        let [a, b, c] = self.flat(corners);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let narrow = (b - a).perp_dot(c - a).abs() / longest.max(f64::MIN_POSITIVE);
        EPSILON + extent * (3.0 * EPSILON / narrow.max(f64::MIN_POSITIVE)).min(1.0)
    }
}

impl Judge {
    pub fn new(scene: Arc<Scene>) -> Self {
        let tracer = Tracer::new(scene.clone());
        let packed = tracer.bvh().packed();
        let (centre, scale) = (packed.centre, packed.scale);
        let (mut firsts, mut corners) = (Vec::new(), Vec::new());
        for object in &scene.objects {
            firsts.push(corners.len());
            let mesh = &object.mesh;
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
        self.tracer.bvh().bounding_sphere()
    }

    pub fn all(&self, rays: &[Ray], answers: &[Answer]) -> Vec<Verdict> {
        assert_eq!(rays.len(), answers.len());
        rays.par_iter()
            .zip(answers)
            .map(|(ray, answer)| self.verdict(ray, answer))
            .collect()
    }

    /// The processor's answer: triangle and distance in local units.
    fn exact(&self, ray: &Ray) -> Option<(usize, f64)> {
        let hit = self.tracer.closest_place(ray)?;
        let triangle = self.firsts[hit.object as usize] + hit.triangle as usize;
        Some((triangle, hit.distance_m * self.scale))
    }

    fn across(&self, ray: &Ray) -> Across {
        let x = ray.direction.any_orthonormal_vector();
        Across {
            origin: (ray.origin - self.centre) * self.scale,
            direction: ray.direction,
            axes: [x, ray.direction.cross(x)],
        }
    }

    fn verdict(&self, ray: &Ray, answer: &Answer) -> Verdict {
        let across = self.across(ray);
        let exact = self.exact(ray);
        let found = answer.map(|hit| (hit.triangle as usize, hit.distance_m * self.scale));
        let bound = |triangle: usize| across.distance_bound(&self.corners[triangle]);
        let aside = |triangle: usize| across.aside(&self.corners[triangle]);
        match (exact, found) {
            (None, None) => Verdict::Same {
                error: 0.0,
                of_bound: 0.0,
            },
            (Some((a, exact_distance)), Some((b, distance))) if a == b => {
                let error = (distance - exact_distance).abs();
                if error > bound(a) {
                    return Verdict::Wrong;
                }
                Verdict::Same {
                    error,
                    of_bound: error / bound(a),
                }
            }
            _ => {
                if let (Some((a, exact_distance)), Some((b, distance))) = (exact, found) {
                    let aside = aside(a).max(aside(b));
                    if aside <= EPSILON && (exact_distance - distance).abs() <= bound(a) + bound(b) {
                        return Verdict::Shared { aside };
                    }
                }
                self.silhouette(ray, &across, exact, found)
            }
        }
    }

    /// One of the answers is of a triangle that the other one went past.
    fn silhouette(
        &self,
        ray: &Ray,
        across: &Across,
        exact: Option<(usize, f64)>,
        found: Option<(usize, f64)>,
    ) -> Verdict {
        let reached = |hit: Option<(usize, f64)>| hit.map_or(f64::INFINITY, |hit| hit.1);
        let (nearer, is_found) = if reached(found) < reached(exact) {
            (found, true)
        } else {
            (exact, false)
        };
        let Some((triangle, _)) = nearer else {
            return Verdict::Wrong;
        };
        let corners = &self.corners[triangle];
        if is_found {
            // The processor sees past it: without a gap, for it leaves none.
            let aside = across.aside(corners);
            let is_close =
                aside <= EPSILON && found.is_some_and(|(_, distance)| across.is_at(corners, distance));
            return if is_close {
                Verdict::Silhouette { aside }
            } else {
                Verdict::Wrong
            };
        }
        // The device went past it: so must a ray beside this one on the processor, and meet what the device met.
        let rings = [(16, 0.05), (64, 0.2), (256, 0.5), (512, 1.0)];
        let offsets = rings.into_iter().flat_map(|(steps, share)| {
            (0..steps).map(move |step| {
                let turn = std::f64::consts::TAU * f64::from(step) / f64::from(steps);
                DVec2::from_angle(turn) * (share * EPSILON)
            })
        });
        let is_like = |beside: Option<(usize, f64)>, passed: f64| match (beside, found) {
            (None, None) => true,
            (Some((a, _)), Some((b, _))) if a == b => true,
            (Some((_, at)), Some((b, distance))) => {
                (passed + at - distance).abs() <= across.distance_bound(&self.corners[b])
            }
            _ => false,
        };
        let answers_beside = |offset: &DVec2| {
            let moved = (across.axes[0] * offset.x + across.axes[1] * offset.y) / self.scale;
            let beside = Ray {
                origin: ray.origin + moved,
                direction: ray.direction,
            };
            is_like(self.exact(&beside), 0.0)
        };
        if let Some(offset) = offsets.clone().find(answers_beside) {
            return Verdict::Silhouette {
                aside: offset.length(),
            };
        }
        // Around the origin it may have been behind: then the device met what comes next.
        let Some(hit) = self.tracer.closest_hit(ray) else {
            return Verdict::Wrong;
        };
        let passed = hit.distance_m * self.scale;
        let is_around = passed <= across.distance_bound(corners) && across.reach(corners).0 <= EPSILON;
        if is_around && is_like(self.exact(&hit.spawn(ray.direction)), passed) {
            return Verdict::Start;
        }
        Verdict::Wrong
    }

    /// An answer with all that belongs to it, for people.
    pub fn tell(&self, ray: &Ray, answer: &Answer) -> String {
        let across = self.across(ray);
        let exact = self.exact(ray);
        let found = answer.map(|hit| (hit.triangle as usize, hit.distance_m * self.scale));
        let details = [exact, found].into_iter().flatten().map(|(triangle, _)| {
            let corners = &self.corners[triangle];
            format!(
                "; {triangle}: {:?}, {:.2e} aside, {:.2e} to its rim, distance known to {:.2e}",
                corners,
                across.aside(corners),
                across.to_rim(corners).length(),
                across.distance_bound(corners),
            )
        });
        let details: String = details.collect();
        format!("{ray:?}: {found:?} instead of {exact:?}{details}")
    }
}
