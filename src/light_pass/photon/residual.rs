//! Photons that put right what bundles get wrong.
//!
//! A photon follows all bundles of its square until the scene or a random choice separates them. Where it leaves one,
//! it removes the bundle's flux where that predicts its arrival, divided by the probability of having followed it so
//! far; where it arrives, it adds its own flux. In the mean, photons thus contribute the difference between the light
//! and its bundles, whatever is wrong with these: edges, surfaces that they missed, curvature (control variates:
//! Hammersley and Handscomb, "Monte Carlo Methods", 1964, section 5.5).
//!
//! A photon that arrives near its prediction changes both places by bilinear weights, so that the noise of the
//! difference is proportional to its length. Bundles are deposited once, and halves hold photons alone; but of
//! dispersed bundles each half samples the wavelengths anew, so that their noise is seen.

use glam::DVec2;

use super::bundle_deposit::plan_deposits;
use super::edge;
use super::launch::{LAMP_DIMENSION, LAMP_MIDDLE, PhotonLaunch, Start};
use super::pass::{Block, Deposit, HALVES, half_seed, trace_and_deposit};
use super::paths::PathFinder;
use super::receivers::{MeasuredChart, Receivers};
use super::squares::{Found, Square, Squares};
use super::subcell_features::SubcellFeatures;
use super::survey::Surveyor;
use super::walk::{Followed, Hit, PhotonArrival, PhotonRules, PhotonWalk};
use crate::geometry::sampling::{GOLDEN_64, even_point, in_square, mix64};
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::pass_report::{PassReport, ProgressScope, Stopwatch};
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::optics::LinearSrgb;

/// All flux is counted so many times, in bundles and in each half: enough that rounding to counts does not matter.
pub const TIMES: u32 = 1 << 20;

/// Photons in a block, at least.
const BLOCK_PHOTONS: u64 = 1 << 12;

/// Where surfaces are rough, bundles have to carry this part of the light, or photons are better off without them;
/// elsewhere any part.
const MIN_BUNDLED: f64 = 0.1;

/// Memory of a square with its points and bundles, roughly [bytes].
const BYTES_PER_SQUARE: u64 = 4 << 10;

/// A half is sampled anew if the other half asks for so many times its photons, with at most as many times.
const ANEW: (f64, f64) = (2.0, 8.0);

/// A photon changes the map by bilinear weights if it arrives nearer than this to its prediction [texels].
const TENT_REACH: f64 = 1.0;

/// The light of one light by bundles and residual photons.
pub struct ResidualPass<'a> {
    pub launch: &'a PhotonLaunch<'a>,
    /// Both halves derive their seeds from the one here.
    pub rules: PhotonRules<'a>,
    pub chart_for: &'a ChartFor<'a>,
    /// What new squares might miss.
    pub sought: Option<&'a SubcellFeatures>,
    /// Whether the light meets rough surfaces.
    pub is_rough: bool,
}

/// The squares of a light, to be refined from one goal to the next.
#[derive(Debug, Default)]
pub struct LightSquares(Squares);

impl LightSquares {
    pub fn is_empty(&self) -> bool {
        self.0.squares.is_empty()
    }

    /// Memory, roughly [bytes].
    pub fn bytes(&self) -> u64 {
        self.0.squares.len() as u64 * BYTES_PER_SQUARE
    }
}

/// Maps that a pass fills.
pub struct ResidualMaps<'a> {
    /// Light of all bundles, unless it is dispersed: then each half samples the spectrum anew, and holds its own.
    pub bundles: &'a mut ReceiverMaps,
    /// What photons add to it: one set of maps, or one for each band.
    pub halves: [&'a mut [ReceiverMaps]; HALVES],
}

/// What a pass tells besides its maps.
#[derive(Debug, Default)]
pub struct ResidualReport {
    pub pass: PassReport,
    /// Squared relative error that the deposit of bundles leaves, as planned.
    pub deposit_square: f64,
    /// Squared relative error that the flux of single photons tells.
    pub photon_square: f64,
    /// Whether bundles carry too little of the light to be worth their cost.
    pub is_left_to_photons: bool,
    /// The goal that was aimed at: larger than the one asked for if that would take too many photons at once.
    pub goal: f64,
}

