//! Edges of cells: bisection with light rays finds where along an edge the light path changes.

use glam::{DVec2, DVec3};

use super::band::{Corner, SampleId, Workspace};
use super::lattice_ray::{LatticeRay, PathSegment};
use super::trace::StrandTracer;
use crate::light_pass::path::PathSignature;

/// An edge with more changes of the path than this is bisected more coarsely.
const MANY_CHANGES: usize = 12;

/// Bisections in that case.
const SHATTERED_BITS: i32 = 3;

/// Bisections that decide whether both ends of the brightest light lie on one sheet of the wavefront. Where light takes
/// very many paths, dimmer light gets fewer.
const JUMP_BITS: i32 = 6;

/// Mismatch of chord and tangents, relative to the chord, above which derivatives are not trusted.
pub const SUSPICION: f64 = 0.35;

/// Ratio of a step's length to that predicted by both derivatives above which an edge may hide a jump. Kinks, folds and
/// square roots at silhouettes stay below.
const SUSPICIOUS_STRETCH: f64 = 1.5;

/// Likewise over the narrowest bracket: above it, the sheet is torn.
const TORN_STRETCH: f64 = 3.0;

/// Samples along an edge by position [0, 1], both ends included.
#[derive(Clone, Debug)]
pub struct Edge {
    /// Ascending by position.
    pub samples: Vec<(f64, SampleId)>,
}

/// How far a segment reaches along an edge from one of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EdgeReach {
    /// To the other end, on one sheet.
    Whole,
    /// Up to a cut.
    Cut {
        /// Middle of the bracket, as a position on the edge.
        place: f64,
        /// Last sample before the cut.
        sample: SampleId,
        /// Number of samples between the end and that one.
        between: usize,
    },
}

/// The step between two segments and the steps that their derivatives predict [m]: lengths combine origins with
/// directions times the distance to the landing point.
struct Step {
    chord: f64,
    tangents: [f64; 2],
    /// Deviation from the mean of both tangents.
    off_mean: f64,
}

impl Step {
    /// `step` is the vector between the segments in the unit square.
    fn between(a: &PathSegment, b: &PathSegment, step: DVec2) -> Self {
        let reach_m = [a, b]
            .map(|segment| segment.landing.distance_m())
            .into_iter()
            .filter(|distance| distance.is_finite())
            .fold(0.0, f64::max);
        let reach_m = if reach_m > 0.0 { reach_m } else { 1.0 };
        let length = |origin: DVec3, direction: DVec3| origin.length() + reach_m * direction.length();
        let tangent = |segment: &PathSegment| {
            let d = &segment.differential;
            (
                d.across.origin * step.x + d.down.origin * step.y,
                d.across.direction * step.x + d.down.direction * step.y,
            )
        };
        let (origin, direction) = (b.ray.origin - a.ray.origin, b.ray.direction - a.ray.direction);
        let ((oa, da), (ob, db)) = (tangent(a), tangent(b));
        Self {
            chord: length(origin, direction),
            tangents: [length(oa, da), length(ob, db)],
            off_mean: length(origin - (oa + ob) * 0.5, direction - (da + db) * 0.5),
        }
    }
}

/// Relative mismatch between the step from one segment to another and the mean prediction of their derivatives; `step`
/// is the vector between them in the unit square. 0 where the wavefront is a parabola between them.
pub fn mismatch(a: &PathSegment, b: &PathSegment, step: DVec2) -> f64 {
    let Step { chord, off_mean, .. } = Step::between(a, b, step);
    if off_mean <= chord * 1e-12 {
        0.0
    } else if chord > 0.0 && off_mean.is_finite() {
        off_mean / chord
    } else {
        // Also for non-finite derivatives.
        f64::INFINITY
    }
}

/// Ratio of the step between two segments to the longer of the steps that their derivatives predict.
fn stretch(a: &PathSegment, b: &PathSegment, step: DVec2) -> f64 {
    let Step { chord, tangents, .. } = Step::between(a, b, step);
    let longest = tangents[0].max(tangents[1]);
    // Parallel light does not move at all.
    if chord <= longest { 0.0 } else { chord / longest }
}

fn is_stretched(a: &LatticeRay, b: &LatticeRay, signature: PathSignature, step: DVec2, most: f64) -> bool {
    match (a.find(signature), b.find(signature)) {
        (Some(i), Some(j)) => stretch(&a.segments[i], &b.segments[j], step) > most,
        _ => false,
    }
}

