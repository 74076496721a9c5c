//! Seams of charts: texels beyond the border of a chart take the light of the place where the surface continues, so
//! that look-ups agree on both sides of the seam.

use glam::{DMat2, DVec2, DVec3};

use super::chart::uv_from_world;
use crate::scene::{Adjacency, Mesh};

/// Width of the border that is filled [texels]: a bilinear lookup reaches one texel, a coarser level two.
const REACH_TEXELS: f64 = 2.5;

/// Distance up to which ends of edges coincide in the map, relative to its side.
const SAME_PLACE: f64 = 1e-9;

/// Normals on both sides of an edge that are further apart, by the cosine of 10°, make it a crease. What light one side
/// has tells little about the other: a wall is dark beside its sunlit end.
const CREASE_COS: f64 = 0.985;

/// An edge of a triangle at which its chart ends although the mesh continues smoothly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// Ends of the edge in the map [0, 1].
    ends: [DVec2; 2],
    /// The triangle's third corner in the map [0, 1]; the edge faces away from it.
    inner: DVec2,
    /// Map coordinates of the edge's first end in the neighbour's chart.
    there: DVec2,
    /// Maps displacements in the map on this side to those on the other, with the surface unfolded at the edge.
    steps: DMat2,
}

/// An uncovered texel, and the point of the map that belongs there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamTexel {
    /// Row·width + column.
    pub texel: usize,
    /// Map coordinates [0, 1].
    pub uv: DVec2,
}

/// Two texels that touch on the surface, but have no uncovered texel beside them in the map that could stand for the
/// other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamTexels {
    /// Row·width + column of both.
    pub texels: [usize; 2],
    /// Fraction of a texel's side along which they touch.
    pub share: f64,
}

/// The seams of a mesh with given map coordinates.
pub fn find(mesh: &Mesh, corner_uvs: &[[DVec2; 3]]) -> Vec<Seam> {
    let adjacency = Adjacency::of(mesh);
    let edges = (0..mesh.triangles.len()).flat_map(|triangle| (0..3).map(move |edge| (triangle, edge)));
    edges
        .filter_map(|(triangle, edge)| {
            let beyond = adjacency.beyond(triangle, edge)?;
            Seam::at(mesh, corner_uvs, (triangle, edge), beyond)
        })
        .collect()
}

impl Seam {
    /// `None` if the chart continues across the edge, or the edge is a crease.
    fn at(
        mesh: &Mesh,
        corner_uvs: &[[DVec2; 3]],
        (triangle, edge): (usize, usize),
        (beyond, second): (usize, usize),
    ) -> Option<Self> {
        // The chart continues where both triangles give the edge the same place in the map.
        let here = mesh.corners(triangle);
        let there = mesh.corners(beyond);
        let (next, first) = ((edge + 1) % 3, (second + 1) % 3);
        let uvs = corner_uvs[triangle];
        let other = corner_uvs[beyond];
        let goes_on =
            uvs[edge].distance(other[first]) <= SAME_PLACE && uvs[next].distance(other[second]) <= SAME_PLACE;
        if goes_on
            || is_crease(
                mesh,
                [(triangle, edge), (beyond, first)],
                [(triangle, next), (beyond, second)],
            )
        {
            return None;
        }

        // The edge and its perpendicular in each triangle's plane are the frame in which the surface unfolds.
        let along = (here[next] - here[edge]).try_normalize()?;
        // Perpendicular to the edge, away from the third corner.
        let away =
            |third: DVec3| (along * (third - here[edge]).dot(along) - (third - here[edge])).try_normalize();
        let inner = (edge + 2) % 3;
        let out_here = away(here[inner])?;
        let out_there = -away(there[(second + 2) % 3])?;

        // Each triangle takes this frame to map coordinates. Back from those of the near one and on to those of the far
        // one leads across the seam.
        let map = |uvs, corners, out| {
            let rows = uv_from_world(uvs, corners)?;
            let column = |step: DVec3| DVec2::new(rows[0].dot(step), rows[1].dot(step));
            Some(DMat2::from_cols(column(along), column(out)))
        };
        let (near, far) = (map(uvs, here, out_here)?, map(other, there, out_there)?);
        let steps = far * near.inverse();
        steps.is_finite().then_some(Self {
            ends: [uvs[edge], uvs[next]],
            inner: uvs[inner],
            there: other[first],
            steps,
        })
    }
}

/// Whether the normals of two triangles differ at either end of their edge, given as corners of both.
fn is_crease(mesh: &Mesh, start: [(usize, usize); 2], end: [(usize, usize); 2]) -> bool {
    let normal =
        |(triangle, corner): (usize, usize)| mesh.corner_normals(triangle)[corner].normalize_or_zero();
    [start, end]
        .into_iter()
        .any(|[here, there]| normal(here).dot(normal(there)) < CREASE_COS)
}

