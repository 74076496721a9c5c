//! Traces rays from every element. Their ends are rows of a sparse matrix.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::grid::{Grid, cosine_direction};
use super::path::Follower;
use crate::geometry::sampling::{GOLDEN_64, even_point, mix64};
use crate::illumination::Receiver;
use crate::optics::LinearSrgb;
use crate::progress::{Control, Progress, Stage};
use crate::scene::Mesh;
use crate::transport::{MediumStack, Tracer, media_at};

/// The contribution of one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Number of the element that sends the light.
    pub element: u32,
    /// E at the start of the ray over E at that element, per channel, for this ray alone.
    pub weight: [f32; 3],
}

/// The links of one element in one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkRange {
    /// Index of the first link in its batch.
    pub first: u64,
    /// Number of links.
    pub links: u32,
    /// Rays that count, including those that found nothing.
    pub kept: u32,
}

/// The rays of some elements.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// Links of all elements.
    pub links: Vec<Link>,
    /// By element, in their order.
    pub rows: Vec<(LinkRange, ElementPoints)>,
    pub counts: TraceCounts,
}

/// Which points of an element send rays: its surface may lie partly inside a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ElementPoints {
    /// Not traced yet.
    #[default]
    Unknown,
    /// Those outside of solids.
    Outside,
    /// Those inside a solid: there are no others, or few.
    Inside,
}

/// Counts of a pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct TraceCounts {
    /// Rays sent by elements.
    pub rays: u64,
    /// Segments traced for them.
    pub segments: u64,
    /// Weight that was truncated, summed over rays.
    pub truncated: f64,
    /// Rays that hit a grid where it has no element.
    pub lost: u64,
}

impl std::ops::AddAssign for TraceCounts {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.segments += other.segments;
        self.truncated += other.truncated;
        self.lost += other.lost;
    }
}

/// Elements per task.
const CHUNK: usize = 32;

/// Maximum number of times that the rays of an element smaller than usual on its grid are halved.
const MAX_HALVINGS: u32 = 3;

/// Inputs of a pass.
pub struct GatherPass<'a> {
    pub follower: Follower<'a>,
    pub grids: &'a [Grid],
    /// The grid of each receiver.
    pub by_receiver: &'a [Option<u32>],
    pub points: &'a [ElementPoints],
    /// Whether each object's mesh is closed.
    pub closed: &'a [bool],
    /// Whether the inside of each object is drawn and holds another object.
    pub rooms: &'a [bool],
    pub seed: u64,
    /// Range of a typical element's ray indices; both ends are powers of two or 0.
    pub rays: (u32, u32),
}

/// A ray with its links.
struct RayEnd {
    links: std::ops::Range<usize>,
    /// Present if it started inside a solid: whether that is a room.
    within: Option<bool>,
}

