//! Points of emissive objects, sampled where they shine.

use glam::{DVec2, DVec3};

use super::{GlowPart, InScene, LightKind, LightSize, PanelShape, Scene};
use crate::geometry::ray;
use crate::optics::LinearSrgb;
use crate::units::{Radiance, RadiantIntensity};

/// An emissive object, prepared for many samples.
#[derive(Debug)]
pub(super) struct GlowSampler<'a> {
    mesh: InScene<'a>,
    pub(super) both_sides: bool,
    /// 1 for the front, or −1 if only the back counts.
    side: f64,
    /// If it is evenly bright, and its two triangles are one.
    pub(super) parallelogram: Option<Parallelogram>,
    /// Cumulative area of the triangles or their parts, weighted by brightness, each inclusive [m²].
    upto_m2: Vec<f64>,
    /// If an emission texture decides where light starts.
    image: Option<GlowImage<'a>>,
    /// Of one side [m²].
    area_m2: f64,
    /// See [`EmitterSampler::bright_area_m2`](super::emitter::EmitterSampler::bright_area_m2).
    pub(super) bright_area_m2: f64,
}

/// A point of an emissive object.
pub(super) struct GlowPoint {
    /// [m].
    pub(super) position: DVec3,
    /// Unit, on the side that shines.
    pub(super) normal: DVec3,
    /// With an emission texture: the radiance there relative to its mean, divided by the relative sampling density.
    pub(super) brightness: Option<LinearSrgb>,
}

/// The image of an emissive object.
#[derive(Debug)]
struct GlowImage<'a> {
    scene: &'a Scene,
    object: usize,
    /// Parts to sample by; `None` for triangles by their area.
    parts: Option<&'a [GlowPart]>,
}

impl<'a> GlowSampler<'a> {
    /// `None` if it has no area.
    pub(super) fn new(scene: &'a Scene, object: usize, is_even: bool) -> Option<Self> {
        let mesh = scene.objects.get(object)?.in_scene();
        let glow = scene.glows.get(&object);
        let parts = glow.map(|glow| &*glow.parts).filter(|_| !is_even);
        let both_sides = scene.material_of(object).double_sided;

        // Areas of triangles or their parts, with their weights.
        let area_m2 = |triangle: usize| mesh.triangle_area_m2(triangle);
        let areas_m2: Vec<(f64, f64)> = match parts {
            Some(parts) => parts
                .iter()
                .map(|part| (area_m2(part.triangle as usize) * part.share(), part.weight))
                .collect(),
            None => (0..mesh.triangle_count())
                .map(|triangle| (area_m2(triangle), 1.0))
                .collect(),
        };
        let (mut sum_m2, mut sum_of_squares_m2) = (0.0, 0.0);
        let mut upto_m2 = Vec::with_capacity(areas_m2.len());
        for (area_m2, weight) in areas_m2 {
            sum_m2 += area_m2 * weight;
            sum_of_squares_m2 += area_m2 * weight * weight;
            upto_m2.push(sum_m2);
        }
        (sum_m2 > 0.0).then(|| Self {
            mesh,
            both_sides,
            side: 1.0,
            parallelogram: glow.is_none().then(|| Parallelogram::of(mesh)).flatten(),
            upto_m2,
            image: glow.map(|_| GlowImage { scene, object, parts }),
            area_m2: mesh.area_m2(),
            bright_area_m2: sum_m2 * sum_m2 / sum_of_squares_m2 * if both_sides { 2.0 } else { 1.0 },
        })
    }

    fn total_m2(&self) -> f64 {
        self.upto_m2.last().copied().unwrap_or(0.0)
    }

    /// Over all emitting sides [m²].
    pub(super) fn area_m2(&self) -> f64 {
        self.area_m2 * if self.both_sides { 2.0 } else { 1.0 }
    }

    /// See [`EmitterSampler::towards`](super::emitter::EmitterSampler::towards).
    pub(super) fn choose_side(&mut self, mut spheres: impl Iterator<Item = (DVec3, f64)>) {
        if !self.both_sides || self.parallelogram.is_none() {
            return;
        }
        let (normal, corner) = (self.mesh.face_normal(0), self.mesh.corners(0)[0]);
        let side = |(centre, radius_m): (DVec3, f64)| {
            let height_m = (centre - corner).dot(normal);
            (height_m.abs() >= radius_m).then(|| height_m.signum())
        };
        let Some(first) = spheres.next().and_then(side) else {
            return;
        };
        if spheres.all(|sphere| side(sphere) == Some(first)) {
            (self.both_sides, self.side) = (false, first);
        }
    }

    /// Samples a point of the surface, with parts in proportion to their brightness.
    pub(super) fn sample(&self, mut square: DVec2) -> Option<GlowPoint> {
        let mut side = self.side;
        if self.both_sides {
            square.y *= 2.0;
            if square.y >= 1.0 {
                (side, square.y) = (-side, square.y - 1.0);
            }
        }
        let (triangle, barycentric, weight) = match &self.parallelogram {
            Some(parallelogram) => {
                let (triangle, barycentric) = parallelogram.at(square);
                (triangle, barycentric, 1.0)
            }
            None => self.place(square)?,
        };
        let (point, error) = ray::point_with_error(&self.mesh.corners(triangle), barycentric);
        let normal = self.mesh.face_normal(triangle) * side;
        let position = ray::offset_origin(point, error, normal, normal);
        let brightness = self.image.as_ref().map(|image| {
            let density = weight * self.area_m2 / self.total_m2();
            image.scene.glow_at(image.object, triangle, barycentric) / density
        });
        Some(GlowPoint {
            position,
            normal,
            brightness,
        })
    }

