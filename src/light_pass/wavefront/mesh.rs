//! Tessellates a patch, and deposits the flux of its triangles.

use glam::DVec2;

use super::coverage::FluxTriangle;
use super::facets::FacetPiece;
use super::patch::PatchShape;
use super::receivers::Receivers;
use super::shares::{Shares, difference, mean, parted, scaled};
use super::spread::SpreadOutput;
use super::virtual_vertex::{LandingPoint, VirtualRays, VirtualVertex};
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxCount;
use crate::light_pass::ledger_sum::Account;
use crate::optics::LinearSrgb;

/// Bisections of a virtual edge between rays that hit different surfaces.
const CUT_STEPS: u32 = 10;

/// Likewise around a single ray, whose own borders are no more precise.
const CUT_STEPS_AROUND_ONE: u32 = 4;

/// Remaining divisions of a triangle.
#[derive(Clone, Copy)]
struct Divisions {
    /// Because it hits several surfaces.
    cuts: u32,
    /// Because the angles of incidence at its corners differ too much.
    bends: u32,
}

impl Divisions {
    const WHOLE: Self = Self { cuts: 4, bends: 4 };

    /// For the surroundings of a single ray.
    const AROUND_ONE: Self = Self { cuts: 2, bends: 1 };

    fn after_cut(self) -> Self {
        Self {
            cuts: self.cuts - 1,
            ..self
        }
    }

    fn after_bend(self) -> Self {
        Self {
            bends: self.bends - 1,
            ..self
        }
    }
}

/// Deposits the triangles of a whole grid on one plane.
pub(super) fn even_grid(
    receiver: Receiver,
    grid: &[DVec2],
    (across, down): (usize, usize),
    colours: &[LinearSrgb],
    flux: FluxCount,
    out: &mut SpreadOutput,
) {
    let (width, height) = ((across as f64).recip(), (down as f64).recip());
    let mut share = Shares::new(flux, 2 * across * down, mean(colours.iter().copied()));
    let list = out.list(receiver);
    list.reserve(2 * across * down);
    for j in 0..down {
        let t = (j as f64 + 0.5) * height;
        let left = colours[0] * (1.0 - t) + colours[3] * t;
        let right = colours[1] * (1.0 - t) + colours[2] * t;
        let rows = [&grid[j * (across + 1)..], &grid[(j + 1) * (across + 1)..]];
        for i in 0..across {
            let s = (i as f64 + 0.5) * width;
            let colour = left * (1.0 - s) + right * s;
            let (a, b, c, d) = (rows[0][i], rows[0][i + 1], rows[1][i + 1], rows[1][i]);
            for corners in [[a, b, c], [a, c, d]] {
                let flux = share.next(colour);
                if flux != [0; 3] {
                    list.push(FluxTriangle {
                        corners,
                        flux,
                        island: 0,
                    });
                }
            }
        }
    }
}

/// Largest ratio of the cosines of incidence at the corners of a triangle.
const MAX_BENT: f64 = 1.2;

/// Cosine below which incidence is grazing: above it, the nine probe rays of a patch already divide it finely enough.
const GRAZING: f64 = 0.3;

/// Divisions of triangles within this size do not show [texels].
const MIN_BENT_TEXELS: f64 = 0.75;

/// Triangles within this size need not be divided between evenly mapped facets [texels].
const TINY_TEXELS: f64 = 0.5;

/// One patch while it is tessellated.
pub(super) struct PatchMesh<'a, 'b> {
    pub(super) receivers: &'a Receivers<'a>,
    pub(super) shape: &'a PatchShape,
    pub(super) rays: VirtualRays<'a>,
    /// Flux density at the patch's corners.
    pub(super) colours: &'a [LinearSrgb],
    pub(super) out: &'b mut SpreadOutput,
    /// Whether its light is absorbed on the way.
    pub(super) absorbs: bool,
    /// Whether any traced ray of the patch leaves the scene.
    pub(super) goes_out: bool,
}