impl ResidualPass<'_> {
    /// Carries the light towards a goal, the relative root mean square error of all maps together. Leaves the maps as
    /// they are if bundles would carry too little of it.
    pub fn run(
        &self,
        goal: f64,
        squares: &mut LightSquares,
        maps: &mut ResidualMaps,
        listener: &ProgressScope,
    ) -> ResidualReport {
        let squares = &mut squares.0;
        let mut report = ResidualReport::default();
        let receivers = Receivers::new(self.rules.tracer.scene().objects.len(), self.chart_for);

        // Squares, finer where photons would cost more.
        let watch = Stopwatch::start();
        let finder = PathFinder {
            launch: self.launch,
            rules: self.rules,
            receivers: &receivers,
        };
        let surveyor = Surveyor::new(finder, listener.control, self.sought);
        let before = squares.points.len();
        surveyor.refine(squares, goal);

        // Bundles that carry too little of the light are not worth their cost: all of it is left to photons.
        let least = if self.is_rough {
            MIN_BUNDLED
        } else {
            f64::MIN_POSITIVE
        };
        if squares.plan.bundled_part < least {
            report.is_left_to_photons = true;
            report.pass.rays = (squares.points.len() - before) as u64;
            report.pass.trace_s.add(watch.elapsed());
            report.pass.cancelled = listener.control.is_cancelled();
            return report;
        }

        // The final squares are cut, and their deposit is made as fine as the goal requires.
        edge::finish(&finder, squares, listener.control, &mut report.pass);
        report.pass.rays += (squares.points.len() - before) as u64;
        report.pass.squares += squares.squares.len() as u64;
        report.deposit_square = plan_deposits(squares, goal, &receivers);
        report.pass.trace_s.add(watch.elapsed());

        // Dispersed bundles sample the spectrum. Each half samples it anew, as noise that both share would not be seen.
        let watch = Stopwatch::start();
        if self.rules.spectrum.is_some() {
            for (half, sets) in maps.halves.iter_mut().enumerate() {
                self.deposit_bundles(squares, sets, half as u32, 1, &mut report.pass.ledger);
            }
        } else {
            // Deposited once, but booked for each half: the photons of both remove it.
            let sets = std::slice::from_mut(maps.bundles);
            self.deposit_bundles(squares, sets, 0, HALVES, &mut report.pass.ledger);
        }
        report.pass.deposit_s.add(watch.elapsed());

        // Photons add what is missing, remove what is wrong, and tell each square how much that was.
        let watch = Stopwatch::start();
        let photons = ResidualPhotons {
            pass: self,
            squares,
            receivers: &receivers,
        };
        let found = photons.run(&mut maps.halves, &mut report.pass, listener);
        let mut traced = 0.0;
        for (square, found) in squares.squares.iter_mut().zip(found) {
            traced += found.photons;
            report.photon_square += squares.plan.relative * found.of_mean;
            square.found.photons += found.photons;
            square.found.squares += found.squares;
        }
        report.pass.trace_s.add(watch.elapsed());
        report.pass.cancelled = listener.control.is_cancelled();
        report.goal = squares.plan.goal;

        // What the next level needs to know.
        squares.photons = traced;
        squares.surprise = report.photon_square / (report.goal * report.goal);
        let counted = f64::from(TIMES) * HALVES as f64;
        let deposited = self.rules.unit.per(counted as u64);
        let arrived_w = report.pass.ledger.watts_of_largest(Account::Deposited, deposited);
        squares.arrived_w = Some(arrived_w).filter(|watts| *watts > 0.0);
        report
    }
}

/// Traces residual photons.
struct ResidualPhotons<'a> {
    pass: &'a ResidualPass<'a>,
    squares: &'a Squares,
    receivers: &'a Receivers<'a>,
}

