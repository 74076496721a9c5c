//! Bundles of light that stay together, as a control variate for photons.
//!
//! The launch domain is divided into triangles. Where the light of all three corners takes the same way, the triangle has a
//! *bundle*: flux spread evenly between the three places where that light arrives. Bundles are deposited as they are. A
//! photon that starts in the triangle removes the bundle's flux where the bundle says that the photon arrives, and leaves
//! its own flux where it does arrive. The mean of what photons deposit is therefore the difference between the light and its
//! bundles, whatever is wrong with them: edges that they run across, surfaces that they missed, curvature within them. Only
//! that difference is noisy (control variates: Hammersley and Handscomb, "Monte Carlo Methods", 1964, section 5.5).
//!
//! A photon's way is drawn at random, so it removes a bundle's flux divided by the probability of having followed it: when
//! both arrive, or where the scene itself parts them. Where a draw parts them, photons with the other outcome remove it.
//!
//! More photons start where more is left to them.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec2, Vec2};
use rayon::prelude::*;

use super::launch::LAMP_DIMENSION;
use super::survey::{LEAST_PHOTONS, Survey, Surveyor};
use crate::geometry::sampling::{even_point, in_square};
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxCount;
use crate::light_pass::wavefront::coverage::FluxTriangle;
use crate::optics::LinearSrgb;

/// Bundles are as fine as so many photons ask for, at most.
const MOST_PHOTONS: f64 = 8e6;

/// One cell of so many tells what bundles would carry.
const TRIED: usize = 16;

/// Bundles that carry less of what arrives are not worth it.
const LEAST_CARRIED: f64 = 0.25;

/// Bundles of a light, about: 60 bytes each.
const MOST_BUNDLES: usize = 1 << 21;

/// Squares whose bundles are deposited at once.
const SQUARES_AT_ONCE: usize = 1 << 10;

/// Light of one part of a lamp arrives within so many texels, unless there are too many parts.
const PART_TEXELS: f64 = 0.1;

/// Parts of a lamp along an axis, at most.
const MOST_LAMP_PARTS: f64 = 8.0;

/// A specular surface of a bundle's way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    pub(super) object: u32,
    pub(super) is_reflected: bool,
}

/// Light of a triangle that takes one way.
#[derive(Clone, Debug)]
pub(super) struct Bundle {
    pub(super) steps: Arc<[Step]>,
    /// Where it arrives.
    pub(super) receiver: Receiver,
    /// Where the light of the triangle's corners arrives [texels].
    pub(super) corners: [Vec2; 3],
    /// How far it arrives from there where it starts half an axis of the lamp from its middle, for both axes [texels].
    pub(super) lamp: [Vec2; 2],
    /// Mean flux of a photon of the triangle [W per channel if it were the only photon].
    pub(super) flux_w: [f32; 3],
}

impl Bundle {
    /// Flux of a photon [W per channel if it were the only one].
    pub(super) fn flux_w(&self) -> LinearSrgb {
        LinearSrgb::from(self.flux_w.map(f64::from))
    }

    /// Where the light of a photon of the triangle arrives [texels].
    pub(super) fn place(&self, carried: &Carried) -> DVec2 {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec2());
        let [first, second, third] = carried.barycentric;
        a * first + b * second + c * third + self.moved(carried.lamp, carried.lamp_offsets)
    }

    /// How far light from a point of the lamp's unit square arrives from that of its middle [texels].
    fn moved(&self, lamp: DVec2, offsets: Option<fn(DVec2) -> DVec2>) -> DVec2 {
        let Some(offsets) = offsets else {
            return DVec2::ZERO;
        };
        let offset = offsets(lamp);
        self.lamp[0].as_dvec2() * offset.x + self.lamp[1].as_dvec2() * offset.y
    }
}

/// Parts of a lamp that a bundle is deposited for, along both axes.
fn lamp_parts(lamp: [Vec2; 2]) -> DVec2 {
    let parts = |moved: Vec2| (2.0 * f64::from(moved.abs().max_element()) / PART_TEXELS).ceil();
    DVec2::from(lamp.map(parts)).clamp(DVec2::ONE, DVec2::splat(MOST_LAMP_PARTS))
}

