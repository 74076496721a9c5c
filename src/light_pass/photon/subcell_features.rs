//! Bodies and openings smaller than the first squares of the launch domain, which all their points would miss.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::slits::{Slit, narrow_openings};
use crate::geometry::Ray;
use crate::geometry::enclosure::Bounds;
use crate::light_pass::item_buffer::{self, CELLS_PER_SIDE, ItemBuffer};
use crate::light_pass::launch::Launch;
use crate::transport::Tracer;

/// A body is small while it is less than this many squares across.
const SMALL_SQUARES: f64 = 2.0;

/// Squares across small bodies after division: casters, and those that only occlude.
const SQUARES_ACROSS: [f64; 2] = [2.0, 8.0];

/// Most divisions of a square for a body in it.
const DEEPEST_BODY_LEVEL: u32 = 18;

/// Bounding sphere of an object, or a capsule around a part of a slit.
#[derive(Clone, Copy, Debug)]
struct Body {
    /// Ends of the capsule's line [m]; equal for a sphere.
    ends: [DVec3; 2],
    /// [m].
    radius_m: f64,
    /// Squares across it after division.
    squares_across: f64,
}

impl Body {
    /// With `across` squares across the opening.
    fn of(opening: &Slit, across: f64) -> Self {
        Self {
            ends: opening.ends,
            radius_m: opening.width_m,
            squares_across: 2.0 * across,
        }
    }

    fn bounds(&self) -> Bounds {
        let [a, b] = self.ends;
        (a.min(b) - self.radius_m, a.max(b) + self.radius_m)
    }

    /// Point of its line that is nearest to the line of a ray [m].
    fn nearest(&self, ray: &Ray) -> DVec3 {
        let [a, b] = self.ends;
        let along = |v: DVec3| v - ray.direction * ray.direction.dot(v);
        let (line, start) = (along(b - a), along(a - ray.origin));
        let share = -start.dot(line) / line.length_squared();
        if share.is_finite() {
            a.lerp(b, share.clamp(0.0, 1.0))
        } else {
            a
        }
    }
}

/// Bodies by cells of the item buffer: face, column, row.
type Bins = HashMap<(u32, u32, u32), Vec<Body>>;

/// Small bodies and openings as one light sees them.
#[derive(Clone, Debug, Default)]
pub struct SubcellFeatures(Bins);

impl SubcellFeatures {
    /// Objects that are small relative to squares of the given size in the unit square, and narrow openings. Both only
    /// where they can deflect light or occlude it, according to `visible`.
    pub fn find(tracer: &Tracer, launch: &Launch, visible: &ItemBuffer, square: DVec2) -> Self {
        // Squares are measured in the middle of the domain, at the distance of the body.
        let scene = tracer.scene();
        let middle = DVec2::splat(0.5);
        let origin = launch.ray(0, middle).origin;
        let is_small = |body: &Body| {
            let width_m = launch
                .cell_area_at_m2(middle, middle + square, origin.distance(body.ends[0]))
                .sqrt();
            body.radius_m > 0.0 && 2.0 * body.radius_m < SMALL_SQUARES * width_m
        };

        // Objects, as their bounding spheres, are booked in all cells of the item buffer that may see them.
        let mut bodies = Bins::default();
        for (index, object) in scene.objects.iter().enumerate() {
            let Some((low, high)) = object.bounds() else {
                continue;
            };
            let occludes_only = !scene.material_of(index).surface.is_specular();
            let body = Body {
                ends: [low * 0.5 + high * 0.5; 2],
                radius_m: 0.5 * (high - low).length(),
                squares_across: SQUARES_ACROSS[usize::from(occludes_only)],
            };
            // The cheap test first: the other one searches the scene.
            if is_small(&body) && visible.may_concern(launch, tracer, index) {
                book(launch, (low, high), body, &mut bodies);
            }
        }

        // Narrow openings let light through between points that all meet what surrounds them.
        let (openings, across) = narrow_openings(tracer, launch, visible, square);
        for opening in &openings {
            let body = Body::of(opening, across);
            book(launch, body.bounds(), body, &mut bodies);
        }
        Self(bodies)
    }

    /// Whether a square of a face, between two corners of the unit square, may contain a body or an opening too small
    /// for it; `level` is how often it was divided for such features.
    pub fn ask_for_finer(
        &self,
        launch: &Launch,
        face: usize,
        (low, high): (DVec2, DVec2),
        level: u32,
    ) -> bool {
        if level >= DEEPEST_BODY_LEVEL || self.0.is_empty() {
            return false;
        }
        let beam = SquareBeam::new(launch, face, (low, high));
        // Slightly larger than the square: bodies reach beyond the bins that they are booked in.
        let margin = (high - low) * 0.5;
        bins_between(face, (low - margin, high + margin)).any(|bin| {
            let booked = self.0.get(&bin).into_iter().flatten();
            booked
                .filter_map(|body| Some((body, beam.reach_at_m(body)?)))
                .any(|(body, reach_m)| body.squares_across * reach_m > 2.0 * body.radius_m)
        })
    }
}

/// Beam of a square: its middle ray and those through its corners.
struct SquareBeam {
    middle: Ray,
    corners: [Ray; 4],
}

impl SquareBeam {
    fn new(launch: &Launch, face: usize, (low, high): (DVec2, DVec2)) -> Self {
        Self {
            middle: launch.ray(face, (low + high) * 0.5),
            corners: [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)]
                .map(|corner| launch.ray(face, corner)),
        }
    }

    fn along_m(&self, point: DVec3) -> f64 {
        (point - self.middle.origin).dot(self.middle.direction)
    }

    /// Half the width of the beam at a distance [m].
    fn reach_m(&self, along_m: f64) -> f64 {
        let centre = self.middle.at(along_m);
        let corners = self.corners.iter();
        corners
            .map(|corner| corner.at(along_m).distance(centre))
            .fold(0.0, f64::max)
    }

    /// Half the width of the beam at a body that it may contain [m]; `None` if it cannot.
    fn reach_at_m(&self, body: &Body) -> Option<f64> {
        let nearest = body.nearest(&self.middle);
        let along_m = self.along_m(nearest);
        if along_m <= -body.radius_m {
            return None;
        }
        let along_m = along_m.max(0.0);
        let centre = self.middle.at(along_m);
        let reach_m = self.reach_m(along_m);
        (centre.distance(nearest) <= body.radius_m + 1.5 * reach_m).then_some(reach_m)
    }
}

/// Adds a body to all cells of the item buffer that its bounding box may touch.
fn book(launch: &Launch, bounds: Bounds, body: Body, bins: &mut Bins) {
    for face in 0..launch.face_count() {
        let Some((columns, rows)) = item_buffer::cells_towards(launch, face, bounds) else {
            continue;
        };
        for row in rows.0..=rows.1 {
            for column in columns.0..=columns.1 {
                let bin = (face as u32, column as u32, row as u32);
                bins.entry(bin).or_default().push(body);
            }
        }
    }
}

fn bins_between(face: usize, (low, high): (DVec2, DVec2)) -> impl Iterator<Item = (u32, u32, u32)> {
    let side = CELLS_PER_SIDE as f64;
    let cell = move |share: f64| ((share * side).max(0.0) as usize).min(CELLS_PER_SIDE - 1) as u32;
    let columns = cell(low.x)..=cell(high.x);
    (cell(low.y)..=cell(high.y))
        .flat_map(move |row| columns.clone().map(move |column| (face as u32, column, row)))
}
