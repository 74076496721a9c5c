//! Schedules indirect light after the layers that it is gathered from.

use super::PreparedBake;
use super::caustic::CausticOutcome;
use super::clock::Clock;
use super::indirect_cache::{IndirectCache, link_bytes, most_texels};
use super::result::LightLayer;
use super::sizes::ChartCache;
use crate::error::Warning;
use crate::illumination::{IlluminationMap, Layer, Receiver};
use crate::light_pass::indirect::{
    Grid, MAX_BOUNCES, MIN_PASSES, Network, NoiseSmoothing, NoiseTolerance, Resampling, Solution, TraceCounts,
};
use crate::light_pass::pass_report::{Seconds, Stopwatch};
use crate::optics::LinearSrgb;
use crate::progress::Control;
use crate::settings::LayerKind;

/// Target of the relative error of the rays if the settings have none [1].
const USUAL_TARGET: f64 = 0.03;

/// Lost share of what rays carry above which a warning is due.
const UNSPOKEN_LOSS: f64 = 1e-3;

/// Indirect light in the course of a bake.
#[derive(Clone, Debug, Default)]
pub(super) struct IndirectWork {
    /// Work of this bake.
    counts: TraceCounts,
    seconds: Seconds,
    /// The solution that the last maps show.
    solution: Option<Solution>,
    /// Its noise.
    tolerance: NoiseTolerance,
    /// Passes per element.
    passes: Vec<u8>,
    /// Target of the relative error.
    target: f64,
    /// Whether the memory limit prevents more rays.
    is_cramped: bool,
    /// Lost share of what all rays carried.
    loss: f64,
    /// Whether no more rays follow.
    is_done: bool,
}

impl IndirectWork {
    /// Traces rays between the elements until their error meets the target, and solves for the indirect light of
    /// `maps`; false if cancelled before the first solution. Calls `better` for each solution but the last.
    pub(super) fn gather(
        &mut self,
        bake: &PreparedBake,
        sizes: &ChartCache,
        cache: &mut IndirectCache,
        maps: &[IlluminationMap],
        better: &mut dyn FnMut(&Self, &IndirectCache),
    ) -> bool {
        // The rays between surfaces do not depend on the lights: those of earlier bakes are used again.
        let watch = Stopwatch::start();
        let settings = bake.settings;
        cache.prepare(&bake.tracer, sizes, settings, most_texels(settings));
        self.seconds.add(watch.elapsed());

        // After the first passes, none starts beyond the time limit.
        let limited = super::limited(bake.control, settings.max_time_s, bake.began);
        let target = settings.max_error.unwrap_or(USUAL_TARGET);
        (self.target, self.solution) = (target, None);

        // Each round doubles the rays of elements that are too noisy, and solves for all bounces anew.
        let elements = cache.network().map_or(0, Network::element_count);
        let mut passes = vec![MIN_PASSES; elements];
        loop {
            let watch = Stopwatch::start();
            let is_there = self.step(bake, &limited, cache, maps, &passes);
            let wanting = match &self.solution {
                Some(solution) if is_there && !bake.control.is_cancelled() => {
                    self.tolerance.wanting(target, solution, &passes)
                }
                _ => Vec::new(),
            };
            self.seconds.add(watch.elapsed());
            self.is_done = wanting.is_empty();
            if self.is_done {
                cache.passes.clone_from(&self.passes);
                return self.solution.is_some();
            }
            better(self, cache);
            wanting.into_iter().for_each(|element| passes[element] += 1);
        }
    }

