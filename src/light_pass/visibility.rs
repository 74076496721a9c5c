//! Finds what each light sees, before any ray is traced.

use std::sync::{Arc, OnceLock};

use glam::{DMat2, DVec2, DVec3};
use rayon::prelude::*;

use super::pass_report::{Seconds, Stopwatch};
use crate::geometry::sampling::even_point;
use crate::light_pass::emitter::{Emitter, EmitterSampler};
use crate::light_pass::item_buffer::{HiddenCellPolicy, ItemBuffer};
use crate::light_pass::launch::Launch;
use crate::light_pass::photon::spheres::Spheres;
use crate::plan::{LightReach, SceneReach};
use crate::scene::{Light, LightKind, LightSize, Material, Scene};
use crate::settings::ItemBufferKind;
use crate::transport::{Tracer, media_at};

/// A light that sees a caster.
#[derive(Clone, Debug)]
pub struct VisibleLight {
    /// Index into `Scene::lights`.
    pub light: usize,
    /// Launch of its rays, as a white light of unit strength; the real one scales their flux.
    pub launch: Launch,
    /// Marks the cells worth tracing.
    pub item_buffer: Arc<ItemBuffer>,
    /// Cells in which light can matter; `None` if these are all of `item_buffer`.
    visible: Option<Arc<ItemBuffer>>,
    /// Distance from the casters' centre to their farthest receiver [m]: scales the ray density of suns.
    pub reach_m: f64,
    /// Specular objects that rays are aimed at from any point of the light (indices).
    casters: Arc<[usize]>,
    /// Spheres that photons are aimed at, for a light with extent; computed on first use.
    spheres: Arc<OnceLock<Spheres>>,
}

impl VisibleLight {
    /// Cells in which light can matter: those of the item buffer, or fewer with [`CullMode::Everything`].
    pub fn visible(&self) -> &ItemBuffer {
        self.visible.as_ref().unwrap_or(&self.item_buffer)
    }

    /// Whether rays start and are aimed as those of another light.
    pub fn aims_as(&self, other: &Self) -> bool {
        self.launch == other.launch
            && self.item_buffer.marks_as(&other.item_buffer)
            && self.visible().marks_as(other.visible())
            && self.casters == other.casters
    }

    /// Whether rays are aimed at an object that lies in a box [m], or at something before or behind it.
    pub fn is_aimed_at(&self, object: usize, bounds: (DVec3, DVec3), scene: &Scene) -> bool {
        let has_places = scene.lights[self.light].has_extent();
        (has_places && self.casters.contains(&object))
            || self.item_buffer.is_marked_towards(&self.launch, bounds)
    }

    /// Angular width of the light as its casters see it, in its narrowest direction and from the caster that sees it
    /// narrowest [rad]; 0 for the sky.
    pub fn width_rad(&self, scene: &Scene) -> f64 {
        let light = &scene.lights[self.light];
        if let LightSize::Angle { diameter_rad } = light.size {
            return diameter_rad;
        }
        let sampler = EmitterSampler::new(light, scene);
        let places = (0..WIDTH_PLACES).filter_map(|place| {
            let emitter = sampler.sample(even_point(place, 0, PLACES_SEED))?;
            emitter.kind.position()
        });
        let places: Vec<DVec3> = places.collect();
        let middle = places.iter().sum::<DVec3>() / places.len() as f64;
        let from_caster = |&caster: &usize| {
            let (low, high) = scene.objects[caster].bounds()?;
            let path = middle - low.midpoint(high);
            let (x, y) = path.try_normalize()?.any_orthonormal_pair();

            // The smaller eigenvalue of the places' covariance across the path; a line's length is the root of twelve
            // of its standard deviations.
            let across = places.iter().map(|place| *place - middle);
            let across = across.map(|offset| DVec2::new(offset.dot(x), offset.dot(y)));
            let moments = across.map(|at| DMat2::from_cols(at * at.x, at * at.y));
            let covariance = moments.sum::<DMat2>() * (places.len() as f64).recip();
            let half_trace = 0.5 * (covariance.x_axis.x + covariance.y_axis.y);
            let apart = (half_trace * half_trace - covariance.determinant())
                .max(0.0)
                .sqrt();
            Some((12.0 * (half_trace - apart).max(0.0)).sqrt() / path.length())
        };
        let narrowest = self
            .casters
            .iter()
            .filter_map(from_caster)
            .fold(f64::INFINITY, f64::min);
        if narrowest.is_finite() { narrowest } else { 0.0 }
    }

