//! Brute-force light tracing, the reference for the estimators: random rays, each hit's whole flux into the texel it
//! falls in. It shares only transport and aiming with bundles and photons, and the walk of rays with splats.
//!
//! Rays are stratified: one at a random position in each cell of a lattice. The noise is measured with two such
//! lattices, each with half of the rays. Each carries half of the flux, so that their sum is the map, and their
//! difference A − B has the same variance as the sum.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

use glam::DVec2;
use rayon::prelude::*;

use crate::bake::{Bake, StopReason};
use crate::error::{Error, Result};
use crate::geometry::sampling::{even_point, mix64};
use crate::illumination::accumulator::{FluxCount, FluxUnit};
use crate::illumination::gutter::fill_gutter;
use crate::illumination::map::estimated_relative_rmse;
use crate::illumination::parametrisation::parametrise;
use crate::illumination::{Chart, IlluminationMap, Receiver};
use crate::light_pass::emitter::EmitterSampler;
use crate::light_pass::ledger_sum::Account;
use crate::light_pass::pass_report::{PassReport, Stopwatch};
use crate::light_pass::path::{Arrival, PathLimits};
use crate::light_pass::splat::lattice::Lattice;
use crate::light_pass::visibility::{CullMode, LightVisibility, VisibleLight};
use crate::optics::LinearSrgb;
use crate::plan::{self, Effect, EffectSet, EffectSwitch};
use crate::progress::{Control, Progress, Stage};
use crate::scene::{Material, Scene};
use crate::settings::{BakeSettings, ItemBufferKind, LayerKind, MapResolution, RayPlacement};
use crate::transport::Tracer;

/// Range of the number of rays.
pub const RAYS: std::ops::RangeInclusive<u64> = 1_000..=1_000_000_000_000;

/// Bakes the caustic layer of a scene with about `rays` rays ([`RAYS`]), divided evenly among the lights, without
/// dispersion. Of the settings, map resolution (which must be fixed), seed, item buffer, depth, branch threshold,
/// threads and the switches of effects apply. Each map's `error` is the texel's standard error [W/m²], and its
/// `estimated_relative_rmse` is the noise: the root mean square of these over the mean. Bit-identical for any number of
/// threads.
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
    // Nothing specular is culled for light from one point or direction: a reference must not inherit what culling
    // misses. The points of a lamp with a size are culled one by one.
    let scene = tracer.scene();
    let watch = Stopwatch::start();
    progress.advance(Stage::Plan, 0, 1);
    let sizes = settings.effects.get(Effect::AreaLights) != EffectSwitch::Off;
    let visibility = LightVisibility::take(tracer, settings.item_buffer, CullMode::Everything, sizes);
    let plan = plan::decide(scene, settings, &visibility.reaches);
    let lights: &[VisibleLight] = if plan.is_on(Effect::LightPass) {
        &visibility.lights
    } else {
        &[]
    };

    // Rough surfaces are sampled as microfacets. All lights add to the same maps, in one unit of flux.
    let is_rough = settings.effects.get(Effect::Roughness) != EffectSwitch::Off
        && scene.materials.iter().any(Material::is_rough);
    let run = Run {
        tracer,
        limits: PathLimits {
            microfacets: is_rough.then_some(0),
            effects: EffectSet::unless_off(&settings.effects),
            ..PathLimits::smooth(settings.photon_depth(), settings.path_threshold())
        },
        item_buffer: settings.item_buffer,
        sizes,
        unit: unit(scene, lights)?,
        targets: targets(scene, size),
        seed: settings.seed,
        rays_per_half: (rays as f64 / (2 * lights.len().max(1)) as f64).max(1.0),
        progress,
        control,
        done: AtomicU64::new(0),
        total: lights.len() as u64 * OF_A_LIGHT,
    };

    // A reference that was cut off would pass for the truth, so that cancellation is an error.
    let mut result = Bake {
        stop_reason: if lights.is_empty() {
            StopReason::NothingToDo
        } else {
            StopReason::Density
        },
        plan,
        ..Bake::default()
    };
    for light in lights {
        let report = run.light(light);
        if control.is_cancelled() {
            return Err(Error::cancelled(&scene.source));
        }
        result.counts.rays += report.rays;
        result.counts.segments += report.segments;
        let name = &scene.lights[light.light].name;
        result
            .ledgers
            .push(report.ledger.report(name, run.unit, LinearSrgb::WHITE));
    }

    // Both half sets of rays become the map and its standard error.
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
    item_buffer: ItemBufferKind,
    /// Whether lights are sampled over their size.
    sizes: bool,
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

/// Rays from one position of a light.
#[derive(Clone, Copy, Debug)]
struct RaySet {
    half: usize,
    /// Of this position in this half set, independent of all others.
    seed: u64,
    /// Number of positions in each half set.
    places: usize,
}

fn merged(mut sum: PassReport, other: PassReport) -> PassReport {
    sum.merge(other);
    sum
}