/// Photons of one half of a square.
#[derive(Default)]
struct Draw {
    deposits: Vec<Deposit>,
    ledger: LedgerSum,
    segments: u64,
    found: Found,
    /// Of the photon that is traced.
    removals: Vec<Removal>,
}

/// Which photons are drawn.
#[derive(Clone, Copy)]
struct DrawOrder {
    half: usize,
    is_anew: bool,
    /// Index of the first one among all of its half.
    first: u32,
    photons: u32,
}

/// Flux that a bundle predicts somewhere, to be removed there.
struct Removal {
    hit: Hit,
    place: DVec2,
    texel: u32,
    island: u32,
    is_smooth: bool,
}

impl ResidualPhotons<'_> {
    /// Returns what photons found in each square.
    fn run(
        &self,
        halves: &mut [&mut [ReceiverMaps]; HALVES],
        report: &mut PassReport,
        listener: &ProgressScope,
    ) -> Vec<Found> {
        // Decides on the photons of each square in each half, and groups squares into blocks of about equal work.
        let squares = &self.squares.squares;
        let mut orders = Vec::with_capacity(squares.len());
        let mut blocks = Vec::new();
        let (mut begin, mut first, mut in_block) = (0, 0_u32, 0_u64);
        for (number, square) in squares.iter().enumerate() {
            let wanted = 0.5 * self.squares.plan.photons(square);
            let photons = wanted.ceil().clamp(1.0, f64::from(u32::MAX >> 8)) as u32;

            // Indices run on from square to square, so that neighbours together sample lamp and spectrum evenly.
            orders.push(DrawOrder {
                half: 0,
                is_anew: false,
                first,
                photons,
            });
            first = first.wrapping_add(photons);
            in_block += u64::from(photons);
            let end = number + 1;
            if in_block >= BLOCK_PHOTONS || end == squares.len() {
                blocks.push(begin..end);
                (begin, in_block) = (end, 0);
            }
        }

        // Squares learn what their photons found.
        let trace =
            |block: &std::ops::Range<usize>| self.block(&squares[block.clone()], &orders[block.clone()]);
        let found = trace_and_deposit(&blocks, trace, halves, self.pass.chart_for, report, listener);
        let mut found: Vec<Found> = found.into_iter().flatten().collect();
        found.resize(squares.len(), Found::default());
        found
    }

    /// The photons of some squares: a block for each half, and what they found in each square.
    fn block(&self, squares: &[Square], orders: &[DrawOrder]) -> (Vec<Block>, Vec<Found>) {
        let mut blocks: Vec<Block> = (0..HALVES)
            .map(|half| Block {
                half,
                ..Block::default()
            })
            .collect();
        let mut all_found = Vec::with_capacity(squares.len());
        for (square, order) in squares.iter().zip(orders) {
            // Both halves draw the planned photons, which tell whether these suffice.
            let order_of = |half| DrawOrder { half, ..*order };
            let draws: Vec<Draw> = (0..HALVES)
                .map(|half| self.draw(square, order_of(half)))
                .collect();
            let founds: Vec<Found> = draws.iter().map(|draw| draw.found).collect();
            let mut found = Found::default();
            for (half, draw) in draws.into_iter().enumerate() {
                found.photons += draw.found.photons;
                found.squares += draw.found.squares;
                // The other half decides, so that no photon is dropped for what it found itself.
                let plan = &self.squares.plan;
                let variance = square.variance_with(founds[1 - half], plan);
                let wanted = 0.5 * plan.photons_for_variance(variance, square);
                let so_far = f64::from(order.photons);

                // Photons that are dropped later were traced all the same, and count as rays.
                let block = &mut blocks[half];
                block.rays += u64::from(order.photons);
                block.segments += draw.segments;
                if wanted <= ANEW.0 * so_far {
                    found.of_mean += draw.found.of_half();
                    block.take(draw.deposits, &draw.ledger);
                    continue;
                }

                // Far too few. A photon's flux depends on their number, so that their hits are dropped and the half is
                // drawn anew.
                let photons = wanted.min(ANEW.1 * so_far).ceil() as u32;
                let anew = self.draw(
                    square,
                    DrawOrder {
                        photons,
                        is_anew: true,
                        ..order_of(half)
                    },
                );
                found.photons += anew.found.photons;
                found.squares += anew.found.squares;
                found.of_mean += anew.found.of_half();
                block.rays += u64::from(photons);
                block.segments += anew.segments;
                block.take(anew.deposits, &anew.ledger);
            }
            all_found.push(found);
        }
        (blocks, all_found)
    }

    fn draw(&self, square: &Square, order: DrawOrder) -> Draw {
        let seed = half_seed(self.pass.rules.seed, order.half) ^ mix64(u64::from(order.is_anew));
        let mut walk = PhotonWalk::new(PhotonRules {
            seed,
            ..self.pass.rules
        });
        let mut draw = Draw::default();
        for number in 0..order.photons {
            let index = order.first.wrapping_add(number);
            let jitter =
                (mix64(seed ^ u64::from(index).wrapping_mul(GOLDEN_64)) >> 11) as f64 * (-53_f64).exp2();
            let along = (f64::from(number) + jitter) / f64::from(order.photons);
            let within = in_square((along * 64_f64.exp2()) as u64);
            self.photon(square, within, (index, order.photons), &mut walk, &mut draw);
        }
        draw.found.photons = f64::from(order.photons);
        draw.segments = walk.segments;
        draw.ledger.merge(&walk.ledger);
        draw
    }

    /// Traces one of so many photons of a square.
    fn photon(
        &self,
        square: &Square,
        within: DVec2,
        (index, photons): (u32, u32),
        walk: &mut PhotonWalk,
        draw: &mut Draw,
    ) {
        // The photon starts at points of its square and of the lamp, and stands for an equal part of the square.
        let pass = self.pass;
        let outline = pass.launch.lamp_outline();
        let lamp = match outline {
            Some(_) => even_point(index, LAMP_DIMENSION, walk.seed()),
            None => LAMP_MIDDLE,
        };
        let unit_squares = square.place.area() * f64::from(TIMES) / f64::from(photons);
        let root = square.place.corner.root as usize;
        let start = pass
            .launch
            .start_at(root, square.place.at(within), lamp)
            .map(|start| Start {
                flux_w: start.flux_w * unit_squares,
                ..start
            });

        // It follows the bundles that exist where it starts: cut ones predict nothing beside their pieces.
        let mut mask = 0;
        for (number, bundle) in square.bundles.iter().enumerate() {
            mask |= u64::from(bundle.has(within)) << number;
        }
        let followed = Followed {
            bundles: &square.bundles,
            mask,
            guides: &square.guides,
            within,
            scale: unit_squares,
            lamp: outline.map_or(DVec2::ZERO, |outline| outline.at(lamp)),
        };

        // Predictions are collected first. One that is close to an arrival is moved there, which has less noise than a
        // removal here and a deposit there.
        let mut removals = std::mem::take(&mut draw.removals);
        let mut maps = Changes {
            photons: self,
            draw,
            whole: f64::from(photons) / f64::from(TIMES),
        };
        walk.follow(index, start, followed, |hit| match hit.place {
            PhotonArrival::Map { place, bundle } => {
                let bundle = &square.bundles[bundle];
                let island = bundle.route.island;
                let chart = self.receivers.get(hit.receiver);
                // Beside its island, a bundle deposits nothing.
                if let Some(texel) = chart.and_then(|chart| chart.texel_of_island(place, island)) {
                    removals.push(Removal {
                        hit,
                        place,
                        texel,
                        island,
                        is_smooth: bundle.is_smooth,
                    });
                }
            }
            PhotonArrival::Surface {
                triangle,
                barycentric,
            } => maps.arrive(&hit, (triangle, barycentric), &mut removals),
        });

        // What no arrival took over did not arrive, and is removed where its bundle put it.
        for removal in removals.drain(..) {
            maps.remove(&removal);
        }
        draw.removals = removals;
    }
}

