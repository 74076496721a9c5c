//! Targets of photons from an extended light: bounding spheres of specular surfaces as seen from each point of the
//! light, narrowed by where pilot photons hit.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::launch::{LAMP_DIMENSION, LAMP_MIDDLE};
use crate::geometry::Ray;
use crate::geometry::sampling::{even_code, even_point, in_square, unfolded};
use crate::scene::emitter::{Emitter, EmitterKind, EmitterSampler, in_cap_across, on_disc};
use crate::scene::{Light, Scene};
use crate::transport::Tracer;

/// Maximum number of spheres per light.
const MAX_SPHERES: usize = 16;

/// Cells along each side of the square from which directions towards a sphere, or points on its disc, are drawn: a
/// power of 2.
const SIDE: usize = 32;
const CELLS: usize = SIDE * SIDE;

/// Pilot photons that find out which cells see specular surfaces.
const PROBES: u32 = 1 << 16;

/// Their seed. No bake shares it, so that bakes stay unbiased.
const PROBE_SEED: u64 = 0x7072_6f62_6573;

/// Density of photons in a cell without hits, relative to one with hits.
const RARE: f64 = 1.0 / 16.0;

/// Directions are opposite if one plus the cosine between them is less.
const OPPOSITE: f64 = 1e-6;

/// A point of a lamp, as rays are aimed from it.
pub struct LampPoint {
    /// The point or, of a ball of light, its centre.
    pub emitter: Emitter,
    ball: Option<BallPoint>,
}

/// A point of the disc as which a ball of light is seen from afar.
#[derive(Clone, Copy)]
struct BallPoint {
    radius_m: f64,
    /// In the unit disc.
    place: DVec2,
}

impl LampPoint {
    /// By a point of the lamp's unit square; `None` if it emits nothing.
    pub fn of(places: &EmitterSampler, square: DVec2) -> Option<Self> {
        let ball = places.disc_radius_m().map(|radius_m| BallPoint {
            radius_m,
            place: on_disc(square),
        });
        let emitter = if ball.is_some() {
            places.middle()
        } else {
            places.sample(square)
        };
        Some(Self {
            emitter: emitter?,
            ball,
        })
    }
}

impl BallPoint {
    /// The line through a point in some direction [m] from the ball's centre, and through the disc that is seen from
    /// there. Also the measure of lines relative to that of directions from the centre to such points, times the ball's
    /// cross-section: a ball of even radiance shines evenly along all lines that meet it.
    ///
    /// `across` is any vector across these directions, roughly.
    fn line_to(&self, centre: DVec3, (direction, distance_m): (DVec3, f64), across: DVec3) -> (Ray, f64) {
        // Lines from the point that touch the ball meet the plane through its centre in a circle that is a little wider
        // than the ball.
        let slope = self.radius_m / distance_m;
        let wider = 1.0 / (1.0 - slope * slope).sqrt();
        let x = across.reject_from_normalized(direction).try_normalize();
        let x = x.unwrap_or_else(|| direction.any_orthonormal_vector());
        let place = self.place * (self.radius_m * wider);
        let offset = x * place.x + direction.cross(x) * place.y;
        let ahead = (direction * distance_m - offset).normalize();

        // Of area on the far sphere and of the plane, a line sees the cosine; the solid angle of the plane's area falls
        // with the squared distance.
        let cosine2 = distance_m.powi(2) / (distance_m.powi(2) + place.length_squared());
        let measure = (wider * cosine2).powi(2);

        // It starts where it leaves the ball.
        let nearest = offset - ahead * offset.dot(ahead);
        let half_chord_m = (self.radius_m.powi(2) - nearest.length_squared()).max(0.0).sqrt();
        let ray = Ray {
            origin: centre + nearest + ahead * half_chord_m,
            direction: ahead,
        };
        (ray, measure)
    }
}

/// Bounding spheres of specular surfaces.
#[derive(Clone, Debug, Default)]
pub struct Spheres(Vec<GuidedSphere>);

/// A sphere with the distribution of its photons.
#[derive(Clone, Debug)]
struct GuidedSphere {
    sphere: Sphere,
    /// Towards it from the middle of the lamp.
    axis: DVec3,
    /// Density summed over the cells before each along Morton's curve; full density in all cells sums to 1.
    before: Vec<f64>,
}

