//! The chart of each surface and the size of its map.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use glam::DVec3;

use super::map_size::{self, Borders, MapSize, SizeRequest, Sizes, TileDemand};
use crate::illumination::parametrisation::{Parametrisation, parametrise};
use crate::illumination::tiles::{TileLayout, tile_counts};
use crate::illumination::{Chart, Receiver, Side, UvSet};
use crate::light_pass::direct::find_borders;
use crate::light_pass::footprint_statistics::FootprintStatistics;
use crate::progress::Control;
use crate::scene::watertight::is_closed;
use crate::scene::{LightKind, Scene};
use crate::settings::{BakeSettings, Estimator, MapResolution};
use crate::transport::Tracer;

/// Side of a map before the first doubling [texels].
pub const FIRST_SIDE: usize = 64;

/// Largest side that automatic doubling reaches without tiles [texels]; larger maps have to be requested.
pub const LARGEST_AUTOMATIC_SIDE: usize = 2048;

/// Largest side of tiled maps [texels of the finest size].
pub const LARGEST_TILED_SIDE: usize = 4096;

/// Memory per texel while flux is summed and maps are finished [bytes]: three 64-bit sums, three floats per layer, an
/// area.
pub const BYTES_PER_TEXEL: u64 = 24 + 2 * 12 + 8;

/// What a light keeps per texel of a level [bytes]: at most three 64-bit sums with their bit, and an error.
const BYTES_PER_LIT_TEXEL: u64 = 24 + 1 + 4;

/// Sums of both halves of the photons, per texel [bytes].
const BYTES_PER_PHOTON_TEXEL: u64 = 2 * 24;

/// Per texel in the course of a bake by photons [bytes]: the maps of the light that is traced, its bundles and its
/// photons, or about as much for finished maps and the weights of their errors.
const BYTES_PER_TRACED_TEXEL: u64 = 2 * 24 + BYTES_PER_PHOTON_TEXEL;

/// The same by splats: finished maps and the weights of their errors; estimates from differences between
/// maps take less.
const BYTES_PER_ESTIMATED_TEXEL: u64 = BYTES_PER_TEXEL + 8;

/// Per texel of the map whose photons are being filtered, with its details at all levels [bytes].
const BYTES_PER_FILTERED_TEXEL: u64 = 136;

/// Memory of maps while they are made.
#[derive(Clone, Debug)]
pub(super) struct MapMemory {
    /// Per texel of every map, for the sum of all lights and the one that is being traced [bytes].
    per_texel: u64,
    /// In addition, per texel and light [bytes].
    per_lit_texel: u64,
    /// In addition, per texel of the largest map [bytes].
    per_texel_of_largest: u64,
    /// Number of lights that reach each receiver.
    lights: BTreeMap<Receiver, u64>,
}

impl MapMemory {
    /// Maps that are finished.
    pub(super) fn finished(lights: BTreeMap<Receiver, u64>) -> Self {
        Self {
            per_texel: BYTES_PER_TEXEL,
            per_lit_texel: BYTES_PER_LIT_TEXEL,
            per_texel_of_largest: 0,
            lights,
        }
    }

    /// Maps that are made. `keeps_photons`: lights keep the sums of their photons.
    pub(super) fn with(estimator: Estimator, keeps_photons: bool, lights: BTreeMap<Receiver, u64>) -> Self {
        match estimator {
            // Maps are filtered one after another.
            Estimator::Auto | Estimator::Photon => Self {
                per_texel: BYTES_PER_TRACED_TEXEL,
                per_lit_texel: BYTES_PER_LIT_TEXEL + if keeps_photons { BYTES_PER_PHOTON_TEXEL } else { 0 },
                per_texel_of_largest: BYTES_PER_FILTERED_TEXEL,
                lights,
            },
            Estimator::Splat => Self {
                per_texel: BYTES_PER_ESTIMATED_TEXEL,
                // Both halves, and the level of the first picture.
                per_lit_texel: 3 * BYTES_PER_LIT_TEXEL,
                per_texel_of_largest: 0,
                lights,
            },
        }
    }