/// A virtual ray with its place on the patch.
#[derive(Clone, Copy, Debug)]
struct Knot {
    at: DVec2,
    vertex: VirtualVertex,
}

impl PatchMesh<'_, '_> {
    fn knot(&mut self, at: DVec2) -> Knot {
        Knot {
            at,
            vertex: self.rays.vertex(at),
        }
    }

    fn colour(&self, at: DVec2) -> LinearSrgb {
        let weights = self.shape.weights(at);
        self.colours
            .iter()
            .zip(weights)
            .fold(LinearSrgb::BLACK, |sum, (colour, weight)| sum + *colour * weight)
    }

    pub(super) fn rectangle(&mut self, (across, down): (usize, usize), flux: FluxCount) {
        let at = |i: usize, j: usize| DVec2::new(i as f64 / across as f64, j as f64 / down as f64);
        let mut share = Shares::new(flux, 2 * across * down, mean(self.colours.iter().copied()));
        let budget = if self.rays.are_around_one() {
            Divisions::AROUND_ONE
        } else {
            Divisions::WHOLE
        };
        let mut row: Vec<Knot> = (0..=across).map(|i| self.knot(at(i, 0))).collect();
        for j in 0..down {
            let next: Vec<Knot> = (0..=across).map(|i| self.knot(at(i, j + 1))).collect();
            for i in 0..across {
                let corners = [row[i], row[i + 1], next[i + 1], next[i]];
                let middle = self.colour((corners[0].at + corners[2].at) * 0.5);
                for triangle in [[0, 1, 2], [0, 2, 3]] {
                    let flux = share.next(middle);
                    self.settle(triangle.map(|corner| corners[corner]), flux, budget);
                }
            }
            row = next;
        }
    }

    pub(super) fn triangle(&mut self, steps: usize, flux: FluxCount) {
        let at = |i: usize, j: usize| DVec2::new(i as f64, j as f64) / steps as f64;
        let mut share = Shares::new(flux, steps * steps, mean(self.colours.iter().copied()));
        let mut row: Vec<Knot> = (0..=steps).map(|i| self.knot(at(i, 0))).collect();
        for j in 0..steps {
            let next: Vec<Knot> = (0..steps - j).map(|i| self.knot(at(i, j + 1))).collect();
            for i in 0..steps - j {
                let mut pieces = vec![[row[i], row[i + 1], next[i]]];
                if i + 1 < next.len() {
                    pieces.push([row[i + 1], next[i + 1], next[i]]);
                }
                for piece in pieces {
                    let middle = (piece[0].at + piece[1].at + piece[2].at) / 3.0;
                    let flux = share.next(self.colour(middle));
                    self.settle(piece, flux, Divisions::WHOLE);
                }
            }
            row = next;
        }
    }

    /// Deposits a triangle's flux where its rays land, divided until each part has one target.
    fn settle(&mut self, knots: [Knot; 3], flux: FluxCount, budget: Divisions) {
        if flux == [0; 3] {
            return;
        }
        let places = knots.map(|knot| knot.vertex.place);
        let is_one = places[0].is_same(&places[1]) && places[0].is_same(&places[2]);
        if is_one && budget.bends > 0 && self.is_bent(&knots) {
            return self.quarter(knots, flux, budget.after_bend());
        }
        if is_one {
            match self.over_facets(&knots) {
                ReceiverHits::One => return self.place(&knots, None, flux),
                ReceiverHits::Several(pieces, is_whole)
                    if is_whole || (budget.cuts == 0 && !pieces.is_empty()) =>
                {
                    return self.place(&knots, Some(&pieces), flux);
                }
                ReceiverHits::Several(..) => {}
            }
        }
        if budget.cuts == 0 {
            // A corner where many surfaces meet, some thousandth of a patch wide: all of it follows its first ray.
            return self.place(&[knots[0]; 3], None, flux);
        }
        let joined = [0, 1, 2].map(|i| self.is_joined(&knots[(i + 1) % 3], &knots[(i + 2) % 3]));
        if joined == [true; 3] {
            return self.quarter(knots, flux, budget.after_cut());
        }
        let lone = joined.iter().position(|joined| *joined).unwrap_or(0);
        let [apex, left, right] = [knots[lone], knots[(lone + 1) % 3], knots[(lone + 2) % 3]];
        let (t1, near1, far1) = self.bracket(apex, left);
        let (t2, near2, far2) = self.bracket(apex, right);
        let parts = [t1 * t2, 1.0 - t1];
        let first = scaled(flux, LinearSrgb::grey(parts[0]));
        let second = scaled(
            difference(flux, first),
            LinearSrgb::grey(parts[1] / (1.0 - parts[0]).max(f64::MIN_POSITIVE)),
        );
        let third = difference(difference(flux, first), second);
        self.settle([apex, near1, near2], first, budget.after_cut());
        self.settle([far1, left, right], second, budget.after_cut());
        self.settle([far1, right, far2], third, budget.after_cut());
    }