/// How far light of one part of a lamp arrives from that of the next [texels].
pub(super) fn lamp_step_texels(lamp: [Vec2; 2]) -> f64 {
    let parts = lamp_parts(lamp).to_array();
    let steps = [0, 1].map(|axis| 2.0 * f64::from(lamp[axis].abs().max_element()) / parts[axis]);
    steps[0].max(steps[1])
}

/// The bundles of a light.
#[derive(Debug, Default)]
pub(super) struct Bundles {
    /// Of a lamp with a size: [`PhotonLaunch::lamp_offsets`](super::launch::PhotonLaunch::lamp_offsets).
    lamp_offsets: Option<fn(DVec2) -> DVec2>,
    /// Along the domain's curve.
    squares: Vec<Square>,
    /// Where each square's part of all photons ends, [0, 2⁶⁴).
    ends: Vec<u64>,
}

/// A square of the launch domain.
#[derive(Debug)]
pub(super) struct Square {
    /// Cell of the item buffer.
    pub(super) cell: usize,
    /// Where it begins on the cell's curve.
    pub(super) begin: u64,
    /// How often the cell was divided.
    pub(super) divisions: u32,
    /// Bundles of its four triangles around the middle: above, right, below, left.
    pub(super) bundles: Vec<Bundle>,
    /// Where those of each triangle end.
    pub(super) ends: [u8; 4],
    /// Density of photons that suits it, in any unit.
    pub(super) density: f64,
}

impl Square {
    /// Its part of the cell.
    fn share(&self) -> f64 {
        0.25_f64.powi(self.divisions as i32)
    }

    fn of_triangle(&self, triangle: usize) -> &[Bundle] {
        let begin = triangle.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.bundles[usize::from(begin)..usize::from(self.ends[triangle])]
    }
}

/// Bundles of the triangle that a photon starts in.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Carried<'a> {
    pub(super) bundles: &'a [Bundle],
    /// Where the photon starts in the triangle.
    pub(super) barycentric: [f64; 3],
    /// Factor of its flux and of theirs: the mean density of photons over that of its square.
    pub(super) scale: f64,
    /// Where it starts in the lamp's unit square.
    pub(super) lamp: DVec2,
    lamp_offsets: Option<fn(DVec2) -> DVec2>,
}

impl Bundles {
    /// As fine as suits so many photons; none where they are too few.
    pub(super) fn new(surveyor: &Surveyor, photons: f64) -> Self {
        let cells = surveyor.launch.cell_count();
        let photons = photons.min(MOST_PHOTONS) / cells as f64;
        if cells == 0 || photons < LEAST_PHOTONS {
            return Self::default();
        }
        let of_cells = |step: usize| -> (Vec<Square>, f64) {
            let of_cell = |cell| surveyor.survey(cell, photons, MOST_BUNDLES / cells);
            let surveys: Vec<Survey> = (0..cells).into_par_iter().step_by(step).map(of_cell).collect();
            let carried_w: f64 = surveys.iter().map(|survey| survey.carried_w).sum();
            let arriving_w: f64 = surveys.iter().map(|survey| survey.arriving_w).sum();
            let squares = surveys.into_iter().flat_map(|survey| survey.squares);
            (squares.collect(), carried_w / arriving_w)
        };
        if !(of_cells(TRIED).1 > LEAST_CARRIED) {
            return Self::default();
        }
        let (squares, _) = of_cells(1);
        let all: f64 = squares.iter().map(|square| square.share() * square.density).sum();
        let mut so_far = 0.0;
        let ends = squares.iter().map(|square| {
            so_far += square.share() * square.density;
            (so_far / all * 64_f64.exp2()) as u64
        });
        Self {
            lamp_offsets: surveyor.launch.lamp_offsets(),
            ends: ends.collect(),
            squares,
        }
    }

    /// Cells of the domain.
    fn cells(&self) -> f64 {
        self.squares.last().map_or(0, |last| last.cell + 1) as f64
    }

