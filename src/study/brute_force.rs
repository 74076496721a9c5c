//! Brute-force light tracing, the reference for the estimators: random rays, each hit's whole flux into the texel it
//! falls in. It shares only transport and aiming with the code it judges.
//!
//! Rays are stratified: one at a random position in each cell of a lattice. The noise is measured with two such
//! lattices, each with half of the rays. Each carries half of the flux, so that their sum is the map, and their
//! difference A − B has the same variance as the sum.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

use glam::DVec2;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;

use crate::bake::{Bake, BakeCounts, StopReason, Timings};
use crate::error::{Error, Result};
use crate::illumination::accumulator::{FluxCount, FluxUnit};
use crate::illumination::gutter::fill_gutter;
use crate::illumination::parametrisation::parametrise;
use crate::illumination::{Chart, IlluminationMap, Receiver};
use crate::light_pass::emitter::Emitter;
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::light_pass::pass_report::Stopwatch;
use crate::light_pass::path::{Arrival, PathLimits, PathTracer};
use crate::light_pass::visibility::{CullMode, LightVisibility, VisibleLight};
use crate::optics::LinearSrgb;
use crate::plan::{self, Effect, EffectPlan, EffectSwitch};
use crate::progress::{Control, Progress, Stage};
use crate::scene::{Material, Scene};
use crate::settings::{BakeSettings, ItemBufferKind, LayerKind, MapResolution};
use crate::transport::{EffectSet, Microfacets, Tracer};

/// Range of the number of rays.
pub const RAYS: std::ops::RangeInclusive<u64> = 1_000..=1_000_000_000_000;

/// Bakes the caustic layer of a scene with about `rays` rays ([`RAYS`]), divided evenly among the lights. Of the
/// settings, map resolution (which must be fixed), seed, item buffer, depth, branch threshold, threads and the switches
/// of effects apply. Each map's `error` is the texel's standard error [W/m²], and its `estimated_relative_rmse` is the
/// noise: the root mean square of these over the mean. Bit-identical for any number of threads.
///
/// # Errors
/// Settings or rays outside their ranges; an automatic map resolution; lights without finite power; threads that cannot
/// be started; cancellation.
pub fn brute_force(
    tracer: &Tracer,
    settings: &BakeSettings,
    rays: u64,
    progress: &dyn Progress,
    control: &Control,
) -> Result<Bake> {
    settings.validate()?;
    if !RAYS.contains(&rays) {
        return Err(Error::usage(
            "--rays",
            format!("{rays} is outside {} to {:e}", RAYS.start(), *RAYS.end() as f64),
            "give a number in that range",
        ));
    }
    let MapResolution::Fixed { width, height } = settings.map_resolution else {
        return Err(Error::usage(
            "--map-resolution",
            "brute force has no footprints to choose a size by",
            "give N or WxH in texels",
        ));
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(settings.threads)
        .build()
        .map_err(|error| Error::failure("--threads", error.to_string(), "ask for fewer threads"))?;
    pool.install(|| run(tracer, settings, rays, (width, height), progress, control))
}

fn run(
    tracer: &Tracer,
    settings: &BakeSettings,
    rays: u64,
    size: (usize, usize),
    progress: &dyn Progress,
    control: &Control,
) -> Result<Bake> {
    let scene = tracer.scene();
    let watch = Stopwatch::start();
    progress.advance(Stage::Plan, 0, 1);
    let sizes = settings.effects.get(Effect::AreaLights) != EffectSwitch::Off;
    let aim = LightVisibility::take(tracer, settings.item_buffer, CullMode::Everything, sizes);
    let plan = plan::decide(scene, settings, &aim.sights);
    let lights: &[VisibleLight] = if plan.is_on(Effect::LightPass) {
        &aim.lights
    } else {
        &[]
    };
    let run = Run {
        tracer,
        limits: PathLimits {
            max_depth: settings.photon_depth(),
            branch_threshold: settings.path_threshold(),
            effects: EffectSet::EVERYTHING,
            microfacets: None,
        },
        aiming: (settings.item_buffer, CullMode::Reachable),
        sizes,
        lobes: settings.effects.get(Effect::Roughness) != EffectSwitch::Off
            && scene.materials.iter().any(Material::is_rough),
        unit: unit(scene, lights)?,
        targets: targets(scene, size),
        seed: settings.seed,
        rays_per_half: (rays as f64 / (2 * lights.len().max(1)) as f64).max(1.0),
        progress,
        control,
        done: AtomicU64::new(0),
        total: lights.len() as u64 * OF_A_LIGHT,
    };
    let mut result = empty_result(plan, lights.is_empty());
    for light in lights {
        let tally = run.light(light);
        if control.is_cancelled() {
            return Err(Error::cancelled(&scene.source));
        }
        result.counts.rays += tally.rays;
        result.counts.segments += tally.segments;
        let name = &scene.lights[light.light].name;
        result
            .ledgers
            .push(tally.ledger.report(name, run.unit, LinearSrgb::WHITE));
    }
    result.maps = run
        .targets
        .iter()
        .flatten()
        .filter_map(|target| target.map(run.unit))
        .collect();
    let seconds = watch.elapsed();
    (result.timings_s.total, result.cpu_s.total) = (seconds.wall, seconds.cpu);
    Ok(result)
}

/// Number of independent half sets of rays.
const HALVES: usize = 2;

/// Sampled positions of a light with a size, per half set.
const PLACES: usize = 2048;

/// State shared by all lights.
struct Run<'a> {
    tracer: &'a Tracer,
    limits: PathLimits,
    aiming: (ItemBufferKind, CullMode),
    /// Whether lights are sampled over their size.
    sizes: bool,
    /// Whether rough surfaces scatter into lobes.
    lobes: bool,
    unit: FluxUnit,
    targets: Vec<Option<Target>>,
    seed: u64,
    /// Approximate number per light.
    rays_per_half: f64,
    progress: &'a dyn Progress,
    control: &'a Control,
    /// Progress over all lights, and its total.
    done: AtomicU64,
    total: u64,
}