    /// Memory of maps with these numbers of texels [bytes].
    pub(super) fn bytes(&self, texels: impl Iterator<Item = (Receiver, u64)>) -> u64 {
        let (mut all, mut largest) = (0_u64, 0);
        for (receiver, texels) in texels {
            let lights = self.lights.get(&receiver).copied().unwrap_or(0);
            let per_texel = self.per_texel + lights * self.per_lit_texel;
            all = all.saturating_add(texels.saturating_mul(per_texel));
            largest = largest.max(texels);
        }
        all.saturating_add(largest.saturating_mul(self.per_texel_of_largest))
    }

    /// Memory of maps of these sizes [bytes].
    pub(super) fn of_sizes(&self, sizes: &Sizes) -> u64 {
        self.bytes(sizes.iter().map(|(&receiver, size)| (receiver, size.texels())))
    }
}

/// Parametrisations and charts of a scene's surfaces, made on first use.
#[derive(Debug)]
pub struct ChartCache {
    scene: Arc<Scene>,
    parametrisations: Vec<OnceLock<Option<Arc<Parametrisation>>>>,
    /// Whether each object's mesh is closed.
    closed: Vec<OnceLock<bool>>,
    core_diagonal_m: OnceLock<Option<f64>>,
    /// Charts by receiver, those used last at the end.
    charts: Mutex<BTreeMap<Receiver, Vec<Arc<Chart>>>>,
    /// Shadow borders of each light on each receiver.
    borders: Mutex<BTreeMap<(usize, Receiver), Borders>>,
}

/// Maximum number of charts kept per receiver.
const MAX_CHARTS: usize = 8;

impl ChartCache {
    pub fn new(scene: Arc<Scene>) -> Self {
        let parametrisations = scene.objects.iter().map(|_| OnceLock::new()).collect();
        let closed = scene.objects.iter().map(|_| OnceLock::new()).collect();
        Self {
            scene,
            parametrisations,
            closed,
            core_diagonal_m: OnceLock::new(),
            charts: Mutex::default(),
            borders: Mutex::default(),
        }
    }

    /// Moves on to an edited copy of the scene, and keeps what belongs to unchanged shapes.
    pub fn edited(self, scene: Arc<Scene>, changed: &[usize]) -> Self {
        let mut sizes = Self {
            scene,
            core_diagonal_m: OnceLock::new(),
            ..self
        };
        for &object in changed {
            sizes.parametrisations[object] = OnceLock::new();
            sizes.closed[object] = OnceLock::new();
        }
        let charts = sizes.charts.get_mut().unwrap_or_else(PoisonError::into_inner);
        charts.retain(|receiver, _| !changed.contains(&receiver.object()));
        sizes
    }

    /// Drops the shadow borders of one light, or of all lights.
    pub fn forget_borders(&mut self, light: Option<usize>) {
        let borders = self.borders.get_mut().unwrap_or_else(PoisonError::into_inner);
        borders.retain(|(of, _), _| light.is_some_and(|light| *of != light));
    }

    /// The parametrisation of an object; `None` if it has no area.
    pub fn parametrisation(&self, object: usize) -> Option<&Arc<Parametrisation>> {
        self.parametrisations[object]
            .get_or_init(|| {
                let mesh = self.scene.objects[object].mesh_in_scene();
                parametrise(object, mesh).map(Arc::new)
            })
            .as_ref()
    }

    /// Whether direct light can reach a receiver that is visible: the front of a surface, or the back of a double-sided
    /// one. The inside of a closed body is lit only by lights within its bounding box.
    pub fn may_see_lights(&self, receiver: Receiver) -> bool {
        let object = receiver.object();
        let material = self.scene.material_of(object);
        let is_seen = receiver.side() == Side::Front || material.double_sided;
        is_seen
            && material.surface.is_receiver()
            && (receiver.side() == Side::Front || !self.is_closed(object) || self.may_enclose_a_light(object))
    }