/// Changes of the maps by one photon.
struct Changes<'a, 'p> {
    photons: &'a ResidualPhotons<'p>,
    draw: &'a mut Draw,
    /// Factor to flux as if the photon stood for the whole square.
    whole: f64,
}

impl Changes<'_, '_> {
    /// A photon arrives on a surface, perhaps close to one of its predictions.
    fn arrive(&mut self, hit: &Hit, (triangle, barycentric): (usize, [f64; 3]), removals: &mut Vec<Removal>) {
        let Some(chart) = self.photons.receivers.get(hit.receiver) else {
            return self.fail(hit.flux_w);
        };
        let place = chart.place(triangle, barycentric);
        let mut nearest: Option<(usize, f64)> = None;
        for (number, removal) in removals.iter().enumerate() {
            let distance = (removal.place - place).abs().max_element();
            let is_alike = removal.hit.receiver == hit.receiver && removal.hit.band == hit.band;
            if is_alike && distance < nearest.map_or(TENT_REACH, |(_, nearest)| nearest) {
                nearest = Some((number, distance));
            }
        }
        match nearest {
            Some((number, _)) if removals[number].is_smooth => {
                let removal = removals.swap_remove(number);
                self.shift(chart, hit, place, &removal);
            }
            Some((number, _)) if chart.texel_at(place) == Some(removals[number].texel) => {
                let removal = removals.swap_remove(number);
                self.book_removal(removal.hit.flux_w);
                let both = Hit {
                    flux_w: hit.flux_w + removal.hit.flux_w,
                    ..*hit
                };
                self.put(&both, chart.texel_at(place));
            }
            _ => self.put(hit, chart.texel_at(place)),
        }
    }