/// Units of progress per light.
const OF_A_LIGHT: u64 = 1 << 30;

/// A subset of a light's rays.
#[derive(Clone, Copy, Debug)]
struct RayRange {
    /// Index of the half set; `None` for both.
    half: Option<usize>,
    /// Share of the light's flux.
    share: f64,
    /// Separates the random streams of different positions.
    place: u64,
}

/// The random stream of positions.
const PLACE_STREAM: u64 = u64::MAX;

/// Outcome of a subset of rays.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    ledger: LedgerSum,
    rays: u64,
    segments: u64,
}

impl Tally {
    fn merged(mut self, other: Self) -> Self {
        self.ledger.merge(&other.ledger);
        self.rays += other.rays;
        self.segments += other.segments;
        self
    }
}

impl Run<'_> {
    /// Reports one of `parts` equal parts of a light as done.
    fn advance(&self, parts: usize) {
        let part = OF_A_LIGHT / parts as u64;
        let done = self.done.fetch_add(part, Ordering::Relaxed) + part;
        self.progress.advance(Stage::Caustic, done, self.total);
    }

    /// Traces both half sets of a light.
    fn light(&self, light: &VisibleLight) -> Tally {
        let source = &self.tracer.scene().lights[light.light];
        if !(self.sizes && source.has_extent()) {
            let whole = RayRange {
                half: None,
                share: 1.0 / HALVES as f64,
                place: 0,
            };
            return self.part(light, whole);
        }
        // Each half set has its own positions, drawn like its rays.
        let source = source.of_unit_strength();
        (0..HALVES * PLACES)
            .into_par_iter()
            .map(|index| {
                let (half, place) = (index / PLACES, index % PLACES);
                let mut random = self.generator(light.light, (half, 0, place), PLACE_STREAM);
                // Stratified: one position per cell of a square lattice.
                let side = (PLACES as f64).sqrt().floor() as usize;
                let within = DVec2::new(random(), random());
                let square = if place < side * side {
                    (DVec2::new((place % side) as f64, (place / side) as f64) + within) / side as f64
                } else {
                    within
                };
                let emitter = Emitter::sample(&source, self.tracer.scene(), square);
                let there = emitter
                    .filter(|_| !self.control.is_cancelled())
                    .and_then(|emitter| light.from_place(self.tracer, self.aiming, &emitter));
                let part = RayRange {
                    half: Some(half),
                    share: 1.0 / (HALVES * PLACES) as f64,
                    place: place as u64 + 1,
                };
                let tally = there.map(|there| self.part(&there, part));
                self.advance(HALVES * PLACES);
                tally.unwrap_or_default()
            })
            .reduce(Tally::default, Tally::merged)
    }

    /// Traces rays from one position of a light, for one half set or both.
    fn part(&self, light: &VisibleLight, part: RayRange) -> Tally {
        let measure = light.item_buffer.marked_measure(&light.launch);
        let halves = part.half.map_or(0..HALVES, |half| half..half + 1);
        let places = if part.half.is_some() { PLACES } else { 1 };
        // Rays per steradian, or per square metre for a sun.
        let density = (self.rays_per_half / places as f64).max(1.0) / measure;
        let size = light.launch.lattice_size(density, 1.0);
        let faces = light.launch.face_count();
        (halves.start * faces..halves.end * faces)
            .into_par_iter()
            .flat_map(|face| (0..size.1).into_par_iter().map(move |row| (face, row)))
            .map(|(half_face, row)| {
                if self.control.is_cancelled() {
                    return Tally::default();
                }
                let (half, face) = (half_face / faces, half_face % faces);
                let tally = self.row(light, size, (half, face, row), &part);
                if part.half.is_none() {
                    self.advance(faces * size.1 * HALVES);
                }
                tally
            })
            .reduce(Tally::default, Tally::merged)
    }

    /// Traces one ray, with its share of the cell's flux, per cell of a row that may see something specular.
    fn row(
        &self,
        light: &VisibleLight,
        size: (usize, usize),
        place: (usize, usize, usize),
        part: &RayRange,
    ) -> Tally {
        let (half, face, row) = place;
        let mut paths = PathTracer::new(self.tracer, self.limits, self.unit);
        let mut random = self.generator(light.light, place, part.place);
        let mut tally = Tally::default();
        let mut deposited = LedgerSum::default();
        let strength = self.tracer.scene().lights[light.light].strength() * part.share;
        let cell_size = DVec2::new(1.0 / size.0 as f64, 1.0 / size.1 as f64);
        for (start, end) in light.item_buffer.lattice_spans(face, row, size) {
            for column in start..end {
                let low = DVec2::new(column as f64, row as f64) * cell_size;
                let high = DVec2::new((column + 1) as f64, (row + 1) as f64) * cell_size;
                let square = low + (high - low) * DVec2::new(random(), random());
                let ray = light.launch.ray(face, square);
                let flux_w = light.launch.cell_flux_w(low, high, ray.direction) * strength;
                if self.lobes {
                    let facets = Microfacets::new(|_| DVec2::new(random(), random()));
                    paths.limits.microfacets = Some(facets);
                }
                tally.rays += 1;
                paths.trace(ray, flux_w, light.launch.media(), |arrival| {
                    let count = self.unit.count(arrival.flux_w);
                    deposited.book(self.deposit(half, &arrival, count), count);
                });
            }
        }
        tally.ledger = paths.ledger;
        tally.ledger.merge(&deposited);
        tally.segments = paths.segments;
        tally
    }

    /// Uniform random numbers in [0, 1). Each row has its own generator, so that the order of rows does not matter.
    fn generator(
        &self,
        light: usize,
        (half, face, row): (usize, usize, usize),
        place: u64,
    ) -> impl FnMut() -> f64 {
        let stream = (light as u64) << 40 ^ (half as u64) << 36 ^ (face as u64) << 32 ^ row as u64;
        // Leaves the streams of lights without a size unchanged.
        let stream = stream ^ place.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut generator = Pcg64Mcg::seed_from_u64(self.seed.rotate_left(29) ^ stream);
        move || (generator.next_u64() >> 11) as f64 * (-53_f64).exp2()
    }

    /// Adds flux to the texel that an arrival hits; returns the account to book it to.
    fn deposit(&self, half: usize, arrival: &Arrival, count: FluxCount) -> Account {
        match &self.targets[arrival.receiver.index()] {
            Some(target) if target.add(half, arrival, count) => Account::Deposited,
            _ => Account::Unresolved,
        }
    }
}

