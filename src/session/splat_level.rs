//! One light by splats: the whole lattice at once, and thinner ones for its error.

use super::caustic::{CausticLayer, Course};
use super::light_level::{LevelKey, LightLevel, LightState, SoftParts, TraceKey};
use super::part_maps::PartMaps;
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxUnit;
use crate::light_pass::accuracy::{self, Images};
use crate::light_pass::caustic::deposit::{Depositor, Halves};
use crate::light_pass::caustic::kept::KeptLight;
use crate::light_pass::caustic::lattice::Lattice;
use crate::light_pass::caustic::pass::{self, Listener, PassReport, Source};
use crate::light_pass::caustic::setup::AimedLight;
use crate::light_pass::caustic::statistics::FootprintStatistics;
use crate::light_pass::ledger_sum::LedgerSum;
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
        let (mut maps, mut second) = (self.part_maps(), self.part_maps());
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
        let halves = (&mut maps, Some(&mut second));
        let (mut report, arrived) = self.deposit_parts(light, lattice, source, &key, halves, course);
        if let Some(arrived) = arrived {
            state.arrivals = Some((key.trace.clone(), arrived));
        }
        let (mut maps, mut bands) = maps.into_sum();
        let (mut second, more) = second.into_sum();
        let mut none = LedgerSum::default();
        self.spectra
            .to_linear_srgb(light.light, &mut maps, &mut report.ledger);
        self.spectra.to_linear_srgb(light.light, &mut second, &mut none);
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
        for (band, more) in bands.iter_mut().zip(more) {
            band.add(more);
        }
        (!report.cancelled).then_some(LightLevel {
            key,
            noise,
            maps,
            bands: self.spectra.level_bands(light.light, bands),
            radiant: self.spectra.radiant(light.light),
            unit,
            ledger: report.ledger,
            overreaches: Vec::new(),
            error: None,
            traced: None,
            has_own_colour: self.spectra.has(light.light),
            parts: SoftParts::default(),
        })
    }

    /// Every part of a light's spectrum, one after the other. What arrived is given back of light without one.
    fn deposit_parts(
        &self,
        light: &AimedLight,
        lattice: Lattice,
        source: Source,
        key: &LevelKey,
        (first, mut second): (&mut PartMaps, Option<&mut PartMaps>),
        course: &Course,
    ) -> (PassReport, Option<KeptLight>) {
        let (mut report, mut kept) = (PassReport::default(), None);
        for (band, part) in self.spectra.parts(light.light) {
            let mut halves = Halves {
                first: first.of(band),
                second: second.as_deref_mut().map(|second| second.of(band)),
            };
            let lattice = Lattice {
                band: part.node(0),
                size: self.spectra.part_size(light.light, lattice.size),
                centre: self.spectra.ray_place(light.light, band),
                ..lattice
            };
            let source = if band.is_some() {
                Source::Rays { keep_bytes: 0 }
            } else {
                source
            };
            let (of_part, arrived) = self.deposit_splats(lattice, source, key, &mut halves, course);
            report.merge(of_part);
            kept = arrived;
            if report.cancelled {
                break;
            }
        }
        (report, kept)
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
        maps: &mut PartMaps,
        course: &Course,
    ) -> PassReport {
        let lattice = Lattice {
            size: key.trace.size,
            ..self.lattice(light, unit)
        };
        let source = Source::Rays { keep_bytes: 0 };
        self.deposit_parts(light, lattice, source, key, (maps, None), course)
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
        let mut maps = self.part_maps();
        let source = source_of(state, &level.key.trace);
        let (mut report, _) =
            self.deposit_parts(light, lattice, source, &level.key, (&mut maps, None), course);
        let (mut maps, _) = maps.into_sum();
        self.spectra
            .to_linear_srgb(light.light, &mut maps, &mut report.ledger);
        course.outcome.count(&report, course.clock);
        Some(accuracy::images(&maps, level.unit))
    }

    /// Maps without light, by band where those are kept.
    pub(super) fn part_maps(&self) -> PartMaps {
        PartMaps::new(self.tracer.scene().objects.len(), self.spectra.kept_bands())
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
