//! Bundles of light that stay together, as a control variate for photons.
//!
//! The launch domain is divided into triangles. Where the light of all three corners takes the same path, the triangle
//! has a *bundle*: flux spread evenly over the triangle between the three arrivals. Bundles are deposited directly. A
//! photon that starts in the triangle removes the bundle's flux where the bundle predicts its arrival, and deposits its
//! own flux where it does arrive. In the mean, photons thus contribute the difference between the light and its
//! bundles, whatever is wrong with these: edges inside them, surfaces that they missed, curvature. Only that difference
//! is noisy (control variates: Hammersley and Handscomb, "Monte Carlo Methods", 1964, section 5.5).
//!
//! A photon's path is random, so it removes the bundle's flux divided by the probability of having followed it: when
//! both arrive, or where the scene separates them. Where a random choice separates them, photons with the other outcome
//! remove it.
//!
//! Photons are denser where bundles leave more to them.

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

/// Number of photons beyond which bundles become no finer.
const MAX_PHOTONS: f64 = 8e6;

/// One in this many cells is surveyed first, to predict how much bundles would carry.
const TRIED: usize = 16;

/// Fraction of the arriving flux below which bundles are not worth their cost.
const MIN_CARRIED: f64 = 0.25;

/// Approximate limit on the bundles of a light, each of 100 bytes.
const MAX_BUNDLES: usize = 1 << 21;

/// Approximate number of triangles deposited at once.
const TRIANGLES_AT_ONCE: usize = 1 << 17;

/// Extent of the light from one part of a lamp on the map [texels], unless that takes too many parts.
const PART_TEXELS: f64 = 0.1;

/// Maximum number of parts of a lamp along each axis, for a single photon.
const MAX_LAMP_PARTS: f64 = 8.0;

/// [`MAX_LAMP_PARTS`] for dispersed light.
const FEW_LAMP_PARTS: f64 = 2.0;

/// Minimum and maximum number of parts of a spectrum. Fewer would leave colour noise.
const HUE_PARTS: (f64, f64) = (8.0, 64.0);

/// A specular event on a bundle's path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    pub(super) object: u32,
    pub(super) is_reflected: bool,
}

/// Displacement of the arrival on the map, relative to light from the lamp's centre at the middle wavelength [texels].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BundleOffsets {
    /// For light from the end of each half-axis of an extended light.
    pub(super) lamp: [Vec2; 2],
    /// At the first and the last wavelength of dispersed light.
    pub(super) hues: [Vec2; 2],
}

/// Point on the lamp and wavelength.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Origin {
    /// In half-axes from the lamp's centre.
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

    /// Parts of a lamp for which a bundle is deposited, along both axes: enough that their sampling error stays below
    /// the noise of this number of photons, but at most `most` along an axis.
    fn lamp_parts(&self, photons: f64, most: f64) -> DVec2 {
        let finer = (photons.sqrt() / MAX_LAMP_PARTS).max(1.0);
        let parts = |moved: Vec2| (2.0 * finer * f64::from(moved.abs().max_element()) / PART_TEXELS).ceil();
        DVec2::from(self.lamp.map(parts)).clamp(DVec2::ONE, DVec2::splat(most))
    }

    /// Distance between the arrivals from neighbouring parts of a lamp [texels].
    pub(super) fn lamp_step_texels(&self) -> f64 {
        let parts = self.lamp_parts(1.0, MAX_LAMP_PARTS).to_array();
        let steps = [0, 1].map(|axis| 2.0 * f64::from(self.lamp[axis].abs().max_element()) / parts[axis]);
        steps[0].max(steps[1])
    }

    /// Parts of the spectrum for which a bundle is deposited.
    fn hue_parts(&self) -> f64 {
        let across = f64::from((self.hues[0] - self.hues[1]).abs().max_element());
        (across / PART_TEXELS).ceil().clamp(HUE_PARTS.0, HUE_PARTS.1)
    }
}

/// Light of a triangle of the launch domain that takes one path.
#[derive(Clone, Debug)]
pub(super) struct Bundle {
    pub(super) steps: Arc<[Step]>,
    pub(super) receiver: Receiver,
    /// Arrivals of the light of the triangle's corners [texels].
    pub(super) corners: [Vec2; 3],
    /// Displacement for other points of the lamp and other wavelengths.
    pub(super) moves: BundleOffsets,
    /// Mean flux of a photon of the triangle, as if it were the only photon [W per channel].
    pub(super) flux_w: [f32; 3],
}

