//! A sketch of where light lands: a sparse lattice of rays is traced to matte surfaces, and four neighbours on the same
//! path span a patch of the wavefront. For display only; it measures nothing.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use rayon::prelude::*;

use crate::light_pass::path::{Arrival, PathLimits, PathTracer};
use crate::light_pass::photon::domain::{DomainPoint, LitCells};
use crate::light_pass::photon::launch::{LAMP_MIDDLE, PhotonLaunch};
use crate::light_pass::visibility::{CullMode, LightVisibility, VisibleLight};
use crate::progress::Control;
use crate::settings::ItemBufferKind;
use crate::transport::Tracer;

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

/// Traces thin wavefronts of all lights. Extended lights emit from their centres, glass refracts all light as at 587.56
/// nm, and rough surfaces are smooth. Ends early if cancelled.
pub fn sketch(tracer: &Tracer, limits: SketchLimits, control: &Control) -> PathPreview {
    let visibility = LightVisibility::take(tracer, ItemBufferKind::Equal, CullMode::Reachable, false);
    let mut all = PathPreview::default();
    for visible_light in &visibility.lights {
        if control.is_cancelled() {
            break;
        }
        of_light(tracer, visible_light, limits, &mut all);
    }
    all
}

fn of_light(tracer: &Tracer, visible_light: &VisibleLight, limits: SketchLimits, all: &mut PathPreview) {
    let launch = PhotonLaunch::of_cells(visible_light);
    let squares = LitCells::of(&launch).fine(limits.cells);
    let corners: BTreeSet<DomainPoint> = squares.iter().flat_map(|square| square.corners()).collect();
    let corners: Vec<DomainPoint> = corners.into_iter().collect();
    let arrived: Vec<Vec<Arrival>> = corners
        .par_iter()
        .map(|corner| follow(tracer, &launch, limits, *corner))
        .collect();
    let light = visible_light.light;
    let points = arrived.iter().flatten();
    all.landings.extend(points.map(|arrived| LandedRay {
        light,
        point: arrived.point,
    }));
    all.rays += corners.len() as u64;
    let known: BTreeMap<DomainPoint, Vec<Arrival>> = corners.into_iter().zip(arrived).collect();
    for square in squares {
        let at = square.corners().map(|corner| &known[&corner][..]);
        all.patches
            .extend(patches(at).map(|corners| SketchedPatch { light, corners }));
    }
}

/// All landings of a corner's ray.
fn follow(tracer: &Tracer, launch: &PhotonLaunch, limits: SketchLimits, corner: DomainPoint) -> Vec<Arrival> {
    let mut found = Vec::new();
    let Some(start) = launch.start_at(corner.root as usize, corner.off_border(), LAMP_MIDDLE) else {
        return found;
    };
    let limits = PathLimits::smooth(limits.max_depth, limits.branch_threshold);
    let mut paths = PathTracer::without_ledger(tracer, limits);
    paths.trace(start.ray, start.flux_w, &start.media, |arrival, _| {
        found.push(arrival)
    });
    found
}

/// Patches between four rays on the same path.
fn patches<'a>(at: [&'a [Arrival]; 4]) -> impl Iterator<Item = [DVec3; 4]> + 'a {
    let [first, others @ ..] = at;
    first.iter().filter_map(move |arrived| {
        let is_same =
            |other: &&Arrival| (other.signature, other.receiver) == (arrived.signature, arrived.receiver);
        let [b, c, d] = others.map(|others| others.iter().find(is_same));
        Some([arrived.point, b?.point, c?.point, d?.point])
    })
}
