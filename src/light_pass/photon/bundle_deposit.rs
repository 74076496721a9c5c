//! Bundles into maps: which triangles each is laid down as, for every wavelength and point of the lamp.

use std::collections::{BTreeMap, HashMap};

use glam::DVec2;
use rayon::prelude::*;

use super::bundle::{Bundle, MAX_STEP_TEXELS, OriginShift, PART_TEXELS, flux_triangle};
use super::launch::LAMP_DIMENSION;
use super::pass::{half_seed, set_of};
use super::receivers::Receivers;
use super::residual::{ResidualPass, TIMES};
use super::spectrum::Hue;
use super::squares::{Square, Squares};
use super::walk::WAVELENGTH_DIMENSION;
use crate::geometry::sampling::{even_point, mix64};
use crate::illumination::Receiver;
use crate::light_pass::coverage::{FluxTriangle, deposit_triangles};
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::path::PathSignature;
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::optics::ColourMatrix;
use crate::scene::PanelShape;

/// Part of the squared goal that the deposit of bundles may err by its plan: curves laid down as chords, slopes as
/// steps.
const DEPOSIT_PART: f64 = 0.1;

/// A triangle is spread as the image of the lamp if it is shorter than this part of the image. Below the edge of a pane,
/// with 32 parts, such light is even to 0.6 %; with half or twice that, to 1.1 %, and with four times that to 2.4 %.
const SMALL: f64 = 0.25;

/// Corners of the image of a disc on a small triangle, besides one for every four parts of the lamp.
const LEAST_CORNERS: u32 = 6;

/// Multiples of it are spread evenly over the unit interval.
const GOLDEN_SECTION: f64 = 0.618_033_988_749_895;

/// Within each part of a lamp: places that differ along both axes even where there are four.
const MIDDLES: DVec2 = DVec2::new(0.5, 0.25);

/// Squares whose triangles are made before they are deposited: of light of one hue, and of a spectrum, which takes many
/// times the triangles.
const SQUARES_AT_ONCE: [usize; 2] = [1 << 12, 1 << 7];

impl ResidualPass<'_> {
    /// Deposits all bundles into a set of maps for each band, and books them so many times.
    pub(super) fn deposit_bundles(
        &self,
        squares: &Squares,
        maps: &mut [ReceiverMaps],
        sample: u32,
        times: usize,
        ledger: &mut LedgerSum,
    ) {
        // A limited number of squares at once bounds the memory for their triangles.
        let at_once = SQUARES_AT_ONCE[usize::from(self.rules.spectrum.is_some())];
        let pass = DepositPass {
            sample,
            sets: maps.len(),
            // A displacement by a part of a texel leaves about that relative error.
            lamp_part_texels: squares.plan.goal.clamp(PART_TEXELS, MAX_STEP_TEXELS),
        };
        for squares in squares.squares.chunks(at_once) {
            let made: Vec<TrianglesByMap> = squares
                .par_chunks(at_once / 32)
                .map(|squares| {
                    let mut triangles = TrianglesByMap::new();
                    squares
                        .iter()
                        .for_each(|square| self.triangles(square, pass, &mut triangles));
                    triangles
                })
                .collect();

            // All triangles of a map are deposited together, which divides its rows among the threads.
            let mut by_map = TrianglesByMap::new();
            for (map, mut triangles) in made.into_iter().flatten() {
                by_map.entry(map).or_default().append(&mut triangles);
            }

            // Photons alone emit: `Sampling` balances what bundles deposit, and gets it back from photons that remove
            // it.
            for ((set, receiver), triangles) in by_map {
                maps[set].touch(receiver, self.chart_for);
                if let Some(map) = maps[set].get_mut(receiver) {
                    let placed = deposit_triangles(&triangles, map)
                        .deposited
                        .map(|count| times as i128 * count);
                    ledger.book_sum(Account::Deposited, placed);
                    ledger.book_sum(Account::Bundled, placed);
                    ledger.book_sum(Account::Sampling, placed.map(|count| -count));
                }
            }
        }
    }

    /// Adds the triangles of a square.
    fn triangles(&self, square: &Square, pass: DepositPass, triangles: &mut TrianglesByMap) {
        // Halves with bundles of their own draw from other seeds, so that their difference shows the noise of lamp and
        // spectrum.
        let DepositPass { sample, sets, .. } = pass;
        let lamp = self.launch.lamp_outline();
        let seed = mix64(half_seed(self.rules.seed, sample as usize));
        for bundle in &square.bundles {
            // Light from one point and of one hue has a single image.
            if self.rules.spectrum.is_none() && lamp.is_none() {
                let triangles = triangles.entry((0, bundle.receiver())).or_default();
                bundle.triangles(square.place.area(), |corners, flux_w, area| {
                    let flux = self.rules.unit.count(flux_w * (area * f64::from(TIMES)));
                    triangles.push(flux_triangle(bundle, corners, flux));
                });
                continue;
            }
            // The triangles of a path draw from one sequence, so that lamp and spectrum are sampled evenly even where
            // a single texel holds the light of many squares. Those of a bundle share their wavelengths: at each of
            // these they meet without a gap.
            let mut index = bundle.first_triangle;
            let hues = self.hues(bundle, BundleDraw { index, seed }, sets);
            let part_texels = pass.lamp_part_texels;
            let lamp = lamp.map(|lamp| LampImage::new(lamp, &bundle.shift, part_texels, hues.len() > 1));

            // Each triangle is spread over the image of the lamp, and moved for each wavelength; the copies share its
            // flux.
            bundle.triangles(square.place.area(), |corners, flux_w, area| {
                let draw = BundleDraw { index, seed };
                index = index.wrapping_add(1);
                let spread = match &lamp {
                    Some(lamp) => lamp.spread(corners, draw),
                    None => vec![corners],
                };
                for (hue, share) in &hues {
                    let share = share / spread.len() as f64;
                    let flux_w = hue.channels.apply(flux_w) * (area * f64::from(TIMES) * share);
                    let flux = self.rules.unit.count(flux_w);
                    let moved = bundle.shift.of_hue(hue.ends);
                    let triangles = triangles
                        .entry((set_of(hue.band, sets), bundle.receiver()))
                        .or_default();
                    for corners in &spread {
                        triangles.push(flux_triangle(bundle, corners.map(|corner| corner + moved), flux));
                    }
                }
            });
        }
    }

    /// Wavelengths for a bundle, each with its part of the flux.
    fn hues(&self, bundle: &Bundle, draw: BundleDraw, sets: usize) -> Vec<(Hue<'_>, f64)> {
        let spectrum = self.rules.spectrum.filter(|_| bundle.route.is_dispersed);
        let Some(spectrum) = spectrum.filter(|_| sets > 1 || bundle.shift.parts_hues()) else {
            return vec![(self.rules.whole_hue(), 1.0)];
        };
        let within = even_point(draw.index, WAVELENGTH_DIMENSION, draw.seed).x;
        let parts = bundle.hue_parts;
        let mut hues = Vec::with_capacity(parts as usize);
        for part in 0..parts as u32 {
            let hue = spectrum.one((f64::from(part) + within) / parts);
            hues.extend(hue.map(|hue| (hue, parts.recip())));
        }
        // The few hues of a bundle have another colour than all: what is missing is spread over them.
        if sets == 1 {
            let of_parts: ColourMatrix = hues.iter().map(|(hue, share)| hue.channels.scaled(*share)).sum();
            let missing = self.rules.whole_hue().channels + of_parts.scaled(-1.0);
            for (hue, _) in &mut hues {
                hue.channels = hue.channels + missing;
            }
        }
        hues
    }
}

