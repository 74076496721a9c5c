//! One light by splats: the whole lattice at once, and thinner ones for its error.

use super::caustic::{CausticLayer, Course};
use super::light_level::{LevelKey, LightLevel, LightState, SoftParts, TraceKey};
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::accuracy::{self, Images};
use crate::light_pass::caustic::deposit::{Depositor, Halves};
use crate::light_pass::caustic::kept::KeptLight;
use crate::light_pass::caustic::lattice::Lattice;
use crate::light_pass::caustic::pass::{self, Listener, PassReport, Source};
use crate::light_pass::caustic::setup::AimedLight;
use crate::light_pass::caustic::statistics::FootprintStatistics;
use crate::light_pass::receiver_maps::ReceiverMaps;
use crate::settings::{BakeSettings, Footprint, Sigma};

/// Strides of the lattice for mean footprints, at most.
const COARSENING: usize = 8;

/// Least side of that lattice.
const LEAST_COARSE_SIDE: usize = 64;

/// Stride of the lattice that the blur of splats is estimated from.
const ERROR_STRIDE: usize = 2;

impl CausticLayer<'_> {
    /// Traces and deposits a light, or deposits again what arrived for other kernels and maps; `None` where it was
    /// stopped.
    pub(super) fn make_splats(
        &self,
        light: &AimedLight,
        key: LevelKey,
        unit: FluxUnit,
        state: &mut LightState,
        course: &mut Course,
    ) -> Option<LightLevel> {
        let (mut maps, mut second) = (self.no_maps(), self.no_maps());
        let lattice = Lattice {
            strides: (key.stride, key.stride),
            ..self.lattice(light, unit)
        };
        let source = match source_of(state, &key.trace) {
            Source::Rays { .. } if key.stride == 1 => Source::Rays {
                keep_bytes: self.settings.kept_light_bytes(),
            },
            source => source,
        };
        let mut halves = Halves {
            first: &mut maps,
            second: Some(&mut second),
        };
        let (report, arrived) = self.deposit_splats(lattice, source, &key, &mut halves, course);
        if let Some(arrived) = arrived {
            state.arrivals = Some((key.trace.clone(), arrived));
        }
        course.outcome.count(&report, course.clock);
        let noise = (!report.cancelled).then(|| {
            course.clock.time(
                |clock| &mut clock.deposit,
                || {
                    let [a, b] = [&maps, &second].map(|maps| accuracy::images(maps, unit));
                    accuracy::half_set_noise(&a, &b)
                },
            )
        });
        maps.add(second);
        (!report.cancelled).then_some(LightLevel {
            key,
            noise,
            maps,
            unit,
            ledger: report.ledger,
            overreaches: Vec::new(),
            error: None,
            traced: None,
            has_own_colour: false,
            parts: SoftParts::default(),
        })
    }

    fn deposit_splats(
        &self,
        lattice: Lattice,
        source: Source,
        key: &LevelKey,
        halves: &mut Halves,
        course: &Course,
    ) -> (PassReport, Option<KeptLight>) {
        let depositor = Depositor {
            lattice,
            settings: self.settings,
            statistics: course.statistics.as_ref(),
            gathers: false,
        };
        let listener = Listener {
            progress: self.progress,
            control: course.control,
            done: course.outcome.counts.rays,
            total: lattice.ray_count(),
        };
        let chart_for = |receiver: Receiver| self.chart(receiver, &key.sizes);
        pass::run(&depositor, source, halves, &chart_for, &listener)
    }

    /// Traces and deposits one wavefront of a soft light onto maps.
    pub(super) fn run_splats(
        &self,
        light: &AimedLight,
        key: &LevelKey,
        unit: FluxUnit,
        maps: &mut ReceiverMaps,
        course: &Course,
    ) -> PassReport {
        let lattice = Lattice {
            size: key.trace.size,
            ..self.lattice(light, unit)
        };
        let mut all = Halves {
            first: maps,
            second: None,
        };
        self.deposit_splats(lattice, Source::Rays { keep_bytes: 0 }, key, &mut all, course)
            .0
    }

    /// Maps of every second ray across and down, each for four.
    pub(super) fn thinned_images(
        &self,
        light: &AimedLight,
        level: &LightLevel,
        state: &LightState,
        course: &mut Course,
    ) -> Option<Images> {
        if level.key.stride > 1 {
            return None;
        }
        let lattice = Lattice {
            strides: (ERROR_STRIDE, ERROR_STRIDE),
            ..self.lattice(light, level.unit)
        };
        let mut maps = self.no_maps();
        let source = source_of(state, &level.key.trace);
        let mut all = Halves {
            first: &mut maps,
            second: None,
        };
        let (report, _) = self.deposit_splats(lattice, source, &level.key, &mut all, course);
        course.outcome.count(&report, course.clock);
        Some(accuracy::images(&maps, level.unit))
    }

    pub(super) fn no_maps(&self) -> ReceiverMaps {
        ReceiverMaps::new(self.tracer.scene().objects.len())
    }

    /// Mean footprints at the full density, from a lattice some 64 times thinner.
    pub(super) fn splat_statistics(
        &self,
        light: &AimedLight,
        unit: FluxUnit,
        state: &LightState,
        course: &mut Course,
    ) -> FootprintStatistics {
        let settings = BakeSettings {
            footprint: Footprint::Ellipse,
            sigma: Sigma::Constant(1.0),
            ..self.settings.clone()
        };
        let lattice = thinned(self.lattice(light, unit));
        let depositor = Depositor {
            lattice,
            settings: &settings,
            statistics: None,
            gathers: true,
        };
        let listener = Listener {
            progress: &(),
            control: course.control,
            done: 0,
            total: 0,
        };
        let chart_for = |receiver: Receiver| {
            let aspect = self.sizes.parametrisation(receiver.object())?.suggested_aspect;
            self.sizes.chart(receiver, super::sizes::first_size(aspect))
        };
        let mut maps = self.no_maps();
        let mut all = Halves {
            first: &mut maps,
            second: None,
        };
        let source = source_of(state, &self.trace_key(light, lattice.size, 0, &[]));
        let (mut report, _) = pass::run(&depositor, source, &mut all, &chart_for, &listener);
        // The kernels of the coarse run are in no map.
        report.splats = 0;
        course.outcome.count(&report, course.clock);
        let cells = (lattice.strides.0 * lattice.strides.1) as f64;
        report.statistics.refined(cells)
    }
}

/// Strides of a light's levels: something soon, then every ray.
pub(super) const LEVEL_STRIDES: [usize; 2] = [8, 1];

/// What arrived before, or rays that are not kept.
fn source_of<'a>(state: &'a LightState, key: &TraceKey) -> Source<'a> {
    match &state.arrivals {
        Some((known, kept)) if known == key => Source::Kept(kept),
        _ => Source::Rays { keep_bytes: 0 },
    }
}

/// The lattice for mean footprints: every so many-th of the same rays, so that kept ones will do.
fn thinned(lattice: Lattice) -> Lattice {
    let stride = |side: usize| (side / LEAST_COARSE_SIDE).clamp(1, COARSENING);
    Lattice {
        strides: (stride(lattice.size.0), stride(lattice.size.1)),
        ..lattice
    }
}