impl Spheres {
    /// Bounding spheres of casters, for a light of unit strength.
    pub fn around(tracer: &Tracer, light: &Light, casters: &[usize]) -> Self {
        let spheres = spheres(tracer.scene(), casters, MAX_SPHERES);
        let evenly = |sphere| GuidedSphere::new(sphere, DVec3::Z, |_| 1.0);
        let even = Self(spheres.into_iter().map(evenly).collect());
        let places = even.places(light, tracer.scene());
        let middle = LampPoint::of(&places, LAMP_MIDDLE);
        let (low, high) = tracer.scene().bounds().unwrap_or_default();
        let across_m = (high - low).length();
        let meets = |index: u32| {
            let point = LampPoint::of(&places, even_point(index, LAMP_DIMENSION, PROBE_SEED))?;
            let (ray, choice) = even.choose(&point, even_code(index, PROBE_SEED), across_m)?;
            let hit = tracer.closest_hit(&ray)?;
            let surface = tracer.scene().material_of(hit.object).surface;
            surface.is_specular().then_some((choice.which, choice.cell))
        };
        let met: Vec<(usize, usize)> = (0..PROBES).into_par_iter().filter_map(meets).collect();
        let met: BTreeSet<(usize, [u32; 2])> = met.into_iter().flat_map(with_neighbours).collect();
        let guided = even.0.into_iter().enumerate().map(|(which, guided)| {
            let axis = middle.as_ref().map(|lamp| guided.sphere.axis(&lamp.emitter));
            GuidedSphere::new(guided.sphere, axis.unwrap_or(DVec3::Z), |cell| {
                if met.contains(&(which, unfolded(cell as u64))) {
                    1.0
                } else {
                    RARE
                }
            })
        });
        Self(guided.collect())
    }

