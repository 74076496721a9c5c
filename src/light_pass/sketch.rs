//! A sketch of where light lands: a sparse lattice of rays is traced to matte surfaces, and four neighbours on the same
//! path span a patch of the wavefront. For display only; it measures nothing.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::item_buffer::CELLS_PER_SIDE;
use crate::light_pass::path::{PathLimits, PathSignature, PathTracer};
use crate::light_pass::visibility::{CullMode, LightVisibility, VisibleLight};
use crate::progress::Control;
use crate::settings::ItemBufferKind;
use crate::transport::{EffectSet, Tracer};

/// Inset of rays from the border of the domain, which may coincide with the border of a surface.
const MARGIN: f64 = 1e-9;
/// Maximum number of subdivisions of the domain's side.
const FINEST: u32 = 14;

/// Limits of a sketch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SketchLimits {
    /// Maximum number of specular surfaces on a path.
    pub max_depth: u32,
    /// Fraction of a ray's flux (luminance) below which a branch is not followed.
    pub branch_threshold: f64,
    /// Maximum number of lattice cells per light, > 0.
    pub cells: usize,
}

/// A ray that reached a matte surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandedRay {
    /// Index into `Scene::lights`.
    pub light: usize,
    /// [m].
    pub point: DVec3,
}

/// A patch of a wavefront on a matte surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SketchedPatch {
    /// Index into `Scene::lights`.
    pub light: usize,
    /// In order around the patch, all on one surface [m].
    pub corners: [DVec3; 4],
}

/// Where light lands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathPreview {
    /// One for each ray and path to a matte surface.
    pub landings: Vec<LandedRay>,
    /// Between neighbouring rays on the same path.
    pub patches: Vec<SketchedPatch>,
    /// Rays traced.
    pub rays: u64,
}

/// A corner of a cell: face, column and row.
type Corner = (usize, u32, u32);

/// The path of a ray to a point.
#[derive(Clone, Copy, Debug)]
struct ArrivalKind {
    way: (PathSignature, Receiver),
    point: DVec3,
}

/// Traces thin wavefronts of all lights. Extended lights emit from their centres, glass refracts all light as at 587.56
/// nm, and rough surfaces are smooth. Ends early if cancelled.
pub fn sketch(tracer: &Tracer, limits: SketchLimits, control: &Control) -> PathPreview {
    let aim = LightVisibility::take(tracer, ItemBufferKind::Equal, CullMode::Reachable, false);
    let mut all = PathPreview::default();
    for visible_light in &aim.lights {
        if control.is_cancelled() {
            break;
        }
        of_light(tracer, visible_light, limits, &mut all);
    }
    all
}

fn of_light(tracer: &Tracer, visible_light: &VisibleLight, limits: SketchLimits, all: &mut PathPreview) {
    let (side, cells) = cells(visible_light, limits.cells);
    let corners: BTreeSet<Corner> = cells.iter().flat_map(|cell| corners_of(*cell)).collect();
    let corners: Vec<Corner> = corners.into_iter().collect();
    let arrived: Vec<Vec<ArrivalKind>> = corners
        .par_iter()
        .map(|corner| follow(tracer, visible_light, limits, *corner, side))
        .collect();
    let light = visible_light.light;
    let points = arrived.iter().flatten();
    all.landings.extend(points.map(|arrived| LandedRay {
        light,
        point: arrived.point,
    }));
    all.rays += corners.len() as u64;
    let known: BTreeMap<Corner, Vec<ArrivalKind>> = corners.into_iter().zip(arrived).collect();
    for cell in cells {
        let at = corners_of(cell).map(|corner| &known[&corner][..]);
        all.patches
            .extend(patches(at).map(|corners| SketchedPatch { light, corners }));
    }
}

/// Cells that see a caster, as many as `most` or down to a quarter of that, and how many fit along a side of the
/// domain.
fn cells(visible_light: &VisibleLight, most: usize) -> (u32, BTreeSet<Corner>) {
    let marked = |face: usize| {
        let all = (0..CELLS_PER_SIDE).flat_map(|row| (0..CELLS_PER_SIDE).map(move |column| (column, row)));
        let buffer = visible_light.visible();
        all.filter(move |(column, row)| buffer.is_marked(face, *column, *row))
            .map(move |(column, row)| (face, column as u32, row as u32))
    };
    let mut cells: BTreeSet<Corner> = (0..visible_light.launch.face_count()).flat_map(marked).collect();
    let mut level = CELLS_PER_SIDE.trailing_zeros();
    while cells.len() > most && level > 0 {
        cells = cells
            .iter()
            .map(|(face, column, row)| (*face, column / 2, row / 2))
            .collect();
        level -= 1;
    }
    while !cells.is_empty() && 4 * cells.len() <= most && level < FINEST {
        cells = cells.iter().flat_map(|cell| quarters(*cell)).collect();
        level += 1;
    }
    (1 << level, cells)
}

fn quarters((face, column, row): Corner) -> [Corner; 4] {
    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| (face, 2 * column + x, 2 * row + y))
}

/// In order around the cell.
fn corners_of((face, column, row): Corner) -> [Corner; 4] {
    [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| (face, column + x, row + y))
}

/// All landings of a corner's ray.
fn follow(
    tracer: &Tracer,
    visible_light: &VisibleLight,
    limits: SketchLimits,
    (face, column, row): Corner,
    side: u32,
) -> Vec<ArrivalKind> {
    let place = DVec2::new(f64::from(column), f64::from(row)) / f64::from(side);
    let square = place.clamp(DVec2::splat(MARGIN), DVec2::splat(1.0 - MARGIN));
    let ray = visible_light.launch.ray(face, square);
    let flux_w = visible_light.launch.flux_density_w(square, ray.direction);
    let mut found = Vec::new();
    if !(flux_w.is_finite() && flux_w.max_channel() > 0.0) {
        return found;
    }
    let limits = PathLimits {
        max_depth: limits.max_depth,
        branch_threshold: limits.branch_threshold,
        effects: EffectSet::EVERYTHING,
        microfacets: None,
    };
    let unit = FluxUnit::for_power(flux_w.max_channel());
    let mut paths = PathTracer::new(tracer, limits, unit);
    paths.trace(ray, flux_w, visible_light.launch.media(), |arrival| {
        found.push(ArrivalKind {
            way: (arrival.signature, arrival.receiver),
            point: arrival.point,
        });
    });
    found
}

/// Patches between four rays on the same path.
fn patches<'a>(at: [&'a [ArrivalKind]; 4]) -> impl Iterator<Item = [DVec3; 4]> + 'a {
    let [first, others @ ..] = at;
    first.iter().filter_map(move |arrived| {
        let same = |others: &[ArrivalKind]| Some(others.iter().find(|other| other.way == arrived.way)?.point);
        let [b, c, d] = others.map(same);
        Some([arrived.point, b?, c?, d?])
    })
}
