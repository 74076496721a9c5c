//! How finely a patch is divided into triangles, from nine rays between its traced ones.

use glam::DVec2;

use super::patch::PatchShape;
use super::spread::{SpreadOutput, Spreader};
use super::virtual_vertex::{VirtualRays, VirtualVertex};
use crate::optics::LinearSrgb;
use crate::transport::PathEffects;

/// Deviation from straight that triangles may have [texels].
const CHORD_TEXELS: f64 = 0.02;

/// Change of the lit area from one triangle to the next, as a share, that is left where triangles are larger than
/// texels.
const DENSITY_STEP: f64 = 0.01;

/// How much coarser patches are divided that add next to nothing to their map.
const COARSEST_TOLERANCE: f64 = 10.0;

/// Most triangles along a patch.
const MOST_STEPS: usize = 128;

/// Steps along a patch whose rays do not all go to one surface.
const MIXED_STEPS: usize = 6;

/// Texels that such a patch is taken to light.
const MIXED_TEXELS: f64 = 16.0;

/// Patches of a wavefront cell that a map resolves details of, along each side: a cubic patch says more than its
/// corners.
const DETAILS_PER_PATCH: f64 = 64.0;

impl<E: PathEffects> Spreader<'_, E> {
    /// Whether nine rays of a patch meet a plane within its map.
    pub(super) fn stays_on_map(&self, shape: &PatchShape, object: u32) -> bool {
        let Some(surface) = self.receivers.get(object) else {
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

    /// How finely a patch has to be divided, from nine of its rays.
    pub(super) fn steps(
        &self,
        shape: &PatchShape,
        rays: &mut VirtualRays<E>,
        is_plane: bool,
        flux_w: LinearSrgb,
        out: &mut SpreadOutput,
    ) -> (usize, usize) {
        let probes: [[VirtualVertex; 3]; 3] =
            std::array::from_fn(|j| std::array::from_fn(|i| rays.vertex(probe_place(shape, i, j))));
        let first = probes[0][0].place;
        let is_one = probes.iter().flatten().all(|vertex| vertex.place.is_same(&first));
        let Some(object) = first.object().filter(|_| is_one) else {
            let lit = probes.iter().flatten().find_map(|vertex| vertex.place.object());
            let tolerance = lit.map_or(1.0, |object| {
                self.tolerance(object, flux_w.luminance(), MIXED_TEXELS)
            });
            return mixed_steps(&probes, is_plane, tolerance);
        };
        let texel = |i: usize, j: usize| probes[j][i].place.texel();
        self.count_area(object, &texel, flux_w, out);
        let bend = |a: DVec2, b: DVec2, c: DVec2| (a - b * 2.0 + c).length() * 0.25;
        let across = (0..3)
            .map(|j| bend(texel(0, j), texel(1, j), texel(2, j)))
            .fold(0.0, f64::max);
        let down = (0..3)
            .map(|i| bend(texel(i, 0), texel(i, 1), texel(i, 2)))
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
        let lit_texels = 0.5 * areas.iter().map(|area| area.abs()).sum::<f64>();
        let tolerance = self.tolerance(object, flux_w.luminance(), lit_texels);
        let length = |a: DVec2, b: DVec2, c: DVec2| a.distance(b) + b.distance(c);
        let width = (0..3)
            .map(|j| length(texel(0, j), texel(1, j), texel(2, j)))
            .fold(0.0, f64::max);
        let height = (0..3)
            .map(|i| length(texel(i, 0), texel(i, 1), texel(i, 2)))
            .fold(0.0, f64::max);
        let steps = |bend: f64, change: f64, length: f64| {
            let straight = (bend / (CHORD_TEXELS * tolerance)).sqrt();
            let even = change / (DENSITY_STEP * tolerance);
            // Of triangles below a texel only those at its border are seen.
            let even = even.min((even * length).sqrt());
            (straight.max(even).ceil() as usize).clamp(1, MOST_STEPS)
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

    /// How much coarser than the finest a patch may be divided: where it adds little to its map, what it adds need not
    /// be as exact.
    fn tolerance(&self, object: u32, flux_w: f64, lit_texels: f64) -> f64 {
        let Some(surface) = self.receivers.get(object) else {
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

    /// Notes how large an area a patch lights.
    fn count_area(
        &self,
        object: u32,
        texel: &impl Fn(usize, usize) -> DVec2,
        flux_w: LinearSrgb,
        out: &mut SpreadOutput,
    ) {
        let Some(surface) = self.receivers.get(object) else {
            return;
        };
        let (a, b, c, d) = (texel(0, 0), texel(2, 0), texel(2, 2), texel(0, 2));
        let texels = 0.5 * ((b - a).perp_dot(c - a).abs() + (c - a).perp_dot(d - a).abs());
        let share = texels / (surface.chart.width * surface.chart.height) as f64;
        out.statistics.add(
            object as usize,
            flux_w.luminance(),
            share * surface.area_m2 / DETAILS_PER_PATCH,
            share / DETAILS_PER_PATCH,
        );
    }
}

/// One of nine places over a patch; those of a triangle are drawn together at its last corner.
fn probe_place(shape: &PatchShape, i: usize, j: usize) -> DVec2 {
    let at = DVec2::new(i as f64, j as f64) * 0.5;
    if shape.is_rectangle() {
        at
    } else {
        DVec2::new(at.x * (1.0 - at.y), at.y)
    }
}

/// Rays that do not all meet one surface: enough to see the border between.
fn mixed_steps(probes: &[[VirtualVertex; 3]; 3], is_plane: bool, tolerance: f64) -> (usize, usize) {
    let lost = probes
        .iter()
        .flatten()
        .all(|vertex| vertex.place.object().is_none());
    let steps = match (is_plane, lost) {
        // Far off the map with every ray.
        (true, true) => 2,
        (true, false) => 2 * MIXED_STEPS,
        (false, _) => MIXED_STEPS,
    };
    let steps = (steps as f64 / tolerance.sqrt()).ceil().max(2.0) as usize;
    (steps, steps)
}