/// Width of the narrowest bracket of a jump, relative to its edge, for light with this share of the edge's brightest.
fn narrowest(share: f64) -> f64 {
    let bits = JUMP_BITS + share.log2().floor().max(-60.0) as i32;
    (-f64::from(bits.clamp(0, JUMP_BITS))).exp2()
}

/// Whether a segment's step is long enough to hide a jump.
pub fn is_suspicious(a: &LatticeRay, b: &LatticeRay, signature: PathSignature, step: DVec2) -> bool {
    is_stretched(a, b, signature, step, SUSPICIOUS_STRETCH)
}

/// Whether light takes the same paths at two samples.
pub fn same_ways(a: &LatticeRay, b: &LatticeRay) -> bool {
    a.segments.len() == b.segments.len()
        && a.nodes.len() == b.nodes.len()
        && a.segments
            .iter()
            .zip(&b.segments)
            .all(|(a, b)| a.signature == b.signature)
        && a.nodes
            .iter()
            .zip(&b.nodes)
            .all(|(a, b)| a.signature == b.signature)
}

impl Edge {
    /// An edge without samples between its ends.
    pub fn plain(a: SampleId, b: SampleId) -> Self {
        Self {
            samples: vec![(0.0, a), (1.0, b)],
        }
    }

    /// Whether light takes the same paths at both ends, on one sheet.
    pub fn is_plain(a: &LatticeRay, b: &LatticeRay, step: DVec2) -> bool {
        same_ways(a, b)
            && a.segments
                .iter()
                .zip(&b.segments)
                .all(|(a, b)| stretch(a, b, step) <= SUSPICIOUS_STRETCH)
    }

    /// Part of an edge between the positions of two of its samples, as an edge of its own.
    pub fn part(&self, from: f64, to: f64) -> Self {
        let width = to - from;
        Self {
            samples: self
                .samples
                .iter()
                .filter(|(place, _)| *place >= from && *place <= to)
                .map(|(place, sample)| ((place - from) / width, *sample))
                .collect(),
        }
    }

    /// Joins two edges of equal length.
    fn followed_by(&self, next: &Self) -> Self {
        let first = self.samples.iter().map(|(place, sample)| (0.5 * place, *sample));
        let second = next.samples.iter().skip(1);
        Self {
            samples: first
                .chain(second.map(|(place, sample)| (0.5 + 0.5 * place, *sample)))
                .collect(),
        }
    }

    /// Sample at a position; `None` without one.
    pub fn at(&self, place: f64) -> Option<SampleId> {
        self.samples
            .iter()
            .find(|(p, _)| *p == place)
            .map(|(_, sample)| *sample)
    }

    /// How far a segment reaches from the first end (or, `backwards`, from the last), where it has to exist.
    pub fn reach(
        &self,
        work: &Workspace,
        signature: PathSignature,
        step: DVec2,
        backwards: bool,
    ) -> EdgeReach {
        let narrowest = narrowest(self.share(work, signature));
        self.reach_where(
            work,
            backwards,
            |sample| sample.find(signature).is_some(),
            |a, b, width| width <= narrowest && is_stretched(a, b, signature, step * width, TORN_STRETCH),
        )
    }

    /// Flux of a segment at the first end that has it, relative to the brightest at either end; 1 where neither has it,
    /// and where light takes so few paths that each counts.
    fn share(&self, work: &Workspace, signature: PathSignature) -> f64 {
        let ends = [0, self.samples.len() - 1].map(|end| work.get(self.samples[end].1));
        let brightest_w = ends[0].brightest_w.max(ends[1].brightest_w);
        let flux_w = |sample: &LatticeRay| Some(sample.segments[sample.find(signature)?].flux_w.luminance());
        if ends.iter().all(|sample| sample.segments.len() <= MANY_CHANGES) {
            return 1.0;
        }
        ends.into_iter()
            .find_map(flux_w)
            .map_or(1.0, |flux_w| flux_w / brightest_w)
    }

    /// How far a surface reaches that light hits.
    pub fn reach_of_node(&self, work: &Workspace, signature: PathSignature, backwards: bool) -> EdgeReach {
        self.reach_where(
            work,
            backwards,
            |sample| sample.find_node(signature).is_some(),
            |_, _, _| false,
        )
    }

    fn reach_where(
        &self,
        work: &Workspace,
        backwards: bool,
        is_there: impl Fn(&LatticeRay) -> bool,
        is_jump: impl Fn(&LatticeRay, &LatticeRay, f64) -> bool,
    ) -> EdgeReach {
        let last = self.samples.len() - 1;
        let at = |index: usize| self.samples[if backwards { last - index } else { index }];
        for index in 0..last {
            let (here, there) = (at(index), at(index + 1));
            let ordered = if backwards { (there, here) } else { (here, there) };
            let (a, b) = (work.get(ordered.0.1), work.get(ordered.1.1));
            let next = work.get(there.1);
            if !is_there(next) || is_jump(a, b, ordered.1.0 - ordered.0.0) {
                return EdgeReach::Cut {
                    place: 0.5 * (here.0 + there.0),
                    sample: here.1,
                    between: index.saturating_sub(1),
                };
            }
        }
        EdgeReach::Whole
    }

