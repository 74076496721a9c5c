//! One level of one light by photons: more of them than the level before, whose photons are reused.

use std::borrow::Cow;
use std::time::Instant;

use super::band_maps::BandMaps;
use super::bundle_level::BundleLevel;
use super::caustic::{BakeContext, CausticLayer, LightProgress};
use super::light_level::{LevelKey, LightLevel, LightState, PhotonAim, PhotonSums, PhotonTime, drop_coarse};
use super::shards::PassSums;
use crate::error::Result;
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::accuracy;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::pass_report::ProgressScope;
use crate::light_pass::photon::filter;
use crate::light_pass::photon::launch::PhotonLaunch;
use crate::light_pass::photon::pass::{HALVES, PhotonPass};
use crate::light_pass::photon::walk::PhotonRules;
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::light_pass::visibility::VisibleLight;
use crate::optics::LinearSrgb;
use crate::transport::EffectSet;

/// Photons in each half of the first level.
const FIRST_PHOTONS: u32 = 1 << 13;

/// Maximum number of photons in each half.
const MAX_PHOTONS: u32 = 1 << 30;

/// A light whose error is still unknown after so many photons in each half is given up.
const MAX_WITHOUT_ERROR: u32 = 1 << 20;

/// Minimum and maximum growth from level to level.
pub(super) const GROWTH: (f64, f64) = (1.5, 8.0);

/// Margin over the photons that the target should need, so that a near miss does not cost another level.
const MARGIN: f64 = 1.1;

/// Noise below this fraction of the goal is low enough, whatever else the error contains.
const MIN_NOISE: f64 = 0.7;

/// Upper limit of the mean flux of all photons, relative to that of the first ones.
const MEAN_MARGIN: f64 = 4.0;

/// Fraction of the remaining time that a level may take, as predicted from the level before.
pub(super) const PART_OF_TIME: f64 = 0.85;

/// A level adds at least one photon per so many texels of its maps. All of them are filtered again, which takes 1.5 µs
/// of a texel, as long as a photon of two to four segments takes.
const TEXELS_PER_PHOTON: f64 = 4.0;

/// Minimum growth that is worth another level.
const MIN_GROWTH: f64 = 1.2;

/// A filter of 1e5 photons that bundles guide is taken to leave one part in so many of the squared error that it
/// removes, beside what is seen to be left; the number of parts grows with theirs. It may have removed light that few
/// of them have found yet: without this, the true error of the scenes of `laws references`, asked for 2 %, is 1.08
/// times the stated one in the mean; with it, 0.98 times.
const PARTS_PER_DOUBT: f64 = 5.0;

/// Photons find at most so many times the squared error that was planned, unless there is light that the plan did not
/// know: of the built-in scenes and those of the laws, a mirrored torus finds 3 to 20 times, all others at most 1.6.
const MOST_PLANNED: f64 = 1.6;

/// Largest factor by which a filter reduces the squared error that photons find beyond that: a few of them stand for
/// much light, and what looks like their noise may be all that is seen of it. On that torus it is 4 to 6; less, for a
/// margin.
const MOST_SURPRISE_FILTERED: f64 = 3.0;

/// Limits the photons of a level to what the remaining time allows, because an interrupted level is lost. The
/// first level is not limited.
fn in_time(photons: u32, before: u32, state: &LightState, context: &BakeContext) -> u32 {
    let (1.., Some(left_s), Some(time)) = (before, context.control.time_left_s(), state.photon_time) else {
        return photons;
    };
    let own_s = PART_OF_TIME * left_s / context.open_lights as f64;
    let affordable = f64::from(before) + (own_s - time.maps_s) / time.photon_s;
    let least = MIN_GROWTH * f64::from(before);
    (affordable.max(least) as u32).min(photons)
}

/// Squared noise that an error contains, and how much of it a goal allows. Finer levels do not recover truncated light.
pub(super) fn squared_noise(error: f64, truncated: f64, goal: f64) -> [f64; 2] {
    let truncated2 = truncated * truncated;
    let wanted2 = (goal * goal - truncated2).max((MIN_NOISE * goal).powi(2));
    [error * error - truncated2, wanted2]
}

/// Minimum number of photons in each half of the level after `level`, which are few where the maps are large.
fn least_photons(level: &LightLevel, before: u32) -> f64 {
    let texels = level.maps.iter().map(|(_, map)| map.chart.texel_count());
    f64::from(before) + texels.sum::<usize>() as f64 / (TEXELS_PER_PHOTON * HALVES as f64)
}

