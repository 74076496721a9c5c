//! Slits and pinholes narrower than a lattice cell. The cell's corners hit only what surrounds them, so extra rays are
//! traced beside the sharp edges in front of casters.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::geometry::Ray;
use crate::light_pass::item_buffer::ItemBuffer;
use crate::light_pass::launch::Launch;
use crate::transport::Tracer;

/// Openings narrower than this many cells are narrow: wider ones contain corners of cells.
const NARROW_CELLS: f64 = 2.0;

/// Narrower openings are not found [cells].
const NARROWEST_CELLS: f64 = 1e-4;

/// Bisections of an opening's width once it is bracketed to a factor of two.
const WIDTH_BITS: u32 = 4;

/// Fewest samples along an edge, where they are otherwise half a cell apart.
const MIN_SAMPLES: usize = 3;

/// Most samples along all edges of one light; beyond that they are farther apart.
const MAX_SAMPLES: f64 = 8_192.0;

/// Fewest and most cells across an opening: with the fewest, cell corners lie inside it; with the most, its own corners
/// are resolved.
const CELLS_ACROSS: (f64, f64) = (4.0, 32.0);

/// Target number of cells in openings, and its limit at the fewest cells across, where no other light reaches casters;
/// otherwise in proportion to the openings' share of the light.
const CELLS: (f64, f64) = (8_192.0, 16_384.0);

/// Rays per side of a face that estimate how much light reaches casters.
const PROBES_PER_SIDE: usize = 64;

/// A part of a narrow opening, beside a part of an edge.
#[derive(Clone, Copy, Debug)]
pub struct Slit {
    /// Ends of its centre line [m].
    pub ends: [DVec3; 2],
    /// As seen from the light [m].
    pub width_m: f64,
    /// Upper bound on the measure of the launch domain that passes through it [sr, or m² of a sun].
    measure: f64,
}

impl Slit {
    /// Its length in squares of its width, including half a square at each end.
    fn squares(&self) -> f64 {
        1.0 + self.ends[0].distance(self.ends[1]) / self.width_m
    }
}

/// One light's search of a scene with a lattice of a given cell size.
struct Search<'a> {
    tracer: &'a Tracer,
    launch: &'a Launch,
    visible: &'a ItemBuffer,
    /// Cell size in the unit square.
    cell: DVec2,
}

/// Openings through which a light sees casters that are narrow relative to cells of the given size in the unit square,
/// and let through enough light to be worth their cells; and the number of cells across each.
pub fn narrow_openings(
    tracer: &Tracer,
    launch: &Launch,
    visible: &ItemBuffer,
    cell: DVec2,
) -> (Vec<Slit>, f64) {
    let search = Search {
        tracer,
        launch,
        visible,
        cell,
    };
    let edges = search.edges();
    let wanted: f64 = edges.iter().map(|edge| search.samples_wanted(edge)).sum();
    let thinning = (wanted / MAX_SAMPLES).max(1.0);
    let beside = |edge: &[DVec3; 2]| search.beside(edge, thinning);
    let openings = edges.par_iter().map(beside).collect::<Vec<_>>().concat();
    if openings.is_empty() {
        return (openings, CELLS_ACROSS.1);
    }
    let through: f64 = openings.iter().map(|opening| opening.measure).sum();
    widest(openings, through / (through + search.seen_measure()))
}

/// Selects the widest openings that fit the cell budget, and the number of cells across each; `share` of all light
/// passes through them.
fn widest(mut openings: Vec<Slit>, share: f64) -> (Vec<Slit>, f64) {
    openings.sort_by(|a, b| b.width_m.total_cmp(&a.width_m));
    let mut squares = 0.0;
    let fits = |opening: &&Slit| {
        squares += opening.squares();
        squares * CELLS_ACROSS.0 * CELLS_ACROSS.0 <= CELLS.1 * share
    };
    let count = openings.iter().take_while(fits).count();
    openings.truncate(count);
    let squares: f64 = openings.iter().map(Slit::squares).sum();
    let across = (CELLS.0 * share / squares).sqrt();
    (openings, across.clamp(CELLS_ACROSS.0, CELLS_ACROSS.1))
}

