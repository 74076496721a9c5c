//! Bodies, openings and sharp corners smaller than the cells of a lattice, which the corners of the cells would miss.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::edge_search::EdgeSearch;
use super::slits::{Slit, narrow_openings};
use crate::geometry::Ray;
use crate::geometry::enclosure::Bounds;
use crate::light_pass::item_buffer::{self, CELLS_PER_SIDE, ItemBuffer};
use crate::light_pass::launch::Launch;
use crate::transport::Tracer;

/// A body is small while it is less than this many cells across.
const SMALL_CELLS: f64 = 2.0;

/// Cells across small bodies that only occlude: enough to find their silhouettes.
const CELLS_ACROSS_OTHERS: f64 = 8.0;

/// Most divisions of a cell for a body in it.
const DEEPEST_BODY_LEVEL: u32 = 18;

/// Cells across each of very many casters: enough for their flux.
const MIN_ACROSS_CASTERS: f64 = 12.0;

/// Number of small casters from which on each of them is resolved less.
const MANY_CASTERS: usize = 8;

/// Bounding sphere of an object, or a capsule around a part of a slit.
#[derive(Clone, Copy, Debug)]
struct Body {
    /// Ends of the capsule's line [m]; equal for a sphere.
    ends: [DVec3; 2],
    /// [m].
    radius_m: f64,
    /// Cells across it after division.
    cells_across: f64,
}