    /// Removes flux that did not arrive.
    fn remove(&mut self, removal: &Removal) {
        self.book_removal(removal.hit.flux_w);
        self.put(&removal.hit, Some(removal.texel));
    }

    /// Moves flux from a prediction to where it arrived, by bilinear weights.
    fn shift(&mut self, chart: &MeasuredChart, hit: &Hit, place: DVec2, removal: &Removal) {
        self.book_removal(removal.hit.flux_w);
        let added = chart.tent(place, removal.island);
        let removed = chart.tent(removal.place, removal.island);
        let mut changes: [(Option<u32>, LinearSrgb); 8] = [(None, LinearSrgb::BLACK); 8];
        let mut count = 0;
        for (tent, flux_w) in [(added, hit.flux_w), (removed, removal.hit.flux_w)] {
            for (texel, weight) in tent {
                let known = changes[..count].iter_mut().find(|(known, _)| *known == texel);
                match known {
                    Some((_, sum)) => *sum += flux_w * weight,
                    None => {
                        changes[count] = (texel, flux_w * weight);
                        count += 1;
                    }
                }
            }
        }
        for &(texel, flux_w) in &changes[..count] {
            if flux_w != LinearSrgb::BLACK {
                self.put(&Hit { flux_w, ..*hit }, texel);
            }
        }
    }

    fn put(&mut self, hit: &Hit, texel: Option<u32>) {
        let Some(texel) = texel else {
            return self.fail(hit.flux_w);
        };
        let count = self.photons.pass.rules.unit.count(hit.flux_w);
        self.draw.ledger.book(Account::Deposited, count);
        let [r, g, b] = hit.flux_w.to_array().map(f64::abs);
        let flux = r.max(g).max(b) * self.whole * self.photons.receivers.weight(hit.receiver);
        self.draw.found.squares += flux * flux;
        self.draw.deposits.push(Deposit {
            receiver: hit.receiver,
            texel,
            band: hit.band,
            count,
        });
    }

    /// Books removed flux, which is negative, as expected only.
    fn book_removal(&mut self, flux_w: LinearSrgb) {
        let count = self.photons.pass.rules.unit.count(flux_w);
        self.draw
            .ledger
            .book(Account::Sampling, count.map(|count| -count));
    }

    fn fail(&mut self, flux_w: LinearSrgb) {
        let count = self.photons.pass.rules.unit.count(flux_w);
        self.draw.ledger.book(Account::Unresolved, count);
    }
}