    /// Lamps that shine from afar as it does at a mean radiance: a panel for each side of a parallelogram, else a ball
    /// around it, which sends as much light in all directions. `has_inside`: its other side faces its inside.
    pub(super) fn stand_ins(&self, radiance: Radiance, has_inside: bool) -> Vec<(LightKind, LightSize)> {
        let Some(parallelogram) = self.parallelogram else {
            let Some((low, high)) = self.mesh.bounds() else {
                return Vec::new();
            };
            // The mean of a convex body's projected area is a quarter of its surface; what its inside sends stays there.
            let area_m2 = if has_inside { self.area_m2 } else { self.area_m2() };
            let ball = LightKind::Point {
                position: 0.5 * (low + high),
                intensity: RadiantIntensity(0.25 * radiance.0 * area_m2),
            };
            let radius_m = 0.5 * (high - low).max_element();
            return vec![(ball, LightSize::Radius { radius_m })];
        };
        let normal = self.mesh.face_normal(0) * self.side;
        let [centre, across, down] = parallelogram.half_axes(self.mesh);
        let front = across * across.cross(down).dot(normal).signum();
        let sides: &[f64] = if self.both_sides { &[1.0, -1.0] } else { &[1.0] };
        let panel = |side: &f64| {
            let shape = PanelShape::Rectangle;
            let across = front * *side;
            (
                LightKind::Panel {
                    centre,
                    across,
                    down,
                    shape,
                    radiance,
                },
                LightSize::None,
            )
        };
        sides.iter().map(panel).collect()
    }

    /// A triangle, a point in it, and the weight of its part.
    fn place(&self, square: DVec2) -> Option<(usize, [f64; 3], f64)> {
        // Parts of no weight are never chosen, trailing ones included.
        let wanted_m2 = square.x * self.total_m2();
        let end = self.upto_m2.partition_point(|upto| *upto < self.total_m2());
        let chosen = self.upto_m2.partition_point(|upto| *upto <= wanted_m2).min(end);
        let before_m2 = chosen.checked_sub(1).map_or(0.0, |before| self.upto_m2[before]);
        let share = ((wanted_m2 - before_m2) / (self.upto_m2.get(chosen)? - before_m2)).clamp(0.0, 1.0);

        // Uniform over the part.
        let root = share.sqrt();
        let within = [1.0 - root, root * (1.0 - square.y), root * square.y];
        let parts = self.image.as_ref().and_then(|image| image.parts);
        Some(match parts.map(|parts| &parts[chosen]) {
            Some(part) => (part.triangle as usize, part.barycentric(within), part.weight),
            None => (chosen, within, 1.0),
        })
    }
}

/// Deviation from a parallelogram that rounding explains, relative to its diagonal.
const FLAT: f64 = 1e-6;

/// Two triangles that are a parallelogram: by triangle, which of its corners is at the start of the shared edge, at the
/// parallelogram's own corner, and at the end of the shared edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parallelogram([[usize; 3]; 2]);

impl Parallelogram {
    /// `None` for other meshes.
    fn of(mesh: InScene) -> Option<Self> {
        if mesh.triangle_count() != 2 {
            return None;
        }
        let [first, second] = [0, 1].map(|triangle| mesh.corners(triangle));
        let turns = || (0..3).map(|turn| [turn, (turn + 1) % 3, (turn + 2) % 3]);
        for one in turns() {
            for other in turns() {
                // From start to end on the one triangle, and from end to start on the other.
                let [start, own, end] = one.map(|corner| first[corner]);
                let [end_there, own_there, start_there] = other.map(|corner| second[corner]);
                let most_m = FLAT * (end - start).length();
                let is_same = |a: DVec3, b: DVec3| a.distance(b) <= most_m;
                let fits = is_same(start, start_there)
                    && is_same(end, end_there)
                    && is_same(start + end, own + own_there);
                if fits && most_m > 0.0 {
                    let [end, own, start] = other;
                    return Some(Self([one, [start, own, end]]));
                }
            }
        }
        None
    }

    /// Its centre, and from there to the middles of two sides [m].
    fn half_axes(self, mesh: InScene) -> [DVec3; 3] {
        let corners = mesh.corners(0);
        let [start, own, end] = self.0[0].map(|corner| corners[corner]);
        [0.5 * (start + end), 0.5 * (own - start), 0.5 * (end - own)]
    }

    /// Uniform: a triangle and a point in it, by a point of the unit square.
    fn at(self, square: DVec2) -> (usize, [f64; 3]) {
        let (triangle, low, high) = if square.y <= square.x {
            (0, square.y, square.x)
        } else {
            (1, square.x, square.y)
        };
        // Along the diagonal from start to end, and aside towards the triangle's own corner.
        let [start, own, end] = self.0[triangle];
        let mut barycentric = [0.0; 3];
        barycentric[start] = 1.0 - high;
        barycentric[own] = high - low;
        barycentric[end] = low;
        (triangle, barycentric)
    }
}