    /// Spheres that photons are aimed at from all points of the light; `source` is the light of unit strength.
    pub fn spheres(&self, tracer: &Tracer, source: &Light) -> &Spheres {
        self.spheres
            .get_or_init(|| Spheres::around(tracer, source, &self.casters))
    }

    /// Upper bound on the power that any point of the light sends [W], at unit strength.
    pub fn power_bound_w(&self, scene: &Scene) -> f64 {
        let own_w = self.launch.power_bound_w();
        if !self.launch.is_fitted() {
            return own_w;
        }
        // The rectangle around the casters depends on the direction of the light.
        let (low, high) = scene.bounds().unwrap_or_default();
        own_w.max(self.launch.emitter().strength.max_channel() * (high - low).length_squared())
    }

    /// The same light as if one of its points sent all of it; `None` if that point sends nothing to a caster.
    pub fn from_place(
        &self,
        tracer: &Tracer,
        (item_buffer, mode): (ItemBufferKind, CullMode),
        emitter: &Emitter,
    ) -> Option<Self> {
        let culler = EmissionCuller {
            tracer,
            item_buffer,
            mode,
        };
        let view = culler.view(emitter, &self.casters)?;
        (!view.item_buffer.casters.is_empty()).then(|| Self {
            launch: view.launch,
            item_buffer: Arc::new(view.item_buffer),
            visible: view.visible.map(Arc::new),
            ..self.clone()
        })
    }
}

/// Which specular objects are culled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CullMode {
    /// Those that are sealed off, hidden, or cannot send light to a diffuse object.
    Reachable,
    /// None: rays are aimed at all of them.
    Everything,
}

/// Cost and size of a light's item buffers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ItemBufferStats {
    /// Marked cells of the item buffer.
    pub cells: u64,
    /// Cells that opaque faces cover.
    pub hidden_cells: u64,
    /// Nodes, triangles and cells tested.
    pub tests: u64,
    pub seconds: Seconds,
}

/// What all lights see.
#[derive(Debug, Default)]
pub struct LightVisibility {
    /// Lights with at least one marked cell.
    pub lights: Vec<VisibleLight>,
    /// What each light of the scene sees.
    pub reaches: Vec<LightReach>,
    /// Cost for each light of the scene.
    pub item_buffers: Vec<ItemBufferStats>,
}

impl LightVisibility {
    /// Builds the item buffers of all lights, if the scene has both casters and receivers.
    ///
    /// `sizes`: whether lights have their extent, or shine from their middles.
    pub fn take(tracer: &Tracer, item_buffer: ItemBufferKind, mode: CullMode, sizes: bool) -> Self {
        let scene = tracer.scene();
        let has = |wanted: fn(&Material) -> bool| {
            (0..scene.objects.len()).any(|object| wanted(scene.material_of(object)))
        };
        let mut visibility = Self::default();
        if !has(Material::is_specular) || !has(|material| material.surface.is_receiver()) {
            visibility.reaches = vec![LightReach::default(); scene.lights.len()];
            visibility.item_buffers = vec![ItemBufferStats::default(); scene.lights.len()];
            return visibility;
        }
        let finder = ItemBufferBuilder {
            culler: EmissionCuller {
                tracer,
                item_buffer,
                mode,
            },
            sizes,
            reach: SceneReach::of(scene),
        };
        for light in 0..scene.lights.len() {
            let watch = Stopwatch::start();
            let (reach, visible_light, mut stats) = finder.find(light);
            stats.seconds = watch.elapsed();
            visibility.reaches.push(reach);
            visibility.item_buffers.push(stats);
            visibility.lights.extend(visible_light);
        }
        visibility
    }
}

impl LightVisibility {
    /// Nodes, triangles and cells tested for all lights.
    pub fn tests(&self) -> u64 {
        self.item_buffers.iter().map(|stats| stats.tests).sum()
    }
}

/// Sample points on a light with extent that determine what it sees.
const PLACES: u32 = 16;

/// Most sample points, tried while the first ones see nothing.
const MAX_PLACES: u32 = 256;

/// Points of a light whose spread tells its width.
const WIDTH_PLACES: u32 = 64;

/// Seed of the sample points.
const PLACES_SEED: u64 = 0;