    /// Points of a light that shines on the spheres.
    pub fn places<'a>(&self, light: &'a Light, scene: &'a Scene) -> EmitterSampler<'a> {
        let spheres = self.0.iter().map(|guided| &guided.sphere);
        let spheres = spheres.map(|sphere| (sphere.centre, sphere.radius_m));
        EmitterSampler::new(light, scene).towards(spheres)
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Solid angle that a point of a lamp illuminates towards the spheres [sr], or their cross-section in parallel
    /// light [m²].
    pub fn measure(&self, lamp: &LampPoint) -> f64 {
        self.0.iter().map(|guided| guided.sphere.measure(lamp)).sum()
    }

    /// A ray from a point of a lamp towards one of the spheres, and the measure [sr or m²] that it represents. `None`
    /// also if the ray could have been aimed at an earlier sphere, to which it then belongs.
    pub fn aim(&self, lamp: &LampPoint, place: u64, across_m: f64) -> Option<(Ray, f64)> {
        let (ray, choice) = self.choose(lamp, place, across_m)?;
        Some((ray, choice.measure))
    }

    pub(super) fn sphere_count(&self) -> usize {
        self.0.len()
    }

    /// A ray from a point of a lamp through a point of a sphere's unit square, and the measure [sr or m²] of that square.
    /// `None` if nothing is emitted towards the sphere, or the ray belongs to an earlier one.
    pub(super) fn aim_at(
        &self,
        lamp: &LampPoint,
        which: usize,
        square: DVec2,
        across_m: f64,
    ) -> Option<(Ray, f64)> {
        let measure = self.0.get(which)?.sphere.measure(lamp);
        if !(measure > 0.0 && measure.is_finite()) {
            return None;
        }
        let (ray, share) = self.ray(lamp, which, square, across_m)?;
        Some((ray, measure * share))
    }

    fn choose(&self, lamp: &LampPoint, place: u64, across_m: f64) -> Option<(Ray, Choice)> {
        let mut choice = self.cell(lamp, place)?;
        let (ray, share) = self.ray(lamp, choice.which, in_square(choice.place), across_m)?;
        choice.measure *= share;
        Some((ray, choice))
    }

    /// From a point of a lamp through a point of a sphere's square, and the share of the square's measure that it stands
    /// for; `None` if the ray belongs to an earlier sphere.
    fn ray(&self, lamp: &LampPoint, which: usize, square: DVec2, across_m: f64) -> Option<(Ray, f64)> {
        let guided = &self.0[which];
        let sphere = &guided.sphere;
        let is_taken = |ray: &Ray| {
            let mut earlier = self.0[..which].iter().map(|guided| &guided.sphere);
            earlier.any(|sphere| sphere.has(ray, &lamp.emitter) && sphere.measure(lamp) > 0.0)
        };
        let ray = match lamp.emitter.kind {
            EmitterKind::Parallel { direction } => {
                let (x, y) = guided.across(direction);
                let offset = on_disc(square) * sphere.radius_m;
                Ray {
                    origin: sphere.centre + x * offset.x + y * offset.y - direction * across_m,
                    direction,
                }
            }
            EmitterKind::Point { position }
            | EmitterKind::Spot { position, .. }
            | EmitterKind::Facet { position, .. } => {
                let axis = sphere.axis(&lamp.emitter);
                let half_angle_rad = sphere.half_angle_rad(position, lamp.ball);
                let direction = in_cap_across(axis, guided.across(axis), half_angle_rad, square);
                if let Some(ball) = lamp.ball {
                    let distance_m = position.distance(sphere.centre);
                    let across = axis.any_orthonormal_vector();
                    let (ray, share) = ball.line_to(position, (direction, distance_m), across);
                    // Lines that miss the sphere may meet another one, and then are aimed at it.
                    return (sphere.has(&ray, &lamp.emitter) && !is_taken(&ray)).then_some((ray, share));
                }
                Ray {
                    origin: position,
                    direction,
                }
            }
        };
        (!is_taken(&ray)).then_some((ray, 1.0))
    }

    fn cell(&self, lamp: &LampPoint, place: u64) -> Option<Choice> {
        let mut measures = [0.0; MAX_SPHERES];
        for (measure, guided) in measures.iter_mut().zip(&self.0) {
            *measure = guided.sphere.measure(lamp) * guided.before[CELLS];
        }
        let total: f64 = measures.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut left = place as f64 * (-64_f64).exp2() * total;
        let mut which = 0;
        while which + 1 < self.0.len() && left >= measures[which] {
            left -= measures[which];
            which += 1;
        }
        while measures[which] <= 0.0 {
            which = which.checked_sub(1)?;
        }
        let before = &self.0[which].before;
        let along = (left / measures[which]).clamp(0.0, 1.0 - f64::EPSILON) * before[CELLS];
        let cell = before[1..CELLS].partition_point(|&before| before <= along);
        let density = (before[cell + 1] - before[cell]) * CELLS as f64;
        let rest = ((along - before[cell]) * CELLS as f64 / density).clamp(0.0, 1.0 - f64::EPSILON);
        Some(Choice {
            which,
            cell,
            place: ((cell as f64 + rest) / CELLS as f64 * 64_f64.exp2()) as u64,
            measure: total / density,
        })
    }
}

/// The sample that a place along the curve of all spheres selects.
struct Choice {
    /// Index of the sphere.
    which: usize,
    /// Cell of the sphere's square, along Morton's curve.
    cell: usize,
    /// Place along the curve of the sphere's square, [0, 2⁶⁴).
    place: u64,
    /// Measure that a photon represents [sr or m²].
    measure: f64,
}

/// A cell of a sphere and its neighbours: pilot photons may have passed beside small objects.
fn with_neighbours((which, cell): (usize, usize)) -> impl Iterator<Item = (usize, [u32; 2])> {
    let [column, row] = unfolded(cell as u64);
    let near = |index: u32| index.saturating_sub(1)..=(index + 1).min(SIDE as u32 - 1);
    near(column).flat_map(move |column| near(row).map(move |row| (which, [column, row])))
}

impl GuidedSphere {
    fn new(sphere: Sphere, axis: DVec3, density: impl Fn(usize) -> f64) -> Self {
        let mut before = vec![0.0; CELLS + 1];
        for cell in 0..CELLS {
            before[cell + 1] = before[cell] + density(cell) / CELLS as f64;
        }
        Self { sphere, axis, before }
    }

    /// Two vectors across a direction. From other points of the lamp they are turned as little as can be, so that rays
    /// through one point of the square cross each other near the sphere.
    fn across(&self, direction: DVec3) -> (DVec3, DVec3) {
        let (x, y) = self.axis.any_orthonormal_pair();
        let both = 1.0 + self.axis.dot(direction);
        if both < OPPOSITE {
            return direction.any_orthonormal_pair();
        }
        let turned = |side: DVec3| side - (self.axis + direction) * (side.dot(direction) / both);
        (turned(x), turned(y))
    }
}

#[derive(Clone, Copy, Debug)]
struct Sphere {
    centre: DVec3,
    radius_m: f64,
}

impl Sphere {
    /// Direction in which an emitter shines on its centre.
    fn axis(&self, emitter: &Emitter) -> DVec3 {
        match emitter.kind {
            EmitterKind::Parallel { direction } => direction,
            EmitterKind::Point { position }
            | EmitterKind::Spot { position, .. }
            | EmitterKind::Facet { position, .. } => (self.centre - position).normalize_or(DVec3::Z),
        }
    }

