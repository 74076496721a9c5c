//! Finds bundles: follows sample points of the launch domain along all their paths, and subdivides the domain as finely
//! as the number of photons is worth.

use std::sync::Arc;

use glam::DVec2;

use super::bundles::{Bundle, BundleOffsets, Square, Step};
use super::launch::{LAMP_MIDDLE, PhotonLaunch};
use super::spectrum::PhotonSpectrum;
use super::walk::PhotonRules;
use crate::geometry::Ray;
use crate::illumination::{Chart, Receiver, Side};
use crate::light_pass::caustic::path::PathSignature;
use crate::optics::LinearSrgb;
use crate::progress::Control;
use crate::transport::{Branch, MediumStack, SurfaceHit, Tracer};

/// Ways with less than this part of the light that starts are left to photons.
const MIN_SHARE: f64 = 0.01;

/// Longer ways are left to photons.
const MAX_STEPS: usize = 12;

/// Ways of a point; further ones are left to photons.
const MAX_WAYS: usize = 16;

/// Cells are looked at where so many photons start in them, of light of one place and of a lamp with a size: for that there
/// are more points to follow.
pub(super) const MIN_PHOTONS: [f64; 2] = [24.0, 400.0];

/// A square is divided where those of its photons that follow no bundle take as many segments as its division, times this.
const WORTH: f64 = 1.0;

/// Points whose light a division follows.
const POINTS_OF_DIVISION: f64 = 8.0;

/// Divisions of a cell, at most.
const MAX_DIVISIONS: u32 = 10;

/// A bundle is of use while the light of the middle of its square arrives no farther than this from the mean of two opposite
/// corners [texels]. Within its triangles it is wrong by a quarter of that or less.
const MAX_BENT_TEXELS: f64 = 1.0;

/// Light of one part of a lamp arrives within so many texels.
const MAX_STEP_TEXELS: f64 = 0.5;

/// Segments of a photon that takes a way without bundles, about.
const LOST_SEGMENTS: f64 = 10.0;

/// Photons start as if no less than this part of the light were left to them.
const MIN_LEFT: f64 = 0.03;

/// Corners of the triangles of a square, beside its middle.
pub(super) const TRIANGLES: [[usize; 2]; 4] = [[0, 1], [1, 3], [2, 3], [0, 2]];

/// Follows the light of points of the domain.
pub(super) struct Surveyor<'a> {
    pub(super) launch: &'a PhotonLaunch<'a>,
    pub(super) rules: PhotonRules<'a>,
    pub(super) chart_of: &'a (dyn Fn(Receiver) -> Option<&'a Chart> + Sync),
    pub(super) control: &'a Control,
}

/// The light of one point.
#[derive(Debug, Default)]
struct Light {
    arrivals: Vec<Arrival>,
    /// What starts [W, largest channel, if it were the only photon].
    start_w: f64,
    /// What was not followed to its end.
    lost_w: f64,
    /// Mean segments of a photon.
    segments: f64,
    /// Segments that were followed.
    followed: u64,
}

/// Light of a point at the end of one way.
#[derive(Debug)]
struct Arrival {
    /// The way: surfaces, their smoothing groups, events, receiver.
    key: PathSignature,
    steps: Arc<[Step]>,
    receiver: Receiver,
    /// On the map [texels].
    place: DVec2,
    flux_w: LinearSrgb,
}

/// Light under way.
struct QueuedLight {
    ray: Ray,
    media: MediumStack,
    flux_w: LinearSrgb,
    key: PathSignature,
    steps: Vec<Step>,
}

/// A square that may be divided.
struct Candidate {
    cell: usize,
    begin: u64,
    low: DVec2,
    side: f64,
    /// Along Morton's curve.
    corners: [Arc<Light>; 4],
    middle: Arc<Light>,
    /// The light of the middle from half-way out on both axes of a lamp with a size.
    outer: Option<[Light; 2]>,
    /// The light of the middle at the first and the last wavelength of a spectrum.
    hues: Option<[Light; 2]>,
    /// That start in it.
    photons: f64,
    divisions: u32,
}

/// What becomes of the light of a square, as parts of what starts.
struct LightShares {
    /// Mean flux of a photon [W, largest channel] that bundles carry.
    carried_w: f64,
    /// The same that arrives.
    arriving_w: f64,
    /// Smaller bundles might carry it.
    left: f64,
    /// No bundle could.
    lost: f64,
    /// Mean segments of a photon.
    segments: f64,
    /// Mean segments that the light of a point takes.
    followed: f64,
}