impl Run<'_> {
    /// Reports one of `parts` equal parts of a light as done.
    fn advance(&self, parts: usize) {
        let part = OF_A_LIGHT / parts as u64;
        let done = self.done.fetch_add(part, Ordering::Relaxed) + part;
        self.progress.advance(Stage::Caustic, done, self.total);
    }

    /// Traces both half sets of a light.
    fn light(&self, light: &VisibleLight) -> PassReport {
        // A lamp with a size is the mean of points on it, each of which sends all of its light.
        let source = self.tracer.scene().lights[light.light].of_unit_strength();
        let sampler = EmitterSampler::new(&source, self.tracer.scene());
        let has_places = self.sizes && source.has_extent();
        let places = if has_places { PLACES } else { 1 };
        let of_place = |index: usize| {
            let (half, place) = (index / places, index % places);
            let of_half = mix64(self.seed ^ mix64((light.light as u64) << 1 | half as u64));
            let rays = RaySet {
                half,
                seed: mix64(of_half ^ place as u64),
                places,
            };
            if !has_places {
                return self.place(light, rays);
            }
            // Each half set has its own positions, evenly spread.
            let square = even_point(place as u32, 0, of_half);
            let there = sampler
                .sample(square)
                .filter(|_| !self.control.is_cancelled())
                .and_then(|emitter| {
                    light.from_place(self.tracer, (self.item_buffer, CullMode::Reachable), &emitter)
                });

            // Progress counts points that send nothing to a caster, too.
            match there {
                Some(there) => self.place(&there, rays),
                None => {
                    self.advance(HALVES * places);
                    PassReport::default()
                }
            }
        };
        (0..HALVES * places)
            .into_par_iter()
            .map(of_place)
            .reduce(PassReport::default, merged)
    }

    /// Traces a random ray, with its share of the flux, in each cell of a lattice that may see something specular.
    fn place(&self, light: &VisibleLight, rays: RaySet) -> PassReport {
        // Flux of this set of rays: the light of one point, divided between points and half sets.
        let share = 1.0 / (HALVES * rays.places) as f64;
        let strength = self.tracer.scene().lights[light.light].strength() * share;
        let launch = light.launch.clone().scaled(strength);
        // Rays per steradian, or per square metre for a sun.
        let density =
            (self.rays_per_half / rays.places as f64).max(1.0) / light.item_buffer.marked_measure(&launch);

        // One ray at a random place in each cell: strata leave less noise than independent rays.
        let lattice = Lattice {
            tracer: self.tracer,
            band: None,
            launch: &launch,
            item_buffer: &light.item_buffer,
            size: launch.lattice_size(density, 1.0),
            strides: (1, 1),
            placement: RayPlacement::Jittered,
            centre: DVec2::ZERO,
            seed: rays.seed,
            limits: self.limits,
            unit: self.unit,
        };

        // A hit goes whole into its texel, so that no kernel blurs the reference. What meets no texel is unresolved.
        let rows = lattice.size.1;
        let of_row = |row: usize| {
            if self.control.is_cancelled() {
                return PassReport::default();
            }
            let mut traced = lattice.trace_row(row / rows, row % rows);
            for arrival in &traced.arrivals {
                let count = self.unit.count(arrival.flux_w);
                let account = match &self.targets[arrival.receiver.index()] {
                    Some(target) if target.add(rays.half, arrival, count) => Account::Deposited,
                    _ => Account::Unresolved,
                };
                traced.ledger.book(account, count);
            }
            self.advance(HALVES * rays.places * launch.face_count() * rows);
            PassReport {
                ledger: traced.ledger,
                rays: traced.rays,
                segments: traced.segments,
                ..PassReport::default()
            }
        };
        (0..launch.face_count() * rows)
            .into_par_iter()
            .map(of_row)
            .reduce(PassReport::default, merged)
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
            let [sum, difference] = [a + b, a - b].map(|flux_w| self.chart.per_area(texel, flux_w));
            irradiance.push(sum.to_array().map(|channel| channel as f32));
            error.push(difference.luminance().abs() as f32);
        }
        fill_gutter(&self.chart, &mut irradiance);
        let mut map = IlluminationMap {
            error: Some(error),
            ..IlluminationMap::of_layer(self.chart.clone(), LayerKind::Caustic, irradiance)
        };
        map.estimated_relative_rmse = Some(estimated_relative_rmse(std::slice::from_ref(&map))?);
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

/// Of the power of all lights together.
fn unit(scene: &Scene, lights: &[VisibleLight]) -> Result<FluxUnit> {
    let of_light = |light: &VisibleLight| {
        light.power_bound_w(scene) * scene.lights[light.light].strength().max_channel()
    };
    let power_w: f64 = lights.iter().map(of_light).sum();
    if lights.is_empty() || (power_w.is_finite() && power_w > 0.0) {
        return Ok(FluxUnit::for_power(power_w.max(f64::MIN_POSITIVE)));
    }
    Err(Error::failure(
        &scene.source,
        format!("its lights send {power_w:e} W together"),
        "give them intensities whose sum is a finite number above zero",
    ))
}