/// How bundles are deposited.
#[derive(Clone, Copy)]
struct DepositPass {
    /// Number among samples of lamp and spectrum.
    sample: u32,
    /// Sets of maps: one, or one for each band.
    sets: usize,
    /// Extent of the light from one part of a lamp [texels].
    lamp_part_texels: f64,
}

/// Random numbers of a triangle of a bundle, or of a bundle by its first.
#[derive(Clone, Copy)]
struct BundleDraw {
    index: u32,
    seed: u64,
}

/// The image of an extended lamp on the map of a bundle.
struct LampImage<'a> {
    lamp: PanelShape,
    shift: &'a OriginShift,
    parts: u32,
    /// Displacement for each part [texels]; empty where each triangle draws its own.
    middles: Vec<DVec2>,
}

impl<'a> LampImage<'a> {
    fn new(lamp: PanelShape, shift: &'a OriginShift, part_texels: f64, is_dispersed: bool) -> Self {
        let mut image = Self {
            lamp,
            shift,
            parts: shift.lamp_parts(part_texels, is_dispersed),
            middles: Vec::new(),
        };
        if !is_dispersed {
            // The middles of parts are nearer to the centre than all of the lamp: they are moved out to have its second
            // moments.
            let middles = image.places(MIDDLES);
            let moment = middles.iter().map(|at| at.length_squared()).sum::<f64>() / middles.len() as f64;
            let scale = if image.parts > 1 {
                (2.0 * lamp.second_moment() / moment).sqrt()
            } else {
                1.0
            };
            image.middles = middles.iter().map(|&at| shift.of_lamp(at * scale)).collect();
        }
        image
    }

    /// A place in each part of the lamp, in half-axes from its centre, by a point of the unit square: those of a lattice
    /// in one quarter, turned into the others. Seen along any direction they lie at different distances, and their
    /// second moments are the same in all directions.
    fn places(&self, within: DVec2) -> Vec<DVec2> {
        if self.parts == 1 {
            return vec![DVec2::ZERO];
        }
        let of_quarter = self.parts / 4;
        let place = |part: u32| {
            let number = f64::from(part / 4);
            let along = (number + within.x) / f64::from(of_quarter);
            let across = (number * GOLDEN_SECTION + within.y).fract();
            let at = self.lamp.at(0.5 + 0.5 * DVec2::new(along, across));
            (0..part % 4).fold(at, |at, _| at.perp())
        };
        (0..self.parts).map(place).collect()
    }

