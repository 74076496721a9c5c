//! Traces one light ray with its derivatives through every relevant specular surface.

use glam::{DVec2, DVec3};

use super::bumps::BumpCells;
use super::edge_search::EdgeSearch;
use super::kept_rays::{CachedHit, CachedRay, RayCache, RayKey, TracedRay};
use super::lattice_ray::{LatticeRay, PathSegment, SegmentEnd, SurfaceFluxRecord};
use super::spectrum::LightPart;
use crate::geometry::Ray;
use crate::illumination::{Receiver, Side};
use crate::light_pass::launch::Launch;
use crate::light_pass::path::{PathLimits, PathSignature};
use crate::optics::LinearSrgb;
use crate::progress::Control;
use crate::transport::{
    Branch, Event, Interaction, MediumStack, RayDerivative, RayDifferential, RayHit, SurfaceDetail,
    SurfaceHit, SurfaceScale, Tracer,
};

/// Most branches of one light ray: a closed mirror box with glass inside would double them without end.
const MAX_BRANCHES: usize = 512;

/// Rays start at least this far inside the border of the unit square.
const DOMAIN_MARGIN: f64 = 1e-9;

/// Traces light rays of one light.
#[derive(Clone, Copy, Debug)]
pub struct StrandTracer<'a> {
    pub tracer: &'a Tracer,
    pub launch: &'a Launch,
    pub limits: PathLimits,
    /// Distance between neighbouring rays, in units of the unit square.
    pub steps: [f64; 2],
    pub bumps: BumpCells,
    /// Number of the wavelength of a spectral light; `None` for RGB.
    pub wavelength: Option<u32>,
    /// Rays traced before.
    pub kept: Option<&'a RayCache>,
    /// How closely borders are searched for.
    pub closeness: EdgeSearch,
    /// Checked for cancellation: rays then end at once, and their results are to be discarded.
    pub control: &'a Control,
}

/// A ray that waits to be traced.
#[derive(Clone, Copy, Debug)]
struct QueuedRay {
    ray: Ray,
    differential: RayDifferential,
    flux_w: LinearSrgb,
    media: MediumStack,
    signature: PathSignature,
    depth: u32,
    /// Index of its segment; `None` for the light's own ray.
    segment: Option<usize>,
    /// Whether it is identical to a ray in the cache, where there is one.
    is_known: bool,
    /// Whether no dispersive surface has refracted it yet, so that it is the same at all wavelengths.
    is_common: bool,
}

/// Hits of a light ray, from the cache or from queries.
struct Search<'a> {
    known: Option<CachedRay<'a>>,
    /// Hits of the same light ray at another wavelength.
    common: &'a [CachedHit],
    hits: Vec<CachedHit>,
    /// Closest-hit queries.
    searches: u32,
}

impl<'a> StrandTracer<'a> {
    /// Without a ray cache; `steps`: distance between neighbouring rays, in units of the unit square.
    pub fn new(
        tracer: &'a Tracer,
        launch: &'a Launch,
        limits: PathLimits,
        steps: [f64; 2],
        control: &'a Control,
    ) -> Self {
        Self {
            tracer,
            launch,
            limits,
            steps,
            bumps: BumpCells::EXACT,
            wavelength: None,
            kept: None,
            closeness: EdgeSearch::SHARP,
            control,
        }
    }

    /// Replaces how closely borders are searched for.
    #[must_use]
    pub fn with_closeness(self, closeness: EdgeSearch) -> Self {
        Self { closeness, ..self }
    }

    /// The same tracer at one wavelength of a light.
    #[must_use]
    pub fn at_node(&self, part: LightPart<'a>, node: usize) -> Self {
        match part.node(node) {
            Some(node) => Self {
                tracer: &node.tracer,
                wavelength: Some(node.number),
                ..*self
            },
            None => *self,
        }
    }

    /// Traces the ray that starts at a point of a face's unit square.
    pub fn trace(&self, face: usize, square: DVec2) -> LatticeRay {
        self.follow(face, square, None)
    }

    /// Traces a ray again at another wavelength. Segments before the first dispersive surface need no queries.
    pub fn trace_again(&self, face: usize, other: &LatticeRay) -> LatticeRay {
        self.follow(face, other.square, other.fresh.as_deref())
    }