    /// Cell, place in it and bundles of the photon of a place along the domain's curve, once that is stretched by density,
    /// and of a point of the lamp's unit square; `None` where there are no squares.
    pub(super) fn beginning(&self, place: u64, lamp: DVec2) -> Option<(usize, DVec2, Carried<'_>)> {
        let last = self.squares.len().checked_sub(1)?;
        let number = self.ends.partition_point(|end| *end <= place).min(last);
        let begin = number.checked_sub(1).map_or(0, |before| self.ends[before]);
        let length = (self.ends[number] - begin).max(1);
        let along = (place - begin).min(length - 1);
        let along = ((u128::from(along) << 64) / u128::from(length)) as u64;
        let square = &self.squares[number];
        let within = in_square(square.begin | along >> (2 * square.divisions));
        let (triangle, barycentric) = triangle_at(in_square(along));
        let carried = Carried {
            bundles: square.of_triangle(triangle),
            barycentric,
            scale: square.share() / self.cells() * 64_f64.exp2() / length as f64,
            lamp,
            lamp_offsets: self.lamp_offsets,
        };
        Some((square.cell, within, carried))
    }

    /// Hands out all flux for so many photons, each time some of one receiver's; `count`: of a flux [W per channel]. A lamp
    /// with a size is stood for by one point of each of its parts, which the seed draws.
    pub(super) fn deposit(
        &self,
        photons: f64,
        seed: u64,
        count: impl Fn(LinearSrgb) -> FluxCount,
        mut take: impl FnMut(Receiver, &[FluxTriangle]),
    ) {
        let mut drawn = 0..;
        for squares in self.squares.chunks(SQUARES_AT_ONCE) {
            let mut by_receiver: BTreeMap<Receiver, Vec<FluxTriangle>> = BTreeMap::new();
            for square in squares {
                let photons = 0.25 * square.share() * photons / self.cells();
                for triangle in 0..4 {
                    // Neighbours, whose light may arrive at one place, are drawn as different as can be.
                    let in_part = even_point(drawn.next().unwrap_or(0), LAMP_DIMENSION, seed);
                    for bundle in square.of_triangle(triangle) {
                        let parts = lamp_parts(bundle.lamp);
                        let flux = count(bundle.flux_w() * (photons / parts.element_product()));
                        let triangles = (0..(parts.x * parts.y) as u32).map(|part| {
                            let part = f64::from(part);
                            let part = DVec2::new(part % parts.x, (part / parts.x).floor());
                            let moved = bundle.moved((part + in_part) / parts, self.lamp_offsets);
                            FluxTriangle {
                                corners: bundle.corners.map(|corner| corner.as_dvec2() + moved),
                                flux,
                                island: 0,
                            }
                        });
                        by_receiver.entry(bundle.receiver).or_default().extend(triangles);
                    }
                }
            }
            for (receiver, triangles) in &by_receiver {
                take(*receiver, triangles);
            }
        }
    }
}

/// The triangle of a square that a point lies in, and where in it: the middle comes first.
fn triangle_at(within: DVec2) -> (usize, [f64; 3]) {
    let [x, y] = (within * 2.0 - 1.0).to_array();
    let (triangle, outwards, along) = if y <= -x.abs() {
        (0, -y, x)
    } else if x >= y.abs() {
        (1, x, y)
    } else if y >= x.abs() {
        (2, y, x)
    } else {
        (3, -x, y)
    };
    let second = 0.5 * (outwards + along);
    (triangle, [1.0 - outwards, outwards - second, second])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_cover_a_square() {
        const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        for number in 0..1000_u64 {
            let point = in_square(number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let (triangle, [middle, first, second]) = triangle_at(point);
            let [a, b] = super::super::survey::TRIANGLES[triangle].map(|corner| DVec2::from(CORNERS[corner]));
            assert!([middle, first, second].iter().all(|part| *part >= 0.0), "{point}");
            let again = DVec2::splat(0.5) * middle + a * first + b * second;
            assert!((again - point).length() < 1e-12, "{point}: {again}");
        }
    }
}