impl Search<'_> {
    /// Sharp edges of occluders in directions in which casters lie.
    fn edges(&self) -> Vec<[DVec3; 2]> {
        let scene = self.tracer.scene();
        let blocks = |&object: &usize| {
            let bounds = scene.objects[object].bounds();
            !scene.material_of(object).surface.is_specular()
                && bounds.is_some_and(|bounds| self.visible.is_marked_towards(self.launch, bounds))
        };
        let objects = (0..scene.objects.len()).filter(blocks);
        let is_before = |[a, b]: &&[DVec3; 2]| {
            self.visible
                .is_marked_towards(self.launch, (a.min(*b), a.max(*b)))
        };
        objects
            .flat_map(|object| self.tracer.sharp_edges(object).iter().filter(is_before))
            .copied()
            .collect()
    }

    /// Width of a cell at a point [m].
    fn cell_m(&self, point: DVec3) -> f64 {
        let middle = DVec2::splat(0.5);
        let path_m = self.launch.ray_through(point).1;
        let area_m2 = self.launch.cell_area_at_m2(middle, middle + self.cell, path_m);
        area_m2.sqrt()
    }

    /// Measure of the launch domain per area across the light at a distance [sr/m², or m²/m² of a sun].
    fn measure_per_m2(&self, path_m: f64) -> f64 {
        let middle = DVec2::splat(0.5);
        let to = middle + self.cell;
        self.launch.cell_measure(middle, to) / self.launch.cell_area_at_m2(middle, to, path_m)
    }

    /// Measure of the launch domain that reaches casters, by a grid of rays [sr, or m² of a sun].
    fn seen_measure(&self) -> f64 {
        let size = (PROBES_PER_SIDE, PROBES_PER_SIDE);
        let cell = DVec2::splat(1.0 / PROBES_PER_SIDE as f64);
        let of_row = |(face, row): (usize, usize)| -> f64 {
            let spans = self.visible.lattice_spans(face, row, size);
            let columns = spans.into_iter().flat_map(|(begin, end)| begin..end);
            let of_cell = |column: usize| {
                let low = DVec2::new(column as f64, row as f64) * cell;
                let ray = self.launch.ray(face, low + 0.5 * cell);
                let is_seen = self.meets_caster(&ray, 0.0);
                is_seen.then(|| self.launch.cell_measure(low, low + cell))
            };
            columns.filter_map(of_cell).sum()
        };
        let rows =
            (0..self.launch.face_count()).flat_map(|face| (0..PROBES_PER_SIDE).map(move |row| (face, row)));
        let rows: Vec<(usize, usize)> = rows.collect();
        // Row by row, so that the sum does not depend on the number of threads.
        rows.into_par_iter()
            .map(of_row)
            .collect::<Vec<f64>>()
            .iter()
            .sum()
    }

    /// Two per cell, along an edge as seen from the light.
    fn samples_wanted(&self, edge: &[DVec3; 2]) -> f64 {
        let middle = edge[0] * 0.5 + edge[1] * 0.5;
        let cells = edge[0].distance(edge[1]) / self.cell_m(middle);
        if cells.is_finite() { 2.0 * cells } else { 0.0 }
    }

    fn beside(&self, edge: &[DVec3; 2], thinning: f64) -> Vec<Slit> {
        let samples = ((self.samples_wanted(edge) / thinning).ceil() as usize).max(MIN_SAMPLES);
        let place = |share: f64| edge[0].lerp(edge[1], share);
        let along = (edge[1] - edge[0]).normalize_or_zero();
        let of_sample = |sample: usize| {
            let [from, middle, to] = [0.0, 0.5, 1.0].map(|part| (sample as f64 + part) / samples as f64);
            let (ray, path_m) = self.launch.ray_through(place(middle));
            let across = ray.direction.cross(along).try_normalize()?;
            let of_side = |across: DVec3| {
                let width_m = self.width_m(ray.at(path_m), across)?;
                let aside = across * (0.5 * width_m);
                Some(Slit {
                    ends: [place(from) + aside, place(to) + aside],
                    width_m,
                    measure: width_m * place(from).distance(place(to)) * self.measure_per_m2(path_m),
                })
            };
            of_side(across).or_else(|| of_side(-across))
        };
        (0..samples).filter_map(of_sample).collect()
    }

    /// Width of the opening beside a point of an edge, in a direction across it [m]; `None` if there is none or it is
    /// wide.
    fn width_m(&self, edge: DVec3, across: DVec3) -> Option<f64> {
        let cell_m = self.cell_m(edge);
        let is_open = |aside_m: f64| self.sees_caster(edge + across * aside_m);
        let mut open_m = NARROWEST_CELLS * cell_m;
        if !is_open(open_m) {
            return None;
        }
        let mut closed_m = 2.0 * open_m;
        while is_open(closed_m) {
            (open_m, closed_m) = (closed_m, 2.0 * closed_m);
            if open_m > NARROW_CELLS * cell_m {
                return None;
            }
        }
        for _ in 0..WIDTH_BITS {
            let middle_m = 0.5 * (open_m + closed_m);
            if is_open(middle_m) {
                open_m = middle_m;
            } else {
                closed_m = middle_m;
            }
        }
        Some(closed_m)
    }

    /// Whether the light's ray through a point hits a caster behind it before anything else.
    fn sees_caster(&self, point: DVec3) -> bool {
        let (ray, path_m) = self.launch.ray_through(point);
        self.meets_caster(&ray, path_m)
    }

    /// Whether the closest hit of a ray is a caster farther away than `beyond_m`.
    fn meets_caster(&self, ray: &Ray, beyond_m: f64) -> bool {
        let scene = self.tracer.scene();
        self.tracer.intersect(ray).is_some_and(|place| {
            let material = scene.material_of(place.object as usize);
            place.distance_m > beyond_m && material.surface.is_specular()
        })
    }
}
