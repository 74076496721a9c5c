//! The elements of all receivers, and the rays between them.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::grid::Grid;
use super::path::Follower;
use super::trace::{Batch, ElementPoints, GatherPass, Link, LinkRange, TraceCounts};
use crate::geometry::enclosure;
use crate::illumination::{Chart, Receiver};
use crate::progress::{Control, Progress};
use crate::scene::Scene;
use crate::transport::Tracer;

/// Rays per element in the first pass. The second has as many, and each further one as many as all before it.
const FIRST_RAYS: u32 = 16;

/// Minimum number of passes per element, 64 rays: fewer may miss a small bright spot and then see no error either.
pub const MIN_PASSES: u8 = 3;

/// Maximum number of passes per element: 4,096 rays.
pub const MAX_PASSES: u8 = 9;

/// Elements and the rays between them.
#[derive(Clone, Debug)]
pub struct Network {
    grids: Vec<Grid>,
    /// The grid of each receiver.
    by_receiver: Vec<Option<u32>>,
    points: Vec<ElementPoints>,
    closed: Vec<bool>,
    /// Whether the inside of each object is drawn and holds another object.
    rooms: Vec<bool>,
    batches: Vec<Vec<Link>>,
    /// By pass, then by element: the number of its batch, and its links there.
    rows: Vec<Vec<Option<(u32, LinkRange)>>>,
    counts: TraceCounts,
}

impl Network {
    /// Elements of all receivers, one chart each at the size of its grid; no rays yet.
    pub fn new(scene: &Scene, charts: &[Arc<Chart>]) -> Self {
        // Grids are built on all threads, and numbered once the element counts of all grids before them are known.
        let unnumbered: Vec<Grid> = charts
            .par_iter()
            .map(|chart| Grid::new(scene, chart, 0))
            .collect();
        let mut by_receiver = vec![None; Receiver::all(scene.objects.len()).count()];
        let mut first = 0;
        let mut grids = Vec::with_capacity(unnumbered.len());
        for (number, grid) in unnumbered.into_iter().enumerate() {
            by_receiver[grid.chart.receiver.index()] = Some(number as u32);
            let count = grid.elements.all().len();
            grids.push(Grid { first, ..grid });
            first += count;
        }

        // A closed body hides the points within it. A room does not: its inside is drawn and holds other objects.
        let is_closed = |object: usize| {
            let mesh = scene.objects[object].copy_in_scene();
            enclosure::is_closed(&mesh.positions, &mesh.triangles)
        };
        let bounds: Vec<_> = scene.objects.iter().map(|object| object.bounds()).collect();
        // The middle of another object is within it, and not only an edge, as where walls overlap.
        let is_room = |object: usize| {
            let material = scene.material_of(object);
            let holds = |(low, high): (DVec3, DVec3), other: (DVec3, DVec3)| {
                let middle = 0.5 * (other.0 + other.1);
                middle.cmpgt(low).all() && middle.cmplt(high).all()
            };
            let mut others = (0..scene.objects.len()).filter(|&other| other != object);
            material.double_sided
                && material.is_opaque()
                && others.any(|other| {
                    bounds[object]
                        .zip(bounds[other])
                        .is_some_and(|(own, other)| holds(own, other))
                })
        };
        Self {
            grids,
            rooms: (0..scene.objects.len()).into_par_iter().map(is_room).collect(),
            by_receiver,
            points: vec![ElementPoints::Unknown; first],
            closed: (0..scene.objects.len()).into_par_iter().map(is_closed).collect(),
            batches: Vec::new(),
            rows: Vec::new(),
            counts: TraceCounts::default(),
        }
    }

    pub fn grids(&self) -> &[Grid] {
        &self.grids
    }

    pub fn element_count(&self) -> usize {
        self.points.len()
    }

    /// Whether an element lies inside a solid or sees nothing: others should not interpolate from it.
    pub fn is_hidden(&self, element: usize) -> bool {
        let sees_nothing = |pass: u8| self.row(element, pass).is_none_or(|(_, kept)| kept == 0);
        self.points[element] == ElementPoints::Inside || (0..MIN_PASSES).all(sees_nothing)
    }

    /// Links of an element in a pass, and the number of its rays that count; `None` if it was not traced.
    pub fn row(&self, element: usize, pass: u8) -> Option<(&[Link], u32)> {
        let (batch, row) = (*self.rows.get(usize::from(pass))?.get(element)?)?;
        let first = row.first as usize;
        let links = &self.batches[batch as usize][first..first + row.links as usize];
        Some((links, row.kept))
    }

    /// Rays of a typical element after this number of passes.
    pub fn rays_after(passes: u8) -> u32 {
        FIRST_RAYS << passes.saturating_sub(1)
    }

    pub fn counts(&self) -> TraceCounts {
        self.counts
    }

    fn bytes(&self) -> u64 {
        let rows = self.rows.iter().map(|rows| size_of_val(&rows[..]) as u64);
        let links = self.batches.iter().map(|links| size_of_val(&links[..]) as u64);
        self.grids.iter().map(Grid::bytes).sum::<u64>() + rows.sum::<u64>() + links.sum::<u64>()
    }

    /// Approximate memory once every element has its number of passes.
    pub fn bytes_after(&self, passes: &[u8]) -> u64 {
        let missing: u64 = (0..MAX_PASSES)
            .map(|pass| {
                let rays = u64::from(Self::rays_after(pass.max(1)));
                self.missing(passes, pass).len() as u64 * rays
            })
            .sum();
        self.bytes() + missing * size_of::<Link>() as u64
    }

    /// Elements that still lack a pass.
    fn missing(&self, passes: &[u8], pass: u8) -> Vec<u32> {
        (0..passes.len() as u32)
            .filter(|&element| passes[element as usize] > pass && self.row(element as usize, pass).is_none())
            .collect()
    }

    /// Traces whatever is missing for every element to have its number of passes. False if cancelled; complete passes
    /// are kept. The result depends neither on the number of threads nor on what was traced before.
    pub fn trace(
        &mut self,
        tracer: &Tracer,
        passes: &[u8],
        (max_depth, seed): (u32, u64),
        progress: &dyn Progress,
        control: &Control,
    ) -> bool {
        // The rays of a pass continue the sequence of all passes before it, so that together they are evenly spread.
        for pass in 0..passes.iter().copied().max().unwrap_or(0) {
            let elements = self.missing(passes, pass);
            if elements.is_empty() {
                continue;
            }
            let rays = if pass == 0 { 0 } else { Self::rays_after(pass) };
            let work = GatherPass {
                follower: Follower { tracer, max_depth },
                grids: &self.grids,
                by_receiver: &self.by_receiver,
                points: &self.points,
                closed: &self.closed,
                rooms: &self.rooms,
                seed,
                rays: (rays, Self::rays_after(pass + 1)),
            };

            // Only whole passes are kept: a cancelled one must not leave some elements with fewer rays than they claim.
            let Some(batch) = work.run(&elements, progress, control) else {
                return false;
            };
            self.keep(pass, &elements, batch);
        }
        true
    }

    fn keep(&mut self, pass: u8, elements: &[u32], batch: Batch) {
        let number = self.batches.len() as u32;
        while self.rows.len() <= usize::from(pass) {
            self.rows.push(vec![None; self.points.len()]);
        }
        for (&element, (row, points)) in elements.iter().zip(batch.rows) {
            self.rows[usize::from(pass)][element as usize] = Some((number, row));
            self.points[element as usize] = points;
        }
        self.batches.push(batch.links);
        self.counts += batch.counts;
    }
}