    /// Divides a triangle into four.
    fn quarter(&mut self, [a, b, c]: [Knot; 3], flux: FluxCount, budget: Divisions) {
        let mut middle = |a: Knot, b: Knot| self.knot(a.at.lerp(b.at, 0.5));
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        let children = [[ab, bc, ca], [a, ab, ca], [ab, b, bc], [ca, bc, c]];
        for (child, flux) in children.into_iter().zip(parted(flux, [0.25; 4].into_iter())) {
            self.settle(child, flux, budget);
        }
    }

    /// Whether the angles of incidence of three rays on a curved receiver differ too much for an even spread between
    /// them: towards the rim of a body the same light covers more and more area.
    fn is_bent(&self, knots: &[Knot; 3]) -> bool {
        let facets = (knots[0].vertex.place.receiver()).and_then(|receiver| self.receivers.facets(receiver));
        let Some(facets) = facets else {
            return false;
        };
        let places = knots.map(|knot| knot.vertex.place.texel());
        let reach = (places[1] - places[0]).abs().max((places[2] - places[0]).abs());
        if reach.max_element() <= MIN_BENT_TEXELS {
            return false;
        }
        let (mut least, mut most) = (1.0_f64, 0.0_f64);
        for knot in knots {
            if let Some((place, _)) = knot.vertex.place.facet() {
                let normal = facets.mesh.face_normal(place.triangle as usize);
                let direction = knot.vertex.ray.direction;
                let cosine = direction.dot(normal).abs() / direction.length();
                (least, most) = (least.min(cosine), most.max(cosine));
            }
        }
        least < GRAZING && most > MAX_BENT * least
    }

    /// Whether two rays hit one surface, with a map that is continuous between the hits.
    fn is_joined(&self, a: &Knot, b: &Knot) -> bool {
        let (a, b) = (&a.vertex.place, &b.vertex.place);
        let (Some(receiver), true) = (a.receiver(), a.is_same(b)) else {
            return a.is_same(b);
        };
        match (self.receivers.facets(receiver), a.facet(), b.facet()) {
            (Some(facets), Some(a), Some(b)) => facets.is_even(a, b),
            _ => true,
        }
    }

    /// How a triangle of rays splits over the facets of its receiver.
    fn over_facets(&self, knots: &[Knot; 3]) -> ReceiverHits {
        let places = knots.map(|knot| knot.vertex.place.facet());
        let facets = (knots[0].vertex.place.receiver()).and_then(|receiver| self.receivers.facets(receiver));
        let (Some(facets), [Some(a), Some(b), Some(c)]) = (facets, places) else {
            return ReceiverHits::One;
        };
        let triangles = [a, b, c].map(|(place, _)| place.triangle);
        let is_tiny = || {
            let reach = (b.0.texel - a.0.texel).abs().max((c.0.texel - a.0.texel).abs());
            reach.max_element() <= TINY_TEXELS && facets.is_even(a, b) && facets.is_even(a, c)
        };
        if triangles[1..] == [triangles[0]; 2] || is_tiny() {
            return ReceiverHits::One;
        }
        let (pieces, is_whole) = facets.pieces(knots.map(|knot| knot.vertex.ray), triangles);
        ReceiverHits::Several(pieces, is_whole)
    }