/// Aims at casters from a point of a light.
struct EmissionCuller<'a> {
    tracer: &'a Tracer,
    item_buffer: ItemBufferKind,
    mode: CullMode,
}

/// What a point of a light sees.
struct View {
    launch: Launch,
    item_buffer: ItemBuffer,
    visible: Option<ItemBuffer>,
    /// Nodes, triangles and cells tested.
    tests: u64,
}

impl EmissionCuller<'_> {
    /// `casters`: specular objects that matter. `None` where there is nothing to aim at.
    fn view(&self, emitter: &Emitter, casters: &[usize]) -> Option<View> {
        let visible = self.at_reachable(emitter, casters);
        match self.mode {
            CullMode::Reachable => visible,
            CullMode::Everything => self.at_everything(emitter, visible),
        }
    }

    fn launch(&self, emitter: &Emitter, casters: &[usize]) -> Option<Launch> {
        let launch = Launch::new(emitter.clone(), self.tracer.scene(), casters, self.item_buffer)?;
        Some(match emitter.kind.position() {
            Some(position) => launch.within(media_at(self.tracer, position)),
            None => launch,
        })
    }

    fn at_reachable(&self, emitter: &Emitter, casters: &[usize]) -> Option<View> {
        let mut tests = 0;
        let mut build = |casters: &[usize]| {
            if casters.is_empty() {
                return None;
            }
            let launch = self.launch(emitter, casters)?;
            let item_buffer = ItemBuffer::build(&launch, self.tracer, casters, HiddenCellPolicy::Drop);
            tests += item_buffer.tests;
            Some((launch, item_buffer))
        };
        let (mut launch, mut item_buffer) = build(casters)?;
        // Casters that parallel light does not see must not enlarge its rectangle.
        if launch.is_fitted()
            && item_buffer.casters.len() < casters.len()
            && let Some(smaller) = build(&item_buffer.casters)
        {
            (launch, item_buffer) = smaller;
        }
        Some(View {
            launch,
            item_buffer,
            visible: None,
            tests,
        })
    }

    /// Uses the launch of the reachable casters, so that maps are the same; more cells are traced.
    fn at_everything(&self, emitter: &Emitter, visible: Option<View>) -> Option<View> {
        let specular = specular_objects(self.tracer.scene());
        let tests = visible.as_ref().map_or(0, |view| view.tests);
        let visible = visible.filter(|view| !view.item_buffer.casters.is_empty());
        let (launch, visible) = match visible {
            Some(view) => (view.launch, Some(view.item_buffer)),
            None => (self.launch(emitter, &specular)?, None),
        };
        let item_buffer = ItemBuffer::build(&launch, self.tracer, &specular, HiddenCellPolicy::Keep);
        Some(View {
            tests: tests + item_buffer.tests,
            launch,
            item_buffer,
            visible,
        })
    }
}

fn specular_objects(scene: &Scene) -> Vec<usize> {
    (0..scene.objects.len())
        .filter(|&object| scene.material_of(object).is_specular())
        .collect()
}

/// What all points of a light see together.
#[derive(Default)]
struct AllSeen {
    /// The first view with a caster, or the first view.
    first: Option<View>,
    seen: Vec<usize>,
    visibly: Vec<usize>,
    hidden_cells: u64,
    tests: u64,
}

impl AllSeen {
    fn add(&mut self, view: View) {
        self.tests += view.tests;
        self.hidden_cells = self.hidden_cells.max(view.item_buffer.hidden_cells);
        self.seen.extend(&view.item_buffer.casters);
        let visible = view.visible.as_ref().unwrap_or(&view.item_buffer);
        self.visibly.extend(&visible.casters);
        let is_blind = |first: &View| first.item_buffer.casters.is_empty();
        if self.first.as_ref().is_none_or(is_blind) {
            self.first = Some(view);
        }
    }
}

struct ItemBufferBuilder<'a> {
    culler: EmissionCuller<'a>,
    /// Whether lights have extent.
    sizes: bool,
    reach: SceneReach<'a>,
}