    /// The `count` samples after the first end (or, `backwards`, before the last), nearest to that end first.
    pub fn inner(
        &self,
        count: usize,
        backwards: bool,
    ) -> impl DoubleEndedIterator<Item = (f64, SampleId)> + '_ {
        let last = self.samples.len() - 1;
        (1..=count).map(move |step| self.samples[if backwards { last - step } else { step }])
    }

    /// How often a segment appears or disappears along the edge.
    pub fn changes(&self, work: &Workspace, signature: PathSignature) -> usize {
        self.samples
            .windows(2)
            .filter(|pair| {
                work.get(pair[0].1).find(signature).is_some() != work.get(pair[1].1).find(signature).is_some()
            })
            .count()
    }
}

/// Light below this share of the brightest makes no bulge.
const BULGE_SHARE: f64 = 0.1;

/// Whether the border of some light may bulge over an edge that has the light at both ends or at neither, given two
/// samples beyond the edge.
pub fn may_bulge(ends: [&LatticeRay; 2], beyond: [&LatticeRay; 2]) -> bool {
    let all = [ends[0], ends[1], beyond[0], beyond[1]];
    let brightest_w = all.iter().map(|sample| sample.brightest_w).fold(0.0, f64::max);
    let has = |sample: &LatticeRay, signature| sample.find(signature).is_some();
    // One side of the border has the light: one of the ends, or one of the samples beyond.
    [ends[0], beyond[0]].into_iter().any(|sample| {
        let bright = |segment: &&PathSegment| segment.flux_w.luminance() > BULGE_SHARE * brightest_w;
        sample.segments.iter().filter(bright).any(|segment| {
            let here = ends.map(|sample| has(sample, segment.signature));
            let there = beyond.map(|sample| has(sample, segment.signature));
            here[0] == here[1] && there[0] == there[1] && here[0] != there[0]
        })
    })
}

/// Bisects edges of one face.
#[derive(Clone, Copy, Debug)]
pub struct EdgeCutter<'a> {
    pub tracer: &'a StrandTracer<'a>,
    /// Face of the launch domain.
    pub face: usize,
}

