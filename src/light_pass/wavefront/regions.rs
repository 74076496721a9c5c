//! Regions of a cell with one light path, bounded by corners, edge samples and cuts.

use glam::DVec2;

use super::band::{Corner, SampleId};
use super::cell::{Cell, EDGE_ENDS};
use super::edge::EdgeReach;

/// One corner of a region of a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// In the unit square.
    pub(super) square: DVec2,
    pub(super) sample: SampleId,
}

/// Outlines of the parts of a cell that a signature fills: the corners that have it, joined along edges that it fills
/// from end to end, and bounded by the cuts between.
pub(super) fn regions(
    cell: &Cell,
    reach: &impl Fn(usize, bool) -> EdgeReach,
    is_there: &impl Fn(usize) -> bool,
) -> Vec<Vec<Outline>> {
    let there: [bool; 4] = std::array::from_fn(is_there);
    // Side i of the outline runs from corner i to corner i + 1.
    const BACKWARDS: [bool; 4] = [false, false, true, true];
    let ahead: [Option<EdgeReach>; 4] =
        std::array::from_fn(|side| there[side].then(|| reach(side, BACKWARDS[side])));
    let behind: [Option<EdgeReach>; 4] = std::array::from_fn(|corner| {
        let side = (corner + 3) % 4;
        there[corner].then(|| reach(side, !BACKWARDS[side]))
    });
    let joined: [bool; 4] = std::array::from_fn(|side| {
        there[side] && there[(side + 1) % 4] && ahead[side] == Some(EdgeReach::Whole)
    });
    let mut outlines = Vec::new();
    if there == [true; 4] && joined.iter().filter(|joined| **joined).count() >= 3 {
        outlines.push(cell.corners.map(outline_of).to_vec());
        return outlines;
    }
    let mut used = [false; 4];
    for start in 0..4 {
        // A region starts at a corner that is not joined to the previous one.
        if !there[start] || used[start] || joined[(start + 3) % 4] {
            continue;
        }
        let mut outline = Vec::with_capacity(16);
        if let Some(reach) = behind[start] {
            let side = (start + 3) % 4;
            outline.extend(up_to_cut(cell, side, !BACKWARDS[side], reach).into_iter().rev());
        }
        let mut corner = start;
        loop {
            used[corner] = true;
            outline.push(outline_of(cell.corners[corner]));
            if !joined[corner] {
                break;
            }
            corner = (corner + 1) % 4;
        }
        if let Some(reach) = ahead[corner] {
            outline.extend(up_to_cut(cell, corner, BACKWARDS[corner], reach));
        }
        outlines.push(outline);
    }
    outlines
}

fn outline_of(corner: Corner) -> Outline {
    Outline {
        square: corner.square,
        sample: corner.sample,
    }
}

/// Samples along a side from a corner up to the cut, and the cut. Near a silhouette the wavefront bends like a square
/// root, and bisection left samples just where they are needed.
fn up_to_cut(cell: &Cell, side: usize, backwards: bool, reach: EdgeReach) -> Vec<Outline> {
    let EdgeReach::Cut {
        place,
        sample,
        between,
    } = reach
    else {
        return Vec::new();
    };
    let (from, to) = EDGE_ENDS[side];
    let at = |place: f64, sample: SampleId| Outline {
        square: cell.corners[from].square.lerp(cell.corners[to].square, place),
        sample,
    };
    let inner = cell.edges[side]
        .iter()
        .flat_map(|edge| edge.inner(between, backwards));
    inner
        .map(|(place, sample)| at(place, sample))
        .chain([at(place, sample)])
        .collect()
}

/// Splits an outline into a strip of triangles between its two ends, always across the shorter diagonal.
pub(super) fn triangles(region: &[Outline]) -> Vec<[Outline; 3]> {
    let (mut first, mut last) = (0, region.len().saturating_sub(1));
    let mut strip = Vec::with_capacity(region.len());
    while first + 1 < last {
        let [a, b] = [region[first], region[last]];
        let (after, before) = (region[first + 1], region[last - 1]);
        if after.square.distance_squared(b.square) <= a.square.distance_squared(before.square) {
            strip.push([a, after, b]);
            first += 1;
        } else {
            strip.push([a, before, b]);
            last -= 1;
        }
    }
    strip
}