    fn is_closed(&self, object: usize) -> bool {
        *self.closed[object].get_or_init(|| is_closed(self.scene.objects[object].mesh_in_scene()))
    }

    fn may_enclose_a_light(&self, object: usize) -> bool {
        let Some((low, high)) = self.scene.objects[object].bounds() else {
            return false;
        };
        let overlaps = |(a, b): (DVec3, DVec3)| a.cmple(high).all() && b.cmpge(low).all();
        self.scene.lights.iter().any(|light| {
            let mesh_bounds = match light.kind {
                LightKind::Surface { object, .. } => self.scene.objects[object].bounds(),
                _ => None,
            };
            let place = light.kind.position().map(|position| (position, position));
            mesh_bounds.or(place).is_some_and(overlaps)
        })
    }

    /// A dense chart.
    pub fn chart(&self, receiver: Receiver, (width, height): (usize, usize)) -> Option<Arc<Chart>> {
        let is_it =
            |chart: &Arc<Chart>| chart.layout.is_none() && (chart.width, chart.height) == (width, height);
        self.cached(receiver, is_it, || {
            Some(self.parametrisation(receiver.object())?.chart(width, height))
        })
    }

    /// A chart of a size, dense or tiled.
    pub fn chart_of(&self, receiver: Receiver, size: &MapSize) -> Option<Arc<Chart>> {
        let Some(layout) = &size.layout else {
            return self.chart(receiver, size.size);
        };
        let is_same = |known: &Arc<TileLayout>| Arc::ptr_eq(known, layout) || known == layout;
        let is_it = |chart: &Arc<Chart>| chart.layout.as_ref().is_some_and(is_same);
        self.cached(receiver, is_it, || {
            self.parametrisation(receiver.object())?.tiled_chart(layout)
        })
    }

    fn cached(
        &self,
        receiver: Receiver,
        is_it: impl Fn(&Arc<Chart>) -> bool,
        make: impl FnOnce() -> Option<Chart>,
    ) -> Option<Arc<Chart>> {
        // Even after a panic under the lock, the charts in the map are complete.
        let all = || self.charts.lock().unwrap_or_else(PoisonError::into_inner);
        let find = |charts: &mut Vec<Arc<Chart>>| {
            let chart = charts.remove(charts.iter().position(&is_it)?);
            charts.push(Arc::clone(&chart));
            Some(chart)
        };
        if let Some(chart) = find(all().entry(receiver).or_default()) {
            return Some(chart);
        }
        let made = Arc::new(make()?.of_side(receiver.side()));
        let mut all = all();
        let charts = all.entry(receiver).or_default();
        // Another thread may have made it meanwhile.
        if let Some(chart) = find(charts) {
            return Some(chart);
        }
        if charts.len() == MAX_CHARTS {
            charts.remove(0);
        }
        charts.push(Arc::clone(&made));
        Some(made)
    }

    /// Number of doublings from the first size of a receiver's map until its texels are no larger than the mean
    /// footprint (section 3.1.1 of the paper) or detail, or until its longer side reaches `largest_side`. `None` if no
    /// footprint was seen.
    ///
    /// In a map without tiles, a detail on a small lit part costs fine texels everywhere. Of side h, they have an error
    /// proportional to h times that part, and their number is proportional to 1/h²: the sum of both is least where h³
    /// is inversely proportional to the part.
    pub fn doublings(
        &self,
        receiver: Receiver,
        statistics: &FootprintStatistics,
        largest_side: usize,
    ) -> Option<u32> {
        let footprint_share = statistics.mean(receiver)?.map_share;
        let is_tileable = self.parametrisation(receiver.object())?.is_uniform();
        let detail_share = statistics.detail(receiver).map_or(1.0, |detail| {
            let lit_share = if is_tileable { 1.0 } else { detail.lit_share };
            detail.map_share / lit_share.powf(2.0 / 3.0)
        });
        let share = footprint_share.min(detail_share);
        let (width, height) = self.doubled_size(receiver.object(), 0)?;
        let coarse = |times: u32| ((width * height) << (2 * times)) as f64 * share < 1.0;
        let small = |times: u32| width.max(height) << times < largest_side;
        (0..).find(|&times| !(coarse(times) && small(times)))
    }