/// Squared relative error of so many photons of equal flux in each half: that of T texels in which n photons arrive is
/// T/n.
fn square_by_count(sums: &PhotonSums, unit: FluxUnit, photons: u32) -> f64 {
    let maps = sums.halves.iter().filter_map(|half| half.sets().first());
    let texels = maps.map(|maps| maps.iter().map(|(_, map)| map.chart.texel_count()).sum::<usize>());
    let watts = |account| sums.ledger.watts_of_largest(account, unit);
    let arriving = f64::from(photons) * HALVES as f64 * watts(Account::Deposited) / watts(Account::Emitted);
    texels.max().unwrap_or(0) as f64 / arriving
}

/// Noise of photons that were distributed by a plan.
#[derive(Clone, Copy)]
pub(super) struct PlannedNoise {
    /// Squared relative error as it was planned.
    pub(super) square: f64,
    /// Photons of both halves, and points.
    pub(super) rays: f64,
}

impl PlannedNoise {
    /// Squared relative error that photons leave of `found`, which the flux of single ones tells, where `noise` is what
    /// is seen of it after a filter.
    fn doubted(&self, noise: f64, found: f64) -> f64 {
        let removed = (found - noise).max(0.0);
        let doubt = removed / (PARTS_PER_DOUBT * (self.rays / 1e5).max(1.0));
        (noise + doubt).max((found - MOST_PLANNED * self.square) / MOST_SURPRISE_FILTERED)
    }
}

/// What a level consists of.
#[derive(Clone, Copy)]
pub(super) struct Layers<'a> {
    /// Light that bundles carry.
    pub(super) bundles: Option<&'a ReceiverMaps>,
    pub(super) photons: &'a PhotonSums,
    /// Squared relative error that the flux of single photons tells.
    pub(super) photon_square: f64,
    /// `None` for photons without a plan.
    pub(super) planned: Option<PlannedNoise>,
    /// Squared relative error of bundles that photons do not correct.
    pub(super) bundle_square: f64,
}