impl GatherPass<'_> {
    /// Traces the rays of some elements; `None` if cancelled.
    pub fn run(&self, elements: &[u32], progress: &dyn Progress, control: &Control) -> Option<Batch> {
        // Chunks are traced on all threads and joined in their order: the result does not depend on the number of
        // threads.
        let has_bodies = self.has_bodies();
        let chunks = elements.len().div_ceil(CHUNK);
        let done = AtomicU64::new(0);
        let parts: Option<Vec<Batch>> = elements
            .par_chunks(CHUNK)
            .map(|chunk| {
                if control.is_cancelled() {
                    return None;
                }
                let mut part = Batch::default();
                for &element in chunk {
                    self.element(element as usize, has_bodies, &mut part);
                }
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress.advance(Stage::Indirect, done, chunks as u64);
                Some(part)
            })
            .collect();

        // Rows refer to links of their own chunk. They move by the links of all chunks before it.
        let mut all = Batch::default();
        for part in parts? {
            let before = all.links.len() as u64;
            let moved = |(row, points): (LinkRange, ElementPoints)| {
                let first = row.first + before;
                (LinkRange { first, ..row }, points)
            };
            all.rows.extend(part.rows.into_iter().map(moved));
            all.links.extend(part.links);
            all.counts += part.counts;
        }
        Some(all)
    }

    fn tracer(&self) -> &Tracer {
        self.follower.tracer
    }

    fn has_bodies(&self) -> bool {
        let scene = self.tracer().scene();
        (0..scene.objects.len()).any(|object| scene.material_of(object).is_solid())
    }

    fn element(&self, number: usize, has_bodies: bool, part: &mut Batch) {
        // Rays start in the medium around the element: its index decides what a coat reflects, and it absorbs on the
        // way.
        let grid = &self.grids[self.grids.partition_point(|grid| grid.first <= number) - 1];
        let element = number - grid.first;
        let mesh = self.tracer().scene().objects[grid.chart.object()].mesh_in_scene();
        let media = if has_bodies {
            self.media(grid, mesh, element)
        } else {
            MediumStack::default()
        };

        // Elements smaller than usual get fewer rays. A halved range of indices is aligned as before, and so evenly
        // spread.
        let seed = self.seed_of(grid, element);
        let halvings = (grid.usual_m2 / grid.elements.all()[element].area_m2)
            .log2()
            .floor();
        let halvings = halvings.clamp(0.0, f64::from(MAX_HALVINGS)) as u32;
        let first_link = part.links.len();
        let mut ends = Vec::new();
        for index in self.rays.0 >> halvings..self.rays.1 >> halvings {
            if let Some(end) = self.ray((grid, mesh, element), index, (seed, media), part) {
                ends.push(end);
            }
        }

        // The first pass decides whether points within a solid count. Later passes keep to it, so that all rows of an
        // element sample the same part of it.
        let points = match self.points[number] {
            ElementPoints::Unknown => points_of(&ends),
            known => known,
        };
        let kept = self.keep(points, &ends, first_link, part);
        let row = LinkRange {
            first: first_link as u64,
            links: (part.links.len() - first_link) as u32,
            kept,
        };
        part.rows.push((row, points));
    }

    /// Drops the links of rays that started on the wrong side; returns the number of rays that are left.
    fn keep(&self, points: ElementPoints, ends: &[RayEnd], first_link: usize, part: &mut Batch) -> u32 {
        let wanted = |end: &RayEnd| end.within.is_some() == (points == ElementPoints::Inside);
        if !ends.iter().all(wanted) {
            let links: Vec<Link> = ends
                .iter()
                .filter(|end| wanted(end))
                .flat_map(|end| part.links[end.links.clone()].iter().copied())
                .collect();
            part.links.truncate(first_link);
            part.links.extend(links);
        }
        ends.iter().filter(|end| wanted(end)).count() as u32
    }

    fn ray(
        &self,
        (grid, mesh, element): (&Grid, &Mesh, usize),
        index: u32,
        (seed, media): (u64, MediumStack),
        part: &mut Batch,
    ) -> Option<RayEnd> {
        // With points uniform by area and directions weighted by the cosine, each ray estimates E as π·L.
        let point = grid.point(mesh, element, even_point(index, 0, seed))?;
        let direction = cosine_direction(&point, even_point(index, 1, seed));

        // The coat of the receiving surface reflects part of what arrives at this angle.
        let own = grid.chart.object();
        let response = self
            .tracer()
            .diffuse_response(own, point.triangle, point.barycentric);
        let ior_around = media.ior(self.tracer().scene());
        let share = response.of(direction.dot(point.shading_normal), ior_around);

        // Each diffuse surface on the path becomes a link, weighted by the E that it causes here per E of its own.
        let first = part.links.len();
        let (links, counts) = (&mut part.links, &mut part.counts);
        let found = self.follower.follow(
            point.spawn(direction),
            media,
            |choice| even_point(index, 2 + choice, seed),
            |hit, side, weight| {
                let Some(sender) = self.by_receiver[Receiver::new(hit.object, side).index()] else {
                    return;
                };
                match self.grids[sender as usize].element_at(hit.triangle, hit.barycentric) {
                    Some(element) if weight != LinearSrgb::BLACK => links.push(Link {
                        element: element as u32,
                        weight: (weight * share).to_array().map(|channel| channel as f32),
                    }),
                    Some(_) => {}
                    None => counts.lost += 1,
                }
            },
        );
        counts.rays += 1;
        counts.segments += found.segments;
        counts.truncated += found.truncated;

        // A ray that first meets the back of a closed opaque body started within that body.
        let within = found
            .first_back
            .filter(|&object| object != own && self.closed[object]);
        Some(RayEnd {
            links: first..part.links.len(),
            within: within.map(|object| self.rooms[object]),
        })
    }

    fn media(&self, grid: &Grid, mesh: &Mesh, element: usize) -> MediumStack {
        let middle = glam::DVec2::splat(0.5);
        match grid.point(mesh, element, middle) {
            Some(point) => media_at(self.tracer(), point.spawn(point.geometric_normal).origin),
            None => MediumStack::default(),
        }
    }

    /// Distinguishes the elements of all grids, whatever else is in the scene.
    fn seed_of(&self, grid: &Grid, element: usize) -> u64 {
        let element = grid.elements.all()[element];
        let place = (grid.chart.receiver.index() as u64) << 40 ^ u64::from(element.texel);
        let hash = |code: u64| mix64(code.wrapping_add(GOLDEN_64));
        hash(place ^ hash(u64::from(element.piece) ^ hash(self.seed)))
    }
}

/// Outside, unless all points lie inside a solid, or most do and it is a room.
fn points_of(ends: &[RayEnd]) -> ElementPoints {
    let within = ends.iter().filter(|end| end.within.is_some()).count();
    let is_room = ends.iter().any(|end| end.within == Some(true));
    if within > 0 && (within == ends.len() || is_room && 2 * within > ends.len()) {
        ElementPoints::Inside
    } else {
        ElementPoints::Outside
    }
}
