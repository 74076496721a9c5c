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
use crate::light_pass::path::PathSignature;
use crate::optics::LinearSrgb;
use crate::progress::Control;
use crate::transport::{Branch, MediumStack, SurfaceHit, Tracer};

/// Paths with less than this part of the emitted flux are left to photons.
const MIN_SHARE: f64 = 0.01;

/// Longer paths are left to photons.
const MAX_STEPS: usize = 12;

/// Maximum number of paths of a point; further ones are left to photons.
const MAX_PATHS: usize = 16;

/// Photons per cell below which bundles are not worth a survey: for light from one point or direction, and for an
/// extended light, which takes more points to follow.
pub(super) const MIN_PHOTONS: [f64; 2] = [24.0, 400.0];

/// A square is subdivided if its photons that follow no bundle take as many segments as the subdivision, times this.
const WORTH: f64 = 1.0;

/// Points that are followed for a subdivision.
const POINTS_OF_DIVISION: f64 = 8.0;

/// Maximum subdivision depth of a cell.
const MAX_DIVISIONS: u32 = 10;

/// A bundle is of use while the light of its square's centre arrives no farther than this from the mean of two opposite
/// corners [texels]. Within its triangles its error is a quarter of that or less.
const MAX_BENT_TEXELS: f64 = 1.0;

/// Maximum distance between the arrivals from neighbouring parts of a lamp [texels].
const MAX_STEP_TEXELS: f64 = 0.5;

/// Approximate segments of a photon on a path without bundles.
const LOST_SEGMENTS: f64 = 10.0;

/// Photon density assumes that bundles leave at least this part of the light.
const MIN_LEFT: f64 = 0.03;

/// Corners of the triangles of a square, besides its centre.
pub(super) const TRIANGLES: [[usize; 2]; 4] = [[0, 1], [1, 3], [2, 3], [0, 2]];

/// Traces the light of points of the domain along all of its paths.
pub(super) struct Surveyor<'a> {
    pub(super) launch: &'a PhotonLaunch<'a>,
    pub(super) rules: PhotonRules<'a>,
    pub(super) chart_of: &'a (dyn Fn(Receiver) -> Option<&'a Chart> + Sync),
    pub(super) control: &'a Control,
}

/// The light of one point, along all of its paths.
#[derive(Debug, Default)]
struct Light {
    arrivals: Vec<Arrival>,
    /// Emitted flux [W, largest channel, as if it were the only photon].
    start_w: f64,
    /// Flux that was not followed to its end.
    lost_w: f64,
    /// Mean segments of a photon.
    segments: f64,
    /// Segments that were traced.
    followed: u64,
}

/// Light of a point at the end of one path.
#[derive(Debug)]
struct Arrival {
    /// The path: surfaces, their smoothing groups, events, receiver.
    key: PathSignature,
    steps: Arc<[Step]>,
    receiver: Receiver,
    /// On the map [texels].
    place: DVec2,
    flux_w: LinearSrgb,
}

/// Light of a path that is to be continued.
struct QueuedLight {
    ray: Ray,
    media: MediumStack,
    flux_w: LinearSrgb,
    key: PathSignature,
    steps: Vec<Step>,
}

/// A square that may be subdivided.
struct Candidate {
    cell: usize,
    begin: u64,
    low: DVec2,
    side: f64,
    /// In Morton order.
    corners: [Arc<Light>; 4],
    middle: Arc<Light>,
    /// Light of the centre from half-way out along both axes of an extended light.
    outer: Option<[Light; 2]>,
    /// Light of the centre at the first and the last wavelength of a spectrum.
    hues: Option<[Light; 2]>,
    /// Photons that start in the square.
    photons: f64,
    divisions: u32,
}

/// How the light of a square is carried.
struct LightShares {
    /// Mean flux of a photon that bundles carry [W, largest channel].
    carried_w: f64,
    /// Mean flux of a photon that arrives [W, largest channel].
    arriving_w: f64,
    /// Part of the emitted light that smaller bundles might carry.
    left: f64,
    /// Part of the emitted light that no bundle can carry.
    lost: f64,
    /// Mean segments of a photon.
    segments: f64,
    /// Mean segments traced for a point.
    followed: f64,
}