    fn follow(&self, face: usize, square: DVec2, other: Option<&TracedRay>) -> LatticeRay {
        let mut sample = LatticeRay {
            square,
            ..LatticeRay::default()
        };
        // Just within the domain, whose border may coincide with that of a surface.
        let square = square.clamp(DVec2::splat(DOMAIN_MARGIN), DVec2::splat(1.0 - DOMAIN_MARGIN));
        if self.control.is_cancelled() {
            return sample;
        }
        let key = RayKey::new(face, self.wavelength.unwrap_or(0), square);
        let mut search = Search {
            known: self.kept.and_then(|kept| kept.get(&key)),
            common: other.map_or(&[], |other| &other.hits),
            hits: Vec::new(),
            searches: 0,
        };
        let (ray, differential) = self.launch.ray_with_differential(face, square);
        let flux_w = self.launch.flux_density_w(square, ray.direction);
        if !(flux_w.is_finite() && flux_w.max_channel() > 0.0) {
            return sample;
        }
        let floor_w = flux_w.luminance() * self.limits.branch_threshold;
        let mut waiting = vec![QueuedRay {
            ray,
            differential,
            flux_w,
            media: *self.launch.media(),
            signature: PathSignature::default(),
            depth: 0,
            segment: None,
            is_known: search.known.is_some(),
            is_common: other.is_some(),
        }];
        while let Some(next) = waiting.pop() {
            self.step(next, floor_w, &mut search, &mut sample, &mut waiting);
        }
        sample.queries = search.searches;
        if search.searches > 0 {
            sample.fresh = Some(Box::new(TracedRay {
                key,
                hits: search.hits.into_boxed_slice(),
            }));
        }
        sample.segments.sort_by_key(|segment| segment.signature);
        sample.nodes.sort_by_key(|node| node.signature);
        sample.brightest_w = sample
            .segments
            .iter()
            .map(|segment| segment.flux_w.luminance())
            .fold(0.0, f64::max);
        sample
    }

    fn step(
        &self,
        from: QueuedRay,
        floor_w: f64,
        search: &mut Search,
        sample: &mut LatticeRay,
        waiting: &mut Vec<QueuedRay>,
    ) {
        let (place, is_known) = search.closest(self.tracer, &from);
        let from = &QueuedRay { is_known, ..from };
        let Some(hit) = place.map(|place| self.tracer.surface_at(&place)) else {
            if from.segment.is_none() {
                sample.not_emitted = from.flux_w;
            }
            return;
        };
        let material = self.tracer.scene().material_of(hit.object);
        match from.segment {
            Some(segment) => {
                sample.segments[segment].landing = landing(
                    &hit,
                    sample.segments[segment].ray.direction,
                    material.surface.is_receiver(),
                );
            }
            None => sample.stopped_m = material.is_opaque().then_some(hit.distance_m),
        }
        if !material.surface.is_specular() {
            if from.segment.is_none() {
                sample.not_emitted = from.flux_w;
            }
            return;
        }
        let effects = self.limits.effects;
        let mut incident = from.flux_w;
        if effects.absorption && from.media.absorbs(self.tracer.scene()) {
            let transmittance = from.media.transmittance(self.tracer.scene(), hit.distance_m);
            incident = incident * transmittance;
        }
        let interaction = self
            .tracer
            .interact_with(effects, &hit, from.ray.direction, &from.media, None);
        self.scatter(from, &hit, incident, &interaction, floor_w, sample, waiting);
    }

    #[allow(clippy::too_many_arguments, reason = "one call site; a hit is made of this")]
    fn scatter(
        &self,
        from: &QueuedRay,
        hit: &SurfaceHit,
        incident: LinearSrgb,
        interaction: &Interaction,
        floor_w: f64,
        sample: &mut LatticeRay,
        waiting: &mut Vec<QueuedRay>,
    ) {
        let moved_smooth = self
            .tracer
            .transfer(&from.ray, hit, &from.differential, SurfaceScale::Smooth);
        let scale = self.tracer.surface_scale(hit, &moved_smooth, self.steps);
        let at_hit = match scale {
            SurfaceScale::Smooth => moved_smooth,
            SurfaceScale::Facet => {
                self.tracer
                    .transfer(&from.ray, hit, &from.differential, SurfaceScale::Facet)
            }
        };
        let is_too_fine = self.is_too_fine(hit, &at_hit, sample);
        let is_dispersive = self.tracer.scene().material_of(hit.object).is_dispersive();
        let group = self.tracer.smoothing_group(hit.object, hit.triangle);
        let at_surface = from.signature.at(hit.object, group);
        // Patches book absorption between surfaces; before the first surface there is no patch.
        let taken_before = match from.segment {
            Some(_) => LinearSrgb::BLACK,
            None => from.flux_w - incident,
        };
        let mut node = SurfaceFluxRecord {
            signature: at_surface,
            first: from.segment.is_none(),
            incident: incident + taken_before,
            absorbed: incident * interaction.absorbed + taken_before,
            depth: LinearSrgb::BLACK,
            threshold: LinearSrgb::BLACK,
            unresolved: LinearSrgb::BLACK,
            non_finite: LinearSrgb::BLACK,
            switched_off: incident * interaction.switched_off,
            taken: incident * interaction.deposit,
        };
        for branch in [interaction.reflection, interaction.transmission]
            .into_iter()
            .flatten()
        {
            let flux_w = incident * branch.share;
            if flux_w.max_channel() <= 0.0 {
                continue;
            }
            let ray = branch.ray;
            if !(flux_w.is_finite() && ray.direction.is_finite() && ray.origin.is_finite()) {
                let finite = flux_w.map(|w| if w.is_finite() { w } else { 0.0 });
                node.non_finite += finite;
            } else if from.depth + 1 > self.limits.max_depth {
                node.depth += flux_w;
            } else if flux_w.luminance() < floor_w {
                node.threshold += flux_w;
            } else if sample.segments.len() >= MAX_BRANCHES {
                node.unresolved += flux_w;
            } else {
                let surface = if is_too_fine {
                    SurfaceDetail::Mesh
                } else {
                    SurfaceDetail::Bumps
                };
                let differential = self.tracer.differential_after(
                    from.ray.direction,
                    hit,
                    &at_hit,
                    &branch,
                    (scale, surface),
                );
                let signature = at_surface.event(branch.event);
                push(
                    from,
                    (hit.object as u32, group),
                    &branch,
                    flux_w,
                    differential,
                    signature,
                    is_dispersive,
                    sample,
                    waiting,
                );
            }
        }
        sample.nodes.push(node);
    }