    /// Number of doublings until direct light on an object's map is no coarser than on a map of its own.
    pub fn doublings_for_direct(&self, object: usize, settings: &BakeSettings) -> u32 {
        let sizes = self
            .direct_size(object, settings)
            .zip(self.doubled_size(object, 0));
        sizes.map_or(0, |((width, height), first)| {
            (0..)
                .find(|times| (first.0 << times) * (first.1 << times) >= width * height)
                .unwrap_or(0)
        })
    }

    /// The size of an object's map after a number of doublings.
    pub fn doubled_size(&self, object: usize, times: u32) -> Option<(usize, usize)> {
        let (width, height) = first_size(self.parametrisation(object)?.suggested_aspect);
        Some((width << times, height << times))
    }

    /// How often a map can be halved before direct light on it is coarser than on a map of its own, or than on a map of
    /// the first size: a caustic lies beside the shadow of its caster.
    pub fn direct_halvings(&self, object: usize, size: (usize, usize), settings: &BakeSettings) -> u32 {
        let halvings = |(width, height): (usize, usize)| {
            (size.0 / width).min(size.1 / height).checked_ilog2().unwrap_or(0)
        };
        let least = self
            .direct_size(object, settings)
            .zip(self.doubled_size(object, 0));
        least.map_or(0, |(own, first)| halvings(own).min(halvings(first)))
    }

    /// The size of a map that holds direct light only: texels of 1/400 of the scene's diagonal, or as requested.
    /// Objects that dwarf the others do not make those coarser.
    pub fn direct_size(&self, object: usize, settings: &BakeSettings) -> Option<(usize, usize)> {
        if let MapResolution::Fixed { width, height } = settings.map_resolution {
            return Some((width, height));
        }
        let (low, high) = self.scene.objects[object].bounds()?;
        let texel_m = low.distance(high).max(self.core_m()?) / 400.0;
        Some(self.map_surface(object)?.size(texel_m, 8))
    }

    /// A map of direct and indirect light only: texels of 1/400 of the scene's diagonal, or as requested; tiled if it
    /// has shadow borders.
    pub fn direct_wish(&self, receiver: Receiver, settings: &BakeSettings) -> Option<SizeRequest> {
        let size = self.direct_size(receiver.object(), settings)?;
        let doublings = self.border_doublings(receiver, settings);
        let Some(borders) = self.borders(receiver).filter(|_| doublings > 0) else {
            return Some(SizeRequest::dense(size));
        };
        let finest = (size.0 << doublings, size.1 << doublings);
        if !map_size::is_divisible(finest) {
            return Some(SizeRequest::dense(size));
        }
        let (columns, rows) = tile_counts(finest.0, finest.1);
        let mut tiles = vec![TileDemand::NOTHING; columns * rows];
        borders.refine(finest, 0, &mut tiles);
        Some(SizeRequest {
            is_even: false,
            tiles: Some(tiles),
            coarsest: doublings as u8,
            ..SizeRequest::dense(finest)
        })
    }

    /// Number of halvings of direct light's texels at the shadow borders of a receiver; 0 if it has none.
    pub fn border_doublings(&self, receiver: Receiver, settings: &BakeSettings) -> u32 {
        if settings.map_resolution != MapResolution::Auto || self.borders(receiver).is_none() {
            return 0;
        }
        let Some(size) = self.direct_size(receiver.object(), settings) else {
            return 0;
        };
        let most = (LARGEST_TILED_SIDE / size.0.max(size.1)).checked_ilog2();
        let doublings = border_doublings(settings) + self.smallness(receiver.object()).min(settings.detail());
        doublings.min(most.unwrap_or(0))
    }