/// Squares of a cell so far.
#[derive(Default)]
pub(super) struct PhotonSurvey {
    pub(super) squares: Vec<Square>,
    /// Mean flux of a photon [W, largest channel] that bundles carry.
    pub(super) carried_w: f64,
    /// The same that arrives anywhere.
    pub(super) arriving_w: f64,
    /// Bundles that it may still have.
    bundles_left: usize,
}

impl Surveyor<'_> {
    /// A cell in squares along its curve, for so many photons; no finer where it has `most_bundles`.
    pub(super) fn survey(&self, cell: usize, photons: f64, most_bundles: usize) -> PhotonSurvey {
        let mut survey = PhotonSurvey {
            bundles_left: most_bundles,
            ..PhotonSurvey::default()
        };
        let light = |x: f64, y: f64| Arc::new(self.light(self.tracer(), cell, DVec2::new(x, y), LAMP_MIDDLE));
        let whole = Candidate {
            cell,
            begin: 0,
            low: DVec2::ZERO,
            side: 1.0,
            corners: [light(0.0, 0.0), light(1.0, 0.0), light(0.0, 1.0), light(1.0, 1.0)],
            middle: light(0.5, 0.5),
            outer: self.outer(cell, DVec2::splat(0.5)),
            hues: self.hues(cell, DVec2::splat(0.5)),
            photons,
            divisions: 0,
        };
        self.divide(whole, &mut survey);
        survey
    }

    fn divide(&self, square: Candidate, survey: &mut PhotonSurvey) {
        let (bundles, ends, outcome) = square.bundles();
        let by_photons = outcome.left * square.photons * outcome.segments;
        let is_fine = by_photons <= WORTH * POINTS_OF_DIVISION * outcome.followed
            || square.divisions == MAX_DIVISIONS
            || survey.bundles_left == 0;
        if is_fine || self.control.is_cancelled() {
            // The variance of a photon over its cost.
            let left = (outcome.left + outcome.lost).clamp(MIN_LEFT, 1.0);
            let share = 0.25_f64.powi(square.divisions as i32);
            survey.carried_w += share * outcome.carried_w;
            survey.arriving_w += share * outcome.arriving_w;
            survey.bundles_left = survey.bundles_left.saturating_sub(bundles.len());
            survey.squares.push(Square {
                cell: square.cell,
                begin: square.begin,
                divisions: square.divisions,
                bundles,
                ends,
                density: (left / outcome.segments).sqrt(),
            });
            return;
        }
        let half = 0.5 * square.side;
        let light = |x: f64, y: f64| {
            let within = square.low + DVec2::new(x, y) * half;
            Arc::new(self.light(self.tracer(), square.cell, within, LAMP_MIDDLE))
        };
        let sides = [light(1.0, 0.0), light(0.0, 1.0), light(2.0, 1.0), light(1.0, 2.0)];
        let middles = [light(0.5, 0.5), light(1.5, 0.5), light(0.5, 1.5), light(1.5, 1.5)];
        let ([a, b, c, d], [above, left, right, below]) = (&square.corners, &sides);
        let middle = &square.middle;
        let corners = [
            [a, above, left, middle],
            [above, b, middle, right],
            [left, middle, c, below],
            [middle, right, below, d],
        ];
        for (number, (corners, middle)) in (0_u32..).zip(corners.into_iter().zip(middles)) {
            let offset = DVec2::new(f64::from(number & 1), f64::from(number >> 1));
            let quarter = Candidate {
                cell: square.cell,
                begin: square.begin | u64::from(number) << (62 - 2 * square.divisions),
                low: square.low + offset * half,
                side: half,
                corners: corners.map(Arc::clone),
                middle,
                outer: self.outer(square.cell, square.low + (offset + 0.5) * half),
                hues: self.hues(square.cell, square.low + (offset + 0.5) * half),
                photons: 0.25 * square.photons,
                divisions: square.divisions + 1,
            };
            self.divide(quarter, survey);
        }
    }

    /// The light of a point of a cell from half-way out on both axes of a lamp with a size.
    fn outer(&self, cell: usize, within: DVec2) -> Option<[Light; 2]> {
        self.launch.lamp_offsets()?;
        let half_way = [DVec2::new(0.75, 0.5), DVec2::new(0.5, 0.75)];
        Some(half_way.map(|lamp| self.light(self.tracer(), cell, within, lamp)))
    }

    /// The light of a point of a cell at the first and the last wavelength of a spectrum.
    fn hues(&self, cell: usize, within: DVec2) -> Option<[Light; 2]> {
        let [_, first, last] = self.rules.spectrum?.tracers()?;
        Some([first, last].map(|tracer| self.light(tracer, cell, within, LAMP_MIDDLE)))
    }

    /// The scene as light meets it, of the middle wavelength where they are parted.
    fn tracer(&self) -> &Tracer {
        let parted = self.rules.spectrum.and_then(PhotonSpectrum::tracers);
        parted.map_or(self.rules.tracer, |[middle, ..]| middle)
    }

    /// The light of a point of a cell and of its lamp, on all its ways.
    fn light(&self, tracer: &Tracer, cell: usize, within: DVec2, lamp: DVec2) -> Light {
        let mut light = Light::default();
        let Some(start) = self.launch.start_in(cell, within, lamp) else {
            return light;
        };
        light.start_w = start.flux_w.max_channel();
        if !(light.start_w > 0.0 && start.flux_w.is_finite()) {
            return light;
        }
        let mut waiting = vec![QueuedLight {
            ray: start.ray,
            media: start.media,
            flux_w: start.flux_w,
            key: PathSignature::default(),
            steps: Vec::new(),
        }];
        while let Some(from) = waiting.pop() {
            light.followed += 1;
            light.segments += from.flux_w.max_channel() / light.start_w;
            if let Some(hit) = tracer.closest_hit(&from.ray) {
                self.meet(tracer, from, &hit, &mut light, &mut waiting);
            }
        }
        light.segments += LOST_SEGMENTS * light.lost_w / light.start_w;
        light
    }

    fn meet(
        &self,
        tracer: &Tracer,
        from: QueuedLight,
        hit: &SurfaceHit,
        light: &mut Light,
        waiting: &mut Vec<QueuedLight>,
    ) {
        let effects = self.rules.effects;
        let material = tracer.scene().material_of(hit.object);
        if from.steps.is_empty() && !material.surface.is_specular() {
            return;
        }
        if effects.lobes && material.is_rough() {
            light.lose(from.flux_w);
            return;
        }
        let mut flux_w = from.flux_w;
        if effects.absorption && from.media.absorbs(tracer.scene()) {
            flux_w = flux_w * from.media.transmittance(tracer.scene(), hit.distance_m);
        }
        let meeting = tracer.meet(effects, hit, from.ray.direction, &from.media, None);
        let least_w = MIN_SHARE * light.start_w;
        let taken_w = flux_w * meeting.deposit;
        if !from.steps.is_empty() && taken_w.max_channel() > 0.0 {
            let receiver = Receiver::new(hit.object, Side::met(from.ray.direction, hit.geometric_normal));
            let place = self.place(receiver, hit);
            match place.filter(|_| taken_w.is_finite() && light.arrivals.len() < MAX_WAYS) {
                Some(place) if taken_w.max_channel() >= least_w => light.arrivals.push(Arrival {
                    key: from.key.at(receiver.index(), 0),
                    steps: from.steps.as_slice().into(),
                    receiver,
                    place,
                    flux_w: taken_w,
                }),
                _ => light.lose(taken_w),
            }
        }
        let key = from
            .key
            .at(hit.object, tracer.smoothing_group(hit.object, hit.triangle));
        let mut go_on = |branch: Branch| {
            let flux_w = flux_w * branch.share;
            let is_followed = from.steps.len() < MAX_STEPS.min(self.rules.max_depth as usize)
                && waiting.len() < MAX_WAYS
                && flux_w.is_finite();
            if !is_followed || flux_w.max_channel() < least_w {
                light.lose(flux_w);
                return;
            }
            let mut steps = Vec::with_capacity(from.steps.len() + 1);
            steps.extend_from_slice(&from.steps);
            steps.push(Step {
                object: hit.object as u32,
                is_reflected: branch.event.is_reflection(),
            });
            waiting.push(QueuedLight {
                ray: branch.ray,
                media: branch.media,
                flux_w,
                key: key.event(branch.event),
                steps,
            });
        };
        meeting.reflection().into_iter().for_each(&mut go_on);
        meeting.transmission().into_iter().for_each(&mut go_on);
    }

    /// Where a hit lies on a map that its surface fills: on another one, a triangle may lie across what is not covered.
    fn place(&self, receiver: Receiver, hit: &SurfaceHit) -> Option<DVec2> {
        let chart = (self.chart_of)(receiver).filter(|chart| chart.is_full())?;
        let size = DVec2::new(chart.width as f64, chart.height as f64);
        Some(chart.uv(hit.triangle, hit.barycentric) * size)
    }
}