    /// Records the lattice resolution that a surface's bumps require, and returns whether no cell is fine enough for
    /// them.
    fn is_too_fine(&self, hit: &SurfaceHit, at_hit: &RayDifferential, sample: &mut LatticeRay) -> bool {
        let detail_m = self.tracer.finest_bump_m(hit.object);
        if detail_m == f64::INFINITY {
            return false;
        }
        let wanted = self.bumps.wanted(at_hit, detail_m);
        let is_too_fine = self.bumps.is_too_fine(wanted, self.steps);
        sample.bump_cells = sample.bump_cells.max(wanted);
        sample.is_rough |= is_too_fine;
        is_too_fine
    }
}

#[allow(
    clippy::too_many_arguments,
    reason = "one call site; a segment is made of this"
)]
fn push(
    from: &QueuedRay,
    surface: (u32, u32),
    branch: &Branch,
    flux_w: LinearSrgb,
    differential: RayDifferential,
    signature: PathSignature,
    is_dispersive: bool,
    sample: &mut LatticeRay,
    waiting: &mut Vec<QueuedRay>,
) {
    waiting.push(QueuedRay {
        ray: branch.ray,
        differential,
        flux_w,
        media: branch.media,
        signature,
        depth: from.depth + 1,
        segment: Some(sample.segments.len()),
        is_known: from.is_known,
        is_common: from.is_common && (!is_dispersive || branch.event == Event::Reflection),
    });
    sample.segments.push(PathSegment {
        signature,
        ray: branch.ray,
        differential,
        flux_w,
        media: branch.media,
        from: surface.0,
        from_group: surface.1,
        landing: SegmentEnd::Escaped,
    });
}

impl Search<'_> {
    /// Where a segment ends, and whether its continuation is identical to the one in the cache.
    fn closest(&mut self, tracer: &Tracer, from: &QueuedRay) -> (Option<RayHit>, bool) {
        let known = self.known.filter(|_| from.is_known);
        let kept = known.and_then(|known| known.hit(from.signature));
        let common = || {
            let mut met = self.common.iter().filter(|_| from.is_common);
            met.find(|hit| hit.signature == from.signature)
        };
        let place = match (known, kept) {
            (Some(known), Some(kept)) if known.holds(&from.ray, kept) => kept,
            _ if let Some(hit) = common() => hit.place,
            _ => {
                self.searches += 1;
                tracer.intersect(&from.ray)
            }
        };
        let is_known = kept == Some(place)
            && known.is_some_and(|known| place.is_none_or(|place| known.leaves_alike(place.object)));
        self.hits.push(CachedHit {
            signature: from.signature,
            place,
        });
        (place, is_known)
    }
}

fn landing(hit: &SurfaceHit, direction: DVec3, is_receiver: bool) -> SegmentEnd {
    if is_receiver {
        SegmentEnd::Receiver {
            receiver: Receiver::new(hit.object, Side::met(direction, hit.geometric_normal)),
            triangle: hit.triangle as u32,
            barycentric: DVec2::new(hit.barycentric[1], hit.barycentric[2]),
            distance_m: hit.distance_m,
        }
    } else {
        SegmentEnd::Specular {
            object: hit.object as u32,
            distance_m: hit.distance_m,
        }
    }
}

impl Launch {
    /// The ray of a point of the domain with its derivatives by the coordinates of the unit square, from central
    /// differences: accurate to some 1e-9 in double precision, far below the error of any surface's derivatives.
    fn ray_with_differential(&self, face: usize, square: DVec2) -> (Ray, RayDifferential) {
        const STEP: f64 = 1e-5;
        let derivative = |step: DVec2| {
            let (before, after) = (self.ray(face, square - step), self.ray(face, square + step));
            RayDerivative {
                origin: (after.origin - before.origin) / (2.0 * STEP),
                direction: (after.direction - before.direction) / (2.0 * STEP),
            }
        };
        let differential = RayDifferential {
            across: derivative(DVec2::new(STEP, 0.0)),
            down: derivative(DVec2::new(0.0, STEP)),
        };
        (self.ray(face, square), differential)
    }
}