    /// Half the number of doublings from an object's diagonal to the scene's: what is small is seen from nearer.
    fn smallness(&self, object: usize) -> u32 {
        let bounds = self.scene.objects[object].bounds();
        let ratio = bounds
            .zip(self.core_m())
            .map(|((low, high), core_m)| core_m / low.distance(high));
        ratio
            .filter(|ratio| ratio.is_finite())
            .map_or(0, |ratio| (0.5 * ratio.log2()) as u32)
    }

    fn core_m(&self) -> Option<f64> {
        *self.core_diagonal_m.get_or_init(|| self.scene.core_diagonal_m())
    }

    /// Shadow borders of all lights on a receiver; `None` if there are none.
    pub fn borders(&self, receiver: Receiver) -> Option<Borders> {
        let known = self.borders.lock().unwrap_or_else(PoisonError::into_inner);
        let of_receiver = known.iter().filter(|((_, of), _)| *of == receiver);
        let all = of_receiver.map(|(_, borders)| borders.clone());
        let all = all.reduce(|mut all, one| {
            let marks = all.marked.iter_mut().zip(one.marked);
            marks.for_each(|(mark, other)| *mark |= other);
            all
        });
        all.filter(|borders| borders.marked.contains(&true))
    }

    /// Finds shadow borders on surfaces whose maps can be tiled; returns the number of shadow rays traced.
    pub fn find_borders(&self, tracer: &Tracer, settings: &BakeSettings, control: &Control) -> u64 {
        // Maps of a fixed size do not become finer at shadow borders.
        if settings.map_resolution != MapResolution::Auto {
            return 0;
        }

        // A border only has to be found to within a tile: texels twice as long as those of direct light do.
        let is_tileable =
            |known: &Arc<Parametrisation>| known.is_uniform() && known.uv_set != UvSet::Generated;
        let may_be_tiled = |&receiver: &Receiver| {
            self.may_see_lights(receiver) && self.parametrisation(receiver.object()).is_some_and(is_tileable)
        };
        let charts: Vec<Arc<Chart>> = Receiver::all(self.scene.objects.len())
            .filter(may_be_tiled)
            .filter_map(|receiver| {
                let size = self.direct_size(receiver.object(), settings)?;
                self.chart(receiver, map_size::halved(size, 1))
            })
            .collect();

        // Borders are kept light by light, so that a light that moves leaves those of the others. Those of an
        // interrupted search are not kept.
        let mut shadow_rays = 0;
        for (light, source) in self.scene.lights.iter().enumerate() {
            let known = || self.borders.lock().unwrap_or_else(PoisonError::into_inner);
            let missing: Vec<&Chart> = {
                let known = known();
                let is_missing = |chart: &&Chart| !known.contains_key(&(light, chart.receiver));
                charts.iter().map(|chart| &**chart).filter(is_missing).collect()
            };
            let found = find_borders(tracer, &source.of_unit_strength(), &missing, control);
            let Some((found, rays)) = found else {
                break;
            };
            shadow_rays += rays;
            let found = missing.into_iter().zip(found).map(|(chart, marked)| {
                let size = (chart.width, chart.height);
                ((light, chart.receiver), Borders { size, marked })
            });
            known().extend(found);
        }
        shadow_rays
    }