impl EdgeCutter<'_> {
    /// Whether the cells on both sides of an edge between two corners will be divided or scattered regardless of the
    /// edge; `level` is how often they were divided for bumps.
    pub fn is_divided(&self, ends: [Corner; 2], level: u32, work: &Workspace) -> bool {
        let samples = ends.map(|corner| work.get(corner.sample));
        let step = ends[1].square - ends[0].square;
        samples.iter().any(|sample| sample.is_rough) || self.tracer.bumps.ask_for_finer(&samples, step, level)
    }

    /// Adds samples until every change of the path along an edge between two points of the unit square is bracketed.
    pub fn resolve(&self, edge: &mut Edge, ends: [DVec2; 2], work: &mut Workspace) {
        let first = work.get(edge.samples[0].1);
        let last = work.get(edge.samples[edge.samples.len() - 1].1);
        let brightest_w = first.brightest_w.max(last.brightest_w);
        let step = ends[1] - ends[0];
        // As fine as on an edge of the lattice itself, in the unit square.
        let whole = DVec2::from(self.tracer.steps).dot(step.abs()) / step.length_squared();
        let cut_bits = self.tracer.closeness.cut_bits;
        let most_bits = (cut_bits - whole.log2().round() as i32).clamp(2, cut_bits);
        let mut changes: Vec<(PathSignature, i32, bool)> = Vec::new();
        for (sample, other) in [(first, last), (last, first)] {
            for segment in &sample.segments {
                let share = segment.flux_w.luminance() / brightest_w;
                let bits = (most_bits + share.log2().floor().max(-60.0) as i32).clamp(0, most_bits);
                match other.find(segment.signature) {
                    None => changes.push((segment.signature, bits, false)),
                    Some(_) if std::ptr::eq(sample, first) => changes.push((segment.signature, bits, true)),
                    Some(_) => {}
                }
            }
            for node in sample.nodes.iter().filter(|node| node.first) {
                if other.find_node(node.signature).is_none() {
                    changes.push((node.signature, most_bits, false));
                }
            }
        }
        if changes.len() > MANY_CHANGES {
            // Shattered light: no single cut matters much.
            changes
                .iter_mut()
                .for_each(|(_, bits, _)| *bits = (*bits).min(SHATTERED_BITS));
        }
        // Brightest first: its samples serve the others.
        changes.sort_by_key(|(signature, bits, _)| (std::cmp::Reverse(*bits), *signature));
        for (signature, bits, both) in changes {
            if both {
                self.bracket_jump(edge, ends, signature, step, work);
            } else {
                self.bracket_change(edge, ends, signature, bits, work);
            }
        }
    }

    /// An edge between two corners, cut where the path of light changes along it; `None` where it does not. `bulges`:
    /// whether something that the ends do not show may reach over the edge.
    pub fn edge(&self, ends: [Corner; 2], bulges: bool, work: &mut Workspace) -> Option<Edge> {
        let [a, b] = ends;
        if bulges {
            let middle = self.corner(a.square.lerp(b.square, 0.5), work);
            let halves = [[a, middle], [middle, b]].map(|half| self.edge(half, false, work));
            if !halves.iter().all(Option::is_none) {
                let [low, high] = halves;
                let low = low.unwrap_or_else(|| Edge::plain(a.sample, middle.sample));
                let high = high.unwrap_or_else(|| Edge::plain(middle.sample, b.sample));
                return Some(low.followed_by(&high));
            }
        }
        let step = b.square - a.square;
        if Edge::is_plain(work.get(a.sample), work.get(b.sample), step) {
            return None;
        }
        let mut edge = Edge::plain(a.sample, b.sample);
        self.resolve(&mut edge, [a.square, b.square], work);
        Some(edge)
    }

    fn has(sample: &LatticeRay, signature: PathSignature) -> bool {
        sample.find(signature).is_some() || sample.find_node(signature).is_some()
    }

    /// Brackets the first change of a signature's presence to 2^−bits of the edge.
    fn bracket_change(
        &self,
        edge: &mut Edge,
        ends: [DVec2; 2],
        signature: PathSignature,
        bits: i32,
        work: &mut Workspace,
    ) {
        let width = (-f64::from(bits)).exp2();
        loop {
            let change = edge.samples.windows(2).position(|pair| {
                Self::has(work.get(pair[0].1), signature) != Self::has(work.get(pair[1].1), signature)
            });
            match change {
                Some(index) if edge.samples[index + 1].0 - edge.samples[index].0 > width => {
                    self.insert(edge, ends, index, work);
                }
                _ => return,
            }
        }
    }

    /// Bisects the suspicious steps of a segment that both ends have, until they are smooth or as narrow as the
    /// narrowest bracket.
    fn bracket_jump(
        &self,
        edge: &mut Edge,
        ends: [DVec2; 2],
        signature: PathSignature,
        step: DVec2,
        work: &mut Workspace,
    ) {
        let width = narrowest(edge.share(work, signature));
        loop {
            let gap = |pair: &[(f64, SampleId)]| pair[1].0 - pair[0].0;
            let worst = edge.samples.windows(2).position(|pair| {
                gap(pair) > width
                    && is_stretched(
                        work.get(pair[0].1),
                        work.get(pair[1].1),
                        signature,
                        step * gap(pair),
                        SUSPICIOUS_STRETCH,
                    )
            });
            let Some(index) = worst else { return };
            self.insert(edge, ends, index, work);
        }
    }

    fn insert(&self, edge: &mut Edge, ends: [DVec2; 2], index: usize, work: &mut Workspace) {
        let place = 0.5 * (edge.samples[index].0 + edge.samples[index + 1].0);
        let corner = self.corner(ends[0].lerp(ends[1], place), work);
        edge.samples.insert(index + 1, (place, corner.sample));
    }

    /// The sample of this tracer's wavelength where another wavelength was traced.
    pub fn again(&self, other: SampleId, work: &mut Workspace) -> SampleId {
        let node = self.tracer.wavelength.unwrap_or(0);
        // At the sample's own position: a patch's corner on a border uses a sample beside the border.
        let square = work.get(other).square;
        if let Some(known) = work.known(node, square) {
            return known;
        }
        let sample = self.tracer.trace_again(self.face, work.get(other));
        work.sample_at(node, square, || sample)
    }

    /// The corner at a point of the unit square.
    pub fn corner(&self, square: DVec2, work: &mut Workspace) -> Corner {
        Corner {
            square,
            sample: work.sample_at(self.tracer.wavelength.unwrap_or(0), square, || {
                self.tracer.trace(self.face, square)
            }),
        }
    }
}