/// A map being accumulated: flux per texel for each half set. Integer sums do not depend on their order.
struct Target {
    chart: Arc<Chart>,
    halves: [Vec<[AtomicI64; 3]>; HALVES],
}

impl Target {
    /// Returns whether there was a texel to receive it.
    fn add(&self, half: usize, arrival: &Arrival, count: FluxCount) -> bool {
        let [b, c] = arrival.barycentric.to_array();
        let uv = self.chart.uv(arrival.triangle as usize, [1.0 - b - c, b, c]);
        let index = |share: f64, side: usize| ((share * side as f64).max(0.0) as usize).min(side - 1);
        let texel = index(uv.y, self.chart.height) * self.chart.width + index(uv.x, self.chart.width);
        let covered = self.chart.texel_area_m2(texel) > 0.0;
        if covered {
            for (sum, channel) in self.halves[half][texel].iter().zip(count) {
                sum.fetch_add(channel, Ordering::Relaxed);
            }
        }
        covered
    }

    /// The sum of both half sets, with its noise; `None` if nothing arrived.
    fn map(&self, unit: FluxUnit) -> Option<IlluminationMap> {
        let (mut irradiance, mut error) = (Vec::new(), Vec::new());
        for texel in 0..self.chart.texel_count() {
            let [a, b] = [0, 1].map(|half| {
                let sums = self.halves[half][texel].each_ref();
                unit.flux_w(sums.map(|sum| sum.load(Ordering::Relaxed)))
            });
            let texel_area_m2 = self.chart.texel_area_m2(texel);
            let per_area = if texel_area_m2 > 0.0 {
                1.0 / texel_area_m2
            } else {
                0.0
            };
            irradiance.push(((a + b) * per_area).to_array().map(|channel| channel as f32));
            error.push(((a - b).luminance().abs() * per_area) as f32);
        }
        fill_gutter(&self.chart, &mut irradiance);
        let mut map = IlluminationMap {
            error: Some(error),
            ..IlluminationMap::of_layer(self.chart.clone(), LayerKind::Caustic, irradiance)
        };
        map.estimated_relative_rmse = Some(relative_noise(std::slice::from_ref(&map))?);
        Some(map)
    }
}