/// A seam in texels: its ends, and unit vectors along it and out of the chart.
struct SeamInTexels {
    a: DVec2,
    b: DVec2,
    along: DVec2,
    out: DVec2,
}

impl Seam {
    /// `None` if it has no length in the map.
    fn laid(&self, size: DVec2) -> Option<SeamInTexels> {
        let [a, b] = self.ends.map(|end| end * size);
        let along = (b - a).try_normalize()?;
        let mut out = along.perp();
        if out.dot(self.inner * size - a) > 0.0 {
            out = -out;
        }
        Some(SeamInTexels { a, b, along, out })
    }
}

/// Pairs of texels that touch along seams without a gutter, each pair once, in ascending order.
pub fn joints(
    seams: &[Seam],
    (width, height): (usize, usize),
    is_covered: impl Fn(usize) -> bool,
) -> Vec<SeamTexels> {
    let size = DVec2::new(width as f64, height as f64);
    let texel_at = |place: DVec2| {
        let inside = place.cmpge(DVec2::ZERO).all() && place.cmplt(size).all();
        inside.then(|| place.y as usize * width + place.x as usize)
    };

    // Where the map has an uncovered texel half a texel outside, that one serves as gutter; elsewhere the texels on
    // both sides of the seam are joined.
    let mut found: Vec<([usize; 2], f64)> = Vec::new();
    for seam in seams {
        let Some(SeamInTexels { a, b, along, out }) = seam.laid(size) else {
            continue;
        };
        let length = a.distance(b);
        let count = (4.0 * length).ceil().max(1.0);
        for index in 0..count as usize {
            let place = a + along * (length * (index as f64 + 0.5) / count);
            let beyond = texel_at(place + out * 0.5);
            let has_room = beyond.is_some_and(|texel| !is_covered(texel));
            let here = texel_at(place - out * 1e-3);
            let other = (seam.there + seam.steps * ((place + out * 1e-3 - a) / size)) * size;
            if let (false, Some(here), Some(there)) = (has_room, here, texel_at(other)) {
                let texels = [here.min(there), here.max(there)];
                if here != there && texels.iter().all(|texel| is_covered(*texel)) {
                    // Each seam is found from both sides.
                    found.push((texels, 0.5 * length / count));
                }
            }
        }
    }

    // The lengths along which a pair touches add up, in a fixed order of the floats.
    found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let pairs = found.chunk_by(|a, b| a.0 == b.0);
    let joint = |pair: &[([usize; 2], f64)]| SeamTexels {
        texels: pair[0].0,
        share: pair.iter().map(|(_, share)| share).sum::<f64>().min(1.0),
    };
    pairs.map(joint).collect()
}

/// Uncovered texels beside the seams of a map, each with its nearest seam, in ascending order.
pub fn texels(
    seams: &[Seam],
    (width, height): (usize, usize),
    is_covered: impl Fn(usize) -> bool,
) -> Vec<SeamTexel> {
    let size = DVec2::new(width as f64, height as f64);
    // Distance from the seam, and the texel.
    let mut found: Vec<(f64, SeamTexel)> = Vec::new();
    for seam in seams {
        let Some(SeamInTexels { a, b, along, out }) = seam.laid(size) else {
            continue;
        };
        let length = a.distance(b);

        // Uncovered texels whose centres lie outside of the edge and within reach, past its ends included.
        let low = (a.min(b) - REACH_TEXELS - 0.5).floor().max(DVec2::ZERO);
        let high = (a.max(b) + REACH_TEXELS + 0.5).ceil().min(size);
        for row in low.y as usize..(high.y.max(0.0)) as usize {
            for column in low.x as usize..(high.x.max(0.0)) as usize {
                let texel = row * width + column;
                let step = DVec2::new(column as f64, row as f64) + 0.5 - a;
                let (beside, beyond) = (step.dot(along), step.dot(out));
                let past = (-beside).max(beside - length).max(0.0);
                if !(0.0..=REACH_TEXELS).contains(&beyond) || past > REACH_TEXELS || is_covered(texel) {
                    continue;
                }

                // The displacement from the edge unfolds into the neighbour's chart.
                let uv = seam.there + seam.steps * (step / size);
                if uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all() {
                    found.push((beyond.hypot(past), SeamTexel { texel, uv }));
                }
            }
        }
    }

    // Of several seams in reach of a texel, the nearest wins.
    found.sort_by(|a, b| a.1.texel.cmp(&b.1.texel).then(a.0.total_cmp(&b.0)));
    found.dedup_by_key(|(_, texel)| texel.texel);
    found.into_iter().map(|(_, texel)| texel).collect()
}
