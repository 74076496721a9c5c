//! The triangles between the rays of a patch, and where their flux goes.

use glam::DVec2;

use super::coverage::FluxTriangle;
use super::patch::PatchShape;
use super::shares::{Shares, difference, mean, scaled};
use super::spread::SpreadOutput;
use super::virtual_vertex::{Place, VirtualRays, VirtualVertex};
use crate::illumination::accumulator::FluxCount;
use crate::light_pass::ledger_sum::Account;
use crate::optics::LinearSrgb;
use crate::transport::PathEffects;

/// Bisections of a virtual edge between rays that go to different surfaces.
const CUT_STEPS: u32 = 10;

/// How often a triangle is cut that meets several surfaces.
const DEEPEST_CUT: u32 = 4;

/// The triangles of a whole grid on one plane.
pub(super) fn even_grid(
    object: u32,
    grid: &[DVec2],
    (across, down): (usize, usize),
    colours: &[LinearSrgb],
    flux: FluxCount,
    out: &mut SpreadOutput,
) {
    let (width, height) = ((across as f64).recip(), (down as f64).recip());
    let mut share = Shares::new(flux, 2 * across * down, mean(colours.iter().copied()));
    let list = out.list(object);
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

/// One patch while it is spread.
pub(super) struct PatchMesh<'a, 'b, E> {
    pub(super) shape: &'a PatchShape,
    pub(super) rays: VirtualRays<'a, E>,
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

impl<E: PathEffects> PatchMesh<'_, '_, E> {
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
        let mut row: Vec<Knot> = (0..=across).map(|i| self.knot(at(i, 0))).collect();
        for j in 0..down {
            let next: Vec<Knot> = (0..=across).map(|i| self.knot(at(i, j + 1))).collect();
            for i in 0..across {
                let corners = [row[i], row[i + 1], next[i + 1], next[i]];
                let middle = self.colour((corners[0].at + corners[2].at) * 0.5);
                for triangle in [[0, 1, 2], [0, 2, 3]] {
                    let flux = share.next(middle);
                    self.settle(triangle.map(|corner| corners[corner]), flux, DEEPEST_CUT);
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
                    self.settle(piece, flux, DEEPEST_CUT);
                }
            }
            row = next;
        }
    }

    /// Gives a triangle's flux to where its rays go.
    fn settle(&mut self, knots: [Knot; 3], flux: FluxCount, cuts_left: u32) {
        if flux == [0; 3] {
            return;
        }
        let places = knots.map(|knot| knot.vertex.place);
        if places[0].is_same(&places[1]) && places[0].is_same(&places[2]) {
            return self.place(&knots, flux);
        }
        if cuts_left == 0 {
            // A corner where many surfaces meet, some thousandth of a patch wide: all of it goes where its first ray
            // goes.
            return self.place(&[knots[0]; 3], flux);
        }
        let lone = (0..3)
            .find(|&i| places[(i + 1) % 3].is_same(&places[(i + 2) % 3]))
            .unwrap_or(0);
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
        self.settle([apex, near1, near2], first, cuts_left - 1);
        self.settle([far1, left, right], second, cuts_left - 1);
        self.settle([far1, right, far2], third, cuts_left - 1);
    }

    /// Where between two knots the rays stop going where the first goes: the place between them [0, 1], the last knot
    /// on the first's side, and the first on the other.
    fn bracket(&mut self, from: Knot, to: Knot) -> (f64, Knot, Knot) {
        let (mut low, mut high) = (0.0, 1.0);
        let (mut near, mut far) = (from, to);
        for _ in 0..CUT_STEPS {
            let middle = 0.5 * (low + high);
            let knot = self.knot(from.at.lerp(to.at, middle));
            if knot.vertex.place.is_same(&from.vertex.place) {
                (low, near) = (middle, knot);
            } else {
                (high, far) = (middle, knot);
            }
        }
        (0.5 * (low + high), near, far)
    }

    /// All three rays go to the same surface, or nowhere.
    fn place(&mut self, knots: &[Knot; 3], flux: FluxCount) {
        let mut arrived = flux;
        if E::ABSORPTION && self.absorbs {
            let left = knots
                .iter()
                .fold(LinearSrgb::BLACK, |sum, knot| sum + knot.vertex.transmittance)
                * (1.0 / 3.0);
            arrived = scaled(flux, left);
            self.out.ledger.book(Account::Absorbed, difference(flux, arrived));
        }
        match knots[0].vertex.place {
            Place::Nowhere if self.goes_out => self.out.ledger.book(Account::Escaped, arrived),
            // No traced ray of the patch left the scene: a ray that was continued too far did.
            Place::Nowhere => self.out.ledger.book(Account::Unresolved, arrived),
            Place::Onward => self.out.ledger.book(Account::Quadrature, arrived),
            Place::Refused => self.out.ledger.book(Account::Unresolved, arrived),
            Place::On { object, island, .. } => {
                let share = knots.iter().map(|knot| knot.vertex.deposit).sum::<f64>() / 3.0;
                let deposit = if share < 1.0 {
                    scaled(arrived, LinearSrgb::grey(share))
                } else {
                    arrived
                };
                self.out
                    .ledger
                    .book(Account::Quadrature, difference(arrived, deposit));
                let triangle = FluxTriangle {
                    corners: knots.map(|knot| knot.vertex.place.texel()),
                    flux: deposit,
                    island,
                };
                self.out.list(object).push(triangle);
            }
        }
    }
}