    /// Solves with the requested passes; false if they could not be traced.
    fn step(
        &mut self,
        bake: &PreparedBake,
        limited: &Control,
        cache: &mut IndirectCache,
        maps: &[IlluminationMap],
        passes: &[u8],
    ) -> bool {
        let has_solution = self.solution.is_some();
        let Some(network) = cache.network() else {
            return false;
        };
        let before = network.counts();
        self.is_cramped = has_solution && network.bytes_after(passes) > link_bytes(bake.settings);
        let control = if has_solution { limited } else { bake.control };
        let is_traced = !self.is_cramped && cache.trace(&bake.tracer, passes, bake.progress, control);
        let Some(network) = cache.network() else {
            return false;
        };
        let after = network.counts();
        self.counts.rays += after.rays - before.rays;
        self.counts.segments += after.segments - before.segments;
        self.loss = (after.truncated + after.lost as f64) / (after.rays as f64).max(1.0);
        if is_traced {
            let sources = sources(network, maps);
            let solution = network.solve(&sources, passes);
            self.tolerance = network.tolerance(&solution, &sources, bake.settings.error_metric);
            self.solution = Some(solution);
            self.passes = passes.to_vec();
        }
        is_traced
    }

    /// Solves for `maps` with rays that were traced earlier, if any, for intermediate pictures.
    pub(super) fn of_known(cache: &IndirectCache, maps: &[IlluminationMap]) -> Self {
        let mut known = Self::default();
        if let Some(network) = cache.network().filter(|_| !cache.passes.is_empty()) {
            known.passes.clone_from(&cache.passes);
            known.solution = Some(network.solve(&sources(network, maps), &known.passes));
        }
        known
    }

    /// Adds the layer to the maps, and its error to theirs; also each light's part if other layers have parts.
    pub(super) fn add_to(
        &self,
        cache: &IndirectCache,
        maps: &mut [IlluminationMap],
        light_layers: &mut Vec<LightLayer>,
    ) {
        // The parts of lights take the other layers of `light_layers` as their sources, and then join them.
        let (Some(network), Some(solution)) = (cache.network(), &self.solution) else {
            return;
        };
        // Where rays did not suffice, light is smoothed. Its error is that of the rays.
        let smoothing = NoiseSmoothing::new(network, solution, &self.tolerance, self.target);
        let smoothed = smoothing.of(network, &solution.irradiance);
        let mut parts = self.parts(network, &smoothing, maps, light_layers);
        light_layers.append(&mut parts);

        // The noise of gather rays is independent of that of the caustic, so that errors add in squares.
        for map in maps {
            let Some(grid) = grid_of(network, map) else {
                continue;
            };
            let errors: Vec<[f64; 3]> = network.errors(grid, solution).iter().map(|e| [*e; 3]).collect();
            let is_hidden = |element: usize| network.is_hidden(grid.first + element);
            let error = Resampling::new(grid, &map.chart).to_map(&errors, is_hidden);
            let has_caustic = map.layer(LayerKind::Caustic).is_some();
            map.error = match map.error.take() {
                Some(other) => Some(other.iter().zip(&error).map(|(a, b)| a.hypot(b[0])).collect()),
                // If the error of the caustic is unknown, so is that of the sum.
                None if has_caustic => None,
                None => Some(error.iter().map(|e| e[0]).collect()),
            };
            map.layers.push(Layer {
                kind: LayerKind::Indirect,
                irradiance: on_map(network, grid, map, &smoothed),
            });
        }
    }

    /// Each light's part of the layer: the same rays, its own sources.
    fn parts(
        &self,
        network: &Network,
        smoothing: &NoiseSmoothing,
        maps: &[IlluminationMap],
        light_layers: &[LightLayer],
    ) -> Vec<LightLayer> {
        // Sources of a light are its parts of the other layers.
        let mut lights: Vec<usize> = light_layers.iter().map(|part| part.light).collect();
        lights.sort_unstable();
        lights.dedup();

        // Light transport is linear: solved for one light after another, the parts add up to the layer.
        let mut parts = Vec::new();
        for light in lights {
            let of_light = |receiver: Receiver| {
                let own = light_layers.iter();
                own.filter(move |part| part.light == light && part.receiver == receiver)
                    .map(|part| &part.irradiance[..])
            };
            let mut sources = vec![LinearSrgb::BLACK; network.element_count()];
            for map in maps {
                add_sources(network, map, of_light(map.chart.receiver), &mut sources);
            }
            let solution = network.solve(&sources, &self.passes);
            let smoothed = smoothing.of(network, &solution.irradiance);
            for map in maps {
                let Some(grid) = grid_of(network, map) else {
                    continue;
                };
                parts.push(LightLayer {
                    receiver: map.chart.receiver,
                    light,
                    kind: LayerKind::Indirect,
                    irradiance: on_map(network, grid, map, &smoothed),
                });
            }
        }
        parts
    }

