//! How finely a patch is tessellated, from nine interpolated rays.

use glam::{DVec2, DVec3};

use super::patch::PatchShape;
use super::spread::{SpreadOutput, Spreader};
use super::virtual_vertex::{VirtualRays, VirtualVertex};
use crate::illumination::Receiver;
use crate::light_pass::footprint_statistics::FootprintSample;
use crate::optics::LinearSrgb;

/// Largest deviation of triangles from the curve [texels].
const CHORD_TEXELS: f64 = 0.02;

/// Largest relative change of the lit area from one triangle to the next, where triangles are larger than texels.
const DENSITY_STEP: f64 = 0.01;

/// Factor by which patches are coarser that add next to nothing to their map.
const COARSEST_TOLERANCE: f64 = 10.0;

/// Tolerance from which on the surroundings of a single ray are not divided at all.
const DUST_TOLERANCE: f64 = 2.0;

/// Most triangles along a side of a patch.
const MAX_STEPS: usize = 128;

/// Height of a surface over its middle facet, relative to the extent of the lit area, above which it counts as a jump
/// or a sharp edge.
const JUMP_SHARE: f64 = 0.25;

/// Weight of the height above the middle facet relative to distances along it.
const HEIGHT_WEIGHT: f64 = 0.5;

/// Steps along a patch whose rays do not all land on one surface.
const MIXED_STEPS: usize = 6;

/// Texels that such a patch is assumed to light.
const MIXED_TEXELS: f64 = 16.0;

/// Details of a whole cell's patch that a map resolves, by area: a cubic patch carries more detail than its corners.
const DETAILS_PER_PATCH: f64 = 64.0;

/// The same for the surroundings of a single ray: a quarter of a cell whose light takes very many paths.
const DETAILS_AROUND_ONE: f64 = 4.0;

