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
use super::spectrum::{Hue, PhotonSpectrum};
use super::survey::{MIN_PHOTONS, PhotonSurvey, Surveyor};
use super::walk::WAVELENGTH_DIMENSION;
use crate::geometry::sampling::{even_point, in_square};
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxCount;
use crate::light_pass::wavefront::coverage::FluxTriangle;
use crate::optics::LinearSrgb;

/// Bundles are as fine as so many photons ask for, at most.
const MAX_PHOTONS: f64 = 8e6;

/// One cell of so many tells what bundles would carry.
const TRIED: usize = 16;

/// Bundles that carry less of what arrives are not worth it.
const MIN_CARRIED: f64 = 0.25;

/// Bundles of a light, about: 100 bytes each.
const MAX_BUNDLES: usize = 1 << 21;

/// Triangles that are deposited at once, about.
const TRIANGLES_AT_ONCE: usize = 1 << 17;

/// Light of one part of a lamp arrives within so many texels, unless there are too many parts.
const PART_TEXELS: f64 = 0.1;

/// Parts of a lamp along an axis for one photon, at most.
const MAX_LAMP_PARTS: f64 = 8.0;

/// The same of light that is parted.
const FEW_LAMP_PARTS: f64 = 2.0;

/// Parts of a spectrum, least and most: few would leave colours to chance.
const HUE_PARTS: (f64, f64) = (8.0, 64.0);

/// A specular surface of a bundle's way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    pub(super) object: u32,
    pub(super) is_reflected: bool,
}

/// How far light arrives from that of the middle of its lamp and of the middle wavelength [texels].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BundleOffsets {
    /// From the end of either half-axis of a lamp with a size.
    pub(super) lamp: [Vec2; 2],
    /// At the first and the last wavelength of light that is parted.
    pub(super) hues: [Vec2; 2],
}

/// Where on its lamp light starts, and of which wavelength it is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Origin {
    /// In half-axes from the lamp's middle.
    pub(super) lamp: DVec2,
    /// [`Hue::ends`](super::spectrum::Hue::ends).
    pub(super) ends: [f64; 2],
}

impl BundleOffsets {
    fn at(&self, origin: &Origin) -> DVec2 {
        let [x, y] = self.lamp.map(|moved| moved.as_dvec2());
        let [first, last] = self.hues.map(|moved| moved.as_dvec2());
        x * origin.lamp.x + y * origin.lamp.y + first * origin.ends[0] + last * origin.ends[1]
    }

    /// Parts of a lamp that a bundle is deposited for, along both axes: what the draw of their points leaves is to be less than
    /// the noise of so many photons. No more than `most` along an axis.
    fn lamp_parts(&self, photons: f64, most: f64) -> DVec2 {
        let finer = (photons.sqrt() / MAX_LAMP_PARTS).max(1.0);
        let parts = |moved: Vec2| (2.0 * finer * f64::from(moved.abs().max_element()) / PART_TEXELS).ceil();
        DVec2::from(self.lamp.map(parts)).clamp(DVec2::ONE, DVec2::splat(most))
    }

    /// How far light of one part of a lamp arrives from that of the next [texels].
    pub(super) fn lamp_step_texels(&self) -> f64 {
        let parts = self.lamp_parts(1.0, MAX_LAMP_PARTS).to_array();
        let steps = [0, 1].map(|axis| 2.0 * f64::from(self.lamp[axis].abs().max_element()) / parts[axis]);
        steps[0].max(steps[1])
    }

    /// Parts of the spectrum that a bundle is deposited for.
    fn hue_parts(&self) -> f64 {
        let across = f64::from((self.hues[0] - self.hues[1]).abs().max_element());
        (across / PART_TEXELS).ceil().clamp(HUE_PARTS.0, HUE_PARTS.1)
    }
}

/// Light of a triangle that takes one way.
#[derive(Clone, Debug)]
pub(super) struct Bundle {
    pub(super) steps: Arc<[Step]>,
    /// Where it arrives.
    pub(super) receiver: Receiver,
    /// Where the light of the triangle's corners arrives [texels].
    pub(super) corners: [Vec2; 3],
    /// How far from there it arrives otherwise.
    pub(super) moves: BundleOffsets,
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
        a * first + b * second + c * third + self.moves.at(&carried.origin)
    }
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
    /// What it starts as.
    pub(super) origin: Origin,
}

impl Bundles {
    /// As fine as suits so many photons; none where they are too few.
    pub(super) fn new(surveyor: &Surveyor, photons: f64) -> Self {
        let cells = surveyor.launch.cell_count();
        let photons = photons.min(MAX_PHOTONS) / cells as f64;
        let has_size = surveyor.launch.lamp_offsets().is_some();
        if cells == 0 || photons < MIN_PHOTONS[usize::from(has_size)] {
            return Self::default();
        }
        let survey = |cell| surveyor.survey(cell, photons, MAX_BUNDLES / cells);
        let tried = |cell: usize| cell.is_multiple_of(TRIED).then(|| survey(cell));
        let tried: Vec<Option<PhotonSurvey>> = (0..cells).into_par_iter().map(tried).collect();
        let of_tried = |flux_w: fn(&PhotonSurvey) -> f64| tried.iter().flatten().map(flux_w).sum::<f64>();
        let is_worth_it =
            of_tried(|survey| survey.carried_w) > MIN_CARRIED * of_tried(|survey| survey.arriving_w);
        if !is_worth_it {
            return Self::default();
        }
        let surveyed = tried.into_par_iter().enumerate();
        let surveyed: Vec<PhotonSurvey> = surveyed
            .map(|(cell, known)| known.unwrap_or_else(|| survey(cell)))
            .collect();
        let squares: Vec<Square> = surveyed.into_iter().flat_map(|survey| survey.squares).collect();
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

    fn lamp_offset(&self, lamp: DVec2) -> DVec2 {
        self.lamp_offsets.map_or(DVec2::ZERO, |offsets| offsets(lamp))
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
            origin: Origin {
                lamp: self.lamp_offset(lamp),
                ..Origin::default()
            },
        };
        Some((square.cell, within, carried))
    }