    /// Bisects between two knots for where rays stop landing with the first: the position between them [0, 1], the last
    /// knot on the first's side, and the first knot on the other.
    fn bracket(&mut self, from: Knot, to: Knot) -> (f64, Knot, Knot) {
        let (mut low, mut high) = (0.0, 1.0);
        let (mut near, mut far) = (from, to);
        let steps = if self.rays.are_around_one() {
            CUT_STEPS_AROUND_ONE
        } else {
            CUT_STEPS
        };
        for _ in 0..steps {
            let middle = 0.5 * (low + high);
            let knot = self.knot(from.at.lerp(to.at, middle));
            if self.is_joined(&near, &knot) {
                (low, near) = (middle, knot);
            } else {
                (high, far) = (middle, knot);
            }
        }
        (0.5 * (low + high), near, far)
    }

    /// Deposits the flux of three rays that land on the same receiver or share another fate.
    fn place(&mut self, knots: &[Knot; 3], pieces: Option<&[FacetPiece]>, flux: FluxCount) {
        let mut arrived = flux;
        if self.absorbs {
            let left = knots
                .iter()
                .fold(LinearSrgb::BLACK, |sum, knot| sum + knot.vertex.transmittance)
                * (1.0 / 3.0);
            arrived = scaled(flux, left);
            self.out.ledger.book(Account::Absorbed, difference(flux, arrived));
        }
        match knots[0].vertex.place {
            LandingPoint::Nowhere if self.goes_out => self.out.ledger.book(Account::Escaped, arrived),
            // No traced ray of the patch left the scene, so an extrapolated ray did.
            LandingPoint::Nowhere => self.out.ledger.book(Account::Unresolved, arrived),
            LandingPoint::Onward => self.out.ledger.book(Account::Quadrature, arrived),
            LandingPoint::Refused => self.out.ledger.book(Account::Unresolved, arrived),
            LandingPoint::On { receiver, island, .. } => {
                let share = knots.iter().map(|knot| knot.vertex.deposit).sum::<f64>() / 3.0;
                let deposit = if share < 1.0 {
                    scaled(arrived, LinearSrgb::grey(share))
                } else {
                    arrived
                };
                self.out
                    .ledger
                    .book(Account::Quadrature, difference(arrived, deposit));
                let list = self.out.list(receiver);
                match pieces {
                    Some(pieces) => list.extend(flux_triangles(pieces, deposit)),
                    None => list.push(FluxTriangle {
                        corners: knots.map(|knot| knot.vertex.place.texel()),
                        flux: deposit,
                        island,
                    }),
                }
            }
        }
    }
}

/// What a triangle of rays hits of one receiver.
enum ReceiverHits {
    /// Facets that count as one.
    One,
    /// Parts on several facets, and whether they cover the triangle exactly.
    Several(Vec<FacetPiece>, bool),
}

/// Splits a triangle's flux over several facets.
fn flux_triangles(pieces: &[FacetPiece], flux: FluxCount) -> impl Iterator<Item = FluxTriangle> {
    let triangles = pieces.iter().flat_map(|piece| {
        let triangles = piece.triangles();
        triangles.map(|(corners, share)| (corners, piece.island, share * piece.share))
    });
    let shares = triangles.clone().map(|(.., share)| share);
    let fluxes = parted(flux, shares);
    let parts = triangles
        .zip(fluxes)
        .map(|((corners, island, _), flux)| FluxTriangle {
            corners,
            flux,
            island,
        });
    parts.filter(|triangle| triangle.flux != [0; 3])
}