impl Candidate {
    /// The bundles of its triangles, where those of each triangle end, and what becomes of the light.
    fn bundles(&self) -> (Vec<Bundle>, [u8; 4], LightShares) {
        let (mut bundles, mut ends) = (Vec::new(), [0; 4]);
        let (mut carried_w, mut blurred_w) = (0.0, 0.0);
        let of_way = |middle| {
            (
                middle,
                self.bent_texels(middle) / MAX_BENT_TEXELS,
                self.moves(middle),
            )
        };
        let ways: Vec<_> = self.middle.arrivals.iter().map(of_way).collect();
        for (corners, end) in TRIANGLES.iter().zip(&mut ends) {
            for &(middle, misplaced, moves) in &ways {
                let [first, second] = corners.map(|corner| self.corners[corner].find(middle.key));
                let (Some(first), Some(second)) = (first, second) else {
                    continue;
                };
                let flux_w = (middle.flux_w + first.flux_w + second.flux_w) * (1.0 / 3.0);
                let Some(moves) = moves else {
                    blurred_w += 0.25 * flux_w.max_channel();
                    continue;
                };
                if misplaced >= 1.0 {
                    continue;
                }
                carried_w += 0.25 * flux_w.max_channel() * (1.0 - misplaced);
                bundles.push(Bundle {
                    steps: Arc::clone(&middle.steps),
                    receiver: middle.receiver,
                    corners: [middle, first, second].map(|arrival| arrival.place.as_vec2()),
                    moves,
                    flux_w: flux_w.to_array().map(|watts| watts as f32),
                });
            }
            *end = bundles.len() as u8;
        }
        (bundles, ends, self.outcome(carried_w, blurred_w))
    }