    /// Sizes of the grids of indirect light, by receiver, with at most `most_texels` texels in all if that is possible,
    /// and for each no more than a requested map has.
    pub fn grid_sizes(&self, settings: &BakeSettings, most_texels: u64) -> Vec<(Receiver, (usize, usize))> {
        // Indirect light is interpolated on the map, so that a grid finer than a requested map gains nothing.
        let most_side = match settings.map_resolution {
            MapResolution::Auto => (usize::MAX, usize::MAX),
            MapResolution::Fixed { width, height } => (width, height),
        };
        let surfaces: Vec<(Receiver, MapSurface, f64)> = Receiver::all(self.scene.objects.len())
            .filter(|&receiver| self.may_see_lights(receiver))
            .filter_map(|receiver| {
                let object = receiver.object();
                Some((receiver, self.map_surface(object)?, self.grid_texel_m(object)?))
            })
            .collect();

        // All grids grow coarser by the same factor until they fit, which keeps their relative detail.
        let coarsened = |step: u32| -> Vec<(Receiver, (usize, usize))> {
            let factor = (f64::from(step) / GRID_STEPS).exp2();
            let least = (MIN_GRID_SIDE as f64 / factor) as usize;
            let size = |(receiver, surface, texel_m): &(Receiver, MapSurface, f64)| {
                let (width, height) = surface.size(factor * texel_m, least);
                (*receiver, (width.min(most_side.0), height.min(most_side.1)))
            };
            surfaces.iter().map(size).collect()
        };
        let texels = |sizes: &[(Receiver, (usize, usize))]| -> u64 {
            let texels = sizes.iter().map(|(_, (width, height))| (width * height) as u64);
            texels.sum()
        };

        // The last step is coarse enough for single texels.
        let last = 12 * GRID_STEPS as u32;
        let fitting = (0..last)
            .map(coarsened)
            .find(|sizes| texels(sizes) <= most_texels);
        fitting.unwrap_or_else(|| coarsened(last))
    }

    /// Texels of a grid of indirect light [m] before they are coarsened to fit: 1/200 of the diagonal of the scene's
    /// core for an object as large as that. What is small is seen from nearer, and has finer ones by the root of the
    /// ratio; what dwarfs the core, as a sky does, is seen from far away.
    fn grid_texel_m(&self, object: usize) -> Option<f64> {
        let (low, high) = self.scene.objects[object].bounds()?;
        let (own_m, core_m) = (low.distance(high), self.core_m()?);
        Some(own_m.max(core_m) * (own_m / core_m).sqrt() / 200.0)
    }

    fn map_surface(&self, object: usize) -> Option<MapSurface> {
        let parametrisation = self.parametrisation(object)?;
        Some(MapSurface {
            area_m2: parametrisation.area_m2(),
            aspect: parametrisation.suggested_aspect,
        })
    }
}

/// What a map of an object covers.
struct MapSurface {
    area_m2: f64,
    /// Width over height.
    aspect: f64,
}

impl MapSurface {
    /// The size of a map with texels of about a length [m]: powers of two from `least` to 1024.
    fn size(&self, texel_m: f64, least: usize) -> (usize, usize) {
        let texels = self.area_m2 / (texel_m * texel_m);
        let side = |wanted: f64| (wanted.max(least.max(1) as f64).log2().round().exp2() as usize).min(1024);
        (
            side((texels * self.aspect).sqrt()),
            side((texels / self.aspect).sqrt()),
        )
    }
}

/// Number of halvings of direct light's texels at shadow borders: down to 1/1,600 of the scene's diagonal for a draft,
/// to a half and a quarter of that for better presets, which add up to one and two for small objects.
fn border_doublings(settings: &BakeSettings) -> u32 {
    2 + settings.detail()
}

/// Steps from grids of indirect light to ones with texels twice as large.
const GRID_STEPS: f64 = 4.0;

/// Minimum side of a grid of indirect light, if there is room for it [texels].
const MIN_GRID_SIDE: usize = 8;

/// A size of about FIRST_SIDE² texels whose aspect ratio is a power of two, at most 8:1.
fn first_size(aspect: f64) -> (usize, usize) {
    let steps = aspect.log2().round().clamp(-3.0, 3.0) as i32;
    let stretch = |steps: i32| FIRST_SIDE << steps.max(0);
    (stretch(steps), stretch(-steps))
}