impl Body {
    /// With `across` cells across the opening.
    fn of(opening: &Slit, across: f64) -> Self {
        Self {
            ends: opening.ends,
            radius_m: opening.width_m,
            cells_across: 2.0 * across,
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

/// Features by cells of the item buffer: face, column, row.
type Bins<T> = HashMap<(u32, u32, u32), Vec<T>>;

/// Small bodies and openings as one light sees them.
#[derive(Clone, Debug, Default)]
pub struct SubcellFeatures {
    bodies: Bins<Body>,
    /// Sharp corners [m].
    corners: Bins<DVec3>,
    /// Most divisions of a cell for one of these corners.
    corner_levels: u32,
    /// Casters among the bodies.
    casters: usize,
}

impl SubcellFeatures {
    /// Objects that are small relative to cells of the given size in the unit square, and sharp corners of casters that
    /// the light sees. Both only where they can deflect light or occlude it, according to `visible`.
    pub fn find(
        tracer: &Tracer,
        launch: &Launch,
        visible: &ItemBuffer,
        cell: DVec2,
        closeness: EdgeSearch,
    ) -> Self {
        let scene = tracer.scene();
        let mut corners = Bins::default();
        let seen = visible
            .casters
            .iter()
            .flat_map(|&object| tracer.sharp_corners(object));
        for corner in seen.copied() {
            let bounds = (corner, corner);
            if visible.is_marked_towards(launch, bounds) {
                book(launch, bounds, corner, &mut corners);
            }
        }
        let middle = DVec2::splat(0.5);
        let origin = launch.ray(0, middle).origin;
        let is_small = |body: &Body| {
            let width_m = launch
                .cell_area_at_m2(middle, middle + cell, origin.distance(body.ends[0]))
                .sqrt();
            body.radius_m > 0.0 && 2.0 * body.radius_m < SMALL_CELLS * width_m
        };
        let mut small: Vec<(Body, Bounds)> = scene
            .objects
            .iter()
            .enumerate()
            .filter_map(|(index, object)| {
                let (low, high) = object.bounds()?;
                let body = Body {
                    ends: [low * 0.5 + high * 0.5; 2],
                    radius_m: 0.5 * (high - low).length(),
                    cells_across: if scene.material_of(index).surface.is_specular() {
                        closeness.cells_across_casters
                    } else {
                        CELLS_ACROSS_OTHERS
                    },
                };
                // The cheap test first: the other one searches the scene.
                (is_small(&body) && visible.may_concern(launch, tracer, index)).then_some((body, (low, high)))
            })
            .collect();
        // Each of many shows less on the maps: all together get as many cells as a single one.
        let casters = small
            .iter()
            .filter(|(body, _)| body.cells_across > CELLS_ACROSS_OTHERS);
        let casters = casters.count();
        let crowd = (casters.max(1) as f64).sqrt();
        let mut bodies = Bins::default();
        for (body, bounds) in &mut small {
            if body.cells_across > CELLS_ACROSS_OTHERS {
                let least = MIN_ACROSS_CASTERS.min(body.cells_across);
                body.cells_across = (body.cells_across / crowd).max(least);
            }
            book(launch, *bounds, *body, &mut bodies);
        }
        let (openings, across) = narrow_openings(tracer, launch, visible, cell);
        for opening in &openings {
            let body = Body::of(opening, across);
            book(launch, body.bounds(), body, &mut bodies);
        }
        Self {
            bodies,
            corners,
            corner_levels: closeness.corner_levels,
            casters,
        }
    }

    /// 1 if there are so many casters that no single one shows much, otherwise 0.
    pub fn are_many(&self) -> u32 {
        u32::from(self.casters >= MANY_CASTERS)
    }

    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty() && self.corners.is_empty()
    }

    /// Whether a cell of a face, between two corners of the unit square, may contain a small body or a sharp corner
    /// within `hidden_beyond_m` of the ray origins [m]; `level` is how often it was divided for such features.
    pub fn ask_for_finer(
        &self,
        launch: &Launch,
        face: usize,
        (low, high): (DVec2, DVec2),
        level: u32,
        hidden_beyond_m: f64,
    ) -> bool {
        if level >= DEEPEST_BODY_LEVEL || self.is_empty() {
            return false;
        }
        let beam = CellBeam::new(launch, face, (low, high));
        // Slightly larger than the cell: bodies reach beyond the bins that they are booked in.
        let margin = (high - low) * 0.5;
        let (low, high) = (low - margin, high + margin);
        let holds_corner = level < self.corner_levels
            && found(&self.corners, face, (low, high), |corner| {
                let along_m = beam.along_m(*corner);
                along_m > 0.0
                    && along_m <= hidden_beyond_m
                    && beam.middle.at(along_m).distance(*corner) <= beam.reach_m(along_m)
            });
        holds_corner
            || found(&self.bodies, face, (low, high), |body| {
                beam.reach_at_m(body, hidden_beyond_m)
                    .is_some_and(|reach_m| body.cells_across * reach_m > 2.0 * body.radius_m)
            })
    }

    /// Approximate number of cells that a cell of a lattice becomes for the small bodies in it; at least 1.
    pub fn cells_within(&self, launch: &Launch, face: usize, (low, high): (DVec2, DVec2)) -> f64 {
        if self.bodies.is_empty() {
            return 1.0;
        }
        let beam = CellBeam::new(launch, face, (low, high));
        let mut cells = 1.0;
        for_each(&self.bodies, face, (low, high), |body| {
            if let Some(reach_m) = beam.reach_at_m(body, f64::INFINITY) {
                // The whole cell, or the body plus the divisions on the way to it.
                let across = body.cells_across * (reach_m / body.radius_m).min(1.0);
                let length_m = body.ends[0].distance(body.ends[1]).min(2.0 * reach_m);
                cells += across.powi(2) * (1.0 + 0.5 * length_m / body.radius_m);
            }
        });
        cells
    }
}

/// Beam of a lattice cell: its middle ray and those through its corners.
struct CellBeam {
    middle: Ray,
    corners: [Ray; 4],
}

impl CellBeam {
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
    fn reach_at_m(&self, body: &Body, hidden_beyond_m: f64) -> Option<f64> {
        let nearest = body.nearest(&self.middle);
        let along_m = self.along_m(nearest);
        if along_m <= -body.radius_m || along_m - body.radius_m > hidden_beyond_m {
            return None;
        }
        let along_m = along_m.max(0.0);
        let centre = self.middle.at(along_m);
        let reach_m = self.reach_m(along_m);
        (centre.distance(nearest) <= body.radius_m + 1.5 * reach_m).then_some(reach_m)
    }
}

/// Adds a feature to all cells of the item buffer that its bounding box may touch.
fn book<T: Copy>(launch: &Launch, bounds: Bounds, what: T, bins: &mut Bins<T>) {
    for face in 0..launch.face_count() {
        let Some((columns, rows)) = item_buffer::cells_towards(launch, face, bounds) else {
            continue;
        };
        for row in rows.0..=rows.1 {
            for column in columns.0..=columns.1 {
                let bin = (face as u32, column as u32, row as u32);
                bins.entry(bin).or_default().push(what);
            }
        }
    }
}

/// Whether any feature in the bins between two corners of a face's unit square passes a test.
fn found<T>(bins: &Bins<T>, face: usize, square: (DVec2, DVec2), test: impl Fn(&T) -> bool) -> bool {
    bins_between(face, square).any(|bin| bins.get(&bin).is_some_and(|booked| booked.iter().any(&test)))
}

/// Visits all features in the bins between two corners of a face's unit square; once per bin.
fn for_each<T>(bins: &Bins<T>, face: usize, square: (DVec2, DVec2), mut act: impl FnMut(&T)) {
    for bin in bins_between(face, square) {
        bins.get(&bin).into_iter().flatten().for_each(&mut act);
    }
}

fn bins_between(face: usize, (low, high): (DVec2, DVec2)) -> impl Iterator<Item = (u32, u32, u32)> {
    let side = CELLS_PER_SIDE as f64;
    let cell = move |share: f64| ((share * side).max(0.0) as usize).min(CELLS_PER_SIDE - 1) as u32;
    let columns = cell(low.x)..=cell(high.x);
    (cell(low.y)..=cell(high.y))
        .flat_map(move |row| columns.clone().map(move |column| (face as u32, column, row)))
}