impl Spreader<'_> {
    /// Whether nine rays of a patch hit a plane within its map.
    pub(super) fn stays_on_map(&self, shape: &PatchShape, receiver: Receiver) -> bool {
        let Some(surface) = self.receivers.get(receiver) else {
            return false;
        };
        let Some(plane) = surface.plane else {
            return false;
        };
        let size = DVec2::new(surface.chart.width as f64, surface.chart.height as f64);
        (0..9).all(|index| {
            let at = probe_place(shape, index % 3, index / 3);
            plane
                .meet(&shape.ray(at))
                .is_some_and(|(texel, _)| texel.cmpge(DVec2::ZERO).all() && texel.cmple(size).all())
        })
    }

    /// Steps into which a patch is divided in both directions, from nine of its rays.
    pub(super) fn steps(
        &self,
        shape: &PatchShape,
        rays: &mut VirtualRays,
        is_plane: bool,
        flux_w: LinearSrgb,
        out: &mut SpreadOutput,
    ) -> (usize, usize) {
        if let Some(steps) = self.steps_around_one(rays, flux_w) {
            return steps;
        }
        let probes: [[VirtualVertex; 3]; 3] =
            std::array::from_fn(|j| std::array::from_fn(|i| rays.vertex(probe_place(shape, i, j))));
        let first = probes[0][0].place;
        let is_one = probes.iter().flatten().all(|vertex| vertex.place.is_same(&first));
        let Some(receiver) = first.receiver().filter(|_| is_one) else {
            if self.gathers {
                self.note_part(&probes, (flux_w, details(rays)), out);
            }
            if rays.are_around_one() {
                // An approximation need not be cut precisely.
                return (1, 1);
            }
            let lit = probes.iter().flatten().find_map(|vertex| vertex.place.receiver());
            let tolerance = lit.map_or(1.0, |receiver| {
                self.tolerance(receiver, flux_w.luminance(), MIXED_TEXELS)
            });
            return mixed_steps(&probes, is_plane, tolerance);
        };
        let local = self.laid_flat(receiver, &probes);
        let place = |i: usize, j: usize| local[j][i];
        let texel = |i: usize, j: usize| local[j][i].truncate();
        self.count_area(receiver, &texel, (flux_w, details(rays)), out);
        let detail = self.detail(receiver, &probes);
        let place = |i: usize, j: usize| place(i, j) * detail;
        let texel = |i: usize, j: usize| texel(i, j) * detail;
        let bend = |a: DVec3, b: DVec3, c: DVec3| (a - b * 2.0 + c).length() * 0.25;
        let across = (0..3)
            .map(|j| bend(place(0, j), place(1, j), place(2, j)))
            .fold(0.0, f64::max);
        let down = (0..3)
            .map(|i| bend(place(i, 0), place(i, 1), place(i, 2)))
            .fold(0.0, f64::max);
        let corner = |i: usize, j: usize| {
            let (a, b, c) = (texel(i, j), texel(i + 1, j), texel(i, j + 1));
            (b - a).perp_dot(c - a)
        };
        let areas = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        let largest = areas.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
        let change = |a: f64, b: f64| {
            if largest > 0.0 {
                (a - b).abs() / largest
            } else {
                0.0
            }
        };
        let lit_texels = 0.5 * areas.iter().map(|area| area.abs()).sum::<f64>() / (detail * detail);
        let tolerance = self.tolerance(receiver, flux_w.luminance(), lit_texels);
        let length = |a: DVec2, b: DVec2, c: DVec2| a.distance(b) + b.distance(c);
        let width = (0..3)
            .map(|j| length(texel(0, j), texel(1, j), texel(2, j)))
            .fold(0.0, f64::max);
        let height = (0..3)
            .map(|i| length(texel(i, 0), texel(i, 1), texel(i, 2)))
            .fold(0.0, f64::max);
        let heights = local.as_flattened().iter().map(|place| place.z * detail);
        let (low, high) = heights.fold((0.0_f64, 0.0_f64), |(low, high), z| (low.min(z), high.max(z)));
        if high - low > JUMP_SHARE * width.max(height) {
            return mixed_steps(&probes, is_plane, tolerance);
        }
        let steps = |bend: f64, change: f64, length: f64| {
            let straight = (bend / (CHORD_TEXELS * tolerance)).sqrt();
            let even = change / (DENSITY_STEP * tolerance);
            // Of triangles smaller than a texel only those at the border show.
            let even = even.min((even * length).sqrt());
            (straight.max(even).ceil() as usize).clamp(1, MAX_STEPS)
        };
        (
            steps(
                across,
                change(areas[0], areas[1]).max(change(areas[3], areas[2])),
                width,
            ),
            steps(
                down,
                change(areas[0], areas[3]).max(change(areas[1], areas[2])),
                height,
            ),
        )
    }

    /// A single step, for the surroundings of a single ray that adds next to nothing: one of very many.
    fn steps_around_one(&self, rays: &VirtualRays, flux_w: LinearSrgb) -> Option<(usize, usize)> {
        let tolerance = |receiver| self.tolerance(receiver, flux_w.luminance(), 1.0);
        let tolerance = rays.lit().map_or(COARSEST_TOLERANCE, tolerance);
        let is_dust = rays.are_around_one() && !self.gathers && tolerance >= DUST_TOLERANCE;
        is_dust.then_some((1, 1))
    }

    /// Hits of a patch's rays on a receiver, unfolded into the texel frame of the middle facet: charts may end and turn
    /// between them. The third coordinate is the height above that facet.
    fn laid_flat(&self, receiver: Receiver, probes: &[[VirtualVertex; 3]; 3]) -> [[DVec3; 3]; 3] {
        let middle = probes[1][1].place.facet();
        let flat = self
            .receivers
            .facets(receiver)
            .zip(middle)
            .and_then(|(facets, (facet, point))| {
                let triangle = facet.triangle as usize;
                let rows = facets
                    .surface
                    .chart
                    .texel_from_world(triangle, facets.mesh.corners(triangle))?;
                let height = facets.mesh.face_normal(triangle) * rows[0].cross(rows[1]).length().sqrt();
                Some((rows, height, point, facet.texel))
            });
        probes.map(|row| {
            row.map(|vertex| match (flat, vertex.place.facet()) {
                (Some((rows, height, middle, texel)), Some((_, point))) => {
                    let step = point - middle;
                    let on = texel + DVec2::new(rows[0].dot(step), rows[1].dot(step));
                    on.extend(HEIGHT_WEIGHT * height.dot(step))
                }
                _ => vertex.place.texel().extend(0.0),
            })
        })
    }

    /// How much coarser than the finest a patch may be divided: a small contribution to a map need not be as precise.
    fn tolerance(&self, receiver: Receiver, flux_w: f64, lit_texels: f64) -> f64 {
        let Some(surface) = self.receivers.get(receiver) else {
            return 1.0;
        };
        let texels = (surface.chart.width * surface.chart.height) as f64;
        let mean_w = self.reference_w / texels;
        let local_w = flux_w / lit_texels.max(1.0);
        if local_w > 0.0 {
            self.coarseness * (mean_w / local_w).sqrt().clamp(1.0, COARSEST_TOLERANCE)
        } else {
            self.coarseness * COARSEST_TOLERANCE
        }
    }

    /// Records the area that a patch lights.
    fn count_area(
        &self,
        receiver: Receiver,
        texel: &impl Fn(usize, usize) -> DVec2,
        (flux_w, details): (LinearSrgb, f64),
        out: &mut SpreadOutput,
    ) {
        let Some(surface) = self.receivers.get(receiver) else {
            return;
        };
        let (a, b, c, d) = (texel(0, 0), texel(2, 0), texel(2, 2), texel(0, 2));
        let texels = 0.5 * ((b - a).perp_dot(c - a).abs() + (c - a).perp_dot(d - a).abs());
        let share = texels / (surface.chart.width * surface.chart.height) as f64 / details;
        let area_m2 = share * surface.area_m2;
        out.statistics.add(receiver, flux_w.luminance(), area_m2, share);
        if self.gathers {
            let all = (0..9).map(|index| texel(index % 3, index / 3));
            self.note(receiver, all, flux_w.luminance(), share, out);
        }
    }

    /// Records the position of a patch of which only some rays land on one surface.
    fn note_part(
        &self,
        probes: &[[VirtualVertex; 3]; 3],
        (flux_w, details): (LinearSrgb, f64),
        out: &mut SpreadOutput,
    ) {
        let places = || probes.iter().flatten().map(|vertex| &vertex.place);
        let Some(receiver) = places().find_map(|place| place.receiver()) else {
            return;
        };
        let Some(surface) = self.receivers.get(receiver) else {
            return;
        };
        let lit = || places().filter(|place| place.receiver() == Some(receiver));
        let (low, high) = bounds(lit().map(|place| place.texel()));
        let extent = (high - low) / DVec2::new(surface.chart.width as f64, surface.chart.height as f64);
        let part = lit().count() as f64 / 9.0;
        let share = extent.x * extent.y / details;
        self.note(
            receiver,
            lit().map(|place| place.texel()),
            flux_w.luminance() * part,
            share,
            out,
        );
    }

    /// Records the position of light with details that cover a share of its map.
    fn note(
        &self,
        receiver: Receiver,
        texels: impl Iterator<Item = DVec2>,
        flux_w: f64,
        share: f64,
        out: &mut SpreadOutput,
    ) {
        let Some(surface) = self.receivers.get(receiver) else {
            return;
        };
        let size = DVec2::new(surface.chart.width as f64, surface.chart.height as f64);
        let (low, high) = bounds(texels);
        out.statistics.add_spot(FootprintSample {
            receiver,
            bounds: (low / size, high / size),
            flux_w,
            map_share: share,
        });
    }

    /// Size of the finest texels relative to those that a patch lights: less than 1 where all of it falls on coarser
    /// tiles.
    fn detail(&self, receiver: Receiver, probes: &[[VirtualVertex; 3]; 3]) -> f64 {
        let Some(chart) = self.receivers.get(receiver).map(|surface| &surface.chart) else {
            return 1.0;
        };
        let Some(layout) = &chart.layout else {
            return 1.0;
        };
        let (low, high) = bounds(probes.iter().flatten().map(|vertex| vertex.place.texel()));
        let last = DVec2::new((chart.width - 1) as f64, (chart.height - 1) as f64);
        let within = |place: DVec2| {
            let place = place.clamp(DVec2::ZERO, last);
            (place.x as usize, place.y as usize)
        };
        1.0 / f64::from(1_u32 << layout.finest_between(within(low), within(high)))
    }
}