    /// The outcome with this work added.
    pub(super) fn added_to(&self, outcome: &CausticOutcome) -> CausticOutcome {
        let mut both = outcome.clone();
        both.counts.gather_rays += self.counts.rays;
        both.counts.gather_segments += self.counts.segments;
        both.counts.bounces = self.solution.as_ref().map_or(0, |solution| solution.bounces);
        both.warnings.extend(self.warnings());
        both
    }

    fn warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let Some(solution) = &self.solution else {
            return warnings;
        };
        let percent = |share: f64| format!("{:.2} %", 100.0 * share);

        // With albedos near 1, each bounce carries nearly as much light as the one before.
        if !solution.converged {
            warnings.push(Warning::new(
                "indirect layer",
                format!(
                    "after {MAX_BOUNCES} bounces it has not converged: surfaces reflect nearly all light"
                ),
                "use albedos below 1",
            ));
        }

        // Noise above the target matters only once no more rays follow.
        if self.is_done && self.tolerance.relative_noise > self.target {
            let rays = Network::rays_after(self.passes.iter().copied().max().unwrap_or(0));
            let remedy = if self.is_cramped {
                "allow more --memory"
            } else {
                "allow more --max-time or --max-error"
            };
            warnings.push(Warning::new(
                "indirect layer",
                format!(
                    "its estimated error is {}, above the target of {}, with up to {rays} rays per texel of its grid",
                    percent(self.tolerance.relative_noise),
                    percent(self.target)
                ),
                remedy,
            ));
        }

        // Rays that were given up darken the layer, which no noise shows.
        if self.loss > UNSPOKEN_LOSS {
            warnings.push(Warning::new(
                "indirect layer",
                format!(
                    "{} of what its rays carry was given up between mirrors or in glass",
                    percent(self.loss)
                ),
                "allow more --max-depth",
            ));
        }
        warnings
    }

    pub(super) fn clock(&self, clock: &Clock) -> Clock {
        let mut both = *clock;
        both.trace.add(self.seconds);
        both
    }
}

/// Indirect light on a map [W/m²].
fn on_map(network: &Network, grid: &Grid, map: &IlluminationMap, irradiance: &[LinearSrgb]) -> Vec<[f32; 3]> {
    let own = grid.first..grid.first + grid.elements.all().len();
    let values: Vec<[f64; 3]> = irradiance[own].iter().map(|e| e.to_array()).collect();
    let is_hidden = |element: usize| network.is_hidden(grid.first + element);
    Resampling::new(grid, &map.chart).to_map(&values, is_hidden)
}

/// Sums of all source layers on all elements [W/m²].
fn sources(network: &Network, maps: &[IlluminationMap]) -> Vec<LinearSrgb> {
    let mut sources = vec![LinearSrgb::BLACK; network.element_count()];
    for map in maps {
        let layers = map
            .layers
            .iter()
            .filter(|layer| layer.kind != LayerKind::Indirect);
        add_sources(
            network,
            map,
            layers.map(|layer| &layer.irradiance[..]),
            &mut sources,
        );
    }
    sources
}

fn add_sources<'a>(
    network: &Network,
    map: &IlluminationMap,
    layers: impl Iterator<Item = &'a [[f32; 3]]>,
    sources: &mut [LinearSrgb],
) {
    let Some(grid) = grid_of(network, map) else {
        return;
    };
    let resampling = Resampling::new(grid, &map.chart);
    for layer in layers {
        for (index, e) in resampling.to_grid(layer).into_iter().enumerate() {
            sources[grid.first + index] += e;
        }
    }
}

fn grid_of<'a>(network: &'a Network, map: &IlluminationMap) -> Option<&'a Grid> {
    let is_own = |grid: &&Grid| grid.chart.receiver == map.chart.receiver;
    network.grids().iter().find(is_own)
}