    /// Hands out all flux for so many photons, each time some of one receiver's and band's; `count`: of a flux [W per channel].
    /// A lamp with a size and a spectrum are stood for by one point of each of their parts, which the seed draws.
    pub(super) fn deposit(
        &self,
        (photons, seed): (f64, u64),
        spectrum: Option<&PhotonSpectrum>,
        count: impl Fn(LinearSrgb) -> FluxCount,
        mut take: impl FnMut(Option<usize>, Receiver, &[FluxTriangle]),
    ) {
        let mut drawn = 0..;
        let mut waiting = QueuedTriangles::new();
        let mut held = 0;
        for square in &self.squares {
            let photons = 0.25 * square.share() * photons / self.cells();
            for triangle in 0..4 {
                // Neighbours, whose light may arrive at one place, are drawn as different as can be.
                let number = drawn.next().unwrap_or(0);
                let on_lamp = even_point(number, LAMP_DIMENSION, seed);
                let in_hue =
                    spectrum.map(|spectrum| (spectrum, even_point(number, WAVELENGTH_DIMENSION, seed).x));
                for bundle in square.of_triangle(triangle) {
                    let parts = self.parts(&bundle.moves, photons, on_lamp, in_hue);
                    held += parts.len();
                    for (origin, hue, share) in parts {
                        let flux_w = bundle.flux_w() * (photons * share);
                        let (band, flux_w) = match hue {
                            Some(hue) => (hue.band, hue.channels.apply(flux_w)),
                            None => (None, flux_w),
                        };
                        let moved = bundle.moves.at(&origin);
                        waiting
                            .entry((band, bundle.receiver))
                            .or_default()
                            .push(FluxTriangle {
                                corners: bundle.corners.map(|corner| corner.as_dvec2() + moved),
                                flux: count(flux_w),
                                island: 0,
                            });
                    }
                }
            }
            if held > TRIANGLES_AT_ONCE {
                hand_out(&mut waiting, &mut take);
                held = 0;
            }
        }
        hand_out(&mut waiting, &mut take);
    }

    /// Points of a lamp and wavelengths that stand for all, for so many photons of a triangle, and what either counts.
    fn parts<'a>(
        &self,
        moves: &BundleOffsets,
        photons: f64,
        on_lamp: DVec2,
        in_hue: Option<(&'a PhotonSpectrum, f64)>,
    ) -> Vec<(Origin, Option<Hue<'a>>, f64)> {
        let hues: Vec<(Option<Hue<'a>>, f64)> = match in_hue {
            None => vec![(None, 1.0)],
            Some((spectrum, _)) if photons > spectrum.hues().count() as f64 => {
                spectrum.hues().map(|(hue, share)| (Some(hue), share)).collect()
            }
            Some((spectrum, within)) => {
                let parts = moves.hue_parts();
                let one = |part: u32| (spectrum.one((f64::from(part) + within) / parts), 1.0 / parts);
                (0..parts as u32).map(one).collect()
            }
        };
        let lamp_parts = match hues.len() {
            1 => moves.lamp_parts(photons, photons.sqrt().floor().max(MAX_LAMP_PARTS)),
            // Each of them is deposited at every wavelength.
            hues => {
                let photons = photons / hues as f64;
                moves.lamp_parts(photons, photons.sqrt().floor().max(FEW_LAMP_PARTS))
            }
        };
        let of_lamp = (0..(lamp_parts.x * lamp_parts.y) as u32).map(|part| {
            let part = f64::from(part);
            let part = DVec2::new(part % lamp_parts.x, (part / lamp_parts.x).floor());
            self.lamp_offset((part + on_lamp) / lamp_parts)
        });
        let share_of_lamp = lamp_parts.element_product().recip();
        of_lamp
            .flat_map(|lamp| {
                hues.iter().map(move |(hue, share)| {
                    let ends = hue.map_or([0.0; 2], |hue| hue.ends);
                    (Origin { lamp, ends }, *hue, share * share_of_lamp)
                })
            })
            .collect()
    }
}

/// Triangles of one band and receiver.
type QueuedTriangles = BTreeMap<(Option<usize>, Receiver), Vec<FluxTriangle>>;

fn hand_out(waiting: &mut QueuedTriangles, take: &mut impl FnMut(Option<usize>, Receiver, &[FluxTriangle])) {
    for ((band, receiver), triangles) in std::mem::take(waiting) {
        take(band, receiver, &triangles);
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