impl ItemBufferBuilder<'_> {
    fn find(&self, light: usize) -> (LightReach, Option<VisibleLight>, ItemBufferStats) {
        // A light with extent looks from several of its points; further ones are tried only while no caster is seen.
        let scene = self.culler.tracer.scene();
        let casters: Arc<[usize]> = self.reach.casters(light).into();
        let places = self.places(light);
        let (usual, more) = places.split_at(places.partition_point(|(place, _)| *place < PLACES));
        let view_from = |(_, emitter): &(u32, Emitter)| self.culler.view(emitter, &casters);
        let views: Vec<Option<View>> = usual.par_iter().map(view_from).collect();
        let mut all = AllSeen::default();
        views.into_iter().flatten().for_each(|view| all.add(view));
        for place in more {
            if !all.seen.is_empty() {
                break;
            }
            if let Some(view) = view_from(place) {
                all.add(view);
            }
        }

        // What any point sees, the light sees.
        let AllSeen {
            first,
            mut seen,
            mut visibly,
            hidden_cells,
            tests,
        } = all;
        let mut stats = ItemBufferStats {
            tests,
            ..ItemBufferStats::default()
        };
        for list in [&mut seen, &mut visibly] {
            list.sort_unstable();
            list.dedup();
        }

        // Without a caster in sight there is nothing to launch, but what was tested is reported all the same.
        let mut reach = self.reach(light, &casters, seen);
        let Some(view) = first else {
            return (reach, None, stats);
        };
        reach.hidden_cells = hidden_cells;
        stats.cells = view.item_buffer.marked_cells();
        stats.hidden_cells = hidden_cells;
        if reach.seen.is_empty() {
            return (reach, None, stats);
        }

        // The ray density of suns scales with the distance from the casters that light can matter to, to their farthest
        // receiver.
        let near = if visibly.is_empty() { &reach.seen } else { &visibly };
        let visible_light = VisibleLight {
            light,
            reach_m: reach_m(scene, near),
            launch: view.launch,
            item_buffer: Arc::new(view.item_buffer),
            visible: view.visible.map(Arc::new),
            casters,
            spheres: Arc::default(),
        };
        (reach, Some(visible_light), stats)
    }

    fn reach(&self, light: usize, casters: &[usize], seen: Vec<usize>) -> LightReach {
        match self.culler.mode {
            CullMode::Reachable => LightReach {
                unsealed: self.reach.unsealed(light).len(),
                casters: casters.len(),
                reached: self.reach.reached(light, &seen),
                seen,
                ..LightReach::default()
            },
            CullMode::Everything => {
                let specular = specular_objects(self.culler.tracer.scene());
                LightReach {
                    unsealed: specular.len(),
                    casters: specular.len(),
                    reached: specular.iter().map(|&object| (object, None)).collect(),
                    seen,
                    ..LightReach::default()
                }
            }
        }
    }

    /// Emitters to look from: several sample points of a light with extent, otherwise its only one. All points of a
    /// surface light with an image get its mean radiance: any of them may represent its power, and may be black.
    fn places(&self, light: usize) -> Vec<(u32, Emitter)> {
        let scene = self.culler.tracer.scene();
        let source = scene.lights[light].of_unit_strength();
        let sampler = EmitterSampler::new(&source, scene);
        if !(self.sizes && source.has_extent()) {
            return sampler.middle().map(|middle| (0, middle)).into_iter().collect();
        }
        let is_surface = matches!(source.kind, LightKind::Surface { .. });
        let mean = sampler.middle().filter(|_| is_surface);
        let mean = mean.map(|middle| middle.strength);
        let places = (0..MAX_PLACES).filter_map(|place| {
            let emitter = sampler.sample(even_point(place, 0, PLACES_SEED))?;
            let strength = mean.unwrap_or(emitter.strength);
            Some((place, Emitter { strength, ..emitter }))
        });
        places.collect()
    }
}

fn bounds_of(scene: &Scene, objects: &[usize]) -> Option<(DVec3, DVec3)> {
    objects
        .iter()
        .filter_map(|&object| scene.objects[object].bounds())
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Never zero for casters with extent: at least their own radius [m].
fn reach_m(scene: &Scene, casters: &[usize]) -> f64 {
    let Some((low, high)) = bounds_of(scene, casters) else {
        return 1.0;
    };
    let centre = low * 0.5 + high * 0.5;
    let own = (high - centre).length();
    let farthest = (0..scene.objects.len())
        .filter(|&object| scene.material_of(object).surface.is_receiver())
        .flat_map(|object| &scene.objects[object].mesh_in_scene().positions)
        .map(|position| position.distance(centre))
        .fold(own, f64::max);
    if farthest > 0.0 { farthest } else { 1.0 }
}