/// Empty targets, by receiver; `None` for surfaces that receive no light.
fn targets(scene: &Scene, (width, height): (usize, usize)) -> Vec<Option<Target>> {
    let receivers: Vec<Receiver> = Receiver::all(scene.objects.len()).collect();
    receivers
        .into_par_iter()
        .map(|receiver| {
            let object = receiver.object();
            if !scene.material_of(object).surface.is_receiver() {
                return None;
            }
            let parametrisation = parametrise(object, scene.objects[object].mesh_in_scene())?;
            let empty = || (0..width * height).map(|_| Default::default()).collect();
            Some(Target {
                chart: Arc::new(parametrisation.chart(width, height).of_side(receiver.side())),
                halves: [empty(), empty()],
            })
        })
        .collect()
}

fn unit(scene: &Scene, lights: &[VisibleLight]) -> Result<FluxUnit> {
    let power_w: f64 = lights
        .iter()
        .map(|light| {
            let source = &scene.lights[light.light];
            let bound_w = if source.has_extent() {
                light.power_bound_w(scene)
            } else {
                light.launch.power_bound_w()
            };
            bound_w * source.strength().max_channel()
        })
        .sum();
    if lights.is_empty() {
        return Ok(FluxUnit::for_power(1.0));
    }
    if power_w.is_finite() && power_w > 0.0 {
        return Ok(FluxUnit::for_power(power_w));
    }
    Err(Error::failure(
        &scene.source,
        format!("its lights send {power_w:e} W together"),
        "give them intensities whose sum is a finite number above zero",
    ))
}

fn empty_result(plan: EffectPlan, nothing_to_do: bool) -> Bake {
    Bake {
        maps: Vec::new(),
        light_layers: Vec::new(),
        band_layers: Vec::new(),
        plan,
        item_buffers: Vec::new(),
        ledgers: Vec::new(),
        counts: BakeCounts::default(),
        course: Vec::new(),
        forecast: None,
        timings_s: Timings::default(),
        cpu_s: Timings::default(),
        estimated_relative_rmse: None,
        estimated_visible: None,
        stop_reason: if nothing_to_do {
            StopReason::NothingToDo
        } else {
            StopReason::Density
        },
        partial: false,
        warnings: Vec::new(),
    }
}

/// Noise of all maps together: area-weighted root mean square of their standard errors over their mean. `None` if
/// nothing is lit, or if a map has no error.
pub fn relative_noise(maps: &[IlluminationMap]) -> Option<f64> {
    let (mut area_m2, mut flux_w, mut squares) = (0.0, 0.0, 0.0);
    for map in maps {
        let error = map.error.as_ref()?;
        for (texel, deviation) in error.iter().enumerate() {
            let texel_area_m2 = map.chart.texel_area_m2(texel);
            area_m2 += texel_area_m2;
            squares += f64::from(*deviation).powi(2) * texel_area_m2;
        }
        flux_w += map.flux_w(LayerKind::Caustic).luminance();
    }
    (flux_w > 0.0).then(|| (squares / area_m2).sqrt() * area_m2 / flux_w)
}