impl Bundle {
    /// Mean flux of a photon of the triangle, as if it were the only photon [W per channel].
    pub(super) fn flux_w(&self) -> LinearSrgb {
        LinearSrgb::from(self.flux_w.map(f64::from))
    }

    /// Predicted arrival of a photon of the triangle [texels].
    pub(super) fn place(&self, carried: &Carried) -> DVec2 {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec2());
        let [first, second, third] = carried.barycentric;
        a * first + b * second + c * third + self.moves.at(&carried.origin)
    }
}

/// The bundles of a light.
#[derive(Debug, Default)]
pub(super) struct Bundles {
    /// Of an extended light: [`PhotonLaunch::lamp_offsets`](super::launch::PhotonLaunch::lamp_offsets).
    lamp_offsets: Option<fn(DVec2) -> DVec2>,
    /// In order along the domain's curve.
    squares: Vec<Square>,
    /// Upper end of each square's share of all photons, [0, 2⁶⁴).
    ends: Vec<u64>,
}

/// A square of the launch domain.
#[derive(Debug)]
pub(super) struct Square {
    /// Cell of the item buffer.
    pub(super) cell: usize,
    /// Its start on the cell's curve.
    pub(super) begin: u64,
    /// Subdivision depth below the cell.
    pub(super) divisions: u32,
    /// Bundles of its four triangles around the centre: top, right, bottom, left.
    pub(super) bundles: Vec<Bundle>,
    /// End of each triangle's bundles.
    pub(super) ends: [u8; 4],
    /// Density of photons that suits it, up to a factor common to all squares.
    pub(super) density: f64,
}

impl Square {
    /// Fraction of the cell's area.
    fn share(&self) -> f64 {
        0.25_f64.powi(self.divisions as i32)
    }

    fn of_triangle(&self, triangle: usize) -> &[Bundle] {
        let begin = triangle.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.bundles[usize::from(begin)..usize::from(self.ends[triangle])]
    }
}

/// Bundles of the triangle in which a photon starts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Carried<'a> {
    pub(super) bundles: &'a [Bundle],
    /// Start of the photon in the triangle.
    pub(super) barycentric: [f64; 3],
    /// Factor on the flux of the photon and of its bundles: mean density of photons over that of its square.
    pub(super) scale: f64,
    pub(super) origin: Origin,
}

impl Bundles {
    /// Bundles as fine as this number of photons warrants; none if there are too few photons or bundles would carry too
    /// little.
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

    /// Number of cells of the domain.
    fn cells(&self) -> f64 {
        self.squares.last().map_or(0, |last| last.cell + 1) as f64
    }

    /// Cell, position in it and bundles of the photon at a place along the domain's curve, which is stretched by
    /// density, and at a point of the lamp's unit square; `None` if there are no squares.
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

    /// Passes the flux of all bundles, for this number of photons, to `take` in batches of one band and receiver.
    /// `count` converts flux [W per channel] to counts. Each part of an extended light and of a spectrum is represented
    /// by one point, which depends on the seed.
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
                // A low-discrepancy sequence: the light of neighbouring triangles may arrive at one place.
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

    /// Samples of lamp and wavelength for this number of photons of a triangle, with their weights.
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
            // Each part of the lamp is deposited at every wavelength.
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

/// Triangles by band and receiver.
type QueuedTriangles = BTreeMap<(Option<usize>, Receiver), Vec<FluxTriangle>>;

fn hand_out(waiting: &mut QueuedTriangles, take: &mut impl FnMut(Option<usize>, Receiver, &[FluxTriangle])) {
    for ((band, receiver), triangles) in std::mem::take(waiting) {
        take(band, receiver, &triangles);
    }
}

/// The triangle of a square in which a point lies, and its barycentric coordinates there, centre first.
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
            let point = in_square(number.wrapping_mul(crate::geometry::sampling::GOLDEN_64));
            let (triangle, [middle, first, second]) = triangle_at(point);
            let [a, b] = super::super::survey::TRIANGLES[triangle].map(|corner| DVec2::from(CORNERS[corner]));
            assert!([middle, first, second].iter().all(|part| *part >= 0.0), "{point}");
            let again = DVec2::splat(0.5) * middle + a * first + b * second;
            assert!((again - point).length() < 1e-12, "{point}: {again}");
        }
    }
}