    /// A triangle [texels], spread by the lamp's image into triangles that share its flux evenly. Those of one hue are
    /// spread alike, so that they meet without a gap: what is left to chance there is not in the difference of halves,
    /// and would be an error that is not stated.
    fn spread(&self, corners: [DVec2; 3], draw: BundleDraw) -> Vec<[DVec2; 3]> {
        let on_lamp = || even_point(draw.index, LAMP_DIMENSION, draw.seed);
        if self.middles.is_empty() {
            let places = self.places(on_lamp());
            let moved = places.iter().map(|&at| self.shift.of_lamp(at));
            return moved.map(|moved| corners.map(|corner| corner + moved)).collect();
        }
        let [a, b, c] = corners;
        let sides = (b - a).abs().max((c - a).abs()).max((c - b).abs());
        if sides.max_element() > SMALL * self.shift.lamp_width() {
            let moved = self.middles.iter();
            return moved.map(|&moved| corners.map(|corner| corner + moved)).collect();
        }

        // A triangle far smaller than the lamp's image: this image, around its middle, as much wider as the triangle
        // makes it.
        let middle = (a + b + c) / 3.0;
        let wider = self
            .shift
            .widened(self.lamp, corners.map(|corner| corner - middle));
        let outline = self.lamp.corners(LEAST_CORNERS + self.parts / 4, on_lamp().x);
        let corners: Vec<DVec2> = outline
            .iter()
            .map(|&at| middle + self.shift.of_lamp(wider * at))
            .collect();
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).map(|(&a, &b)| [middle, a, b]).collect()
    }
}

/// Triangles by set of maps and receiver.
type TrianglesByMap = BTreeMap<(usize, Receiver), Vec<FluxTriangle>>;

/// Chooses how finely each bundle is deposited, and numbers its triangles. Returns the squared relative error that this
/// leaves.
pub(super) fn plan_deposits(squares: &mut Squares, goal: f64, receivers: &Receivers) -> f64 {
    let relative = squares.plan.relative;
    let bundles: usize = squares.squares.iter().map(|square| square.bundles.len()).sum();
    if relative <= 0.0 {
        return 0.0;
    }
    let allowed = DEPOSIT_PART * goal * goal / (relative * bundles as f64);
    let of_square = |square: &mut Square| -> f64 {
        let mut left = 0.0;
        for bundle in &mut square.bundles {
            left += bundle.plan_deposit(receivers.weight(bundle.receiver()), allowed);
        }
        left
    };
    let left: Vec<f64> = squares.squares.par_iter_mut().map(of_square).collect();

    let mut triangles: HashMap<PathSignature, u32> = HashMap::new();
    for bundle in squares.squares.iter_mut().flat_map(|square| &mut square.bundles) {
        let count = triangles.entry(bundle.route.signature).or_default();
        bundle.first_triangle = *count;
        *count = count.wrapping_add(bundle.triangle_count() as u32);
    }
    left.iter().sum::<f64>() * relative
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat2;

    /// Mean of the products of coordinates over triangles of equal flux, around a point.
    fn second_moments(triangles: &[[DVec2; 3]], around: DVec2) -> DMat2 {
        let product = |at: DVec2| DMat2::from_cols(at * at.x, at * at.y);
        let mut sum = DMat2::ZERO;
        for corners in triangles {
            let corners = corners.map(|corner| corner - around);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            sum += product(middle);
            for corner in corners {
                sum += product(corner - middle) * (1.0 / 12.0);
            }
        }
        sum * (triangles.len() as f64).recip()
    }

    /// However large lamp and triangle are, light spreads as far as both together.
    #[test]
    fn spread_light_has_the_moments_of_lamp_and_triangle() {
        for lamp in [1.0, 10.0] {
            spread_has_moments(lamp);
        }
    }

    fn spread_has_moments(lamp: f64) {
        let sides = [DVec2::new(0.8, 0.3), DVec2::new(-0.1, 0.6)];
        let shift = OriginShift::of_lamp_sides(sides.map(|side| side * lamp));
        let triangle = [DVec2::ZERO, DVec2::new(1.0, 0.2), DVec2::new(0.3, 1.0)];
        for shape in [PanelShape::Disc, PanelShape::Rectangle] {
            let image = LampImage::new(shape, &shift, PART_TEXELS, false);
            let of_lamp = second_moments(
                &image.spread([DVec2::ZERO; 3], BundleDraw { index: 0, seed: 1 }),
                DVec2::ZERO,
            );
            for size in [0.2, 0.8, 3.0] {
                let corners = triangle.map(|corner| corner * size * lamp);
                let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
                let spread = image.spread(corners, BundleDraw { index: 7, seed: 1 });
                let off = second_moments(&spread, middle) - second_moments(&[corners], middle) - of_lamp;
                let largest = off
                    .to_cols_array()
                    .into_iter()
                    .fold(0.0, |most: f64, off| most.max(off.abs()));
                assert!(largest < 1e-3 * lamp * lamp, "{shape:?}, {size} times: {off}");
            }
        }
    }
}