/// The squares of a cell found so far.
#[derive(Default)]
pub(super) struct PhotonSurvey {
    pub(super) squares: Vec<Square>,
    /// Mean flux of a photon that bundles carry [W, largest channel].
    pub(super) carried_w: f64,
    /// Mean flux of a photon that arrives [W, largest channel].
    pub(super) arriving_w: f64,
    /// Further bundles that the cell may have.
    bundles_left: usize,
}

impl Surveyor<'_> {
    /// Divides a cell into squares along its curve, for this number of photons; no further once there are
    /// `most_bundles`.
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
            // The density with the least noise for its cost: the root of a photon's variance over its cost.
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

    /// Light of a point of a cell from half-way out along both axes of an extended light.
    fn outer(&self, cell: usize, within: DVec2) -> Option<[Light; 2]> {
        self.launch.lamp_offsets()?;
        let half_way = [DVec2::new(0.75, 0.5), DVec2::new(0.5, 0.75)];
        Some(half_way.map(|lamp| self.light(self.tracer(), cell, within, lamp)))
    }

    /// Light of a point of a cell at the first and the last wavelength of a spectrum.
    fn hues(&self, cell: usize, within: DVec2) -> Option<[Light; 2]> {
        let [_, first, last] = self.rules.spectrum?.tracers()?;
        Some([first, last].map(|tracer| self.light(tracer, cell, within, LAMP_MIDDLE)))
    }

    /// The scene, at the middle wavelength if light is dispersed.
    fn tracer(&self) -> &Tracer {
        let parted = self.rules.spectrum.and_then(PhotonSpectrum::tracers);
        parted.map_or(self.rules.tracer, |[middle, ..]| middle)
    }

    /// The light of a point of a cell and of its lamp, along all paths.
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
            match place.filter(|_| taken_w.is_finite() && light.arrivals.len() < MAX_PATHS) {
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
                && waiting.len() < MAX_PATHS
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

    /// Position of a hit on a map that its surface fills. `None` on others: a triangle of flux could cross uncovered
    /// texels.
    fn place(&self, receiver: Receiver, hit: &SurfaceHit) -> Option<DVec2> {
        let chart = (self.chart_of)(receiver).filter(|chart| chart.is_full())?;
        let size = DVec2::new(chart.width as f64, chart.height as f64);
        Some(chart.uv(hit.triangle, hit.barycentric) * size)
    }
}

impl Candidate {
    /// The bundles of its triangles, where those of each triangle end, and how the light is carried.
    fn bundles(&self) -> (Vec<Bundle>, [u8; 4], LightShares) {
        let (mut bundles, mut ends) = (Vec::new(), [0; 4]);
        let (mut carried_w, mut blurred_w) = (0.0, 0.0);
        let of_way = |middle| {
            (
                middle,
                self.deviation_texels(middle) / MAX_BENT_TEXELS,
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

    /// Displacements of an arrival at the centre; `None` if light takes another path there, or the lamp is too large.
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

    /// Deviation of the centre's arrival from the mean of opposite corners on the same path [texels].
    fn deviation_texels(&self, middle: &Arrival) -> f64 {
        let bends = [[0, 3], [1, 2]].map(|opposite| {
            let [a, b] = opposite.map(|corner| self.corners[corner].find(middle.key));
            let bend = (0.5 * (a?.place + b?.place) - middle.place).abs();
            Some(bend.x + bend.y)
        });
        bends.into_iter().flatten().fold(0.0, f64::max)
    }
}

impl Light {
    /// Leaves light to photons. They also book flux that is not finite.
    fn lose(&mut self, flux_w: LinearSrgb) {
        if flux_w.is_finite() {
            self.lost_w += flux_w.max_channel();
        }
    }

    fn find(&self, key: PathSignature) -> Option<&Arrival> {
        self.arrivals.iter().find(|arrival| arrival.key == key)
    }
}