impl CausticLayer<'_> {
    /// Photons in each half of the next level of a light that aims at a relative RMSE; `None` if nothing is left to do.
    pub(super) fn next_photons(
        &self,
        light: &VisibleLight,
        last: Option<&LightLevel>,
        target_rmse: Option<f64>,
    ) -> Option<u32> {
        // Without a target, a small level gives the first picture, and a second one the density that was asked for.
        let before = last.and_then(|level| level.key.photons.as_ref()?.count());
        let Some(target) = self.settings.max_error else {
            let wanted = self.photons_at_density(light);
            return match before {
                None => Some(FIRST_PHOTONS.min(wanted)),
                Some(before) => (before < wanted).then_some(wanted),
            };
        };

        // With a target, the first photons tell how noisy they are.
        let Some(before) = before else {
            return Some(FIRST_PHOTONS);
        };

        // The variance is inversely proportional to the number of photons, which therefore grows by the ratio of
        // squared errors.
        let known = last.and_then(|level| {
            let error = level.error.as_ref()?.relative_rmse;
            let truncated = accuracy::truncated_share(&level.energy());
            (error.is_finite() && error > 0.0).then_some((error, truncated))
        });
        let goal = target_rmse.unwrap_or(target);
        let times = match known {
            Some((error, truncated)) => {
                let [noise2, wanted2] = squared_noise(error, truncated, goal);
                if noise2 <= wanted2 {
                    return None;
                }
                (MARGIN * noise2 / wanted2).clamp(GROWTH.0, GROWTH.1)
            }
            None if before >= MAX_WITHOUT_ERROR => return None,
            None => GROWTH.1,
        };

        // All maps are filtered anew, so that a level has to add enough photons to be worth it.
        let least = last.map_or(0.0, |level| least_photons(level, before));
        let wanted = (f64::from(before) * times).max(least) / f64::from(FIRST_PHOTONS);
        let wanted = wanted.ceil() * f64::from(FIRST_PHOTONS);
        (before < MAX_PHOTONS).then_some(wanted.min(f64::from(MAX_PHOTONS)) as u32)
    }

    /// Photons in each half at the density of the settings.
    fn photons_at_density(&self, light: &VisibleLight) -> u32 {
        let launch_measure = self.with_launch(light, |launch| launch.measure());
        let per_measure = if light.launch.is_fitted() {
            self.settings.density_per_sr / (light.reach_m * light.reach_m)
        } else {
            self.settings.density_per_sr
        };
        (per_measure * launch_measure / HALVES as f64)
            .ceil()
            .clamp(1.0, f64::from(MAX_PHOTONS)) as u32
    }

    /// What the next level of a light aims at, towards a relative RMSE; `None` if nothing is left to do.
    pub(super) fn next_aim(
        &self,
        light: &VisibleLight,
        last: Option<&LightLevel>,
        target_rmse: Option<f64>,
    ) -> Option<PhotonAim> {
        let before = last.and_then(|last| last.key.photons.as_ref());
        let is_left_to_photons = matches!(before, Some(PhotonAim::Count(_)));
        match self.settings.max_error {
            Some(target) if !is_left_to_photons && self.has_bundles(light) => {
                let mut goals = match before {
                    Some(PhotonAim::Goals(goals)) => goals.clone(),
                    _ => Vec::new(),
                };
                goals.push(self.next_goal(last, target_rmse.unwrap_or(target))?);
                Some(PhotonAim::Goals(goals))
            }
            _ => self.next_photons(light, last, target_rmse).map(PhotonAim::Count),
        }
    }

    pub(super) fn with_launch<T>(&self, light: &VisibleLight, f: impl FnOnce(&PhotonLaunch) -> T) -> T {
        let source = self.tracer.scene().lights[light.light].of_unit_strength();
        let extended = self.has_places(light).then_some(&source);
        f(&PhotonLaunch::of(
            self.tracer,
            light,
            extended,
            self.settings.seed,
        ))
    }

    /// Adds a level of photons to a light.
    ///
    /// # Errors
    /// A power that is not finite.
    pub(super) fn advance_photons(&self, light: &mut LightProgress, context: &mut BakeContext) -> Result<()> {
        if !self.has_next_level(light) {
            light.done = true;
            return Ok(());
        }
        let mut last = light.levels.pop();
        let made = self.more_photons(light, last.as_mut(), light.target_rmse, context)?;
        // The light is negligible: a better estimate is not worth its cost.
        light.done |= !light.is_underrated && made.is_some() && self.is_negligible(light.visible);
        light.levels.extend(last.into_iter().chain(made));
        // Only the last level is needed, but the next bake reaches it sooner with all of them.
        drop_coarse(&mut light.levels, 1, context.spare_bytes);
        Ok(())
    }

    /// The next level of a light after its last one, towards a relative RMSE; `None` if nothing is left to do, or it
    /// was stopped.
    ///
    /// # Errors
    /// A power that is not finite.
    pub(super) fn more_photons(
        &self,
        light: &mut LightProgress,
        last: Option<&mut LightLevel>,
        target_rmse: Option<f64>,
        context: &mut BakeContext,
    ) -> Result<Option<LightLevel>> {
        // A level is led by a goal of bundles or a number of photons. A light that bundles cannot carry changes to the
        // latter, and begins with the first photons.
        let Some(aim) = self.next_aim(light.visible, last.as_deref(), target_rmse) else {
            return Ok(None);
        };
        let photons = match aim {
            PhotonAim::Goals(goals) => match self.next_bundles(light, last.as_deref(), goals, context)? {
                BundleLevel::Made(level) => return Ok(Some(*level)),
                BundleLevel::Stopped => return Ok(None),
                BundleLevel::LeftToPhotons => FIRST_PHOTONS,
            },
            PhotonAim::Count(photons) => photons,
        };

        // The limit of time is applied before the key is formed: levels of other numbers of photons are other levels.
        let before = last
            .as_ref()
            .and_then(|last| last.key.photons.as_ref()?.count())
            .unwrap_or(0);
        let photons = in_time(photons, before, &light.state, context);
        let key = self.key(light, Some(PhotonAim::Count(photons)), context);
        match light.state.take(&key) {
            Some(level) => Ok(Some(level)),
            None => {
                let made = self.make_photons(light.visible, key, last, context)?;
                let (level, time) = made.unzip();
                light.state.photon_time = time;
                Ok(level)
            }
        }
    }

    /// Traces the missing photons, and filters all of them; `None` if it was stopped.
    fn make_photons(
        &self,
        light: &VisibleLight,
        key: LevelKey,
        before: Option<&mut LightLevel>,
        context: &mut BakeContext,
    ) -> Result<Option<(LightLevel, PhotonTime)>> {
        let unit = self.photon_unit(light)?;

        // Photons of the level before count as well if they took the same paths to the same maps.
        let photons = key
            .photons
            .as_ref()
            .and_then(PhotonAim::count)
            .unwrap_or(FIRST_PHOTONS);
        let alike = |level: &&mut LightLevel| level.key.trace == key.trace && level.key.sizes == key.sizes;
        let earlier = before.filter(|level| alike(level) && level.photons.is_some());
        let first = earlier
            .as_ref()
            .and_then(|level| level.key.photons.as_ref()?.count())
            .unwrap_or(0);

        // Only the missing indices are traced: Owen-scrambled Sobol points fill the gaps between earlier ones.
        let chart_for = |receiver: Receiver| self.chart(receiver, &key.sizes);
        let nothing = PassSums::new(vec![self.part_maps(), self.part_maps()]);
        let began = Instant::now();
        let sums = context.pass(&chart_for, nothing, |context, share, mut sums| {
            let total = context.outcome.counts.rays + HALVES as u64 * u64::from(photons - first);
            let listener = self.listener(context, total);
            let mut halves = sums.maps.iter_mut().map(|maps| maps.sets_mut());
            let mut halves = [halves.next(), halves.next()].map(|half| half.unwrap_or(&mut []));
            sums.report = self.with_launch(light, |launch| {
                let pass = PhotonPass {
                    launch,
                    rules: self.rules(light, unit),
                    chart_for: &chart_for,
                };
                pass.run(first..photons, share, &mut halves, &listener)
            });
            sums
        })?;

        // An interrupted pass lacks parts of the launch domain and is dropped as a whole.
        context.outcome.count(&sums.report, context.clock);
        let photon_s = began.elapsed().as_secs_f64() / f64::from(photons - first);
        if sums.report.cancelled {
            return Ok(None);
        }

        // Sums are integers, so that the level is the same as if all its photons were traced at once.
        let mut segments = sums.report.segments;
        let mut raw = PhotonSums {
            ledger: sums.report.ledger,
            halves: sums.maps,
        };
        if let Some((earlier, so_far)) =
            earlier.and_then(|level| Some((level.photons.take()?, level.segments)))
        {
            raw.add(&earlier);
            segments += so_far;
        }

        // Filtering costs the same however few photons are new, so that it is timed apart: both times tell how many
        // photons the next level can afford.
        let unit = unit.per(u64::from(photons) * HALVES as u64);
        let is_shard = context.role.is_shard();
        let began = Instant::now();
        let level = context.clock.time(
            |clock| &mut clock.deposit,
            || self.photon_level(light, (key, unit), raw, is_shard),
        );
        let maps_s = began.elapsed().as_secs_f64();
        let time = PhotonTime { photon_s, maps_s };
        Ok(Some((LightLevel { segments, ..level }, time)))
    }

    fn photon_level(
        &self,
        light: &VisibleLight,
        (key, unit): (LevelKey, FluxUnit),
        raw: PhotonSums,
        is_shard: bool,
    ) -> LightLevel {
        let photons = key.photons.as_ref().and_then(PhotonAim::count).unwrap_or(0);
        let layers = Layers {
            bundles: None,
            photons: &raw,
            photon_square: square_by_count(&raw, unit, photons),
            planned: None,
            bundle_square: 0.0,
        };
        let level = self.level_of_layers(light, (key, unit), layers);
        LightLevel {
            error: level.error.filter(|_| !is_shard),
            photons: Some(raw),
            ..level
        }
    }

    /// A level from its bundles and the photons of both halves.
    pub(super) fn level_of_layers(
        &self,
        light: &VisibleLight,
        (key, unit): (LevelKey, FluxUnit),
        layers: Layers,
    ) -> LightLevel {
        // Dispersed light was counted as XYZ. As linear sRGB it may have negative channels.
        let mut ledger = layers.photons.ledger;
        self.spectra
            .to_linear_srgb(light.light, &mut self.no_maps(), &mut ledger);
        let [first, second] = self.half_maps(light, layers.photons);

        // The map is the sum of both halves.
        let bundles = layers.bundles;
        let is_signed = self.spectra.has(light.light);
        let mut maps = first.clone().into_owned();
        maps.add(&second);
        // Bundles belong to either half.
        for _ in 0..HALVES {
            bundles.into_iter().for_each(|bundles| maps.add(bundles));
        }

        // The difference of the halves is the noise. A filter keeps what exceeds it and tells the error that it leaves.
        let mut left = [0; 3];
        let [one, other] = [&first, &second].map(|half| accuracy::images(half, unit));
        let noise = if self.settings.filters() {
            let halves = [&first, &second].map(|half| &**half);
            filter::filter(&mut maps, halves, bundles, (unit, is_signed), &mut left)
        } else {
            accuracy::half_set_noise(&one, &other)
        };

        // Negative light is removed at the expense of all other texels. What these cannot give is booked as sampling,
        // so that the ledger agrees with the maps.
        filter::without_negative(&mut maps, is_signed, &mut left);
        ledger.book_sum(Account::Sampling, left);
        ledger.book_sum(Account::Deposited, left.map(|count| -count));

        // Bands are kept as they are, without a filter.
        let mut bands = layers.photons.halves[0].bands().to_vec();
        for (band, more) in bands.iter_mut().zip(layers.photons.halves[1].bands()) {
            band.add(more);
        }

        // Halves may agree by chance and a filter may hide light, so that the error is raised to what single photons
        // and the plan lead to expect.
        let energy = ledger.report("", unit, LinearSrgb::WHITE).energy_w;
        let light_of_maps = accuracy::images(&maps, unit);
        let mut error = accuracy::by_noise(&light_of_maps, noise, &energy);
        if let Some(error) = &mut error {
            let square = error.relative_rmse.powi(2);
            // More photons do not recover truncated light, and nothing about it is left to chance.
            let truncated = accuracy::truncated_share(&energy).powi(2);
            let shown = square - truncated;
            let noise = accuracy::expected_noise(shown, [&one, &other], &light_of_maps, layers.photon_square);
            let noise = match &layers.planned {
                Some(planned) => planned.doubted(noise, layers.photon_square),
                None => noise,
            };
            error.raise_to(noise + truncated);
            error.add_to(noise + truncated + layers.bundle_square, &light_of_maps);
        }
        LightLevel {
            error,
            ..self.level(light, (key, unit), (maps, bands), ledger)
        }
    }

    /// The sum of all bands, in linear sRGB.
    fn srgb_sum<'a>(&self, light: &VisibleLight, maps: &'a BandMaps) -> Cow<'a, ReceiverMaps> {
        let mut sum = maps.sum();
        if self.spectra.has(light.light) {
            let mut none = LedgerSum::default();
            self.spectra.to_linear_srgb(light.light, sum.to_mut(), &mut none);
        }
        sum
    }

    /// Maps of both halves, not divided by the number of photons.
    fn half_maps<'a>(&self, light: &VisibleLight, raw: &'a PhotonSums) -> [Cow<'a, ReceiverMaps>; HALVES] {
        [0, 1].map(|half| self.srgb_sum(light, &raw.halves[half]))
    }

    /// What the photons of a light share.
    pub(super) fn rules(&self, light: &VisibleLight, unit: FluxUnit) -> PhotonRules<'_> {
        PhotonRules {
            tracer: self.tracer,
            spectrum: self.spectra.photons(light.light),
            effects: EffectSet::of(self.plan),
            max_depth: self.settings.photon_depth(),
            unit,
            seed: self.settings.seed,
        }
    }

    /// The scope of a pass after which there are so many rays.
    pub(super) fn listener<'b>(&'b self, context: &BakeContext<'b>, total: u64) -> ProgressScope<'b> {
        ProgressScope {
            progress: self.progress,
            control: context.control,
            done: context.outcome.counts.rays,
            total,
        }
    }

    /// Unit of a single photon's flux, for sums over the maximum number of photons.
    pub(super) fn photon_unit(&self, light: &VisibleLight) -> Result<FluxUnit> {
        let mean_w = self.with_launch(light, |launch| launch.mean_flux_w(self.settings.seed));
        // If no photon starts, any unit will do.
        let power_w = (mean_w * MEAN_MARGIN).max(f64::MIN_POSITIVE);
        self.unit_for(light, power_w, f64::from(MAX_PHOTONS) * HALVES as f64)
    }
}