    /// Solid angle that an emitter illuminates towards the sphere [sr], or its cross-section in parallel light [m²].
    fn measure(&self, lamp: &LampPoint) -> f64 {
        let LampPoint { emitter, ball } = lamp;
        let Some(position) = emitter.kind.position() else {
            return std::f64::consts::PI * self.radius_m * self.radius_m;
        };
        let towards = self.centre - position;
        if let EmitterKind::Facet { normal, .. } = emitter.kind
            && towards.dot(normal) < -self.radius_m
        {
            return 0.0;
        }
        let half_angle_rad = self.half_angle_rad(position, *ball);
        if let EmitterKind::Spot {
            direction,
            outer_cone_rad,
            ..
        } = emitter.kind
            && towards.angle_between(direction) > half_angle_rad + outer_cone_rad
        {
            return 0.0;
        }
        cap_sr(half_angle_rad)
    }

    /// Half-angle of the cone around the sphere [rad]; π from inside. From a ball of light that is far away, that of the
    /// points which its lines towards the sphere pass at the distance of the sphere's centre.
    fn half_angle_rad(&self, position: DVec3, ball: Option<BallPoint>) -> f64 {
        let distance_m = position.distance(self.centre);
        let ball_m = ball.map_or(0.0, |ball| ball.radius_m);
        if distance_m > self.radius_m + ball_m {
            // A line in the steepest direction starts at the rim of the ball, and so turns back by as much as that is
            // aside.
            ((self.radius_m + ball_m) / distance_m).asin() - (ball_m / distance_m).asin()
        } else {
            std::f64::consts::PI
        }
    }

    /// Whether a ray of an emitter may have been aimed at the sphere.
    fn has(&self, ray: &Ray, emitter: &Emitter) -> bool {
        let towards = self.centre - ray.origin;
        if emitter.kind.position().is_none() {
            let beside = towards - ray.direction * towards.dot(ray.direction);
            return beside.length_squared() <= self.radius_m * self.radius_m;
        }
        let along = towards.dot(ray.direction);
        let distance2 = towards.length_squared();
        let radius2 = self.radius_m * self.radius_m;
        distance2 <= radius2 || (along > 0.0 && distance2 - along * along <= radius2)
    }
}

/// Solid angle of a cone [sr].
fn cap_sr(half_angle_rad: f64) -> f64 {
    4.0 * std::f64::consts::PI * (0.5 * half_angle_rad).sin().powi(2)
}

/// Bounding spheres of objects: one each, or one for each group of neighbours if there are more objects than `most`.
fn spheres(scene: &Scene, objects: &[usize], most: usize) -> Vec<Sphere> {
    let mut bounded: Vec<(usize, DVec3)> = objects
        .iter()
        .filter_map(|&object| {
            let (low, high) = scene.objects[object].bounds()?;
            Some((object, low * 0.5 + high * 0.5))
        })
        .collect();
    let mut found = Vec::new();
    divide(scene, &mut bounded, most, &mut found);
    found
}

fn divide(scene: &Scene, objects: &mut [(usize, DVec3)], most: usize, found: &mut Vec<Sphere>) {
    if objects.is_empty() {
        return;
    }
    if objects.len() == 1 || most <= 1 {
        found.extend(around(scene, objects));
        return;
    }
    let centres = || objects.iter().map(|(_, centre)| *centre);
    let low = centres().fold(DVec3::INFINITY, DVec3::min);
    let high = centres().fold(DVec3::NEG_INFINITY, DVec3::max);
    let axis = (high - low).max_position();
    objects.sort_by(|a, b| a.1[axis].total_cmp(&b.1[axis]).then(a.0.cmp(&b.0)));
    let (first, second) = objects.split_at_mut(objects.len() / 2);
    divide(scene, first, most / 2, found);
    divide(scene, second, most - most / 2, found);
}

fn around(scene: &Scene, objects: &[(usize, DVec3)]) -> Option<Sphere> {
    let vertices = || {
        objects
            .iter()
            .flat_map(|(object, _)| scene.objects[*object].in_scene().positions())
    };
    let low = vertices().fold(DVec3::INFINITY, |low, position| low.min(position));
    let high = vertices().fold(DVec3::NEG_INFINITY, |high, position| high.max(position));
    let centre = low * 0.5 + high * 0.5;
    let radius_m = vertices()
        .map(|position| position.distance(centre))
        .fold(0.0, f64::max);
    // Slightly enlarged, so that rounding loses nothing at the rim.
    (radius_m > 0.0 && radius_m.is_finite()).then_some(Sphere {
        centre,
        radius_m: radius_m * (1.0 + 1e-9),
    })
}
