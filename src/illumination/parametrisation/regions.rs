//! Cuts a bent surface into pieces that lie nearly flat.

use std::collections::{HashMap, VecDeque};

use glam::{DVec2, DVec3};
use rayon::slice::ParallelSliceMut;

use super::overlap::overlaps;
use super::plane::{Rectangle, smallest_rectangle};
use crate::scene::Mesh;

/// Cosine of the largest angle between a piece's axis and its triangles: 40°, at which a projected length shrinks by
/// at most a quarter.
const COS_CONE: f64 = 0.766_044_443_118_978;

/// Side of the overlap raster for one piece.
const RASTER_SIDE: usize = 32;

/// Connected triangles that project onto one plane without overlap.
#[derive(Debug)]
pub struct Region {
    /// Indices of triangles with area.
    pub triangles: Vec<u32>,
    /// The rectangle around their projection.
    pub rectangle: Rectangle,
}

/// Cuts a mesh into regions, the largest triangles first. Triangles without area are in none.
pub fn grow(mesh: &Mesh) -> Vec<Region> {
    let neighbours = Neighbours::of(mesh);
    let count = mesh.triangles.len();
    let area = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle);
        (b - a).cross(c - a).length()
    };
    let mut taken: Vec<bool> = (0..count).map(|triangle| area(triangle) == 0.0).collect();
    let mut seeds: Vec<(f64, u32)> = (0..count)
        .map(|triangle| (area(triangle), triangle as u32))
        .collect();
    seeds.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut regions = Vec::new();
    for (_, seed) in seeds {
        if taken[seed as usize] {
            continue;
        }
        let axis = mesh.face_normal(seed as usize);
        let triangles = grow_from(seed, axis, mesh, &neighbours, &mut taken);
        flatten(mesh, triangles, axis, &mut regions);
    }
    regions
}

/// Triangles that are connected with the seed and face within the cone around its normal, in breadth-first order.
fn grow_from(seed: u32, axis: DVec3, mesh: &Mesh, neighbours: &Neighbours, taken: &mut [bool]) -> Vec<u32> {
    let mut found = Vec::new();
    let mut queue = VecDeque::from([seed]);
    taken[seed as usize] = true;
    while let Some(triangle) = queue.pop_front() {
        found.push(triangle);
        for &next in neighbours.around(triangle) {
            if !taken[next as usize] && mesh.face_normal(next as usize).dot(axis) >= COS_CONE {
                taken[next as usize] = true;
                queue.push_back(next);
            }
        }
    }
    found
}

/// Lays triangles onto the plane; where they overlap there, halves are laid down on their own. One triangle alone
/// cannot overlap, so that this ends.
fn flatten(mesh: &Mesh, triangles: Vec<u32>, axis: DVec3, regions: &mut Vec<Region>) {
    let mut waiting = vec![triangles];
    while let Some(mut triangles) = waiting.pop() {
        let points: Vec<DVec3> = triangles
            .iter()
            .flat_map(|&triangle| mesh.corners(triangle as usize))
            .collect();
        let rectangle = smallest_rectangle(&points, axis);
        // Two neighbours that both face the axis lie on either side of their common edge.
        if triangles.len() > 2 && overlaps(&unit_coordinates(mesh, &triangles, &rectangle), RASTER_SIDE) {
            let second_half = triangles.split_off(triangles.len() / 2);
            waiting.push(second_half);
            waiting.push(triangles);
        } else {
            regions.push(Region { triangles, rectangle });
        }
    }
}

fn unit_coordinates(mesh: &Mesh, triangles: &[u32], rectangle: &Rectangle) -> Vec<[DVec2; 3]> {
    triangles
        .iter()
        .map(|&triangle| {
            mesh.corners(triangle as usize)
                .map(|corner| (rectangle.frame.project(corner) - rectangle.low) / rectangle.size)
        })
        .collect()
}

/// Which triangles share an edge; vertices at the same position are one.
struct Neighbours {
    first: Vec<u32>,
    list: Vec<u32>,
}

impl Neighbours {
    fn of(mesh: &Mesh) -> Self {
        let vertices = weld(&mesh.positions);
        let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.triangles.len());
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let welded = triangle.map(|vertex| vertices[vertex as usize]);
            for corner in 0..3 {
                let (a, b) = (welded[corner], welded[(corner + 1) % 3]);
                edges.push((a.min(b), a.max(b), index as u32));
            }
        }
        edges.par_sort_unstable();
        // An edge of more than two triangles is a border: there is no telling which two go on into each other.
        let pairs: Vec<(u32, u32)> = edges
            .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
            .filter_map(|edge| match edge {
                [a, b] => Some((a.2, b.2)),
                _ => None,
            })
            .collect();
        let mut first = vec![0u32; mesh.triangles.len() + 1];
        for &(a, b) in &pairs {
            first[a as usize + 1] += 1;
            first[b as usize + 1] += 1;
        }
        for index in 1..first.len() {
            first[index] += first[index - 1];
        }
        let mut next = first.clone();
        let mut list = vec![0; 2 * pairs.len()];
        for &(a, b) in &pairs {
            for (from, to) in [(a, b), (b, a)] {
                list[next[from as usize] as usize] = to;
                next[from as usize] += 1;
            }
        }
        Self { first, list }
    }

    fn around(&self, triangle: u32) -> &[u32] {
        let triangle = triangle as usize;
        &self.list[self.first[triangle] as usize..self.first[triangle + 1] as usize]
    }
}

/// For every vertex the first one at the same position.
fn weld(positions: &[DVec3]) -> Vec<u32> {
    let mut first_at: HashMap<[u64; 3], u32> = HashMap::with_capacity(positions.len());
    positions
        .iter()
        .enumerate()
        .map(|(index, position)| {
            // Adding zero makes −0 and +0 the same bits.
            let key = (*position + DVec3::ZERO).to_array().map(f64::to_bits);
            *first_at.entry(key).or_insert(index as u32)
        })
        .collect()
}