    fn outcome(&self, carried_w: f64, blurred_w: f64) -> LightShares {
        let mean = |value: &dyn Fn(&Light) -> f64| {
            let points = self.corners.iter().chain([&self.middle]);
            points.map(|point| value(point)).sum::<f64>() / 5.0
        };
        let start_w = mean(&|light| light.start_w);
        let part = |flux_w: f64| {
            if start_w > 0.0 {
                (flux_w / start_w).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        let arriving_w = mean(&|light| {
            let arrivals = light.arrivals.iter();
            arrivals.map(|arrival| arrival.flux_w.max_channel()).sum()
        });
        LightShares {
            carried_w,
            arriving_w,
            left: part(arriving_w - carried_w - blurred_w),
            lost: part(blurred_w + mean(&|light| light.lost_w)),
            segments: mean(&|light| light.segments).max(1.0),
            followed: mean(&|light| light.followed as f64),
        }
    }

    /// How far the light of the middle arrives from there otherwise; `None` where it takes another way, or its lamp is too large.
    fn moves(&self, middle: &Arrival) -> Option<BundleOffsets> {
        let mut moves = BundleOffsets::default();
        let moved = |light: &Light| Some((light.find(middle.key)?.place - middle.place).as_vec2());
        if let Some([x, y]) = &self.outer {
            moves.lamp = [moved(x)? * 2.0, moved(y)? * 2.0];
        }
        if let Some([first, last]) = &self.hues {
            moves.hues = [moved(first)?, moved(last)?];
        }
        (moves.lamp_step_texels() < MAX_STEP_TEXELS).then_some(moves)
    }

    /// How far the light of the middle arrives from where opposite corners say [texels], where two of them say so.
    fn bent_texels(&self, middle: &Arrival) -> f64 {
        let bends = [[0, 3], [1, 2]].map(|opposite| {
            let [a, b] = opposite.map(|corner| self.corners[corner].find(middle.key));
            let bend = (0.5 * (a?.place + b?.place) - middle.place).abs();
            Some(bend.x + bend.y)
        });
        bends.into_iter().flatten().fold(0.0, f64::max)
    }
}

impl Light {
    /// Leaves light to photons; what is no number is theirs to book.
    fn lose(&mut self, flux_w: LinearSrgb) {
        if flux_w.is_finite() {
            self.lost_w += flux_w.max_channel();
        }
    }

    fn find(&self, key: PathSignature) -> Option<&Arrival> {
        self.arrivals.iter().find(|arrival| arrival.key == key)
    }
}