/// Details of a patch that a map should resolve.
fn details(rays: &VirtualRays) -> f64 {
    if rays.are_around_one() {
        DETAILS_AROUND_ONE
    } else {
        DETAILS_PER_PATCH
    }
}

/// Minimum and maximum coordinates.
fn bounds(places: impl Iterator<Item = DVec2>) -> (DVec2, DVec2) {
    places.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), place| {
        (low.min(place), high.max(place))
    })
}

/// One of nine points of a patch; those of a triangle converge at its last corner.
fn probe_place(shape: &PatchShape, i: usize, j: usize) -> DVec2 {
    let at = DVec2::new(i as f64, j as f64) * 0.5;
    if shape.is_rectangle() {
        at
    } else {
        DVec2::new(at.x * (1.0 - at.y), at.y)
    }
}

/// Steps where rays do not all hit one surface: enough to resolve the border between.
fn mixed_steps(probes: &[[VirtualVertex; 3]; 3], is_plane: bool, tolerance: f64) -> (usize, usize) {
    let lost = probes
        .iter()
        .flatten()
        .all(|vertex| vertex.place.receiver().is_none());
    let steps = match (is_plane, lost) {
        // Every ray is far off the map.
        (true, true) => 2,
        (true, false) => 2 * MIXED_STEPS,
        (false, _) => MIXED_STEPS,
    };
    let steps = (steps as f64 / tolerance.sqrt()).ceil().max(2.0) as usize;
    (steps, steps)
}
